//! Hostile configurations: every one is refused at its line, whatever it asks for.

use std::fs;
use std::path::{Path, PathBuf};

use crate::changes::{Base, TABLES};
use crate::limited::{BESIDE, baseline, check, limited, objection};

use Base::{Block, Pole, Quick, Sphere};

fn written(folder: &Path, bytes: &[u8]) -> PathBuf {
    let config = folder.join("device.toml");
    fs::write(&config, bytes).expect("written");
    config
}

/// What no configuration may take beside the program itself [bytes]: they have 1 MiB at most.
fn limit() -> Option<u64> {
    Some(baseline() + 4 * BESIDE)
}

#[test]
fn every_hostile_configuration_is_refused_at_its_key() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let mut wrong = Vec::new();
    for base in [Quick, Sphere, Pole, Block] {
        let config = written(folder.path(), base.text().as_bytes());
        assert_eq!(limited(None, &check(&config)).code, Some(0), "{base:?}");
    }
    for &(base, from, to, says) in TABLES.into_iter().flatten() {
        let text = base.text();
        assert!(text.contains(from), "{base:?} has no `{from}`");
        let config = written(folder.path(), text.replacen(from, to, 1).as_bytes());
        let ended = limited(limit(), &check(&config));
        if let Some(objection) = objection(&ended, &[3], &[&["device.toml:"], says].concat()) {
            wrong.push(format!("{base:?}, {from:?} to {to:?}: {objection}"));
        }
    }
    let count: usize = TABLES.iter().map(|table| table.len()).sum();
    println!("{count} configurations");
    assert!(count >= 120, "{count}");
    assert!(wrong.is_empty(), "{} of {count}:\n{}", wrong.len(), wrong.join("\n\n"));
    crate::limited::assert_holds(folder.path(), &["device.toml"]);
}

