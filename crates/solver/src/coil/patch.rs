//! The elements of a coil region on their own: local node numbers, faces and separate parts. What makes parts separate is said by
//! [`Contact`].

use std::collections::HashMap;

use fluxmorph_geometry::disjoint_sets::DisjointSets;
use fluxmorph_geometry::tet4::{FACES, Point, Tet4, area_vector, dot, norm};
use fluxmorph_geometry::topology::face_key;
use fluxmorph_geometry::{ElementId, Mesh, NodeId};

/// A face of the region's elements.
#[derive(Clone, Copy, Debug)]
pub(super) struct PatchFace {
    /// Nodes of the mesh, ascending.
    pub(super) key: [NodeId; 3],
    /// Area vector out of `inside` [m²].
    pub(super) area: Point,
    /// Position of the element the area vector points out of.
    pub(super) inside: usize,
    /// Position of the element behind it; `None` on the region's wall.
    pub(super) outside: Option<usize>,
}

/// A set of elements with what a nodal problem on it needs.
#[derive(Debug)]
pub(super) struct Patch {
    /// The elements, ascending.
    pub(super) elements: Vec<ElementId>,
    /// Geometry of each element.
    pub(super) tets: Vec<Tet4>,
    /// Local nodes of each element.
    pub(super) connectivity: Vec<[NodeId; 4]>,
    /// Position of every local node [m].
    pub(super) points: Vec<Point>,
    /// All faces, by their nodes.
    pub(super) faces: Vec<PatchFace>,
    /// The part of every local node, numbered from 0 in the order of their first nodes.
    pub(super) part_of: Vec<usize>,
    /// Separate parts.
    pub(super) parts: usize,
    /// The node of the mesh of every local node.
    mesh_nodes: Vec<NodeId>,
}

/// What joins elements to one part. Nodes that several parts have are local nodes of each.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Contact {
    /// A node: all that touches conducts.
    Node,
    /// A face: strands do not pass along a line.
    Face,
}

impl Patch {
    pub(super) fn new(mesh: &Mesh, elements: &[ElementId], contact: Contact) -> Self {
        let topology = mesh.topology();
        let mut elements = elements.to_vec();
        elements.sort_unstable();
        elements.dedup();
        let faces = faces(mesh, &elements);
        let tets: Vec<[NodeId; 4]> = elements.iter().map(|&e| topology.tet(e)).collect();
        let joined = joined(&tets, &faces, contact);
        // A node of each part that has it.
        let mut nodes: Vec<(NodeId, usize)> =
            tets.iter().zip(&joined).flat_map(|(tet, part)| tet.map(|n| (n, *part))).collect();
        nodes.sort_unstable();
        nodes.dedup();
        let local = |node| NodeId::new(nodes.binary_search(&node).expect("it is among them"));
        let connectivity =
            tets.iter().zip(&joined).map(|(tet, part)| tet.map(|n| local((n, *part)))).collect();
        let mut numbers: HashMap<usize, usize> = HashMap::new();
        let number = |(_, part): &(NodeId, usize)| {
            let next = numbers.len();
            *numbers.entry(*part).or_insert(next)
        };
        let part_of = nodes.iter().map(number).collect();
        Self {
            tets: elements.iter().map(|&e| Tet4::new(mesh.vertices(e))).collect(),
            points: nodes.iter().map(|(n, _)| mesh.point(*n)).collect(),
            faces,
            elements,
            connectivity,
            part_of,
            parts: numbers.len(),
            mesh_nodes: nodes.into_iter().map(|(n, _)| n).collect(),
        }
    }

    /// A face by its nodes in the mesh, ascending.
    pub(super) fn face(&self, key: &[NodeId; 3]) -> Option<&PatchFace> {
        self.faces.binary_search_by_key(key, |face| face.key).ok().map(|i| &self.faces[i])
    }

    /// The local nodes of a face, in the element that its area vector points out of.
    pub(super) fn nodes_of(&self, face: &PatchFace) -> impl Iterator<Item = NodeId> {
        let is_of_face = |n: &NodeId| face.key.contains(&self.mesh_nodes[n.index()]);
        self.connectivity[face.inside].into_iter().filter(is_of_face)
    }

