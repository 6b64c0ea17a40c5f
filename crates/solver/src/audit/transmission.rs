//! What passes through conductors that their surfaces replace: behind such a surface there is no field but what goes around it.
//!
//! A wave that enters a wall of the thickness `t` with `A_t` along its face reaches the other one as `A_t e^(−γt)`, `γ = (1 + j)/δ`,
//! and is doubled there, where hardly any current leaves it. So the flux density across the face behind is `2 e^(−t/δ)` of that
//! across the face in front, and behind iron `|1 + (1 − j) μr δ/r|` times less, by the impedance of air over the distance `r` to
//! the wall (for a shell in a uniform field the limit of H. Kaden, Wirbelströme und Schirmung in der Nachrichtentechnik,
//! Springer 1959). What that makes at a place is taken from its mean square over the solid angle of the faces that it sees, with
//! their images in symmetry planes that cut the wall: all of it before a wide wall; √3 times as much inside a closed one, where
//! the mean square of the normal component of a uniform field is a third; less before a small one. Walls that stand behind others
//! are seen, too. So this is about what passes, and tells whether it matters.

use std::f64::consts::{PI, TAU};

use fluxmorph_geometry::NodeId;
use fluxmorph_geometry::directions::unit;
use fluxmorph_geometry::fem::c64;
use fluxmorph_geometry::tet4::{Point, area_vector, centroid, cross, dot, norm, sub};
use fluxmorph_geometry::topology::face_key;
use rayon::prelude::*;

use super::inside_of_outer_faces;
use super::walls::{Wall, walls};
use crate::element::dot3;
use crate::recovery::Plane;
use crate::solution::FieldState;
use crate::surface::{Conductor, SurfaceLaw};

/// Skin depths beyond which a wall passes nothing that matters: `2 e^(−t/δ)` is 2e-9.
const THICKEST: f64 = 21.0;

/// What passes through one conductor.
#[derive(Clone, Debug, PartialEq)]
pub struct Transmission {
    /// Name of the region.
    pub region: String,
    /// About the flux density at each place that was asked for [T].
    pub flux_densities: Vec<f64>,
}

/// A triangle behind a wall.
struct Exit {
    corners: [Point; 3],
    /// Amplitude of the flux density across it [T].
    flux_density: f64,
}

/// What passes through the impedance surfaces of a field, at places beside them; those that pass nothing are left out.
pub fn transmissions((model, mesh, solution): FieldState<'_>, places: &[Point]) -> Vec<Transmission> {
    let inside = inside_of_outer_faces(mesh);
    let of = |conductor: &Conductor| {
        let SurfaceLaw::Impedance(material) = conductor.law else { return None };
        let skin_depth = material.skin_depth(model.angular_frequency())?;
        let across = |triangle: &[NodeId; 3]| {
            let normal = unit(area_vector(triangle.map(|node| mesh.point(node))));
            let field = inside.get(&face_key(*triangle)).map(|&e| solution.flux_density(model, mesh, e));
            field.map_or(0.0, |field| dot3(field, normal.map(c64::from)).norm())
        };
        // A wall of several regions goes on through all that are alike.
        let is_alike = |other: &&Conductor| other.law == conductor.law && other.name != conductor.name;
        let others = model.conductors().iter().filter(is_alike).flat_map(|other| &other.surface);
        let faces: Vec<[NodeId; 3]> = conductor.surface.iter().chain(others).copied().collect();
        let corners: Vec<[Point; 3]> =
            faces.iter().map(|triangle| triangle.map(|node| mesh.point(node))).collect();
        let behind = |wall: &Option<Wall>| {
            let Some(Wall { thickness, opposite }) = *wall else { return 0.0 };
            2.0 * (-thickness / skin_depth).exp() * across(&faces[opposite])
        };
        let walls = walls(&corners, conductor.surface.len(), THICKEST * skin_depth);
        let exits: Vec<Exit> = corners
            .iter()
            .zip(&walls)
            .map(|(&corners, wall)| Exit { corners, flux_density: behind(wall) })
            .collect();
        if exits.iter().all(|exit| exit.flux_density == 0.0) {
            return None;
        }
        let planes = model.walls().planes_at(mesh, conductor.surface.as_flattened());
        let depth = material.relative_permeability * skin_depth;
        let at = |place: &Point| seen(&exits, &images(*place, &planes), depth);
        let flux_densities = places.par_iter().map(at).collect();
        Some(Transmission { region: conductor.name.clone(), flux_densities })
    };
    model.conductors().iter().filter_map(of).collect()
}

/// A place with its images in planes.
fn images(place: Point, planes: &[Plane]) -> Vec<Point> {
    let mut all = vec![place];
    for plane in planes {
        let beyond: Vec<Point> = all.iter().map(|x| plane.image(*x)).collect();
        all.extend(beyond);
    }
    all
}

/// About what passes to a place, seen from it and from its images [T], out of a wall with this `μr δ` [m].
fn seen(exits: &[Exit], images: &[Point], depth: f64) -> f64 {
    let (mut angle, mut squares, mut distances) = (0.0, 0.0, 0.0);
    for place in images {
        for exit in exits {
            let own = solid_angle(exit.corners.map(|corner| sub(corner, *place)));
            // Of a face that looks away the angle is negative.
            if own > 0.0 {
                angle += own;
                squares += own * exit.flux_density.powi(2);
                distances += own * norm(sub(centroid(exit.corners), *place));
            }
        }
    }
    if angle == 0.0 {
        return 0.0;
    }
    let reached = angle / TAU;
    let gain = if reached < 1.0 { reached.powi(2) } else { 1.0 + (angle.min(4.0 * PI) - TAU) / PI };
    let mismatch = depth * angle / distances;
    (gain * squares / angle).sqrt() / (1.0 + mismatch).hypot(mismatch)
}

/// The solid angle of a triangle seen from the origin, positive where its area vector points away (A. van Oosterom, J. Strackee, IEEE
/// Trans. Biomed. Eng. 30 (1983) 125).
fn solid_angle([a, b, c]: [Point; 3]) -> f64 {
    let (la, lb, lc) = (norm(a), norm(b), norm(c));
    let volume = dot(a, cross(b, c));
    let below = la * lb * lc + dot(a, b) * lc + dot(b, c) * la + dot(c, a) * lb;
    2.0 * volume.atan2(below)
}
