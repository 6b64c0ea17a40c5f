//! CPU time of the geometric kernels and of assembly without physics, on one thread: `cargo bench -p fluxmorph-geometry
//! --bench kernels`.
//!
//! The clock is the process's CPU time; *elements per second* are tetrahedra.

#[path = "../../../benches/clock/mod.rs"]
mod clock;

use std::hint::black_box;

use criterion::Throughput;
use fluxmorph_geometry::fem::{BlockPattern, Coupling, CsrMatrix, DofMap, ElementGroup, LocalMatrix};
use fluxmorph_geometry::generate::{BlockParameters, block};
use fluxmorph_geometry::quality::{QualityReport, quality};
use fluxmorph_geometry::tet4::{Point, Tet4, dot};

const VERTICES: [Point; 4] = [[0.1, 0.2, -0.1], [1.3, 0.1, 0.2], [0.3, 0.9, 0.1], [0.2, 0.3, 1.4]];

/// `∫∇N_a·∇N_b`.
struct Laplace(Tet4);

impl LocalMatrix<f64, 4, 1> for Laplace {
    #[inline]
    fn block(&self, a: usize, b: usize) -> [[f64; 1]; 1] {
        [[self.0.volume * dot(self.0.gradients[a], self.0.gradients[b])]]
    }
}

fn main() {
    let mut criterion = clock::on_one_thread();
    let mut group = criterion.benchmark_group("element");
    group.bench_function("gradients and volume", |b| b.iter(|| Tet4::new(black_box(VERTICES))));
    group.bench_function("quality", |b| b.iter(|| quality(black_box(VERTICES))));
    group.finish();

    let mesh = block(&BlockParameters { size: [0.1, 0.11, 0.13], cells: [25; 3] }).expect("a block");
    let topology = mesh.topology();
    let (node_count, tets) = (topology.node_count(), topology.tets().to_vec());
    let mut group = criterion.benchmark_group(format!("{} tets", tets.len()));
    group.throughput(Throughput::Elements(tets.len() as u64));
    group.bench_function("quality report", |b| b.iter(|| QualityReport::of_mesh(&mesh)));
    let dofs = DofMap::<1>::new(node_count, |_, _| true);
    let elements = ElementGroup::new(node_count, tets.clone(), vec![Coupling::full(1); tets.len()]);
    group.bench_function("pattern", |b| b.iter(|| BlockPattern::rectangular(&dofs, &dofs, &elements)));
    let pattern = BlockPattern::rectangular(&dofs, &dofs, &elements);
    group.bench_function("binding to the pattern", |b| b.iter(|| pattern.bind(&elements)));
    let bound = pattern.bind(&elements);
    let mut matrix = CsrMatrix::zeros(pattern.structure());
    group.bench_function("assembly of a Laplacian", |b| {
        b.iter(|| {
            pattern.assemble(&bound, &mut matrix.values, |e| Laplace(Tet4::new(mesh.vertices(e))));
        });
    });
    group.finish();
    criterion.final_summary();
}
