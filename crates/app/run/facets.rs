//! How far the facets of a mesh are from the curved surfaces that they stand for: the error of the geometry, which no
//! refinement of the mesh takes away, since new nodes lie on the facets, and which is in no estimate of the field.
//!
//! The surface is taken from the facets themselves: with the mean normals `n` of the smooth surface at the ends of an edge `e`, its
//! middle lies `|(n_b − n_a)·e|/8` off, exactly so of a circle (`L²/(8R)`). Facets of one interface are one smooth surface
//! where they meet at less than [`SMOOTH`]; flatter than [`FLAT`] they are a plane.

use std::collections::BTreeMap;

use fluxmorph_geometry::tet4::{Point, area_vector, centroid, dot, norm, sub};
use fluxmorph_geometry::{Mesh, Millimetres, NodeId, millimetres};

use crate::build::{functionals, is_air, is_wound};
use crate::config::Config;
use crate::files::CurvedFacets;

/// Cosine of the largest angle, 35°, at which two facets are taken for one curved surface: a ball with eight of them along a half
/// circle, and no chamfer of 45°.
const SMOOTH: f64 = 0.82;

/// Share of an edge's length below which its middle is taken to lie on the surface: planes of a mesh file with few digits.
const FLAT: f64 = 1e-5;

/// A face between two regions, or at the outside of one.
struct Face {
    nodes: [NodeId; 3],
    /// Of the regions on both sides; the second is missing at the outside.
    between: (usize, Option<usize>),
    area: Point,
}

/// Whether two faces belong to one smooth surface.
fn is_smooth(a: &Face, b: &Face) -> bool {
    a.between == b.between && dot(a.area, b.area) > SMOOTH * norm(a.area) * norm(b.area)
}

/// The edge whose middle is farthest off the surface that its facets stand for; `None` where no surface is curved. Between two
/// regions that are `empty` there is none: nothing changes there.
pub(super) fn curved_facets(mesh: &Mesh, empty: impl Fn(&str) -> bool) -> Option<CurvedFacets> {
    let topology = mesh.topology();
    let empty: Vec<bool> = topology.region_names().iter().map(|name| empty(name)).collect();
    let region = |e: fluxmorph_geometry::ElementId| topology.region_of()[e.index()].index();
    let of = |facet: &fluxmorph_geometry::topology::Facet| {
        let between = (region(facet.inside), facet.outside.map(region));
        let area = area_vector(facet.nodes.map(|n| mesh.point(n)));
        // One direction for both orders of the regions.
        match between {
            (own, Some(other)) if own == other || empty[own] && empty[other] => None,
            (own, Some(other)) if own > other => {
                Some(Face { nodes: facet.nodes, between: (other, Some(own)), area: area.map(|c| -c) })
            }
            _ => Some(Face { nodes: facet.nodes, between, area }),
        }
    };
    let faces: Vec<Face> = topology.facets().iter().filter_map(of).collect();
    let mut around: BTreeMap<NodeId, Vec<usize>> = BTreeMap::new();
    for (i, face) in faces.iter().enumerate() {
        face.nodes.iter().for_each(|&n| around.entry(n).or_default().push(i));
    }
    let normal = |node: NodeId, face: &Face| {
        let own = around[&node].iter().map(|&i| &faces[i]).filter(|other| is_smooth(face, other));
        let sum = own.fold([0.0; 3], |sum: Point, f| std::array::from_fn(|d| sum[d] + f.area[d]));
        sum.map(|c| c / norm(sum))
    };
    // The outside counts where nothing inside is curved.
    let mut worst: Option<((bool, f64), [NodeId; 2], &Face)> = None;
    for face in &faces {
        let normals = face.nodes.map(|n| normal(n, face));
        for (a, b) in [(0, 1), (1, 2), (2, 0)] {
            let along = sub(mesh.point(face.nodes[b]), mesh.point(face.nodes[a]));
            let off = dot(sub(normals[b], normals[a]), along).abs() / 8.0;
            let rank = (face.between.1.is_some(), off);
            if off > FLAT * norm(along) && worst.is_none_or(|(most, ..)| rank > most) {
                worst = Some((rank, [face.nodes[a], face.nodes[b]], face));
            }
        }
    }
    worst.map(|((_, off_m), ends, face)| {
        let name = |region: usize| topology.region_names()[region].as_str();
        let (own, other) = face.between;
        let [a, b] = ends.map(|n| mesh.point(n));
        CurvedFacets {
            surface: format!("{}|{}", name(own), other.map_or("outside", name)),
            off_m,
            at_m: centroid([a, b]),
        }
    })
}

/// Whether a region is air in which nothing flows and nothing is measured.
pub(super) fn is_empty(config: &Config, name: &str) -> bool {
    is_air(config, name)
        && !is_wound(config, name)
        && !config.forces.iter().any(|body| body.regions.iter().any(|own| own == name))
        && !functionals(config).iter().any(|(_, own)| own.region.as_deref() == Some(name))
}

/// What no refinement takes away, in words.
pub(super) fn described(found: &CurvedFacets) -> String {
    format!(
        "`{}` is curved, and its facets are up to {:.3} mm off it, at {}: no error bar counts that, and refined meshes and cut \
         elements keep the facets; begin with smaller faces there to see what it does",
        found.surface,
        Millimetres(found.off_m),
        millimetres(found.at_m)
    )
}

#[cfg(test)]
mod tests {
    use fluxmorph_geometry::generate::{BlockParameters, SphereParameters, block, sphere};
    use fluxmorph_geometry::refine::{RefineLimits, uniform};

    use super::*;

    /// The edges of a ball's facets are `L²/(8R)` off; halved edges lie on the same facets, and the angles say the same of them to
    /// what a facet hides; a block is not curved.
    #[test]
    fn the_facets_of_a_ball_are_off_it_by_the_height_of_their_arcs() {
        let parameters = SphereParameters { radius: 0.05, divisions: 6, ..SphereParameters::default() };
        let mesh = sphere(&parameters).expect("a ball");
        let found = curved_facets(&mesh, |_| false).expect("it is curved");
        // The outer sphere is the larger one, and only the outside.
        assert_eq!(found.surface, "air|sphere");
        let radius = parameters.radius;
        let [ball, air] = ["sphere", "air"].map(|name| mesh.topology().region(name).expect("it has both"));
        let surface = mesh.topology().interface(ball, air);
        let edges = surface.iter().flat_map(|&[a, b, c]| [(a, b), (b, c), (c, a)]);
        let middle = |(a, b)| radius - norm(centroid([mesh.point(a), mesh.point(b)]));
        let height = edges.map(middle).fold(0.0, f64::max);
        assert!((found.off_m / height - 1.0).abs() < 0.1, "{} {height}", found.off_m);
        assert!((radius - norm(found.at_m) - height).abs() < 0.2 * height);
        let finer = uniform(&mesh, RefineLimits::default()).expect("finer");
        let kept = curved_facets(finer.mesh(), |_| false).expect("it is curved");
        assert!(kept.off_m > 0.1 * height, "{} {height}", kept.off_m);
        let outside = curved_facets(&mesh, |_| true).expect("it is a ball as a whole");
        assert_eq!(outside.surface, "air|outside");
        let flat = block(&BlockParameters { size: [0.1; 3], cells: [3; 3] }).expect("a block");
        assert_eq!(curved_facets(&flat, |_| false), None);
    }
}
