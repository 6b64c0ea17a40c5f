//! What impedance surfaces leave out where a conductor is no half space: at its sharp edges, and where it is round; and where the
//! field along it changes within a few skin depths.
//!
//! **Sharp edges.** Along one the field grows, with the distance `s` from it as `s^(p − 1)`, `p = π/θ` by the angle `θ` outside, until
//! it is a skin depth away; what goes on there is a matter of the angle, of the permeability and of the skin depth alone. Of
//! current along the edge the conductor has more loss there than its surface: beside a right-angled edge of copper by six tenths of
//! what the surface has within a skin depth. That is some percent of the loss of a thick conductor, and a third of that of a bar of
//! five skin depths by twelve across the field. Current across an edge is left out, and
//! so are edges that stand into the conductor, where there is hardly any field.
//!
//! How much it is comes from the loss that the surface has in the elements beside the edge, by [`EXCESS`], which was found in the
//! plane: a wedge and its surface in a disc of 120 skin depths, linear elements of a hundredth of one at the edge, and what both
//! differ by within 8 to 16 skin depths, which is nearly all, over the loss of the surface within each width. The whole of bars of 25 by 10 mm is 13.8, 22.1 and 31.5 % at skin depths
//! of 0.3, 0.94 and 2.1 mm in the same way, and 14.0, 23.2 and 35.1 % of the loss beside their edges.
//!
//! **Round surfaces.** The resistance of a surface with the curvatures `κ₁` along the current and `κ₂` across it is that of a half space
//! times `1 + δ(κ₂ − κ₁)/2` (S. M. Rytov, J. Exp. Theor. Phys. 10 (1940) 180; a wire of radius `a` has `I₀/I₁`, a billet along the field
//! `I₁/I₀`, which begin with `1 ± δ/2a`). Of facets all curvature is in the edges between them: the angle between both times the
//! length, across the edge. What the surface is given is no field, but the currents that excite it: by reciprocity a change `δZ` of
//! its impedance changes that of a coil with the current `I` by `∫ δZ H·H/I²`, without conjugate. Of round surfaces `δZ` is real, so
//! that the loss changes by `½ δZ Re(H·H)` of the phase of the current: in copper, whose field is in phase, by that of a given
//! field; in iron, whose field its poles oppose by the flux that gets in, by a third or an eighth of it. Where currents have several
//! phases `|H|²` is taken.
//!
//! **Fields that change.** In a half space a field of wave number `k` along the surface goes down as `exp(−√(γ² + k²) z)` and not as
//! `exp(−γ z)`, `γ = (1 + j)/δ`. For a given field at the surface, electric or magnetic, that takes `(k δ)²/4` off the loss, to
//! `(k δ)⁴`. Over all waves that is `δ²/4 ∫ |∇E|² / ∫ |E|²`, of the field along the surface with its mean at the nodes, but for what
//! is beside edges.

use std::collections::{BTreeMap, HashMap, HashSet};

use fluxmorph_geometry::directions::unit;
use fluxmorph_geometry::fem::c64;
use fluxmorph_geometry::tet4::{Point, area_vector, centroid, cross, dot, norm, sub};
use fluxmorph_geometry::topology::{around_edges, face_key, triangle_edges};
use fluxmorph_geometry::{Mesh, NodeId};

use super::inside_of_outer_faces;
use crate::boundary::Boundary;
use crate::circuit::currents;
use crate::element::triangle::Triangle;
use crate::element::{Complex3, dot3};
use crate::fixed_directions::CREASE;
use crate::model::FieldModel;
use crate::reentrant::is_reentrant;
use crate::solution::{FieldSolution, FieldState};
use crate::surface::{Conductor, SurfaceLaw};

/// Widths of a strip beside an edge, in skin depths.
const WIDTHS: [f64; 8] = [0.25, 0.5, 1.0, 2.0, 4.0, 8.0, 16.0, 32.0];

/// Angles of conductors [°], and what they have more loss by than their surfaces, over the loss of the surfaces within [`WIDTHS`].
const EXCESS: [(f64, [f64; 8]); 8] = [
    (30.0, [5.722, 3.388, 2.126, 1.486, 1.133, 0.909, 0.752, 0.640]),
    (45.0, [4.086, 2.393, 1.479, 1.016, 0.760, 0.597, 0.484, 0.403]),
    (60.0, [3.101, 1.795, 1.092, 0.735, 0.538, 0.413, 0.326, 0.265]),
    (75.0, [2.413, 1.379, 0.824, 0.543, 0.388, 0.289, 0.222, 0.175]),
    (90.0, RIGHT_ANGLE),
    (105.0, [1.466, 0.814, 0.466, 0.291, 0.195, 0.136, 0.097, 0.070]),
    (120.0, [1.110, 0.606, 0.338, 0.205, 0.132, 0.088, 0.060, 0.041]),
    (140.0, [0.692, 0.369, 0.198, 0.114, 0.069, 0.043, 0.027, 0.017]),
];

