//! A distributed solver of PETSc.

use std::sync::Arc;

use fluxmorph_geometry::fem::c64;
use fluxmorph_geometry::ranks::{DistributedSolver, Rows, Solved, SolverOptions};

use crate::{bridge, options};

/// Relative residual beyond which there is no solution to speak of; what is enough is for who asked to judge.
const LOST: f64 = 1e-3;

/// What helps against it.
const ADVICE: &str = "take analysis.petsc.solver = \"mumps\", sub_solver = \"complete\", krylov = \"gmres\" or a larger overlap";

/// A user's option as it is called for one solver.
fn prefixed(prefix: &str, name: &str) -> String {
    format!("-{prefix}{}", name.trim_start_matches('-'))
}

/// Matrix, factor and iteration of one distributed system.
#[derive(Debug)]
pub(crate) struct PetscSolver {
    solver: bridge::Solver,
    rows: Rows,
    tolerance: f64,
    /// Options of the user that this solver must have asked for once it has solved; empty when that is checked.
    own: Arc<[(String, String)]>,
    /// What it is called in PETSc's options.
    prefix: String,
}

impl PetscSolver {
    /// Collective.
    pub(crate) fn new(
        rows: Rows,
        given: &SolverOptions,
        prefix: String,
        own: Arc<[(String, String)]>,
    ) -> Result<Self, String> {
        for (name, value) in &*own {
            bridge::option_default(&prefixed(&prefix, name), value)?;
        }
        for (name, value) in options::of_solver(given) {
            bridge::option_default(&format!("-{prefix}{name}"), &value)?;
        }
        let (structure, layout) = (&rows.structure, &rows.layout);
        let rows_here = layout.rows();
        let mut counts = [Vec::with_capacity(rows_here.len()), Vec::with_capacity(rows_here.len())];
        for row in 0..structure.row_count() {
            let columns = &structure.columns[structure.row(row)];
            let is_inside = |&&e: &&u32| rows_here.contains(&(layout.row_of(e as usize) as usize));
            let inside = columns.iter().filter(is_inside).count();
            counts[0].push(inside as i32);
            counts[1].push((columns.len() - inside) as i32);
        }
        let shape = bridge::Shape { count: layout.count(), inside: &counts[0], outside: &counts[1] };
        let solver = bridge::Solver::new(&shape, &prefix, given)?;
        Ok(Self { solver, rows, tolerance: given.tolerance, own, prefix })
    }

    /// Refuses an option of the user that nothing has asked for.
    fn check_options(&mut self) -> Result<(), String> {
        let is_unknown = |(name, _): &&(String, String)| !bridge::option_used(&prefixed(&self.prefix, name));
        if let Some((name, _)) = self.own.iter().find(is_unknown) {
            return Err(format!(
                "analysis.petsc.options: nothing asks for `{name}` with this solver; check its name in PETSc's manual, or \
                 leave it out"
            ));
        }
        self.own = Arc::default();
        Ok(())
    }
}

impl DistributedSolver for PetscSolver {
    fn set_matrix(&mut self, values: &[c64]) -> Result<(), String> {
        let structure = &self.rows.structure;
        let number = |&e: &u32| self.rows.layout.row_of(e as usize);
        let columns: Vec<u32> = structure.columns.iter().map(number).collect();
        let values: Vec<[f64; 2]> = values.iter().map(|v| [v.re, v.im]).collect();
        self.solver.set(&structure.row_starts, &columns, &values)
    }

    fn solve(&mut self, right_side: &[c64], solution: &mut [c64]) -> Result<Solved, String> {
        let right_side: Vec<[f64; 2]> = right_side.iter().map(|b| [b.re, b.im]).collect();
        let mut found = vec![[0.0; 2]; solution.len()];
        let (iterations, residual, reason) = self.solver.solve(&right_side, &mut found, self.tolerance)?;
        self.check_options()?;
        if residual.is_nan() || residual > LOST {
            return Err(format!(
                "the iteration reached the relative residual {residual:.1e} in {iterations} iterations ({reason}); {ADVICE}"
            ));
        }
        for (x, [re, im]) in solution.iter_mut().zip(found) {
            *x = c64::new(re, im);
        }
        Ok(Solved { iterations, residual })
    }
}
