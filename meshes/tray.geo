// A tray: a floor and two walls of sheet, stiffened by beams along two of its edges. Metres.
DefineConstant[ length = {0.6, Name "length of the tray [m]"}, width = {0.3, Name "width [m]"},
                height = {0.1, Name "height of the walls [m]"}, h = {0.05, Name "element size [m]"} ];
Point(1) = {0, 0, 0, h};            Point(2) = {length, 0, 0, h};
Point(3) = {length, width, 0, h};   Point(4) = {0, width, 0, h};
Point(5) = {0, 0, height, h};       Point(6) = {length, 0, height, h};
Point(7) = {length, width, height, h};  Point(8) = {0, width, height, h};
Line(1) = {1, 2};  Line(2) = {2, 3};  Line(3) = {3, 4};  Line(4) = {4, 1};
Line(5) = {1, 5};  Line(6) = {5, 6};  Line(7) = {6, 2};
Line(8) = {4, 8};  Line(9) = {8, 7};  Line(10) = {7, 3};
Curve Loop(1) = {1, 2, 3, 4};      Plane Surface(1) = {1};
Curve Loop(2) = {5, 6, 7, -1};     Plane Surface(2) = {2};
Curve Loop(3) = {8, 9, 10, 3};     Plane Surface(3) = {3};
Transfinite Surface {2, 3};        Recombine Surface {2, 3};
Physical Surface("floor") = {1};   Physical Surface("walls") = {2, 3};
Physical Curve("rims") = {6, 9};
Physical Curve("front") = {4, 5, 8};  Physical Curve("rear") = {2, 7, 10};
