//! Where a coil may meet the outside of the mesh.
//!
//! A flux-parallel plane (B·n = 0) mirrors a current so that its normal part goes on and its tangential part turns
//! round: a coil may be cut there if its current crosses at right angles. At a flux-normal plane (n × H = 0) it is the
//! other way: no current may cross. There and on natural outer faces and impedance surfaces, the tangential part of the
//! test functions is free, and `∫T·curl w = ∫J·w + ∮(T × n)·w` holds the surface term that would make the natural
//! condition `n × (H − T) = 0`: `T` must be normal or zero. A coil that only touches a surface is not cut by it.
//!
//! An analytic coil is looked at in points of each face; a coil region by the current of the elements at its faces,
//! which is only nearly parallel to its walls: there the root mean square over a surface counts, against
//! [`REGION_TOLERANCE`].

use std::collections::HashMap;

use fluxmorph_geometry::tet4::{Point, add, area_vector, centroid, dot, norm, sub};
use fluxmorph_geometry::topology::face_key;
use fluxmorph_geometry::{Mesh, NodeId};

use super::fault::PlaneFault;
use super::racetrack::Racetrack;
use super::region::RegionCurrent;
use super::{Coil, CoilShape};
use crate::error::SolverError;

/// What holds on a surface.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Condition {
    /// B·n = 0.
    FluxParallel,
    /// n × H = 0.
    FluxNormal,
    /// A is given.
    Prescribed,
    /// Nothing is said: n × H = 0 follows, or the surface is an impedance surface.
    Open,
}

/// A named surface with a condition.
#[derive(Clone, Copy, Debug)]
pub struct ConditionedSurface<'a> {
    /// Its name.
    pub name: &'a str,
    /// What holds on it.
    pub condition: Condition,
    /// Its triangles, in either orientation.
    pub triangles: &'a [[NodeId; 3]],
}

/// Sine of an angle up to which two directions count as one: faces of a fine mesh with coordinates of six digits have directions of
/// their own.
const ROUNDING: f64 = 1e-3;

/// `T` over that of the window up to which it counts as zero.
const NO_POTENTIAL: f64 = 1e-5;

/// Share of a coil's size below which no part of it is looked for: the edges of a thinner winding would take seconds to follow.
const THINNEST: f64 = 1e-5;

/// Sine of the angle that a region's current may be off: 10°, more than the scatter of elements of constant current
/// and less than any cut that is meant to be slanted.
pub const REGION_TOLERANCE: f64 = 0.173_648;

