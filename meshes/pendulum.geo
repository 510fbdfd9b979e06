// A flexible pendulum: a plate strip 1.2 m long, 9 mm thick and 0.2 m wide, in metres.
//
// It lies along x from the hinge at x = 0, centred about the x axis, thin along y and wide along z, so that it swings and
// bends in the plane x-y. Volume "rod"; surfaces "hinge" (x = 0) and "tip" (x = length).
// A structured mesh of hexahedra, one layer through the thickness: with 27 nodes each they bend without locking.
//
// Use:  ffr-prep reduce meshes/pendulum.geo --material E=7e10,nu=0.3,rho=5540 ...

SetFactory("OpenCASCADE");

DefineConstant[
  length = 1.2,     // along x
  thickness = 0.009,  // along y
  width = 0.2,      // along z
  along = 32,       // number of elements
  across = 4,
  layers = 1
];

Point(1) = {0, -thickness / 2, -width / 2};
depth() = Extrude {0, thickness, 0} { Point{1}; Layers{layers}; };
face() = Extrude {0, 0, width} { Curve{depth(1)}; Layers{across}; Recombine; };
strip() = Extrude {length, 0, 0} { Surface{face(1)}; Layers{along}; Recombine; };

Physical Volume("rod") = {strip(1)};
Physical Surface("hinge") = {face(1)};
Physical Surface("tip") = {strip(0)};
