//! Tests of the crate from outside: sources, grounding, and the ladder of linear solvers under injected failures.

mod applied;
mod circuits;
mod coil_regions;
mod edge;
mod estimate;
mod forces;
mod grounding;
mod guards;
mod half_space;
mod open;
mod prisms;
mod recovery;
mod saturation;
mod sheet;
mod solid;
mod sources;
mod transmission;
mod two_level;

use fluxmorph_geometry::generate::{Grid, ShieldParameters, shield};
use fluxmorph_geometry::tet4::Point;
use fluxmorph_geometry::{Mesh, RegionId};
use fluxmorph_solver::coil::{Coil, Corner, Racetrack, Terminal};
use fluxmorph_solver::{
    Boundary, ElementFamily, FieldModel, FieldModelSetup, FieldSolution, Material, Order, Winding,
};

/// Both families in both orders.
const ALL: [(ElementFamily, Order); 4] = [
    (ElementFamily::Nodal, Order::Linear),
    (ElementFamily::Nodal, Order::Quadratic),
    (ElementFamily::Edge, Order::Linear),
    (ElementFamily::Edge, Order::Quadratic),
];

const STEEL: Material = Material { relative_permeability: 800.0, conductivity: 7e6 };

/// One turn, and nothing in series with it.
const NO_CIRCUIT: Winding =
    Winding { turns: 1.0, resistance: 0.0, series_inductance: 0.0, series_capacitance: None, voltage: None };

/// Lines of so many cells of a size [m], from 0 on.
fn lines(count: usize, size: f64) -> Vec<f64> {
    (0..=count).map(|i| size * i as f64).collect()
}

/// A mesh of three sets of lines [m], with the region of every cell by its middle.
fn painted(lines: [Vec<f64>; 3], regions: &[&str], paint: impl Fn(Point) -> u32) -> Mesh {
    let grid = Grid::new("grid", lines).expect("ascending lines");
    grid.mesh(regions, |x| RegionId(paint(x))).expect("a grid conforms")
}

/// A square of 2 m and a height of 0.1 m in cells of 0.1 m, with a block in the quarter x > 0, y < 0 and a region far from the coil
/// of [`in_the_square`].
fn square() -> Mesh {
    let line = || (0..=20).map(|i| -1.0 + 0.1 * f64::from(i)).collect::<Vec<_>>();
    let region = |[x, y, _]: Point| if x > 0.0 && y < 0.0 { 1 } else { 2 * u32::from(x < -0.4 && y < -0.4) };
    painted([line(), line(), vec![0.0, 0.05, 0.1]], &["air", "block", "far"], region)
}

/// A coil in the quarter x > 0, y > 0 of the square, longer than that is high, between flux-parallel walls and flux-normal planes.
fn in_the_square((family, order): (ElementFamily, Order), frequency: f64) -> FieldModelSetup {
    let shape = Racetrack::new([0.5, 0.5, 0.05], 2, [0.15; 2], 0.1, 0.4, Corner::Mitred).expect("a coil");
    let mut boundaries = flux_parallel(&OUTSIDE[..4]);
    boundaries.extend(["z_min", "z_max"].map(|name| (name.to_owned(), Boundary::FluxNormal)));
    FieldModelSetup {
        family,
        order,
        frequency,
        materials: vec![Material::AIR; 3],
        coils: vec![Coil { name: "coil".to_owned(), ampere_turns: 1e3.into(), shape: shape.into() }],
        boundaries,
        ..FieldModelSetup::default()
    }
}

/// The shield on a coarse mesh, with one layer in the skin of its plate.
fn coarse_shield() -> Mesh {
    let (skin, side_skin) = (vec![1e-3], Vec::new());
    let parameters = ShieldParameters { refinement: 0.3, skin, side_skin, ..ShieldParameters::default() };
    shield(&parameters).expect("a coarse shield")
}

/// A plate below the shield's coil, in air between flux-parallel walls.
fn over_a_plate(mesh: &Mesh, plate: Material, ampere_turns: f64, frequency: f64) -> FieldModelSetup {
    let shape =
        Racetrack::new([0.0, 0.0, 0.06], 2, [0.06, 0.16], 0.02, 0.04, Corner::Mitred).expect("a coil");
    let names = mesh.topology().region_names();
    FieldModelSetup {
        frequency,
        materials: names.iter().map(|n| if n == "plate" { plate } else { Material::AIR }).collect(),
        coils: vec![Coil { name: "coil".to_owned(), ampere_turns: ampere_turns.into(), shape: shape.into() }],
        boundaries: flux_parallel(&OUTSIDE),
        ..FieldModelSetup::default()
    }
}

/// A sound problem, and its solution.
#[track_caller]
fn solved(mesh: &Mesh, setup: FieldModelSetup) -> (FieldModel, FieldSolution) {
    let model = FieldModel::new(mesh, setup).expect("a sound problem");
    let (solution, _) = model.solve(mesh).expect("it is solved");
    (model, solution)
}

/// A surface of a mesh as a terminal of a coil.
fn terminal(mesh: &Mesh, name: &str) -> Terminal {
    Terminal { name: name.to_owned(), triangles: mesh.topology().surface(name).expect("a face").to_vec() }
}

/// Surfaces that the flux does not cross.
fn flux_parallel(names: &[&str]) -> Vec<(String, Boundary)> {
    names.iter().map(|name| ((*name).to_owned(), Boundary::FluxParallel)).collect()
}

const OUTSIDE: [&str; 6] = ["x_min", "x_max", "y_min", "y_max", "z_min", "z_max"];

/// What `run` yields in a pool of so many threads.
fn on_threads<R: Send>(threads: usize, run: impl FnOnce() -> R + Send) -> R {
    rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("a pool").install(run)
}
