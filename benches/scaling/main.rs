//! CPU time, wall time and memory of the phases of a design step on meshes from 14 thousand to a million tetrahedra:
//! `just bench` writes the tables of docs/performance.md.
//!
//! Each case is a process of its own, so that its peak of memory is its own; the cases of a table follow one another on the
//! same machine, so that their ratios mean something. Arguments choose tables: `cargo bench --bench scaling -- steps`.

mod case;
mod page;

use std::process::Command;

use case::{Case, Record};

/// The meshes: the shipped shield with other line distances. Name, `--set` overrides.
pub(crate) const MESHES: [(&str, &[&str]); 6] = [
    (
        "14k",
        &["mesh.shield.refinement=0.3", "mesh.shield.growth=2.5", THIN, "mesh.shield.side_skin=[1e-3,4e-3]"],
    ),
    ("35k", &["mesh.shield.refinement=0.5"]),
    ("73k", &[]),
    ("103k", &["mesh.shield.refinement=1.3"]),
    ("406k", &["mesh.shield.refinement=1.6"]),
    ("1M", &["mesh.shield.refinement=2.5", "mesh.shield.growth=2.1"]),
];

/// Four lines below each face of the plate.
const THIN: &str = "mesh.shield.skin=[4e-4,1.2e-3,2.5e-3,5e-3]";

/// The tables, by the word that chooses them.
const TABLES: [&str; 5] = ["steps", "methods", "two_level", "quadratic", "runs"];

fn main() {
    let words: Vec<String> = std::env::args().skip(1).filter(|word| word != "--bench").collect();
    if words.first().is_some_and(|word| word == "--case") {
        let case: Case = serde_json::from_str(&words[1]).expect("the parent writes it");
        // In a pool of its own, as the program works: from outside every parallel loop would wait for a thread to wake.
        let pool = rayon::ThreadPoolBuilder::new().num_threads(case.threads).build().expect("a pool");
        println!("{}", serde_json::to_string(&pool.install(|| case.measure())).expect("numbers"));
        return;
    }
    let chosen = |table: &str| words.is_empty() || words.iter().any(|word| word == table);
    for table in TABLES.into_iter().filter(|table| chosen(table)) {
        let text = match table {
            "steps" => page::steps(&of_meshes(&[1, 2], Case::step)),
            "methods" => page::methods(&run(methods())),
            "two_level" => page::two_level(&run(MESHES[2..]
                .iter()
                .map(|(mesh, _)| Case::step(mesh, 1).with_method("two_level"))
                .collect())),
            "quadratic" => page::quadratic(&run(quadratic())),
            _ => page::runs(&run(MESHES[..3].iter().map(|(mesh, _)| Case::optimisation(mesh)).collect())),
        };
        println!("{text}");
        page::replace(table, &text);
    }
}

fn of_meshes(threads: &[usize], case: impl Fn(&str, usize) -> Case) -> Vec<Record> {
    run(MESHES.iter().flat_map(|(mesh, _)| threads.iter().map(|&t| case(mesh, t))).collect())
}

fn methods() -> Vec<Case> {
    let names = ["direct", "direct_single", "real_factor", "real_factor_single", "two_level", "incomplete"];
    MESHES[1..4]
        .iter()
        .flat_map(|(mesh, _)| names.map(|method| Case::step(mesh, 1).with_method(method)))
        .collect()
}

fn quadratic() -> Vec<Case> {
    let methods = ["real_factor_single", "two_level"];
    let on = |&(mesh, _)| methods.map(|method| Case::step(mesh, 1).quadratic().with_method(method));
    MESHES[..2].iter().flat_map(on).collect()
}

/// Measures every case in a process of its own.
fn run(cases: Vec<Case>) -> Vec<Record> {
    cases
        .into_iter()
        .map(|case| {
            eprintln!("{case:?}");
            let output = Command::new(std::env::current_exe().expect("this program"))
                .args(["--case", &serde_json::to_string(&case).expect("words and numbers")])
                .stderr(std::process::Stdio::inherit())
                .output()
                .expect("this program runs");
            assert!(output.status.success(), "{case:?} failed");
            serde_json::from_slice(&output.stdout).expect("the child writes a record")
        })
        .collect()
}
