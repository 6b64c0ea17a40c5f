//! Where a stranger's configuration may read and write, and that nothing in it is executed or expanded.

use std::fs;
use std::path::{Path, PathBuf};

use crate::program::{assert_holds, limited, write};
use crate::support::program::{Finished, folder};
use crate::support::repository_text;

fn quick() -> String {
    repository_text("configs/shield_quick.toml")
}

/// Writes the quick configuration with another directory of results.
fn write_quick(home: &Path, directory: &str) {
    write(home, "device.toml", quick().replace("\"runs/shield_quick\"", &format!("{directory:?}")));
}

fn run(home: &Path, arguments: &[&str]) -> Finished {
    limited(home, None, arguments)
}

fn solve(home: &Path, further: &[&str]) -> Finished {
    run(home, &[&["solve", "device.toml", "--quiet"], further].concat())
}

fn check(home: &Path, further: &[&str]) -> Finished {
    run(home, &[&["check", "device.toml"], further].concat())
}

/// `home/own/device.toml` with its mesh in `home/other/device.msh`; the folder `own`.
fn apart(home: &Path, mesh: &str) -> PathBuf {
    let (own, other) = (home.join("own"), home.join("other"));
    for folder in [&own, &other] {
        fs::create_dir_all(folder).expect("made");
    }
    write(&other, "device.msh", repository_text("crates/geometry/tests/msh_support/sound_v4.msh"));
    let config = repository_text("tests/config/bases/of_file.toml").replace("face", "left|outside");
    write(&own, "device.toml", config.replace("\"device.msh\"", &format!("{mesh:?}")));
    own
}

#[test]
fn a_mesh_outside_needs_the_users_word() {
    let home = folder();
    let absolute = home.path().join("other/device.msh");
    for mesh in ["../other/device.msh", absolute.to_str().expect("UTF-8")] {
        let own = apart(home.path(), mesh);
        for command in ["check", "run", "solve", "morph", "gradient"] {
            let says = ["`mesh.file`", "--allow-outside", "device.toml:2:8"];
            run(&own, &[command, "device.toml"]).refuses(3, &says);
        }
        check(&own, &["--allow-outside"]).succeeds();
        // What the user types is the user's word.
        check(&own, &["--set", &format!("mesh.file={mesh}")]).succeeds();
    }
}

#[cfg(unix)]
#[test]
fn links_that_lead_out_need_the_users_word() {
    use std::os::unix::fs::symlink;
    let home = folder();
    for (mesh, link, target) in
        [("mesh.msh", "mesh.msh", "../other/device.msh"), ("meshes/device.msh", "meshes", "../other")]
    {
        let own = apart(home.path(), mesh);
        symlink(target, own.join(link)).expect("linked");
        check(&own, &[]).refuses(3, &["`mesh.file`", "leads out of the folder", "--allow-outside"]);
        check(&own, &["--allow-outside"]).succeeds();
    }
    // A link that stays inside is a file like any other, and so is a configuration behind a link.
    let own = apart(home.path(), "inner.msh");
    fs::rename(home.path().join("other/device.msh"), own.join("real.msh")).expect("moved");
    symlink("real.msh", own.join("inner.msh")).expect("linked");
    check(&own, &[]).succeeds();
    symlink(&own, home.path().join("way")).expect("linked");
    run(home.path(), &["check", "way/device.toml"]).succeeds();
}

#[test]
fn nothing_is_written_outside_without_the_users_word() {
    let home = folder();
    let own = home.path().join("own");
    fs::create_dir(&own).expect("made");
    let absolute = home.path().join("target");
    for directory in ["../target", absolute.to_str().expect("UTF-8"), "runs/../../target"] {
        write_quick(&own, directory);
        for command in ["run", "solve", "check"] {
            run(&own, &[command, "device.toml"]).refuses(3, &["`output.directory`", "--out"]);
        }
        assert_holds(home.path(), &["own"]);
    }
    solve(&own, &["--out", "../chosen"]).succeeds();
    assert!(home.path().join("chosen/result.json").is_file());
    fs::create_dir(own.join("runs")).expect("made");
    solve(&own, &["--allow-outside"]).succeeds();
    assert!(home.path().join("target/result.json").is_file());
}