/// That of a right angle.
const RIGHT_ANGLE: [f64; 8] = [1.889, 1.065, 0.624, 0.401, 0.278, 0.201, 0.149, 0.113];

/// Relative permeabilities, and the same of a right angle.
const EXCESS_OF_IRON: [(f64, [f64; 8]); 7] = [
    (1.0, RIGHT_ANGLE),
    (2.0, [1.989, 1.072, 0.588, 0.351, 0.229, 0.158, 0.113, 0.084]),
    (4.0, [1.986, 1.039, 0.543, 0.305, 0.185, 0.119, 0.082, 0.059]),
    (10.0, [1.762, 0.902, 0.454, 0.240, 0.135, 0.079, 0.050, 0.034]),
    (30.0, [1.210, 0.612, 0.301, 0.154, 0.082, 0.044, 0.025, 0.015]),
    (100.0, [0.606, 0.305, 0.149, 0.075, 0.039, 0.020, 0.011, 0.006]),
    (300.0, [0.250, 0.126, 0.061, 0.031, 0.016, 0.008, 0.004, 0.002]),
];

/// Skin depths from an edge, at least, beyond which the field changes as along a half space.
const NEAR_EDGE: f64 = 4.0;

/// Angle [°] between a surface and its image behind a wall from which on the surface ends there along the wall, and is no wedge.
const ALONG_WALL: f64 = 150.0;

/// Difference of the squares of two phase factors below which they are one.
const SAME_PHASE: f64 = 1e-3;

/// Component of a unit vector along an edge across a face that begins at it.
const ACROSS_FACE: f64 = 0.2;

/// What the impedance surface of a conductor leaves out.
#[derive(Clone, Debug, PartialEq)]
pub struct ExcessLoss {
    /// Name of the region.
    pub region: String,
    /// Loss of the surface [W].
    pub of_surface: f64,
    /// What the conductor has more at its sharp edges, about [W].
    pub at_edges: f64,
    /// What it has more, or less, where it is round, about [W].
    pub of_curvature: f64,
    /// What it has less where the field along it changes within some skin depths, about [W]; negative.
    pub of_variation: f64,
}

impl ExcessLoss {
    /// What the conductor has more, about [W].
    pub fn more(&self) -> f64 {
        self.at_edges + self.of_curvature + self.of_variation
    }

    /// The same over the loss of its surface.
    pub fn share(&self) -> f64 {
        self.more() / self.of_surface
    }
}

/// A triangle of an impedance surface and what goes on there.
struct SurfaceTriangle {
    /// [W]
    loss: f64,
    /// In its middle, `E/(−jω)` along the surface [T m].
    field: Complex3,
    /// Its area vector [m²], into the conductor.
    area: Point,
}

