//! Finds PETSc and MPI by pkg-config and compiles the bridge to them; does nothing without the feature `link`.

fn main() {
    println!("cargo:rerun-if-changed=src/bridge.c");
    #[cfg(feature = "link")]
    link::bridge();
}

#[cfg(feature = "link")]
mod link {
    use pkg_config::Library;

    /// Names that PETSc of complex numbers goes by, and MPI; the first that is found is taken.
    const PETSC: [&str; 3] = ["petsc-complex", "PETSc", "petsc"];
    const MPI: [&str; 4] = ["mpi-c", "ompi-c", "mpi", "mpich"];

    /// Compiles the bridge, or says what is missing.
    pub(super) fn bridge() {
        let petsc = found("FLUXMORPH_PETSC_PC", &PETSC, "PETSc with complex numbers");
        let mpi = found("FLUXMORPH_MPI_PC", &MPI, "MPI");
        let mut build = cc::Build::new();
        build.file("src/bridge.c").warnings(true).extra_warnings(true);
        // Their headers are not ours to mend.
        for path in petsc.include_paths.iter().chain(&mpi.include_paths) {
            build.flag("-isystem").flag(path);
        }
        build.compile("fluxmorph_petsc_bridge");
    }

    fn found(variable: &str, names: &[&str], what: &str) -> Library {
        println!("cargo:rerun-if-env-changed={variable}");
        let given = std::env::var(variable).ok();
        let names: Vec<&str> = given.as_deref().map_or(names.to_vec(), |name| vec![name]);
        let mut said = Vec::new();
        for name in &names {
            match pkg_config::probe_library(name) {
                Ok(library) => return library,
                Err(error) => said.push(error.to_string()),
            }
        }
        panic!(
            "{what} is not found: pkg-config knows none of {}. On Debian or Ubuntu `apt install libpetsc-complex-dev \
             pkg-config` brings both (`just setup-petsc`); elsewhere put the folder of its .pc file into PKG_CONFIG_PATH, or \
             its name into {variable}.\n{}",
            names.join(", "),
            said.join("\n")
        );
    }
}
