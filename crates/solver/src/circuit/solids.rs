//! The voltages of solid conductors as unknowns of the field.
//!
//! In a solid conductor `E = −jω(A + ∇ψ) − V∇χ = −jω(A + ∇(ψ + Uχ))` with one unknown `U = V/(jω)` [Wb] beside those of the
//! field, and its net current is tested by `∇χ`. With the matrices `K_e` of its elements and the coefficients `g` of `∇χ`,
//!
//! `[ K  c ; cᵀ  d ] [ u ; U ] = [ f ; I ]`,  `c = Σ K_e g`,  `d = Σ gᵀ K_e g = jω∫σ|∇χ|²`:
//!
//! complex symmetric as `K` is. `∇χ` has no curl, so that nothing but conduction sees it, and `c` and `d` are made of that part
//! of `K_e` alone: in a weak conductor rounding of the curl would be far above the flux linkage. `U` stands behind the unknowns
//! of the field, wherever these are. Of a conductor as a coil the load of 1 A is 1 in this row, and its flux linkage `V/(jω)` is
//! `U`: its imaginary part is what the resistance takes. Segments in series are such conductors each, with the same current.
//!
//! At 0 Hz the current has the distribution of conduction and is a source.

use std::collections::HashSet;
use std::ops::Range;
use std::sync::Arc;

use fluxmorph_geometry::fem::c64;
use fluxmorph_geometry::{ElementId, Mesh, NodeId};

use super::product;
use crate::boundary::Boundary;
use crate::coil::{Coil, CoilShape, PlaneFault, RegionFault, SolidConductor};
use crate::element::edge::functions::WHITNEY;
use crate::elements::ElementFamily;
use crate::error::SolverError;
use crate::family::{Local, MOST};
use crate::material::Material;
use crate::space::Space;
use crate::unknowns::{Conductors, PSI};

/// Coefficients of `∇χ` in an element.
#[derive(Clone, Copy, Debug)]
struct Gradient {
    /// The segment of a conductor, by its number.
    conductor: usize,
    /// One a carrier.
    coefficients: [f64; MOST],
}

/// The solid conductors of a model above 0 Hz.
#[derive(Clone, Debug, Default)]
pub(crate) struct Solids {
    /// The coil of every segment, by place in the model.
    coils: Vec<usize>,
    /// The component that the coefficients are of.
    component: usize,
    /// Ascending by element.
    gradients: Vec<(ElementId, Gradient)>,
}

/// What solid conductors add to the matrix on one mesh.
#[derive(Clone, Debug, Default)]
pub(crate) struct SolidRows {
    /// `−c`: the load of `U = 1 Wb`.
    pub(super) loads: Arc<Vec<Vec<c64>>>,
    /// `d` [S s].
    pub(super) diagonal: Vec<c64>,
}

impl Solids {
    /// Of the coils that are solid conductors; none at 0 Hz.
    pub(crate) fn new(coils: &[Coil], space: &Space, angular_frequency: f64) -> Self {
        let component = match space.family() {
            ElementFamily::Nodal => PSI,
            ElementFamily::Edge => WHITNEY,
        };
        let mut solids = Self { component, ..Self::default() };
        for (coil, conductor) in conductors(coils).filter(|_| angular_frequency > 0.0) {
            let first = solids.coils.len();
            solids.coils.resize(first + conductor.segment_count(), coil);
            let elements = conductor.potential().iter().zip(conductor.segments());
            solids.gradients.extend(elements.map(|((e, chi), segment)| {
                let coefficients = space.gradient_coefficients(*e, chi);
                (*e, Gradient { conductor: first + segment, coefficients })
            }));
        }
        solids.gradients.sort_by_key(|(e, _)| *e);
        solids
    }

    /// Number of segments of all conductors, each with an unknown of its own.
    pub(crate) fn count(&self) -> usize {
        self.coils.len()
    }

    /// The segments of a coil of the model, by their numbers; `None` where it is no solid conductor.
    pub(crate) fn of_coil(&self, coil: usize) -> Option<Range<usize>> {
        let first = self.coils.iter().position(|own| *own == coil)?;
        Some(first..first + self.coils.iter().filter(|own| **own == coil).count())
    }

    fn gradient_in(&self, e: ElementId) -> Option<&Gradient> {
        let place = self.gradients.binary_search_by_key(&e, |(e, _)| *e).ok()?;
        Some(&self.gradients[place].1)
    }

    /// Adds `U∇χ` to the coefficients of an element; `unknowns` are the `U` of all conductors.
    #[inline]
    pub(crate) fn add_to(&self, e: ElementId, unknowns: &[c64], field: &mut Local) {
        if unknowns.is_empty() {
            return;
        }
        let Some(gradient) = self.gradient_in(e) else { return };
        for carrier in 0..field.values().len() {
            field.add(carrier, self.component, gradient.coefficients[carrier] * unknowns[gradient.conductor]);
        }
    }

    /// The transpose: adds what the coefficients of an element add to its conductor.
    pub(crate) fn scatter(&self, e: ElementId, coefficients: &[[c64; 4]], sums: &mut [c64]) {
        let Some(gradient) = self.gradient_in(e) else { return };
        sums[gradient.conductor] += self.product(gradient, coefficients);
    }

    fn product(&self, gradient: &Gradient, coefficients: &[[c64; 4]]) -> c64 {
        let terms = coefficients.iter().zip(gradient.coefficients);
        terms.map(|(values, g)| g * values[self.component]).sum()
    }

