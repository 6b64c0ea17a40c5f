//! Mirror images of elements beyond the symmetry planes of a model, by which a patch goes on there as in the whole device.
//!
//! The field of an image is that of `plane`; the potential has the other sign. Planes at right angles to each other are taken, with
//! the images of images. A patch ends at all other outer faces, and at a plane in which a part of them lies or which elements lie behind.

use std::collections::BTreeSet;

use fluxmorph_geometry::tet4::{Point, norm, sub};
use fluxmorph_geometry::topology::face_key;
use fluxmorph_geometry::{ElementId, Facet, Mesh, MeshError, NodeId, Topology};

use super::plane::{Condition, Plane, ROUNDING, conditions};
use super::symmetry::SymmetryPlanes;
use crate::boundary::Boundary;
use crate::model::FieldModel;

/// Layers of elements around the start of a patch after which no fit is tried.
const LAYERS_LIMIT: usize = 3;

/// The outer faces of a model with what makes an image there, by node.
#[derive(Clone, Debug, Default)]
pub(crate) struct Walls {
    /// Ascending by node.
    faces: Vec<(NodeId, [NodeId; 3], Condition)>,
    symmetry: SymmetryPlanes,
}

/// Which planes an image is beyond, a bit each; the element itself where it is zero.
pub(super) type Image = u8;

/// The symmetry planes around some element, at right angles to each other.
#[derive(Clone, Debug)]
pub(super) struct Mirrors {
    planes: Vec<Plane>,
    /// Planes through which there is no image.
    refused: Vec<Plane>,
    /// `B_r` [T] of the element: the image of a magnet that would be another one is none.
    remanence: Point,
}

impl Walls {
    /// Of the conditions of a model, whose `replaced` faces are those of conductors that are not meshed. On the `gradients`, faces of
    /// walls beside re-entrant edges, nodal `A_t` is `−∇ψ` and not zero.
    ///
    /// # Errors
    /// [`MeshError::UnknownSurface`].
    pub(crate) fn new(
        mesh: &Mesh,
        boundaries: &[(String, Boundary)],
        replaced: impl Iterator<Item = [NodeId; 3]>,
        gradients: &[[NodeId; 3]],
    ) -> Result<Self, MeshError> {
        let topology = mesh.topology();
        let mut conditions = conditions(topology, boundaries)?;
        replaced.for_each(|face| {
            conditions.entry(face_key(face)).or_insert(Condition::Other);
        });
        let symmetry = SymmetryPlanes::new(mesh, boundaries, &conditions)?;
        conditions.extend(gradients.iter().map(|face| (face_key(*face), Condition::Other)));
        let of_face = |facet: &Facet| {
            let condition = conditions.get(&face_key(facet.nodes)).copied().unwrap_or(Condition::Other);
            facet.nodes.map(|node| (node, facet.nodes, condition))
        };
        let mut faces: Vec<_> = topology.outer_facets().flat_map(of_face).collect();
        faces.sort_unstable();
        Ok(Self { faces, symmetry })
    }

    pub(crate) fn symmetry_planes(&self) -> &SymmetryPlanes {
        &self.symmetry
    }

    /// The planes with a condition in which outer faces at some nodes lie, at right angles to each other.
    pub(crate) fn planes_at(&self, mesh: &Mesh, nodes: &[NodeId]) -> Vec<Plane> {
        let nodes: BTreeSet<NodeId> = nodes.iter().copied().collect();
        let mut planes: Vec<Plane> = Vec::new();
        for (_, face, condition) in self.faces.iter().filter(|(node, ..)| nodes.contains(node)) {
            let plane = Plane::of(mesh, *face, *condition);
            if plane.condition != Condition::Other && planes.iter().all(|known| known.is_square_to(&plane)) {
                planes.push(plane);
            }
        }
        planes
    }

    /// The planes of the outer faces at a node that are at right angles to each other; one with a part of another condition, or with
    /// an element at the node behind it, as one of another condition.
    fn at(&self, topology: &Topology, mesh: &Mesh, node: NodeId) -> Vec<Plane> {
        let first = self.faces.partition_point(|(of, ..)| *of < node);
        let at_node = self.faces[first..].iter().take_while(|(of, ..)| *of == node);
        let mut planes: Vec<Plane> = Vec::new();
        for &(_, face, condition) in at_node {
            let plane = Plane { place: mesh.point(node), ..Plane::of(mesh, face, condition) };
            if let Some(known) = planes.iter_mut().find(|known| known.is_parallel(&plane)) {
                known.condition = if known.condition == condition { condition } else { Condition::Other };
            } else if planes.iter().all(|known| known.is_square_to(&plane)) {
                planes.push(plane);
            }
        }
        for plane in &mut planes {
            if plane.is_crossed(topology.elements_around(node).iter().flat_map(|&e| mesh.vertices(e))) {
                plane.condition = Condition::Other;
            }
        }
        planes
    }
}

impl Mirrors {
    /// Around an element, of which none is known yet.
    pub(super) fn new(model: &FieldModel, e: ElementId) -> Self {
        Self { planes: Vec::new(), refused: Vec::new(), remanence: model.remanence_of(e) }
    }

