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
    cargo test --release --test verification -- --ignored --nocapture write_the_table

# Computes the tables of mesh motion in docs/torture.md
torture:
    cargo test --release -p fluxmorph-remesh --test torture -- --ignored --nocapture write_the_table

# The fields of fresh runs read through VTK; installs pyvista with pip below target/
test-pyvista:
    cargo test --release --test acceptance -- --ignored --nocapture pyvista

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

# What must be green before a change is taken
ci:
    .ci/run
