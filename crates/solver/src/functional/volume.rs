//! Volume of a region on the moved mesh, or its mass: a function of the shape alone, which no field has a say in.
//!
//! Of a meshed region: the sum of its tetrahedra, `∂V_e/∂x_a = V_e ∇N_a`. Of a region that an impedance surface replaces
//! no element is left, but all of its faces are known: those that are exposed, and those that close them, at the outside
//! and towards other regions that are replaced. They enclose
//!
//! `V = 1/6 Σ a·(b × c)` over triangles out of the region with corners `a`, `b`, `c` from any one place, `∂V/∂a = (b × c)/6`.
//!
//! Corners in a closing face alone stay where they were. While its rim moves within the plane of such a face, `V` is exact
//! whatever becomes of the triangles there: in a plane only the rim counts. Both sums run in the order of the elements or
//! triangles, whatever the number of threads.

use fluxmorph_geometry::tet4::{Point, Tet4, cross, dot, sub};
use fluxmorph_geometry::{ElementId, Mesh, NodeId, RegionId, tet4};

use super::FunctionalValue;
use crate::error::SolverError;

/// Volume [m³] of a region, or its mass [kg].
#[derive(Clone, Debug)]
pub struct Volume {
    extent: Extent,
    /// 1, or the density [kg/m³].
    factor: f64,
}

#[derive(Clone, Debug)]
enum Extent {
    Meshed(Vec<ElementId>),
    Enclosed {
        /// Out of the region.
        faces: Vec<[Corner; 3]>,
        /// From where corners are measured [m]: a place of the region, near which little cancels.
        origin: Point,
    },
}

/// A corner of a face.
#[derive(Clone, Copy, Debug)]
enum Corner {
    Node(NodeId),
    /// No node of the mesh that moves [m].
    Still(Point),
}

impl Volume {
    /// The volume of a region: of `reference`, the mesh that moves, where the region is meshed there; else what its faces
    /// enclose in `full_mesh`, which has the region and the coordinates of `reference`.
    ///
    /// # Errors
    /// [`SolverError::Mesh`] for an unknown name, [`SolverError::EmptyRegion`].
    pub fn new(reference: &Mesh, full_mesh: &Mesh, region_name: &str) -> Result<Self, SolverError> {
        let elements = |mesh: &Mesh| {
            Ok::<_, SolverError>(mesh.topology().elements_of(mesh.topology().region(region_name)?))
        };
        let extent = match elements(reference)? {
            meshed if !meshed.is_empty() => Extent::Meshed(meshed),
            _ => Extent::enclosed(reference, full_mesh, full_mesh.topology().region(region_name)?)
                .ok_or_else(|| {
                    let expected = "name a region that is meshed, whose volume is defined";
                    SolverError::EmptyRegion { region: region_name.to_owned(), expected }
                })?,
        };
        Ok(Self { extent, factor: 1.0 })
    }

    /// The mass [kg] instead, for a density [kg/m³].
    pub fn with_density(self, density: f64) -> Self {
        Self { factor: density, ..self }
    }

    /// The value alone, on a moved mesh: [m³], or [kg] with a density.
    pub fn value(&self, mesh: &Mesh) -> f64 {
        let volume: f64 = match &self.extent {
            Extent::Meshed(elements) => elements.iter().map(|&e| tet4::volume(mesh.vertices(e))).sum(),
            Extent::Enclosed { faces, origin } => faces
                .iter()
                .map(|face| face.map(|corner| corner.seen_from(*origin, mesh)))
                .map(|[a, b, c]| dot(a, cross(b, c)) / 6.0)
                .sum(),
        };
        self.factor * volume
    }

    pub(super) fn evaluate(&self, mesh: &Mesh) -> FunctionalValue {
        let explicit = Some(self.node_derivative(mesh));
        FunctionalValue { value: self.value(mesh), explicit, ..FunctionalValue::default() }
    }

    /// Derivative with respect to every node's position [m², or kg/m], shape `(n_nodes, 3)`.
    pub fn node_derivative(&self, mesh: &Mesh) -> Vec<Point> {
        let mut nodal = vec![[0.0; 3]; mesh.points().len()];
        let mut add = |node: NodeId, g: Point, factor: f64| {
            for (sum, g) in nodal[node.index()].iter_mut().zip(g) {
                *sum += factor * g;
            }
        };
        match &self.extent {
            Extent::Meshed(elements) => {
                for &e in elements {
                    let tet = Tet4::new(mesh.vertices(e));
                    for (node, g) in mesh.topology().tet(e).into_iter().zip(tet.gradients) {
                        add(node, g, self.factor * tet.volume);
                    }
                }
            }
            Extent::Enclosed { faces, origin } => {
                for face in faces {
                    let seen = face.map(|corner| corner.seen_from(*origin, mesh));
                    for (k, corner) in face.iter().enumerate() {
                        if let Corner::Node(node) = *corner {
                            add(node, cross(seen[(k + 1) % 3], seen[(k + 2) % 3]), self.factor / 6.0);
                        }
                    }
                }
            }
        }
        nodal
    }
}

