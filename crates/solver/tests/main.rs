//! Tests of the crate from outside: sources, grounding, and the ladder of linear solvers under injected failures.

mod applied;
mod circuits;
mod coil_regions;
mod edge;
mod estimate;
mod grounding;
mod guards;
mod open;
mod prisms;
mod saturation;
mod sheet;
mod solid;
mod sources;
mod two_level;

use fluxmorph_geometry::Mesh;
use fluxmorph_solver::Boundary;
use fluxmorph_solver::coil::Terminal;

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
