//! Elements under the first layer: do they follow the decay into the conductor?
//!
//! Interpolated linearly, `e^{−x/δ}` errs by `(h/δ)² e^{−a/δ}`, but for a factor, over an element from the depth `a` to
//! `a + h`. The first layer is allowed `h = δ`; as much error as that makes an element with `h = δ e^{a/2δ}`. So an element
//! counts as `(δ/h) e^{a/2δ}` to a skin depth. The depth of a node is its distance from the surface; the thickness of an
//! element is the range of its nodes' depths, or, where its middle lies deeper than all of them as between two faces, twice the
//! depth of the middle under the first. Three depths down 5 % of the field are left, and nobody looks.

use fluxmorph_geometry::depth::depths;
use fluxmorph_geometry::tet4::{Point, area_vector, centroid, norm, volume};
use fluxmorph_geometry::{ElementId, Mesh, NodeId, RegionId};

use crate::elements::Order;

/// Skin depths down to which elements are looked at.
const DEEPEST: f64 = 3.0;

/// Depth beyond which its exact value does not matter, in skin depths: an element from 3 to there is too thick at any depth,
/// `e^{1.5} = 4.5`.
const FAR: f64 = 8.0;

/// Elements under the surface of a conductor that do not follow the decay.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CoarseLayers {
    /// The area under which they lie, as a share of the conductor's surface; two layers count twice.
    pub share: f64,
    /// Where the worst of them begins, in skin depths under the surface.
    pub from: f64,
    /// Its thickness in skin depths.
    pub thickness: f64,
}

/// The coarse elements of a region under its faces; `None` where all of them follow the decay.
pub(super) fn coarse_layers(
    mesh: &Mesh,
    region: RegionId,
    faces: &[[NodeId; 3]],
    skin_depth: f64,
    order: Order,
) -> Option<CoarseLayers> {
    let topology = mesh.topology();
    let elements = topology.elements_of(region);
    let mut nodes: Vec<NodeId> = elements.iter().flat_map(|&e| topology.tet(e)).collect();
    nodes.sort_unstable();
    nodes.dedup();
    let places: Vec<Point> = nodes.iter().map(|&n| mesh.point(n)).collect();
    let far = FAR * skin_depth;
    let of_nodes = depths(mesh, faces, &places, far);
    let depth = |n: NodeId| of_nodes[nodes.binary_search(&n).expect("a node of the region")] / skin_depth;
    // The first layer is looked at for itself, face by face.
    let below = |e: &ElementId| {
        let from = topology.tet(*e).map(depth).into_iter().fold(f64::INFINITY, f64::min);
        from > 0.0 && from < DEEPEST
    };
    let elements: Vec<ElementId> = elements.into_iter().filter(below).collect();
    let middles: Vec<Point> = elements.iter().map(|&e| centroid(mesh.vertices(e))).collect();
    let of_middles = depths(mesh, faces, &middles, far);
    let surface: f64 = faces.iter().map(|f| norm(area_vector(f.map(|n| mesh.point(n))))).sum();
    let mut coarse = 0.0;
    let mut worst: Option<(f64, CoarseLayers)> = None;
    for (e, middle) in elements.into_iter().zip(of_middles) {
        let own = topology.tet(e).map(depth);
        let from = own.into_iter().fold(f64::INFINITY, f64::min);
        let to = own.into_iter().fold(0.0, f64::max);
        let thickness = if middle > to * skin_depth { 2.0 * (middle / skin_depth - from) } else { to - from };
        let per_depth = order.degree() as f64 / thickness * (0.5 * from).exp();
        if per_depth >= 1.0 {
            continue;
        }
        // The elements of a layer fill it: the sum of V/h over them is its area.
        coarse += volume(mesh.vertices(e)) / (thickness * skin_depth);
        if worst.is_none_or(|(least, _)| per_depth < least) {
            worst = Some((per_depth, CoarseLayers { share: 0.0, from, thickness }));
        }
    }
    worst.map(|(_, layers)| CoarseLayers { share: coarse / surface, ..layers })
}

#[cfg(test)]
mod tests {
    use super::*;
    use fluxmorph_geometry::generate::{BlockParameters, block};

    /// A block of a square metre in layers up to these heights, with the faces at some heights as its surface.
    fn layered(heights: [f64; 4], surface: &[f64]) -> Option<CoarseLayers> {
        let block = block(&BlockParameters { size: [1.0, 1.0, 4.0], cells: [4, 4, 4] }).expect("a block");
        let level = |z: f64| (z.round() as usize).checked_sub(1).map_or(0.0, |k| heights[k]);
        let points = block.points().iter().map(|[x, y, z]| [*x, *y, level(*z)]).collect();
        let mesh = Mesh::new(std::sync::Arc::clone(block.topology()), points).expect("layers");
        let facets = mesh.topology().facets().iter().map(|f| f.nodes);
        let faces: Vec<_> =
            facets.filter(|f| surface.iter().any(|&at| f.iter().all(|&n| mesh.point(n)[2] == at))).collect();
        coarse_layers(&mesh, RegionId(0), &faces, 1.0, Order::Linear)
    }

    #[test]
    fn growing_layers_follow_the_decay_and_a_thick_one_under_thin_ones_does_not() {
        // From 0.9 a layer may be e^{0.45} = 1.57 thick, from 2.4 e^{1.2} = 3.3.
        assert_eq!(layered([0.9, 2.4, 5.6, 9.0], &[0.0]), None);
        let found = layered([0.45, 0.47, 11.0, 12.0], &[0.0]).expect("the third layer is ten depths thick");
        assert!((found.share - 1.0).abs() < 1e-12, "{found:?}");
        assert!((found.from - 0.47).abs() < 1e-12 && (found.thickness - 10.53).abs() < 1e-12, "{found:?}");
        // Coarse elements below three depths are nobody's concern.
        assert_eq!(layered([0.9, 2.0, 3.1, 40.0], &[0.0]), None);
        // A plate with a layer at each face and one between them, whose nodes are all equally deep.
        let found = layered([0.2, 0.45, 9.55, 10.0], &[0.0, 10.0]).expect("the middle is nine depths thick");
        assert!((found.from - 0.45).abs() < 1e-12 && (4.5..9.2).contains(&found.thickness), "{found:?}");
    }
}
