//! The table, the page and the exit codes.

use serde_json::Value;

use super::home::Home;
use crate::support::markup::{Element, elements};

/// The cells of a line, quotes resolved.
pub(super) fn cells(line: &str) -> Vec<String> {
    let (mut cells, mut cell, mut is_quoted) = (Vec::new(), String::new(), false);
    for c in line.chars() {
        match c {
            '"' => is_quoted = !is_quoted,
            ',' if !is_quoted => cells.push(std::mem::take(&mut cell)),
            c => cell.push(c),
        }
    }
    cells.push(cell);
    cells
}

#[test]
fn the_table_holds_the_numbers_of_the_results() {
    let home = Home::new();
    let set = ["--set", "design.upper=2 mm,4 mm", "--set", "optimizer.max_evaluations=2,3"];
    let ended = home.sweep("out", &[&set[..], &["--json"]].concat()).with(1, &[]);
    let table = home.text("out/sweep.csv");
    let mut lines = table.lines();
    let head = cells(lines.next().expect("a head"));
    let expected = "design.upper optimizer.max_evaluations status stop_reason evaluations objective_initial \
                    objective_best ratio verified_ratio verdict violated worst_quality seconds peak_memory_bytes directory";
    assert_eq!(head.join(" "), expected);
    let printed = ended.json();
    let mut values = Vec::new();
    for (i, line) in lines.enumerate() {
        let row = cells(line);
        assert_eq!([&row[0], &row[1]], [["2 mm", "4 mm"][i / 2], ["2", "3"][i % 2]]);
        let result = home.json(&format!("out/{}/result.json", row[14]));
        let pointers = "/status /stop_reason /evaluations /objective/initial /objective/best /objective/ratio \
                        /objective/verified_ratio /accuracy/verdict /violated /mesh/worst_quality_final /timings_s/total /peak_memory_bytes";
        for (pointer, cell) in pointers.split(' ').zip(&row[2..]) {
            // No bound is violated here.
            let value = match pointer {
                "/violated" => &Value::Null,
                "/accuracy/verdict" => result.pointer(pointer).unwrap_or(&Value::Null),
                _ => result.pointer(pointer).expect(pointer),
            };
            let text = match value {
                Value::Null => String::new(),
                Value::String(text) => text.clone(),
                number => number.to_string(),
            };
            assert_eq!(*cell, text, "{pointer}");
        }
        assert_eq!(printed["combinations"][i]["ratio"], result["objective"]["ratio"]);
        assert_eq!(printed["combinations"][i]["directory"], row[14].as_str());
        values.push(row[6].parse::<f64>().expect("a number"));
    }
    assert_eq!(values.len(), 4);
    let best = (0..4).min_by(|&a, &b| values[a].total_cmp(&values[b]));
    assert_eq!(printed["best"].as_u64(), best.map(|best| best as u64));
}

fn has(elements: &[Element], name: &str, attribute: &str, value: &str) -> bool {
    elements.iter().any(|element| element.name == name && element.get(attribute) == Some(value))
}

/// Runs that begin at different designs have ratios to different values, and of two objectives none is the better one.
#[test]
fn the_best_is_that_of_the_objective_and_not_of_its_ratio() {
    let home = Home::with(&[("max_evaluations = 6", "max_evaluations = 2")]);
    let sweep = |out: &str, set: &str| home.sweep(out, &["--set", set, "--json"]).with(1, &[]).json();
    let begun = sweep("begun", "design.initial=0 mm,3 mm");
    let [values, ratios] = ["objective_best", "ratio"]
        .map(|column| [0, 1].map(|i| begun["combinations"][i][column].as_f64().expect("a number")));
    println!("F {values:?}, F/F0 {ratios:?}");
    assert!((values[0] < values[1]) != (ratios[0] < ratios[1]), "the device tells them apart");
    assert_eq!(begun["best"], usize::from(values[1] < values[0]));
    assert!(home.text("begun/sweep.html").contains("Marked: the best F of the runs"));
    assert_eq!(sweep("of_two", "objective.goal=minimise,maximise")["best"], Value::Null);
    let page = home.text("of_two/sweep.html");
    assert!(page.contains("none is the best") && !page.contains("drawn bold"));
}

