//! `report.html`: whole, the same when made twice, without network, safe whatever the files hold, and honest about what is
//! missing. `browser` looks at it in Chromium.

mod browser;
mod faults;
mod page;
#[path = "../support/mod.rs"]
mod support;

use std::path::{Path, PathBuf};

use support::device::written;
use support::folder::read_text;
use support::program::{finish, fluxmorph};
use support::shield::on_quick;

/// A run of the quick shield, which ends at its limit of evaluations.
fn shield(out: &Path, further: &[&str]) {
    on_quick("run", out, &[&["--quiet"], further].concat()).exits_with(1);
}

/// A run of the block with texts of its configuration replaced.
fn block(command: &str, folder: &Path, changes: &[(&str, &str)]) -> PathBuf {
    let out = folder.join("out");
    finish(&mut written("block", folder, changes).command(command, &out)).completed();
    out
}

/// The page of a run directory, made now.
#[track_caller]
fn report(directory: &Path) -> String {
    fluxmorph(&[&"report", &directory]).with(0, &["report.html"]);
    read_text(&directory.join("report.html"))
}
