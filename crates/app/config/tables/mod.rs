//! The tables of the configuration, one file each; `config` is the whole.

mod accuracy;
mod analysis;
mod axis;
mod boundary;
mod coil;
mod config;
mod constraint;
mod constraint_kind;
mod design;
mod force;
mod functional;
mod initial;
mod linear_solver;
mod load;
mod load_cases;
mod material;
mod mesh;
mod morph;
mod multipole;
mod objective;
mod open;
mod optimizer;
mod order;
mod output;
mod petsc;
mod remesh;

pub use accuracy::Accuracy;
pub use analysis::{Analysis, ElementOrder, Elements, Frequencies};
pub use axis::{Axis, AxisWord};
pub use boundary::{Boundaries, UniformField};
pub use coil::{
    Circular, Coil, CoilPath, CoilShape, ConductorWord, ConnectionWord, Corner, CornerWord, Racetrack,
    RegionCoil, ShapeWord,
};
pub use config::Config;
pub use constraint::{Constraint, Limit, ValueBound};
pub use constraint_kind::ThicknessKind;
pub use design::{Design, DesignDirection, DirectionWord, RimMotion, SymmetryPlane};
pub use force::ForceBody;
pub(crate) use functional::ABOVE_ZERO_HERTZ;
pub use functional::{Compared, Follow, Functional, ObjectiveKind, Weighting};
pub use initial::{InitialDesign, RandomDesign};
pub use linear_solver::{FactorReuse, LinearSolver, SolverMethod};
pub use load::{Feed, Load, LoadCase};
pub(crate) use load_cases::each_once;
pub use material::{KneeWord, Material, Region, RegionModel, Steel, WrittenCurve};
pub use mesh::{
    BlockMesh, BoxOfRegion, BoxesMesh, Generator, LengthUnit, MeshConfig, Patch, ShieldMesh, SizeAlong,
    SphereMesh,
};
pub use morph::{
    Case, DesignMotion, DesignWord, Morph, Paper, PrescribedMotion, Rotation, Scale, Target, Tune,
    TunedParameter,
};
pub use multipole::{ExpansionShape, MultipoleSet};
pub use objective::{Combination, Goal, Objective, Probe, Sum, Term};
pub use open::Open;
pub use optimizer::{Algorithm, MOST_EVALUATIONS, Optimizer};
pub use output::{FieldsKept, Output};
pub use petsc::{Petsc, PetscKrylov, PetscSolver, PetscSubSolver};
pub use remesh::{DEFAULT_POISSON, Motion, MotionLaw, Remesh, RemeshExtent, StiffnessLaw, Subregion};
