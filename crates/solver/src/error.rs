//! What can go wrong in a field analysis.

use fluxmorph_geometry::parallel::RankError;
use fluxmorph_geometry::{MeshError, millimetres};

use crate::coil::{PlaneFault, RegionFault};

/// Errors of this crate; each names the culprit.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
#[allow(missing_docs, reason = "the message of a variant says what its fields are")]
pub enum SolverError {
    /// The mesh or the sparse kernel refused.
    #[error(transparent)]
    Mesh(#[from] MeshError),
    /// A rank could not do its share.
    #[error(transparent)]
    Rank(#[from] RankError),
    /// A parameter of the model is out of range.
    #[error("{what} = {value}: {expected}")]
    Parameter { what: String, value: String, expected: String },
    /// One face with two conditions.
    #[error(
        "the surfaces `{}` and `{}` share the face at {}, with different conditions: a face takes \
         one; take it out of one of them",
        surfaces[0], surfaces[1], millimetres(*place)
    )]
    TwoConditions {
        surfaces: [String; 2],
        /// Centroid of the face [m].
        place: [f64; 3],
    },
    /// An applied field and another condition contradict each other.
    #[error(
        "at {} the applied field contradicts another condition: a flux-parallel plane must be parallel \
         to the field and hold the field's center, a flux-normal one at right angles to it; of two opposite flux-parallel planes, \
         apply the field to one instead",
        millimetres(*place)
    )]
    Conflict {
        /// A node at which both are asked [m].
        place: [f64; 3],
    },
    /// Two applied fields that contradict each other.
    #[error(
        "the surfaces `{}` and `{}` meet at {} with different applied fields: one field is there. Apply \
         one field to both, or leave one of them flux-parallel",
        surfaces[0], surfaces[1], millimetres(*place)
    )]
    TwoFields {
        surfaces: [String; 2],
        /// The middle of an edge that they share [m].
        place: [f64; 3],
    },
    /// A perfect conductor on a surface with an applied field.
    #[error(
        "the perfect conductor `{conductor}` touches the surface `{surface}` of the applied field at {}: \
         no flux enters it, but the applied field does. Keep the conductor away from that surface",
        millimetres(*place)
    )]
    FieldOnConductor {
        conductor: String,
        surface: String,
        /// The middle of an edge that they share [m].
        place: [f64; 3],
    },
    /// An analytic coil that meets no element.
    #[error("no current flows: {cause}")]
    NoSource { coil: String, cause: String },
    /// A coil's window or winding meets a face on which its source would be wrong.
    #[error(
        "the coil `{coil}` or its window meets {surface} at {}: {reason}",
        millimetres(*place)
    )]
    SourceOnBoundary {
        coil: String,
        surface: String,
        /// Where [m].
        place: [f64; 3],
        reason: PlaneFault,
    },
    /// No current can be made in a coil's region.
    #[error("the region of the coil `{coil}`: {fault}")]
    CoilRegion { coil: String, fault: RegionFault },
    /// A region that cannot stand for open space.
    #[error(
        "the region `{region}` cannot be open space: at {} {what}; a shell lies between two closed \
         surfaces, or their parts between symmetry planes through the centre, of which every ray from the centre meets \
         each once",
        millimetres(*at)
    )]
    Open {
        region: String,
        /// Where [m].
        at: [f64; 3],
        what: String,
    },
    /// What open space cannot hold.
    #[error(
        "the open region `{region}` holds {what}; there is air alone, and a field that vanishes at infinity: matter and coils \
         with their windows belong inside"
    )]
    OpenContents { region: String, what: &'static str },
    /// A region that must have elements has none.
    #[error("the region `{region}` has no elements: {expected}")]
    EmptyRegion { region: String, expected: &'static str },
    /// The iteration did not reach its residual.
    #[error(
        "the linear solver stopped at the relative residual {residual:.1e} after {iterations} iterations, not at the \
         {required:e} required: {cause}"
    )]
    NotConverged {
        /// True relative residual `|b − Ku|/|b|`.
        residual: f64,
        required: f64,
        iterations: usize,
        cause: NonConvergence,
    },
    /// The layer around a body on which a force is sought is not free.
    #[error(
        "the force on `{body}` is taken in the layer of elements around it, which meets {what} in `{region}` at {}: \
         a body needs a layer of air around it; make it finer there, or add what it touches to its regions",
        millimetres(*place)
    )]
    Layer {
        body: String,
        region: String,
        /// Where [m].
        place: [f64; 3],
        what: &'static str,
    },
    /// A body on which a force is sought that touches the surface which stands for a conductor.
    #[error(
        "the body `{body}` touches the surface that stands for `{conductor}`, at {}: the force on it is taken in the elements around it, \
         and what flows in that surface has none; leave a layer of air between the two, or add the conductor to its regions",
        millimetres(*place)
    )]
    TouchesConductor {
        body: String,
        conductor: String,
        /// Where [m].
        place: [f64; 3],
    },
    /// A body on which a force is sought, or the layer of elements around it, is in the shell of open space.
    #[error(
        "the force on `{body}` is taken in the layer of elements around it, and the body touches or holds the shell of open space, at \
         {}: there an element stands for another piece of space; leave a layer of elements between the body and the shell",
        millimetres(*place)
    )]
    ForceInShell {
        body: String,
        /// Where [m].
        place: [f64; 3],
    },
    /// A body on which a force is sought that fills the mesh.
    #[error(
        "the force on `{body}` is taken in the layer of elements around it, and there is none: leave at least one \
         region around the body out of its `regions`"
    )]
    NoLayer { body: String },
    /// A B–H law where the problem is shared out among ranks.
    #[error(
        "the region `{region}` has a B–H curve, which is solved for in one process: start the program without `mpirun`, or give \
         the material a relative_permeability"
    )]
    CurveOnRanks { region: String },
    /// A solid conductor above 0 Hz where the problem is shared out among ranks.
    #[error(
        "the coil `{coil}` is a solid conductor, whose current above 0 Hz is solved for in one process: start the program without \
         `mpirun`, or make it of strands"
    )]
    SolidOnRanks { coil: String },
    /// Newton's method did not reach its residual.
    #[error(
        "Newton's method stopped after {steps} steps at the relative residual {residual:.1e}; least settled is the region \
         `{region}` at {} with |B| = {flux_density:.3} T: {failure}",
        millimetres(*place)
    )]
    Newton {
        steps: usize,
        /// `|residual| / |load|`.
        residual: f64,
        region: String,
        /// Where [m].
        place: [f64; 3],
        /// `|B|` there [T].
        flux_density: f64,
        failure: NewtonFailure,
    },
    /// A field or objective that is not a finite number.
    #[error(
        "the {what} is {value}: the field problem has no usable solution; check currents, remanence, prescribed fields, weights, \
         material data and units"
    )]
    NotFinite { what: &'static str, value: f64 },
    /// A right side whose norm cannot be computed.
    #[error(
        "the largest entry of the right side is {largest:e}: its products in the iteration leave the range of \
         numbers; check currents, remanence, prescribed fields, weights and units"
    )]
    OutOfRange { largest: f64 },
    /// Something that moves has reached a place at which the field is observed.
    #[error(
        "the observed place {} would lie in {by}: a place that stays is of use where the body does not come; \
         narrow the bounds of the design, or observe another region",
        millimetres(*place)
    )]
    Covered {
        /// The place [m].
        place: [f64; 3],
        by: String,
    },
    /// The field is wanted at a point outside the mesh.
    #[error(
        "the point {} of {wanted_by} lies outside the mesh, whose box is {} to {}",
        millimetres(*point), millimetres(*lower), millimetres(*upper)
    )]
    PointOutside {
        wanted_by: PointsOf,
        /// The point [m].
        point: [f64; 3],
        /// Lower corner of the mesh [m].
        lower: [f64; 3],
        /// Upper corner [m].
        upper: [f64; 3],
    },
}