/// What the impedance surfaces of a field leave out of the losses of their conductors.
pub fn excess_losses((model, mesh, solution): FieldState<'_>) -> Vec<ExcessLoss> {
    if model.conductors().iter().all(|own| !matches!(own.law, SurfaceLaw::Impedance(_))) {
        return Vec::new();
    }
    let of_surfaces = solution.surface_losses(model, mesh).into_iter();
    let losses: HashMap<[NodeId; 3], f64> = of_surfaces.map(|(_, t, loss)| (face_key(t), loss)).collect();
    let outer = || mesh.topology().outer_facets();
    let inside = inside_of_outer_faces(mesh);
    let replaced: HashSet<[NodeId; 3]> =
        model.conductors().iter().flat_map(|own| &own.surface).map(|t| face_key(*t)).collect();
    let walls = || outer().map(|facet| facet.nodes).filter(|nodes| !replaced.contains(&face_key(*nodes)));
    let phase = phase_of_sources(model, solution);
    let of = |conductor: &Conductor| {
        let SurfaceLaw::Impedance(material) = conductor.law else { return None };
        let skin_depth = material.skin_depth(model.angular_frequency())?;
        let of_triangle = |triangle: &[NodeId; 3]| {
            let key = face_key(*triangle);
            let of_face = |node: NodeId| if key.contains(&node) { 1.0 / 3.0 } else { 0.0 };
            let e = *inside.get(&key)?;
            let field = solution.at(model, mesh, e, &mesh.topology().tet(e).map(of_face)).electric_potential;
            let area = area_vector(triangle.map(|node| mesh.point(node)));
            Some(SurfaceTriangle { loss: *losses.get(&key)?, field: along(area, field), area })
        };
        let triangles: Vec<SurfaceTriangle> =
            conductor.surface.iter().map(of_triangle).collect::<Option<_>>()?;
        let bends = Bends::of(mesh, &conductor.surface, walls());
        let of_curvature = bends.round.iter().map(|own| own.weigh(&triangles, phase)).sum::<f64>();
        let at_edge = |(triangle, own): (&[NodeId; 3], &SurfaceTriangle)| {
            let strip = bends.strip(mesh, *triangle)?;
            let share = excess_share(strip.angle, strip.width / skin_depth, material.relative_permeability);
            Some(own.loss * own.share_along(strip.direction) * share)
        };
        let of_surface = triangles.iter().map(|own| own.loss).sum();
        let variation = 0.25
            * skin_depth
            * skin_depth
            * bends.variation(mesh, skin_depth, (&conductor.surface, &triangles));
        Some(ExcessLoss {
            region: conductor.name.clone(),
            of_surface,
            // Waves of no more than a skin depth have hardly any loss.
            of_variation: -of_surface * variation.min(1.0),
            at_edges: conductor.surface.iter().zip(&triangles).filter_map(at_edge).sum(),
            of_curvature: 0.5 * skin_depth * of_curvature,
        })
    };
    model.conductors().iter().filter_map(of).collect()
}

/// `e^(−2jφ)` of the phase `φ`, but for signs, that everything which excites the field has; `None` of several. Of a voltage it is that
/// of the current that it drives, where there is no other coil, of which a change would change that of the first.
fn phase_of_sources(model: &FieldModel, solution: &FieldSolution) -> Option<c64> {
    let is_driven = model.setup().windings.iter().flatten().any(|winding| winding.voltage.is_some());
    if is_driven && model.coils().len() > 1 {
        return None;
    }
    let given = model.coils().iter().map(|coil| coil.ampere_turns);
    let driven = currents(model, solution).into_iter().map(|(_, current)| current);
    let is_applied = model.setup().boundaries.iter().any(|(_, own)| matches!(own, Boundary::UniformField(_)));
    let sources = given.chain(driven).chain(is_applied.then(|| c64::from(1.0)));
    let mut phases = sources.filter(|own| *own != c64::default()).map(|own| own * own / own.norm_sqr());
    let first = phases.next()?;
    phases.all(|own| (own - first).norm() < SAME_PHASE).then(|| first.conj())
}

impl SurfaceTriangle {
    /// What the loss changes by with a real impedance that the surface has more along a unit vector, and less across it, over what that
    /// does to a field of this size: of a phase of what excites it, or, of several, of that size.
    fn change(&self, along: Point, phase: Option<c64>) -> f64 {
        let (part, all) = (dot3(self.field, along.map(c64::from)), square(&self.field));
        match phase {
            // H is an eighth of a turn behind E, the field times −jω.
            Some(phase) if all > 0.0 => {
                -(phase * (2.0 * part * part - dot3(self.field, self.field))).im / all
            }
            _ => 2.0 * self.share_along(along) - 1.0,
        }
    }

    /// Share of the square of the current in the direction of a unit vector along the surface.
    fn share_along(&self, direction: Point) -> f64 {
        let part = dot3(self.field, direction.map(c64::from));
        let all = square(&self.field);
        if all > 0.0 { (part.norm_sqr() / all).min(1.0) } else { 0.0 }
    }
}

/// What a field has along a triangle with this area vector.
fn along(area: Point, field: Complex3) -> Complex3 {
    let normal = unit(area);
    let across = dot3(field, normal.map(c64::from));
    std::array::from_fn(|d| field[d] - across * normal[d])
}

/// `|E|²`
fn square(field: &Complex3) -> f64 {
    field.iter().map(|c| c.norm_sqr()).sum()
}

/// By how much a conductor has more loss than its surface within a strip of so many skin depths beside an edge, over the loss there.
fn excess_share(angle: f64, width: f64, relative_permeability: f64) -> f64 {
    let at_width = |shares: &[f64; 8]| interpolated(&WIDTHS, shares, width);
    let of_angles = EXCESS.map(|(_, shares)| at_width(&shares));
    let angle = angle.clamp(EXCESS[0].0, EXCESS[7].0);
    let of_irons = EXCESS_OF_IRON.map(|(_, shares)| at_width(&shares));
    let iron = relative_permeability.clamp(EXCESS_OF_IRON[0].0, EXCESS_OF_IRON[6].0);
    interpolated(&EXCESS.map(|(angle, _)| angle), &of_angles, angle)
        * interpolated(&EXCESS_OF_IRON.map(|(permeability, _)| permeability), &of_irons, iron)
        / at_width(&RIGHT_ANGLE)
}

