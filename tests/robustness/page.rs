//! The long series, and their table in docs/robustness.md: `just torture-runs`.

use std::fmt::Write;
use std::time::Duration;

use crate::disks::{self, full_disks, limited_files};
use crate::kills::{self, torture};
use crate::signals::{first_signal, second_signal};
use crate::support::device::{block, endless, shipped, slow};
use crate::support::program::folder;
use crate::support::write_into_page;

/// Kills and full disks go by runs of different lengths and with other things in them.
#[test]
#[ignore = "takes minutes and writes docs/robustness.md: just torture-runs"]
fn write_the_table() {
    let mut text = String::new();
    killed(&mut text);
    filled(&mut text);
    signalled(&mut text);
    write_into_page("docs/robustness.md", "torture-runs", &text);
}

fn killed(text: &mut String) {
    let home = folder();
    let quick = || shipped("shield_quick", &["--set", "output.fields=every"]);
    let devices = [
        (block(home.path(), 40), 150),
        (quick(), 60),
        (shipped("shield_two_frequencies", &["--set", "output.fields=improved"]), 30),
    ];
    *text += "| killed runs of | `kill -9` | of these, of `resume` | runs to the end | most kills in one run | started again | other bits at the end | torn files |\n";
    *text += "|---|---|---|---|---|---|---|---|\n";
    let mut kills = 0;
    for (number, (device, count)) in devices.iter().enumerate() {
        let home = folder();
        let tally = torture(device, home.path(), *count, number as u64);
        kills += tally.kills;
        let kills::Tally { kills, of_resumes, runs, started_again, most } = tally;
        let name = device.name;
        writeln!(text, "| {name} | {kills} | {of_resumes} | {runs} | {most} | {started_again} | 0 | 0 |")
            .expect("a text grows");
        println!("{name}: {tally:?}");
    }
    assert!(kills >= 200, "{kills}");
}

fn filled(text: &mut String) {
    *text += "\n| runs on | found no room, exit 5, file named | resumed | started again | had room | other bits at the end | torn files |\n";
    *text += "|---|---|---|---|---|---|---|\n";
    let home = folder();
    let sizes: Vec<usize> = (1..=14_usize).map(|k| 4096 * k * k.div_ceil(3)).collect();
    let files: Vec<usize> = (3..=16).collect();
    let blocks = [1, 2, 3, 4, 6, 8, 12, 16, 24, 48, 100, 200];
    let device = block(home.path(), 12).with("output.fields=every");
    let quick = shipped("shield_quick", &["--set", "output.fields=every"]);
    let larger: Vec<usize> = sizes.iter().map(|size| 8 * size).collect();
    let rows = [
        ("block, disks of 4 KiB and more", full_disks(&device, folder().path(), "size", &sizes)),
        ("block, disks of 3 files and more", full_disks(&device, folder().path(), "nr_inodes", &files)),
        ("shield_quick, disks of 32 KiB and more", full_disks(&quick, folder().path(), "size", &larger)),
        ("block, a limit on the size of files", Some(limited_files(&device, folder().path(), &blocks))),
    ];
    let (mut full, mut mounted) = (0, true);
    for (name, tally) in rows {
        println!("{name}: {tally:?}");
        let Some(tally) = tally else {
            mounted = false;
            writeln!(text, "| {name} | nothing can be mounted here | | | | | |").expect("a text grows");
            continue;
        };
        full += tally.full;
        let disks::Tally { full, resumed, with_room } = tally;
        writeln!(text, "| {name} | {full} | {resumed} | {} | {with_room} | 0 | 0 |", full - resumed)
            .expect("a text grows");
    }
    assert!(!mounted || full >= 20, "{full}");
}

fn signalled(text: &mut String) {
    let home = folder();
    let (device, long) = (endless(), slow(home.path()));
    let mut answers = Vec::new();
    let mut ends = Vec::new();
    for trial in 0..30 {
        let out = home.path().join(format!("first_{trial}"));
        answers.push(first_signal(&device, &out, ["INT", "TERM"][trial % 2]).0);
    }
    for trial in 0..20 {
        let out = home.path().join(format!("second_{trial}"));
        let name = ["run", "solve"][trial % 2];
        let begun = || out.join("resolved.toml").exists();
        let (answer, end) = second_signal(&mut long.command(name, &out), begun);
        answers.push(answer);
        ends.push(end);
    }
    *text += "\n| signal | trials | bound | within it | median | largest |\n|---|---|---|---|---|---|\n";
    for (name, bound, mut times) in [
        ("first: its message", Duration::from_millis(100), answers),
        ("second: the end of the process", Duration::from_secs(1), ends),
    ] {
        times.sort();
        let within = times.iter().filter(|time| **time <= bound).count();
        let [bound, median, largest] =
            [bound, times[times.len() / 2], times[times.len() - 1]].map(|time| time.as_secs_f64() * 1e3);
        let row = format!(
            "| {name} | {} | {bound:.0} ms | {within} | {median:.1} ms | {largest:.1} ms |",
            times.len()
        );
        println!("{row}");
        writeln!(text, "{row}").expect("a text grows");
        // A loaded machine may be late now and then.
        assert!(10 * within >= 9 * times.len(), "{row}");
    }
}
