// A rod core in a coil, upper half: z = 0 is the plane of symmetry. Lengths in millimetres.
// inductor.msh: gmsh -3 -format msh41 inductor.geo

SetFactory("OpenCASCADE");

core_radius = 12;
core_end = 30;              // half length
gap_radius = 21;            // of the air that follows the core's end face
gap_end = 60;
coil_inner = 24;
coil_outer = 32;
coil_end = 20;              // half length
outer_radius = 200;

Cylinder(1) = {0, 0, 0, 0, 0, core_end, core_radius};
Cylinder(2) = {0, 0, 0, 0, 0, gap_end, gap_radius};
Cylinder(3) = {0, 0, 0, 0, 0, coil_end, coil_outer};
Cylinder(4) = {0, 0, 0, 0, 0, coil_end, coil_inner};
BooleanDifference(5) = { Volume{3}; Delete; }{ Volume{4}; Delete; };
Sphere(6) = {0, 0, 0, outer_radius, 0, Pi/2, 2*Pi};
v() = BooleanFragments{ Volume{6}; Delete; }{ Volume{1, 2, 5}; Delete; };

e = 0.01;
core() = Volume In BoundingBox{-core_radius-e, -core_radius-e, -e, core_radius+e, core_radius+e, core_end+e};
gap() = Volume In BoundingBox{-gap_radius-e, -gap_radius-e, -e, gap_radius+e, gap_radius+e, gap_end+e};
gap() -= core();
coil() = Volume In BoundingBox{-coil_outer-e, -coil_outer-e, -e, coil_outer+e, coil_outer+e, coil_end+e};
coil() -= core();
all() = Volume{:};
air() = all();
air() -= core();
air() -= gap();
air() -= coil();

skin() = CombinedBoundary{ Volume{:}; };
middle() = Surface In BoundingBox{-outer_radius-e, -outer_radius-e, -e, outer_radius+e, outer_radius+e, e};
outer() = Abs(skin());
outer() -= middle();
end_face() = Surface In BoundingBox{-core_radius-e, -core_radius-e, core_end-e, core_radius+e, core_radius+e, core_end+e};

Physical Volume("core") = core();
Physical Volume("gap") = gap();
Physical Volume("coil") = coil();
Physical Volume("air") = air();
Physical Surface("outer") = outer();
Physical Surface("middle") = middle();
Physical Surface("end_face") = end_face();

MeshSize{ PointsOf{ Volume{air()}; } } = 50;
MeshSize{ PointsOf{ Volume{gap()}; } } = 7;
MeshSize{ PointsOf{ Volume{coil()}; } } = 6;
MeshSize{ PointsOf{ Volume{core()}; } } = 4;
Mesh.MeshSizeExtendFromBoundary = 1;
Mesh.Algorithm3D = 1;
Mesh.Optimize = 1;
Mesh.OptimizeNetgen = 1;