/// Between ascending places linear in the logarithms; beyond them as between the last two.
fn interpolated(places: &[f64], values: &[f64], at: f64) -> f64 {
    let k = places.partition_point(|place| *place < at).clamp(1, places.len() - 1);
    let share = (at / places[k - 1]).ln() / (places[k] / places[k - 1]).ln();
    values[k - 1] * (values[k] / values[k - 1]).powf(share)
}

/// A sharp edge between two faces of a conductor.
struct SharpEdge {
    ends: [NodeId; 2],
    /// Between the faces, inside the conductor [°].
    angle: f64,
}

/// An edge between two facets of a round surface, or between one and its mirror image.
struct RoundEdge {
    /// Its facets by their numbers; of one at a wall twice the same.
    sides: [usize; 2],
    /// Unit vector along it.
    direction: Point,
    /// Its length [m] times the angle by which the facets turn towards the conductor; of an image half of it.
    turn: f64,
}

impl RoundEdge {
    /// Its curvature times the loss per area of its facets [W/m], positive for current along it, as far as a change of the impedance
    /// changes that loss.
    fn weigh(&self, triangles: &[SurfaceTriangle], phase: Option<c64>) -> f64 {
        let of = |k: usize| {
            let own = &triangles[k];
            own.loss / norm(own.area) * own.change(self.direction, phase)
        };
        0.5 * self.turn * (of(self.sides[0]) + of(self.sides[1]))
    }
}

/// How the surface of a conductor turns from triangle to triangle.
#[derive(Default)]
struct Bends {
    /// The sharp edges by the nodes on them.
    sharp: BTreeMap<NodeId, Vec<SharpEdge>>,
    /// The nodes on these and on edges that stand into the conductor.
    creased: HashSet<NodeId>,
    round: Vec<RoundEdge>,
}

/// Where a triangle lies beside a sharp edge.
struct Strip {
    /// Unit vector along the edge.
    direction: Point,
    /// From the edge to the far side of the triangle [m].
    width: f64,
    /// Of the conductor at the edge [°].
    angle: f64,
}

impl Bends {
    /// Those of a surface whose triangles are oriented into the conductor, and which goes on in its mirror image behind walls.
    fn of(mesh: &Mesh, surface: &[[NodeId; 3]], walls: impl Iterator<Item = [NodeId; 3]>) -> Self {
        let around = around_edges(surface);
        let mut wall_at: BTreeMap<[NodeId; 2], [NodeId; 3]> = BTreeMap::new();
        for wall in walls {
            let is_end = |edge: &[NodeId; 2]| around.get(edge).is_some_and(|own| own.len() == 1);
            wall_at.extend(triangle_edges(wall).into_iter().filter(is_end).map(|edge| (edge, wall)));
        }
        let normal = |triangle: [NodeId; 3]| unit(area_vector(triangle.map(|node| mesh.point(node))));
        let mut bends = Self::default();
        for (ends, sides) in around {
            match (sides.as_slice(), wall_at.get(&ends)) {
                (&[one, other], _) => {
                    let turn = dot(normal(surface[one]), normal(surface[other])).clamp(-1.0, 1.0).acos();
                    let is_convex = is_reentrant(mesh, ends, [surface[one], surface[other]]);
                    bends.add(mesh, ends, [one, other], (if is_convex { turn } else { -turn }, 1.0));
                }
                (&[one], Some(wall)) => {
                    let turn = 2.0 * dot(normal(surface[one]), normal(*wall)).clamp(-1.0, 1.0).asin();
                    if turn > ALONG_WALL.to_radians() {
                        continue;
                    }
                    bends.add(mesh, ends, [one; 2], (turn, 0.5));
                }
                _ => {}
            }
        }
        bends
    }

    /// Adds an edge at which the surface turns towards the conductor by an angle [rad], and of which so much is the mesh's.
    fn add(&mut self, mesh: &Mesh, ends: [NodeId; 2], sides: [usize; 2], (turn, share): (f64, f64)) {
        let [a, b] = ends.map(|node| mesh.point(node));
        let along = sub(b, a);
        if turn.abs() < CREASE.to_radians() {
            self.round.push(RoundEdge { sides, direction: unit(along), turn: share * turn * norm(along) });
            return;
        }
        self.creased.extend(ends);
        if turn > 0.0 {
            for node in ends {
                let edge = SharpEdge { ends, angle: 180.0 - turn.to_degrees() };
                self.sharp.entry(node).or_default().push(edge);
            }
        }
    }

