//! Open space: a shell around the mesh that stands for all that lies outside.
//!
//! Points of the shell are at `x = c + y`; its inner side is `R = 1`, its outer side `R = 2` of a gauge `R`, linear in every
//! element with its nodal values, that grows along every ray from the centre `c`. The shell is mapped to the outside by
//! `X = c + f y`, `f = 1 / (R (2 − R))`, so that `R = 2` lies at infinity and the map has slope one where it begins: the
//! shell transformation of GetDP (its `F_Transformation`; Henrotte et al., IEEE Trans. Magn. 35 (1999) 1406) for any
//! surface that is seen whole from the centre, ball or box. With `θ = (2 − 2R)/(2 − R)` its Jacobian is
//!
//! `J = f (I − θ y ⊗ ∇R / R)`,  `det J = f³ (1 − θ y·∇R / R)`.
//!
//! Circulations of `A` do not change under a map, and `B` becomes `J B / det J`; so the shell is air with the reluctivity
//! `ν_0 JᵀJ / det J`, bounded up to infinity, and nothing else changes: no load, no gauge (that of nodal elements
//! holds in the coordinates of the mesh), no adjoint. Lives here: the gauge of a mesh, the tensor, the field. Does not live
//! here: how a shell is put around a mesh (`fluxmorph_geometry::generate`).

use std::collections::BTreeMap;
use std::collections::btree_map::Entry;

use fluxmorph_geometry::box_tree::{AxisBox, BoxTree};
use fluxmorph_geometry::fem::c64;
use fluxmorph_geometry::tet4::{Point, Tet4, centroid, cross, dot, norm, point_at, sub};
use fluxmorph_geometry::{ElementId, Mesh, RegionId};

use crate::element::Complex3;
use crate::element::tabulated::Rule;
use crate::element::tensor::{Tensor, TensorField};
use crate::error::SolverError;

/// A region of the mesh that stands for the space outside.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct OpenRegion {
    /// The shell.
    pub region: RegionId,
    /// `c` [m]: the inner side must be seen whole from it, and symmetry planes must pass through it.
    pub centre: Point,
}

/// The shell's map in every one of its elements.
#[derive(Clone, Debug)]
pub(crate) struct Shell {
    elements: BTreeMap<ElementId, Stretch>,
}

/// The map in one element.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Stretch {
    /// `y` of the vertices [m].
    offsets: [Point; 4],
    /// `R` at the vertices.
    gauge: [f64; 4],
    /// `∇R` [1/m].
    slope: Point,
}

impl Stretch {
    fn new(offsets: [Point; 4], gauge: [f64; 4]) -> Self {
        let gradients = Tet4::new(offsets).gradients;
        let slope = std::array::from_fn(|d| (0..4).map(|a| gauge[a] * gradients[a][d]).sum());
        Self { offsets, gauge, slope }
    }

    /// `J` and `det J` at a point given by its barycentric coordinates.
    fn jacobian(&self, lambda: &[f64; 4]) -> (Tensor, f64) {
        let y = point_at(&self.offsets, lambda);
        let r: f64 = (0..4).map(|a| lambda[a] * self.gauge[a]).sum();
        let (f, theta) = (1.0 / (r * (2.0 - r)), (2.0 - 2.0 * r) / (2.0 - r));
        let jacobian = std::array::from_fn(|i| {
            std::array::from_fn(|j| f * (f64::from(u8::from(i == j)) - theta * y[i] * self.slope[j] / r))
        });
        (jacobian, f * f * f * (1.0 - theta * dot(y, self.slope) / r))
    }

    /// `JᵀJ / det J − I`: what the relative reluctivity has beyond one.
    fn excess(&self, lambda: &[f64; 4]) -> Tensor {
        let (jacobian, determinant) = self.jacobian(lambda);
        std::array::from_fn(|i| {
            std::array::from_fn(|j| {
                let product: f64 = jacobian.iter().map(|row| row[i] * row[j]).sum();
                product / determinant - f64::from(u8::from(i == j))
            })
        })
    }

    /// `J B / det J`: the flux density [T] at the place that a point of the shell stands for.
    pub(crate) fn flux_density(&self, lambda: &[f64; 4], b: Complex3) -> Complex3 {
        let (jacobian, determinant) = self.jacobian(lambda);
        jacobian.map(|row| (0..3).map(|j| b[j] * row[j]).sum::<c64>() / determinant)
    }

    /// The tensor at the points of a rule, for the reluctivity `ν_0` [m/H].
    pub(crate) fn tensors(&self, reluctivity: f64, rule: Rule) -> TensorField {
        let at = |(lambda, _): &([f64; 4], f64)| self.excess(lambda).map(|row| row.map(|t| reluctivity * t));
        TensorField { rule, values: rule.nodes().iter().map(at).collect() }
    }
}

