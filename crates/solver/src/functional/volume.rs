//! Volume of a region on the moved mesh, or its mass: a function of the shape alone, which no field has a say in.
//!
//! Of a meshed region: the sum of its tetrahedra, `∂V_e/∂x_a = V_e ∇N_a`. Of a region that an impedance surface replaces
//! only the exposed surface `S` is left. With a field `q` of `div q = 1` whose normal component vanishes on the outer
//! planes that close `S`, the divergence theorem gives
//!
//! `V(x) = V(x₀) + ∫_S(x) q·n dA − ∫_S(x₀) q·n dA`, `q_i = w_i (x_i − o_i)`, `Σ w_i = 1`:
//!
//! along an axis with one closing plane, `o_i` is that plane; with two (a slab between planes) `w_i = 0`; else any `o_i`
//! does. What else closes `S`, such as a curved outer face, adds a constant, as nothing moves there. `q` is linear, so the
//! flux through a triangle is `q(centroid) · area vector`, exactly. Both sums run in the order of the elements or
//! triangles, whatever the number of threads.

use fluxmorph_geometry::tet4::{Point, Tet4, area_vector, centroid, cross, dot, sub};
use fluxmorph_geometry::{ElementId, Mesh, NodeId, RegionId, tet4};

use super::FunctionalValue;
use crate::error::SolverError;

/// Largest component of a unit normal across its axis for a plane: coordinates in files carry 6 or more digits.
const PLANE_TOLERANCE: f64 = 1e-6;

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
    Exposed {
        /// Oriented into the region.
        triangles: Vec<[NodeId; 3]>,
        flux: FluxField,
        /// `V(x₀)` plus the flux into the region on the reference mesh [m³].
        constant: f64,
    },
}

impl Volume {
    /// The volume of a region: of `reference`, the mesh that moves, where the region is meshed; inside
    /// `impedance_surface` where that replaces it. The surface consists of triangles of `reference` oriented out of it;
    /// `full_mesh` has the region and the coordinates of `reference`.
    ///
    /// # Errors
    /// [`SolverError::Mesh`] for an unknown name, [`SolverError::EmptyRegion`], [`SolverError::Boxed`].
    pub fn new(
        reference: &Mesh,
        full_mesh: &Mesh,
        region_name: &str,
        impedance_surface: Option<&[[NodeId; 3]]>,
    ) -> Result<Self, SolverError> {
        let mesh = if impedance_surface.is_some() { full_mesh } else { reference };
        let region = mesh.topology().region(region_name)?;
        let elements = mesh.topology().elements_of(region);
        if elements.is_empty() {
            let expected = "name a region that is meshed, whose volume is defined";
            return Err(SolverError::EmptyRegion { region: region_name.to_owned(), expected });
        }
        let extent = match impedance_surface {
            None => Extent::Meshed(elements),
            Some(triangles) => {
                let flux = FluxField::new(full_mesh, region)
                    .ok_or_else(|| SolverError::Boxed { region: region_name.to_owned() })?;
                let triangles = triangles.to_vec();
                let volume: f64 = elements.iter().map(|&e| tet4::volume(full_mesh.vertices(e))).sum();
                Extent::Exposed { constant: volume + flux.through(reference, &triangles), triangles, flux }
            }
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
            Extent::Exposed { triangles, flux, constant } => constant - flux.through(mesh, triangles),
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
            Extent::Exposed { triangles, flux, .. } => {
                for triangle in triangles {
                    let derivative = flux.derivative(triangle.map(|n| mesh.point(n)));
                    for (&node, g) in triangle.iter().zip(derivative) {
                        add(node, g, -self.factor);
                    }
                }
            }
        }
        nodal
    }
}

/// `q_i = weights_i (x_i − origin_i)`, a field of divergence 1.
#[derive(Clone, Debug)]
struct FluxField {
    weights: Point,
    /// [m]
    origin: Point,
}

