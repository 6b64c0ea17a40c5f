//! PETSc as the engine of several ranks: [`Communicator`] and [`DistributedSolver`] over the foreign crate's plain numbers, and
//! the options that its solvers begin with.
//!
//! Options of `analysis.petsc.options` come first and win. Each field problem has a prefix of its own, so that settings of one
//! are none of another's; an option that belongs to the solvers of the field and that none of them asks for is refused.

use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};

use fluxmorph_geometry::fem::csr::CsrStructure;
use fluxmorph_geometry::fem::{CsrMatrix, c64};
use fluxmorph_geometry::parallel::{
    Communicator, DistributedSolver, Krylov, Preconditioning, Rows, Solved, SolverOptions, SubSolver,
};
use fluxmorph_petsc::petsc::{Coarse, Petsc, Settings, Shape, Solver};

use crate::exit_code::ExitCode;

/// Relative residual beyond which there is no solution to speak of; what is enough is for who asked to judge.
const LOST: f64 = 1e-3;

/// What helps against it.
const ADVICE: &str = "take analysis.petsc.solver = \"mumps\", sub_solver = \"complete\", krylov = \"gmres\" or a larger overlap";

/// This process as a rank of MPI, with PETSc behind it.
#[derive(Debug)]
pub(super) struct PetscRank {
    petsc: Petsc,
    /// The user's options for solvers of the field, with their values.
    field_options: Arc<[(String, String)]>,
    /// How many of these there are.
    solvers: AtomicUsize,
}

impl PetscRank {
    /// Starts MPI and PETSc with a user's options.
    pub(super) fn start(options: &str) -> Result<Self, String> {
        let petsc = Petsc::start(options)?;
        let of_field = option_pairs(options).into_iter().filter(|(name, _)| is_field_option(name));
        let field_options = of_field.map(|(name, value)| (name.to_owned(), value.to_owned())).collect();
        Ok(Self { petsc, field_options, solvers: AtomicUsize::new(0) })
    }

    /// How many ranks this machine has.
    pub(super) fn size_here(&self) -> usize {
        self.petsc.size_here()
    }
}

impl Communicator for PetscRank {
    fn rank(&self) -> usize {
        self.petsc.rank()
    }

    fn size(&self) -> usize {
        self.petsc.size()
    }

    fn broadcast(&self, numbers: &mut [f64]) {
        self.petsc.broadcast(numbers);
    }

    fn gather(&self, own: &[f64]) -> Vec<Vec<f64>> {
        self.petsc.gather(own)
    }

    fn sum(&self, numbers: &mut [f64]) {
        self.petsc.sum(numbers);
    }

    fn solver(&self, rows: Rows, options: &SolverOptions) -> Result<Box<dyn DistributedSolver>, String> {
        let (prefix, field_options) = if options.prefix.is_empty() {
            let number = self.solvers.fetch_add(1, Ordering::SeqCst);
            (format!("field{number}_"), Arc::clone(&self.field_options))
        } else {
            (options.prefix.to_owned(), Arc::default())
        };
        Ok(Box::new(PetscSolver::new(&self.petsc, rows, options, (prefix, field_options))?))
    }

    fn abort(&self, cause: Option<&str>) -> ! {
        if let Some(cause) = cause {
            let line = format!("rank {} of {} cannot continue: {cause}\n", self.rank(), self.size());
            let _ = std::io::Write::write_all(&mut std::io::stderr(), line.as_bytes());
        }
        self.petsc.abort(ExitCode::Numerical as i32)
    }
}

/// Matrix, factor and iteration of one distributed system.
#[derive(Debug)]
struct PetscSolver {
    solver: Solver,
    rows: Rows,
    tolerance: f64,
    /// Options of the user that this solver must have asked for once it has solved; empty when that is checked.
    unchecked: Arc<[(String, String)]>,
    /// What it is called in PETSc's options.
    prefix: String,
}