    /// The rows on one mesh: `times` is the product of what conduction has of the matrix of an element, `scatter` adds its
    /// result to a load.
    pub(crate) fn rows(
        &self,
        unknown_count: usize,
        mut times: impl FnMut(ElementId, &Local) -> Local,
        mut scatter: impl FnMut(ElementId, &Local, &mut [c64]),
    ) -> SolidRows {
        let mut loads = vec![vec![c64::default(); unknown_count]; self.count()];
        let mut diagonal = vec![c64::default(); self.count()];
        for (e, gradient) in &self.gradients {
            let mut one = Local::new(MOST, |_| [c64::default(); 4]);
            for (carrier, g) in gradient.coefficients.into_iter().enumerate() {
                one.add(carrier, self.component, g.into());
            }
            let image = times(*e, &one);
            diagonal[gradient.conductor] += self.product(gradient, image.values());
            scatter(*e, &image, &mut loads[gradient.conductor]);
        }
        loads.iter_mut().flatten().for_each(|value| *value = -*value);
        SolidRows { loads: Arc::new(loads), diagonal }
    }
}

impl SolidRows {
    /// Number of conductors.
    pub(crate) fn count(&self) -> usize {
        self.diagonal.len()
    }

    /// `r −= [ 0  c ; cᵀ  d ] [ u ; U ]`.
    pub(crate) fn subtract_product(&self, x: &[c64], r: &mut [c64]) {
        let Some(count) = x.len().checked_sub(self.count()).filter(|_| self.count() > 0) else { return };
        let (u, voltages) = x.split_at(count);
        let (field, own) = r.split_at_mut(count);
        for (k, load) in self.loads.iter().enumerate() {
            field.iter_mut().zip(load).for_each(|(r, load)| *r += load * voltages[k]);
            own[k] += product(load, u) - self.diagonal[k] * voltages[k];
        }
    }
}

/// The coils that are solid conductors, with their places.
pub(crate) fn conductors(coils: &[Coil]) -> impl Iterator<Item = (usize, &SolidConductor)> {
    coils.iter().enumerate().filter_map(|(i, coil)| match &coil.shape {
        CoilShape::Solid(conductor) => Some((i, conductor)),
        _ => None,
    })
}

/// Elements of all solid conductors, ascending.
pub(crate) fn elements(coils: &[Coil]) -> Vec<ElementId> {
    let of =
        |(_, conductor): (usize, &SolidConductor)| conductor.potential().iter().map(|(e, _)| *e).collect();
    let mut elements: Vec<ElementId> = conductors(coils).flat_map::<Vec<_>, _>(of).collect();
    elements.sort_unstable();
    elements
}

/// Refuses a solid conductor on a surface with an applied field.
fn check_applied(
    mesh: &Mesh,
    coil: &str,
    conductor: &SolidConductor,
    boundaries: &[(String, Boundary)],
) -> Result<(), SolverError> {
    for (surface, _) in boundaries.iter().filter(|(_, kind)| matches!(kind, Boundary::UniformField(_))) {
        let given: HashSet<NodeId> = mesh.topology().surface(surface)?.iter().flatten().copied().collect();
        let mut nodes = conductor.potential().iter().flat_map(|(e, _)| mesh.topology().tet(*e));
        if let Some(node) = nodes.find(|node| given.contains(node)) {
            return Err(SolverError::SourceOnBoundary {
                coil: coil.to_owned(),
                surface: format!("the surface `{surface}` of the uniform field"),
                place: mesh.point(node),
                reason: PlaneFault::OnPrescribedField,
            });
        }
    }
    Ok(())
}

/// Refuses solid conductors that another conductor touches, whose driving field ends where the current would go on, and those on a
/// surface with an applied field. At rest, where no conductor has unknowns, what conducts follows from `materials`.
///
/// # Errors
/// [`SolverError::CoilRegion`], [`SolverError::SourceOnBoundary`].
pub(crate) fn check(
    mesh: &Mesh,
    coils: &[Coil],
    (conductors, materials): (&Conductors, &[Material]),
    boundaries: &[(String, Boundary)],
) -> Result<(), SolverError> {
    let solids: Vec<_> = self::conductors(coils).collect();
    if solids.is_empty() {
        return Ok(());
    }
    let topology = mesh.topology();
    let is_stranded = |e: &ElementId| {
        let mut stranded = coils.iter().filter(|coil| !matches!(coil.shape, CoilShape::Solid(_)));
        stranded.any(|coil| coil.shape.flows_in(*e))
    };
    let conducts = |e: &ElementId| materials[topology.region_of()[e.index()].index()].conductivity > 0.0;
    let conducting = match &conductors.elements[..] {
        [] => topology.elements().filter(|e| conducts(e) && !is_stranded(e)).collect(),
        elements => elements.to_vec(),
    };
    let mut shared = vec![false; topology.node_count()];
    for (coil, conductor) in solids {
        let is_own = |e: &ElementId| conductor.potential().binary_search_by_key(e, |(e, _)| *e).is_ok();
        let others = conducting.iter().filter(|e| !is_own(e));
        shared.fill(false);
        let surfaces = conductors.surface.iter().chain(&conductors.grounded).copied().flatten();
        others.flat_map(|&e| topology.tet(e)).chain(surfaces).for_each(|node| shared[node.index()] = true);
        let mut nodes = conductor.potential().iter().flat_map(|(e, _)| topology.tet(*e));
        if let Some(node) = nodes.find(|node| shared[node.index()]) {
            let fault = RegionFault::Touched { place: mesh.point(node) };
            return Err(SolverError::CoilRegion { coil: coils[coil].name.clone(), fault });
        }
        check_applied(mesh, &coils[coil].name, conductor, boundaries)?;
    }
    Ok(())
}
