//! A shell of tetrahedra put around a mesh: scaled copies of its outer faces, joined by layers of prisms.
//!
//! The layers lie between the outer faces and their image twice as far from a centre, whatever shape they have, as long as the
//! centre sees each face from inside: ball, box, cylinder. Symmetry planes through the centre cut the shell too, and their
//! surfaces grow with it. What the shell means (all of space outside) is the field problem's business.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

use crate::error::MeshError;
use crate::ids::{NodeId, RegionId};
use crate::mesh::Mesh;
use crate::millimetres::millimetres;
use crate::tet4::{Point, centroid, cross, dot, norm, sub, volume};
use crate::topology::{Facet, Topology, face_key};

/// How far out the shell's outer side is: twice the place of the faces it stands on.
const REACH: f64 = 2.0;

/// Sine of the angle below which a plane is taken to pass through the centre.
const IN_PLANE: f64 = 1e-6;

/// A shell around a mesh.
#[derive(Clone, Debug)]
pub struct OpenShellParameters {
    /// Surfaces of the outer faces on which it stands.
    pub surfaces: Vec<String>,
    /// The centre [m].
    pub centre: Point,
    /// Layers of prisms, at least one.
    pub layers: usize,
    /// Name of its region.
    pub region: String,
    /// Name of its outer surface.
    pub outer: String,
}

/// The mesh with a shell around it; nodes and elements keep their numbers, those of the shell follow.
///
/// # Errors
/// [`MeshError::UnknownSurface`]; [`MeshError::Parameter`] for faces that do not lie outside or are not seen from inside,
/// for a face beside the shell whose plane misses the centre, and for a name that is taken.
pub fn open_shell(mesh: &Mesh, parameters: &OpenShellParameters) -> Result<Mesh, MeshError> {
    let topology = mesh.topology();
    if parameters.layers == 0 {
        return Err(MeshError::parameter("open.layers", 0, "at least one layer"));
    }
    let is_taken = topology.region_names().contains(&parameters.region)
        || topology.surface_names().any(|name| name == parameters.outer);
    if is_taken {
        let taken = format!("`{}` and `{}`", parameters.region, parameters.outer);
        let expected = "a mesh without these names, which are those of the shell; one that has its shell already names it as the \
                        region of open space";
        return Err(MeshError::parameter("open", taken, expected));
    }
    let faces = covered_faces(mesh, parameters)?;
    let layers = Layers::new(mesh, &faces, parameters);
    let (points, tets) = (layers.points(mesh, parameters.centre), layers.tets(&faces));
    let tets: Vec<[NodeId; 4]> = topology
        .tets()
        .iter()
        .copied()
        .chain(tets.into_iter().map(|[a, b, c, d]| {
            let is_right_handed = volume([a, b, c, d].map(|n| points[n.index()])) > 0.0;
            if is_right_handed { [a, b, c, d] } else { [a, c, b, d] }
        }))
        .collect();
    let mut names = topology.region_names().to_vec();
    names.push(parameters.region.clone());
    let mut regions = topology.region_of().to_vec();
    regions.resize(tets.len(), RegionId::new(names.len() - 1));
    let mut grown = Topology::new(points.len(), tets, names, regions)?;
    let mut sides = sides(mesh, parameters.centre, &faces)?;
    for name in topology.surface_names() {
        let mut triangles = topology.surface(name)?.to_vec();
        triangles.extend(layers.side(&sides.remove(name).unwrap_or_default()));
        grown = grown.with_surface(name, triangles)?;
    }
    for name in topology.region_names() {
        if let Some(cells) = topology.given_cells(name) {
            grown = grown.with_cells(name, cells.to_vec());
        }
    }
    let outer = faces.values().map(|facet| facet.nodes.map(|n| layers.node(n, layers.count))).collect();
    Mesh::new(Arc::new(grown.with_surface(&parameters.outer, outer)?), points)
}

