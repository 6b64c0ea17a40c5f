//! The motions: a block's top line, a growing ball, a cylinder shifted and turned, the shield at its roughest.

use std::path::Path;

use fluxmorph_geometry::Mesh;
use fluxmorph_geometry::generate::{BlockParameters, ShieldParameters, block, shield};
use fluxmorph_geometry::io::msh::read_msh_file;
use fluxmorph_geometry::tet4::{add, cross, sub};
use fluxmorph_remesh::{Boundary, BoundaryKind, KinematicConstraint, RemeshSetup, Subregion};

use super::case::Case;
use crate::support::{Point, nodes_where, plate_bottom, shield_setup, whole};

/// The middle line of a block's top face moves by a share of the block's edge, upwards if positive. The bottom is fixed,
/// the sides slide, the rest of the top is free.
pub(crate) fn block_line(share: f64) -> Case {
    let parameters = BlockParameters::default();
    let mesh = block(&parameters).expect("the default block");
    let [_, width, height] = parameters.size;
    let kind =
        |name: &str, kind| Boundary::of_surface(mesh.topology(), name, kind).expect("a face of the block");
    let slide = |name: &&str| kind(name, BoundaryKind::Slide);
    let mut boundaries: Vec<_> = ["x_min", "x_max", "y_min", "y_max"].iter().map(slide).collect();
    boundaries.push(kind("z_max", BoundaryKind::Free));
    let setup = RemeshSetup {
        subregions: whole(&mesh),
        design_nodes: nodes_where(&mesh, |p| p[2] == height && (p[1] - width / 2.0).abs() < 1e-9),
        boundaries,
        ..RemeshSetup::default()
    };
    let name = format!("block, top line {:+.0} %", 100.0 * share);
    Case::new(&name, mesh, setup, move |t, _| [0.0, 0.0, t * share * height])
}

/// A mesh of `configs/meshes`, in millimetres.
pub(crate) fn shipped(file: &str) -> Mesh {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../configs/meshes").join(file);
    read_msh_file(&path, 1e-3).expect("a shipped mesh").mesh
}

/// Every region of a mesh with the default law, one surface designed.
fn surface_setup(mesh: &Mesh, surface: &str) -> RemeshSetup {
    let topology = mesh.topology();
    let mut design_nodes = topology.surface(surface).expect("a surface").concat();
    design_nodes.sort_unstable();
    design_nodes.dedup();
    let of_region = |name: &String| Subregion::of_region(topology, name).expect("a region");
    RemeshSetup {
        subregions: topology.region_names().iter().map(of_region).collect(),
        design_nodes,
        ..RemeshSetup::default()
    }
}

/// A ball inside a box grows to 2.5 times its radius; the box, of half size 4 r, stays.
pub(crate) fn growing_ball() -> Case {
    let mesh = shipped("ball.msh");
    let setup = surface_setup(&mesh, "ball_surface");
    Case::new("ball growing to 2.5 r", mesh, setup, |t, p| p.map(|c| 1.5 * t * c))
}

/// Half size of the box, radius and half length of the cylinder of `rotor.msh` [m].
const ROTOR: [f64; 3] = [30e-3, 10e-3, 15e-3];

/// The cylinder is shifted along x by 80 % of its gap to the box while it turns by 45° about an axis through its centre.
fn rotor(name: &str, axis: Point, gap: f64) -> Case {
    let mesh = shipped("rotor.msh");
    let setup = surface_setup(&mesh, "rotor_surface");
    Case::new(name, mesh, setup, move |t, p| {
        add([t * 0.8 * gap, 0.0, 0.0], sub(turned(p, axis, t * std::f64::consts::FRAC_PI_4), p))
    })
}

pub(crate) fn rotor_about_own_axis() -> Case {
    let [half, radius, _] = ROTOR;
    rotor("cylinder +80 % of its gap, 45° about its axis", [0.0, 0.0, 1.0], half - radius)
}

