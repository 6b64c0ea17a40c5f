//! The state of a field problem on a mesh: by one linear system, or with B–H laws by Newton's method.

use fluxmorph_geometry::Mesh;
use fluxmorph_geometry::fem::c64;

use crate::circuit::Excitation;
use crate::error::SolverError;
use crate::linear::{LinearSolverCache, Method, PreparedSystem};
use crate::model::FieldModel;
use crate::newton::{self, NewtonObserver};
use crate::newton_harmonic;
use crate::newton_steps::StepSystems;
use crate::solution::FieldSolution;

impl FieldModel {
    /// Solves the state problem on a mesh; also returns the prepared system for the adjoint.
    ///
    /// # Errors
    /// [`SolverError`] for a mesh of another size than that of the set-up, and when the factorisation or the iteration fails.
    pub fn solve(&self, mesh: &Mesh) -> Result<(FieldSolution, PreparedSystem), SolverError> {
        let [own, others] = [self.topology(), mesh.topology()].map(|of| (of.node_count(), of.tets().len()));
        if own != others {
            let expected = format!("{} and {}, as the mesh of the set-up has", own.0, own.1);
            let value = format!("{} and {}", others.0, others.1);
            return Err(SolverError::parameter("number of nodes and tetrahedra", value, &expected));
        }
        if !self.is_linear() {
            return self.solve_nonlinear(mesh, (&mut LinearSolverCache::default(), None), &mut |_| {});
        }
        let mut system = self.prepare(self.assembled(mesh))?;
        let state = self.solve_prepared(&mut system, &self.load(mesh))?;
        Ok((state, system))
    }

    /// Solves the state problem of a model with B–H laws; also returns the system with the tangent in that state, for the
    /// adjoint. Of `cache` the method that worked last takes part, and what is kept of factors; Newton's method begins with `start`,
    /// the [`unknowns`](FieldSolution::unknowns) of a similar state, and where there is none with the field of the linear parts.
    /// Where its residual stays for rounding a more robust method of the linear solver follows.
    ///
    /// # Errors
    /// [`SolverError::Newton`], and those of [`PreparedSystem::solve`].
    ///
    /// # Panics
    /// Where all is linear.
    pub fn solve_nonlinear(
        &self,
        mesh: &Mesh,
        (cache, start): (&mut LinearSolverCache, Option<&[c64]>),
        observer: &mut NewtonObserver<'_>,
    ) -> Result<(FieldSolution, PreparedSystem), SolverError> {
        assert!(!self.is_linear(), "a model with B–H laws");
        let solve = if self.angular_frequency() > 0.0 { newton_harmonic::solve } else { newton::solve };
        let (mut systems, mut start) = (StepSystems::new(self, cache), start);
        loop {
            match solve(self, mesh, (&mut systems, start), observer) {
                Err(error) if systems.escalate(&error) => {}
                Err(SolverError::Newton { .. }) if start.is_some() => start = None,
                solved => {
                    return solved.map(|(state, system)| (state, system.with_events(systems.into_events())));
                }
            }
        }
    }

    /// What two states' [`unknowns`](FieldSolution::unknowns) leave of the field's equations with B–H laws: the load less all that they
    /// take of it.
    pub(crate) fn nonlinear_residuals(&self, mesh: &Mesh, states: [Vec<c64>; 2]) -> [Vec<c64>; 2] {
        let residuals =
            if self.angular_frequency() > 0.0 { newton_harmonic::residuals } else { newton::residuals };
        residuals(self, mesh, states).map(|own| own.iter().map(|r| -r).collect())
    }

    /// Solves the state problem with a prepared system and a load.
    ///
    /// # Errors
    /// As [`PreparedSystem::solve`].
    pub fn solve_prepared(
        &self,
        system: &mut PreparedSystem,
        load: &[c64],
    ) -> Result<FieldSolution, SolverError> {
        let (values, report, currents) = system.solve_with(load, Excitation::Voltages)?;
        Ok(FieldSolution::state(values, report).with_currents(currents))
    }

    /// Solves for 1 A in every winding whose response the state does not hold yet, where all is linear; beginning with a method, or
    /// with the first choice.
    ///
    /// # Errors
    /// As [`FieldModel::prepare`] and [`PreparedSystem::solve_field`].
    pub fn respond_to_all(
        &self,
        mesh: &Mesh,
        method: Option<Method>,
        state: &mut FieldSolution,
    ) -> Result<(), SolverError> {
        let is_missing = (0..self.windings().count()).any(|k| state.response(k).is_none());
        if !is_missing || !self.is_linear() {
            return Ok(());
        }
        let cache = &mut LinearSolverCache::with_method(method);
        let mut system = self.prepare_with(self.assembled(mesh), cache)?;
        self.respond_to_every_winding(&mut system, state)
    }

    /// The same with a system that is prepared.
    ///
    /// # Errors
    /// As [`PreparedSystem::solve_field`].
    pub fn respond_to_every_winding(
        &self,
        system: &mut PreparedSystem,
        state: &mut FieldSolution,
    ) -> Result<(), SolverError> {
        (0..self.windings().count()).try_for_each(|winding| self.respond(system, winding, state))
    }

    /// Solves for 1 A in a winding by its place, which the state then holds as its response; again only where it does not yet.
    ///
    /// # Errors
    /// As [`PreparedSystem::solve_field`].
    pub fn respond(
        &self,
        system: &mut PreparedSystem,
        winding: usize,
        state: &mut FieldSolution,
    ) -> Result<(), SolverError> {
        if state.response(winding).is_none() {
            let (values, report) = system.solve_field(self.windings().load(winding))?;
            state.respond(winding, FieldSolution::adjoint(values, report));
        }
        Ok(())
    }
}