/// The outer faces on which the shell stands, by their key.
fn covered_faces(
    mesh: &Mesh,
    parameters: &OpenShellParameters,
) -> Result<BTreeMap<[NodeId; 3], Facet>, MeshError> {
    let topology = mesh.topology();
    let outer: BTreeMap<[NodeId; 3], Facet> =
        topology.outer_facets().map(|f| (face_key(f.nodes), *f)).collect();
    let mut faces = BTreeMap::new();
    for name in &parameters.surfaces {
        for &triangle in topology.surface(name)? {
            let key = face_key(triangle);
            let Some(facet) = outer.get(&key) else {
                let expected = "surfaces at the outside of the mesh";
                return Err(MeshError::parameter("open.surfaces", name, expected));
            };
            let vertices = facet.nodes.map(|n| sub(mesh.point(n), parameters.centre));
            if dot(normal(&vertices), vertices[0]) <= IN_PLANE * norm(normal(&vertices)) * norm(vertices[0]) {
                let at = millimetres(centroid(facet.nodes.map(|n| mesh.point(n))));
                let expected = format!(
                    "a centre that sees every face from inside; that at {at} is not, or its plane holds the centre"
                );
                return Err(MeshError::parameter("open.surfaces", name, expected));
            }
            faces.insert(key, *facet);
        }
    }
    if faces.is_empty() {
        let expected = "the outer surfaces beyond which space is open";
        return Err(MeshError::parameter("open.surfaces", "[]", expected));
    }
    Ok(faces)
}

/// A normal of a triangle, of twice its area.
fn normal(vertices: &[Point; 3]) -> Point {
    let [a, b, c] = *vertices;
    cross(sub(b, a), sub(c, a))
}

/// Edges of a triangle, each ascending.
fn edges(nodes: [NodeId; 3]) -> [[NodeId; 2]; 3] {
    let [a, b, c] = face_key(nodes);
    [[a, b], [a, c], [b, c]]
}

/// The edges at which the covered faces end, by the names of the surfaces beside them that grow with the shell.
fn sides(
    mesh: &Mesh,
    centre: Point,
    faces: &BTreeMap<[NodeId; 3], Facet>,
) -> Result<BTreeMap<String, Vec<[NodeId; 2]>>, MeshError> {
    let topology = mesh.topology();
    let mut ends = BTreeSet::new();
    for edge in faces.keys().flat_map(|&key| edges(key)) {
        // An edge inside the covered faces comes twice.
        if !ends.remove(&edge) {
            ends.insert(edge);
        }
    }
    let beside = topology.outer_facets().filter(|f| !faces.contains_key(&face_key(f.nodes)));
    let mut edges_of: BTreeMap<[NodeId; 3], Vec<[NodeId; 2]>> = BTreeMap::new();
    for facet in beside {
        for edge in edges(facet.nodes).into_iter().filter(|edge| ends.contains(edge)) {
            let vertices = facet.nodes.map(|n| sub(mesh.point(n), centre));
            let n = normal(&vertices);
            if vertices.iter().any(|&v| dot(n, v).abs() > IN_PLANE * norm(n) * norm(v)) {
                let at = millimetres(mesh.point(edge[0]));
                let expected = format!(
                    "all outer faces but symmetry planes through the centre; the face beside the shell at {at} is neither: \
                     open space begins there too, or the centre belongs into its plane"
                );
                return Err(MeshError::parameter("open.surfaces", "a part of the outside", expected));
            }
            edges_of.entry(face_key(facet.nodes)).or_default().push(edge);
        }
    }
    let mut sides: BTreeMap<String, Vec<[NodeId; 2]>> = BTreeMap::new();
    for name in topology.surface_names() {
        for triangle in topology.surface(name)? {
            let edges = edges_of.get(&face_key(*triangle)).into_iter().flatten();
            sides.entry(name.to_owned()).or_default().extend(edges);
        }
    }
    Ok(sides)
}

/// The nodes of the layers.
struct Layers {
    /// Nodes of the covered faces, with their place among these.
    base: BTreeMap<NodeId, usize>,
    /// Nodes of the mesh inside.
    inside: usize,
    count: usize,
}

impl Layers {
    fn new(mesh: &Mesh, faces: &BTreeMap<[NodeId; 3], Facet>, parameters: &OpenShellParameters) -> Self {
        let nodes: BTreeSet<NodeId> = faces.keys().flatten().copied().collect();
        let base = nodes.into_iter().enumerate().map(|(place, node)| (node, place)).collect();
        Self { base, inside: mesh.topology().node_count(), count: parameters.layers }
    }

    /// The image of a node of the covered faces on a layer; the first is layer zero.
    fn node(&self, node: NodeId, layer: usize) -> NodeId {
        match layer.checked_sub(1) {
            None => node,
            Some(above) => NodeId::new(self.inside + above * self.base.len() + self.base[&node]),
        }
    }

