// A steel slug stands on a round coil, a sensor above it: a quarter, lengths in millimetres.
SetFactory("OpenCASCADE");

slug_radius = 10;   slug_end = 30;          // the part whose side moves: z = 0 to 30
room_radius = 22;   room_end = 34;          // air that follows the motion
sensor = 4;         sensor_z = 37;          // a box of 4 x 4 x 3 in this quarter
outer_radius = 150; outer_z = 170;          // end of the model: z = -140 to 170

Cylinder(1) = {0, 0, 0, 0, 0, slug_end, slug_radius, Pi/2};
Cylinder(2) = {0, 0, -12, 0, 0, 12 + room_end, room_radius, Pi/2};
Box(3) = {0, 0, sensor_z, sensor, sensor, 3};
Cylinder(4) = {0, 0, -140, 0, 0, 140 + outer_z, outer_radius, Pi/2};
BooleanFragments{ Volume{4}; Delete; }{ Volume{1, 2, 3}; Delete; }

e = 0.01;
slug() = Volume In BoundingBox{-e, -e, -e, slug_radius+e, slug_radius+e, slug_end+e};
sensor() = Volume In BoundingBox{-e, -e, sensor_z-e, sensor+e, sensor+e, sensor_z+3+e};
room() = Volume In BoundingBox{-e, -e, -12-e, room_radius+e, room_radius+e, room_end+e};
room() -= slug();
air() = Volume{:};
air() -= slug();
air() -= sensor();
air() -= room();

skin() = Abs(CombinedBoundary{ Volume{:}; });
x_min() = Surface In BoundingBox{-e, -e, -140-e, e, outer_radius+e, outer_z+e};
y_min() = Surface In BoundingBox{-e, -e, -140-e, outer_radius+e, e, outer_z+e};
outer() = skin();
outer() -= x_min();
outer() -= y_min();
side() = Abs(Boundary{ Volume{slug()}; });
side() -= x_min();
side() -= y_min();
side() -= Surface In BoundingBox{-e, -e, -e, slug_radius+e, slug_radius+e, e};
side() -= Surface In BoundingBox{-e, -e, slug_end-e, slug_radius+e, slug_radius+e, slug_end+e};

Physical Volume("slug") = slug();
Physical Volume("room") = room();
Physical Volume("sensor") = sensor();
Physical Volume("air") = air();
Physical Surface("x_min") = x_min();
Physical Surface("y_min") = y_min();
Physical Surface("outer") = outer();
Physical Surface("slug_side") = side();

MeshSize{ PointsOf{ Volume{air()}; } } = 40;
MeshSize{ PointsOf{ Volume{room()}; } } = 6;
MeshSize{ PointsOf{ Volume{slug()}; } } = 3;
MeshSize{ PointsOf{ Volume{sensor()}; } } = 2;
Mesh.Algorithm3D = 1;
Mesh.Optimize = 1;