impl Extent {
    /// What the faces of a region of `full` enclose. Corners that are nodes of `reference`, by their coordinates, move; the others
    /// stay. `None` without faces.
    fn enclosed(reference: &Mesh, full: &Mesh, region: RegionId) -> Option<Self> {
        let faces = full.topology().boundary(region);
        let moving = full.nodes_in(reference);
        let corner = |n: NodeId| moving[n.index()].map_or_else(|| Corner::Still(full.point(n)), Corner::Node);
        let origin = full.point(faces.first()?[0]);
        Some(Self::Enclosed { faces: faces.iter().map(|face| face.map(corner)).collect(), origin })
    }
}

impl Corner {
    /// The vector from a place to it [m].
    fn seen_from(self, origin: Point, mesh: &Mesh) -> Point {
        match self {
            Self::Node(node) => sub(mesh.point(node), origin),
            Self::Still(point) => sub(point, origin),
        }
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use fluxmorph_geometry::generate::{BoxRegion, BoxesParameters, boxes};

    use super::*;

    /// Two bodies beside each other under a gap, all to the outside, away from the origin and turned about z: no plane that
    /// closes a body leads through the origin, or is at right angles to an axis.
    fn two_bodies() -> Mesh {
        let region = |name: &str, lower: Point, upper: Point| BoxRegion {
            name: name.to_owned(),
            corners: [lower, upper],
            size: [0.25, 0.5, 0.25],
            skin: [f64::INFINITY; 3],
            cells: None,
        };
        let parameters = BoxesParameters {
            corners: [[0.0; 3], [2.0, 1.0, 2.0]],
            regions: vec![
                region("left", [0.0; 3], [0.5, 1.0, 1.0]),
                region("right", [0.5, 0.0, 0.0], [2.0, 1.0, 1.0]),
            ],
            sizes: Vec::new(),
            surfaces: Vec::new(),
            growth: 1.5,
            refinement: 1.0,
            division: None,
        };
        let mesh = boxes(&parameters).expect("two bodies");
        let place = |&[x, y, z]: &Point| [0.8 * x - 0.6 * y + 7.0, 0.6 * x + 0.8 * y - 3.0, z + 5.0];
        let points = mesh.points().iter().map(place).collect();
        Mesh::new(Arc::clone(mesh.topology()), points).expect("it is turned and moved")
    }

    /// Their faces towards the gap go up by `0.05 + 0.05 x`, `x` along the row.
    fn lifted(mesh: &Mesh) -> Mesh {
        let lift = |&[x, y, z]: &Point| {
            let along = 0.8 * (x - 7.0) + 0.6 * (y + 3.0);
            [0.0, 0.0, if (z - 6.0).abs() < 1e-9 { 0.05 + 0.05 * along } else { 0.0 }]
        };
        mesh.moved(&mesh.points().iter().map(lift).collect::<Vec<_>>()).expect("less than a cell")
    }

    #[test]
    fn bodies_that_are_replaced_have_their_volume_whatever_closes_them() {
        let full = two_bodies();
        let removed = |mesh: &Mesh, name: &str| {
            mesh.without_region(mesh.topology().region(name).expect("a body")).expect("more is left").0
        };
        let left_out = removed(&full, "left");
        for mesh in [&full, &left_out, &removed(&left_out, "right")] {
            let moved = lifted(mesh);
            // 0.5 and 1.5 wide; the mean lift is 0.05 + 0.05 · 0.25 and 0.05 + 0.05 · 1.25.
            for (name, volume, grown) in [("left", 0.5, 0.03125), ("right", 1.5, 0.16875)] {
                let body = Volume::new(mesh, &full, name).expect("a body").with_density(2.0);
                let found = [mesh, &moved].map(|mesh| body.value(mesh));
                let wanted = [volume, volume + grown].map(|volume| 2.0 * volume);
                assert!((0..2).all(|k| (found[k] - wanted[k]).abs() < 1e-12), "{name}: {found:?} {wanted:?}");
            }
        }
        let missing = Volume::new(&full, &full, "lefd").expect_err("no such region");
        assert!(missing.to_string().contains("lefd"), "{missing}");
    }

    /// A volume is linear in every coordinate: a central difference is exact up to rounding, 1e-16 / 1e-3.
    #[test]
    fn what_faces_enclose_has_its_derivative_by_every_node() {
        let full = two_bodies();
        let region = full.topology().region("left").expect("a body");
        let mesh = lifted(&full.without_region(region).expect("more is left").0);
        let body =
            Volume::new(&full.without_region(region).expect("as before").0, &full, "left").expect("a body");
        let derivative = body.node_derivative(&mesh);
        assert!(derivative.iter().filter(|g| **g != [0.0; 3]).count() > 10);
        for (node, d) in (0..mesh.points().len()).flat_map(|node| (0..3).map(move |d| (node, d))) {
            let shifted = |h: f64| {
                let mut motion = vec![[0.0; 3]; mesh.points().len()];
                motion[node][d] = h;
                body.value(&mesh.moved(&motion).expect("far less than a cell"))
            };
            let difference = (shifted(1e-3) - shifted(-1e-3)) / 2e-3;
            assert!((derivative[node][d] - difference).abs() < 1e-12, "{node} {d}");
        }
    }
}
