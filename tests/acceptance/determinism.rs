//! The same bits whatever the number of threads.

use crate::program::folder;
use crate::shield::{Model, RunFolder};

/// `history.csv` without the column of times.
fn history_without_times(run: &RunFolder) -> Vec<Vec<String>> {
    let (header, rows) = run.history();
    let seconds = header.iter().position(|name| name == "seconds").expect("the column");
    let without = |mut row: Vec<String>| {
        row.remove(seconds);
        row
    };
    std::iter::once(header).chain(rows).map(without).collect()
}

#[test]
fn one_two_and_four_threads_write_the_same_bits() {
    for model in Model::ALL {
        let home = folder();
        let runs = ["1", "2", "4"].map(|threads| {
            let out = home.path().join(threads);
            let arguments = ["--threads", threads, "--max-evaluations", "3", "--set", "output.fields=every"];
            model.command("run", &out, &arguments).exits_with(1);
            RunFolder(out)
        });
        assert_eq!(runs[2].json("manifest.json")["threads"], 4);
        for other in &runs[1..] {
            assert_eq!(history_without_times(&runs[0]), history_without_times(other), "{model:?}");
            for evaluation in 0..3 {
                let name = format!("fields/eval_{evaluation:04}.vtu");
                let bytes = |run: &RunFolder| std::fs::read(run.0.join(&name)).expect("a field file");
                assert!(bytes(&runs[0]) == bytes(other), "{model:?}: {name} differs");
            }
            for key in ["objective", "design", "mesh", "probes", "losses_w", "linear_solver"] {
                assert_eq!(
                    runs[0].json("result.json")[key],
                    other.json("result.json")[key],
                    "{model:?}: {key}"
                );
            }
        }
    }
}
