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
use fluxmorph_geometry::{ElementId, Mesh, RegionId};
use fluxmorph_solver::coil::{Coil, Corner, Racetrack, Terminal};
use fluxmorph_solver::{
    Boundary, ElementFamily, FieldModel, FieldModelSetup, FieldSolution, Functional, Material, Order,
    Winding, adjoint,
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

/// The mesh in a motion of its nodes, by so many of it.
fn displaced(mesh: &Mesh, direction: &[Point], step: f64) -> Mesh {
    let moved: Vec<Point> = direction.iter().map(|v| v.map(|c| step * c)).collect();
    mesh.moved(&moved).expect("small")
}

/// The derivatives of functionals along a motion are those of central differences, with the elements that move and the step.
fn derivatives_match(
    model: &FieldModel,
    mesh: &Mesh,
    functionals: &[Functional],
    (moving, direction, step): (&[ElementId], &[Point], f64),
) {
    let solve = |step: f64| {
        let mesh = displaced(mesh, direction, step);
        let (mut state, mut system) = model.solve(&mesh).expect("a field");
        if model.is_linear() {
            model.respond_to_every_winding(&mut system, &mut state).expect("responses");
        }
        (mesh, state, system)
    };
    let (at, state, mut system) = solve(0.0);
    let sides = [solve(step), solve(-step)];
    for (k, functional) in functionals.iter().enumerate() {
        let value = functional.evaluate((model, &at, &state)).expect("finite");
        let mut gradient = value.explicit.unwrap_or_else(|| vec![[0.0; 3]; direction.len()]);
        let mut add = |own: Vec<Point>| {
            gradient.iter_mut().flatten().zip(own.as_flattened()).for_each(|(sum, own)| *sum += own)
        };
        if !value.derivative.is_empty() {
            let lambda = adjoint::solve(&mut system, &value.derivative).expect("an adjoint");
            add(adjoint::node_gradient((model, &at, &state), &lambda, moving).expect("one process"));
        }
        let of_inductances = adjoint::inductance_gradient((model, &at, &state), &value.inductances, moving);
        add(of_inductances.expect("one process"));
        let terms = gradient.iter().zip(direction);
        let exact: f64 = terms.map(|(g, v)| (0..3).map(|d| g[d] * v[d]).sum::<f64>()).sum();
        let [plus, minus] = sides
            .each_ref()
            .map(|(mesh, state, _)| functional.evaluate((model, mesh, state)).expect("finite").value);
        let difference = (plus - minus) / (2.0 * step);
        let elements = (model.setup().family, model.setup().order);
        println!("{elements:?} {k}: {exact:e} {:e}", difference / exact - 1.0);
        // Truncation by the square of a step of some micrometres on cells of millimetres; rounding of the solver over the step.
        assert!(
            (difference / exact - 1.0).abs() < 1e-6,
            "{elements:?}, functional {k}: {difference} {exact}"
        );
    }
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
