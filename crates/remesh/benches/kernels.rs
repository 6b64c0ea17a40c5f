//! CPU time of the elastic stiffness, of one element and of a body, on one thread: `cargo bench -p fluxmorph-remesh --bench
//! kernels`.
//!
//! *Elements per second* are tetrahedra.

#[path = "../../../benches/clock/mod.rs"]
mod clock;

use std::hint::black_box;

use criterion::Throughput;
use fluxmorph_geometry::fem::{BlockPattern, Coupling, CsrMatrix, DofMap, ElementGroup, LocalMatrix};
use fluxmorph_geometry::generate::{BlockParameters, block};
use fluxmorph_geometry::tet4::{Point, Tet4};
use fluxmorph_remesh::elasticity::{ISOTROPIC, Isotropic, stiffness};

const VERTICES: [Point; 4] = [[0.1, 0.2, -0.1], [1.3, 0.1, 0.2], [0.3, 0.9, 0.1], [0.2, 0.3, 1.4]];
const LAW: Isotropic = Isotropic { young: 1.0, poisson: 0.3 };

fn main() {
    let mut criterion = clock::on_one_thread();
    let mut group = criterion.benchmark_group("element");
    group.bench_function("stiffness", |b| {
        b.iter(|| {
            let matrix = stiffness(&Tet4::new(black_box(VERTICES)), &LAW, &ISOTROPIC);
            let pairs = (0..4).flat_map(|a| (0..4).map(move |b| (a, b)));
            pairs.map(|(a, b)| matrix.block(a, b).iter().flatten().sum::<f64>()).sum::<f64>()
        });
    });
    group.finish();

    let mesh = block(&BlockParameters { size: [0.1, 0.11, 0.13], cells: [20; 3] }).expect("a block");
    let topology = mesh.topology();
    let tets = topology.tets().to_vec();
    let mut group = criterion.benchmark_group(format!("{} tets", tets.len()));
    group.throughput(Throughput::Elements(tets.len() as u64));
    let dofs = DofMap::<3>::new(topology.node_count(), |_, _| true);
    let couplings = vec![Coupling::full(3); tets.len()];
    let elements = ElementGroup::new(topology.node_count(), tets, couplings);
    let pattern = BlockPattern::rectangular(&dofs, &dofs, &elements);
    let bound = pattern.bind(&elements);
    let mut matrix = CsrMatrix::zeros(pattern.structure());
    group.bench_function("assembly of the stiffness", |b| {
        b.iter(|| {
            pattern.assemble(&bound, &mut matrix.values, |e| {
                stiffness(&Tet4::new(mesh.vertices(e)), &LAW, &ISOTROPIC)
            });
        });
    });
    group.finish();
    criterion.final_summary();
}
