//! Integrals of energy and loss densities over elements and impedance surfaces that may move with the design.
//!
//! The sums run in the order of the elements, whatever the number of threads.

use fluxmorph_geometry::fem::c64;
use fluxmorph_geometry::tet4::Point;
use fluxmorph_geometry::{CarrierId, ElementId, NodeId, RegionId};
use rayon::prelude::*;

use super::{FunctionalValue, is_static};
use crate::element::Complex3;
use crate::element::density::squared_deviation;
use crate::element::tensor::TensorField;
use crate::error::SolverError;
use crate::family::{Cell, Family, Local, LocalIntegral};
use crate::model::FieldModel;
use crate::nonlinear;
use crate::solution::FieldState;
use crate::surface::{SurfaceLaw, SurfaceTerm};

/// Elements whose integrals are held at once: some megabytes.
const CHUNK: usize = 8192;

/// The integral of a density.
#[derive(Clone, Debug)]
pub enum Integral {
    /// `½∫ν|B − B_r|²` [J] in statics, `∫w(|B|)` where there is a B–H law; in harmonics `¼∫ν|B|²`, and of a law the mean of `w` at the
    /// largest and the least `|B|` of a period; over these elements, ascending.
    Energy(Vec<ElementId>),
    /// `½∫σ|E|²` [W] over these elements, ascending.
    VolumeLoss(Vec<ElementId>),
    /// `½Re(1/Zs)∫|E_t|²` [W] over the impedance surface of the conductor with this index.
    SurfaceLoss(usize),
}

impl Integral {
    pub(super) fn loss(model: &FieldModel, region: &str) -> Result<Self, SolverError> {
        let topology = model.topology();
        if let Some(index) = model.conductors().iter().position(|c| c.name == region) {
            if model.conductors()[index].law == SurfaceLaw::Perfect {
                let what = format!("model of `{region}`");
                return Err(SolverError::parameter(what, "perfect", "a perfect conductor has no loss"));
            }
            return Ok(Self::SurfaceLoss(index));
        }
        let id = topology.region(region)?;
        let elements = topology.elements_of(id);
        if elements.is_empty() || model.materials()[id.index()].conductivity == 0.0 {
            return Err(SolverError::EmptyRegion {
                region: region.to_owned(),
                expected: "a loss needs a region whose material conducts",
            });
        }
        Ok(Self::VolumeLoss(elements))
    }

    pub(super) fn energy(model: &FieldModel, region: Option<RegionId>) -> Result<Self, SolverError> {
        let topology = model.topology();
        let elements: Vec<ElementId> = match region {
            Some(region) => topology.elements_of(region),
            None => topology.elements().collect(),
        };
        if elements.is_empty() {
            let name = region.map_or("", |region| &topology.region_names()[region.index()]);
            return Err(SolverError::EmptyRegion {
                region: name.to_owned(),
                expected: "its field energy is asked for",
            });
        }
        Ok(Self::Energy(elements))
    }

    pub(super) fn evaluate(&self, (model, mesh, solution): FieldState<'_>) -> FunctionalValue {
        let mut sum = Sum::new(model);
        let space = model.space();
        let elements = space.elements();
        match self {
            Self::Energy(of) => {
                let share = if is_static(model) { 0.5 } else { 0.25 };
                sum.elements(of, |e| {
                    let (cell, field) = (space.cell(mesh, e), solution.element(model, e));
                    if let Some(curve) = model.curve_of(e) {
                        let density = &mut |b: Complex3| {
                            let (value, by_b) = nonlinear::energy(curve, b);
                            (2.0 * share * value, by_b.map(|c| 2.0 * share * c))
                        };
                        return elements.flux_integral(&cell, field.values(), density);
                    }
                    let factor = share * model.coefficients_of(e).reluctivity;
                    let density = squared_deviation(factor, model.remanence_of(e));
                    let mut energy = elements.flux_integral(&cell, field.values(), &mut |b| density(b));
                    if let Some(tensors) = model.form().tensors_of(e) {
                        add_tensor_energy(elements, &cell, (share, &tensors), &field, &mut energy);
                    }
                    energy
                });
            }
            Self::VolumeLoss(of) => sum.elements(of, |e| {
                // ½σ|E|² with E = −jω(A + ∇ψ), and the imaginary part ωσ of the eddy coefficient.
                let factor = 0.5 * model.angular_frequency() * model.coefficients_of(e).eddy.im;
                elements.eddy_loss(&space.cell(mesh, e), factor, solution.element(model, e).values())
            }),
            Self::SurfaceLoss(index) => {
                for (triangle, term) in model.surface() {
                    let SurfaceTerm::Impedance(coefficient, owner) = term else { continue };
                    if owner != *index {
                        continue;
                    }
                    let carriers = space.triangle(triangle);
                    let field = solution.local(model, &carriers);
                    // ½ω²Re(1/Zs), and the real part ωRe(1/Zs) of the surface coefficient.
                    let factor = 0.5 * model.angular_frequency() * coefficient.re;
                    let vertices = triangle.map(|n| mesh.point(n));
                    let integral = elements.surface_loss(vertices, factor, field.values());
                    sum.add(&carriers, &triangle, &integral);
                }
            }
        }
        sum.into_value()
    }
}

