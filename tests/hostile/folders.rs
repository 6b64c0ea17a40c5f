//! Where a stranger's configuration may read and write, and that nothing in it is executed or expanded.

use std::ffi::OsStr;
use std::fs;
use std::path::Path;

use crate::limited::{assert_holds, check, limited, objection};
use crate::meshes::{device, written};
use crate::msh_support::{Form, Version};

fn quick() -> String {
    fs::read_to_string(Path::new(env!("CARGO_MANIFEST_DIR")).join("configs/shield_quick.toml"))
        .expect("shipped")
}

fn solve(config: &Path, further: &[&OsStr]) -> crate::limited::Ended {
    limited(None, &[&["solve".as_ref(), config.as_os_str(), "--quiet".as_ref()], further].concat())
}

/// `home/own/device.toml` with its mesh in `home/other/device.msh`.
fn apart(home: &Path, mesh: &str) -> std::path::PathBuf {
    for folder in ["own", "other"] {
        fs::create_dir_all(home.join(folder)).expect("made");
    }
    let config = written(&home.join("own"), &device().bytes(Version::V4, Form::Ascii));
    fs::rename(home.join("own/device.msh"), home.join("other/device.msh")).expect("moved");
    let text = fs::read_to_string(&config).expect("written");
    fs::write(&config, text.replace("\"device.msh\"", &format!("{mesh:?}"))).expect("written");
    config
}

#[test]
fn a_mesh_outside_needs_the_users_word() {
    let home = tempfile::tempdir().expect("a temporary folder");
    let absolute = home.path().join("other/device.msh");
    let allow: &OsStr = "--allow-outside".as_ref();
    for mesh in ["../other/device.msh", absolute.to_str().expect("UTF-8")] {
        let config = apart(home.path(), mesh);
        for command in ["check", "run", "solve", "morph", "gradient"] {
            let ended = limited(None, &[command.as_ref(), config.as_os_str()]);
            assert_eq!(objection(&ended, &[3], &["`mesh.file`", "--allow-outside", "device.toml:2:8"]), None);
        }
        assert_eq!(limited(None, &[&check(&config)[..], &[allow]].concat()).code, Some(0), "{mesh}");
        // What the user types is the user's word.
        let set = format!("mesh.file={mesh}");
        let typed = limited(None, &[&check(&config)[..], &["--set".as_ref(), set.as_ref()]].concat());
        assert_eq!(typed.code, Some(0), "{mesh}: {}", typed.stderr);
    }
}

#[cfg(unix)]
#[test]
fn links_that_lead_out_need_the_users_word() {
    use std::os::unix::fs::symlink;
    let home = tempfile::tempdir().expect("a temporary folder");
    let allow: &OsStr = "--allow-outside".as_ref();
    for (mesh, link, target) in
        [("mesh.msh", "mesh.msh", "../other/device.msh"), ("meshes/device.msh", "meshes", "../other")]
    {
        let config = apart(home.path(), mesh);
        symlink(target, home.path().join("own").join(link)).expect("linked");
        let ended = limited(None, &check(&config));
        assert_eq!(
            objection(&ended, &[3], &["`mesh.file`", "leads out of the folder", "--allow-outside"]),
            None
        );
        assert_eq!(limited(None, &[&check(&config)[..], &[allow]].concat()).code, Some(0), "{mesh}");
    }
    // A link that stays inside is a file like any other, and so is a configuration behind a link.
    let config = apart(home.path(), "inner.msh");
    fs::rename(home.path().join("other/device.msh"), home.path().join("own/real.msh")).expect("moved");
    symlink("real.msh", home.path().join("own/inner.msh")).expect("linked");
    assert_eq!(limited(None, &check(&config)).code, Some(0));
    symlink(home.path().join("own"), home.path().join("way")).expect("linked");
    assert_eq!(limited(None, &check(&home.path().join("way/device.toml"))).code, Some(0));
}

#[test]
fn nothing_is_written_outside_without_the_users_word() {
    let home = tempfile::tempdir().expect("a temporary folder");
    let own = home.path().join("own");
    fs::create_dir(&own).expect("made");
    let config = own.join("device.toml");
    let absolute = home.path().join("target");
    for directory in ["../target", absolute.to_str().expect("UTF-8"), "runs/../../target"] {
        let text = quick().replace("\"runs/shield_quick\"", &format!("{directory:?}"));
        fs::write(&config, text).expect("written");
        for command in ["run", "solve", "check"] {
            let ended = limited(None, &[command.as_ref(), config.as_os_str()]);
            assert_eq!(objection(&ended, &[3], &["`output.directory`", "--out"]), None, "{directory}");
        }
        assert_holds(home.path(), &["own"]);
    }
    let out = home.path().join("chosen");
    assert_eq!(solve(&config, &["--out".as_ref(), out.as_os_str()]).code, Some(0));
    assert!(out.join("result.json").is_file());
    fs::create_dir(own.join("runs")).expect("made");
    assert_eq!(solve(&config, &["--allow-outside".as_ref()]).code, Some(0));
    assert!(home.path().join("target/result.json").is_file());
}

