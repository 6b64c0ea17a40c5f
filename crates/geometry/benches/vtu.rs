//! Speed of the VTU writer: `cargo bench -p fluxmorph-geometry --bench vtu`.
//!
//! The arrays are those that a run writes, with the mantissas of a smooth field: noise to a compressor.

use cpu_time::ProcessTime;
use fluxmorph_geometry::generate::{BlockParameters, block};
use fluxmorph_geometry::io::{ArrayData, Field, vtu_bytes};
use fluxmorph_geometry::tet4::{Point, centroid};

/// Cells along each edge of the blocks: 24k, 98k and 384k tetrahedra.
const SIZES: [usize; 3] = [16, 25, 40];

fn smooth(x: Point) -> Point {
    [(3.0 * x[0]).sin() * x[1], (2.0 * x[1] + x[2]).cos(), x[0] * x[1] * x[2]]
}

/// Like a current density: zero outside a slab.
fn in_slab(x: Point) -> Point {
    if x[2] < 0.1 { smooth(x) } else { [0.0; 3] }
}

fn case(cells: usize) {
    let mesh = block(&BlockParameters { size: [1.0; 3], cells: [cells; 3] }).expect("valid");
    let topology = mesh.topology();
    let nodal: Vec<Point> = mesh.points().iter().map(|&x| smooth(x)).collect();
    let zero = vec![[0.0; 3]; nodal.len()];
    let psi: Vec<f64> = mesh.points().iter().map(|&x| in_slab(x)[0]).collect();
    let b: Vec<Point> = topology.elements().map(|e| smooth(centroid(mesh.vertices(e)))).collect();
    let j: Vec<Point> = topology.elements().map(|e| in_slab(centroid(mesh.vertices(e)))).collect();
    let loss: Vec<f64> = j.iter().map(|j| j[0] * j[0]).collect();
    let size: Vec<f64> = b.iter().map(|b| b[0].hypot(b[1])).collect();
    let region: Vec<i32> = topology.region_of().iter().map(|r| r.0 as i32).collect();
    let vector = |name, values| Field { name, data: ArrayData::Vector(values) };
    let scalar = |name, values| Field { name, data: ArrayData::Scalar(values) };
    let at_nodes = [
        vector("A_re", &nodal),
        vector("A_im", &nodal),
        scalar("psi_re", &psi),
        scalar("psi_im", &psi),
        vector("displacement", &zero),
        vector("sensitivity", &zero),
    ];
    let in_cells = [
        vector("B_re", &b),
        vector("B_im", &b),
        scalar("B_abs", &size),
        vector("J_re", &j),
        vector("J_im", &j),
        scalar("loss_density", &loss),
        Field { name: "region", data: ArrayData::Integer(&region) },
        scalar("quality", &size),
    ];
    let (nodes, tets) = (topology.node_count() as f64, topology.tets().len() as f64);
    let megabytes = (nodes * (24.0 * 5.0 + 16.0) + tets * (24.0 * 4.0 + 28.0 + 41.0)) * 1e-6;
    let (mut least, mut written) = (f64::INFINITY, 0);
    for _ in 0..3 {
        let clock = ProcessTime::now();
        written = vtu_bytes(&mesh, &at_nodes, &in_cells).expect("finite").len();
        least = least.min(clock.elapsed().as_secs_f64());
    }
    println!(
        "{:>10}{:>10.1}{:>10.1}{:>10.3}{:>10.1}",
        topology.tets().len(),
        megabytes,
        written as f64 * 1e-6,
        least,
        megabytes / least
    );
}

fn main() {
    println!("{:>10}{:>10}{:>10}{:>10}{:>10}", "tets", "MB arrays", "MB file", "CPU s", "MB/CPU s");
    SIZES.into_iter().for_each(case);
}
