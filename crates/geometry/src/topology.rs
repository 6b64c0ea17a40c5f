//! What never changes while a mesh moves: connectivity, regions, named surfaces, and what follows from them.
//!
//! Lives here: which nodes make which tetrahedron, which elements make which region, the faces between regions and at
//! the outside, and the incidence node → elements. Does not live here: any coordinate (see [`crate::Mesh`]).

use std::collections::{BTreeMap, BTreeSet};

use crate::error::MeshError;
use crate::facets::find_facets;
use crate::ids::{ElementId, NodeId, RegionId};
use crate::incidence::Incidence;

/// What stands for the outside of the mesh in the name of an interface.
pub const OUTSIDE: &str = "outside";

/// The nodes of a triangle, ascending: the same for every order and orientation.
pub fn face_key(mut nodes: [NodeId; 3]) -> [NodeId; 3] {
    nodes.sort_unstable();
    nodes
}

/// The nodes of an edge, ascending.
pub fn edge_key([a, b]: [NodeId; 2]) -> [NodeId; 2] {
    [a.min(b), a.max(b)]
}

/// The edges of a triangle, each with ascending nodes.
pub fn triangle_edges([a, b, c]: [NodeId; 3]) -> [[NodeId; 2]; 3] {
    [[a, b], [b, c], [c, a]].map(edge_key)
}

/// The edges that only one of some triangles has.
pub fn rim_edges(triangles: &[[NodeId; 3]]) -> BTreeSet<[NodeId; 2]> {
    around_edges(triangles).into_iter().filter(|(_, at)| at.len() == 1).map(|(edge, _)| edge).collect()
}

/// The triangles at every edge, by their numbers, ascending.
pub fn around_edges(triangles: &[[NodeId; 3]]) -> BTreeMap<[NodeId; 2], Vec<usize>> {
    let mut around: BTreeMap<[NodeId; 2], Vec<usize>> = BTreeMap::new();
    for (t, triangle) in triangles.iter().enumerate() {
        triangle_edges(*triangle).into_iter().for_each(|edge| around.entry(edge).or_default().push(t));
    }
    around
}

/// Whether two orders of the same three nodes have the same normal.
pub(crate) fn same_turn(a: [NodeId; 3], b: [NodeId; 3]) -> bool {
    (0..3).any(|shift| (0..3).all(|k| a[k] == b[(k + shift) % 3]))
}

/// A triangle between two regions or at the outside of the mesh.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Facet {
    /// Nodes, ordered so that the area vector points out of `inside`.
    pub nodes: [NodeId; 3],
    /// The element the normal points out of.
    pub inside: ElementId,
    /// The element on the other side; `None` at the outside of the mesh.
    pub outside: Option<ElementId>,
}

/// What is left of a topology without one region.
#[derive(Clone, Debug)]
pub struct Remainder {
    /// The remaining elements, in their order, on renumbered nodes.
    pub topology: Topology,
    /// The old node of every new one.
    pub old_of: Vec<NodeId>,
    /// Faces towards the removed region, now outside faces, oriented out of the remaining elements.
    pub exposed: Vec<[NodeId; 3]>,
}

/// Connectivity, regions and named surfaces of a tetrahedral mesh; immutable and shared.
#[derive(Clone, Debug)]
pub struct Topology {
    node_count: usize,
    tets: Vec<[NodeId; 4]>,
    region_names: Vec<String>,
    region_of: Vec<RegionId>,
    surfaces: BTreeMap<String, Vec<[NodeId; 3]>>,
    cells: BTreeMap<String, Vec<Vec<ElementId>>>,
    incidence: Incidence,
    facets: Vec<Facet>,
}

/// Most tetrahedra around a node: a hundred times what a mesh has, and few enough for 16-bit places in its matrix rows.
const MOST_AROUND: usize = 4096;

