//! Edge elements from outside: the gauge changes no field, and every conductor has its gradients.

use std::collections::HashSet;
use std::sync::Arc;

use fluxmorph_geometry::fem::c64;
use fluxmorph_geometry::tet4::Point;
use fluxmorph_geometry::{Mesh, NodeId, RegionId, Topology};
use fluxmorph_solver::linear::LinearSolverSettings;
use fluxmorph_solver::{FieldModel, FieldModelSetup, Material, Order};

use super::{OUTSIDE, STEEL, coarse_shield, flux_parallel, lines, over_a_plate, painted};

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
    // Residuals of 1e-11 leave 1.3e-9 of the field in statics, where a gauge is all that holds the gradients; 1e-12 leaves 4e-11.
    let linear_solver = LinearSolverSettings { tolerance: 1e-12, ..LinearSolverSettings::default() };
    let setup = FieldModelSetup { order, linear_solver, ..over_a_plate(mesh, STEEL, 40e3, frequency) };
    FieldModel::new(mesh, setup).expect("a sound problem")
}

/// The largest difference of two fields, of the largest of the first.
fn largest_deviation(one: &[[c64; 3]], two: &[[c64; 3]]) -> f64 {
    let size = |b: &[c64; 3]| b.iter().map(|c| c.norm_sqr()).sum::<f64>();
    let largest = one.iter().map(size).fold(0.0, f64::max).sqrt();
    let difference = |(a, b): (&[c64; 3], &[c64; 3])| size(&std::array::from_fn(|d| a[d] - b[d])).sqrt();
    one.iter().zip(two).map(difference).fold(0.0, f64::max) / largest
}

/// `B` in every element and the losses are those of another tree; to 1e-9 of the largest.
#[test]
fn the_tree_changes_no_field() {
    let mesh = coarse_shield();
    let other = renumbered(&mesh);
    for order in [Order::Linear, Order::Quadratic] {
        for frequency in [0.0, 60.0] {
            let [one, two] = [&mesh, &other].map(|mesh| {
                let model = model(mesh, order, frequency);
                let (solution, _) = model.solve(mesh).expect("it is solved");
                (solution.flux_densities(&model, mesh), solution.losses(&model, mesh))
            });
            let deviation = largest_deviation(&one.0, &two.0);
            assert!(deviation < 1e-9, "{order:?}, {frequency} Hz: {deviation:e}");
            for ((_, a), (_, b)) in one.1.iter().zip(&two.1) {
                assert!((a / b - 1.0).abs() < 1e-9, "{order:?}: {a} and {b}");
            }
        }
    }
}

/// A bar of magnet beside a tunnel through the mesh; `walls` are flux-parallel, all else is natural.
fn beside_a_tunnel(mesh: &Mesh, order: Order, walls: &[&str]) -> FieldModel {
    let setup = FieldModelSetup {
        order,
        materials: vec![Material::AIR; mesh.topology().region_names().len()],
        remanence: vec![[0.0; 3], [0.2, 0.5, 1.0]],
        boundaries: flux_parallel(walls),
        ..FieldModelSetup::default()
    };
    FieldModel::new(mesh, setup).expect("a sound problem")
}

/// The tree leaves out an edge for each vertex but one of every part; each tunnel with free walls takes one more, and walls
/// that are apart count as one vertex each. Otherwise the matrix is singular, and what is solved depends on rounding.
#[test]
fn a_tunnel_and_walls_that_are_apart_leave_one_field() {
    let region = |x: Point| match [(x[0] * 100.0) as usize, (x[1] * 100.0) as usize] {
        [1, 1] => 2,
        [2, 1] => 1,
        _ => 0,
    };
    let mesh = painted([4, 3, 2].map(|n| lines(n, 0.01)), &["air", "magnet", "hole"], region);
    let (mesh, _) = mesh.without_region(RegionId(2)).expect("what is left");
    let other = renumbered(&mesh);
    for (walls, tunnels) in [(&[][..], 1), (&["x_min", "x_max"], 1), (&["z_min", "z_max"], 0)] {
        for order in [Order::Linear, Order::Quadratic] {
            let [one, two] = [&mesh, &other].map(|mesh| {
                let model = beside_a_tunnel(mesh, order, walls);
                let (solution, _) = model.solve(mesh).expect("it is solved");
                solution.flux_densities(&model, mesh)
            });
            let deviation = largest_deviation(&one, &two);
            assert!(deviation < 1e-9, "{walls:?}, {order:?}: {deviation:e}");
        }
        let model = beside_a_tunnel(&mesh, Order::Linear, walls);
        let on_wall: Vec<HashSet<NodeId>> = walls
            .iter()
            .map(|name| mesh.topology().surface(name).expect("a side").iter().flatten().copied().collect())
            .collect();
        let free = |edge: &&[NodeId; 2]| {
            let middle_is_on = |nodes: &HashSet<NodeId>| edge.iter().all(|n| nodes.contains(n));
            !on_wall.iter().any(middle_is_on)
        };
        let edges = model.space().edges().iter().filter(free).count();
        let sets = mesh.topology().node_count() - on_wall.iter().map(|nodes| nodes.len() - 1).sum::<usize>();
        assert_eq!(model.unknown_count(), edges - (sets - 1) - tunnels, "{walls:?}");
    }
}

/// Outside conductors there are as many unknowns as edges off a spanning tree; gradients are in conductors alone.
#[test]
fn unknowns_are_what_the_gauge_leaves() {
    let mesh = coarse_shield();
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
