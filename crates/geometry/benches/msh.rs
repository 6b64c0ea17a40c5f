//! Speed and memory of the Gmsh reader over three sizes: `cargo bench -p fluxmorph-geometry --bench msh`.
//!
//! Every case runs in a process of its own, because the largest memory of a process never falls again. It is the one that
//! Linux counts (`VmHWM`).

use std::path::Path;
use std::process::Command;
use std::time::Instant;

use cpu_time::ProcessTime;
use fluxmorph_geometry::generate::{BlockParameters, block};
use fluxmorph_geometry::io::{MshEncoding, msh_bytes, read_msh};

/// Cells along each edge of the blocks: 98k, 384k and 1.5 million tetrahedra.
const SIZES: [usize; 3] = [25, 40, 63];

/// Largest memory of this process so far [bytes].
fn peak() -> usize {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let line = status.lines().find_map(|line| line.strip_prefix("VmHWM:"));
    line.and_then(|line| line.trim().trim_end_matches(" kB").parse::<usize>().ok()).unwrap_or(0) * 1024
}

/// Reads a file and prints the least wall and processor time of three [s] and the peak memory [bytes].
fn read_once(path: &str) {
    let bytes = std::fs::read(path).expect("the parent wrote it");
    let (mut wall, mut cpu) = (f64::INFINITY, f64::INFINITY);
    let mut largest = 0;
    for _ in 0..3 {
        let (clock, processor) = (Instant::now(), ProcessTime::now());
        let read = read_msh(&bytes, 1e-3).unwrap_or_else(|error| panic!("{error}"));
        wall = wall.min(clock.elapsed().as_secs_f64());
        cpu = cpu.min(processor.elapsed().as_secs_f64());
        largest = largest.max(read.mesh.topology().tets().len());
    }
    println!("{wall} {cpu} {} {largest}", peak());
}

fn case(folder: &Path, cells: usize, encoding: MshEncoding) {
    let mesh = block(&BlockParameters { size: [0.1, 0.11, 0.13], cells: [cells; 3] }).expect("valid");
    let bytes = msh_bytes(&mesh, 1e-3, encoding).expect("finite");
    let path = folder.join("bench.msh");
    std::fs::write(&path, &bytes).expect("written");
    drop(mesh);
    let program = std::env::current_exe().expect("this program has a path");
    let output = Command::new(program).arg("--read").arg(&path).output().expect("it runs");
    let text = String::from_utf8_lossy(&output.stdout).into_owned();
    let values: Vec<f64> = text.split_whitespace().filter_map(|word| word.parse().ok()).collect();
    let [wall, cpu, peak, tets] = values[..] else { panic!("{}", String::from_utf8_lossy(&output.stderr)) };
    let size = bytes.len() as f64;
    println!(
        "{:<8}{:>10}{:>10.1}{:>10.3}{:>10.3}{:>10.1}{:>14.1}",
        format!("{encoding:?}").to_lowercase(),
        tets,
        size / 1e6,
        wall,
        cpu,
        size / 1e6 / wall,
        peak / size
    );
}

fn main() {
    let arguments: Vec<String> = std::env::args().collect();
    if let Some(at) = arguments.iter().position(|argument| argument == "--read") {
        return read_once(&arguments[at + 1]);
    }
    let folder = tempfile::tempdir().expect("a temporary folder");
    println!(
        "{:<8}{:>10}{:>10}{:>10}{:>10}{:>10}{:>14}",
        "form", "tets", "MB", "wall s", "CPU s", "MB/s", "memory/file"
    );
    for encoding in [MshEncoding::Ascii, MshEncoding::Binary] {
        for cells in SIZES {
            case(folder.path(), cells, encoding);
        }
    }
}
