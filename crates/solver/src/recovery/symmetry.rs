//! The symmetry planes of a model, and what a mean over a region and its images beyond them has nothing of.
//!
//! A symmetry plane is a flat part of a surface with a condition of its own, which the whole mesh lies on one side of and no outer face
//! of another condition lies in. One of natural faces alone is none, though flux crosses them at right angles. A far wall that a region
//! reaches counts as one: the field there is that of a device with images beyond it.

use std::cell::OnceCell;
use std::collections::{BTreeSet, HashMap, HashSet};

use fluxmorph_geometry::curved::SMOOTH;
use fluxmorph_geometry::directions::{extend, tangents, unit};
use fluxmorph_geometry::tet4::{FACES, Point, area_vector, dot};
use fluxmorph_geometry::topology::{around_edges, face_key, triangle_edges};
use fluxmorph_geometry::{ElementId, Mesh, MeshError, NodeId, Topology};

use super::plane::{Condition, Plane, ROUNDING};
use crate::boundary::Boundary;

/// Planes of one named surface, at most: a surface of more of them is curved.
const MOST_PLANES: usize = 6;

/// Sine of the angle to a plane from which a direction is another one. Planes of symmetry meet at whole parts of half a turn, and those
/// of a mesh in coordinates of six digits, or of facets, at far less.
const INDEPENDENT: f64 = 0.05;

/// The symmetry planes with their faces, on the mesh at the start.
#[derive(Clone, Debug, Default)]
pub(crate) struct SymmetryPlanes {
    planes: Vec<Plane>,
    /// The plane of every face that lies in one.
    faces: HashMap<[NodeId; 3], usize>,
}

impl SymmetryPlanes {
    /// Of the conditions of a model, by surface and by the key of a face.
    ///
    /// # Errors
    /// [`MeshError::UnknownSurface`].
    pub(super) fn new(
        mesh: &Mesh,
        boundaries: &[(String, Boundary)],
        conditions: &HashMap<[NodeId; 3], Condition>,
    ) -> Result<Self, MeshError> {
        let mut all = Self::default();
        let round = OnceCell::new();
        for (name, _) in boundaries {
            all.add(mesh, mesh.topology().surface(name)?, conditions, &round);
        }
        Ok(all)
    }

    /// Adds the planes of a surface, of one that is curved those beside the `round` faces, which are found once.
    fn add(
        &mut self,
        mesh: &Mesh,
        surface: &[[NodeId; 3]],
        conditions: &HashMap<[NodeId; 3], Condition>,
        round: &OnceCell<HashSet<[NodeId; 3]>>,
    ) {
        let keys: Vec<[NodeId; 3]> = surface.iter().map(|face| face_key(*face)).collect();
        let flat = flat_parts(mesh, keys.iter().copied(), conditions);
        let beside_round = || {
            let round = round.get_or_init(|| round_faces(mesh));
            flat_parts(mesh, keys.iter().copied().filter(|face| !round.contains(face)), conditions)
        };
        let Some((planes, of_faces)) = flat.or_else(beside_round) else { return };
        let is_symmetry: Vec<bool> = planes.iter().map(|plane| plane.is_symmetry(mesh, conditions)).collect();
        let kept = of_faces.into_iter().filter(|(_, k)| is_symmetry[*k]);
        self.faces.extend(kept.map(|(face, k)| (face, self.planes.len() + k)));
        self.planes.extend(planes);
    }

    /// Orthonormal directions in which a mean of `B` over some elements and their images has nothing: across flux-parallel planes in
    /// which faces of theirs lie, and along flux-normal ones; all three where the mean of the whole device is zero.
    pub(crate) fn odd_directions(
        &self,
        topology: &Topology,
        elements: impl Iterator<Item = ElementId>,
    ) -> Vec<Point> {
        let faces = elements.flat_map(|e| {
            let nodes = topology.tet(e);
            FACES.map(|face| face_key(face.map(|a| nodes[a])))
        });
        let held: BTreeSet<usize> = faces.filter_map(|face| self.faces.get(&face).copied()).collect();
        let mut odd = Vec::new();
        for plane in held.into_iter().map(|k| &self.planes[k]) {
            let (first, second) = tangents(plane.normal);
            let directions = match plane.condition {
                Condition::FluxParallel => vec![plane.normal],
                Condition::FluxNormal => vec![first, second],
                Condition::Other => Vec::new(),
            };
            directions.into_iter().for_each(|direction| extend(&mut odd, direction, INDEPENDENT));
        }
        odd
    }
}

/// The outer faces that go on in another plane without a sharp edge, with all that lie in one plane with such a face and are joined
/// to it; by their keys.
fn round_faces(mesh: &Mesh) -> HashSet<[NodeId; 3]> {
    let outer: Vec<[NodeId; 3]> = mesh.topology().outer_facets().map(|facet| facet.nodes).collect();
    let normal = |face: &[NodeId; 3]| unit(area_vector(face.map(|node| mesh.point(node))));
    let normals: Vec<Point> = outer.iter().map(normal).collect();
    let at_edges = around_edges(&outer);
    let beside = |k: usize| {
        let faces = triangle_edges(outer[k]).map(|edge| &at_edges[&edge]);
        faces.into_iter().flatten().copied().filter(move |other| *other != k)
    };
    let cosine = |k: usize, other: usize| dot(normals[k], normals[other]);
    let flat = 1.0 - 0.5 * ROUNDING * ROUNDING;
    let is_round = |k: &usize| beside(*k).any(|other| (SMOOTH..flat).contains(&cosine(*k, other)));
    let mut open: Vec<usize> = (0..outer.len()).filter(is_round).collect();
    let mut round: HashSet<usize> = open.iter().copied().collect();
    while let Some(k) = open.pop() {
        open.extend(beside(k).filter(|other| cosine(k, *other) >= flat && round.insert(*other)));
    }
    round.into_iter().map(|k| face_key(outer[k])).collect()
}

