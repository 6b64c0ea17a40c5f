//! Uniform refinement of any tetrahedral mesh: every element in eight, with its regions and surfaces.

use std::collections::HashMap;
use std::sync::Arc;

use fluxmorph_geometry::tet4::Point;
use fluxmorph_geometry::{Mesh, NodeId, Topology};

/// Nodes at the middles of edges, made as they are asked for.
struct Middles {
    points: Vec<Point>,
    of_edge: HashMap<[NodeId; 2], NodeId>,
}

impl Middles {
    fn between(&mut self, a: NodeId, b: NodeId) -> NodeId {
        let points = &mut self.points;
        *self.of_edge.entry([a.min(b), a.max(b)]).or_insert_with(|| {
            let [p, q] = [a, b].map(|n| points[n.index()]);
            points.push([0, 1, 2].map(|d| 0.5 * (p[d] + q[d])));
            NodeId::new(points.len() - 1)
        })
    }
}

/// The mesh with every edge halved.
pub(super) fn refined(mesh: &Mesh) -> Mesh {
    let topology = mesh.topology();
    let mut middles = Middles { points: mesh.points().to_vec(), of_edge: HashMap::new() };
    let (mut tets, mut regions) = (Vec::new(), Vec::new());
    for (tet, region) in topology.tets().iter().zip(topology.region_of()) {
        tets.extend(eight(*tet, &mut middles));
        regions.extend([*region; 8]);
    }
    let names = topology.region_names().to_vec();
    let mut finer = Topology::new(middles.points.len(), tets, names, regions).expect("it conforms");
    for name in topology.surface_names() {
        let coarse = topology.surface(name).expect("it has a name");
        let triangles = coarse.iter().flat_map(|&[a, b, c]| {
            let [ab, bc, ca] = [[a, b], [b, c], [c, a]].map(|[p, q]| middles.between(p, q));
            [[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]
        });
        let triangles = triangles.collect();
        finer = finer.with_surface(name, triangles).expect("its nodes exist");
    }
    Mesh::new(Arc::new(finer), middles.points).expect("parts of elements with a volume")
}

/// Four corners, and the octahedron in the middle in four along its shortest diagonal.
fn eight([a, b, c, d]: [NodeId; 4], middles: &mut Middles) -> [[NodeId; 4]; 8] {
    let edges = [[a, b], [a, c], [a, d], [b, c], [b, d], [c, d]];
    let [ab, ac, ad, bc, bd, cd] = edges.map(|[p, q]| middles.between(p, q));
    let square = |p: NodeId, q: NodeId| {
        let [p, q] = [p, q].map(|n| middles.points[n.index()]);
        (0..3).map(|i| (p[i] - q[i]).powi(2)).sum::<f64>()
    };
    // A diagonal, and the ring of the other four around it, right-handed about it.
    let diagonals =
        [([ab, cd], [ad, bd, bc, ac]), ([ac, bd], [bc, cd, ad, ab]), ([ad, bc], [ac, cd, bd, ab])];
    let shortest =
        diagonals.into_iter().min_by(|x, y| square(x.0[0], x.0[1]).total_cmp(&square(y.0[0], y.0[1])));
    let ([p, q], ring) = shortest.expect("there are three");
    [
        [a, ab, ac, ad],
        [ab, b, bc, bd],
        [ac, bc, c, cd],
        [ad, bd, cd, d],
        [p, q, ring[0], ring[1]],
        [p, q, ring[1], ring[2]],
        [p, q, ring[2], ring[3]],
        [p, q, ring[3], ring[0]],
    ]
}

#[test]
fn a_refined_mesh_has_the_same_regions_and_surfaces() {
    use fluxmorph_geometry::tet4::{area_vector, norm, volume};
    let coarse = crate::meshes::unit_cube(2, &["left", "right"], |centre| u32::from(centre[0] > 0.5));
    let fine = refined(&coarse);
    assert_eq!(fine.topology().tets().len(), 8 * coarse.topology().tets().len());
    let of = |mesh: &Mesh| {
        let topology = mesh.topology();
        let right = topology.region("right").expect("it has it");
        let size: f64 = topology.elements_of(right).iter().map(|&e| volume(mesh.vertices(e))).sum();
        let face = topology.surface("y_max").expect("a cube has it");
        let area: f64 = face.iter().map(|t| norm(area_vector(t.map(|n| mesh.point(n))))).sum();
        assert!(face.iter().all(|t| topology.has_face(*t)));
        [size, area]
    };
    // Rounding.
    assert!((0..2).all(|i| (of(&fine)[i] - of(&coarse)[i]).abs() < 1e-12));
}
