//! The skin-depth audit: is the mesh fine enough for the eddy currents it is to carry?
//!
//! A linear element thicker than the skin depth cannot follow the decay `e^{−x/δ}`: with one element through a plate of
//! 11 skin depths the field behind it was measured three times too large, with the wrong sign of the thickness effect
//! (docs/verification.md). The audit looks at the first layer of elements under every conductor face, and at all others down
//! to three depths (`layers`).

mod half_space;
mod layers;
mod nodal;
mod transmission;
mod walls;

pub use half_space::{ExcessLoss, excess_losses};
pub use layers::CoarseLayers;
pub use nodal::NodalErrors;
pub use transmission::{Transmission, transmissions};

use std::collections::HashMap;

use fluxmorph_geometry::box_tree::AxisBox;
use fluxmorph_geometry::tet4::{Point, area_vector, centroid, dot, norm, sub, volume};
use fluxmorph_geometry::topology::face_key;
use fluxmorph_geometry::{ElementId, Mesh, Millimetres, NodeId, RegionId};

use crate::elements::Order;
use crate::material::Material;

/// Share of the surface on which the first layer may be thicker than a skin depth before the audit warns: edges and
/// corners of graded meshes.
const TOLERATED_SHARE: f64 = 0.05;

/// Mean thickness in skin depths below which an impedance surface is doubtful: fields of the two faces meet.
const IMPEDANCE_THICKNESS: f64 = 4.0;

/// Elements per skin depth above which a factor of edge elements is lost in rounding: of a plate a double-precision one takes 3
/// iterations at 3e4, and has no digit left at 3e5 (docs/verification.md, 2.8).
const WEAKEST: f64 = 5e4;

/// What the audit found of one conductor.
#[derive(Clone, Debug, PartialEq)]
pub struct SkinAudit {
    /// Name of the region.
    pub region: String,
    /// `δ` [m].
    pub skin_depth: f64,
    /// Elements per skin depth in the first layer, area-weighted median over the conductor's surface.
    pub median_elements_per_skin_depth: f64,
    /// The smallest such number.
    pub least_elements_per_skin_depth: f64,
    /// Share of the surface whose first layer is thicker than `δ`.
    pub coarse_share: f64,
    /// Elements further down that are too coarse, where there are any.
    pub coarse_layers: Option<CoarseLayers>,
    /// Mean thickness `2 V/S` over the skin depth.
    pub thickness_in_skin_depths: f64,
    /// Share of its surface under which it is thinner than an impedance surface assumes.
    pub thin_share: f64,
    /// There the least thickness over the skin depth; infinite where it is that thick everywhere.
    pub least_thickness_in_skin_depths: f64,
    /// Diagonal of the box around it [m].
    pub extent: f64,
    /// Root of the mean square of its elements' edges, by volume [m].
    pub edge_length: f64,
    /// `μr`.
    pub relative_permeability: f64,
}

impl SkinAudit {
    /// What to tell the user of a conductor whose volume is meshed.
    pub fn volume_warning(&self) -> Option<String> {
        let (delta, depths) = (Millimetres(self.skin_depth), self.thickness_in_skin_depths);
        let instead =
            format!("use model = \"impedance\" (the region is {depths:.1} skin depths thick on average)");
        if self.coarse_share > TOLERATED_SHARE {
            return Some(format!(
                "region `{}`: the first element layer is too thick for the skin depth ({delta:.3} mm) on {:.0} % of the \
                 surface (median {:.2} elements per skin depth): the field behind it will be wrong, and any error \
                 estimate too small. Refine the skin, or {instead}",
                self.region,
                self.coarse_share * 100.0,
                self.median_elements_per_skin_depth,
            ));
        }
        let layers = self.coarse_layers.filter(|layers| layers.share > TOLERATED_SHARE)?;
        Some(format!(
            "region `{}`: below the first layer the elements are too thick for the skin depth ({delta:.3} mm) on {:.0} % of the \
             surface: one that begins {:.1} skin depths deep is {:.1} thick, and losses will be wrong. Refine the skin down to \
             three skin depths, or {instead}",
            self.region,
            layers.share.min(1.0) * 100.0,
            layers.from,
            layers.thickness,
        ))
    }

    /// Whether eddy currents are so weak under edge elements that no factor carries them: in a conductor the potential of
    /// these is held by `(h/δ)²` of the reluctivity's terms alone.
    pub fn is_too_weak_for_edges(&self) -> bool {
        self.median_elements_per_skin_depth > WEAKEST
    }