    /// The part of an element, by position.
    pub(super) fn part_of_element(&self, e: usize) -> usize {
        self.part_of[self.connectivity[e][0].index()]
    }

    /// The four vertices of an element, by position [m].
    pub(super) fn vertices(&self, e: usize) -> [Point; 4] {
        self.connectivity[e].map(|n| self.points[n.index()])
    }

    /// The gradient of a nodal field on every element.
    pub(super) fn gradient(&self, nodal: &[f64]) -> Vec<Point> {
        self.connectivity
            .iter()
            .zip(&self.tets)
            .map(|(nodes, tet)| {
                std::array::from_fn(|d| {
                    nodes.iter().zip(&tet.gradients).map(|(n, g)| nodal[n.index()] * g[d]).sum()
                })
            })
            .collect()
    }

    /// A field constant on each element, averaged over the elements around each node by their volumes, and over the nodes of each
    /// element: of a field between elements an approximation of one order more.
    pub(super) fn smoothed(&self, field: &[Point]) -> Vec<Point> {
        let mut sums = vec![([0.0; 3], 0.0); self.points.len()];
        for ((nodes, tet), u) in self.connectivity.iter().zip(&self.tets).zip(field) {
            for n in nodes {
                let (sum, volume) = &mut sums[n.index()];
                *sum = std::array::from_fn(|d| sum[d] + tet.volume * u[d]);
                *volume += tet.volume;
            }
        }
        let mean = |nodes: &[NodeId; 4]| {
            let around = nodes.map(|n| sums[n.index()]);
            std::array::from_fn(|d| 0.25 * around.iter().map(|(sum, volume)| sum[d] / volume).sum::<f64>())
        };
        self.connectivity.iter().map(mean).collect()
    }

    /// `∫u·v dV` of two fields constant on each element.
    pub(super) fn inner(&self, u: &[Point], v: &[Point]) -> f64 {
        self.tets.iter().zip(u).zip(v).map(|((tet, u), v)| tet.volume * dot(*u, *v)).sum()
    }

    /// `(∫|u|² dV)^½`.
    pub(super) fn norm(&self, u: &[Point]) -> f64 {
        self.inner(u, u).sqrt()
    }

    /// `(∫|u|² dV / V)^½`.
    pub(super) fn rms(&self, u: &[Point]) -> f64 {
        self.norm(u) / self.tets.iter().map(|t| t.volume).sum::<f64>().sqrt()
    }
}

/// Faces of elements, ascending by nodes.
fn faces(mesh: &Mesh, elements: &[ElementId]) -> Vec<PatchFace> {
    let mut all: Vec<PatchFace> = elements
        .iter()
        .enumerate()
        .flat_map(|(position, &e)| {
            let tet = mesh.topology().tet(e);
            FACES.map(|face| {
                let nodes = face.map(|v| tet[v]);
                PatchFace {
                    key: face_key(nodes),
                    area: area_vector(nodes.map(|n| mesh.point(n))),
                    inside: position,
                    outside: None,
                }
            })
        })
        .collect();
    all.sort_by_key(|f| (f.key, f.inside));
    all.chunk_by(|a, b| a.key == b.key)
        .map(|same| PatchFace { outside: same.get(1).map(|f| f.inside), ..same[0] })
        .collect()
}

/// Which elements are joined: of each the first one of its part.
fn joined(tets: &[[NodeId; 4]], faces: &[PatchFace], contact: Contact) -> Vec<usize> {
    let mut sets = DisjointSets::new(tets.len());
    match contact {
        Contact::Face => {
            let pairs = faces.iter().filter_map(|face| Some([face.inside, face.outside?]));
            pairs.for_each(|pair| sets.join(pair));
        }
        Contact::Node => {
            let mut first: HashMap<NodeId, usize> = HashMap::new();
            for (e, tet) in tets.iter().enumerate() {
                tet.iter().for_each(|n| sets.join([*first.entry(*n).or_insert(e), e]));
            }
        }
    }
    (0..tets.len()).map(|e| sets.root(e)).collect()
}

/// `u/|u|`, zero where `u` is below `least`.
pub(super) fn direction(u: Point, least: f64) -> Point {
    let length = norm(u);
    if length > least { u.map(|c| c / length) } else { [0.0; 3] }
}
