//! What is too long, too deep, too large for the memory, or no file at all: refused at once, and never with an abort.
//!
//! Every command runs with a limit on its memory, so that a file that asks for more than it is worth ends in an abort and
//! not in an exit code.

use std::ffi::OsStr;
use std::fs;
use std::path::Path;

use crate::program::{BESIDE, assert_holds, baseline, check, limited, write};
use crate::support::program::{Finished, folder};
use crate::support::repository_text;

/// Largest configuration, and longest list of overrides, that is read [bytes].
const LARGEST: usize = 1 << 20;

/// Room for the program and a small set-up, and not for six million tetrahedra [bytes].
const LITTLE: u64 = 32 << 20;

/// Between what the set-up of the sphere takes (145 MiB) and what its solution is estimated at (362 MiB) [bytes].
const BETWEEN: u64 = 200 << 20;

fn quick() -> String {
    repository_text("configs/shield_quick.toml")
}

/// The quick configuration with one change.
fn with(from: &str, to: &str) -> Vec<u8> {
    quick().replacen(from, to, 1).into_bytes()
}

fn many(count: usize, text: fn(usize) -> String) -> String {
    (0..count).map(text).collect()
}

/// Asserts that each content of a configuration is refused with its words.
#[track_caller]
fn are_refused(cases: &[(&str, Vec<u8>, &[&str])]) {
    let home = folder();
    let objection = |(name, bytes, says): &(&str, Vec<u8>, &[&str])| {
        write(home.path(), "device.toml", bytes);
        let objection = check(home.path(), &[]).objection(3, &[&["device.toml"], *says].concat());
        objection.map(|objection| format!("{name}: {objection}"))
    };
    let wrong: Vec<String> = cases.iter().filter_map(objection).collect();
    assert!(wrong.is_empty(), "{}", wrong.join("\n\n"));
    assert_holds(home.path(), &["device.toml"]);
}

#[test]
fn what_is_no_text_is_refused() {
    let quick = quick();
    let behind = |bytes: &[u8]| [quick.as_bytes(), bytes].concat();
    are_refused(&[
        ("empty", Vec::new(), &["missing key `mesh`", "missing key `analysis`"]),
        ("zeros", vec![0; 4096], &["not valid TOML"]),
        ("a zero", behind(b"\0"), &["not valid TOML"]),
        ("Latin 1", [b"title = \"\xe9\"\n", quick.as_bytes()].concat(), &["not UTF-8 text at byte 9"]),
        (
            "UTF-16",
            [&b"\xff\xfe"[..], &quick.bytes().flat_map(|b| [b, 0]).collect::<Vec<_>>()].concat(),
            &["not UTF-8 text at byte 0"],
        ),
        ("overlong UTF-8", behind(b"# \xc0\xaf"), &["not UTF-8 text at byte"]),
        ("lone surrogate", behind(b"# \xed\xa0\x80"), &["not UTF-8 text at byte"]),
        ("mark in the middle", [b"[mesh]\n\xef\xbb\xbf", quick.as_bytes()].concat(), &["not valid TOML"]),
        ("carriage return alone", with("[mesh]\n", "[mesh]\r"), &["not valid TOML"]),
    ]);
}

#[test]
fn what_is_too_deep_is_refused() {
    let bytes = |parts: &[&str]| parts.concat().into_bytes();
    are_refused(&[
        ("deep lists", bytes(&["a = ", &"[".repeat(LARGEST - 4)]), &["recursion"]),
        ("closed lists", bytes(&["a = ", &"[".repeat(200_000), &"]".repeat(200_000)]), &["recursion"]),
        ("deep tables", bytes(&["a = ", &"{a=".repeat(300_000)]), &["recursion"]),
        ("deep keys", bytes(&[&"a.".repeat(500_000), "a = 1"]), &["recursion"]),
        ("deep headers", bytes(&["[", &"a.".repeat(500_000), "a]"]), &["recursion"]),
        (
            "deep enough to be read",
            with("\"shield\"", &["[".repeat(20), "]".repeat(20)].concat()),
            &["`mesh.generator` is a list"],
        ),
    ]);
}