#[test]
fn the_page_is_well_formed_stands_alone_and_shows_the_best() {
    let hostile = "title = '''</title><script>alert(1)</script>&'''";
    let home = Home::with(&[("title = \"Block over a gap\"", hostile)]);
    let set = ["--set", "design.upper=2 mm,3 mm,4 mm", "--max-evaluations", "3", "--jobs", "2"];
    home.sweep("out", &set).with(1, &[]);
    let page = home.text("out/sweep.html");
    let elements = elements(&page);
    for fragment in ["http://", "https://", "src=", "@import", "url(", "<script>alert"] {
        assert!(!page.contains(fragment), "{fragment}");
    }
    for id in ["comparison", "over-value", "convergence", "files"] {
        assert!(has(&elements, "section", "id", id), "{id}");
    }
    for chart in ["over-value", "convergence"] {
        assert!(has(&elements, "figure", "data-chart", chart), "{chart}");
    }
    // Every drawing has a name for those who do not see it.
    for drawing in elements.iter().filter(|element| element.name == "svg") {
        assert!(drawing.get("aria-label").is_some_and(|label| label.len() > 15), "{drawing:?}");
    }
    assert_eq!(elements.iter().filter(|e| e.name == "tr" && e.get("class") == Some("marked")).count(), 1);
    let curves =
        elements.iter().filter(|e| e.name == "path" && e.get("class").is_some_and(|c| c.starts_with("k k")));
    // One in the figure and one beside its name.
    assert_eq!(curves.count(), 6);
    for run in ["2mm", "3mm", "4mm"] {
        let link = format!("design.upper%3D{run}/report.html");
        assert!(has(&elements, "a", "href", &link), "{link}");
        assert!(home.path(&format!("out/design.upper={run}/report.html")).is_file());
    }
    assert!(page.contains("3 of 3 combinations have ended") && page.contains("design.upper [mm]"));
    // Made again of the same files it is the same.
    home.sweep("out", &[&set[..], &["--compare"]].concat()).with(0, &["sweep.html"]);
    assert_eq!(home.text("out/sweep.html"), page);
}

#[test]
fn values_that_are_no_numbers_have_no_axis() {
    let home = Home::with(&[("max_evaluations = 6", "max_evaluations = 1")]);
    home.sweep("out", &["--set", "optimizer.algorithm=mma,ccsaq"]).with(1, &[]);
    let page = home.text("out/sweep.html");
    assert!(!page.contains("data-chart=\"over-value\"") && page.contains("data-chart=\"convergence\""));
}

#[test]
fn one_that_fails_ends_no_other_and_the_worst_code_counts() {
    let home = Home::new();
    // The surface of the second one does not exist, which shows once the mesh is there.
    let set = ["--set", "design.surface=face,nowhere", "--max-evaluations", "1"];
    let ended = home.sweep("out", &[&set[..], &["--quiet"]].concat()).with(
        3,
        &[
            "design.surface=nowhere: failed with exit code 3, error: there is no surface",
            "out/logs/design.surface=nowhere.log",
        ],
    );
    assert_eq!(ended.count("design.surface=face"), 0, "only errors are told:\n{}", ended.stderr);
    assert_eq!(home.runs("out"), ["design.surface=face"]);
    assert!(home.text("out/logs/design.surface=nowhere.log").contains("nowhere"));
    assert!(home.text("out/sweep.csv").contains("\nnowhere,failed,,"));
    // It has no directory: the page links to what it said.
    let page = home.text("out/sweep.html");
    assert!(page.contains("href=\"logs/design.surface%3Dnowhere.log\""), "{page}");
    assert!(!page.contains("href=\"design.surface%3Dnowhere/"), "{page}");
    assert!(home.text("out/sweep.html").contains("1 of 2 combinations have ended"));
    // A log that cannot be written is a fault of files; what a sweep that was killed left is removed.
    std::fs::create_dir_all(home.path("held/logs/design.upper=2mm.log")).expect("made");
    home.write("held/.fluxmorph-1-sweep.html", "");
    let set = ["--set", "design.upper=2 mm,3 mm", "--max-evaluations", "1"];
    home.sweep("held", &set).with(5, &["design.upper=2mm: not started: cannot write `", "3mm: stopped"]);
    assert!(!home.path("held/.fluxmorph-1-sweep.html").exists());
    // All converge: the lower bound of the change is one that any step keeps.
    let converged = ["--set", "optimizer.ftol_rel=0.9,0.8", "--max-evaluations", "20"];
    home.sweep("converged", &converged).with(0, &[": converged, F/F0"]);
}
