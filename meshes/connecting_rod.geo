// A connecting rod of a piston engine, in millimetres.
//
// The big eye lies around the origin, the small eye around (length, 0, 0); both bores have the axis z. The shank has an
// I-section: a web between two flanges, milled out from both sides. The corners where the shank meets the eyes are
// rounded. Volume "rod"; surfaces "big_eye" and "small_eye" are the bores, in which the crank pin and the piston pin
// sit.
//
// Use:  ffr-prep reduce meshes/connecting_rod.geo --unit mm --set length=180 --material steel ...

SetFactory("OpenCASCADE");

DefineConstant[
  length = 150,          // between the axes of the bores
  big_bore = 48,         // diameters
  big_outer = 70,
  small_bore = 22,
  small_outer = 38,
  thickness = 22,        // of the eyes, along z
  shank_width = 26,      // along y
  shank_thickness = 16,  // along z
  web = 5,               // along z
  flange = 5,            // along y
  corner = 8,            // radius between shank and eyes
  pocket_corner = 5,     // radius in the pockets
  size = 10              // largest element edge
];

// Shank and eyes, still without bores and pockets.
Box(1) = {0, -shank_width / 2, -shank_thickness / 2, length, shank_width, shank_thickness};
Cylinder(2) = {0, 0, -thickness / 2, 0, 0, thickness, big_outer / 2};
Cylinder(3) = {length, 0, -thickness / 2, 0, 0, thickness, small_outer / 2};
blank() = BooleanUnion{ Volume{1}; Delete; }{ Volume{2, 3}; Delete; };

// The four edges along z where the shank meets the eyes.
eps = 1e-3;
big_x = Sqrt((big_outer^2 - shank_width^2) / 4);
small_x = length - Sqrt((small_outer^2 - shank_width^2) / 4);
corners() = {};
For k In {0 : 3}
  x = (k < 2) ? big_x : small_x;
  y = (k % 2) ? shank_width / 2 : -shank_width / 2;
  corners() += Curve In BoundingBox{x - eps, y - eps, -shank_thickness / 2 - eps,
                                    x + eps, y + eps, shank_thickness / 2 + eps};
EndFor
rounded() = Fillet{blank(0)}{corners()}{corner};

// Bores, and a pocket on either side that leaves the web.
Cylinder(101) = {0, 0, -thickness, 0, 0, 2 * thickness, big_bore / 2};
Cylinder(102) = {length, 0, -thickness, 0, 0, 2 * thickness, small_bore / 2};
start = big_outer / 2 + pocket_corner;
end = length - small_outer / 2 - pocket_corner;
width = shank_width - 2 * flange;
Rectangle(1001) = {start, -width / 2, web / 2, end - start, width, pocket_corner};
Rectangle(1002) = {start, -width / 2, -web / 2, end - start, width, pocket_corner};
upper() = Extrude {0, 0, shank_thickness} { Surface{1001}; };
lower() = Extrude {0, 0, -shank_thickness} { Surface{1002}; };
rod() = BooleanDifference{ Volume{rounded(0)}; Delete; }{ Volume{101, 102, upper(1), lower(1)}; Delete; };
Recursive Delete { Surface{1001, 1002}; }

Physical Volume("rod") = {rod()};
reach = thickness / 2 + eps;
big() = Surface In BoundingBox{-big_bore / 2 - eps, -big_bore / 2 - eps, -reach,
                               big_bore / 2 + eps, big_bore / 2 + eps, reach};
small() = Surface In BoundingBox{length - small_bore / 2 - eps, -small_bore / 2 - eps, -reach,
                                 length + small_bore / 2 + eps, small_bore / 2 + eps, reach};
Physical Surface("big_eye") = {big()};
Physical Surface("small_eye") = {small()};

Mesh.MeshSizeMax = size;
Mesh.MeshSizeFromCurvature = 12;  // elements per turn
