//! A system ready to be solved with, wherever its matrix is.

use std::sync::Arc;

use fluxmorph_geometry::fem::{CsrMatrix, c64};

use super::cache::LinearSolverCache;
use super::distributed::DistributedSystem;
use super::method::{Method, Reuse};
use super::report::LinearSolverReport;
use super::system::{Goal, LocalSystem, SolverEvent};
use crate::circuit::{Border, Equations, Excitation, Windings};
use crate::error::SolverError;

/// Relative true residual [1] of a solution that serves as a preconditioner.
const ROUGH: f64 = 0.1;

/// The field's matrix ready to be solved with, wherever it is.
#[derive(Debug)]
pub(crate) enum FieldSystem {
    /// In this process.
    Local(Box<LocalSystem>),
    /// On several ranks.
    Distributed(DistributedSystem),
}

/// A derivative of the field's equations that is linear over the real numbers alone.
pub(crate) trait RealLinear: std::fmt::Debug + Send + Sync {
    /// Solves the adjoint problem for all unknowns, those of circuits behind the field's, preconditioned by the system of the matrix
    /// that is nearest to the derivative.
    ///
    /// # Errors
    /// [`SolverError::NotConverged`], and those of the preconditioner.
    fn solve_adjoint(
        &self,
        right_side: &[c64],
        nearest: &mut PreparedSystem,
    ) -> Result<(Vec<c64>, LinearSolverReport), SolverError>;
}

/// A matrix ready to be solved with, for any number of right sides, with the circuits that border it.
#[derive(Debug)]
pub struct PreparedSystem {
    field: FieldSystem,
    border: Option<Border>,
    /// Where the derivative of the equations is linear over the real numbers alone: then the matrix is its preconditioner.
    tangent: Option<Box<dyn RealLinear>>,
}

impl PreparedSystem {
    /// Solves for the circuits that border the field's matrix, if any do; `earlier` is a border of the same matrix.
    ///
    /// # Errors
    /// As [`PreparedSystem::solve`].
    pub(crate) fn new(
        mut field: FieldSystem,
        (circuits, earlier): (Option<Equations>, Option<Border>),
    ) -> Result<Self, SolverError> {
        let border = circuits.map(|own| Border::new(own, earlier, &mut |right_side| field.solve(right_side)));
        Ok(Self { border: border.transpose()?, field, tangent: None })
    }

    /// The same with a derivative that the matrix is nearest to.
    pub(crate) fn with_tangent(self, tangent: impl RealLinear + 'static) -> Self {
        Self { tangent: Some(Box::new(tangent)), ..self }
    }

    /// The same with the circuits of another problem with this matrix, which has no derivative of its own.
    ///
    /// # Errors
    /// As [`PreparedSystem::solve`].
    pub(crate) fn bordered_anew(
        self,
        windings: &Arc<Windings>,
        angular_frequency: f64,
    ) -> Result<Self, SolverError> {
        let Self { field, border, .. } = self;
        let solids = border.as_ref().map(|border| border.solids().clone()).unwrap_or_default();
        Self::new(field, (Equations::new(windings, solids, angular_frequency), border))
    }

    /// The field's matrix alone.
    pub(crate) fn into_field(self) -> FieldSystem {
        self.field
    }

    /// The matrix of the field; `None` where it is on several ranks.
    pub fn matrix(&self) -> Option<&CsrMatrix<c64>> {
        self.field.matrix()
    }

    /// The method in use; `None` where the matrix is on several ranks.
    pub fn method(&self) -> Option<Method> {
        self.field.method()
    }

    /// Bytes of the preconditioner in this process, as far as they are known.
    pub fn preconditioner_bytes(&self) -> usize {
        match &self.field {
            FieldSystem::Local(system) => system.preconditioner_bytes(),
            FieldSystem::Distributed(_) => 0,
        }
    }

    /// What the solver did beside solving.
    pub fn events(&self) -> &[SolverEvent] {
        self.field.events()
    }

    /// Solves as [`PreparedSystem::solve`], as far as a goal says and not the settings.
    ///
    /// # Errors
    /// As [`PreparedSystem::solve`].
    pub(crate) fn solve_within(
        &mut self,
        goal: Goal,
        right_side: &[c64],
    ) -> Result<(Vec<c64>, LinearSolverReport), SolverError> {
        self.aimed(goal, |system| system.solve(right_side))
    }