    /// How thin it is, where that is too thin for an impedance surface.
    pub fn thinness(&self) -> Option<String> {
        let (depths, delta) = (self.thickness_in_skin_depths, Millimetres(self.skin_depth));
        if depths < IMPEDANCE_THICKNESS {
            return Some(format!("on average {depths:.1} skin depths of {delta:.3} mm thick"));
        }
        (self.thin_share > TOLERATED_SHARE).then(|| {
            format!(
                "thinner than {IMPEDANCE_THICKNESS} skin depths of {delta:.3} mm under {:.0} % of its surface, down to {:.2} of them",
                100.0 * self.thin_share,
                self.least_thickness_in_skin_depths
            )
        })
    }

    /// What to tell the user of a conductor that an impedance surface replaces.
    pub fn impedance_warning(&self) -> Option<String> {
        self.thinness().map(|thinness| {
            format!(
                "region `{}`: {thinness}; an impedance surface assumes {IMPEDANCE_THICKNESS} or more, and lets nothing through to the \
                 other side. Use model = \"volume\"",
                self.region
            )
        })
    }

    /// What to tell the user of a design of which so much [m] is left where an impedance surface stands for it.
    pub fn wall_warning(&self, thickness: f64) -> Option<String> {
        let depths = thickness / self.skin_depth;
        (depths < IMPEDANCE_THICKNESS).then(|| {
            format!(
                "region `{}` is {:.3} mm thick at its thinnest place, {depths:.1} skin depths; an impedance surface assumes \
                 {IMPEDANCE_THICKNESS} or more",
                self.region,
                Millimetres(thickness)
            )
        })
    }
}

/// Audits one region of a mesh in which it is still meshed; `None` where nothing is induced or the region is empty.
///
/// The regions of `conductor` (see [`conductor_of`]), the audited one among them, have one surface, volume and extent. The first layer
/// is that under the region's own part of the surface; of a region without one, as of a core, that under all of it. A quadratic element
/// counts as two: it follows the decay over twice the thickness.
pub fn skin_audit(
    mesh: &Mesh,
    (region, conductor): (RegionId, &[RegionId]),
    material: &Material,
    frequency: f64,
    order: Order,
) -> Option<SkinAudit> {
    let skin_depth = material.skin_depth(2.0 * std::f64::consts::PI * frequency)?;
    let topology = mesh.topology();
    let own: Vec<[Point; 4]> = topology.elements_of(region).into_iter().map(|e| mesh.vertices(e)).collect();
    let own_volume: f64 = own.iter().map(|&vertices| volume(vertices)).sum();
    let squares: f64 = own.iter().map(|&vertices| volume(vertices) * mean_square_edge(vertices)).sum();
    let elements = conductor.iter().flat_map(|&part| topology.elements_of(part));
    let elements: Vec<[Point; 4]> = elements.map(|e| mesh.vertices(e)).collect();
    let around = AxisBox::around(elements.as_flattened());
    let all_volume: f64 = elements.iter().map(|&vertices| volume(vertices)).sum();

    let faces: Vec<ConductorFace> = conductor_faces(mesh, conductor).collect();
    let surface: f64 = faces.iter().map(|face| face.area).sum();
    let elements_per_depth = |face: &ConductorFace| {
        let height = 3.0 * volume(mesh.vertices(face.element)) / face.area;
        (order.degree() as f64 * skin_depth / height, face.area)
    };
    let nodes: Vec<[NodeId; 3]> = faces.iter().map(|face| face.nodes).collect();
    let inwards: Vec<[Point; 3]> = faces.iter().map(|face| face.inwards(mesh)).collect();
    let walls = walls::walls(&inwards, inwards.len(), IMPEDANCE_THICKNESS * skin_depth);
    let thin =
        || faces.iter().zip(&walls).filter_map(|(face, wall)| Some((face.area, wall.as_ref()?.thickness)));
    let thin_share = thin().map(|(area, _)| area).sum::<f64>() / surface;
    let least_thickness = thin().map(|(_, thickness)| thickness).fold(f64::INFINITY, f64::min);
    let mut layers: Vec<(f64, f64)> =
        looked_at_of(mesh, region, faces).iter().map(elements_per_depth).collect();
    let looked_at: f64 = layers.iter().map(|l| l.1).sum();
    let median = weighted_median(&mut layers)?;
    let least = layers.first()?.0;
    let coarse: f64 = layers.iter().filter(|l| l.0 < 1.0).map(|l| l.1).sum();
    Some(SkinAudit {
        region: topology.region_names()[region.index()].clone(),
        skin_depth,
        median_elements_per_skin_depth: median,
        least_elements_per_skin_depth: least,
        coarse_share: coarse / looked_at,
        coarse_layers: layers::coarse_layers(mesh, region, &nodes, skin_depth, order),
        thickness_in_skin_depths: 2.0 * all_volume / surface / skin_depth,
        thin_share,
        least_thickness_in_skin_depths: least_thickness / skin_depth,
        extent: norm(sub(around.upper, around.lower)),
        edge_length: (squares / own_volume).sqrt(),
        relative_permeability: material.relative_permeability,
    })
}