impl SolverError {
    /// [`SolverError::Parameter`] of these texts.
    pub(crate) fn parameter(what: impl Into<String>, value: impl ToString, expected: &str) -> Self {
        Self::Parameter { what: what.into(), value: value.to_string(), expected: expected.to_owned() }
    }
}

/// What takes the field at points, by its name.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum PointsOf {
    /// A probe.
    #[error("the probe `{0}`")]
    Probe(String),
    /// The expansion of a field in multipoles.
    #[error("the expansion `{0}`")]
    Expansion(String),
}

/// What a linear system that is not solved looks like, and what may help.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum NonConvergence {
    /// The residual stays, with the most robust method that there is memory for.
    #[error(
        "the mesh may hold nearly flat elements, the material data span too many orders of magnitude, or a conductor is so weak that \
         edge elements do not carry it, and nodal ones do; more memory for a factor may help"
    )]
    IllConditioned,
    /// Something on the way is not finite.
    #[error("the iteration broke down; a coefficient or coordinate is not finite")]
    Breakdown,
    /// The residual stays, on several ranks.
    #[error(
        "more memory or ranks for a direct factor, a larger overlap of the subdomains or complete factors on them may help"
    )]
    OnRanks,
}

/// What a state that Newton's method does not find looks like, and what may help.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum NewtonFailure {
    /// The law or the load keep it far off.
    #[error(
        "check the units of its B–H table and the currents; a capacitance in series with it may have several states, or one that is hard to find"
    )]
    Law,
    /// It is nearly there and does not come nearer, with the most robust linear method that there is memory for.
    #[error("the mesh may hold nearly flat elements; more memory for a factor may help")]
    Rounding,
}