    /// What is solved with a goal; the settings' is that of what follows.
    fn aimed<T>(&mut self, goal: Goal, solve: impl FnOnce(&mut Self) -> T) -> T {
        self.field.aim(Some(goal));
        let solved = solve(self);
        self.field.aim(None);
        solved
    }

    /// Solves as [`PreparedSystem::solve`], to a relative residual [1] that may be larger than the settings'; on several ranks, and
    /// where the derivative is linear over the real numbers alone, to theirs.
    ///
    /// # Errors
    /// As [`PreparedSystem::solve`].
    pub fn solve_to(
        &mut self,
        tolerance: f64,
        right_side: &[c64],
    ) -> Result<(Vec<c64>, LinearSolverReport), SolverError> {
        match (&self.field, &self.tangent) {
            (FieldSystem::Local(system), None) => {
                let goal = system.usual_goal().relaxed_to(tolerance);
                self.solve_within(goal, right_side)
            }
            _ => self.solve(right_side),
        }
    }

    /// The same after what was done in systems before it.
    pub(crate) fn with_events(mut self, before: Vec<SolverEvent>) -> Self {
        if let FieldSystem::Local(system) = &mut self.field {
            system.precede_events(before);
        }
        self
    }

    /// What the next design may start from.
    pub fn into_cache(self) -> LinearSolverCache {
        let reuse = match &self.field {
            FieldSystem::Local(system) => system.reuse(),
            FieldSystem::Distributed(_) => Reuse::Never,
        };
        self.field.into_cache().between_designs(reuse)
    }

    /// Solves `K x = b` of the field alone, with solid conductors in it: their unknowns are behind the others, and their currents
    /// behind the load, zero where they are left out.
    ///
    /// # Errors
    /// [`SolverError::NotConverged`] when the true residual stays above the required one, [`SolverError::Mesh`] and
    /// [`SolverError::Rank`] when no method has a factor, [`SolverError::NotFinite`] and [`SolverError::OutOfRange`] for a
    /// right side that cannot be solved for.
    pub fn solve_field(&mut self, right_side: &[c64]) -> Result<(Vec<c64>, LinearSolverReport), SolverError> {
        let (values, report, _) = self.solve_with(right_side, Excitation::Open)?;
        Ok((values, report))
    }

    /// Solves with the circuits' sources shorted, as adjoint problems are. Behind the entries of the field's unknowns there may
    /// be those of the currents that voltages drive, zero where they are left out.
    ///
    /// # Errors
    /// As [`PreparedSystem::solve_field`].
    pub fn solve(&mut self, right_side: &[c64]) -> Result<(Vec<c64>, LinearSolverReport), SolverError> {
        let (mut values, report) = self.solve_all(right_side)?;
        values.truncate(self.field_unknowns(&values)[1]);
        Ok((values, report))
    }

    /// Number of the field's unknowns, without and with those of solid conductors, of a vector without others.
    fn field_unknowns(&self, vector: &[c64]) -> [usize; 2] {
        self.border.as_ref().map_or([vector.len(); 2], Border::field_unknowns)
    }

    /// As [`PreparedSystem::solve`], with the currents that voltages drive behind the field's unknowns.
    pub(crate) fn solve_all(
        &mut self,
        right_side: &[c64],
    ) -> Result<(Vec<c64>, LinearSolverReport), SolverError> {
        let (field, circuits) = right_side.split_at(self.field_unknowns(right_side)[1].min(right_side.len()));
        let (mut values, report, currents) = self.solve_with(field, Excitation::Given(circuits))?;
        values.extend(currents);
        Ok((values, report))
    }

    /// The same, and keeps nothing of it for other designs: one of very many.
    pub(crate) fn solve_once(
        &mut self,
        right_side: &[c64],
    ) -> Result<(Vec<c64>, LinearSolverReport), SolverError> {
        let solved = self.solve_all(right_side)?;
        if let FieldSystem::Local(system) = &mut self.field {
            system.forget_last();
        }
        Ok(solved)
    }

    /// The same, so far as a preconditioner has to go that another operator is iterated with; on several ranks as the settings say.
    pub(crate) fn solve_roughly(
        &mut self,
        right_side: &[c64],
    ) -> Result<(Vec<c64>, LinearSolverReport), SolverError> {
        let FieldSystem::Local(system) = &self.field else { return self.solve_once(right_side) };
        let goal = system.usual_goal().relaxed_to(ROUGH);
        self.aimed(goal, |system| system.solve_once(right_side))
    }

