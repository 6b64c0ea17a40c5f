//! What the methods need of the pattern alone: orderings and symbolic factors, made when first asked for; and the choice of
//! the method by size.

use std::sync::{Arc, Mutex, PoisonError};

use fluxmorph_geometry::MeshError;
use fluxmorph_geometry::fem::csr::CsrStructure;
use fluxmorph_geometry::fem::{
    Changes, CsrMatrix, Hosts, IncompleteAnalysis, LdltAnalysis, c64, kept_first, lifted_dissection, ordering,
};

use super::cost::{
    Costs, MATRIX_ENTRY, SINGLE_ENTRY, Service, Sizes, iterations_with_hats, typical_iterations,
};
use super::method::{FieldKind, LinearSolver, LinearSolverSettings, Method, Reuse};
use super::two_level::{self, TwoLevelAnalysis};
use crate::elements::{ElementFamily, Order};
use crate::error::SolverError;

/// What a system is analysed by.
pub(crate) struct SystemPattern<'a> {
    /// The pattern.
    pub(crate) structure: &'a Arc<CsrStructure>,
    /// What the unknowns are ordered by, where they are not vertices' alone.
    pub(crate) hosts: Option<Hosts>,
    /// Which rows change from one matrix to the next; `None` where nothing is known of it.
    pub(crate) changes: Option<Vec<bool>>,
    /// Makes the matrix on the reference mesh: strong couplings are taken from it, once.
    pub(crate) reference: &'a dyn Fn() -> CsrMatrix<c64>,
    /// Makes the prolongation from a coarse level, for that matrix.
    pub(crate) prolongation: &'a Prolong<'a>,
}

/// From a matrix to the prolongation onto its unknowns.
pub(crate) type Prolong<'a> = dyn Fn(&CsrMatrix<c64>) -> Result<CsrMatrix<f64>, SolverError> + 'a;

/// Orderings and symbolic factors of one pattern, and the method for it.
#[derive(Debug)]
pub struct SystemAnalysis {
    pub(super) settings: LinearSolverSettings,
    field: FieldKind,
    elements: (ElementFamily, Order),
    structure: Arc<CsrStructure>,
    hosts: Option<Hosts>,
    changes: Option<Vec<bool>>,
    method: Method,
    /// Once made; the cause where it cannot be.
    complete: Mutex<Option<Result<Arc<LdltAnalysis>, String>>>,
    /// Where it is the method.
    incomplete: Option<Arc<IncompleteAnalysis>>,
    /// Where it is the method.
    two_level: Option<Arc<TwoLevelAnalysis>>,
}

impl SystemAnalysis {
    /// Chooses the method for a pattern, which takes a symbolic factor where the system is not large.
    ///
    /// # Errors
    /// [`SolverError::Mesh`] when the symbolic factorisation does not fit.
    pub(crate) fn new(
        mut pattern: SystemPattern<'_>,
        (field, elements): (FieldKind, (ElementFamily, Order)),
        settings: LinearSolverSettings,
    ) -> Result<Self, SolverError> {
        let mut analysis = Self {
            settings,
            field,
            elements,
            structure: Arc::clone(pattern.structure),
            hosts: pattern.hosts.take(),
            changes: pattern.changes.take(),
            method: Method::Incomplete,
            complete: Mutex::default(),
            incomplete: None,
            two_level: None,
        };
        analysis.method = match settings.method {
            LinearSolver::Fixed(method) => method,
            LinearSolver::Automatic => analysis.cheapest(&pattern)?,
        };
        let reference = || (pattern.reference)();
        match analysis.method {
            Method::Incomplete => analysis.incomplete = Some(two_level::incomplete_analysis(&reference())),
            Method::TwoLevel if analysis.two_level.is_none() => {
                analysis.two_level = Some(two_levels(&pattern, analysis.elements)?);
            }
            _ => {}
        }
        if !analysis.method.is_complete() {
            // What was made to compare with may be as large as the matrix.
            analysis.complete = Mutex::default();
        }
        Ok(analysis)
    }

