// A ball in a box with room to grow to two and a half times its radius. Lengths in millimetres.
// ball.msh: gmsh -3 -format msh41 ball.geo

SetFactory("OpenCASCADE");

radius = 10;
half = 40;                  // of the box

Box(1) = {-half, -half, -half, 2*half, 2*half, 2*half};
Sphere(2) = {0, 0, 0, radius};
BooleanFragments{ Volume{1}; Delete; }{ Volume{2}; Delete; }

e = 0.01;
ball() = Volume In BoundingBox{-radius-e, -radius-e, -radius-e, radius+e, radius+e, radius+e};
air() = Volume{:};
air() -= ball();
outer() = Abs(CombinedBoundary{ Volume{:}; });
ball_surface() = Abs(Boundary{ Volume{ball()}; });

Physical Volume("ball") = ball();
Physical Volume("air") = air();
Physical Surface("ball_surface") = ball_surface();
Physical Surface("outer") = outer();

Mesh.MeshSizeFromPoints = 0;
Mesh.MeshSizeExtendFromBoundary = 0;
Field[1] = MathEval;        // 3.5 mm at the ball, 13 mm at the faces of the box
Field[1].F = "3.5 + 0.32 * Max(0, Sqrt(x*x + y*y + z*z) - 10)";
Background Field = 1;
Mesh.MeshSizeMax = 13;
Mesh.Algorithm3D = 1;
Mesh.Optimize = 1;
Mesh.OptimizeNetgen = 1;
