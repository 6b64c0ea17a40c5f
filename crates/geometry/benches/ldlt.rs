//! Speed and memory of the symmetric factor over three sizes: `cargo bench -p fluxmorph-geometry --bench ldlt`, or with
//! `-- CELLS …` over others.
//!
//! Three decoupled Laplacians with a complex mass on a block of cubes of six tetrahedra, as the vector potential has where
//! no material changes. Every case runs in a process of its own, because the largest memory of a process never falls again.
//! Memory is what Linux counts (`VmHWM`) from before the factorisation on, in parts of the factor.

use std::process::Command;
use std::sync::Arc;
use std::time::Instant;

use cpu_time::ProcessTime;
use fluxmorph_geometry::fem::csr::CsrStructure;
use fluxmorph_geometry::fem::{
    BlockPattern, Coupling, DofMap, ElementGroup, FactorScalar, Ldlt, LdltAnalysis, ordering,
};
use fluxmorph_geometry::generate::{BlockParameters, block};
use num_complex::{Complex32, Complex64};

/// Cells along each edge of the blocks: 41k, 98k and 192k unknowns.
const CELLS: [usize; 3] = [23, 31, 39];
const KINDS: [&str; 4] = ["f64", "f32", "c64", "c32"];

/// A memory figure of this process [bytes].
fn memory(key: &str) -> usize {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let line = status.lines().find_map(|line| line.strip_prefix(key));
    line.and_then(|line| line.trim().trim_end_matches(" kB").parse::<usize>().ok()).unwrap_or(0) * 1024
}

/// Makes the largest memory so far the present one; where that is not allowed, the peak includes the analysis.
fn forget_peak() {
    let _ = std::fs::write("/proc/self/clear_refs", "5");
}

fn timed<R>(work: impl FnOnce() -> R) -> (R, f64, f64) {
    let (clock, processor) = (Instant::now(), ProcessTime::now());
    let result = work();
    (result, processor.elapsed().as_secs_f64(), clock.elapsed().as_secs_f64())
}

fn system(cells: usize) -> (DofMap<3>, Arc<CsrStructure>) {
    let mesh = block(&BlockParameters { size: [0.1; 3], cells: [cells; 3] }).expect("valid");
    let tets = mesh.topology().tets().to_vec();
    let couplings = vec![Coupling::diagonal(3); tets.len()];
    let nodes = mesh.points().len();
    let dofs = DofMap::<3>::new(nodes, |_, _| true);
    let volumes = ElementGroup::new(nodes, tets, couplings);
    let surfaces = ElementGroup::<3>::new(nodes, Vec::<[fluxmorph_geometry::NodeId; 3]>::new(), Vec::new());
    let structure = Arc::clone(BlockPattern::symmetric(&dofs, &volumes, &surfaces).structure());
    (dofs, structure)
}

fn value(structure: &CsrStructure, row: usize, k: usize) -> Complex64 {
    let own = structure.columns[k] as usize == row;
    if own { Complex64::new(14.5, 1.0) } else { Complex64::new(-1.0, 0.02) }
}

/// Factors twice, solves five times; prints the least processor and wall times [s], the peak and the bytes of the factor.
fn measure<T: FactorScalar>(analysis: &Arc<LdltAnalysis>, entry: impl Fn(usize, usize) -> T + Sync) {
    let factor = || Ldlt::new(analysis, &entry).expect("no pivot is zero");
    let before = memory("VmRSS:");
    forget_peak();
    let (made, mut cpu, mut wall) = timed(factor);
    let (peak, bytes) = (memory("VmHWM:").saturating_sub(before), made.bytes());
    drop(made);
    let (made, again_cpu, again_wall) = timed(factor);
    (cpu, wall) = (cpu.min(again_cpu), wall.min(again_wall));
    let (mut solve_cpu, mut solve_wall) = (f64::INFINITY, f64::INFINITY);
    for _ in 0..5 {
        let mut x = vec![T::ONE; analysis.size()];
        let ((), this_cpu, this_wall) = timed(|| made.solve_in_place(&mut x));
        (solve_cpu, solve_wall) = (solve_cpu.min(this_cpu), solve_wall.min(this_wall));
    }
    let (n, entries) = (analysis.size(), analysis.factor_entries());
    println!("{n} {entries} {cpu} {wall} {solve_cpu} {solve_wall} {peak} {bytes}");
}