/// Refuses coils that meet the outside of the mesh where their source would be wrong.
///
/// Outer faces that no surface holds are [`Condition::Open`].
///
/// # Errors
/// [`SolverError::SourceOnBoundary`] names coil, surface, place and reason.
pub fn check(mesh: &Mesh, coils: &[Coil], surfaces: &[ConditionedSurface<'_>]) -> Result<(), SolverError> {
    let mut surface_of: HashMap<[NodeId; 3], usize> = HashMap::new();
    for (i, surface) in surfaces.iter().enumerate() {
        for triangle in surface.triangles {
            surface_of.entry(face_key(*triangle)).or_insert(i);
        }
    }
    let outer = mesh.topology().outer_facets().map(|facet| facet.nodes);
    let open: Vec<[NodeId; 3]> = outer.filter(|face| !surface_of.contains_key(&face_key(*face))).collect();
    let rest = ConditionedSurface { name: "", condition: Condition::Open, triangles: &open };
    for coil in coils {
        let found = match &coil.shape {
            CoilShape::Racetrack(racetrack) => surfaces.iter().chain([&rest]).find_map(|surface| {
                let faces = surface.triangles.iter().map(|t| t.map(|n| mesh.point(n)));
                let (place, reason) = racetrack_fault(racetrack, surface.condition, faces)?;
                Some((describe(surface), place, reason))
            }),
            shape => {
                let Some(current) = shape.region_current() else { continue };
                let surface_at = |key: &[NodeId; 3]| surface_of.get(key).map_or(&rest, |&i| &surfaces[i]);
                terminal_fault(mesh, current, surface_at)
                    .or_else(|| wall_fault(mesh, current, surfaces, &rest, &surface_of))
            }
        };
        if let Some((surface, place, reason)) = found {
            return Err(SolverError::SourceOnBoundary { coil: coil.name.clone(), surface, place, reason });
        }
    }
    Ok(())
}

fn describe(surface: &ConditionedSurface<'_>) -> String {
    match surface.condition {
        Condition::FluxParallel => format!("the flux-parallel surface `{}`", surface.name),
        Condition::FluxNormal => format!("the flux-normal surface `{}`", surface.name),
        Condition::Prescribed => format!("the surface `{}` of the uniform field", surface.name),
        Condition::Open => "an outer face without a condition, or an impedance surface,".to_owned(),
    }
}

/// Where and why an analytic coil may not meet a surface as it does; the triangles are given by their vertices [m].
///
/// Of the points found, one where current flows comes before one where only `T` is wrong.
pub fn racetrack_fault(
    coil: &Racetrack,
    condition: Condition,
    triangles: impl Iterator<Item = [Point; 3]>,
) -> Option<(Point, PlaneFault)> {
    let mut tangential = None;
    for vertices in triangles.filter(|v| near(coil, v)) {
        let normal = area_vector(vertices);
        let normal = normal.map(|c| c / norm(normal));
        let across = sine(normal, coil.axis());
        for place in places(coil, vertices) {
            let current = coil.current_density(place);
            if norm(current) > 0.0
                && let Some(reason) = current_fault(condition, current, normal)
            {
                return Some((place, reason));
            }
            let wrong = matches!(condition, Condition::FluxNormal | Condition::Open)
                && across > ROUNDING
                && coil.potential(place) > NO_POTENTIAL * coil.plateau();
            if wrong && tangential.is_none() {
                tangential = Some((place, PlaneFault::TangentialSource));
            }
        }
    }
    tangential
}

/// What is wrong with a current at a face.
fn current_fault(condition: Condition, current: Point, normal: Point) -> Option<PlaneFault> {
    let angle = (dot(current, normal).abs() / norm(current)).min(1.0).acos().to_degrees();
    match condition {
        Condition::FluxParallel => {
            (sine(normal, current) > ROUNDING).then_some(PlaneFault::Slanting { angle })
        }
        Condition::FluxNormal | Condition::Open => {
            let crossing = dot(current, normal).abs() > ROUNDING * norm(current);
            crossing.then_some(PlaneFault::Crossing { angle })
        }
        Condition::Prescribed => Some(PlaneFault::OnPrescribedField),
    }
}

/// Sine of the angle between a unit vector and a vector.
fn sine(unit: Point, v: Point) -> f64 {
    norm(fluxmorph_geometry::tet4::cross(unit, v)) / norm(v)
}

/// Whether a triangle may meet the coil: the boxes in the coil's directions overlap.
fn near(coil: &Racetrack, vertices: &[Point; 3]) -> bool {
    let local = vertices.map(|x| coil.frame().local(x));
    let extent = coil.extent();
    (0..3).all(|d| local.iter().any(|x| x[d] <= extent[d]) && local.iter().any(|x| x[d] >= -extent[d]))
}

/// Places of a triangle that stand for all of it, but for what is smaller than a third of the winding or [`THINNEST`]: the middles of
/// its parts, quartered until each is all in the winding, in the window or beyond both. Never on an edge of the triangle, where a
/// coil may just touch it.
fn places(coil: &Racetrack, vertices: [Point; 3]) -> Vec<Point> {
    let smallest = (coil.detail() / 3.0).max(THINNEST * coil.extent().into_iter().fold(0.0, f64::max));
    let mut places = Vec::new();
    let mut parts = vec![vertices];
    while let Some(part) = parts.pop() {
        let longest = (0..3).map(|k| norm(sub(part[k], part[(k + 1) % 3]))).fold(0.0, f64::max);
        if longest <= smallest || coil.is_alike_in(&part) {
            places.push(centroid(part));
        } else {
            let [a, b, c] = part;
            let [ab, bc, ca] = [[a, b], [b, c], [c, a]].map(|[p, q]| add(p, q).map(|x| 0.5 * x));
            let quarters = [[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]];
            parts.extend(quarters.into_iter().filter(|quarter| near(coil, quarter)));
        }
    }
    places
}

/// A terminal must lie on a flux-parallel surface.
fn terminal_fault<'a>(
    mesh: &Mesh,
    current: &RegionCurrent,
    surface_at: impl Fn(&[NodeId; 3]) -> &'a ConditionedSurface<'a>,
) -> Option<(String, Point, PlaneFault)> {
    let wrong = current
        .terminals()
        .iter()
        .find(|face| surface_at(&face.nodes).condition != Condition::FluxParallel)?;
    let name = current.terminal_name(wrong.end).unwrap_or_default();
    let place = centroid(wrong.nodes.map(|n| mesh.point(n)));
    Some((format!("its terminal `{name}`"), place, PlaneFault::EndsAtTerminal))
}

/// A face of a coil region on the outside of the mesh.
struct Wall {
    place: Point,
    area: f64,
    /// `J·n/|J|`, its size.
    across: f64,
    /// `|J|²` times the area.
    weight: f64,
}

