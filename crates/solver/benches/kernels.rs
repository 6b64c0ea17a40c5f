//! CPU time of the element kernels and of the loops over elements, on one thread: `cargo bench -p fluxmorph-solver --bench
//! kernels`.
//!
//! The clock is the process's CPU time, so that a loaded machine does not change the numbers much; criterion's *elements
//! per second* of a loop are tetrahedra, of a product stored entries, of operations on vectors unknowns. The mesh is a
//! quarter of a shield plate with its skin meshed.

#[path = "../../../benches/clock/mod.rs"]
mod clock;

use std::hint::black_box;

use clock::CpuTime;
use criterion::{BenchmarkGroup, Criterion, Throughput};
use fluxmorph_geometry::fem::{LocalMatrix, advance, c64, dot, norm};
use fluxmorph_geometry::generate::{ShieldParameters, shield};
use fluxmorph_geometry::tet4::{Point, Tet4};
use fluxmorph_geometry::{ElementId, Mesh};
use fluxmorph_solver::boundary::Boundary;
use fluxmorph_solver::coil::{Coil, CoilShape, Corner, Racetrack};
use fluxmorph_solver::element::impedance::{self, ImpedanceTriangle};
use fluxmorph_solver::element::interface::{self, InterfaceTriangle};
use fluxmorph_solver::element::lagrange::Lagrange;
use fluxmorph_solver::element::point;
use fluxmorph_solver::element::quadratic::LagrangeTet;
use fluxmorph_solver::element::volume::{AphiTet, Coefficients, NodalField};
use fluxmorph_solver::element::{Complex3, density};
use fluxmorph_solver::functional::Functional;
use fluxmorph_solver::material::Material;
use fluxmorph_solver::{ElementFamily, FieldModel, FieldModelSetup, Order, adjoint};

const VERTICES: [Point; 4] = [[0.1, 0.2, -0.1], [1.3, 0.1, 0.2], [0.3, 0.9, 0.1], [0.2, 0.3, 1.4]];
const AIR: Coefficients = Coefficients { reluctivity: 1.7, extra_penalty: 0.0, eddy: c64::new(0.0, 0.0) };
const STEEL: Coefficients = Coefficients { reluctivity: 0.2, extra_penalty: 0.0, eddy: c64::new(0.0, 2.3) };

fn noise(seed: usize) -> c64 {
    let x = seed as f64;
    c64::new((12.9898 * x + 1.0).sin(), (78.233 * x + 2.0).sin())
}

fn field<const N: usize>(seed: usize) -> NodalField<N> {
    NodalField::new(std::array::from_fn(|a| std::array::from_fn(|c| noise(seed + 4 * a + c))))
}

/// The sum of all entries: everything of the matrix is computed.
fn total<const N: usize>(matrix: &impl LocalMatrix<c64, N, 4>) -> c64 {
    let pairs = (0..N).flat_map(|a| (0..N).map(move |b| (a, b)));
    pairs.map(|(a, b)| matrix.block(a, b).iter().flatten().sum::<c64>()).sum()
}

fn element_kernels(group: &mut BenchmarkGroup<'_, CpuTime>) {
    let (linear, quadratic) = (Lagrange::<4, 4>::tet(), Lagrange::<10, 4>::tet());
    for (material, law) in [("air", AIR), ("steel", STEEL)] {
        group.bench_function(format!("matrix, linear, {material}"), |b| {
            b.iter(|| total(&AphiTet::new(Tet4::new(black_box(VERTICES)), law)));
        });
        group.bench_function(format!("matrix, quadratic, {material}"), |b| {
            b.iter(|| total(&LagrangeTet::new(quadratic, Tet4::new(black_box(VERTICES)), law)));
        });
        let (l, u) = (field::<4>(1), field::<4>(40));
        group.bench_function(format!("shape derivative, linear, {material}"), |b| {
            b.iter(|| point::shape_derivative(linear, &Tet4::new(black_box(VERTICES)), &law, &l, &u));
        });
        let (l, u) = (field::<10>(1), field::<10>(90));
        group.bench_function(format!("shape derivative, quadratic, {material}"), |b| {
            b.iter(|| point::shape_derivative(quadratic, &Tet4::new(black_box(VERTICES)), &law, &l, &u));
        });
    }
    let (u, u_quadratic) = (field::<4>(1), field::<10>(1));
    group.bench_function("energy, linear", |b| {
        b.iter(|| {
            density::flux_integral(
                linear,
                &Tet4::new(black_box(VERTICES)),
                &u,
                density::squared_deviation(0.7, [0.0; 3]),
            )
        });
    });
    group.bench_function("energy, quadratic", |b| {
        b.iter(|| {
            density::flux_integral(
                quadratic,
                &Tet4::new(black_box(VERTICES)),
                &u_quadratic,
                density::squared_deviation(0.7, [0.0; 3]),
            )
        });
    });
    group.bench_function("eddy loss, linear", |b| {
        b.iter(|| density::eddy_loss(linear, &Tet4::new(black_box(VERTICES)), 0.7, &u));
    });
    group.bench_function("eddy loss, quadratic", |b| {
        b.iter(|| density::eddy_loss(quadratic, &Tet4::new(black_box(VERTICES)), 0.7, &u_quadratic));
    });
}

