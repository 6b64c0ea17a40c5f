//! What is run, under which names, and what is refused before anything is.

use std::process::Command;

use super::home::Home;
use crate::support::device::BLOCK;
use crate::support::essence::assert_same;
use crate::support::folder::list;
use crate::support::program::finish;

#[test]
fn every_combination_has_a_run_of_its_own_that_is_what_its_command_makes() {
    let home = Home::new();
    let set = ["--set", "design.upper=2 mm,\"4 mm\"", "--set", "optimizer.algorithm=mma,ccsaq"];
    let fixed = ["--set", "optimizer.max_evaluations=3", "--jobs", "2"];
    let sweep = home.sweep("out", &[&set[..], &fixed].concat()).with(1, &[]);
    let names = [
        "design.upper=2mm,optimizer.algorithm=ccsaq",
        "design.upper=2mm,optimizer.algorithm=mma",
        "design.upper=4mm,optimizer.algorithm=ccsaq",
        "design.upper=4mm,optimizer.algorithm=mma",
    ];
    assert_eq!(home.runs("out"), names);
    assert_eq!((sweep.count(": begun"), sweep.count(", F/F0 0.")), (4, 4), "{}", sweep.stderr);

    let description = home.json("out/sweep.json");
    assert_eq!(description["program"], "fluxmorph");
    assert_eq!(description["version"], env!("CARGO_PKG_VERSION"));
    let combinations = list(&description, "/combinations");
    // The first key slowest.
    let order: Vec<&str> = combinations.iter().filter_map(|c| c["directory"].as_str()).collect();
    assert_eq!(order, [names[1], names[0], names[3], names[2]]);
    assert_eq!(combinations[2]["values"]["design.upper"], "\"4 mm\"");

    // The command that stands there, elsewhere, makes the same.
    let command = combinations[3]["command"].as_str().expect("a command").replace("out/", "alone/");
    let program = format!("'{}'", env!("CARGO_BIN_EXE_fluxmorph"));
    let command = command.replacen("fluxmorph", &program, 1);
    finish(Command::new("sh").args(["-c", &command]).current_dir(home.path(""))).exits_with(1);
    let (own, alone) = (format!("out/{}", names[2]), format!("alone/{}", names[2]));
    assert_same(&home.essence(&own), &home.essence(&alone), "by hand");
}

#[test]
fn a_comma_in_brackets_separates_no_values_and_the_directory_has_a_default() {
    let home = Home::with(&[
        ("max_evaluations = 6", "max_evaluations = 1"),
        ("[output]", "[output]\nreport = false"),
    ]);
    let values = "probes=[{ name = \"a\", points = [[1e-3, 1e-3, 5e-3]] }],[{ name = \"b, c\", points = [[2e-3, 2e-3, 5e-3]] }]";
    home.fluxmorph(&["sweep", "block.toml", "--set", values, "--quiet"]).exits_with(1);
    let runs = home.runs("runs/block_sweep");
    assert_eq!(runs.len(), 2);
    for (run, probe) in runs.iter().zip(["a", "b, c"]) {
        assert!(
            run.starts_with("probes=name_")
                && run.chars().all(|c| c.is_alphanumeric() || "=._-+,".contains(c)),
            "{run}"
        );
        let result = home.json(&format!("runs/block_sweep/{run}/result.json"));
        assert_eq!(result["probes"][0]["name"], probe);
    }
}

#[test]
fn all_faults_are_told_before_anything_runs() {
    let home = Home::new();
    let set = ["--set", "design.upper=2 mm,3 volts", "--set", "optimizer.algorithm=mma,mmma"];
    let refused = home.sweep("out", &set).with(
        3,
        &[
            "combination `design.upper=2mm,optimizer.algorithm=mmma`:",
            "--> --set 'optimizer.algorithm=mmma':1:",
            "did you mean `mma`?",
            "combination `design.upper=3volts,optimizer.algorithm=mma`:",
            "is not a unit of length",
            "3 of 4 combinations cannot be read, and nothing was run",
        ],
    );
    // The last combination has both faults, and they have been reported.
    assert_eq!((refused.count("combination `"), home.path("out").exists()), (2, false), "{}", refused.stderr);
    // A fault of the configuration itself stands once, however many combinations have it.
    let broken = Home::with(&[("frequency = \"50 Hz\"", "freqency = \"50 Hz\"")]);
    let told =
        broken.sweep("out", &["--set", "design.upper=1 mm,2 mm,3 mm"]).with(3, &["3 of 3 combinations"]);
    assert_eq!(told.count("--> block.toml"), 1, "{}", told.stderr);
}

