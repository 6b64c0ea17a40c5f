//! Which designs the three laws carry along one axis in one step, on the shield's meshed plate and a coarse one: the optimum's
//! frame, random designs filtered and not, uniform ones and spikes.
//!
//! Every tetrahedron of these meshes has an edge along z, and its `J` on rails is the ratio of that edge's lengths: rails of
//! whatever energy carry a design exactly where every column of nodes has room between the face and where it is held. That
//! is the limit that the convex law is held against.

use std::collections::BTreeMap;

use fluxmorph_geometry::generate::{ShieldParameters, shield};
use fluxmorph_geometry::{Mesh, NodeId};
use fluxmorph_remesh::{Motion, MotionLaw};

use super::laws::{Device, Kind, Row, measured};
use crate::support::{self, Point, noise};

/// −5 and 20 mm: the bounds of configs/shield.toml.
const BOUNDS: [f64; 2] = [-0.005, 0.020];

/// Random designs of each kind.
const SEEDS: u64 = 20;

/// Those of every node that the hyperelastic law is tried on: it gives each up after half a minute.
const FEW: usize = 3;

const EVERY_NODE: &str = "random, every node";

/// Weighted means of the values around each node, with cones of a radius [m].
fn filtered(mesh: &Mesh, nodes: &[NodeId], values: &[f64], radius: f64) -> Vec<f64> {
    let mean = |at: &NodeId| {
        let weight = |other: &NodeId| {
            let (a, b) = (mesh.point(*at), mesh.point(*other));
            (1.0 - ((a[0] - b[0]).powi(2) + (a[1] - b[1]).powi(2)).sqrt() / radius).max(0.0)
        };
        let sums = nodes.iter().zip(values).fold((0.0, 0.0), |(sum, total), (node, value)| {
            (sum + weight(node) * value, total + weight(node))
        });
        sums.0 / sums.1
    };
    nodes.iter().map(mean).collect()
}

fn kinds(mesh: &Mesh, nodes: &[NodeId]) -> Vec<Kind> {
    let [low, high] = BOUNDS;
    let frame = |p: Point| if p[0] > 0.07 || p[1] > 0.15 { high } else { low };
    let frame: Vec<f64> = nodes.iter().map(|n| frame(mesh.point(*n))).collect();
    let random = |seed: u64| -> Vec<f64> {
        let mut noise = noise(seed);
        nodes.iter().map(|_| low + (high - low) * 0.5 * (1.0 + noise())).collect()
    };
    // A node in fourteen, on its own.
    let spike = |k: usize, value: f64| -> Vec<f64> {
        (0..nodes.len()).map(|i| if i == k * nodes.len() / 14 { value } else { 0.0 }).collect()
    };
    let of_random = |radius: f64| (0..SEEDS).map(|s| filtered(mesh, nodes, &random(s), radius)).collect();
    let kind = |name: &str, designs: Vec<Vec<f64>>| {
        let along = |values: Vec<f64>| values.into_iter().map(|z| [0.0, 0.0, -z]).collect();
        Kind { name: name.to_owned(), designs: designs.into_iter().map(along).collect() }
    };
    vec![
        kind("uniform, −5 and +20 mm", BOUNDS.map(|z| vec![z; nodes.len()]).to_vec()),
        kind("frame of the optimum, a step over one cell", vec![frame.clone()]),
        kind("the same, filtered over 30 mm", vec![filtered(mesh, nodes, &frame, 0.03)]),
        kind("random, filtered over 30 mm", of_random(0.03)),
        kind(EVERY_NODE, (0..SEEDS).map(random).collect()),
        kind("spikes of 20 mm at one node", (0..14).map(|k| spike(k, high)).collect()),
        kind("holes of 5 mm at one node", (0..14).map(|k| spike(k, low)).collect()),
    ]
}

/// Whether any motion on rails carries a design: columns of nodes above one another, held where the body ends, in order.
fn is_within_limit(motion: &Motion, design: &[Point]) -> bool {
    let (mesh, map) = (motion.original(), motion.map());
    let mut columns = BTreeMap::<[u64; 2], Vec<(f64, Option<f64>)>>::new();
    let design: BTreeMap<NodeId, f64> =
        map.design_nodes().iter().copied().zip(design.iter().map(|u| u[2])).collect();
    for node in mesh.topology().nodes() {
        let [x, y, z] = mesh.point(node);
        let known =
            design.get(&node).copied().or((map.unknown_part(node, [0.0, 0.0, 1.0])[2] == 0.0).then_some(0.0));
        columns.entry([x.to_bits(), y.to_bits()]).or_default().push((z, known.map(|u| z + u)));
    }
    columns.into_values().all(|mut column| {
        column.sort_by(|a, b| a.0.total_cmp(&b.0));
        let known: Vec<f64> = column.iter().filter_map(|(_, place)| *place).collect();
        known.windows(2).all(|pair| pair[0] < pair[1])
    })
}

fn every_element_has_an_edge_along_z(mesh: &Mesh) -> bool {
    mesh.topology().elements().all(|e| {
        let v = mesh.vertices(e);
        (0..4).any(|a| (0..a).any(|b| v[a][0] == v[b][0] && v[a][1] == v[b][1]))
    })
}

/// The table of designs along one axis, on both meshes.
pub(crate) fn table() -> String {
    let mut table = "| tetrahedra | designs | of | limit | linear | least J | worst q | steps | CPU s | rails | least J | worst q | steps | CPU s | hyperelastic | least J | worst q | steps | CPU s |\n|---|---|---|---|---|---|---|---|---|---|---|---|---|---|---|---|---|---|---|\n".to_owned();
    let coarse = ShieldParameters { refinement: 0.7, ..ShieldParameters::default() };
    for mesh in [support::meshed_shield(), shield(&coarse).expect("valid")] {
        assert!(every_element_has_an_edge_along_z(&mesh));
        let setup = support::shield_setup(&mesh, &["plate", "remesh"], Default::default(), 0.0);
        let device = Device { mesh, setup };
        let laws = [MotionLaw::Linear, MotionLaw::Rails(2), MotionLaw::Hyperelastic];
        let motions = laws.map(|law| device.motion(law));
        for kind in kinds(&device.mesh, &device.setup.design_nodes) {
            let of = kind.designs.len();
            let limit = kind.designs.iter().filter(|design| is_within_limit(&motions[1], design)).count();
            let few = if kind.name == EVERY_NODE { FEW } else { of };
            let rows: [Row; 3] =
                std::array::from_fn(|k| measured(&motions[k], &kind.designs[..[of, of, few][k]]));
            let cells = rows.each_ref().map(|row| row.cells(of)).join(" | ");
            let tets = device.mesh.topology().tets().len();
            let line = format!("| {tets} | {} | {of} | {limit} | {cells} |\n", kind.name);
            print!("{line}");
            let [linear, rails, _] = rows;
            assert!(rails.carried == limit && rails.carried >= linear.carried, "{}", kind.name);
            table += &line;
        }
    }
    table
}

#[test]
#[ignore = "minutes: designs that are far beyond what hyperelastic motion carries"]
fn rails_carry_all_that_any_motion_along_the_axis_can() {
    table();
}