/// A surface's planes, and its faces with the number of the plane of each.
type FlatParts = (Vec<Plane>, Vec<([NodeId; 3], usize)>);

/// The planes of faces; `None` of more than a few, which are those of a curved surface.
fn flat_parts(
    mesh: &Mesh,
    faces: impl Iterator<Item = [NodeId; 3]>,
    conditions: &HashMap<[NodeId; 3], Condition>,
) -> Option<FlatParts> {
    let mut planes: Vec<Plane> = Vec::new();
    let mut of_faces = Vec::new();
    for face in faces {
        let plane = Plane::of(mesh, face, conditions[&face_key(face)]);
        let known = planes.iter().position(|known| known.lies_in(&plane));
        let number = known.unwrap_or_else(|| {
            planes.push(plane);
            planes.len() - 1
        });
        if planes.len() > MOST_PLANES {
            return None;
        }
        of_faces.push((face, number));
    }
    Some((planes, of_faces))
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use fluxmorph_geometry::RegionId;
    use fluxmorph_geometry::generate::Grid;

    use super::super::plane::conditions;
    use super::*;
    use crate::boundary::UniformField;

    const PARALLEL: Boundary = Boundary::FluxParallel;
    const NORMAL: Boundary = Boundary::FluxNormal;

    /// Of the cell at the origin of a grid of 27 under conditions on its sides.
    fn odd(boundaries: &[(&str, Boundary)]) -> Vec<Point> {
        let grid = Grid::new("grid", [(); 3].map(|()| vec![0.0, 1.0, 2.0, 3.0])).expect("ascending lines");
        let corner = |x: Point| RegionId(u32::from(x.iter().all(|c| *c < 1.0)));
        let mesh = grid.mesh(&["rest", "corner"], corner).expect("a grid conforms");
        let cell = mesh.topology().elements_of(RegionId(1));
        let boundaries: Vec<(String, Boundary)> =
            boundaries.iter().map(|(name, boundary)| ((*name).to_owned(), *boundary)).collect();
        let conditions = conditions(mesh.topology(), &boundaries).expect("sides of the grid");
        let planes = SymmetryPlanes::new(&mesh, &boundaries, &conditions).expect("sides of the grid");
        planes.odd_directions(mesh.topology(), cell.into_iter())
    }

    /// A quarter of a cylinder whose faces are one surface, oriented at random, as files may have them.
    #[test]
    fn planes_are_found_in_a_surface_that_is_round_elsewhere() {
        let line = || (0..=4).map(f64::from).collect::<Vec<_>>();
        let grid = Grid::new("grid", [line(), line(), line()]).expect("ascending lines");
        let corner = |x: Point| RegionId(u32::from(x.iter().all(|c| *c < 1.0)));
        let topology = grid.topology(&["rest", "corner"], corner).expect("a grid conforms");
        let round = |[x, y, z]: Point| {
            let by = if x.max(y) > 0.0 { x.max(y) / x.hypot(y) } else { 1.0 };
            [by * x, by * y, z]
        };
        let points = grid.points().into_iter().map(round).collect();
        let mesh = Mesh::new(Arc::new(topology), points).expect("cells have a volume");
        let mut surface: Vec<[NodeId; 3]> = mesh.topology().outer_facets().map(|facet| facet.nodes).collect();
        surface.iter_mut().step_by(3).for_each(|face| face.swap(1, 2));
        let conditions = surface.iter().map(|face| (face_key(*face), Condition::FluxParallel)).collect();
        let mut planes = SymmetryPlanes::default();
        planes.add(&mesh, &surface, &conditions, &OnceCell::new());
        let reached = |region| {
            let elements = mesh.topology().elements_of(RegionId(region));
            planes.odd_directions(mesh.topology(), elements.into_iter()).len()
        };
        // The planes x, y and z = 0; of all the mesh also the opposite end, and no round face.
        assert_eq!([reached(1), reached(0)], [3, 3]);
        assert_eq!(planes.faces.len(), 4 * 2 * 4 * 4, "{:?}", planes.planes);
    }

    #[test]
    fn the_mean_of_a_corner_has_what_its_images_leave() {
        let [x, y, z] = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
        let along = |found: &[Point], axis: Point| {
            found
                .iter()
                .any(|direction| (0..3).map(|d| direction[d] * axis[d]).sum::<f64>().abs() > 1.0 - 1e-12)
        };
        let found = odd(&[("x_min", PARALLEL), ("x_max", PARALLEL), ("y_max", PARALLEL)]);
        assert!(found.len() == 1 && along(&found, x), "the corner reaches one of them: {found:?}");
        let found = odd(&[("z_min", NORMAL)]);
        assert!(found.len() == 2 && along(&found, x) && along(&found, y), "{found:?}");
        let found = odd(&[("x_min", PARALLEL), ("z_min", NORMAL)]);
        assert!(found.len() == 2 && !along(&found, z), "{found:?}");
        let field = UniformField { flux_density: z, centre: None };
        assert!(odd(&[("x_min", Boundary::UniformField(field))]).is_empty());
        let all = [("x_min", PARALLEL), ("y_min", PARALLEL), ("z_min", PARALLEL)];
        assert_eq!(odd(&all).len(), 3, "the whole has no mean");
    }
}