impl FluxField {
    /// A field that does not cross the outer planes of a region; `None` where there are two along every axis.
    fn new(mesh: &Mesh, region: RegionId) -> Option<Self> {
        let topology = mesh.topology();
        let [lower, upper] = mesh.bounding_box();
        let mut planes: [Vec<f64>; 3] = Default::default();
        for facet in topology.facets().iter().filter(|f| f.outside.is_none()) {
            if topology.region_of()[facet.inside.index()] != region {
                continue;
            }
            let vertices = facet.nodes.map(|n| mesh.point(n));
            let Some(axis) = normal_axis(vertices) else { continue };
            let (at, tolerance) = (centroid(vertices)[axis], PLANE_TOLERANCE * (upper[axis] - lower[axis]));
            if !planes[axis].iter().any(|plane| (plane - at).abs() <= tolerance) {
                planes[axis].push(at);
            }
        }
        let open = planes.iter().filter(|planes| planes.len() < 2).count();
        let weight = |planes: &Vec<f64>| if planes.len() < 2 { 1.0 / open as f64 } else { 0.0 };
        let origin = |planes: &Vec<f64>| planes.first().copied().unwrap_or(0.0);
        (open > 0)
            .then(|| Self { weights: planes.each_ref().map(weight), origin: planes.each_ref().map(origin) })
    }

    fn at(&self, point: Point) -> Point {
        std::array::from_fn(|i| self.weights[i] * (point[i] - self.origin[i]))
    }

    /// `∫ q·n dA` over the triangles [m³].
    fn through(&self, mesh: &Mesh, triangles: &[[NodeId; 3]]) -> f64 {
        let flux = |triangle: &[NodeId; 3]| {
            let vertices = triangle.map(|n| mesh.point(n));
            dot(self.at(centroid(vertices)), area_vector(vertices))
        };
        triangles.iter().map(flux).sum()
    }

    /// `∂/∂x_k` of the flux through one triangle [m²], shape `(3, 3)`.
    ///
    /// `A = ½ x_k × (x_{k+1} − x_{k+2}) + …`, so `q·dA = ½ ((x_{k+1} − x_{k+2}) × q)·dx_k`; and `dq = w dx_k / 3`.
    fn derivative(&self, vertices: [Point; 3]) -> [Point; 3] {
        let (area, q) = (area_vector(vertices), self.at(centroid(vertices)));
        std::array::from_fn(|k| {
            let turned = cross(sub(vertices[(k + 1) % 3], vertices[(k + 2) % 3]), q);
            std::array::from_fn(|d| self.weights[d] * area[d] / 3.0 + 0.5 * turned[d])
        })
    }
}

/// The axis that a triangle is normal to.
fn normal_axis(vertices: [Point; 3]) -> Option<usize> {
    let area = area_vector(vertices);
    let length = tet4::norm(area);
    (0..3).find(|&axis| (0..3).all(|d| d == axis || area[d].abs() <= PLANE_TOLERANCE * length))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_flux_through_a_triangle_has_its_derivative() {
        let flux = FluxField { weights: [0.5, 0.2, 0.3], origin: [0.1, -0.4, 0.7] };
        let vertices = [[0.1, 0.2, 0.3], [1.0, 0.3, -0.2], [0.4, 1.1, 0.6]];
        let value = |v: [Point; 3]| dot(flux.at(centroid(v)), area_vector(v));
        let derivative = flux.derivative(vertices);
        for (k, d) in (0..3).flat_map(|k| (0..3).map(move |d| (k, d))) {
            let shifted = |h: f64| {
                let mut v = vertices;
                v[k][d] += h;
                value(v)
            };
            // The flux is quadratic in one coordinate: a central difference is exact up to rounding, 1e-16 / 1e-3.
            let difference = (shifted(1e-3) - shifted(-1e-3)) / 2e-3;
            assert!((derivative[k][d] - difference).abs() < 1e-12, "{k} {d}");
        }
    }

    #[test]
    fn a_region_between_planes_is_measured_along_the_open_axis() {
        let mesh = fluxmorph_geometry::generate::block(&fluxmorph_geometry::generate::BlockParameters {
            size: [1.0; 3],
            cells: [2; 3],
        })
        .expect("a block");
        let region = mesh.topology().region("block").expect("it has one");
        assert!(FluxField::new(&mesh, region).is_none(), "two planes along every axis");
        let missing = Volume::new(&mesh, &mesh, "blok", None).expect_err("no such region");
        assert!(missing.to_string().contains("blok"), "{missing}");
    }
}
