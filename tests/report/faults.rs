//! Directories that there is no report of, and files that are damaged: named, with the exit codes of the documentation.

use std::path::{Path, PathBuf};

use crate::support::device::BLOCK;
use crate::support::folder::read_text;
use crate::support::program::{finish, fluxmorph, folder};
use crate::support::{repository, with_mesh_file};
use crate::{block, report};

fn report_fails(directory: &Path, code: i32, fragments: &[&str]) {
    fluxmorph(&[&"report", &directory]).with(code, fragments);
}

#[test]
fn what_is_no_run_or_analysis_is_refused() {
    let home = folder();
    report_fails(home.path(), 5, &["holds no run of fluxmorph"]);
    report_fails(&home.path().join("none"), 5, &["holds no run of fluxmorph"]);
    let out = home.path().join("morph");
    let config = repository("configs/block_table2.toml");
    fluxmorph(&[&"morph", &config, &"--out", &out, &"--quiet"]);
    report_fails(&out, 3, &["it holds a `morph`", "fluxmorph run"]);
    assert!(!out.join("report.html").exists());
}

#[test]
fn a_page_takes_the_place_of_a_page_alone() {
    let home = folder();
    let out = block("run", home.path(), &[]);
    let (notes, page) = (home.path().join("notes.txt"), home.path().join("page.html"));
    std::fs::write(&notes, "mine").expect("written");
    let journal = out.join("journal.jsonl");
    let whole = std::fs::read(&journal).expect("a journal");
    for other in [&notes, &journal] {
        fluxmorph(&[&"report", &out, &"--out", other]).with(5, &["is no page of fluxmorph", "--out"]);
    }
    assert_eq!(std::fs::read(&journal).expect("it is there"), whole);
    assert_eq!(read_text(&notes), "mine");
    for _ in 0..2 {
        fluxmorph(&[&"report", &out, &"--out", &page]).with(0, &["page.html"]);
    }
    // Without its mark a directory is none of a run, and the file is named that is missing.
    std::fs::remove_file(out.join("manifest.json")).expect("it is there");
    report_fails(&out, 5, &["manifest.json` is missing, the mark of a run", "restore it"]);
}

#[test]
fn a_damaged_file_is_named_and_the_older_page_stays() {
    let home = folder();
    let out = block("run", home.path(), &[]);
    let page = std::fs::read(out.join("report.html")).expect("a page");
    let field = "fields/eval_0000.vtu";
    for name in ["result.json", "journal.jsonl", field, "config.toml", "manifest.json"] {
        let path = out.join(name);
        let whole = std::fs::read(&path).expect("a file");
        let halved = whole[..whole.len() / 2].to_vec();
        let garbled: Vec<u8> =
            whole.iter().enumerate().map(|(i, b)| if i % 7 == 3 { b ^ 0x15 } else { *b }).collect();
        let hollow = b"{}\n".to_vec();
        for damaged in [halved, garbled, hollow] {
            // A journal that ends early is what a crash leaves: it is no damage.
            if name == "journal.jsonl" && whole.starts_with(&damaged) {
                continue;
            }
            std::fs::write(&path, damaged).expect("written");
            let ended = fluxmorph(&[&"report", &out]);
            let expected = if name == "config.toml" { [Some(3), Some(5)] } else { [Some(5); 2] };
            assert!(expected.contains(&ended.code), "{name}: {:?} {}", ended.code, ended.stderr);
            let file = if name == "manifest.json" { "out" } else { name };
            assert!(
                ended.stderr.contains(file) && !ended.stderr.contains("panicked"),
                "{name}: {}",
                ended.stderr
            );
            assert_eq!(std::fs::read(out.join("report.html")).expect("a page"), page, "{name}");
        }
        std::fs::write(&path, whole).expect("written");
    }
    assert_eq!(report(&out).as_bytes(), page);
}

/// The block with its mesh in a file, which the configuration calls `name`: the folder of the configuration.
fn block_from_file(home: &Path, name: &str) -> PathBuf {
    let first = block("solve", home, &[]);
    let folder = home.join("second");
    std::fs::create_dir(&folder).expect("made");
    std::fs::copy(first.join("optimum.msh"), folder.join(name)).expect("copied");
    std::fs::write(folder.join("block.toml"), with_mesh_file(BLOCK, name)).expect("written");
    folder
}

