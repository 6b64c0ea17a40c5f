//! How much memory the work on a problem will hold, from the sizes that are known before anything is solved.
//!
//! A sum of what the process holds anyway, arrays by element, matrices, and factors by their symbolic analysis. The constants
//! are least-error fits to the peak of the resident memory over the shipped configurations; docs/performance.md has the
//! table. Matrices and factors dominate from ten thousand elements on, and these are counted, not fitted.
//!
//! Does not live here: how much memory there is, and what is refused for lack of it (`memory_limit`).

use fluxmorph_geometry::fem::workspace::LARGE_FACTOR;
use fluxmorph_solver::linear::{FieldKind, Method, Reuse, SystemAnalysis, two_levels_from};
use fluxmorph_solver::{FieldModel, Order};

use crate::problem::Problem;

/// The program itself, its libraries and the stacks of its threads.
const PROCESS: usize = 13 << 20;

/// Mesh, adjacency and output arrays, with what belongs to the nodes, and the places of a linear element's entries in the
/// matrix; per element.
const LINEAR_ELEMENT: usize = 330;

/// The same with the 30 unknowns of a quadratic element, whose places alone are 900 numbers.
const QUADRATIC_ELEMENT: usize = 2600;

/// Element derivatives, moved mesh and quality, per element where something moves.
const MOVING: usize = 170;

/// Solution, files and arrays of every load case and frequency beyond the first, per element: 290 to 370 with linear elements, nodal
/// and edge, 230 to 350 with quadratic ones.
const FURTHER_STATE: usize = 340;

/// What a run still holds of its own mesh and patterns while the fresh mesh is worked on, per element.
const HELD_BY_SETUP: usize = 300;

/// Entries of a factor under nested dissection grow with this power of the unknowns: 4/3 where a mesh is as fine along all
/// directions (George and Liu, *Computer Solution of Large Sparse Positive Definite Systems* (1981), chapter 8), 1.0 measured where
/// the flat cells of skin layers are halved. What lies between is wrong by a quarter at both ends for eight times the elements.
const FACTOR_GROWTH: f64 = 1.2;

/// Bytes of both levels of the two-level preconditioner per unknown: 470 to 850 on shields of 18 000 to 210 000 unknowns, 1090 of
/// 530 000, and of quadratic elements 1.1 to 1.8 kB, with the vectors and transfers beside them 2.1.
const TWO_LEVELS_PER_UNKNOWN: [usize; 2] = [800, 1800];

/// What an evaluation of a problem adds to the process [bytes], and what that grows with on another mesh.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sizes {
    /// Arrays by element, and the elastic solver.
    arrays: usize,
    /// What states beyond the first hold until they are written.
    further_states: usize,
    /// Matrices of the field.
    matrices: usize,
    /// Their preconditioners.
    preconditioners: usize,
    /// Elements of the mesh.
    tets: usize,
    /// Those with ψ, of the state that has most of them.
    eddy_tets: usize,
    /// Unknowns of the largest field problem.
    unknowns: usize,
    /// Whether a factor preconditions one of them.
    has_factor: bool,
    /// Unknowns from which two levels may take its place on a finer mesh.
    two_levels_from: usize,
    /// Bytes of these per unknown.
    two_levels_per_unknown: usize,
}