#[test]
fn what_is_no_text_or_too_long_is_refused() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let quick = Quick.text();
    let many = |count: usize, text: fn(usize) -> String| (0..count).map(text).collect::<String>();
    let mebibyte = 1 << 20;
    let with = |from: &str, to: &str| quick.replacen(from, to, 1).into_bytes();
    let cases: Vec<(&str, Vec<u8>, &[&str])> = vec![
        (
            "one byte too long",
            [quick.as_bytes(), &vec![b'#'; mebibyte + 1 - quick.len()]].concat(),
            &["larger than 1048576 bytes"],
        ),
        ("far too long", vec![b'\n'; 20 * mebibyte], &["larger than 1048576 bytes"]),
        ("empty", Vec::new(), &["missing key `mesh`"]),
        ("zeros", vec![0; 4096], &["not valid TOML"]),
        ("a zero", [quick.as_bytes(), b"\0"].concat(), &["not valid TOML"]),
        (
            "Latin 1",
            with("title = \"", "title = \"").iter().map(|&b| if b == b'S' { 0xe9 } else { b }).collect(),
            &["not UTF-8 text at byte"],
        ),
        (
            "UTF-16",
            [&b"\xff\xfe"[..], &quick.bytes().flat_map(|b| [b, 0]).collect::<Vec<_>>()].concat(),
            &["not UTF-8 text at byte 0"],
        ),
        ("overlong UTF-8", [quick.as_bytes(), b"# \xc0\xaf"].concat(), &["not UTF-8 text at byte"]),
        ("lone surrogate", [quick.as_bytes(), b"# \xed\xa0\x80"].concat(), &["not UTF-8 text at byte"]),
        ("mark in the middle", [b"[mesh]\n\xef\xbb\xbf", quick.as_bytes()].concat(), &["not valid TOML"]),
        ("carriage return alone", with("[mesh]\n", "[mesh]\r"), &["not valid TOML"]),
        ("deep lists", [b"a = ".to_vec(), vec![b'['; mebibyte - 4]].concat(), &["recursion"]),
        (
            "deep closed lists",
            [b"a = ".to_vec(), vec![b'['; 200_000], vec![b']'; 200_000]].concat(),
            &["recursion"],
        ),
        ("deep tables", ["a = ".to_owned(), "{a=".repeat(300_000)].concat().into_bytes(), &["recursion"]),
        ("deep keys", ["a.".repeat(500_000), "a = 1".to_owned()].concat().into_bytes(), &["recursion"]),
        (
            "deep headers",
            ["[".to_owned(), "a.".repeat(500_000), "a]".to_owned()].concat().into_bytes(),
            &["recursion"],
        ),
        (
            "deep enough to be read",
            with("generator = \"shield\"", "generator = [[[[[[[[[[[[[[[[[[[[]]]]]]]]]]]]]]]]]]]]"),
            &["`mesh.generator` is a list"],
        ),
        (
            "endless text",
            ["title = \"", &"x".repeat(mebibyte - 20), "\""].concat().into_bytes(),
            &["missing key `mesh`"],
        ),
        (
            "endless word",
            with("\"mma\"", &format!("\"{}\"", "x".repeat(1_000_000))),
            &["`optimizer.algorithm` cannot be `xxx"],
        ),
        (
            "endless key",
            with("[optimizer]\n", &format!("[optimizer]\n{} = 1\n", "x".repeat(1_000_000))),
            &["names of more than 512 bytes"],
        ),
        (
            "endless name",
            with("region = \"observation\"", &format!("region = \"{}\"", "x".repeat(1_000_000))),
            &["there is no region `xxx"],
        ),
        ("endless number", with("0.5", &"5".repeat(1_000_000)), &["`mesh.shield.refinement`"]),
        (
            "endless quantity",
            with("60 Hz", &format!("{} Hz", "6".repeat(1_000_000))),
            &["`analysis.frequency`"],
        ),
        ("endless unit", with("60 Hz", &format!("60 {}", "H".repeat(1_000_000))), &["`analysis.frequency`"]),
        (
            "many unknown keys",
            [many(100_000, |i| format!("k{i}=1\n")).as_bytes(), quick.as_bytes()].concat(),
            &["unknown key `k0`", "not shown"],
        ),
        (
            "many unknown names",
            with("\"z_max\"]", &format!("\"z_max\"{}]", many(90_000, |i| format!(",\"s{i}\"")))),
            &["there is no surface `s0`", "not shown"],
        ),
        (
            "longest list",
            with("\"z_max\"]", &format!("\"z_max\"{}]", ",1".repeat(100_000))),
            &["`boundaries.flux_parallel` has 100006 items"],
        ),
        (
            "many coils",
            [quick.as_bytes(), many(40_000, |i| format!("[[coils]]\nname=\"c{i}\"\n")).as_bytes()].concat(),
            &["missing key `shape` in `coils[1]`"],
        ),
        (
            "many materials",
            [quick.as_bytes(), many(30_000, |i| format!("[materials.m{i}]\n_=1\n")).as_bytes()].concat(),
            &["unknown key `_`"],
        ),
        (
            "many tables",
            [quick.as_bytes(), many(70_000, |i| format!("[t{i}]\n")).as_bytes()].concat(),
            &["unknown key `t0`"],
        ),
        ("many faults of syntax", "= =\n".repeat(200_000).into_bytes(), &["not valid TOML", "not shown"]),
        (
            "many cases",
            [Block.text().as_bytes(), many(30_000, |i| format!("[[morph.case]]\nname=\"{i}\"\n")).as_bytes()]
                .concat(),
            &["cases repeat a configuration of", "at most"],
        ),
    ];
    let mut wrong = Vec::new();
    for (name, bytes, says) in &cases {
        let config = written(folder.path(), bytes);
        let ended = limited(limit(), &check(&config));
        if let Some(objection) = objection(&ended, &[3], &[&["device.toml"], *says].concat()) {
            wrong.push(format!("{name}: {objection}"));
        }
    }
    println!("{} configurations", cases.len());
    assert!(wrong.is_empty(), "{}", wrong.join("\n\n"));
}