/// Adds `f ∫B̄·D B` of a tensor at the points of its rule, in an element that is held.
fn add_tensor_energy(
    elements: &dyn Family,
    cell: &Cell,
    (factor, tensors): (f64, &TensorField),
    field: &Local,
    energy: &mut LocalIntegral<4>,
) {
    let mut flux_densities = vec![[c64::default(); 3]; tensors.values.len()];
    elements.each_curl(cell, tensors.rule, &mut |point, carrier, component, curl| {
        let u = field.values()[carrier][component];
        (0..3).for_each(|d| flux_densities[point][d] += u * curl[d]);
    });
    let points = tensors.rule.nodes().iter().zip(&tensors.values).zip(&flux_densities);
    let strengths: Vec<Complex3> = points
        .map(|(((_, share), d), b)| {
            let weight = factor * share * cell.tet.volume;
            d.map(|row| (0..3).map(|j| weight * row[j] * b[j].conj()).sum())
        })
        .collect();
    for (b, h) in flux_densities.iter().zip(&strengths) {
        energy.value += (0..3).map(|d| (b[d] * h[d]).re).sum::<f64>();
    }
    elements.each_curl(cell, tensors.rule, &mut |point, carrier, component, curl| {
        energy.potentials.add(carrier, component, (0..3).map(|d| strengths[point][d] * curl[d]).sum());
    });
}

/// Gathers element integrals.
pub(super) struct Sum<'a> {
    model: &'a FieldModel,
    value: f64,
    derivative: Vec<c64>,
    explicit: Vec<Point>,
}

impl<'a> Sum<'a> {
    pub(super) fn new(model: &'a FieldModel) -> Self {
        Self {
            model,
            value: 0.0,
            derivative: vec![c64::default(); model.unknown_count() + model.solids().count()],
            explicit: vec![[0.0; 3]; model.topology().node_count()],
        }
    }

    pub(super) fn elements(
        &mut self,
        elements: &[ElementId],
        integral: impl Fn(ElementId) -> LocalIntegral<4> + Sync,
    ) {
        for chunk in elements.chunks(CHUNK) {
            let integrals: Vec<_> = chunk.par_iter().map(|&e| integral(e)).collect();
            for (&e, integral) in chunk.iter().zip(&integrals) {
                let (_, of_solids) = self.derivative.split_at_mut(self.model.unknown_count());
                self.model.solids().scatter(e, integral.potentials.values(), of_solids);
                self.add(self.model.space().carriers_of(e), &self.model.topology().tet(e), integral);
            }
        }
    }

    fn add<const M: usize>(
        &mut self,
        carriers: &[CarrierId],
        vertices: &[NodeId; M],
        integral: &LocalIntegral<M>,
    ) {
        self.value += integral.value;
        for (&carrier, terms) in carriers.iter().zip(integral.potentials.values()) {
            self.model.unknowns().scatter_add(&mut self.derivative, carrier, *terms);
        }
        for (vertex, terms) in vertices.iter().zip(integral.positions) {
            for d in 0..3 {
                self.explicit[vertex.index()][d] += terms[d];
            }
        }
    }

    pub(super) fn into_value(self) -> FunctionalValue {
        FunctionalValue {
            value: self.value,
            derivative: self.derivative,
            explicit: Some(self.explicit),
            inductances: Vec::new(),
        }
    }
}