impl Topology {
    /// A topology of `node_count` nodes.
    ///
    /// `region_of` has one entry per tet and indexes `region_names`. The node order of a tet decides the sign of its
    /// volume; it is checked where there are coordinates, in [`crate::Mesh::new`]. With volumes of one sign, two tets with
    /// a common face lie on its two sides exactly where they see it turned the other way round: that is checked here.
    ///
    /// # Errors
    /// [`MeshError::DanglingNode`], [`MeshError::CrowdedNode`], [`MeshError::OverfullFace`] and [`MeshError::Folded`].
    ///
    /// # Panics
    /// If `region_of` and `tets` differ in length or a region id has no name: both are the caller's to keep.
    pub fn new(
        node_count: usize,
        tets: Vec<[NodeId; 4]>,
        region_names: Vec<String>,
        region_of: Vec<RegionId>,
    ) -> Result<Self, MeshError> {
        assert_eq!(tets.len(), region_of.len(), "one region an element");
        assert!(region_of.iter().all(|r| r.index() < region_names.len()), "every region has a name");
        if let Some(&node) = tets.iter().flatten().find(|n| n.index() >= node_count) {
            return Err(MeshError::DanglingNode { node, nodes: node_count });
        }
        let incidence = Incidence::new(node_count, &tets);
        let crowded = (0..node_count).map(NodeId::new).find(|&n| incidence.around(n).len() > MOST_AROUND);
        if let Some(node) = crowded {
            return Err(MeshError::CrowdedNode {
                node,
                tets: incidence.around(node).len(),
                most: MOST_AROUND,
            });
        }
        let facets = find_facets(node_count, &tets, &region_of)?;
        Ok(Self {
            node_count,
            tets,
            region_names,
            region_of,
            surfaces: BTreeMap::new(),
            cells: BTreeMap::new(),
            incidence,
            facets,
        })
    }

    /// Adds (or replaces) a named surface, given by its triangles.
    ///
    /// # Errors
    /// [`MeshError::DanglingNode`].
    pub fn with_surface(mut self, name: &str, triangles: Vec<[NodeId; 3]>) -> Result<Self, MeshError> {
        if let Some(&node) = triangles.iter().flatten().find(|n| n.index() >= self.node_count) {
            return Err(MeshError::DanglingNode { node, nodes: self.node_count });
        }
        self.surfaces.insert(name.to_owned(), triangles);
        Ok(self)
    }

    /// Partitions a region into cells, each a list of elements: the observation cells of `Σ B·B*`.
    pub fn with_cells(mut self, region: &str, cells: Vec<Vec<ElementId>>) -> Self {
        self.cells.insert(region.to_owned(), cells);
        self
    }

    /// Number of nodes.
    pub fn node_count(&self) -> usize {
        self.node_count
    }

    /// Nodes of every tetrahedron.
    pub fn tets(&self) -> &[[NodeId; 4]] {
        &self.tets
    }

    /// Nodes of one tetrahedron.
    #[inline]
    pub fn tet(&self, element: ElementId) -> [NodeId; 4] {
        self.tets[element.index()]
    }

    /// All elements, in order.
    pub fn elements(&self) -> impl ExactSizeIterator<Item = ElementId> + Clone + use<> {
        (0..self.tets.len()).map(ElementId::new)
    }

    /// All nodes, in order.
    pub fn nodes(&self) -> impl ExactSizeIterator<Item = NodeId> + Clone + use<> {
        (0..self.node_count).map(NodeId::new)
    }

    /// Region of every element.
    pub fn region_of(&self) -> &[RegionId] {
        &self.region_of
    }

    /// Names of the regions, by [`RegionId`].
    pub fn region_names(&self) -> &[String] {
        &self.region_names
    }

    /// Name of the region of an element.
    ///
    /// # Panics
    /// If there is no such element.
    pub fn region_name_at(&self, element: ElementId) -> &str {
        &self.region_names[self.region_of[element.index()].index()]
    }

    /// The region of a name.
    ///
    /// # Errors
    /// [`MeshError::UnknownRegion`] lists the names there are.
    pub fn region(&self, name: &str) -> Result<RegionId, MeshError> {
        self.region_names.iter().position(|n| n == name).map(RegionId::new).ok_or_else(|| {
            MeshError::UnknownRegion { name: name.to_owned(), known: self.region_names.join(", ") }
        })
    }

    /// The elements of a region, ascending.
    pub fn elements_of(&self, region: RegionId) -> Vec<ElementId> {
        self.elements().filter(|e| self.region_of[e.index()] == region).collect()
    }

    /// The cells of a region: those given by [`Topology::with_cells`], else one per element.
    pub fn cells_of(&self, region: RegionId) -> Vec<Vec<ElementId>> {
        match self.cells.get(&self.region_names[region.index()]) {
            Some(cells) => cells.clone(),
            None => self.elements_of(region).into_iter().map(|e| vec![e]).collect(),
        }
    }

