//! (e): what the skin layers under the moved face keep of their thickness when the plate goes to 5 and 30 mm.

use fluxmorph_geometry::generate::ShieldParameters;
use fluxmorph_geometry::tet4::{norm, sub};
use fluxmorph_geometry::{Mesh, NodeId};
use fluxmorph_remesh::{KinematicConstraint, StepLimits, StiffnessPolicy};

use super::cases::{alternating_control_points, shield_parameters};
use crate::support::plate_columns;

/// The layers of the moved face from outside to inside, and how much of their thickness they keep.
pub(crate) struct Kept {
    pub(crate) policy: StiffnessPolicy,
    pub(crate) kinematic_constraint: KinematicConstraint,
    pub(crate) layers: Vec<Layer>,
}

/// Shares of its thickness that a layer keeps: distance of its two nodes in a column, after and before.
#[derive(Debug)]
pub(crate) struct Layer {
    /// At first [m].
    pub(crate) thickness: f64,
    /// Least share over the columns clear of the side layers.
    pub(crate) clear: f64,
    /// Least share over all columns.
    pub(crate) least: f64,
    /// Mean share over all columns.
    pub(crate) mean: f64,
}

/// The plate of configs/shield.toml, whose ten layers fill it.
pub(crate) fn filled() -> ShieldParameters {
    shield_parameters()
}

/// The same plate with layers to two skin depths (1.74 mm) and a coarse core of two cells.
pub(crate) fn cored() -> ShieldParameters {
    ShieldParameters { skin: vec![0.3e-3, 0.8e-3, 1.6e-3, 5e-3], ..shield_parameters() }
}

/// What is left when the control points alternate between 5 and 30 mm.
pub(crate) fn kept(
    p: &ShieldParameters,
    policy: StiffnessPolicy,
    kinematic_constraint: KinematicConstraint,
) -> Kept {
    let case = alternating_control_points(p, kinematic_constraint);
    let outcome = case.outcome(policy, &StepLimits::default());
    let moved = &outcome.travelled.moved.mesh;
    let columns = plate_columns(&case.mesh);
    // On the side layers' innermost line a column is still as wide as the plate's other ones on one side.
    let inner = [0, 1].map(|d| p.plate[d] - p.side_skin.last().copied().unwrap_or(0.0) + 1e-9);
    let is_clear = |c: &[NodeId]| (0..2).all(|d| case.mesh.point(c[0])[d] <= inner[d]);
    let least = |shares: &mut dyn Iterator<Item = f64>| shares.fold(f64::INFINITY, f64::min);
    let of_layer = |layer: usize| {
        let height = |mesh: &Mesh, c: &[NodeId]| norm(sub(mesh.point(c[layer + 1]), mesh.point(c[layer])));
        let share = |c: &Vec<NodeId>| height(moved, c) / height(&case.mesh, c);
        Layer {
            thickness: height(&case.mesh, &columns[0]),
            clear: least(&mut columns.iter().filter(|c| is_clear(c)).map(share)),
            least: least(&mut columns.iter().map(share)),
            mean: columns.iter().map(share).sum::<f64>() / columns.len() as f64,
        }
    };
    Kept { policy, kinematic_constraint, layers: (0..p.skin.len()).map(of_layer).collect() }
}