    /// `∫ |∇E|² / ∫ |E|²` of the field along the surface [1/m²], without the triangles at edges and within a few skin depths of their
    /// nodes: what goes on there is in [`EXCESS`].
    fn variation(
        &self,
        mesh: &Mesh,
        skin_depth: f64,
        (surface, triangles): (&[[NodeId; 3]], &[SurfaceTriangle]),
    ) -> f64 {
        let cell = |x: Point| x.map(|c| (c / (NEAR_EDGE * skin_depth)).floor() as i64);
        let around = |node: &NodeId| {
            let own = cell(mesh.point(*node));
            (0..27).map(move |k| [own[0] + k % 3 - 1, own[1] + k / 3 % 3 - 1, own[2] + k / 9 - 1])
        };
        let near: HashSet<[i64; 3]> = self.creased.iter().flat_map(around).collect();
        let mut means: HashMap<NodeId, (Complex3, f64)> = HashMap::new();
        for (nodes, own) in surface.iter().zip(triangles) {
            let area = norm(own.area);
            for node in nodes {
                let (sum, weight) = means.entry(*node).or_default();
                sum.iter_mut().zip(own.field).for_each(|(sum, c)| *sum += area * c);
                *weight += area;
            }
        }
        let [mut of_gradient, mut of_field] = [0.0; 2];
        for (nodes, own) in surface.iter().zip(triangles) {
            of_field += norm(own.area) * square(&own.field);
            let vertices = nodes.map(|node| mesh.point(node));
            if nodes.iter().any(|node| self.creased.contains(node))
                || near.contains(&cell(centroid(vertices)))
            {
                continue;
            }
            let values = nodes.map(|node| {
                let (sum, weight) = means[&node];
                // On a round surface a field that turns with it does not change.
                along(own.area, sum.map(|c| c / weight))
            });
            for (value, row) in values.iter().zip(Triangle::new(vertices).metric) {
                for (other, product) in values.iter().zip(row) {
                    of_gradient += product * (0..3).map(|d| (value[d].conj() * other[d]).re).sum::<f64>();
                }
            }
        }
        if of_field > 0.0 { of_gradient / of_field } else { 0.0 }
    }

    /// Where a triangle lies beside the nearest sharp edge that it begins at; `None` where it touches none.
    fn strip(&self, mesh: &Mesh, triangle: [NodeId; 3]) -> Option<Strip> {
        let vertices = triangle.map(|node| mesh.point(node));
        let normal = unit(area_vector(vertices));
        let mut nearest: Option<(f64, Strip)> = None;
        for edge in triangle.iter().filter_map(|node| self.sharp.get(node)).flatten() {
            let [a, b] = edge.ends.map(|node| mesh.point(node));
            let direction = unit(sub(b, a));
            if dot(direction, normal).abs() > ACROSS_FACE {
                continue;
            }
            let distance = |x: Point| norm(cross(sub(x, a), direction));
            let off = distance(centroid(vertices));
            if nearest.as_ref().is_none_or(|(least, _)| off < *least) {
                let width = vertices.into_iter().map(distance).fold(0.0, f64::max);
                nearest = Some((off, Strip { direction, width, angle: edge.angle }));
            }
        }
        let (_, strip) = nearest?;
        // From edge to edge half of the face is beside each.
        let ends_at_edges = triangle.iter().all(|node| self.sharp.contains_key(node));
        Some(Strip { width: if ends_at_edges { 0.5 * strip.width } else { strip.width }, ..strip })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shares_are_those_of_the_table_and_go_on_as_powers() {
        assert_eq!(excess_share(90.0, 1.0, 1.0), 0.624);
        assert!((excess_share(90.0, 2.0, 10.0) - 0.240).abs() < 1e-12);
        let between = excess_share(82.5, 3.0, 1.0);
        assert!((excess_share(90.0, 4.0, 1.0)..excess_share(75.0, 2.0, 1.0)).contains(&between), "{between}");
        // Far from the edge the loss of the surface grows with the third root of the width.
        let slope = (excess_share(90.0, 64.0, 1.0) / excess_share(90.0, 512.0, 1.0)).log(8.0);
        assert!((0.33..0.42).contains(&slope), "{slope}");
        assert!(excess_share(180.0, 1.0, 1e5) < excess_share(90.0, 1.0, 100.0));
    }
}