    /// The planes that a node lies in; those at right angles to what is known become known.
    fn of(&mut self, (model, mesh): (&FieldModel, &Mesh), node: NodeId) -> Image {
        let mut image = 0;
        for plane in model.walls().at(model.topology(), mesh, node) {
            let change = norm(sub(plane.turn(self.remanence), self.remanence));
            if plane.condition == Condition::Other || change > ROUNDING * norm(self.remanence) {
                self.refuse(plane);
                continue;
            }
            let known = self.planes.iter().position(|known| known.lies_in(&plane));
            if let Some(k) = known.filter(|&k| self.planes[k].condition == plane.condition) {
                image |= 1 << k;
            } else if known.is_some() {
                self.refuse(plane);
            } else if !self.refused.iter().any(|refused| refused.lies_in(&plane))
                && self.planes.iter().all(|known| known.is_square_to(&plane))
            {
                image |= 1 << self.planes.len();
                let plane = plane.squared_to(&self.planes);
                self.planes.push(plane);
            }
        }
        image
    }

    fn refuse(&mut self, plane: Plane) {
        if !self.refused.iter().any(|refused| refused.lies_in(&plane)) {
            self.refused.push(plane);
        }
    }

    /// What can be fitted to the smallest patch that determines it: that at the start, or with layers of elements around it; `None`
    /// after [`LAYERS_LIMIT`]. Planes that are given up on the way leave it to start anew, without their images.
    pub(super) fn fit<T>(
        &mut self,
        (model, mesh): (&FieldModel, &Mesh),
        counts: &impl Fn(ElementId) -> bool,
        start: impl Fn(&mut Self) -> BTreeSet<(Image, ElementId)>,
        fitted: impl Fn(&BTreeSet<(Image, ElementId)>, &Self) -> Option<T>,
    ) -> Option<T> {
        let (mut members, mut layers) = (start(self), 1);
        loop {
            if self.give_up_crossed(mesh, &members) {
                (members, layers) = (start(self), 1);
                continue;
            }
            let found = fitted(&members, self);
            if found.is_some() || layers == LAYERS_LIMIT {
                return found;
            }
            members = self.around((model, mesh), &members, counts);
            layers += 1;
        }
    }

    /// Some elements, each itself or an image, with all those that share a vertex with one of them and count.
    pub(super) fn around(
        &mut self,
        (model, mesh): (&FieldModel, &Mesh),
        members: &BTreeSet<(Image, ElementId)>,
        counts: &impl Fn(ElementId) -> bool,
    ) -> BTreeSet<(Image, ElementId)> {
        let mut all = BTreeSet::new();
        for &(image, e) in members {
            for node in model.topology().tet(e) {
                let at_node = self.around_node((model, mesh), node, counts);
                all.extend(at_node.into_iter().map(|(beyond, e)| (image ^ beyond, e)));
            }
        }
        all
    }

    /// The elements at a node that count, with their images.
    pub(super) fn around_node(
        &mut self,
        (model, mesh): (&FieldModel, &Mesh),
        node: NodeId,
        counts: &impl Fn(ElementId) -> bool,
    ) -> BTreeSet<(Image, ElementId)> {
        let planes = self.of((model, mesh), node);
        let images =
            move |e| (0..=planes).filter(move |image| image & !planes == 0).map(move |image| (image, e));
        let elements = model.topology().elements_around(node).iter().copied().filter(|&e| counts(e));
        elements.flat_map(images).collect()
    }

    /// Gives up the planes that some elements are on both sides of, as beside an edge at which the domain is re-entrant, and those in
    /// which a node has faces of another condition. Whether there was one.
    fn give_up_crossed(&mut self, mesh: &Mesh, members: &BTreeSet<(Image, ElementId)>) -> bool {
        let is_given_up = |plane: &Plane| {
            let own = members.iter().filter(|(image, _)| *image == 0);
            self.refused.iter().any(|refused| refused.lies_in(plane))
                || plane.is_crossed(own.flat_map(|(_, e)| mesh.vertices(*e)))
        };
        let (given_up, kept): (Vec<Plane>, Vec<Plane>) =
            self.planes.iter().partition(|plane| is_given_up(plane));
        let any = !given_up.is_empty();
        self.refused.extend(given_up);
        self.planes = kept;
        any
    }

    fn through(&self, image: Image) -> impl Iterator<Item = &Plane> {
        self.planes.iter().enumerate().filter(move |(k, _)| image >> k & 1 == 1).map(|(_, plane)| plane)
    }

    /// The image of a place.
    pub(super) fn place(&self, image: Image, x: Point) -> Point {
        self.through(image).fold(x, |x, plane| plane.image(x))
    }

    /// The image of a direction.
    pub(super) fn direction(&self, image: Image, v: Point) -> Point {
        self.through(image).fold(v, |v, plane| plane.reflect(v))
    }

    /// The field at the image of where it is `b`, as a matrix, symmetric.
    pub(super) fn turn(&self, image: Image) -> [Point; 3] {
        let column = |axis: usize| {
            let unit = std::array::from_fn(|d| f64::from(u8::from(d == axis)));
            self.through(image).fold(unit, |b, plane| plane.turn(b))
        };
        [column(0), column(1), column(2)]
    }

    /// The image without the planes in which a place lies, as seen from another one: there it is its own image.
    pub(super) fn distinct(&self, image: Image, x: Point, reach: f64) -> Image {
        let planes = self.planes.iter().enumerate();
        let holding = planes.filter(|(_, plane)| plane.height(x).abs() <= ROUNDING * reach);
        holding.fold(image, |image, (k, _)| image & !(1 << k))
    }
}
