//! The tables as Markdown, and their places in docs/performance.md.

use std::fmt::Write;
use std::path::Path;

use fluxmorph_optimizer::verify::fitted_slope;

use crate::case::{Record, Time};

/// Writes a table between its marks of the page.
pub(crate) fn replace(name: &str, table: &str) {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("docs/performance.md");
    let page = std::fs::read_to_string(&path).expect("the page is in the repository");
    let (begin, end) = (format!("<!-- bench:{name} -->\n"), format!("<!-- bench:{name} end -->\n"));
    let (head, rest) = page.split_once(&begin).expect("the page has the first mark");
    let (_, tail) = rest.split_once(&end).expect("the page has the second mark");
    std::fs::write(&path, format!("{head}{begin}{table}{end}{tail}")).expect("the page can be written");
}

/// Phases of a design step, and their growth.
pub(crate) fn steps(records: &[Record]) -> String {
    let mut text = String::from(
        "| tets | unknowns | threads | method | set-up | elastic | assembly | factor | state (iterations) | adjoint \
         (iterations) | gradient | **step** CPU | step wall | peak MiB |\n|---|---|---|---|---|---|---|---|---|---|---|---|---|---|\n",
    );
    for r in records {
        let [state, adjoint] = r.iterations;
        let step = r.step();
        row(
            &mut text,
            &[
                r.tets.to_string(),
                r.unknowns.to_string(),
                r.threads.to_string(),
                format!("`{}`", r.method),
                seconds(r.set_up.cpu),
                seconds(r.elastic.cpu),
                seconds(r.assembly.cpu),
                seconds(r.factor.cpu),
                format!("{} ({state})", seconds(r.state.cpu)),
                format!("{} ({adjoint})", seconds(r.adjoint.cpu)),
                seconds(r.gradient.cpu),
                format!("**{}**", seconds(step.cpu)),
                seconds(step.wall),
                mebibytes(r.peak_bytes),
            ],
        );
    }
    let one: Vec<&Record> = records.iter().filter(|r| r.threads == 1).collect();
    let large: Vec<&Record> = one.iter().filter(|r| r.tets > 90_000).copied().collect();
    text.push_str("\nGrowth exponents of the CPU time with the number of tetrahedra, one thread:\n\n");
    text.push_str(
        "| meshes | set-up | assembly | factor | state + adjoint | gradient | step | peak memory |\n",
    );
    text.push_str("|---|---|---|---|---|---|---|---|\n");
    for (name, set) in [("all", &one), ("above 100k", &large)] {
        let of = |quantity: &dyn Fn(&Record) -> f64| format!("{:.2}", exponent(set, quantity));
        row(
            &mut text,
            &[
                name.to_owned(),
                of(&|r| r.set_up.cpu),
                of(&|r| r.assembly.cpu),
                of(&|r| r.factor.cpu),
                of(&|r| r.state.cpu + r.adjoint.cpu),
                of(&|r| r.gradient.cpu),
                of(&|r| r.step().cpu),
                of(&|r| r.peak_bytes as f64),
            ],
        );
    }
    text.push_str("\nWall time of a design step, one thread over two:");
    for pair in records.chunks_exact(2) {
        let ratio = pair[0].step().wall / pair[1].step().wall;
        let _ = write!(text, " {:.2} ({})", ratio, pair[0].mesh);
    }
    text.push_str(".\n");
    text
}

/// The methods against each other, with the deviation of their results from the first one's.
pub(crate) fn methods(records: &[Record]) -> String {
    let mut text = String::from(
        "| tets | unknowns | method | factor | state + adjoint (iterations) | both | preconditioner MiB | peak MiB | F differs by | \
         \\|dF/dp\\| differs by |\n|---|---|---|---|---|---|---|---|---|---|\n",
    );
    for r in records {
        let first = records.iter().find(|first| first.mesh == r.mesh).expect("itself at least");
        let Time { cpu, .. } = r.state + r.adjoint;
        let [state, adjoint] = r.iterations;
        row(
            &mut text,
            &[
                r.tets.to_string(),
                r.unknowns.to_string(),
                format!("`{}`", r.method),
                seconds(r.factor.cpu),
                format!("{} ({state} + {adjoint})", seconds(cpu)),
                seconds(r.factor.cpu + cpu),
                mebibytes(r.preconditioner_bytes as u64),
                mebibytes(r.peak_bytes),
                format!("{:.0e}", (r.objective / first.objective - 1.0).abs()),
                format!("{:.0e}", (r.gradient_norm / first.gradient_norm - 1.0).abs()),
            ],
        );
    }
    text
}

/// Two levels, and their growth.
pub(crate) fn two_level(records: &[Record]) -> String {
    let mut text = iterative(records);
    let all: Vec<&Record> = records.iter().collect();
    let time = exponent(&all, &|r| r.step().cpu);
    let iterations = exponent(&all, &|r| r.iterations[0] as f64);
    let _ = writeln!(text, "\nGrowth exponents: step {time:.2}, iterations {iterations:.2}.");
    text
}

/// Quadratic elements.
pub(crate) fn quadratic(records: &[Record]) -> String {
    iterative(records)
}

fn iterative(records: &[Record]) -> String {
    let mut text = String::from(
        "| tets | unknowns | method | assembly | factor | state (iterations) | adjoint (iterations) | gradient | step | \
         preconditioner MiB | peak MiB |\n|---|---|---|---|---|---|---|---|---|---|---|\n",
    );
    for r in records {
        let [state, adjoint] = r.iterations;
        row(
            &mut text,
            &[
                r.tets.to_string(),
                r.unknowns.to_string(),
                format!("`{}`", r.method),
                seconds(r.assembly.cpu),
                seconds(r.factor.cpu),
                format!("{} ({state})", seconds(r.state.cpu)),
                format!("{} ({adjoint})", seconds(r.adjoint.cpu)),
                seconds(r.gradient.cpu),
                seconds(r.step().cpu),
                mebibytes(r.preconditioner_bytes as u64),
                mebibytes(r.peak_bytes),
            ],
        );
    }
    text
}

/// Whole optimisations.
pub(crate) fn runs(records: &[Record]) -> String {
    let mut text = String::from(
        "| tets | unknowns | evaluations | F/F0 | set-up | run | run per evaluation | peak MiB |\n|---|---|---|---|---|---|---|---|\n",
    );
    for r in records {
        row(
            &mut text,
            &[
                r.tets.to_string(),
                r.unknowns.to_string(),
                r.evaluations.to_string(),
                format!("{:.4}", r.objective),
                seconds(r.set_up.cpu),
                seconds(r.run.cpu),
                format!("**{}**", seconds(r.run.cpu / r.evaluations as f64)),
                mebibytes(r.peak_bytes),
            ],
        );
    }
    text
}

fn row(text: &mut String, cells: &[String]) {
    let _ = writeln!(text, "| {} |", cells.join(" | "));
}

/// Slope of log quantity over log tets by least squares.
fn exponent(records: &[&Record], quantity: &dyn Fn(&Record) -> f64) -> f64 {
    let (tets, values): (Vec<f64>, Vec<f64>) =
        records.iter().map(|r| (r.tets as f64, quantity(r).max(1e-9))).unzip();
    fitted_slope(&tets, &values)
}

fn seconds(s: f64) -> String {
    if s < 0.0995 {
        format!("{s:.3}")
    } else if s < 9.95 {
        format!("{s:.2}")
    } else {
        format!("{s:.1}")
    }
}

fn mebibytes(bytes: u64) -> String {
    format!("{:.0}", bytes as f64 / f64::from(1 << 20))
}
