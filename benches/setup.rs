//! CPU time of everything before the first evaluation, over meshes of the shield: `cargo bench --bench setup`.
//!
//! Every part is done once a mesh, with the CPU time of all threads together; below stand exponents of growth between
//! neighbouring meshes. The ordering and the factor of the elastic body grow faster than the mesh, all else with it.

use std::path::Path;

use cpu_time::ProcessTime;
use fluxmorph::build::{Mode, build_mesh, set_up};
use fluxmorph::config::Config;
use fluxmorph::files::fields;
use fluxmorph_geometry::io::{MshEncoding, msh_bytes, read_msh};
use fluxmorph_geometry::locate::locate;
use fluxmorph_geometry::tet4::Point;
use fluxmorph_optimizer::geometric::WallThickness;
use fluxmorph_optimizer::problem::{Analysis, Derivatives, NoProgress, SolverCache};

/// Refinements of `shield_quick.toml`: 10k, 55k and 595k tetrahedra.
const REFINEMENTS: [f64; 3] = [0.5, 1.4, 2.7];

/// Points that are looked for in the mesh.
const PROBES: usize = 10_000;

/// Largest mesh that is solved, for its fields.
const LARGEST_SOLVED: usize = 100_000;

fn timed<T>(work: impl FnOnce() -> T) -> (f64, T) {
    let clock = ProcessTime::now();
    let result = work();
    (clock.elapsed().as_secs_f64() * 1e3, result)
}

/// Names and CPU times [ms] of the parts on one mesh, and its number of tetrahedra.
fn parts(refinement: f64) -> (usize, Vec<(&'static str, f64)>) {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("configs/shield_quick.toml");
    let refined = [format!("mesh.shield.refinement={refinement}")];
    let (config, source) = Config::from_file(&path, &refined).unwrap_or_else(|e| panic!("{e}"));
    let (generated, mesh) = timed(|| build_mesh(&config, &source).expect("valid"));
    let bytes = msh_bytes(&mesh, 1e-3, MshEncoding::Ascii).expect("finite");
    let (text, _) = timed(|| read_msh(&bytes, 1e-3).expect("just written"));
    let bytes = msh_bytes(&mesh, 1e-3, MshEncoding::Binary).expect("finite");
    let (binary, _) = timed(|| read_msh(&bytes, 1e-3).expect("just written"));
    let [lower, upper] = mesh.bounding_box();
    let points: Vec<Point> = (0..PROBES)
        .map(|k| {
            let share = |step: f64| (step * k as f64).fract();
            let shares = [share(0.618_034), share(0.754_878), share(0.569_84)];
            [0, 1, 2].map(|d| lower[d] + shares[d] * (upper[d] - lower[d]))
        })
        .collect();
    let (probes, found) = timed(|| locate(&mesh, &points));
    assert!(found.iter().all(Option::is_some), "all inside");
    let (all, setup) = timed(|| set_up(&config, &source, Mode::Optimisation).expect("valid"));
    let shape = setup.problem.shape().expect("it has a design");
    let plate = mesh.topology().region("plate").expect("it has one");
    let (thickness, _) = timed(|| WallThickness::measure(&mesh, &[plate], shape.surface()));
    let mut parts = vec![
        ("mesh, generated", generated),
        ("mesh, Gmsh text", text),
        ("mesh, Gmsh binary", binary),
        ("10,000 probes", probes),
        ("thickness rays", thickness),
        ("set-up, all", all),
    ];
    let tets = mesh.topology().tets().len();
    if tets <= LARGEST_SOLVED {
        let analysis: Analysis = setup
            .problem
            .evaluate(shape.initial(), Derivatives::First, &mut SolverCache::default(), &mut NoProgress)
            .expect("it converges");
        parts.push((
            "fields and VTU",
            timed(|| fields::vtu(setup.problem.states(), &fields::FieldData::of(&analysis))).0,
        ));
    }
    (tets, parts)
}

fn main() {
    let (sizes, columns): (Vec<usize>, Vec<_>) = REFINEMENTS.into_iter().map(parts).unzip();
    print!("{:<22}", "CPU ms");
    sizes.iter().for_each(|tets| print!("{:>14}", format!("{tets} tets")));
    println!("{:>24}", "exponents of growth");
    for (row, (name, _)) in columns[0].iter().enumerate() {
        let times: Vec<f64> = columns.iter().filter_map(|parts| Some(parts.get(row)?.1)).collect();
        print!("{name:<22}");
        times.iter().for_each(|ms| print!("{ms:>14.1}"));
        let growth = times.windows(2).zip(sizes.windows(2));
        let exponents: Vec<String> = growth
            .map(|(t, n)| format!("{:.2}", (t[1] / t[0]).ln() / (n[1] as f64 / n[0] as f64).ln()))
            .collect();
        println!("{:>24}", exponents.join(", "));
    }
}
