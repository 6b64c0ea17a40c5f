//! Motions in several directions: a ball in a box that grows, shrinks, wanders, turns and roughens, a cylinder shifted and
//! turned, a block's top line.

use std::path::Path;

use fluxmorph_geometry::generate::{BlockParameters, block};
use fluxmorph_geometry::io::msh::read_msh_file;
use fluxmorph_geometry::tet4::{add, cross};
use fluxmorph_remesh::{Boundary, BoundaryKind, MotionLaw, RemeshSetup, Subregion};

use super::laws::{Device, Kind, measured};
use crate::support::{Point, nodes_where, noise, whole};

/// Random designs.
const SEEDS: u64 = 20;

/// Radius of the ball [m]; its box has four times that as its half size.
const RADIUS: f64 = 0.01;

/// Half size of the box, radius and half length of the cylinder of `rotor.msh` [m].
const ROTOR: [f64; 3] = [30e-3, 10e-3, 15e-3];

/// A mesh of `configs/meshes`, in millimetres, with all its regions and one surface designed.
fn shipped(file: &str, surface: &str) -> Device {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../configs/meshes").join(file);
    let mesh = read_msh_file(&path, 1e-3).expect("a shipped mesh").mesh;
    let topology = mesh.topology();
    let mut design_nodes = topology.surface(surface).expect("a surface").concat();
    design_nodes.sort_unstable();
    design_nodes.dedup();
    let of_region = |name: &String| Subregion::of_region(topology, name).expect("a region");
    let subregions = topology.region_names().iter().map(of_region).collect();
    let setup = RemeshSetup { subregions, design_nodes, ..RemeshSetup::default() };
    Device { mesh, setup }
}

/// A block whose top line is designed; bottom fixed, sides sliding, rest of the top free.
fn ridge() -> (Device, f64) {
    let parameters = BlockParameters::default();
    let mesh = block(&parameters).expect("the default block");
    let [_, width, height] = parameters.size;
    let of = |name: &str, kind| Boundary::of_surface(mesh.topology(), name, kind).expect("a face");
    let mut boundaries = ["x_min", "x_max", "y_min", "y_max"].map(|s| of(s, BoundaryKind::Slide)).to_vec();
    boundaries.push(of("z_max", BoundaryKind::Free));
    let setup = RemeshSetup {
        subregions: whole(&mesh),
        design_nodes: nodes_where(&mesh, |p| p[2] == height && (p[1] - width / 2.0).abs() < 1e-9),
        boundaries,
        ..RemeshSetup::default()
    };
    (Device { mesh, setup }, height)
}

/// A point turned about a unit axis through the origin (Rodrigues), as a displacement.
fn turn(p: Point, axis: Point, degrees: f64) -> Point {
    let (once, angle) = (cross(axis, p), degrees.to_radians());
    let twice = cross(axis, once);
    std::array::from_fn(|d| angle.sin() * once[d] + (1.0 - angle.cos()) * twice[d])
}

fn of_ball(ball: &Device) -> Vec<Kind> {
    let scaled = |name: &str, factor: f64, shift: f64| {
        ball.moved(name, |p| add(p.map(|c| (factor - 1.0) * c), [shift * RADIUS, 0.0, 0.0]))
    };
    let spun =
        |name: &str, degrees: f64| ball.moved(name, |p| turn(p, [2.0 / 7.0, -3.0 / 7.0, 6.0 / 7.0], degrees));
    // Every node moved along its radius by up to a share of it.
    let rough = |name: &str, share: f64| {
        let nodes = &ball.setup.design_nodes;
        let design = |seed: u64| -> Vec<Point> {
            let mut noise = noise(seed);
            nodes
                .iter()
                .map(|n| (ball.mesh.point(*n), share * noise()))
                .map(|(p, s)| p.map(|c| s * c))
                .collect()
        };
        Kind { name: name.to_owned(), designs: (0..SEEDS).map(design).collect() }
    };
    vec![
        scaled("ball × 1.4", 1.4, 0.0),
        scaled("ball × 2", 2.0, 0.0),
        scaled("ball × 2.5", 2.5, 0.0),
        scaled("ball × 0.4", 0.4, 0.0),
        scaled("ball × 1.2, moved by R", 1.2, 1.0),
        scaled("ball × 1.2, moved by 2 R", 1.2, 2.0),
        spun("ball turned by 60°", 60.0),
        spun("ball turned by 150°", 150.0),
        rough("ball, every node ±10 % R", 0.1),
        rough("ball, every node ±20 % R", 0.2),
    ]
}

/// The cylinder is shifted along x by 80 % of its gap to the box and turned by 45° about an axis through its centre.
fn of_rotor(rotor: &Device) -> Vec<Kind> {
    let [half, radius, half_length] = ROTOR;
    let shifted = |name: &str, axis: Point, gap: f64| {
        rotor.moved(name, |p| add([0.8 * gap, 0.0, 0.0], turn(p, axis, 45.0)))
    };
    // Turned about y, it reaches further along x.
    let reach = (radius + half_length) * std::f64::consts::FRAC_1_SQRT_2;
    vec![
        shifted("cylinder + 80 % of its gap, 45° about its axis", [0.0, 0.0, 1.0], half - radius),
        shifted("cylinder + 80 % of its gap, 45° across its axis", [0.0, 1.0, 0.0], half - reach),
    ]
}

/// The table of motions in several directions.
pub(crate) fn table() -> String {
    let mut table = "| motion | of | linear | least J | worst q | steps | CPU s | hyperelastic | least J | worst q | steps | CPU s |\n|---|---|---|---|---|---|---|---|---|---|---|---|\n".to_owned();
    let (ball, rotor, (block, height)) =
        (shipped("ball.msh", "ball_surface"), shipped("rotor.msh", "rotor_surface"), ridge());
    let lines = [0.45, 0.8, -0.45, -0.8].map(|share| {
        block.moved(&format!("block, top line {:+.0} %", 100.0 * share), |_| [0.0, 0.0, share * height])
    });
    for (device, kinds) in [(&ball, of_ball(&ball)), (&rotor, of_rotor(&rotor)), (&block, lines.into())] {
        let laws = [MotionLaw::Linear, MotionLaw::Hyperelastic].map(|law| device.motion(law));
        for kind in kinds {
            let [linear, own] = laws.each_ref().map(|motion| measured(motion, &kind.designs));
            let line = format!(
                "| {} | {} | {} | {} |\n",
                kind.name,
                kind.designs.len(),
                linear.cells(kind.designs.len()),
                own.cells(kind.designs.len())
            );
            print!("{line}");
            assert_eq!(own.carried, kind.designs.len(), "{}", kind.name);
            table += &line;
        }
    }
    table
}

#[test]
fn the_hyperelastic_law_carries_every_motion_in_one_step() {
    table();
}