    /// The cheapest method that fits; without a factor or two levels, the incomplete factor.
    fn cheapest(&mut self, pattern: &SystemPattern<'_>) -> Result<Method, SolverError> {
        let unknowns = pattern.structure.row_count();
        let is_large = unknowns >= self.factors_up_to();
        let mut factor = if is_large { None } else { self.cheapest_factor()? };
        if let Some((method, _)) = factor.filter(|_| unknowns < two_levels_from(self.field, self.elements)) {
            return Ok(method);
        }
        // A coarse level that cannot be made is none.
        self.two_level = two_levels(pattern, self.elements).ok();
        if self.two_level.is_some() && self.fits(Method::TwoLevel) {
            let cost = self.cost_of_design(Method::TwoLevel)?;
            if factor.is_none_or(|(_, least)| cost < least) {
                return Ok(Method::TwoLevel);
            }
        }
        self.two_level = None;
        if is_large {
            factor = self.cheapest_factor()?;
        }
        Ok(factor.map_or(Method::Incomplete, |(method, _)| method))
    }

    /// Unknowns from which a factor is not looked at where two levels fit: its symbolic part takes longer than a design, or
    /// seconds, and its memory is twice that of two levels and more.
    fn factors_up_to(&self) -> usize {
        let is_new = self.settings.reuse == Reuse::Never;
        match (self.field, self.elements) {
            // Of a state and its adjoint on 18 000 and 36 000 unknowns of a meshed plate two levels take two thirds of the time
            // even where a part of the factor is kept, and as long as the factor where there are two of each.
            (FieldKind::Harmonic, (ElementFamily::Nodal, Order::Linear)) if is_new => {
                let few = self.settings.solutions <= FEW_SOLUTIONS;
                if few { two_levels_from(self.field, self.elements) } else { 100_000 }
            }
            (_, (_, Order::Linear)) => 200_000,
            (_, (ElementFamily::Nodal, Order::Quadratic)) => 400_000,
            (_, (ElementFamily::Edge, Order::Quadratic)) => usize::MAX,
        }
    }

    /// The method that solutions begin with.
    pub fn method(&self) -> Method {
        self.method
    }

    /// Unknowns of the system.
    pub fn unknown_count(&self) -> usize {
        self.structure.row_count()
    }

    /// Bytes of the matrix.
    pub fn matrix_bytes(&self) -> usize {
        self.structure.columns.len() * MATRIX_ENTRY
    }

    /// Bytes of the preconditioner of a method on this pattern; of two levels only where that is the method.
    ///
    /// # Errors
    /// [`MeshError::Factorisation`] when the symbolic factorisation does not fit.
    pub fn preconditioner_bytes(&self, method: Method) -> Result<usize, MeshError> {
        Ok(match method {
            Method::Incomplete => self.structure.columns.len() / 2 * SINGLE_ENTRY,
            Method::TwoLevel => self.two_level.as_ref().map_or(0, |levels| levels.bytes()),
            _ => self.complete()?.factor_entries() * entry_bytes(method),
        })
    }

    /// Whether factors serve several designs.
    pub fn reuse(&self) -> Reuse {
        self.settings.reuse
    }

    /// Whether a part of a complete factor is kept from one matrix to the next.
    pub fn keeps_a_part(&self) -> bool {
        self.complete().is_ok_and(|own| own.keeps_a_part())
    }

    /// The cheapest factor that fits, and its cost.
    fn cheapest_factor(&self) -> Result<Option<(Method, f64)>, MeshError> {
        let factors: &[Method] = match self.field {
            FieldKind::Static => &[Method::RealFactorSingle],
            FieldKind::Harmonic => &[Method::DirectSingle, Method::RealFactorSingle],
        };
        let mut best: Option<(Method, f64)> = None;
        for &method in factors.iter().filter(|&&method| self.fits(method)) {
            let cost = self.cost_of_design(method)?;
            if best.is_none_or(|(_, least)| cost < least) {
                best = Some((method, cost));
            }
        }
        Ok(best)
    }