impl PetscSolver {
    fn new(
        petsc: &Petsc,
        rows: Rows,
        options: &SolverOptions,
        (prefix, field_options): (String, Arc<[(String, String)]>),
    ) -> Result<Self, String> {
        for (name, value) in &*field_options {
            petsc.set_option_default(&with_prefix(&prefix, name), value)?;
        }
        for (name, value) in solver_options(options, rows.coarse.is_some()) {
            petsc.set_option_default(&format!("-{prefix}{name}"), &value)?;
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
        let [inside, outside] = &counts;
        let coarse = rows.coarse.as_ref().map(|coarse| {
            let CsrMatrix { structure, values } = &coarse.prolongation;
            let CsrStructure { row_starts, columns, column_count } = &**structure;
            let [own, shared] = [coarse.own, column_count - coarse.own];
            Coarse {
                row_starts,
                columns,
                weights: values,
                own,
                shared,
                diagonal_factor: coarse.diagonal_factor,
            }
        });
        let shape = Shape { count: layout.count(), inside, outside, coarse };
        let settings = Settings {
            tolerance: options.tolerance,
            max_iterations: options.max_iterations,
            is_complex_symmetric: options.krylov == Krylov::Cocg,
        };
        let solver = petsc.solver(&shape, &prefix, &settings)?;
        Ok(Self { solver, rows, tolerance: options.tolerance, unchecked: field_options, prefix })
    }

    /// Refuses an option of the user that nothing has asked for.
    fn check_options(&mut self) -> Result<(), String> {
        let is_unused =
            |(name, _): &&(String, String)| !self.solver.is_option_used(&with_prefix(&self.prefix, name));
        if let Some((name, _)) = self.unchecked.iter().find(is_unused) {
            return Err(format!(
                "analysis.petsc.options: nothing asks for `{name}` with this solver; check its name in PETSc's manual, or \
                 leave it out"
            ));
        }
        self.unchecked = Arc::default();
        Ok(())
    }
}

impl DistributedSolver for PetscSolver {
    fn set_matrix(&mut self, values: &[c64]) -> Result<(), String> {
        let (structure, numbers) = (&self.rows.structure, self.rows.layout.row_numbers());
        self.solver.set(&structure.row_starts, &structure.columns, numbers, values)
    }