fn child(cells: usize, kind: &str) {
    let (dofs, structure) = system(cells);
    let s = &structure;
    let (analysis, cpu, _) = timed(|| {
        let order = ordering::nested_dissection_of_nodes(s, &dofs);
        LdltAnalysis::new(s, order).expect("a pattern")
    });
    print!("{cpu} ");
    match kind {
        "f64" => measure(&analysis, |row, k| value(s, row, k).re),
        "f32" => measure(&analysis, |row, k| value(s, row, k).re as f32),
        "c64" => measure(&analysis, |row, k| value(s, row, k)),
        _ => measure(&analysis, |row, k| {
            let z = value(s, row, k);
            Complex32::new(z.re as f32, z.im as f32)
        }),
    }
}

/// Time and fill of the two orderings.
fn orderings(cells: usize) {
    let (dofs, structure) = system(cells);
    for name in ["matrix graph", "node graph"] {
        let (order, cpu, _) = timed(|| match name {
            "node graph" => ordering::nested_dissection_of_nodes(&structure, &dofs),
            _ => ordering::dissection(&structure),
        });
        let (analysis, analysis_cpu, _) = timed(|| LdltAnalysis::new(&structure, order).expect("a pattern"));
        println!(
            "{:<14}{:>9}{:>10.3}{:>12.3}{:>12.1}{:>10.2}",
            name,
            analysis.size(),
            cpu,
            analysis_cpu,
            analysis.factor_entries() as f64 / 1e6,
            analysis.multiplications() / 1e9,
        );
    }
}

fn case(cells: usize, kind: &str, threads: usize) {
    let program = std::env::current_exe().expect("this program has a path");
    let child = ["--case".to_owned(), cells.to_string(), kind.to_owned()];
    let output = Command::new(program).args(child).env("RAYON_NUM_THREADS", threads.to_string()).output();
    let output = output.expect("it runs");
    let text = String::from_utf8_lossy(&output.stdout).into_owned();
    let values: Vec<f64> = text.split_whitespace().filter_map(|word| word.parse().ok()).collect();
    let [analysis, n, entries, cpu, wall, solve_cpu, solve_wall, peak, bytes] = values[..] else {
        panic!("{}", String::from_utf8_lossy(&output.stderr))
    };
    println!(
        "{:<8}{:>4}{:>9}{:>10.1}{:>10.3}{:>10.3}{:>10.3}{:>11.2}{:>11.2}{:>10.0}{:>8.2}",
        kind,
        threads,
        n,
        entries / 1e6,
        analysis,
        cpu,
        wall,
        solve_cpu * 1e3,
        solve_wall * 1e3,
        peak / 1e6,
        peak / bytes
    );
}

fn main() {
    let arguments: Vec<String> = std::env::args().collect();
    if let Some(at) = arguments.iter().position(|argument| argument == "--case") {
        return child(arguments[at + 1].parse().expect("cells"), &arguments[at + 2]);
    }
    let asked: Vec<usize> = arguments.iter().filter_map(|argument| argument.parse().ok()).collect();
    let cells = if asked.is_empty() { CELLS.to_vec() } else { asked };
    println!(
        "{:<14}{:>9}{:>10}{:>12}{:>12}{:>10}",
        "ordering", "unknowns", "CPU s", "analysis s", "M entries", "G muladd"
    );
    cells.iter().for_each(|&cells| orderings(cells));
    println!(
        "\n{:<8}{:>4}{:>9}{:>10}{:>10}{:>10}{:>10}{:>11}{:>11}{:>10}{:>8}",
        "number",
        "thr",
        "unknowns",
        "M entries",
        "analyse s",
        "CPU s",
        "wall s",
        "solve ms",
        "wall ms",
        "peak MB",
        "/factor"
    );
    for &cells in &cells {
        for kind in KINDS {
            case(cells, kind, 1);
            case(cells, kind, 2);
        }
    }
}