    /// Counted work of a design with all its solutions by the method that solutions begin with [ns].
    ///
    /// # Errors
    /// [`MeshError::Factorisation`] when the symbolic factorisation does not fit.
    pub fn work_of_design(&self) -> Result<f64, MeshError> {
        self.work_of(self.settings.solutions)
    }

    /// Counted work of so many solutions with one matrix [ns].
    ///
    /// # Errors
    /// As [`SystemAnalysis::work_of_design`].
    pub(crate) fn work_of(&self, solutions: usize) -> Result<f64, MeshError> {
        Ok(self.costs(self.method)?.of_design(self.service(self.method), solutions))
    }

    /// The same in a run, in which what is kept of a factor is made once.
    fn cost_of_design(&self, method: Method) -> Result<f64, MeshError> {
        Ok(self.costs_by(method, of_a_design)?.of_design(self.service(method), self.settings.solutions))
    }

    fn service(&self, method: Method) -> Service {
        Service::typical(method, self.settings.reuse, self.typical_iterations(method), self.field)
    }

    /// Whether the preconditioner of a method stays within the settings' bytes; not where it cannot be made at all.
    pub(super) fn fits(&self, method: Method) -> bool {
        // Without any bytes for one a factor is not even analysed, which may take longer than the iterations.
        self.settings.factor_bytes > 0
            && self.preconditioner_bytes(method).is_ok_and(|bytes| bytes <= self.settings.factor_bytes)
    }

    /// The next more robust method that fits.
    pub(crate) fn more_robust(&self, method: Method) -> Option<Method> {
        std::iter::successors(method.more_robust(), |method| method.more_robust())
            .find(|&method| self.fits(method))
    }

    /// Costs of a method on this pattern.
    pub(super) fn costs(&self, method: Method) -> Result<Costs, MeshError> {
        self.costs_by(method, LdltAnalysis::multiplications)
    }

    fn costs_by(
        &self,
        method: Method,
        multiplications: impl Fn(&LdltAnalysis) -> f64,
    ) -> Result<Costs, MeshError> {
        let mut sizes = Sizes { matrix_entries: self.structure.columns.len(), ..Sizes::default() };
        match (method, &self.two_level) {
            (Method::Incomplete, _) => Ok(Costs::incomplete(&sizes)),
            (Method::TwoLevel, levels) => {
                Ok(levels.as_ref().map_or(Costs::default(), |levels| levels.costs(sizes.matrix_entries)))
            }
            _ => {
                let complete = self.complete()?;
                sizes.factor_entries = complete.factor_entries();
                sizes.multiplications = multiplications(&complete);
                Ok(Costs::complete(method, &sizes))
            }
        }
    }

    /// Iterations to expect of a method with a factor of the matrix itself.
    pub(super) fn typical_iterations(&self, method: Method) -> usize {
        let unknowns = self.structure.row_count();
        match &self.two_level {
            Some(levels) if method == Method::TwoLevel && levels.has_hats() => iterations_with_hats(unknowns),
            _ => typical_iterations(method, self.field, self.elements, unknowns),
        }
    }

    /// Ordering and symbolic factor.
    ///
    /// # Errors
    /// [`MeshError::Factorisation`] when it does not fit.
    pub(super) fn complete(&self) -> Result<Arc<LdltAnalysis>, MeshError> {
        let mut held = self.complete.lock().unwrap_or_else(PoisonError::into_inner);
        let analysis = held.get_or_insert_with(|| {
            let usual = LdltAnalysis::new(&self.structure, self.order(None)).map_err(|e| e.to_string())?;
            Ok(self.keeping(&usual).unwrap_or(usual))
        });
        analysis
            .clone()
            .map_err(|cause| MeshError::Factorisation { unknowns: self.structure.row_count(), cause })
    }

    /// A fill-reducing order, with rows last that change from one matrix to the next where they are given.
    fn order(&self, changes: Option<Changes<'_>>) -> Option<Vec<u32>> {
        // On the graph of the matrix, not of the mesh: components that do not couple are graphs of their own.
        match (&self.hosts, changes) {
            (Some(hosts), _) => lifted_dissection(&self.structure, hosts, changes),
            (None, None) => ordering::dissection(&self.structure),
            (None, Some(changes)) => kept_first(&self.structure, None, changes),
        }
    }