    fn solve(&mut self, right_side: &[c64], solution: &mut [c64]) -> Result<Solved, String> {
        let (iterations, residual, reason) = self.solver.solve(right_side, solution, self.tolerance)?;
        self.check_options()?;
        if residual.is_nan() || residual > LOST {
            return Err(format!(
                "the iteration reached the relative residual {residual:.1e} in {iterations} iterations ({reason}); {ADVICE}"
            ));
        }
        Ok(Solved { iterations, residual })
    }
}

/// A user's option as it is called for one solver.
fn with_prefix(prefix: &str, name: &str) -> String {
    format!("-{prefix}{}", name.trim_start_matches('-'))
}

/// Names and values, in PETSc's words without prefix, of what a solver is to do.
///
/// Iterations are preconditioned from the right, and the norm of conjugate gradients is that of the residual itself, so that
/// they stop by what is asked for. Conjugate gradients of either kind have the symmetric form of Schwarz's method, the other
/// the restricted one. A direct solver is an iteration with a factor: what rounding leaves, one or two steps mend.
fn solver_options(options: &SolverOptions, has_coarse_level: bool) -> Vec<(&'static str, String)> {
    let mut list: Vec<(&str, String)> = Vec::new();
    let mut add = |name, value: &str| list.push((name, value.to_owned()));
    match options.krylov {
        Krylov::Gmres => {
            add("ksp_type", "gmres");
            add("ksp_pc_side", "right");
            // Vectors of a restart: with PETSc's 30 the iterations are several times as many.
            add("ksp_gmres_restart", "200");
        }
        // The bridge iterates; PETSc has the preconditioner.
        Krylov::Cocg => add("ksp_type", "preonly"),
        Krylov::Cg => {
            add("ksp_type", "cg");
            add("ksp_norm_type", "unpreconditioned");
        }
    }
    match options.preconditioning {
        Preconditioning::Direct => {
            // `L D Lᵀ`: half of what a factor without symmetry takes.
            add("pc_type", "cholesky");
            add("pc_factor_mat_solver_type", "mumps");
            // Room beside the estimate, in per cent: pivots that are put off take it.
            add("mat_mumps_icntl_14", "40");
        }
        Preconditioning::Schwarz { overlap, sub_solver } => {
            add("pc_type", "asm");
            add("pc_asm_overlap", &overlap.to_string());
            add("pc_asm_type", if options.krylov == Krylov::Gmres { "restrict" } else { "basic" });
            add("sub_ksp_type", "preonly");
            if has_coarse_level {
                add("coarse_ksp_type", "preonly");
                add("coarse_pc_type", "cholesky");
                add("coarse_pc_factor_mat_solver_type", "mumps");
                // Room for delayed pivots, of which small fronts have many: 40 was too little on four ranks.
                add("coarse_mat_mumps_icntl_14", "100");
            }
            match (sub_solver, options.krylov) {
                (SubSolver::Complete, _) => {
                    add("sub_pc_type", "cholesky");
                    add("sub_pc_factor_mat_solver_type", "mumps");
                    add("sub_mat_mumps_icntl_14", "40");
                }
                // The elastic matrix is positive definite, but its incomplete factor need not be: pivots are raised.
                (SubSolver::Incomplete, Krylov::Cg) => {
                    add("sub_pc_type", "icc");
                    add("sub_pc_factor_shift_type", "positive_definite");
                }
                // The coarse level has what thin elements leave to it: a factor without fill, of one triangle, does.
                (SubSolver::Incomplete, _) if has_coarse_level => {
                    add("sub_pc_type", "icc");
                    add("sub_pc_factor_shift_type", "none");
                    add("sub_pc_factor_mat_ordering_type", "rcm");
                }
                // One level of fill and a narrow band: without either, thin elements take ten times the iterations.
                (SubSolver::Incomplete, _) => {
                    add("sub_pc_type", "ilu");
                    add("sub_pc_factor_levels", "1");
                    add("sub_pc_factor_mat_ordering_type", "rcm");
                }
            }
        }
    }
    list
}

/// A user's options: names, which begin with a hyphen and are no numbers, with their values, which may be empty.
fn option_pairs(text: &str) -> Vec<(&str, &str)> {
    let mut pairs: Vec<(&str, &str)> = Vec::new();
    for word in text.split_whitespace() {
        match pairs.last_mut() {
            _ if word.starts_with('-') && word.parse::<f64>().is_err() => pairs.push((word, "")),
            Some((_, value)) if value.is_empty() => *value = word,
            _ => {}
        }
    }
    pairs
}

/// Whether an option belongs to the solvers of the field, so that one of them must have asked for it once it has solved.
fn is_field_option(name: &str) -> bool {
    ["-ksp_", "-pc_", "-sub_", "-coarse_", "-mat_mumps_"].iter().any(|start| name.starts_with(start))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn value<'a>(list: &'a [(&str, String)], name: &str) -> Option<&'a str> {
        list.iter().find(|(own, _)| *own == name).map(|(_, value)| value.as_str())
    }

    #[test]
    fn conjugate_gradients_have_a_symmetric_preconditioner() {
        for (krylov, kind) in [(Krylov::Gmres, "restrict"), (Krylov::Cocg, "basic"), (Krylov::Cg, "basic")] {
            let preconditioning = Preconditioning::Schwarz { overlap: 3, sub_solver: SubSolver::Incomplete };
            let options =
                SolverOptions { prefix: "", krylov, preconditioning, tolerance: 1e-10, max_iterations: 9 };
            let list = solver_options(&options, false);
            assert_eq!(value(&list, "coarse_pc_type"), None);
            assert_eq!(value(&list, "pc_asm_type"), Some(kind));
            assert_eq!(value(&list, "pc_asm_overlap"), Some("3"));
        }
    }

    #[test]
    fn names_are_told_from_values() {
        let pairs = option_pairs("-ksp_rtol 1e-9 -mat_mumps_icntl_23 -4000 -ksp_monitor");
        assert_eq!(pairs, [("-ksp_rtol", "1e-9"), ("-mat_mumps_icntl_23", "-4000"), ("-ksp_monitor", "")]);
        assert!(
            is_field_option(pairs[0].0)
                && !is_field_option("-elastic_ksp_type")
                && !is_field_option("-log_view")
        );
    }
}