    /// The cells of a region as given by [`Topology::with_cells`]; `None` where its elements are its cells.
    pub fn given_cells(&self, region: &str) -> Option<&[Vec<ElementId>]> {
        self.cells.get(region).map(Vec::as_slice)
    }

    /// Names of the surfaces, sorted.
    pub fn surface_names(&self) -> impl Iterator<Item = &str> {
        self.surfaces.keys().map(String::as_str)
    }

    /// Triangles of a named surface.
    ///
    /// # Errors
    /// [`MeshError::UnknownSurface`] lists the names there are.
    pub fn surface(&self, name: &str) -> Result<&[[NodeId; 3]], MeshError> {
        self.surfaces.get(name).map(Vec::as_slice).ok_or_else(|| MeshError::UnknownSurface {
            name: name.to_owned(),
            known: self.surface_names().collect::<Vec<_>>().join(", "),
        })
    }

    /// Elements that touch a node, ascending.
    #[inline]
    pub fn elements_around(&self, node: NodeId) -> &[ElementId] {
        self.incidence.around(node)
    }

    /// Whether each node is one of some elements, shape `(n_nodes,)`.
    pub fn is_node_of(&self, elements: impl IntoIterator<Item = ElementId>) -> Vec<bool> {
        let mut is_in = vec![false; self.node_count];
        elements.into_iter().flat_map(|e| self.tet(e)).for_each(|node| is_in[node.index()] = true);
        is_in
    }

    /// Whether three different nodes make a face of some element.
    pub fn has_face(&self, nodes: [NodeId; 3]) -> bool {
        let [a, b, c] = nodes;
        // The node with the fewest elements: a hub of many faces is not searched for each of them.
        let least = nodes.into_iter().min_by_key(|&n| self.elements_around(n).len()).unwrap_or(a);
        let holds = |e: &ElementId| nodes.iter().all(|n| self.tet(*e).contains(n));
        a != b && b != c && c != a && self.elements_around(least).iter().any(holds)
    }

    /// Faces between two regions and at the outside, ordered by (inside element, local face).
    pub fn facets(&self) -> &[Facet] {
        &self.facets
    }

    /// Faces at the outside of the mesh, in the order of [`Topology::facets`].
    pub fn outer_facets(&self) -> impl Iterator<Item = &Facet> + Clone {
        self.facets.iter().filter(|facet| facet.outside.is_none())
    }

    /// Faces between two regions, oriented out of the first, in the order of [`Topology::facets`].
    pub fn interface(&self, of: RegionId, towards: RegionId) -> Vec<[NodeId; 3]> {
        let region_at = |e: ElementId| self.region_of[e.index()];
        let oriented = |f: &Facet| {
            let [a, b, c] = f.nodes;
            match (region_at(f.inside), region_at(f.outside?)) {
                pair if pair == (of, towards) => Some([a, b, c]),
                pair if pair == (towards, of) => Some([a, c, b]),
                _ => None,
            }
        };
        self.facets.iter().filter_map(oriented).collect()
    }

    /// Faces of a region at the outside of the mesh, oriented outwards.
    pub fn outer_faces(&self, of: RegionId) -> Vec<[NodeId; 3]> {
        self.outer_facets().filter(|f| self.region_of[f.inside.index()] == of).map(|f| f.nodes).collect()
    }

    /// All faces of a region, oriented outwards, in the order of [`Topology::facets`].
    pub fn boundary(&self, of: RegionId) -> Vec<[NodeId; 3]> {
        let is_own = |e: ElementId| self.region_of[e.index()] == of;
        let oriented = |f: &Facet| {
            let [a, b, c] = f.nodes;
            match (is_own(f.inside), f.outside.is_some_and(is_own)) {
                (true, false) => Some([a, b, c]),
                (false, true) => Some([a, c, b]),
                _ => None,
            }
        };
        self.facets.iter().filter_map(oriented).collect()
    }