#[test]
fn a_mesh_file_that_is_missing_is_reported_before_anything_runs() {
    let home = Home::new();
    let device = &BLOCK[BLOCK.find("[analysis]").expect("an analysis")..];
    home.write("read.toml", &format!("[mesh]\nfile = \"here.msh\"\nunit = \"mm\"\n{device}"));
    home.write("here.msh", "");
    let files = "mesh.file=here.msh,gone.msh";
    home.fluxmorph(&["sweep", "read.toml", "--out", "out", "--set", files]).with(
        3,
        &[
            "combination `mesh.file=gone.msh`:",
            "cannot open the mesh `",
            "1 of 2 combinations cannot be read",
        ],
    );
    assert!(!home.path("out").exists());
}

#[test]
fn what_is_no_sweep_is_refused_with_the_reason() {
    let home = Home::new();
    let numbers: Vec<String> = (0..102).map(|n| format!("{}e-4", 1 + n)).collect();
    let many = format!("={}", numbers.join(","));
    let [upper, lower] = ["design.upper", "optimizer.ftol_rel"].map(|key| format!("{key}{many}"));
    let cases: [(&[&str], i32, &str); 8] = [
        (&["design.upper=1 mm,,2 mm"], 2, "the value number 2 is empty"),
        (&["design.upper=1 mm,2 mm", "design.upper=3 mm"], 2, "is given twice"),
        (&["design.upper=1 mm,1 mm"], 2, "are the same configuration"),
        (
            &["design.upper=2 mm,0.2 cm"],
            2,
            "`design.upper=2mm` and `design.upper=0.2cm` are the same configuration",
        ),
        (&["output.directory=a,b"], 2, "with --out"),
        (&[&upper, &lower], 2, "10404 combinations: expected at most 10000"),
        (&["design=1,2"], 3, "2 of 2 combinations"),
        (&["upper"], 2, "must be KEY=VALUE"),
    ];
    for (set, code, reason) in cases {
        let arguments: Vec<&str> = set.iter().flat_map(|item| ["--set", item]).collect();
        home.sweep("out", &arguments).with(code, &[reason]);
    }
    assert!(!home.path("out").exists());
    home.fluxmorph(&["sweep", "none.toml", "--set", "a=1,2"])
        .with(5, &["cannot read the configuration `none.toml`"]);
}

#[cfg(target_os = "linux")]
#[test]
fn a_folder_whose_name_is_no_text_is_refused_before_anything_is_written() {
    use std::os::unix::ffi::OsStrExt;
    let home = Home::new();
    let odd = home.path("").join(std::ffi::OsStr::from_bytes(b"latin-1 \xe4"));
    let sweep = ["sweep", "block.toml", "--set", "design.upper=2 mm,3 mm"];
    finish(home.command(&sweep).arg("--out").arg(&odd)).with(5, &["is no UTF-8 text", "rename the folder"]);
    assert!(!odd.exists());
    std::fs::create_dir(&odd).expect("made");
    std::fs::copy(home.path("block.toml"), odd.join("block.toml")).expect("copied");
    for command in ["run", "solve"] {
        finish(home.command(&[command, "block.toml", "--out", "out"]).current_dir(&odd))
            .with(5, &["is no UTF-8 text", "rename the folder"]);
    }
    finish(home.command(&sweep[..2]).current_dir(&odd)).with(5, &["no UTF-8 text"]);
    assert_eq!(std::fs::read_dir(&odd).expect("a folder").count(), 1);
}

#[test]
fn a_folder_of_others_is_left_alone() {
    let home = Home::new();
    std::fs::create_dir(home.path("theirs")).expect("made");
    home.write("theirs/letter.txt", "x");
    let set = ["--set", "design.upper=2 mm,4 mm", "--max-evaluations", "1"];
    home.sweep("theirs", &set).with(5, &["holds no sweep", "nothing in it was touched"]);
    home.sweep("theirs", &[&set[..], &["--force"]].concat()).with(5, &["holds no sweep"]);
    home.sweep("block.toml", &set).with(5, &["is a file"]);
    assert_eq!(std::fs::read_dir(home.path("theirs")).expect("a folder").count(), 1);
}
