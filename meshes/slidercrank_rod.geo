// The connecting rod of a slider-crank mechanism: a round bar 0.3 m long, 6 mm in diameter, in metres.
//
// It lies along x from the crank pin at the origin. Volume "rod"; surfaces "crankpin" (x = 0) and "slider" (x = length).
// A structured mesh of hexahedra with a square core: second-order ones follow the circle.
//
// Use:  ffr-prep reduce meshes/slidercrank_rod.geo --material E=2e11,nu=0.3,rho=7870 ...

SetFactory("Built-in");

DefineConstant[
  length = 0.3,
  diameter = 0.006,
  along = 30,    // number of elements along the rod
  around = 2,    // along a quarter of the circle
  core = 0.45    // diagonal of the square core over the diameter
];

radius = diameter / 2;
Point(1) = {0, 0, 0};
For k In {0 : 3}
  angle = Pi / 4 + k * Pi / 2;
  Point(10 + k) = {0, core * radius * Cos(angle), core * radius * Sin(angle)};
  Point(20 + k) = {0, radius * Cos(angle), radius * Sin(angle)};
EndFor
For k In {0 : 3}
  next = (k + 1) % 4;
  Line(10 + k) = {10 + k, 10 + next};
  Circle(20 + k) = {20 + k, 1, 20 + next};
  Line(30 + k) = {10 + k, 20 + k};
EndFor
Curve Loop(1) = {10, 11, 12, 13};
Plane Surface(1) = {1};
For k In {0 : 3}
  next = (k + 1) % 4;
  Curve Loop(10 + k) = {30 + k, 20 + k, -(30 + next), -(10 + k)};
  Plane Surface(10 + k) = {10 + k};
EndFor

Transfinite Curve {10 : 13, 20 : 23} = around + 1;
Transfinite Curve {30 : 33} = 2;
Transfinite Surface {1, 10 : 13};
Recombine Surface {1, 10 : 13};

volumes() = {};
ends() = {};
For s In {0 : 4}
  surface = (s == 0) ? 1 : 9 + s;
  swept() = Extrude {length, 0, 0} { Surface{surface}; Layers{along}; Recombine; };
  ends() += swept(0);
  volumes() += swept(1);
EndFor

Physical Volume("rod") = {volumes()};
Physical Surface("crankpin") = {1, 10 : 13};
Physical Surface("slider") = {ends()};
