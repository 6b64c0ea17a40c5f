//! The page in a browser: `tests/report/browser.py` drives headless Chromium, where it is installed.

use std::process::Command;

use crate::shield;
use crate::support::program::folder;
use crate::support::repository;

/// Whether a program answers; without it the test is skipped.
fn is_there(program: &str) -> bool {
    Command::new(program).arg("--version").output().is_ok_and(|output| output.status.success())
}

#[test]
#[ignore = "needs Chromium and Python; run by `just test-long`, and skipped where they are absent"]
fn chromium_shows_every_figure_without_complaint() {
    let browsers = ["chromium", "chromium-browser", "google-chrome", "chrome"];
    if !browsers.iter().any(|name| is_there(name)) || !is_there("python3") {
        println!("skipped: no Chromium or no python3 on this machine");
        return;
    }
    let home = folder();
    let out = home.path().join("out");
    shield(&out, &[]);
    let script = repository("tests/report/browser.py");
    let output = Command::new("python3")
        .arg(script)
        .arg(out.join("report.html"))
        .env("PYTHONPATH", repository("tools"))
        .env("PYTHONDONTWRITEBYTECODE", "1")
        .output()
        .expect("python3 starts");
    let said = String::from_utf8_lossy(&output.stdout);
    print!("{said}");
    assert!(output.status.success(), "{said}\n{}", String::from_utf8_lossy(&output.stderr));
    assert!(said.ends_with("OK\n"), "{said}");
}