/// Turned about y, the cylinder reaches further along x: the gap is what it then leaves.
pub(crate) fn rotor_about_cross_axis() -> Case {
    let [half, radius, half_length] = ROTOR;
    let reach = (radius + half_length) * std::f64::consts::FRAC_1_SQRT_2;
    rotor("cylinder +80 % of its gap, 45° across its axis", [0.0, 1.0, 0.0], half - reach)
}

/// A point turned about a unit axis through the origin (Rodrigues).
pub(crate) fn turned(p: Point, axis: Point, angle: f64) -> Point {
    let once = cross(axis, p);
    let twice = cross(axis, once);
    std::array::from_fn(|d| p[d] + angle.sin() * once[d] + (1.0 - angle.cos()) * twice[d])
}

/// The plate of configs/shield.toml.
pub(crate) fn shield_parameters() -> ShieldParameters {
    ShieldParameters {
        skin: vec![0.3e-3, 0.8e-3, 1.6e-3, 3e-3, 5e-3],
        side_skin: vec![0.5e-3, 1.5e-3, 4e-3, 10e-3],
        side_air: 4e-3,
        growth: 1.8,
        ..ShieldParameters::default()
    }
}

/// Added thickness at the bounds [m].
const THICKNESS: [f64; 2] = [-5e-3, 20e-3];

/// Control points at the 20 mm pitch alternate between the bounds, bilinear between them: 5 and 30 mm.
pub(crate) fn alternating_control_points(
    p: &ShieldParameters,
    kinematic_constraint: KinematicConstraint,
) -> Case {
    let pitch = p.pitch;
    let last = [0, 1].map(|d| (p.plate[d] / pitch).round() as usize - 1);
    let thickened = move |x: Point| {
        let cell = [0, 1].map(|d| ((x[d] / pitch + 1e-9) as usize).min(last[d]));
        let [s, t] = [0, 1].map(|d| x[d] / pitch - cell[d] as f64);
        let at = |i: usize, j: usize| THICKNESS[(cell[0] + i + cell[1] + j) % 2];
        (1.0 - s) * ((1.0 - t) * at(0, 0) + t * at(0, 1)) + s * ((1.0 - t) * at(1, 0) + t * at(1, 1))
    };
    shield_case("shield, control points 5/30 mm", p, kinematic_constraint, thickened)
}

/// Every node of the surface alternates with its neighbours along both grid lines.
pub(crate) fn alternating_nodes(p: &ShieldParameters, kinematic_constraint: KinematicConstraint) -> Case {
    let mesh = shield(p).expect("valid parameters");
    let lines: [Vec<f64>; 2] = [0, 1].map(|d| {
        let mut lines: Vec<f64> = plate_bottom(&mesh).iter().map(|&n| mesh.point(n)[d]).collect();
        lines.sort_by(f64::total_cmp);
        lines.dedup();
        lines
    });
    let thickened = move |x: Point| {
        let line = |d: usize| lines[d].partition_point(|l| *l < x[d]);
        THICKNESS[(line(0) + line(1)) % 2]
    };
    shield_case("shield, surface nodes 5/30 mm", p, kinematic_constraint, thickened)
}

fn shield_case(
    name: &str,
    p: &ShieldParameters,
    kinematic_constraint: KinematicConstraint,
    thickened: impl Fn(Point) -> f64 + Sync + 'static,
) -> Case {
    let mesh = shield(p).expect("valid parameters");
    let policy = Default::default();
    let poisson = match kinematic_constraint {
        KinematicConstraint::Free => 0.2,
        KinematicConstraint::Axis(_) => 0.0,
    };
    let setup =
        RemeshSetup { kinematic_constraint, ..shield_setup(&mesh, &["plate", "remesh"], policy, poisson) };
    let name = match kinematic_constraint {
        KinematicConstraint::Free => format!("{name}, free"),
        KinematicConstraint::Axis(_) => format!("{name}, along z"),
    };
    Case::new(&name, mesh, setup, move |t, p| [0.0, 0.0, -t * thickened(p)])
}
