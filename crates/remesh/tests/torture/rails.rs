//! Which designs the two laws carry along one axis in one step, on the shield's meshed plate and a coarse one: the optimum's
//! frame, random designs filtered and not, uniform ones and spikes.

use cpu_time::ProcessTime;

use crate::support::{self, Point, noise};
use fluxmorph_geometry::generate::{ShieldParameters, shield};
use fluxmorph_geometry::{Mesh, NodeId};
use fluxmorph_remesh::{Motion, MotionLaw, RemeshSetup, StiffnessPolicy};

/// −5 and 20 mm: the bounds of configs/shield.toml.
const BOUNDS: [f64; 2] = [-0.005, 0.020];

/// Random designs of each kind.
const SEEDS: u64 = 20;

/// A kind of design, and the displacements of its designs [m, towards −z].
struct Kind {
    name: &'static str,
    designs: Vec<Vec<f64>>,
}

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
    vec![
        Kind { name: "uniform, −5 and +20 mm", designs: BOUNDS.map(|z| vec![z; nodes.len()]).to_vec() },
        Kind { name: "frame, a step over one cell", designs: vec![frame.clone()] },
        Kind { name: "frame, filtered over 30 mm", designs: vec![filtered(mesh, nodes, &frame, 0.03)] },
        Kind { name: "random, filtered over 30 mm", designs: of_random(0.03) },
        Kind { name: "random, every node", designs: (0..SEEDS).map(random).collect() },
        Kind { name: "spikes of 20 mm", designs: (0..14).map(|k| spike(k, high)).collect() },
        Kind { name: "holes of 5 mm", designs: (0..14).map(|k| spike(k, low)).collect() },
    ]
}

/// Designs carried, and CPU seconds each.
fn carried(motion: &Motion, kind: &Kind) -> (usize, f64) {
    let clock = ProcessTime::now();
    let is_carried = |values: &&Vec<f64>| {
        let design: Vec<Point> = values.iter().map(|z| [0.0, 0.0, -z]).collect();
        motion.moved(&design).is_ok()
    };
    let count = kind.designs.iter().filter(is_carried).count();
    (count, clock.elapsed().as_secs_f64() / kind.designs.len() as f64)
}

fn coarse_shield() -> Mesh {
    shield(&ShieldParameters { refinement: 0.7, ..ShieldParameters::default() }).unwrap()
}

#[test]
fn rails_carry_what_is_filtered_and_more_of_all_else_than_one_linear_step() {
    for (name, mesh) in [("meshed plate", support::meshed_shield()), ("coarser", coarse_shield())] {
        let nodes = support::plate_bottom(&mesh);
        let of_law = |law: MotionLaw| {
            let setup =
                support::shield_setup(&mesh, &["plate", "remesh"], StiffnessPolicy::InverseVolume, 0.0);
            Motion::new(mesh.clone(), RemeshSetup { law, ..setup }).unwrap()
        };
        let [linear, rails] = [MotionLaw::Linear, MotionLaw::Rails(2)].map(of_law);
        println!("{name}: {} tets, {} equations", mesh.topology().tets().len(), rails.map().equation_count());
        println!("| designs | of | linear, one step | rails | CPU s each: linear | rails |");
        for kind in kinds(&mesh, &nodes) {
            let [(by_linear, linear_time), (by_rails, rails_time)] =
                [&linear, &rails].map(|m| carried(m, &kind));
            let total = kind.designs.len();
            println!(
                "| {} | {total} | {by_linear} | {by_rails} | {linear_time:.3} | {rails_time:.3} |",
                kind.name
            );
            assert!(by_rails >= by_linear, "{}", kind.name);
            assert!(by_rails == total || !kind.name.contains("filtered"), "{}", kind.name);
        }
    }
}
