//! The options of PETSc that a solver begins with.

use fluxmorph_geometry::ranks::{Krylov, Preconditioning, SolverOptions, SubSolver};

/// Names and values, in PETSc's words without prefix, of what a solver is to do.
///
/// Iterations are preconditioned from the right, and the norm of conjugate gradients is that of the residual itself, so that
/// they stop by what is asked for. Conjugate gradients of either kind have the symmetric form of Schwarz's method, the other the
/// restricted one. A direct solver is an iteration with a factor: what rounding leaves, one
/// or two steps mend.
pub fn of_solver(options: &SolverOptions) -> Vec<(&'static str, String)> {
    let mut list: Vec<(&str, String)> = Vec::new();
    let mut add = |name, value: &str| list.push((name, value.to_owned()));
    match options.krylov {
        Krylov::Gmres => {
            add("ksp_type", "gmres");
            add("ksp_pc_side", "right");
            // Vectors of a restart: with PETSc's 30 the iterations are several times as many (docs/scale.md).
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
pub fn pairs(text: &str) -> Vec<(&str, &str)> {
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
pub fn is_of_field(name: &str) -> bool {
    ["-ksp_", "-pc_", "-sub_", "-mat_mumps_"].iter().any(|start| name.starts_with(start))
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
            let list = of_solver(&options);
            assert_eq!(value(&list, "pc_asm_type"), Some(kind));
            assert_eq!(value(&list, "pc_asm_overlap"), Some("3"));
        }
    }

    #[test]
    fn names_are_told_from_values() {
        let pairs = pairs("-ksp_rtol 1e-9 -mat_mumps_icntl_23 -4000 -ksp_monitor");
        assert_eq!(pairs, [("-ksp_rtol", "1e-9"), ("-mat_mumps_icntl_23", "-4000"), ("-ksp_monitor", "")]);
        assert!(is_of_field(pairs[0].0) && !is_of_field("-elastic_ksp_type") && !is_of_field("-log_view"));
    }
}