/// A face of a conductor; symmetry planes are none.
#[derive(Clone, Copy, Debug)]
pub struct ConductorFace {
    /// Its nodes.
    pub nodes: [NodeId; 3],
    /// The element under it.
    pub element: ElementId,
    /// [m²]
    pub area: f64,
}

impl ConductorFace {
    /// Its corners, oriented into the conductor.
    fn inwards(&self, mesh: &Mesh) -> [Point; 3] {
        let [a, b, c] = self.nodes.map(|node| mesh.point(node));
        let under = sub(centroid(mesh.vertices(self.element)), a);
        if dot(area_vector([a, b, c]), under) > 0.0 { [a, b, c] } else { [a, c, b] }
    }
}

/// The elements at the outer faces, by the keys of these.
fn inside_of_outer_faces(mesh: &Mesh) -> HashMap<[NodeId; 3], ElementId> {
    mesh.topology().outer_facets().map(|facet| (face_key(facet.nodes), facet.inside)).collect()
}

/// The faces of the regions of a conductor, as one.
fn conductor_faces<'a>(
    mesh: &'a Mesh,
    conductor: &'a [RegionId],
) -> impl Iterator<Item = ConductorFace> + 'a {
    let region_of = mesh.topology().region_of();
    mesh.topology().facets().iter().filter_map(move |facet| {
        let sides = [facet.inside, facet.outside?];
        let [is_inside, is_outside] = sides.map(|e| conductor.contains(&region_of[e.index()]));
        let area = || norm(area_vector(facet.nodes.map(|n| mesh.point(n))));
        let element = sides[usize::from(is_outside)];
        (is_inside != is_outside).then(|| ConductorFace { nodes: facet.nodes, element, area: area() })
    })
}

/// The faces of a conductor under which the skin of one of its regions is looked at: the region's own, and all where it has none.
pub fn first_layer(mesh: &Mesh, (region, conductor): (RegionId, &[RegionId])) -> Vec<ConductorFace> {
    looked_at_of(mesh, region, conductor_faces(mesh, conductor).collect())
}

fn looked_at_of(mesh: &Mesh, region: RegionId, faces: Vec<ConductorFace>) -> Vec<ConductorFace> {
    let region_of = mesh.topology().region_of();
    let is_own = |face: &ConductorFace| region_of[face.element.index()] == region;
    let (own, others): (Vec<_>, Vec<_>) = faces.into_iter().partition(is_own);
    if own.is_empty() { others } else { own }
}

/// The median of values by their weights, which sorts them; `None` without any.
pub fn weighted_median(values: &mut [(f64, f64)]) -> Option<f64> {
    values.sort_by(|a, b| a.0.total_cmp(&b.0));
    let half = 0.5 * values.iter().map(|own| own.1).sum::<f64>();
    let mut below = 0.0;
    let is_in_the_middle = |own: &&(f64, f64)| {
        below += own.1;
        below >= half
    };
    values.iter().find(is_in_the_middle).map(|own| own.0)
}

/// The conductor that a region is a part of: with it those of others, alike in material and model, that faces join with it, one
/// through the other.
pub fn conductor_of(mesh: &Mesh, region: RegionId, others: &[RegionId]) -> Vec<RegionId> {
    let mut found = vec![region];
    let mut k = 0;
    while let Some(&part) = found.get(k) {
        let touches = |other: &RegionId| !mesh.topology().interface(part, *other).is_empty();
        let new: Vec<RegionId> =
            others.iter().copied().filter(|other| !found.contains(other) && touches(other)).collect();
        found.extend(new);
        k += 1;
    }
    found
}

/// Mean square of the lengths of an element's edges [m²].
fn mean_square_edge(vertices: [Point; 4]) -> f64 {
    let pairs = [(0, 1), (0, 2), (0, 3), (1, 2), (1, 3), (2, 3)];
    pairs.into_iter().map(|(a, b)| norm(sub(vertices[a], vertices[b])).powi(2)).sum::<f64>() / 6.0
}

