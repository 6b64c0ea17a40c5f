//! Quantities of the shape alone: volume of a body, bound on its thickness.

use fluxmorph_geometry::tet4::{Point, Tet4, area_vector, cross, dot, sub};
use fluxmorph_geometry::{ElementId, Mesh, NodeId};

use crate::error::Error;
use crate::problem::Shape;

/// Volume of a region on the moved mesh.
#[derive(Clone, Debug)]
pub struct Volume {
    elements: Vec<ElementId>,
    surface: Vec<[NodeId; 3]>,
}

impl Volume {
    /// Of a meshed region, or of one that an impedance surface replaces.
    ///
    /// # Errors
    /// When the region is unknown.
    pub fn new(
        reference: &Mesh,
        _full_mesh: &Mesh,
        region: &str,
        impedance_surface: Option<&[[NodeId; 3]]>,
    ) -> Result<Self, Error> {
        let elements = match impedance_surface {
            Some(_) => Vec::new(),
            None => reference.topology().elements_of(reference.topology().region(region)?),
        };
        Ok(Self { elements, surface: impedance_surface.unwrap_or_default().to_vec() })
    }

    /// Volume [m³] and its derivative by the variables [m²].
    pub fn evaluate(&self, mesh: &Mesh, shape: &Shape) -> (f64, Vec<f64>) {
        let mut nodal: Vec<Point> = vec![[0.0; 3]; mesh.points().len()];
        let mut volume = 0.0;
        for &e in &self.elements {
            let tet = Tet4::new(mesh.vertices(e));
            volume += tet.volume;
            for (n, g) in mesh.topology().tet(e).into_iter().zip(tet.gradients) {
                for d in 0..3 {
                    nodal[n.index()][d] += tet.volume * g[d];
                }
            }
        }
        for nodes in &self.surface {
            let x = nodes.map(|n| mesh.point(n));
            volume -= dot(x[0], area_vector(x)) / 3.0;
            for k in 0..3 {
                let by = cross(x[(k + 1) % 3], x[(k + 2) % 3]);
                for d in 0..3 {
                    nodal[nodes[k].index()][d] -= by[d] / 6.0;
                }
            }
        }
        let _ = sub;
        (volume, shape.surface.gradient(&shape.map.gradient(&nodal)))
    }
}

/// A bound on the thickness.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Bound {
    /// At least [m].
    Minimum(f64),
    /// At most [m].
    Maximum(f64),
}

/// By how much the worst place is beyond a bound on the thickness.
#[derive(Clone, Debug)]
pub struct ThicknessBound {
    bound: Bound,
}

impl ThicknessBound {
    /// For the designed body of a shape.
    pub fn new(_shape: &Shape, bound: Bound) -> Self {
        Self { bound }
    }

    /// The smooth maximum [m], not positive where the bound holds, and its derivative by the variables [1].
    pub fn evaluate(&self, shape: &Shape, p: &[f64]) -> (f64, Vec<f64>) {
        let heights = shape.surface.heights(p);
        let initial = shape.thickness.as_ref().map_or(0.0, |t| t.range(&vec![0.0; heights.len()]).0);
        let (sign, bound) = match self.bound {
            Bound::Minimum(t) => (-1.0, t),
            Bound::Maximum(t) => (1.0, t),
        };
        let beyond: Vec<f64> = heights.iter().map(|h| sign * (initial + h - bound)).collect();
        let worst = beyond.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        let rho = 1e4;
        let weights: Vec<f64> = beyond.iter().map(|b| (rho * (b - worst)).exp()).collect();
        let sum: f64 = weights.iter().sum();
        let nodal: Vec<Point> =
            weights.iter().map(|w| shape.surface.direction().map(|d| sign * w / sum * d)).collect();
        (worst + sum.ln() / rho, shape.surface.gradient(&nodal))
    }
}
