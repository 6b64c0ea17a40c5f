// A cylinder across a box, with a gap of 20 mm to its sides in x: to be shifted and turned. Lengths in millimetres.
// rotor.msh: gmsh -3 -format msh41 rotor.geo

SetFactory("OpenCASCADE");

radius = 10;
half_length = 15;
half = 30;                  // of the box

Box(1) = {-half, -half, -half, 2*half, 2*half, 2*half};
Cylinder(2) = {0, 0, -half_length, 0, 0, 2*half_length, radius};
BooleanFragments{ Volume{1}; Delete; }{ Volume{2}; Delete; }

e = 0.01;
rotor() = Volume In BoundingBox{-radius-e, -radius-e, -half_length-e, radius+e, radius+e, half_length+e};
air() = Volume{:};
air() -= rotor();
outer() = Abs(CombinedBoundary{ Volume{:}; });
rotor_surface() = Abs(Boundary{ Volume{rotor()}; });

Physical Volume("rotor") = rotor();
Physical Volume("air") = air();
Physical Surface("rotor_surface") = rotor_surface();
Physical Surface("outer") = outer();

Mesh.MeshSizeMin = 4;
Mesh.MeshSizeMax = 6;
Mesh.Algorithm3D = 1;
Mesh.Optimize = 1;
Mesh.OptimizeNetgen = 1;