    /// The faces that a name `"a|b"` stands for: between the regions `a` and `b`, oriented out of `a`.
    ///
    /// `"a|outside"` are the faces of `a` at the outside of the mesh, unless a region has that name.
    ///
    /// # Errors
    /// [`MeshError::UnknownRegion`] for a side that is no region, [`MeshError::NoInterface`] for regions that do not
    /// touch, [`MeshError::UnknownSurface`] for a name without bar.
    pub fn faces_between(&self, name: &str) -> Result<Vec<[NodeId; 3]>, MeshError> {
        // A region's own name may hold a bar: the first bar with a region on both sides is the one.
        let side = |name: &str| match self.region(name) {
            Err(_) if name == OUTSIDE => Ok(None),
            other => other.map(Some),
        };
        let splits = || name.match_indices('|').map(|(at, _)| (name[..at].trim(), name[at + 1..].trim()));
        let known = splits().find(|(of, towards)| self.region(of).is_ok() && side(towards).is_ok());
        let Some((of, towards)) = known.or_else(|| splits().next()) else {
            return self.surface(name).map(<[_]>::to_vec);
        };
        let of = self.region(of)?;
        let faces = match side(towards)? {
            Some(towards) => self.interface(of, towards),
            None => self.outer_faces(of),
        };
        if faces.is_empty() { Err(MeshError::NoInterface { name: name.to_owned() }) } else { Ok(faces) }
    }

    /// The same mesh without one region: its elements and the nodes that only it used are gone.
    ///
    /// Surfaces keep the triangles that are faces of a remaining element.
    ///
    /// # Errors
    /// [`MeshError::OverfullFace`] cannot occur on a valid topology; it is passed through.
    pub fn without_region(&self, region: RegionId) -> Result<Remainder, MeshError> {
        let keep: Vec<ElementId> = self.elements().filter(|e| self.region_of[e.index()] != region).collect();
        let (new_of, old_of) = self.renumber_nodes_of(&keep);
        let mut new_element: Vec<Option<ElementId>> = vec![None; self.tets.len()];
        for (i, e) in keep.iter().enumerate() {
            new_element[e.index()] = Some(ElementId::new(i));
        }
        let renumber = |nodes: &[NodeId; 3]| -> Option<[NodeId; 3]> {
            Some([new_of[nodes[0].index()]?, new_of[nodes[1].index()]?, new_of[nodes[2].index()]?])
        };
        let tets = keep
            .iter()
            .map(|&e| self.tet(e).map(|n| new_of[n.index()].expect("nodes of kept elements are kept")))
            .collect();
        let regions = keep.iter().map(|e| self.region_of[e.index()]).collect();
        let mut topology = Self::new(old_of.len(), tets, self.region_names.clone(), regions)?;
        topology.surfaces = self
            .surfaces
            .iter()
            .map(|(name, triangles)| {
                let left = triangles.iter().filter_map(renumber).filter(|face| topology.has_face(*face));
                (name.clone(), left.collect())
            })
            .collect();
        topology.cells = self
            .cells
            .iter()
            .map(|(name, cells)| {
                let cells = cells
                    .iter()
                    .map(|cell| cell.iter().filter_map(|e| new_element[e.index()]).collect::<Vec<_>>())
                    .filter(|cell| !cell.is_empty())
                    .collect();
                (name.clone(), cells)
            })
            .collect();
        let region_at = |e: ElementId| self.region_of[e.index()];
        let exposed = self
            .facets
            .iter()
            .filter_map(|f| {
                let outside = f.outside?;
                let [a, b, c] = f.nodes;
                match (region_at(f.inside) == region, region_at(outside) == region) {
                    (false, true) => renumber(&[a, b, c]),
                    (true, false) => renumber(&[a, c, b]),
                    _ => None,
                }
            })
            .collect();
        Ok(Remainder { topology, old_of, exposed })
    }