fn triangle_kernels<const F: usize>(
    group: &mut BenchmarkGroup<'_, CpuTime>,
    order: &str,
    shape: &'static Lagrange<F, 3>,
) {
    let corners = [VERTICES[0], VERTICES[1], VERTICES[2]];
    let coefficient = c64::new(0.3, 0.3);
    let (l, u) = (field::<F>(1).vector_potential, field::<F>(70).vector_potential);
    group.bench_function(format!("interface matrix, {order}"), |b| {
        b.iter(|| total(&InterfaceTriangle::new(shape, black_box(corners), 1.3)));
    });
    group.bench_function(format!("interface shape derivative, {order}"), |b| {
        b.iter(|| interface::shape_derivative(shape, black_box(1.3), &l, &u));
    });
    group.bench_function(format!("impedance matrix, {order}"), |b| {
        b.iter(|| total(&ImpedanceTriangle::new(shape, black_box(corners), coefficient)));
    });
    group.bench_function(format!("impedance shape derivative, {order}"), |b| {
        let all = |vector: &[Complex3; F]| vector.map(|[x, y, z]| [x, y, z, x]);
        let (l, u) = (all(&l), all(&u));
        b.iter(|| impedance::shape_derivative(shape, black_box(corners), coefficient, &l, &u));
    });
}

/// A quarter of a steel plate under a coil, at 60 Hz.
fn plate(refinement: f64, order: Order) -> (FieldModel, Mesh) {
    let parameters = ShieldParameters {
        skin: [0.3, 0.8, 1.6, 3.0, 5.0].map(|d| 1e-3 * d).to_vec(),
        side_skin: [0.5, 1.5, 4.0, 10.0].map(|d| 1e-3 * d).to_vec(),
        side_air: 4e-3,
        growth: 1.8,
        refinement,
        ..ShieldParameters::default()
    };
    let mesh = shield(&parameters).expect("the parameters are those of a shipped configuration");
    let topology = mesh.topology();
    let material = |name: &String| Material {
        relative_permeability: if name == "plate" { 800.0 } else { 1.0 },
        conductivity: if name == "plate" { 7e6 } else { 0.0 },
    };
    let faces = ["x_min", "x_max", "y_min", "y_max", "z_min", "z_max"];
    let coil = Racetrack::new([0.0, 0.0, 0.06], 2, [0.06, 0.16], 0.02, 0.04, Corner::Mitred);
    let shape = CoilShape::Racetrack(coil.expect("the sizes are positive"));
    let setup = FieldModelSetup {
        family: ElementFamily::Nodal,
        frequency: 60.0,
        order,
        materials: topology.region_names().iter().map(material).collect(),
        coils: vec![Coil { name: "coil".to_owned(), ampere_turns: c64::new(4e4, 0.0), shape }],
        boundaries: faces.map(|name| (name.to_owned(), Boundary::FluxParallel)).to_vec(),
        ..FieldModelSetup::default()
    };
    let model = FieldModel::new(&mesh, setup).expect("a sound problem");
    (model, mesh)
}

fn loops(criterion: &mut Criterion<CpuTime>, order: Order, refinement: f64) {
    let (model, mesh) = plate(refinement, order);
    let elements: Vec<ElementId> = mesh.topology().elements().collect();
    let mut group = criterion.benchmark_group(format!("{order:?}, {} tets", elements.len()));
    group.throughput(Throughput::Elements(elements.len() as u64));
    group.bench_function("assembly", |b| b.iter(|| model.assemble(&mesh)));
    group.bench_function("load", |b| b.iter(|| model.load(&mesh)));
    let (state, system) = model.solve(&mesh).expect("a regular system");
    group.bench_function("gradient at nodes", |b| {
        b.iter(|| adjoint::node_gradient((&model, &mesh, &state), &state, &elements));
    });
    group.bench_function("flux densities", |b| b.iter(|| state.flux_densities(&model, &mesh)));
    group.bench_function("current densities", |b| {
        b.iter(|| state.current_densities_of(&model, &mesh, &elements))
    });
    group.bench_function("losses", |b| b.iter(|| state.losses(&model, &mesh)));
    let energy = Functional::energy(&model, None).expect("the mesh is not empty");
    group.bench_function("energy functional", |b| b.iter(|| energy.evaluate((&model, &mesh, &state))));
    let matrix = system.matrix().expect("one process has the matrix");
    let mut image = vec![c64::default(); matrix.structure.row_count()];
    group.throughput(Throughput::Elements(matrix.values.len() as u64));
    group.bench_function("matrix product", |b| b.iter(|| matrix.mul(state.values(), &mut image)));
    group.throughput(Throughput::Elements(image.len() as u64));
    group.bench_function("dot", |b| b.iter(|| dot(state.values(), black_box(&image))));
    group.bench_function("norm", |b| b.iter(|| norm(black_box(&image))));
    let (mut x, mut r) = (image.clone(), image.clone());
    let step = c64::new(1e-9, 0.0);
    group.bench_function("step of conjugate gradients", |b| {
        b.iter(|| advance(step, (&mut x, &image), (&mut r, state.values())));
    });
    group.finish();
}

fn main() {
    let mut criterion = clock::on_one_thread();
    let mut group = criterion.benchmark_group("element");
    element_kernels(&mut group);
    triangle_kernels(&mut group, "linear", Lagrange::<3, 3>::triangle());
    triangle_kernels(&mut group, "quadratic", Lagrange::<6, 3>::triangle());
    group.finish();
    loops(&mut criterion, Order::Linear, 1.0);
    loops(&mut criterion, Order::Quadratic, 0.5);
    criterion.final_summary();
}