    /// Solves with what excites the circuits; the currents [A] that flow in them too.
    ///
    /// # Errors
    /// As [`PreparedSystem::solve_field`].
    pub(crate) fn solve_with(
        &mut self,
        right_side: &[c64],
        excitation: Excitation<'_>,
    ) -> Result<(Vec<c64>, LinearSolverReport, Vec<c64>), SolverError> {
        if let Some(tangent) = self.tangent.take() {
            let solved = self.solve_adjoint(&*tangent, right_side, excitation);
            self.tangent = Some(tangent);
            return solved;
        }
        let unknowns = self.field_unknowns(right_side)[0];
        let (right_side, of_solids) = right_side.split_at(unknowns.min(right_side.len()));
        let (mut values, mut report) = self.field.solve(right_side)?;
        let border = self.border.as_ref();
        // What circuits drive is as exact as the responses that it is made of.
        if let (Some(border), Excitation::Voltages) = (border, excitation) {
            report.residual = report.residual.max(border.report().residual);
            report.iterations += border.report().iterations;
        }
        let currents = border.map(|border| border.complete(&mut values, of_solids, excitation));
        Ok((values, report, currents.unwrap_or_default()))
    }

    /// Solves with a derivative that this system is nearest to, for the entries of adjoint problems.
    fn solve_adjoint(
        &mut self,
        tangent: &dyn RealLinear,
        right_side: &[c64],
        excitation: Excitation<'_>,
    ) -> Result<(Vec<c64>, LinearSolverReport, Vec<c64>), SolverError> {
        let mut right_side = right_side.to_vec();
        let unknowns = self.field_unknowns(&right_side)[1];
        if let Excitation::Given(entries) = excitation {
            right_side.resize(unknowns, c64::default());
            right_side.extend(entries);
        }
        let (mut values, report) = tangent.solve_adjoint(&right_side, self)?;
        let currents = values.split_off(unknowns);
        Ok((values, report, currents))
    }

    /// The circuits that border the field's matrix.
    pub(crate) fn circuits(&self) -> Option<&Equations> {
        self.border.as_ref().map(Border::equations)
    }

    /// `r −= K x` of the field with solid conductors; nothing where the matrix is on several ranks.
    pub(crate) fn subtract_product(&self, x: &[c64], r: &mut [c64]) {
        let Some(matrix) = self.matrix() else { return };
        let count = matrix.structure.row_count();
        let mut product = vec![c64::default(); count];
        matrix.mul(&x[..count], &mut product);
        r.iter_mut().zip(product).for_each(|(r, p)| *r -= p);
        if let Some(border) = &self.border {
            border.solids().subtract_product(x, r);
        }
    }
}

impl FieldSystem {
    /// The matrix; `None` where it is on several ranks.
    pub(crate) fn matrix(&self) -> Option<&CsrMatrix<c64>> {
        match self {
            Self::Local(system) => Some(system.matrix()),
            Self::Distributed(_) => None,
        }
    }

    /// The method in use; `None` where the matrix is on several ranks.
    pub(crate) fn method(&self) -> Option<Method> {
        match self {
            Self::Local(system) => Some(system.method()),
            Self::Distributed(_) => None,
        }
    }

    /// What the solver did beside solving.
    pub(crate) fn events(&self) -> &[SolverEvent] {
        match self {
            Self::Local(system) => system.events(),
            Self::Distributed(_) => &[],
        }
    }

    /// How far to go with the solutions to come; `None` is what the settings say.
    fn aim(&mut self, goal: Option<Goal>) {
        if let Self::Local(system) = self {
            system.aim(goal);
        }
    }

    /// What the next design may start from.
    pub(crate) fn into_cache(self) -> LinearSolverCache {
        match self {
            Self::Local(system) => system.into_cache(),
            Self::Distributed(_) => LinearSolverCache::default(),
        }
    }

    fn solve(&mut self, right_side: &[c64]) -> Result<(Vec<c64>, LinearSolverReport), SolverError> {
        match self {
            Self::Local(system) => system.solve(right_side),
            Self::Distributed(system) => system.solve(right_side),
        }
    }
}