#[test]
fn overrides_have_limits_too() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let config = written(folder.path(), Quick.text().as_bytes());
    let one = format!("title=\"{}\"", "x".repeat(110_000));
    let mut arguments = check(&config).to_vec();
    for _ in 0..10 {
        arguments.extend([std::ffi::OsStr::new("--set"), one.as_ref()]);
    }
    let ended = limited(limit(), &arguments);
    assert_eq!(objection(&ended, &[3], &["the overrides are longer than 1048576 bytes"]), None);
    for (set, says) in [
        ("title=\u{1b}[31m", "control character"),
        ("mesh=5", "`mesh` is the whole number 5"),
        ("a.b.c.d=5", "unknown key `a`"),
        ("analysis.frequency=nan", "`analysis.frequency` is NaN"),
        ("coils[9999999999999999999999].width=1", "coils"),
        ("coils[-1].width=1", "coils"),
        ("mesh.block.cells=[1000000000,1,1]", "mesh.block.cells"),
    ] {
        let ended = limited(limit(), &[&check(&config)[..], &["--set".as_ref(), set.as_ref()]].concat());
        assert_eq!(objection(&ended, &[3], &[says]), None, "{set}");
    }
    let deep = format!("{}=1", vec!["a"; 50_000].join("."));
    let ended = limited(limit(), &[&check(&config)[..], &["--set".as_ref(), deep.as_ref()]].concat());
    assert_eq!(objection(&ended, &[3], &["recursion"]), None);
}

#[cfg(unix)]
#[test]
fn what_is_no_regular_file_is_not_waited_for() {
    use std::os::unix::fs::symlink;
    let folder = tempfile::tempdir().expect("a temporary folder");
    let at = |name: &str| folder.path().join(name);
    let pipe = at("pipe");
    let made = std::process::Command::new("mkfifo").arg(&pipe).status().expect("mkfifo of every Unix");
    assert!(made.success());
    fs::create_dir(at("folder.toml")).expect("made");
    symlink(at("round"), at("round")).expect("linked");
    symlink("nothing", at("dead")).expect("linked");
    symlink("pipe", at("to_pipe")).expect("linked");
    let _socket = std::os::unix::net::UnixListener::bind(at("socket")).expect("a socket");
    let names = ["pipe", "to_pipe", "socket", "folder.toml", "round", "dead", "none.toml"].map(at);
    for path in names.iter().map(PathBuf::as_path).chain(["/dev/zero", "/dev/null", "/"].map(Path::new)) {
        let ended = limited(limit(), &check(path));
        let says = ["cannot read the configuration", path.to_str().expect("UTF-8")];
        assert_eq!(objection(&ended, &[5], &says), None, "{}", path.display());
    }
    // The same as a mesh; links that lead out or nowhere are refused before.
    for (mesh, code, says) in [
        ("pipe", 5, "a pipe"),
        ("to_pipe", 5, "a pipe"),
        ("socket", 5, "a socket"),
        ("folder.toml", 5, "a folder"),
        ("none.msh", 5, "cannot read"),
        ("round", 3, "leads nowhere"),
        ("dead", 3, "leads nowhere"),
    ] {
        let text = format!("[mesh]\nfile = \"{mesh}\"\nunit = \"m\"\n[analysis]\nfrequency = 0\n");
        let config = written(folder.path(), text.as_bytes());
        assert_eq!(objection(&limited(limit(), &check(&config)), &[code], &[mesh, says]), None, "{mesh}");
    }
    // And as a design.
    let config = written(folder.path(), Quick.text().as_bytes());
    let arguments = ["solve".as_ref(), config.as_os_str(), "--design".as_ref(), pipe.as_os_str()];
    assert_eq!(objection(&limited(None, &arguments), &[5], &["cannot read the design", "a pipe"]), None);
}
