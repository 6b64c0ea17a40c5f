//! The skin-depth audit: is the mesh fine enough for the eddy currents it is to carry?
//!
//! A linear element thicker than the skin depth cannot follow the decay `e^{−x/δ}`: with one element through a plate of
//! 11 skin depths the field behind it was measured three times too large, with the wrong sign of the thickness effect
//! (docs/verification.md). The audit looks at the first layer of elements under every conductor face, and at all others down
//! to three depths (`layers`).

mod layers;
mod nodal;

pub use layers::CoarseLayers;
pub use nodal::NodalErrors;

use fluxmorph_geometry::box_tree::AxisBox;
use fluxmorph_geometry::tet4::{Point, area_vector, norm, sub, volume};
use fluxmorph_geometry::{ElementId, Mesh, RegionId};

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
        let (delta, depths) = (self.skin_depth * 1e3, self.thickness_in_skin_depths);
        let instead =
            format!("use model = \"impedance\" (the region is {depths:.1} skin depths thick on average)");
        if self.coarse_share > TOLERATED_SHARE {
            return Some(format!(
                "region `{}`: the first element layer is too thick for the skin depth ({delta:.3} mm) on {:.0} % of the \
                 surface (median {:.2} elements per skin depth): the field behind it will be wrong, and by more than an \
                 estimate of the error says. Refine the skin, or {instead}",
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

    /// What to tell the user of a conductor that an impedance surface replaces.
    pub fn impedance_warning(&self) -> Option<String> {
        (self.thickness_in_skin_depths < IMPEDANCE_THICKNESS).then(|| {
            format!(
                "region `{}`: on average {:.1} skin depths ({:.3} mm) thick; an impedance surface assumes {} or more, and \
                 lets nothing through to the other side. Use model = \"volume\"",
                self.region,
                self.thickness_in_skin_depths,
                self.skin_depth * 1e3,
                IMPEDANCE_THICKNESS
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
                thickness * 1e3
            )
        })
    }
}

/// Audits one region of a mesh in which it is still meshed; `None` where nothing is induced, the region is empty or nothing of it
/// but faces towards `joined`: regions of one conductor with it, whose common faces have no skin.
///
/// A quadratic element counts as two: it follows the decay over twice the thickness.
pub fn skin_audit(
    mesh: &Mesh,
    (region, joined): (RegionId, &[RegionId]),
    material: &Material,
    frequency: f64,
    order: Order,
) -> Option<SkinAudit> {
    let skin_depth = material.skin_depth(2.0 * std::f64::consts::PI * frequency)?;
    let topology = mesh.topology();
    let region_at = |e: ElementId| topology.region_of()[e.index()];
    let elements: Vec<[Point; 4]> =
        topology.elements_of(region).into_iter().map(|e| mesh.vertices(e)).collect();
    let volume_sum: f64 = elements.iter().map(|&vertices| volume(vertices)).sum();
    let around = AxisBox::around(elements.as_flattened());
    let squares: f64 = elements.iter().map(|&vertices| volume(vertices) * mean_square_edge(vertices)).sum();

    // (elements per skin depth, area) of every face of the conductor; symmetry planes are none.
    let (mut layers, mut faces) = (Vec::new(), Vec::new());
    for facet in topology.facets() {
        let Some(outside) = facet.outside else { continue };
        let (element, other) = match (region_at(facet.inside) == region, region_at(outside) == region) {
            (true, false) => (facet.inside, region_at(outside)),
            (false, true) => (outside, region_at(facet.inside)),
            _ => continue,
        };
        if joined.contains(&other) {
            continue;
        }
        let area = norm(area_vector(facet.nodes.map(|n| mesh.point(n))));
        let height = 3.0 * volume(mesh.vertices(element)) / area;
        layers.push((order.degree() as f64 * skin_depth / height, area));
        faces.push(facet.nodes);
    }
    let surface: f64 = layers.iter().map(|l| l.1).sum();
    layers.sort_by(|a, b| a.0.total_cmp(&b.0));
    let least = layers.first()?.0;
    let mut below = 0.0;
    let median = layers
        .iter()
        .find(|l| {
            below += l.1;
            below >= 0.5 * surface
        })?
        .0;
    let coarse: f64 = layers.iter().filter(|l| l.0 < 1.0).map(|l| l.1).sum();
    Some(SkinAudit {
        region: topology.region_names()[region.index()].clone(),
        skin_depth,
        median_elements_per_skin_depth: median,
        least_elements_per_skin_depth: least,
        coarse_share: coarse / surface,
        coarse_layers: layers::coarse_layers(mesh, region, &faces, skin_depth, order),
        thickness_in_skin_depths: 2.0 * volume_sum / surface / skin_depth,
        extent: norm(sub(around.upper, around.lower)),
        edge_length: (squares / volume_sum).sqrt(),
        relative_permeability: material.relative_permeability,
    })
}

/// Mean square of the lengths of an element's edges [m²].
fn mean_square_edge(vertices: [Point; 4]) -> f64 {
    let pairs = [(0, 1), (0, 2), (0, 3), (1, 2), (1, 3), (2, 3)];
    pairs.into_iter().map(|(a, b)| norm(sub(vertices[a], vertices[b])).powi(2)).sum::<f64>() / 6.0
}