    /// The nodes of some elements numbered anew, in their order: the new number of every old one, and the reverse.
    fn renumber_nodes_of(&self, elements: &[ElementId]) -> (Vec<Option<NodeId>>, Vec<NodeId>) {
        let mut new_of: Vec<Option<NodeId>> = vec![None; self.node_count];
        for &e in elements {
            for n in self.tet(e) {
                new_of[n.index()] = Some(NodeId(0));
            }
        }
        let mut old_of = Vec::new();
        for node in self.nodes() {
            if new_of[node.index()].is_some() {
                new_of[node.index()] = Some(NodeId::new(old_of.len()));
                old_of.push(node);
            }
        }
        (new_of, old_of)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn n(i: u32) -> NodeId {
        NodeId(i)
    }

    /// Two tets that share the face (1, 2, 3), in two regions.
    fn pair() -> Topology {
        Topology::new(
            5,
            vec![[n(0), n(1), n(2), n(3)], [n(4), n(1), n(3), n(2)]],
            vec!["left".into(), "right".into()],
            vec![RegionId(0), RegionId(1)],
        )
        .expect("two tets make a mesh")
    }

    #[test]
    fn facets_are_the_interface_and_the_outside() {
        let topology = pair();
        let interface: Vec<_> = topology.facets().iter().filter(|f| f.outside.is_some()).collect();
        assert_eq!(interface.len(), 1);
        assert_eq!(interface[0].nodes, [n(1), n(2), n(3)]);
        assert_eq!(topology.facets().len(), 7);
    }

    #[test]
    fn an_interface_points_out_of_its_first_region() {
        let topology = pair();
        assert_eq!(topology.interface(RegionId(0), RegionId(1)), [[n(1), n(2), n(3)]]);
        assert_eq!(topology.interface(RegionId(1), RegionId(0)), [[n(1), n(3), n(2)]]);
        assert!(topology.interface(RegionId(0), RegionId(0)).is_empty());
        assert_eq!(topology.outer_faces(RegionId(0)).len(), 3);
        assert_eq!(topology.faces_between("right|left").expect("they touch"), [[n(1), n(3), n(2)]]);
        assert_eq!(topology.faces_between("left | outside").expect("it is outside").len(), 3);
    }

    #[test]
    fn an_interface_that_is_not_there_says_which_side_is_wrong() {
        let topology = pair();
        let message = |name| topology.faces_between(name).expect_err("there is none").to_string();
        assert_eq!(message("left|rihgt"), "there is no region `rihgt`; the mesh has: left, right");
        assert_eq!(message("outside|left"), "there is no region `outside`; the mesh has: left, right");
        assert_eq!(message("left|left"), "the regions of `left|left` have no face in common");
        assert_eq!(message("top"), "there is no surface `top`; the mesh has: ");
    }

    #[test]
    fn removing_a_region_exposes_its_faces_and_drops_its_nodes() {
        let left = pair().without_region(RegionId(1)).expect("a region may go");
        assert_eq!((left.topology.node_count(), left.topology.tets().len()), (4, 1));
        assert_eq!(left.old_of, [n(0), n(1), n(2), n(3)]);
        assert_eq!(left.exposed, [[n(1), n(2), n(3)]]);
        let right = pair().without_region(RegionId(0)).expect("a region may go");
        assert_eq!(right.exposed, [[n(0), n(2), n(1)]], "oriented out of the element that stays");
    }

    #[test]
    fn a_surface_loses_the_faces_of_a_removed_region_although_their_nodes_stay() {
        // On the nodes 1, 2, 3 and 0 stands a tet of another region too; its face (0, 1, 4) lies between kept nodes.
        let tets = vec![[n(0), n(1), n(2), n(3)], [n(4), n(1), n(3), n(2)], [n(0), n(1), n(3), n(4)]];
        let regions = vec![RegionId(0), RegionId(0), RegionId(1)];
        let topology = Topology::new(5, tets, vec!["a".into(), "b".into()], regions).expect("a mesh");
        let topology =
            topology.with_surface("s", vec![[n(0), n(1), n(4)], [n(0), n(1), n(2)]]).expect("nodes");
        let left = topology.without_region(RegionId(1)).expect("a region may go").topology;
        assert_eq!(left.surface("s").expect("named"), [[n(0), n(1), n(2)]]);
        assert!(!left.has_face([n(0), n(0), n(1)]) && left.has_face([n(2), n(1), n(0)]));
    }

    #[test]
    fn a_face_of_three_tets_and_a_dangling_node_are_refused() {
        let tets = vec![[n(0), n(1), n(2), n(3)], [n(4), n(1), n(3), n(2)], [n(5), n(1), n(2), n(3)]];
        let regions = vec![RegionId(0); 3];
        let err = Topology::new(6, tets.clone(), vec!["a".into()], regions.clone()).unwrap_err();
        assert!(matches!(err, MeshError::OverfullFace { .. }));
        let err = Topology::new(5, tets, vec!["a".into()], regions).unwrap_err();
        assert!(matches!(err, MeshError::DanglingNode { node: NodeId(5), .. }));
    }

    #[test]
    fn names_that_do_not_exist_list_those_that_do() {
        let err = pair().region("lefd").unwrap_err();
        assert_eq!(err.to_string(), "there is no region `lefd`; the mesh has: left, right");
    }
}