#[test]
fn what_is_too_long_is_refused() {
    let quick = quick();
    let x = |count: usize| "x".repeat(count);
    are_refused(&[
        (
            "one byte too long",
            [quick.as_bytes(), &vec![b'#'; LARGEST + 1 - quick.len()]].concat(),
            &["larger than 1048576 bytes"],
        ),
        ("far too long", vec![b'\n'; 20 * LARGEST], &["larger than 1048576 bytes"]),
        ("text", format!("title = \"{}\"", x(LARGEST - 20)).into_bytes(), &["missing key `mesh`"]),
        ("word", with("\"mma\"", &format!("\"{}\"", x(1_000_000))), &["algorithm` cannot be `xxx"]),
        (
            "key",
            with("[optimizer]\n", &format!("[optimizer]\n{} = 1\n", x(1_000_000))),
            &["more than 512 bytes"],
        ),
        (
            "name of a table",
            with("[materials.steel]", &format!("[materials.{}]", x(600))),
            &["more than 512 bytes"],
        ),
        ("name", with("\"observation\"", &format!("\"{}\"", x(1_000_000))), &["there is no region `xxx"]),
        ("number", with("0.5", &"5".repeat(1_000_000)), &["`mesh.shield.refinement`"]),
        ("quantity", with("60 Hz", &format!("{} Hz", "6".repeat(1_000_000))), &["`analysis.frequency`"]),
        ("unit", with("60 Hz", &format!("60 {}", "H".repeat(1_000_000))), &["`analysis.frequency`"]),
    ]);
    // Region names in files of Gmsh have at most 127 bytes.
    let home = folder();
    write(home.path(), "device.toml", quick.replace("steel", &x(400)));
    // A sound device, whose dense kernels want addresses by the size of the machine's cache: without a limit.
    limited(home.path(), None, &["check", "device.toml"]).succeeds();
}

#[test]
fn what_is_too_many_is_refused() {
    let quick = quick();
    let behind = |text: String| [quick.as_bytes(), text.as_bytes()].concat();
    let surfaces = |text: String| with("\"z_max\"]", &format!("\"z_max\"{text}]"));
    are_refused(&[
        (
            "unknown keys",
            [many(100_000, |i| format!("k{i}=1\n")).as_bytes(), quick.as_bytes()].concat(),
            &["unknown key `k0`", "not shown"],
        ),
        (
            "unknown names",
            surfaces(many(90_000, |i| format!(",\"s{i}\""))),
            &["no surface `s0`", "not shown"],
        ),
        ("items", surfaces(",1".repeat(100_000)), &["`boundaries.flux_parallel` has 100006 items"]),
        (
            "coils",
            behind(many(40_000, |i| format!("[[coils]]\nname=\"c{i}\"\n"))),
            &["`shape` in `coils[1]`"],
        ),
        ("materials", behind(many(30_000, |i| format!("[materials.m{i}]\n_=1\n"))), &["unknown key `_`"]),
        ("tables", behind(many(70_000, |i| format!("[t{i}]\n"))), &["unknown key `t0`"]),
        ("faults of syntax", "= =\n".repeat(200_000).into_bytes(), &["not valid TOML", "not shown"]),
        (
            "cases",
            (repository_text("configs/block_table1.toml")
                + &many(30_000, |i| format!("[[morph.case]]\nname=\"{i}\"\n")))
                .into_bytes(),
            &["cases repeat a configuration of", "at most"],
        ),
    ]);
}

#[test]
fn overrides_have_limits_too() {
    let home = folder();
    write(home.path(), "device.toml", quick());
    let long = format!("title=\"{}\"", "x".repeat(110_000));
    check(home.path(), &["--set", &long].repeat(10))
        .refuses(3, &["the overrides are longer than 1048576 bytes"]);
    check(home.path(), &["--set", "title=\u{1b}[31m"]).refuses(3, &["control character"]);
    let lines = "analysis.frequency=50\nanalysis.penalty=3";
    check(home.path(), &["--set", lines]).refuses(2, &["must be KEY=VALUE on one line"]);
    let deep = format!("{}=1", vec!["a"; 50_000].join("."));
    check(home.path(), &["--set", &deep]).refuses(3, &["recursion"]);
}

