// A portal frame of two columns and a beam in the xy plane, with a diagonal brace, in metres.
//
// Curves "columns", "beam" and "brace"; points "left_foot", "right_foot" and "load" (the middle of the beam).
// Beams have no thickness here: their sections are given when the frame is read.

SetFactory("Built-in");

DefineConstant[
  height = 2.0,
  span = 3.0,
  size = 0.5      // element length
];

Point(1) = {0, 0, 0, size};
Point(2) = {0, height, 0, size};
Point(3) = {span / 2, height, 0, size};
Point(4) = {span, height, 0, size};
Point(5) = {span, 0, 0, size};
Line(1) = {1, 2};
Line(2) = {2, 3};
Line(3) = {3, 4};
Line(4) = {5, 4};
Line(5) = {1, 3};

Physical Curve("columns") = {1, 4};
Physical Curve("beam") = {2, 3};
Physical Curve("brace") = {5};
Physical Point("left_foot") = {1};
Physical Point("right_foot") = {5};
Physical Point("load") = {3};