    /// Coordinates [m] of all nodes.
    fn points(&self, mesh: &Mesh, centre: Point) -> Vec<Point> {
        let mut points = mesh.points().to_vec();
        for layer in 1..=self.count {
            let scale = 1.0 + (REACH - 1.0) * layer as f64 / self.count as f64;
            points.extend(self.base.keys().map(|&node| {
                let y = sub(mesh.point(node), centre);
                std::array::from_fn::<f64, 3, _>(|d| centre[d] + scale * y[d])
            }));
        }
        points
    }

    /// Three tetrahedra a prism, cut so that neighbours meet: every side is cut from the lower number's lower node up.
    fn tets(&self, faces: &BTreeMap<[NodeId; 3], Facet>) -> Vec<[NodeId; 4]> {
        let prism = |(key, layer): (&[NodeId; 3], usize)| {
            let [[a, b, c], [above_a, above_b, above_c]] =
                [layer, layer + 1].map(|layer| key.map(|node| self.node(node, layer)));
            [[a, b, c, above_c], [a, b, above_b, above_c], [a, above_a, above_b, above_c]]
        };
        faces.keys().flat_map(|key| (0..self.count).map(move |layer| (key, layer))).flat_map(prism).collect()
    }

    /// The triangles above some edges, ascending each, cut as the prisms are.
    fn side(&self, edges: &[[NodeId; 2]]) -> Vec<[NodeId; 3]> {
        let above = |(&[a, b], layer): (&[NodeId; 2], usize)| {
            let ([a, b], [above_a, above_b]) = (
                [self.node(a, layer), self.node(b, layer)],
                [self.node(a, layer + 1), self.node(b, layer + 1)],
            );
            [[a, b, above_b], [a, above_a, above_b]]
        };
        edges
            .iter()
            .flat_map(|edge| (0..self.count).map(move |layer| (edge, layer)))
            .flat_map(above)
            .collect()
    }
}

#[cfg(test)]
mod tests {
    use super::super::{BlockParameters, block};
    use super::*;

    fn parameters(surfaces: &[&str], centre: Point) -> OpenShellParameters {
        OpenShellParameters {
            surfaces: surfaces.iter().map(|&s| s.to_owned()).collect(),
            centre,
            layers: 3,
            region: "open".into(),
            outer: "infinity".into(),
        }
    }

    fn volume_of(mesh: &Mesh) -> f64 {
        mesh.topology().elements().map(|e| volume(mesh.vertices(e))).sum()
    }

    #[test]
    fn a_shell_on_five_faces_of_a_box_fills_a_box_of_twice_the_size_and_grows_the_symmetry_plane() {
        let inside =
            block(&BlockParameters { cells: [3, 2, 4], ..BlockParameters::default() }).expect("a block");
        let [low, high] = inside.bounding_box();
        let centre = [low[0], 0.5 * (low[1] + high[1]), 0.5 * (low[2] + high[2])];
        let names = ["x_max", "y_min", "y_max", "z_min", "z_max"];
        let mesh = open_shell(&inside, &parameters(&names, centre)).expect("a shell");
        assert!((volume_of(&mesh) / volume_of(&inside) - 8.0).abs() < 1e-12);
        let area = |mesh: &Mesh, name: &str| -> f64 {
            let triangles = mesh.topology().surface(name).expect("named");
            triangles.iter().map(|t| 0.5 * norm(normal(&t.map(|n| mesh.point(n))))).sum()
        };
        assert!((area(&mesh, "x_min") / area(&inside, "x_min") - 4.0).abs() < 1e-12);
        let outside: f64 = names.iter().map(|name| area(&inside, name)).sum();
        assert!((area(&mesh, "infinity") / outside - 4.0).abs() < 1e-12);
        let all = mesh.topology().outer_facets().count();
        let named = ["x_min", "infinity"].map(|name| mesh.topology().surface(name).expect("named").len());
        assert_eq!(all, named.iter().sum(), "nothing else is outside");
    }

    #[test]
    fn what_cannot_carry_a_shell_is_refused_with_its_place() {
        let mesh = block(&BlockParameters::default()).expect("a block");
        let [low, high] = mesh.bounding_box();
        let middle = std::array::from_fn(|d| 0.5 * (low[d] + high[d]));
        let message = |surfaces: &[&str], centre| {
            open_shell(&mesh, &parameters(surfaces, centre)).expect_err("it cannot be").to_string()
        };
        assert!(message(&["x_max"], middle).contains("the face beside the shell at"));
        assert!(message(&["x_min"], low).contains("sees every face from inside"));
        assert!(message(&["nowhere"], middle).contains("no surface `nowhere`"));
        assert!(message(&[], middle).contains("beyond which space is open"));
    }
}