/// Runs a command on `device.toml` with so much memory.
fn with_memory(home: &Path, bytes: u64, command: &str, further: &[&str]) -> Finished {
    limited(home, Some(bytes), &[&[command, "device.toml"], further].concat())
}

#[test]
fn a_problem_that_does_not_fit_is_refused_before_it_is_solved() {
    let home = folder();
    write(home.path(), "device.toml", repository_text("configs/sphere.toml"));
    for command in ["check", "solve"] {
        let says =
            ["solving the problem needs about", "allowed by the limit on data", "--force", "device.toml:6:"];
        with_memory(home.path(), BETWEEN, command, &[]).refuses(3, &says);
    }
    assert_holds(home.path(), &["device.toml"]);
    // Nothing is solved by `check`: with --force it can tell the estimate.
    with_memory(home.path(), BETWEEN, "check", &["--force"]).succeeds();
}

#[test]
fn a_generated_mesh_that_does_not_fit_is_refused_before_it_is_made() {
    let home = folder();
    let block = repository_text("configs/block_table1.toml");
    write(home.path(), "device.toml", &block);
    for (command, cells, tetrahedra) in
        [("check", 100, "6000000"), ("morph", 100, "6000000"), ("check", 200, "48000000")]
    {
        let set = format!("mesh.block.cells=[{cells}, {cells}, {cells}]");
        let says = format!("setting up a mesh of {tetrahedra} tetrahedra needs about");
        with_memory(home.path(), LITTLE, command, &["--set", &set]).refuses(3, &[&says, "--force"]);
    }
    // A case of a sweep has a mesh of its own.
    let fine = "[[morph.case]]\nname = \"fine\"\nmesh.block.cells = [100, 100, 100]\n[[morph.case]]";
    write(home.path(), "device.toml", block.replacen("[[morph.case]]", fine, 1));
    with_memory(home.path(), LITTLE, "check", &[]).refuses(3, &["6000000 tetrahedra", "device.toml:"]);
    assert_holds(home.path(), &["device.toml"]);
}

#[cfg(unix)]
#[test]
fn what_is_no_regular_file_is_not_waited_for() {
    use std::os::unix::fs::symlink;
    let home = folder();
    let at = |name: &str| home.path().join(name);
    let pipe = at("pipe");
    let made = std::process::Command::new("mkfifo").arg(&pipe).status().expect("mkfifo of every Unix");
    assert!(made.success());
    fs::create_dir(at("folder.toml")).expect("made");
    for (target, link) in [("round", "round"), ("nothing", "dead"), ("pipe", "to_pipe")] {
        symlink(target, at(link)).expect("linked");
    }
    let _socket = std::os::unix::net::UnixListener::bind(at("socket")).expect("a socket");
    let limit = Some(baseline() + 4 * BESIDE);
    for name in [
        "pipe",
        "to_pipe",
        "socket",
        "folder.toml",
        "round",
        "dead",
        "none.toml",
        "/dev/zero",
        "/dev/null",
        "/",
    ] {
        let ended = limited(home.path(), limit, &["check", name]);
        ended.refuses(5, &["cannot read the configuration", name]);
    }
    // The same as a mesh; links that lead out or nowhere are refused before.
    for (mesh, code, says) in [
        ("pipe", 5, "a pipe"),
        ("to_pipe", 5, "a pipe"),
        ("socket", 5, "a socket"),
        ("folder.toml", 5, "a folder"),
        ("none.msh", 3, "there is no file"),
        ("round", 3, "leads nowhere"),
        ("dead", 3, "leads nowhere"),
    ] {
        write(
            home.path(),
            "device.toml",
            repository_text("tests/config/bases/of_file.toml").replace("device.msh", mesh),
        );
        check(home.path(), &[]).refuses(code, &[mesh, says]);
    }
    // And as a design.
    write(home.path(), "device.toml", quick());
    let arguments = ["solve", "device.toml", "--design"].map(OsStr::new);
    limited(home.path(), None, &[&arguments[..], &[pipe.as_os_str()]].concat())
        .refuses(5, &["cannot read the design", "a pipe"]);
}