/// Where the current at a coil region's outer faces is wrong, surface by surface.
fn wall_fault(
    mesh: &Mesh,
    current: &RegionCurrent,
    surfaces: &[ConditionedSurface<'_>],
    rest: &ConditionedSurface<'_>,
    surface_of: &HashMap<[NodeId; 3], usize>,
) -> Option<(String, Point, PlaneFault)> {
    let density = current.current_density();
    let mut walls: Vec<Vec<Wall>> = (0..=surfaces.len()).map(|_| Vec::new()).collect();
    for facet in mesh.topology().outer_facets() {
        let Ok(i) = density.binary_search_by_key(&facet.inside, |(e, _)| *e) else { continue };
        let j = density[i].1;
        let vertices = facet.nodes.map(|n| mesh.point(n));
        let (normal, magnitude) = (area_vector(vertices), norm(j));
        let area = norm(normal);
        let across = if magnitude > 0.0 { dot(j, normal).abs() / (magnitude * area) } else { 0.0 };
        let surface = surface_of.get(&face_key(facet.nodes)).copied().unwrap_or(surfaces.len());
        walls[surface].push(Wall {
            place: centroid(vertices),
            area,
            across,
            weight: magnitude * magnitude * area,
        });
    }
    surfaces.iter().chain([rest]).zip(&walls).find_map(|(surface, walls)| {
        let (place, reason) = region_fault(surface.condition, walls)?;
        Some((describe(surface), place, reason))
    })
}

fn region_fault(condition: Condition, walls: &[Wall]) -> Option<(Point, PlaneFault)> {
    // Root mean square of a sine over faces, weighted with |J|², and the largest face for a place.
    let rms = |of: &dyn Fn(&Wall) -> Option<f64>| {
        let used: Vec<(&Wall, f64)> = walls.iter().filter_map(|w| Some((w, of(w)?))).collect();
        let weight: f64 = used.iter().map(|(w, _)| w.weight).sum();
        let sine = (used.iter().map(|(w, s)| w.weight * s * s).sum::<f64>() / weight).sqrt();
        let worst = used.iter().max_by(|a, b| (a.0.area * a.1).total_cmp(&(b.0.area * b.1)))?;
        (weight > 0.0 && sine > REGION_TOLERANCE).then_some((worst.0.place, sine))
    };
    match condition {
        Condition::FluxParallel => {
            // Faces that the current crosses, and faces that it runs along and only touches.
            let crossing =
                |w: &Wall| (w.across * w.across >= 0.5).then(|| (1.0 - w.across * w.across).max(0.0).sqrt());
            let touching = |w: &Wall| (w.across * w.across < 0.5).then_some(w.across);
            let slanting = |sine: f64| PlaneFault::Slanting { angle: sine.min(1.0).asin().to_degrees() };
            rms(&crossing).map(|(place, sine)| (place, slanting(sine))).or_else(|| {
                rms(&touching).map(|(place, sine)| (place, slanting((1.0 - sine * sine).max(0.0).sqrt())))
            })
        }
        Condition::FluxNormal | Condition::Open => rms(&|w| Some(w.across)).map(|(place, cosine)| {
            (place, PlaneFault::Crossing { angle: cosine.min(1.0).acos().to_degrees() })
        }),
        Condition::Prescribed => {
            rms(&|w| Some(w.across)).map(|(place, _)| (place, PlaneFault::OnPrescribedField))
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::coil::racetrack::Corner;

    /// A square of two triangles with a normal along `d`, at `at` along it, of half size `half`.
    fn square(d: usize, at: f64, half: f64) -> Vec<[Point; 3]> {
        let corner = |s: f64, t: f64| -> Point {
            let mut x = [0.0; 3];
            x[d] = at;
            x[(d + 1) % 3] = s * half;
            x[(d + 2) % 3] = t * half;
            x
        };
        vec![
            [corner(-1.0, -1.0), corner(1.0, -1.0), corner(1.0, 1.0)],
            [corner(-1.0, -1.0), corner(1.0, 1.0), corner(-1.0, 1.0)],
        ]
    }

    fn coil() -> Racetrack {
        Racetrack::new([0.0; 3], 2, [0.06, 0.1], 0.02, 0.04, Corner::Round { inner_radius: 0.02 }).unwrap()
    }

    fn fault(condition: Condition, triangles: Vec<[Point; 3]>) -> Option<PlaneFault> {
        racetrack_fault(&coil(), condition, triangles.into_iter()).map(|(_, reason)| reason)
    }

    #[test]
    fn a_flux_parallel_plane_may_cut_straight_sides_at_right_angles() {
        assert_eq!(fault(Condition::FluxParallel, square(0, 0.0, 0.3)), None);
        assert_eq!(fault(Condition::FluxParallel, square(0, 0.03, 0.3)), None);
        let through_arcs = fault(Condition::FluxParallel, square(0, 0.05, 0.3)).unwrap();
        assert!(matches!(through_arcs, PlaneFault::Slanting { .. }), "{through_arcs}");
        let lengthwise = fault(Condition::FluxParallel, square(2, 0.0, 0.3)).unwrap();
        assert!(matches!(lengthwise, PlaneFault::Slanting { angle } if angle > 89.9), "{lengthwise}");
        let turned = square(0, 0.0, 0.3).into_iter().map(|t| t.map(|[_, y, z]| [0.1 * y, y, z])).collect();
        let slanted = fault(Condition::FluxParallel, turned).unwrap();
        assert!(matches!(slanted, PlaneFault::Slanting { angle } if (angle - 5.7).abs() < 0.1), "{slanted}");
    }

    /// A winding of a hundredth of the size and less of the faces that it meets.
    #[test]
    fn a_thin_winding_is_found_on_large_faces() {
        for thickness in [4e-3, 4e-4, 4e-5] {
            let size = [[thickness, thickness], [thickness, 0.1], [0.1, thickness]];
            for [width, height] in size {
                let corner = Corner::Round { inner_radius: 0.2 };
                let ring = Racetrack::new([0.003, 0.01, 0.0], 2, [0.2; 2], width, height, corner).unwrap();
                let fault = |condition, d, at| {
                    racetrack_fault(&ring, condition, square(d, at, 0.7).into_iter())
                        .map(|(_, reason)| reason)
                };
                let cut = fault(Condition::Open, 0, 0.0);
                assert!(matches!(cut, Some(PlaneFault::Crossing { .. })), "{width} {height}: {cut:?}");
                assert_eq!(fault(Condition::Open, 2, 0.0), None);
                // In its middle the current runs along the plane, and crosses it beside that.
                let tangent = fault(Condition::Open, 0, 0.203 + 0.5 * width);
                assert!(
                    matches!(tangent, Some(PlaneFault::Crossing { .. })),
                    "{width} {height}: {tangent:?}"
                );
                assert_eq!(fault(Condition::FluxParallel, 2, 0.5 * height), None);
                let lengthwise = fault(Condition::FluxParallel, 2, 0.49 * height);
                assert!(
                    matches!(lengthwise, Some(PlaneFault::Slanting { .. })),
                    "{width} {height}: {lengthwise:?}"
                );
            }
        }
    }

    #[test]
    fn a_plane_that_touches_the_winding_does_not_cut_it() {
        for (d, at) in [(0, 0.08), (1, 0.12), (2, 0.02), (2, -0.02)] {
            assert_eq!(fault(Condition::FluxParallel, square(d, at, 0.3)), None, "{d} {at}");
        }
        assert_eq!(fault(Condition::FluxNormal, square(0, 0.08, 0.3)), None);
        assert_eq!(fault(Condition::Prescribed, square(0, 0.08, 0.3)), None);
    }

    #[test]
    fn a_flux_normal_plane_may_halve_the_height_but_no_current_may_cross() {
        assert_eq!(fault(Condition::FluxNormal, square(2, 0.0, 0.3)), None);
        assert_eq!(fault(Condition::Open, square(2, 0.01, 0.3)), None);
        let cut = fault(Condition::FluxNormal, square(0, 0.0, 0.3)).unwrap();
        assert!(matches!(cut, PlaneFault::Crossing { angle } if angle < 0.1), "{cut}");
        // Inside the window no current flows, but T is there.
        assert_eq!(fault(Condition::Open, square(0, 0.0, 0.05)), Some(PlaneFault::TangentialSource));
        assert_eq!(fault(Condition::Prescribed, square(0, 0.0, 0.3)), Some(PlaneFault::OnPrescribedField));
    }

    fn wall(degrees_to_normal: f64) -> Wall {
        let across = degrees_to_normal.to_radians().cos();
        Wall { place: [0.0; 3], area: 1.0, across, weight: 1.0 }
    }

    #[test]
    fn a_regions_current_may_scatter_by_less_than_ten_degrees() {
        let good = [wall(4.0), wall(7.0), wall(85.0)];
        assert_eq!(region_fault(Condition::FluxParallel, &good), None);
        for slanted in [20.0, 45.0, 70.0] {
            let found = region_fault(Condition::FluxParallel, &[wall(slanted)]);
            let Some((_, PlaneFault::Slanting { angle })) = found else { panic!("{slanted}: {found:?}") };
            assert!((angle - slanted).abs() < 1e-6, "{angle}");
        }
        assert_eq!(region_fault(Condition::FluxNormal, &[wall(84.0), wall(88.0)]), None);
        assert!(region_fault(Condition::FluxNormal, &good).is_some());
        assert!(region_fault(Condition::Open, &[wall(0.0)]).is_some());
        assert_eq!(region_fault(Condition::Open, &[]), None);
    }
}