impl Sizes {
    /// Those of a problem that is set up.
    pub fn of(problem: &Problem) -> Self {
        let quadratic = problem.states().iter().any(|state| state.space().order() == Order::Quadratic);
        let moving = if problem.shape().is_some() { MOVING } else { 0 };
        let element = moving + if quadratic { QUADRATIC_ELEMENT } else { LINEAR_ELEMENT };
        let elastic = problem.shape().map_or(0, |shape| shape.motion().map().solver_bytes());
        let tets = problem.original().topology().tets().len();
        let solvers = || problem.states().iter().filter_map(FieldModel::linear_solver);
        let harmonic = problem.states().iter().filter(|state| state.angular_frequency() != 0.0);
        let mut sizes = Self {
            arrays: tets * element + elastic,
            further_states: problem.states().len().saturating_sub(1) * tets * FURTHER_STATE,
            matrices: 0,
            preconditioners: 0,
            tets,
            eddy_tets: problem.states().iter().map(eddy_tets).max().unwrap_or(0),
            unknowns: solvers().map(|solver| solver.unknown_count()).max().unwrap_or(0),
            has_factor: solvers().any(|solver| is_factor(solver.method())),
            two_levels_from: harmonic
                .map(|state| (state.space().family(), state.space().order()))
                .map(|elements| two_levels_from(FieldKind::Harmonic, elements))
                .min()
                .unwrap_or(usize::MAX),
            two_levels_per_unknown: TWO_LEVELS_PER_UNKNOWN[usize::from(quadratic)],
        };
        // Factors that serve the next design are held all at once, the others one after the other.
        let mut largest = (0, 0);
        for state in problem.matrices().iter().map(|states| &problem.states()[states[0]]) {
            let Some(solver) = state.linear_solver() else { continue };
            // Newton's method holds the matrix of the linear parts beside that of the tangent.
            let matrices = if state.is_linear() { 1 } else { 2 };
            let preconditioner = solver.preconditioner_bytes(solver.method()).unwrap_or_default();
            let own = (matrices * solver.matrix_bytes(), preconditioner);
            match solver.reuse() {
                Reuse::WhileItPays => {
                    sizes.matrices += own.0;
                    sizes.preconditioners += own.1;
                }
                Reuse::Never if own.0 + own.1 > largest.0 + largest.1 => largest = own,
                Reuse::Never => {}
            }
        }
        sizes.matrices += largest.0;
        sizes.preconditioners += largest.1;
        sizes
    }

    /// Bytes that the process holds at the peak of one evaluation, about.
    pub fn here(&self) -> usize {
        self.of_one_state() + self.further_states
    }

    /// The same with one load case or frequency.
    pub fn of_one_state(&self) -> usize {
        PROCESS + self.arrays + self.matrices + self.preconditioners
    }

    /// Bytes that the process holds while it works on something else that takes so many for each element, and so many more for
    /// each with ψ, about.
    pub fn beside(&self, [bytes_per_tet, bytes_per_eddy_tet]: [usize; 2]) -> usize {
        PROCESS + self.tets * (HELD_BY_SETUP + bytes_per_tet) + self.eddy_tets * bytes_per_eddy_tet
    }

    /// Bytes that the process holds at the peak of the same analysis on another mesh of `growth` times the elements, while the
    /// problem's own mesh and patterns are still held, about: the least, with two levels in place of a factor where that may be,
    /// and the most, with a factor.
    pub fn on_other_mesh(&self, growth: f64) -> [usize; 2] {
        let held = PROCESS + self.tets * HELD_BY_SETUP;
        [self.two_levels_from, usize::MAX].map(|from| held + self.grown(growth, from))
    }

    fn grown(&self, growth: f64, two_levels_from: usize) -> usize {
        let times = |bytes: usize, factor: f64| (bytes as f64 * factor) as usize;
        let unknowns = times(self.unknowns, growth);
        let preconditioners = if self.has_factor {
            let factor = times(self.preconditioners, growth.powf(FACTOR_GROWTH));
            if unknowns < two_levels_from {
                factor
            } else {
                factor.min(unknowns * self.two_levels_per_unknown).max(self.preconditioners)
            }
        } else {
            times(self.preconditioners, growth)
        };
        times(self.arrays + self.matrices, growth) + preconditioners
    }
}

/// Elements with ψ.
fn eddy_tets(state: &FieldModel) -> usize {
    state.topology().elements().filter(|&e| state.has_eddy_currents(e)).count()
}

fn is_factor(method: Method) -> bool {
    !matches!(method, Method::Incomplete | Method::TwoLevel)
}

/// Whether a factor of the problem is so large that every thread asks for the workspace of the dense kernels: addresses, of
/// which it uses a small part. Limits on addresses count them, the memory of the machine does not.
pub fn needs_workspace(problem: &Problem) -> bool {
    let is_large = |solver: &SystemAnalysis| {
        let bytes = solver.preconditioner_bytes(solver.method()).unwrap_or_default();
        is_factor(solver.method()) && bytes >= LARGE_FACTOR
    };
    problem.states().iter().filter_map(FieldModel::linear_solver).any(is_large)
}