#[cfg(test)]
mod tests {
    use fluxmorph_geometry::generate::Grid;

    use super::*;

    const COPPER: Material = Material { relative_permeability: 1.0, conductivity: 5.8e7 };

    /// A plate of 20 × 20 × 8 mm in air; the number of the region at a point of it.
    fn plate(lines_of_height: &[f64], part: impl Fn(Point) -> u32) -> Mesh {
        let across = || (-1..=9).map(|i| 0.0025 * f64::from(i)).collect::<Vec<_>>();
        let mut height = vec![-0.01];
        height.extend(lines_of_height);
        height.push(0.018);
        let grid = Grid::new("grid", [across(), across(), height]).expect("a grid");
        let is_air = |x: Point| {
            !(0.0..0.02).contains(&x[0]) || !(0.0..0.02).contains(&x[1]) || !(0.0..0.008).contains(&x[2])
        };
        let region = |x: Point| RegionId(if is_air(x) { 0 } else { part(x) });
        grid.mesh(&["air", "first", "second"], region).expect("regions")
    }

    fn audit(mesh: &Mesh, region: u32, alike: &[u32]) -> SkinAudit {
        let alike: Vec<RegionId> = alike.iter().map(|&k| RegionId(k)).collect();
        let conductor = conductor_of(mesh, RegionId(region), &alike);
        skin_audit(mesh, (RegionId(region), &conductor), &COPPER, 2000.0, Order::Linear).expect("it conducts")
    }

    #[test]
    fn regions_of_one_conductor_have_one_surface() {
        let lines = [0.0, 0.002, 0.004, 0.006, 0.008];
        let whole = audit(&plate(&lines, |_| 1), 1, &[1]);
        let halves = plate(&lines, |x| if x[0] < 0.01 { 1 } else { 2 });
        for part in [1, 2] {
            let own = audit(&halves, part, &[1, 2]);
            assert!((own.thickness_in_skin_depths / whole.thickness_in_skin_depths - 1.0).abs() < 1e-12);
            assert!((own.coarse_share - whole.coarse_share).abs() < 1e-12 && own.extent == whole.extent);
            let alone = audit(&halves, part, &[]);
            assert!(alone.thickness_in_skin_depths < 0.9 * own.thickness_in_skin_depths, "{alone:?}");
        }
    }

    /// A slot of 2.5 by 15 mm and 6 mm deep leaves walls of 2.5 and 2 mm: of the surface of 1650 mm² 315 are above or below these.
    #[test]
    fn thin_walls_of_a_body_that_is_thick_on_average_are_found() {
        let is_slot =
            |x: Point| (0.0025..0.005).contains(&x[0]) && (0.0025..0.0175).contains(&x[1]) && x[2] > 0.002;
        let mesh = plate(&[0.0, 0.002, 0.004, 0.006, 0.008], |x| if is_slot(x) { 0 } else { 1 });
        let whole = (RegionId(1), &[RegionId(1)][..]);
        let audit = skin_audit(&mesh, whole, &COPPER, 8000.0, Order::Linear).expect("it conducts");
        assert!(audit.thickness_in_skin_depths > IMPEDANCE_THICKNESS, "{audit:?}");
        assert!((audit.thin_share / (315.0 / 1650.0) - 1.0).abs() < 1e-9, "{audit:?}");
        assert!(
            (audit.least_thickness_in_skin_depths * audit.skin_depth / 0.002 - 1.0).abs() < 1e-9,
            "{audit:?}"
        );
        let text = audit.impedance_warning().expect("a warning");
        assert!(text.contains("under 19 % of its surface, down to 2.71 of them"), "{text}");
    }

    /// A core that begins half a skin depth down, of one element: it has no surface, and does not follow the decay.
    #[test]
    fn a_coarse_core_under_a_fine_skin_is_found() {
        let depth = COPPER.skin_depth(std::f64::consts::TAU * 2000.0).expect("it conducts");
        let lines = [0.0, 0.5 * depth, 0.008 - 0.5 * depth, 0.008];
        let is_skin = |x: Point| x[2] < 0.5 * depth || x[2] > 0.008 - 0.5 * depth;
        let mesh = plate(&lines, |x| if is_skin(x) { 1 } else { 2 });
        let core = audit(&mesh, 2, &[1, 2]);
        let layers = core.coarse_layers.expect("an element through the core");
        assert!(layers.share > 0.1 && layers.thickness > 2.0, "{core:?}");
        assert!(core.volume_warning().is_some(), "{core:?}");
    }
}
