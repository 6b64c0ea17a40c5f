//! `[analysis.petsc]`: how the linear systems are solved on several ranks.

use crate::config::table::table;
use crate::config::value::choice::choice;

/// Layers of overlap at most: beyond, every rank has most of the mesh of any other.
const MOST_LAYERS: usize = 20;

choice! {
    /// The method for matrices that lie on several ranks.
    pub enum PetscSolver {
        /// MUMPS up to a million unknowns, above Schwarz's method.
        Automatic = "automatic",
        /// A factor over all ranks, by MUMPS: few iterations, much memory.
        Mumps = "mumps",
        /// Additive Schwarz, one subdomain a rank: little memory. Of linear nodal elements it has a coarse level, with which more
        /// ranks hardly take more iterations.
        Asm = "asm",
    }
}

choice! {
    /// The iteration around it.
    pub enum PetscKrylov {
        /// Generalised minimal residuals: robust, and keeps up to 200 vectors.
        Gmres = "gmres",
        /// Conjugate orthogonal conjugate gradients: keeps a few vectors, and has no part in `-ksp_…` options.
        Cocg = "cocg",
    }
}

choice! {
    /// What solves on the subdomain of a rank.
    pub enum PetscSubSolver {
        /// An incomplete factor: without fill beside a coarse level, with one level of it elsewhere.
        Incomplete = "incomplete",
        /// A complete factor.
        Complete = "complete",
    }
}

table! {
    /// How the linear systems are solved on several ranks, by PETSc. It counts where a program with PETSc is started by `mpirun`,
    /// and has no meaning otherwise; `[analysis.linear_solver]` gives the tolerance. `docs/howto/cluster.md` tells more.
    ///
    /// ```toml
    /// [analysis.petsc]
    /// solver = "asm"
    /// overlap = 2
    /// options = "-ksp_gmres_restart 300"
    /// ```
    pub struct Petsc: Default {
        /// The method.
        solver: PetscSolver = WORD => PetscSolver::Automatic;
        /// The iteration.
        krylov: PetscKrylov = WORD => PetscKrylov::Gmres;
        /// Layers of the matrix graph by which the subdomains of `"asm"` overlap.
        overlap: usize = integer(0, MOST_LAYERS) => 2;
        /// What solves on the subdomains of `"asm"`.
        sub_solver: PetscSubSolver = WORD => PetscSubSolver::Incomplete;
        /// Options in PETSc's own words; they win over the keys above. `-ksp_…` and `-pc_…` are those of the field, `-elastic_ksp_…`
        /// and `-elastic_pc_…` those of the mesh motion.
        #[serde(skip_serializing_if = "String::is_empty")]
        options: String = TEXT, else String::new();
    }
    check = |petsc, section| {
        if let Some((message, expected)) = fault_of(&petsc.options, petsc.krylov) {
            section.wrong("options", message, expected);
        }
    };
}

/// How the names of options begin that solvers read; all others are of the library itself, which reads and writes files.
const KNOWN: [&str; 6] = ["-ksp_", "-pc_", "-sub_", "-coarse_", "-mat_mumps_", "-elastic_"];

/// What is wrong with options, and what is expected.
fn fault_of(options: &str, krylov: PetscKrylov) -> Option<(String, String)> {
    let words = || options.split_whitespace();
    let is_name = |word: &str| word.starts_with('-') && word.parse::<f64>().is_err();
    if let Some(first) = words().next().filter(|word| !is_name(word)) {
        let message = format!("`analysis.petsc.options` begins with `{first}`, which is no option");
        return Some((message, "names with a hyphen, each with its value behind it".to_owned()));
    }
    if let Some(name) =
        words().find(|&word| is_name(word) && !KNOWN.iter().any(|known| word.starts_with(known)))
    {
        let message = format!("`{name}` in `analysis.petsc.options` is no option of a solver");
        return Some((message, format!("options that begin with {}", KNOWN.join(", "))));
    }
    if let Some(value) = words().find(|word| word.contains(':')) {
        let message = format!("`{value}` in `analysis.petsc.options` leads PETSc's output elsewhere");
        return Some((message, "options that print on standard output".to_owned()));
    }
    let name = words().find(|word| krylov == PetscKrylov::Cocg && word.starts_with("-ksp_"))?;
    let message = format!("`{name}` in `analysis.petsc.options` has no part in the iteration `cocg`");
    Some((message, "krylov = \"gmres\" with options of an iteration".to_owned()))
}
