# `just` alone lists the targets. None is needed to build or to test: each is one or two cargo commands.

_default:
    @{{ just_executable() }} --list --unsorted

# Format all sources
fmt:
    cargo fmt --all

# Formatting and clippy, warnings are errors
lint:
    cargo fmt --all --check
    cargo clippy --workspace --all-targets -- -D warnings

# All tests but the long ones, with overflow checks and debug assertions
test:
    cargo test --workspace

# The long tests: the paper's tables and runs, convergence on fine meshes
test-long:
    cargo test --release --workspace -- --ignored

# Computes the table of closed forms and benchmarks in docs/verification.md
verify:
    cargo test --release --test physics -- --ignored --nocapture verification::page

# Tables of mesh motion in docs/torture.md, of killed runs, full disks and signals in docs/robustness.md
torture: torture-meshes torture-runs

# Computes the tables of mesh motion in docs/torture.md
torture-meshes:
    cargo test --release -p fluxmorph-remesh --test remesh -- --ignored --nocapture write_the_table

# Real kills, full disks (as root, or where this user may mount) and timed signals; writes docs/robustness.md
torture-runs:
    cargo test --release --test robustness -- --ignored --nocapture page::write_the_table

# The same bits from the program built without and with optimisation
determinism:
    cargo build
    cargo test --release --test robustness -- --ignored --nocapture debug_and_release

# The fields of fresh runs read through VTK; installs pyvista with pip below target/
test-pyvista:
    cargo test --release --test runs -- --ignored --nocapture pyvista

# Writes configs/fluxmorph.schema.json and the tables of docs/configuration.md, both from the types of the configuration
generate:
    cargo test --release --test config -- --ignored write_the_files

# The documentation of the code, warnings are errors
doc:
    RUSTDOCFLAGS="-D warnings" cargo doc --workspace --no-deps

# CPU time and memory of design steps up to a million tetrahedra; writes docs/performance.md
bench:
    cargo bench --bench scaling

# The kernels one by one, and the sparse factors
bench-kernels:
    cargo bench --workspace --bench kernels --bench ldlt --bench elastic --bench msh --bench vtu --bench setup

# A first optimisation, in seconds (it ends at its limit of evaluations): results in configs/runs/shield_quick
demo:
    cargo run --release -- run configs/shield_quick.toml --force || test $? -eq 1

# The picture of a run on a terminal, docs/images/terminal.svg; needs `script` of util-linux
screenshot-terminal:
    cargo test --release --test runs -- --ignored draw_the_terminal

# Fuzz one reader (msh22, msh41_ascii, msh41_binary, config, quantity, journal); needs `cargo install cargo-fuzz`
fuzz TARGET SECONDS="60":
    fuzz/run {{ TARGET }} {{ SECONDS }}

# Fuzz all readers one after the other, so many seconds each
fuzz-all SECONDS="60":
    for target in msh22 msh41_ascii msh41_binary config quantity journal; do fuzz/run $target {{ SECONDS }} || exit 1; done

# The boundary to NLopt with address and undefined-behaviour sanitizers, C included; needs clang
sanitize:
    fuzz/sanitize

# Writes docs/commands.md from what the program says about its commands
commands:
    cargo test --release --test book -- --ignored --nocapture write_the_commands

# Runs every command block of README.md and docs/, the long ones too
book:
    cargo test --release --test book -- --include-ignored --nocapture --skip write_the_commands

# The release archive with checksum and licences in target/dist; tries it out
dist:
    python3 tools/dist.py

# Licences, advisories and versions of all dependencies; needs `cargo install cargo-deny --locked`
deny:
    cargo deny --locked check

# Installs what `--features petsc` needs on Debian and Ubuntu: PETSc of complex numbers, MPI, a fast BLAS
setup-petsc:
    tools/setup_petsc

# The program on several ranks, in a few minutes; needs `just setup-petsc`
test-mpi:
    cargo test --release --features petsc --test mpi -- --test-threads 1
    cargo test --release -p fluxmorph-petsc --features link

# The tables of docs/scale.md; needs `just setup-petsc` and takes an hour
scale:
    cargo build --release --features petsc
    tools/scale.py

# What must be green before a change is taken
ci:
    .ci/run

# Pictures of the shield's report in docs/images; needs Chromium and python3
screenshots:
    cargo run --release -- run configs/shield.toml --force
    python3 -B tools/screenshots.py configs/runs/shield
