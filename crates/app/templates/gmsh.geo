// A round iron pole over a gap, a quarter of it: x >= 0, y >= 0. The plane z = 0 mirrors it to the opposite pole.
// Lengths in millimetres. After a change:
//
//     gmsh -3 -format msh41 NAME.geo

SetFactory("OpenCASCADE");

pole_radius = 25;
pole_face = 10;             // half of the gap
pole_end = 60;
tip_end = 25;               // up to here the iron follows the moving face
follow_radius = 34;         // of the air that follows it too
target_radius = 15;         // where the field is wanted
target_end = 4;
outer_radius = 160;

// A quarter of each: the last parameter is the angle about the axis.
Cylinder(1) = {0, 0, pole_face, 0, 0, tip_end - pole_face, pole_radius, Pi/2};
Cylinder(2) = {0, 0, tip_end, 0, 0, pole_end - tip_end, pole_radius, Pi/2};
Cylinder(3) = {0, 0, target_end, 0, 0, tip_end - target_end, follow_radius, Pi/2};
Cylinder(4) = {0, 0, 0, 0, 0, target_end, target_radius, Pi/2};
Sphere(5) = {0, 0, 0, outer_radius, 0, Pi/2, Pi/2};
BooleanFragments{ Volume{5}; Delete; }{ Volume{1, 2, 3, 4}; Delete; }

// Volumes and surfaces are found by the boxes that hold them: their numbers may change with the geometry.
e = 0.01;
tip() = Volume In BoundingBox{-e, -e, pole_face-e, pole_radius+e, pole_radius+e, tip_end+e};
pole() = Volume In BoundingBox{-e, -e, tip_end-e, pole_radius+e, pole_radius+e, pole_end+e};
gap() = Volume In BoundingBox{-e, -e, target_end-e, follow_radius+e, follow_radius+e, tip_end+e};
gap() -= tip();
target() = Volume In BoundingBox{-e, -e, -e, target_radius+e, target_radius+e, target_end+e};
air() = Volume{:};
air() -= tip();
air() -= pole();
air() -= gap();
air() -= target();

x_min() = Surface In BoundingBox{-e, -e, -e, e, outer_radius+e, outer_radius+e};
y_min() = Surface In BoundingBox{-e, -e, -e, outer_radius+e, e, outer_radius+e};
z_min() = Surface In BoundingBox{-e, -e, -e, outer_radius+e, outer_radius+e, e};
face() = Surface In BoundingBox{-e, -e, pole_face-e, pole_radius+e, pole_radius+e, pole_face+e};
skin() = CombinedBoundary{ Volume{:}; };
outer() = Abs(skin());
outer() -= x_min();
outer() -= y_min();
outer() -= z_min();

// The names that the configuration uses: volumes are its regions, surfaces its surfaces.
Physical Volume("tip") = tip();
Physical Volume("pole") = pole();
Physical Volume("gap") = gap();
Physical Volume("target") = target();
Physical Volume("air") = air();
Physical Surface("x_min") = x_min();
Physical Surface("y_min") = y_min();
Physical Surface("z_min") = z_min();
Physical Surface("outer") = outer();
Physical Surface("face") = face();

MeshSize{ PointsOf{ Volume{air()}; } } = 55;
MeshSize{ PointsOf{ Volume{pole()}; } } = 16;
MeshSize{ PointsOf{ Volume{gap()}; } } = 9;
MeshSize{ PointsOf{ Volume{tip()}; } } = 7;
MeshSize{ PointsOf{ Volume{target()}; } } = 6;
Mesh.Algorithm3D = 1;
Mesh.Optimize = 1;