impl Shell {
    /// The map of a region.
    ///
    /// # Errors
    /// [`SolverError::EmptyRegion`]; [`SolverError::Open`] where a node of the shell sees no inner or no outer side on its
    /// ray, or the map folds an element.
    pub(crate) fn new(mesh: &Mesh, open: &OpenRegion) -> Result<Self, SolverError> {
        let topology = mesh.topology();
        let name = || topology.region_names()[open.region.index()].clone();
        let elements = topology.elements_of(open.region);
        if elements.is_empty() {
            return Err(SolverError::EmptyRegion { region: name(), expected: "it is to be open space" });
        }
        let fault = |at: Point, what: &str| SolverError::Open { region: name(), at, what: what.to_owned() };
        let sides = Sides::new(mesh, open);
        let mut gauge = BTreeMap::new();
        for node in elements.iter().flat_map(|&e| topology.tet(e)) {
            if let Entry::Vacant(entry) = gauge.entry(node) {
                let value = sides.gauge(sub(mesh.point(node), open.centre));
                entry.insert(value.map_err(|what| fault(mesh.point(node), what))?);
            }
        }
        let stretch = |e: ElementId| {
            let offsets = mesh.vertices(e).map(|x| sub(x, open.centre));
            Stretch::new(offsets, topology.tet(e).map(|n| gauge[&n]))
        };
        let elements: BTreeMap<ElementId, Stretch> = elements.into_iter().map(|e| (e, stretch(e))).collect();
        for (&e, stretch) in &elements {
            if Rule::Degree5.nodes().iter().any(|(lambda, _)| stretch.jacobian(lambda).1 <= 0.0) {
                let at = centroid(mesh.vertices(e));
                return Err(fault(at, "an element lies across the rays from the centre"));
            }
        }
        Ok(Self { elements })
    }

    /// The map in an element of the shell.
    #[inline]
    pub(crate) fn of(&self, e: ElementId) -> Option<&Stretch> {
        self.elements.get(&e)
    }

    /// Elements of the shell, ascending.
    pub(crate) fn elements(&self) -> impl Iterator<Item = ElementId> + '_ {
        self.elements.keys().copied()
    }
}

/// The two sides of a shell as seen from the centre.
struct Sides {
    inner: Faces,
    outer: Faces,
}

impl Sides {
    fn new(mesh: &Mesh, open: &OpenRegion) -> Self {
        let topology = mesh.topology();
        let is_shell = |e: ElementId| topology.region_of()[e.index()] == open.region;
        let (mut inner, mut outer) = (Vec::new(), Vec::new());
        for facet in topology.facets() {
            let vertices = facet.nodes.map(|n| sub(mesh.point(n), open.centre));
            match facet.outside {
                Some(other) if is_shell(facet.inside) != is_shell(other) => inner.push(vertices),
                // A symmetry plane passes through the centre.
                None if is_shell(facet.inside) && !is_plane_of_centre(&vertices) => outer.push(vertices),
                _ => {}
            }
        }
        Self { inner: Faces::new(inner), outer: Faces::new(outer) }
    }

    /// `R` at a place seen from the centre: 1 on the inner side, 2 on the outer, linear along the ray.
    fn gauge(&self, y: Point) -> Result<f64, &'static str> {
        let inner = self.inner.along(y).ok_or("its inner side is not seen from the centre")?;
        let outer = self.outer.along(y).ok_or("its outer side is not seen from the centre")?;
        if outer <= inner {
            return Err("its outer side lies before its inner one");
        }
        Ok((1.0 + (1.0 - inner) / (outer - inner)).clamp(1.0, 2.0))
    }
}

/// Sine of the angle below which a face is taken to pass through the centre.
const IN_PLANE: f64 = 1e-6;

fn is_plane_of_centre(vertices: &[Point; 3]) -> bool {
    let [a, b, c] = *vertices;
    let normal = cross(sub(b, a), sub(c, a));
    vertices.iter().all(|&v| dot(normal, v).abs() <= IN_PLANE * norm(normal) * norm(v))
}

/// Triangles around the centre, at the origin.
struct Faces {
    triangles: Vec<[Point; 3]>,
    tree: BoxTree,
}

/// Share of a triangle by which a ray may miss it: rays to its own corners and edges must not.
const MISS: f64 = 1e-7;

impl Faces {
    fn new(triangles: Vec<[Point; 3]>) -> Self {
        let boxes = triangles.iter().map(AxisBox::around).map(|b| b.grown(MISS * b.extent())).collect();
        Self { triangles, tree: BoxTree::new(boxes) }
    }

    /// The factor `t` for which `t y` is on the surface; of several the one hit best.
    fn along(&self, y: Point) -> Option<f64> {
        let mut best: Option<(f64, f64)> = None;
        for i in self.tree.hits([0.0; 3], y) {
            let [a, b, c] = self.triangles[i];
            let volumes = [dot(y, cross(b, c)), dot(y, cross(c, a)), dot(y, cross(a, b))];
            let sum: f64 = volumes.iter().sum();
            let least = volumes.iter().map(|v| v / sum).fold(f64::INFINITY, f64::min);
            let factor = dot(a, cross(b, c)) / sum;
            if factor > 0.0 && least > -MISS && best.is_none_or(|(most, _)| least > most) {
                best = Some((least, factor));
            }
        }
        best.map(|(_, factor)| factor)
    }
}