#[test]
fn a_mesh_from_elsewhere_is_shown_where_the_user_allows_it() {
    let home = folder();
    let folder = block_from_file(home.path(), "../device.msh");
    for command in ["run", "solve"] {
        let out = folder.join(command);
        let config = folder.join("block.toml");
        let mut program = crate::support::program::command(&[&command, &config, &"--out", &out, &"--quiet"]);
        finish(&mut program).with(3, &["which leads upwards by `..`", "--allow-outside"]);
        finish(program.arg("--allow-outside")).completed();
        // A run has made its page by itself.
        let own = std::fs::read_to_string(out.join("report.html")).ok();
        assert_eq!(own.is_some(), command == "run");
        report_fails(&out, 3, &["which leads upwards by `..`", "--allow-outside"]);
        fluxmorph(&[&"report", &out, &"--allow-outside"]).with(0, &["report.html"]);
        let page = read_text(&out.join("report.html"));
        assert!(own.is_none_or(|own| own == page), "{command}");
        assert!(page.contains("<svg") && page.contains("data:image/png;base64,"), "{command}: no figures");
        assert!(!page.contains("Not shown"), "{command}");
    }
}

#[test]
fn without_its_mesh_file_a_run_is_still_reported() {
    let home = folder();
    let folder = block_from_file(home.path(), "device.msh");
    let out = folder.join("out");
    fluxmorph(&[&"solve", &folder.join("block.toml"), &"--out", &out, &"--quiet"]).exits_with(0);
    assert!(!report(&out).contains("Not shown"));
    std::fs::remove_file(folder.join("device.msh")).expect("removed");
    let page = report(&out);
    assert!(page.contains("the mesh cannot be rebuilt") && page.contains("device.msh"));
}

#[test]
fn what_is_another_mesh_or_configuration_than_that_of_the_run_is_not_shown_as_its_own() {
    let home = folder();
    let folder = block_from_file(home.path(), "device.msh");
    let out = folder.join("out");
    fluxmorph(&[&"run", &folder.join("block.toml"), &"--out", &out, &"--quiet"]).completed();
    assert!(!report(&out).contains("Not shown"));
    let own = std::fs::read(folder.join("device.msh")).expect("read");
    let third = home.path().join("third");
    std::fs::create_dir(&third).expect("made");
    let other = block("solve", &third, &[("cells = [2, 2, 1]", "cells = [2, 3, 1]")]);
    std::fs::copy(other.join("optimum.msh"), folder.join("device.msh")).expect("copied");
    let page = report(&out);
    assert!(
        page.contains("is another than that of the run: restore the file")
            && page.contains("Not shown: the shape")
    );
    std::fs::write(folder.join("device.msh"), own).expect("written");

    // An analysis on halved edges is of the same file.
    let refined = folder.join("refined");
    let config = folder.join("block.toml");
    fluxmorph(&[&"solve", &config, &"--refine", &"1", &"--out", &refined, &"--quiet"]).exits_with(0);
    let page = report(&refined);
    assert!(page.contains("mesh of the configuration") && page.contains("id=\"surface\""));
    assert!(!page.contains("another than that of the run"));

    // With another title a run may be resumed, with another bound it is another one.
    let (path, text) = (out.join("config.toml"), read_text(&out.join("config.toml")));
    std::fs::write(&path, format!("# a remark\n{text}")).expect("written");
    assert!(!report(&out).contains("Not shown"));
    std::fs::write(&path, text.replace("upper = \"4 mm\"", "upper = \"5 mm\"")).expect("written");
    report_fails(&out, 3, &["its config.toml is another than that of the run", "restore it"]);
}

#[test]
fn a_page_that_cannot_be_written_is_an_error_that_names_it() {
    let home = folder();
    let out = block("run", home.path(), &[]);
    let nowhere = home.path().join("none/report.html");
    fluxmorph(&[&"report", &out, &"--out", &nowhere]).with(5, &["none/report.html"]);
}

#[cfg(unix)]
#[test]
fn a_run_whose_page_cannot_be_written_ends_as_it_would() {
    let home = folder();
    let out =
        block("run", home.path(), &[("verify_refinement = 0", "verify_refinement = 0\nreport = false")]);
    // A folder in the place of the page.
    std::fs::create_dir(out.join("report.html")).expect("made");
    std::fs::write(out.join("report.html/theirs"), "x").expect("written");
    let text = read_text(&out.join("config.toml"));
    std::fs::write(out.join("config.toml"), text.replace("report = false", "report = true"))
        .expect("written");
    let ended = fluxmorph(&[&"resume", &out, &"--max-evaluations", &"7"]);
    ended.with(0, &["the report is not written", "report.html"]);
    assert!(out.join("result.json").is_file());
}
