//! Edge elements from outside: the gauge changes no field, and every conductor has its gradients.

use std::sync::Arc;

use fluxmorph_geometry::generate::{ShieldParameters, shield};
use fluxmorph_geometry::{Mesh, NodeId, Topology};
use fluxmorph_solver::coil::{Coil, Corner, Racetrack};
use fluxmorph_solver::{Boundary, ElementFamily, FieldModel, FieldModelSetup, Material, Order};

use super::OUTSIDE;

const STEEL: Material = Material { relative_permeability: 800.0, conductivity: 7e6 };

fn coarse() -> Mesh {
    let parameters = ShieldParameters {
        refinement: 0.3,
        skin: vec![1e-3],
        side_skin: Vec::new(),
        ..ShieldParameters::default()
    };
    shield(&parameters).expect("a coarse shield")
}

/// The same mesh with its nodes numbered in another order: another tree, and every edge the other way round.
fn renumbered(mesh: &Mesh) -> Mesh {
    let topology = mesh.topology();
    let count = topology.node_count();
    // A step that shares no factor with the count visits every node.
    let step = (2..).map(|k| 2 * k + 1).find(|step| gcd(*step, count) == 1).expect("one of them");
    let new = |n: NodeId| NodeId::new((count - 1 - n.index()) * step % count);
    let mut points = vec![[0.0; 3]; count];
    for node in topology.nodes() {
        points[new(node).index()] = mesh.point(node);
    }
    let tets = topology.tets().iter().map(|tet| tet.map(new)).collect();
    let (regions, names) = (topology.region_of().to_vec(), topology.region_names().to_vec());
    let mut other = Topology::new(count, tets, names, regions).expect("the same topology");
    for name in OUTSIDE {
        let triangles = topology.surface(name).expect("an outer face").iter().map(|t| t.map(new)).collect();
        other = other.with_surface(name, triangles).expect("the same face");
    }
    Mesh::new(Arc::new(other), points).expect("the same mesh")
}

fn gcd(a: usize, b: usize) -> usize {
    if b == 0 { a } else { gcd(b, a % b) }
}

fn model(mesh: &Mesh, order: Order, frequency: f64) -> FieldModel {
    let names = mesh.topology().region_names();
    let racetrack =
        Racetrack::new([0.0, 0.0, 0.06], 2, [0.06, 0.16], 0.02, 0.04, Corner::Mitred).expect("a coil");
    let coil = Coil { name: "coil".to_owned(), ampere_turns: 40e3.into(), shape: racetrack.into() };
    let setup = FieldModelSetup {
        frequency,
        family: ElementFamily::Edge,
        order,
        materials: names.iter().map(|n| if n == "plate" { STEEL } else { Material::AIR }).collect(),
        coils: vec![coil],
        boundaries: OUTSIDE.map(|name| (name.to_owned(), Boundary::FluxParallel)).to_vec(),
        ..FieldModelSetup::default()
    };
    FieldModel::new(mesh, setup).expect("a sound problem")
}

/// `B` in every element and the losses are those of another tree; to 1e-9 of the largest.
#[test]
fn the_tree_changes_no_field() {
    let mesh = coarse();
    let other = renumbered(&mesh);
    for order in [Order::Linear, Order::Quadratic] {
        for frequency in [0.0, 60.0] {
            let [one, two] = [&mesh, &other].map(|mesh| {
                let model = model(mesh, order, frequency);
                let (solution, _) = model.solve(mesh).expect("it is solved");
                (solution.flux_densities(&model, mesh), solution.losses(&model, mesh))
            });
            let size =
                |b: &[_; 3]| b.iter().map(|c: &fluxmorph_geometry::fem::c64| c.norm_sqr()).sum::<f64>();
            let largest = one.0.iter().map(size).fold(0.0, f64::max).sqrt();
            let deviation = one.0.iter().zip(&two.0).map(|(a, b)| {
                let difference = std::array::from_fn(|d| a[d] - b[d]);
                size(&difference).sqrt()
            });
            let deviation = deviation.fold(0.0, f64::max) / largest;
            assert!(deviation < 1e-9, "{order:?}, {frequency} Hz: {deviation:e}");
            for ((_, a), (_, b)) in one.1.iter().zip(&two.1) {
                assert!((a / b - 1.0).abs() < 1e-9, "{order:?}: {a} and {b}");
            }
        }
    }
}

/// Outside conductors there are as many unknowns as edges off a spanning tree; gradients are in conductors alone.
#[test]
fn unknowns_are_what_the_gauge_leaves() {
    let mesh = coarse();
    let model = model(&mesh, Order::Linear, 0.0);
    let space = model.space();
    let on_faces = |n: NodeId| {
        let inside = |d: usize| {
            let [lower, upper] = mesh.bounding_box();
            mesh.point(n)[d] > lower[d] && mesh.point(n)[d] < upper[d]
        };
        !(0..3).all(inside)
    };
    let inner = mesh.topology().nodes().filter(|&n| !on_faces(n)).count();
    // An edge is known where it lies in an outer face: both ends on it, and its middle too.
    let free = |edge: &[NodeId; 2]| {
        let [lower, upper] = mesh.bounding_box();
        let [a, b] = edge.map(|n| mesh.point(n));
        !(0..3).any(|d| a[d] == b[d] && (a[d] == lower[d] || a[d] == upper[d]))
    };
    let edges = space.edges().iter().filter(|edge| free(edge)).count();
    // The outside is one set; each inner node is reached by one branch.
    assert_eq!(model.unknown_count(), edges - inner);
}
