// A box [0, x] x [0, y] x [0, z] in metres: for first trials and for comparison with closed forms.
//
// Volume "box"; surfaces "left", "right" (x = 0, x), "front", "back" (y = 0, y), "bottom", "top" (z = 0, z).
// Hexahedra, or with tetrahedra = 1 tetrahedra, in a structured mesh.
//
// Use:  ffr-prep reduce meshes/box.geo --set x=2 --set nx=20 --material steel ...

SetFactory("OpenCASCADE");

DefineConstant[
  x = 1, y = 0.1, z = 0.1,    // edges
  nx = 10, ny = 2, nz = 2,    // number of elements along them
  tetrahedra = 0
];

// Swept layer by layer: point, edge, face, box.
Point(1) = {0, 0, 0};
edge() = Extrude {0, y, 0} { Point{1}; Layers{ny}; };
If (tetrahedra)
  face() = Extrude {0, 0, z} { Curve{edge(1)}; Layers{nz}; };
  box() = Extrude {x, 0, 0} { Surface{face(1)}; Layers{nx}; };
Else
  face() = Extrude {0, 0, z} { Curve{edge(1)}; Layers{nz}; Recombine; };
  box() = Extrude {x, 0, 0} { Surface{face(1)}; Layers{nx}; Recombine; };
EndIf

Physical Volume("box") = {box(1)};
eps = 1e-6 * (x + y + z);
left() = Surface In BoundingBox{-eps, -eps, -eps, eps, y + eps, z + eps};
right() = Surface In BoundingBox{x - eps, -eps, -eps, x + eps, y + eps, z + eps};
front() = Surface In BoundingBox{-eps, -eps, -eps, x + eps, eps, z + eps};
back() = Surface In BoundingBox{-eps, y - eps, -eps, x + eps, y + eps, z + eps};
bottom() = Surface In BoundingBox{-eps, -eps, -eps, x + eps, y + eps, eps};
top() = Surface In BoundingBox{-eps, -eps, z - eps, x + eps, y + eps, z + eps};
Physical Surface("left") = {left()};
Physical Surface("right") = {right()};
Physical Surface("front") = {front()};
Physical Surface("back") = {back()};
Physical Surface("bottom") = {bottom()};
Physical Surface("top") = {top()};