#[cfg(unix)]
#[test]
fn links_in_the_way_of_the_output_are_not_followed() {
    use std::os::unix::fs::symlink;
    let home = folder();
    let (own, target, out) = (home.path().join("own"), home.path().join("target"), home.path().join("out"));
    for folder in [&own, &target] {
        fs::create_dir(folder).expect("made");
    }
    // The default `runs` may be a link as well.
    for config in [quick().replace("directory = \"runs/shield_quick\"\n", ""), quick()] {
        write(&own, "device.toml", config);
        symlink("../target", own.join("runs")).expect("linked");
        solve(&own, &[]).refuses(3, &["leads out of the folder", "--out"]);
        fs::remove_file(own.join("runs")).expect("removed");
    }
    assert_holds(&target, &[]);
    // The fields of a run that is replaced lie in its own folder, and in no other.
    solve(&own, &["--out", "../out"]).succeeds();
    fs::remove_dir_all(out.join("fields")).expect("removed");
    symlink("../target", out.join("fields")).expect("linked");
    let before = fs::read(out.join("result.json")).expect("a result");
    solve(&own, &["--out", "../out", "--force"]).refuses(5, &["fields", "is a link"]);
    assert_holds(&target, &[]);
    assert_eq!(fs::read(out.join("result.json")).expect("a result"), before, "nothing was removed either");
    // Nor are those of a folder that holds nothing else.
    fs::remove_dir_all(&out).expect("removed");
    fs::create_dir(&out).expect("made");
    symlink("../target", out.join("fields")).expect("linked");
    solve(&own, &["--out", "../out"]).refuses(5, &["is a link"]);
    assert_holds(&target, &[]);
}

#[test]
fn a_foreign_folder_is_not_taken_by_a_mark_that_is_none() {
    let home = folder();
    let out = home.path().join("out");
    fs::create_dir(&out).expect("made");
    write(home.path(), "device.toml", quick());
    write(&out, "thesis.txt", "years of work");
    let force = || solve(home.path(), &["--out", "out", "--force"]);
    for further in [&[][..], &["--force"]] {
        solve(home.path(), &[&["--out", "out"], further].concat())
            .refuses(5, &["is not empty and holds no run of fluxmorph"]);
        assert_holds(&out, &["thesis.txt"]);
    }
    let marks = [
        String::new(),
        "{}".into(),
        "[]".into(),
        "null".into(),
        "{\"program\": \"other\"}".into(),
        "{\"program\": 5}".into(),
        "{\"program\": \"fluxmorph\"".into(),
        format!("{}1{}", "[".repeat(100_000), "]".repeat(100_000)),
        " ".repeat(2 << 20),
    ];
    for mark in marks {
        write(&out, "manifest.json", &mark);
        force().refuses(5, &["holds no run of fluxmorph", "--out"]);
        assert_holds(&out, &["manifest.json", "thesis.txt"]);
    }
    #[cfg(unix)]
    {
        fs::remove_file(out.join("manifest.json")).expect("removed");
        let made = std::process::Command::new("mkfifo").arg(out.join("manifest.json")).status();
        assert!(made.expect("mkfifo of every Unix").success());
        force().refuses(5, &["holds no run of fluxmorph"]);
    }
    assert_eq!(fs::read_to_string(out.join("thesis.txt")).expect("it stays"), "years of work");
}

#[test]
fn texts_are_neither_executed_nor_expanded() {
    let texts = [
        "~/out",
        "$HOME/out",
        "${HOME}",
        "`touch x`",
        "$(touch x)",
        "*",
        "%TEMP%",
        "; touch x #",
        "| touch x",
    ];
    for text in texts {
        let home = folder();
        write_quick(home.path(), text);
        let config = fs::read_to_string(home.path().join("device.toml")).expect("written");
        let title = "title = \"Shield plate, coarse and quick\"";
        write(home.path(), "device.toml", config.replace(title, &format!("title = {text:?}")));
        solve(home.path(), &[]).succeeds();
        assert!(home.path().join(text).join("result.json").is_file(), "{text}");
        let mut names = [text.split('/').next().expect("a part"), "device.toml"];
        names.sort_unstable();
        assert_holds(home.path(), &names);
        // The same as a mesh: a file of that name, which there is none of.
        let mesh = crate::support::repository_text("tests/config/bases/of_file.toml")
            .replace("\"device.msh\"", &format!("{:?}", format!("{text}.msh")));
        write(home.path(), "device.toml", mesh);
        check(home.path(), &[]).refuses(3, &["there is no file", &format!("{text}.msh")]);
        assert_holds(home.path(), &names);
    }
}
