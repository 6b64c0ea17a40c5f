//! What cannot fit into memory is refused by every command before it is begun, unless the user insists.

use std::ffi::OsStr;
use std::fs;

use crate::changes::Base;
use crate::limited::{assert_holds, check, limited, objection};

/// Room for the program and a small set-up, and not for six million tetrahedra.
const LITTLE: u64 = 32 << 20;

/// Between what the set-up of the sphere takes (80 MiB) and what its solution is estimated at (355 MiB).
const BETWEEN: u64 = 130 << 20;

#[test]
fn a_problem_that_does_not_fit_is_refused_before_it_is_solved() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let config = folder.path().join("device.toml");
    fs::write(&config, Base::Sphere.text()).expect("written");
    for command in ["check", "solve"] {
        let ended = limited(Some(BETWEEN), &[command.as_ref(), config.as_os_str()]);
        let says =
            ["solving the problem needs about", "allowed by the limit on data", "--force", "device.toml:6:"];
        assert_eq!(objection(&ended, &[3], &says), None, "{command}");
    }
    assert_holds(folder.path(), &["device.toml"]);
    // Nothing is solved by `check`: with --force it can tell the estimate.
    let ended = limited(Some(BETWEEN), &[&check(&config)[..], &["--force".as_ref()]].concat());
    assert_eq!(ended.code, Some(0), "{}", ended.stderr);
}

#[test]
fn a_generated_mesh_that_does_not_fit_is_refused_before_it_is_made() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let config = folder.path().join("device.toml");
    fs::write(&config, Base::Block.text()).expect("written");
    let cells = ["--set", "mesh.block.cells=[100, 100, 100]"].map(OsStr::new);
    for command in ["check", "morph"] {
        let ended = limited(Some(LITTLE), &[&[command.as_ref(), config.as_os_str()], &cells[..]].concat());
        let says = ["setting up a mesh of 6000000 tetrahedra needs about", "--force"];
        assert_eq!(objection(&ended, &[3], &says), None, "{command}");
    }
    // A case of a sweep has a mesh of its own.
    let text = Base::Block.text().replacen(
        "[[morph.case]]",
        "[[morph.case]]\nname = \"fine\"\nmesh.block.cells = [100, 100, 100]\n[[morph.case]]",
        1,
    );
    fs::write(&config, text).expect("written");
    let ended = limited(Some(LITTLE), &check(&config));
    assert_eq!(objection(&ended, &[3], &["6000000 tetrahedra", "device.toml:"]), None);
    assert_holds(folder.path(), &["device.toml"]);
}