#[cfg(unix)]
#[test]
fn links_in_the_way_of_the_output_are_not_followed() {
    use std::os::unix::fs::symlink;
    let home = tempfile::tempdir().expect("a temporary folder");
    let (own, target) = (home.path().join("own"), home.path().join("target"));
    for folder in [&own, &target] {
        fs::create_dir(folder).expect("made");
    }
    let config = own.join("device.toml");
    fs::write(&config, quick()).expect("written");
    // The default `runs` may be a link as well.
    for text in [quick(), quick().replace("directory = \"runs/shield_quick\"\n", "")] {
        fs::write(&config, text).expect("written");
        symlink("../target", own.join("runs")).expect("linked");
        assert_eq!(objection(&solve(&config, &[]), &[3], &["leads out of the folder", "--out"]), None);
        fs::remove_file(own.join("runs")).expect("removed");
    }
    assert_holds(&target, &[]);
    // The fields of a run that is replaced lie in its own folder, and in no other.
    let out = home.path().join("out");
    let to_out = ["--out".as_ref(), out.as_os_str()];
    assert_eq!(solve(&config, &to_out).code, Some(0));
    fs::remove_dir_all(out.join("fields")).expect("removed");
    symlink("../target", out.join("fields")).expect("linked");
    let before = fs::read(out.join("result.json")).expect("a result");
    let ended = solve(&config, &[&to_out[..], &["--force".as_ref()]].concat());
    assert_eq!(objection(&ended, &[5], &["fields", "is a link"]), None);
    assert_holds(&target, &[]);
    assert_eq!(fs::read(out.join("result.json")).expect("a result"), before, "nothing was removed either");
    // Nor are those of a folder that holds nothing else.
    fs::remove_dir_all(&out).expect("removed");
    fs::create_dir(&out).expect("made");
    symlink("../target", out.join("fields")).expect("linked");
    assert_eq!(objection(&solve(&config, &to_out), &[5], &["is a link"]), None);
    assert_holds(&target, &[]);
}

#[test]
fn a_foreign_folder_is_not_taken_by_a_mark_that_is_none() {
    let home = tempfile::tempdir().expect("a temporary folder");
    let out = home.path().join("out");
    fs::create_dir(&out).expect("made");
    let config = home.path().join("device.toml");
    fs::write(&config, quick()).expect("written");
    fs::write(out.join("thesis.txt"), "years of work").expect("written");
    let force = ["--out".as_ref(), out.as_os_str(), "--force".as_ref()];
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
        fs::write(out.join("manifest.json"), &mark).expect("written");
        let ended = solve(&config, &force);
        assert_eq!(objection(&ended, &[5], &["holds no run of fluxmorph", "--out"]), None);
        assert_holds(&out, &["manifest.json", "thesis.txt"]);
    }
    #[cfg(unix)]
    {
        fs::remove_file(out.join("manifest.json")).expect("removed");
        let made = std::process::Command::new("mkfifo").arg(out.join("manifest.json")).status();
        assert!(made.expect("mkfifo of every Unix").success());
        assert_eq!(objection(&solve(&config, &force), &[5], &["holds no run of fluxmorph"]), None);
    }
    assert_eq!(fs::read_to_string(out.join("thesis.txt")).expect("it stays"), "years of work");
}

#[test]
fn texts_are_neither_executed_nor_expanded() {
    let home = tempfile::tempdir().expect("a temporary folder");
    for (k, text) in [
        "~/out",
        "$HOME/out",
        "${HOME}",
        "`touch x`",
        "$(touch x)",
        "*",
        "%TEMP%",
        "; touch x #",
        "| touch x",
    ]
    .into_iter()
    .enumerate()
    {
        let folder = home.path().join(k.to_string());
        fs::create_dir(&folder).expect("made");
        let config = folder.join("device.toml");
        let with = quick()
            .replace("\"runs/shield_quick\"", &format!("{text:?}"))
            .replace("title = \"Shield plate, coarse and quick\"", &format!("title = {text:?}"));
        fs::write(&config, with).expect("written");
        let ended = solve(&config, &[]);
        assert_eq!(ended.code, Some(0), "{text}: {}", ended.stderr);
        assert!(folder.join(text).join("result.json").is_file(), "{text}");
        let first = text.split('/').next().expect("a part");
        let mut names = [first, "device.toml"];
        names.sort_unstable();
        assert_holds(&folder, &names);
        // The same as a mesh: a file of that name, which there is none of.
        let mesh = quick()
            .replace("generator = \"shield\"", &format!("file = {:?}\nunit = \"m\"", format!("{text}.msh")));
        let (before, after) = mesh.split_once("[mesh.shield]").expect("parameters");
        let (_, after) = after.split_once("[analysis]").expect("the next table");
        fs::write(&config, format!("{before}[analysis]{after}")).expect("written");
        let ended = limited(None, &check(&config));
        assert_eq!(objection(&ended, &[5], &["cannot read", &format!("{text}.msh")]), None, "{text}");
        assert_holds(&folder, &names);
    }
}
