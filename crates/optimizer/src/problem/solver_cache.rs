//! What the linear solvers of all states keep from one design to the next.

use fluxmorph_geometry::Mesh;
use fluxmorph_geometry::fem::c64;
use fluxmorph_geometry::tet4::Point;
use fluxmorph_solver::linear::{LinearSolverCache, Method, PreparedSystem};

/// Factors and solutions of the design before, by matrix: states that share one share them.
///
/// What an evaluation computes depends on its cache only within the tolerance of the linear solver.
#[derive(Debug, Default)]
pub struct SolverCache {
    matrices: Vec<LinearSolverCache>,
    anchor: Option<Anchor>,
}

/// Where Newton's method begins: the states on the undeformed mesh, whose nodes these are. A state is then a function of its
/// design, and not of the designs before.
#[derive(Debug, Clone)]
struct Anchor {
    nodes: Vec<Point>,
    states: Vec<Option<Vec<c64>>>,
}

impl SolverCache {
    /// The cache of a matrix; of one without any, what another frequency of the same design offers.
    pub(super) fn of_matrix(&mut self, index: usize) -> &mut LinearSolverCache {
        while self.matrices.len() <= index {
            let other = self.matrices.last().map(LinearSolverCache::without_initial_guess);
            self.matrices.push(other.unwrap_or_default());
        }
        &mut self.matrices[index]
    }

    /// What may serve other designs as well: the factors, without solutions to start from.
    ///
    /// With it an evaluation is a smooth function of the design, as differences need.
    pub fn without_initial_guess(&self) -> Self {
        let matrices = self.matrices.iter().map(LinearSolverCache::without_initial_guess).collect();
        Self { matrices, anchor: self.anchor.clone() }
    }

    /// Whether the states on this mesh are those that others begin with.
    pub(super) fn is_anchored_on(&self, mesh: &Mesh) -> bool {
        self.anchor.as_ref().is_some_and(|anchor| anchor.nodes == mesh.points())
    }

    /// Forgets what states begin with.
    pub(super) fn forget_anchor(&mut self) {
        self.anchor = None;
    }

    /// Keeps the states on a mesh as those that others begin with; `None` where one is linear.
    pub(super) fn anchor_on(&mut self, mesh: &Mesh, states: Vec<Option<Vec<c64>>>) {
        self.anchor = Some(Anchor { nodes: mesh.points().to_vec(), states });
    }

    /// What a state's Newton method begins with.
    pub(super) fn start(&self, index: usize) -> Option<&[c64]> {
        self.anchor.as_ref()?.states.get(index)?.as_deref()
    }

    /// The methods that worked last, by matrix; `None` where it is the first one tried.
    pub fn methods(&self) -> Vec<Option<Method>> {
        self.matrices.iter().map(LinearSolverCache::method).collect()
    }

    /// A cache of nothing but methods, by matrix.
    pub fn with_methods(methods: &[Option<Method>]) -> Self {
        let matrices = methods.iter().map(|&method| LinearSolverCache::with_method(method)).collect();
        Self { matrices, anchor: None }
    }

    /// Keeps what a solved system leaves.
    pub(super) fn keep(&mut self, index: usize, system: PreparedSystem) {
        *self.of_matrix(index) = system.into_cache();
    }
}