    /// The analysis of a factor that is kept in part from one matrix to the next, where that costs less.
    fn keeping(&self, usual: &LdltAnalysis) -> Option<Arc<LdltAnalysis>> {
        let rows = self.changes.as_deref()?;
        let max_rim_multiplications = MAX_RIM_SHARE * usual.multiplications();
        let order = self.order(Some(Changes { rows, max_rim_multiplications }))?;
        let keeping = LdltAnalysis::keeping(&self.structure, Some(order), rows).ok()?;
        let is_cheaper = of_a_design(&keeping) <= WORTH_KEEPING * usual.multiplications();
        let [more, entries] = [&*keeping, usual].map(LdltAnalysis::factor_entries);
        let fits = |entries: usize, method| entries * entry_bytes(method) <= self.settings.factor_bytes;
        // No method may be lost by it, nor one to fall back to.
        let fits_as_well = Method::ALL.iter().all(|&method| fits(more, method) || !fits(entries, method));
        let is_small = more as f64 <= MORE_ENTRIES * entries as f64;
        (is_cheaper && is_small && fits_as_well).then_some(keeping)
    }

    /// Order and parts of the incomplete factor, where that is the method.
    pub(super) fn incomplete(&self) -> Option<&Arc<IncompleteAnalysis>> {
        self.incomplete.as_ref()
    }

    /// Both levels, where that is the method.
    pub(super) fn two_level(&self) -> Option<&Arc<TwoLevelAnalysis>> {
        self.two_level.as_ref()
    }
}

/// Bytes of an entry of a complete factor.
fn entry_bytes(method: Method) -> usize {
    match method {
        Method::Direct => 16,
        Method::RealFactorSingle => 4,
        _ => 8,
    }
}

/// Multiply-adds of a factor in a run, which makes once what is kept.
fn of_a_design(analysis: &LdltAnalysis) -> f64 {
    let (all, changing) = (analysis.multiplications(), analysis.changing_multiplications());
    changing + (all - changing) / DESIGNS
}

/// A state with one or two adjoints.
const FEW_SOLUTIONS: usize = 3;

/// Designs that a run has, about: the shipped ones have 5 to 20.
const DESIGNS: f64 = 10.0;

/// The share of the multiplications of the usual factor below which a part is kept: what is nearer would not earn the time back
/// that its own analysis takes.
const WORTH_KEEPING: f64 = 0.9;

/// The share of these that the rims may take (`Changes`). In the shipped configurations parts of factors pay to a tenth, from a
/// sixth on they do not, and to see it by an order takes as long as a factor.
const MAX_RIM_SHARE: f64 = 0.125;

/// How many times the entries a factor may have that is kept in part: every iteration reads them.
const MORE_ENTRIES: f64 = 1.25;

/// Analyses both levels of the matrix on the reference mesh.
fn two_levels(
    pattern: &SystemPattern<'_>,
    elements: (ElementFamily, Order),
) -> Result<Arc<TwoLevelAnalysis>, SolverError> {
    let matrix = (pattern.reference)();
    let prolongation = (pattern.prolongation)(&matrix)?;
    Ok(TwoLevelAnalysis::new(&matrix, prolongation, elements)?)
}

/// Unknowns from which two levels are compared with a factor, which takes their analysis: below, a factor is cheaper, or as good
/// as that.
pub const fn two_levels_from(field: FieldKind, elements: (ElementFamily, Order)) -> usize {
    match (elements, field) {
        ((ElementFamily::Nodal, Order::Linear), FieldKind::Harmonic) => 12_000,
        ((_, Order::Linear), _) => 45_000,
        ((ElementFamily::Nodal, Order::Quadratic), FieldKind::Harmonic) => 50_000,
        ((ElementFamily::Nodal, Order::Quadratic), FieldKind::Static) => 150_000,
        ((ElementFamily::Edge, Order::Quadratic), _) => 60_000,
    }
}
