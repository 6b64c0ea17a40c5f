//! README.md and the book in docs/ hold what they say: every command block runs and prints what stands there, every
//! file that a page quotes is the file of the repository, every link leads somewhere.
//!
//! How a block is written:
//!
//! * ` ```sh `: commands, one a line (a backslash at the end continues it). Every command must end with exit code 0, or
//!   with the one that a comment behind it states: `# exit code 1`.
//! * ` ```console `: the same behind `$ `, each followed by what it prints, messages included; `...` stands for any
//!   text within a line, and for any lines on a line of its own. Blanks count as one.
//! * `,long`: takes long; run by `just test-long` alone. `,tools=gmsh+pvpython`: likewise, where these tools exist.
//! * ` ```toml,file=PATH ` (any language): the content of that file of the repository, or one that the reader makes.
//!
//! The blocks of a page run in order in one copy of the project's files. `rules` lists what is never run, and why.

mod audit;
mod command_pages;
mod contents;
mod page;
mod release;
mod rules;
mod runner;
#[path = "../support/mod.rs"]
mod support;

use page::Page;
use rayon::prelude::*;
use runner::{Extent, Outcome, run_page};
use support::repository;

/// Runs the blocks of all pages, several pages at a time.
fn run_pages(extent: Extent) {
    let pages = Page::all();
    let outcomes: Vec<Outcome> = pages.par_iter().map(|page| run_page(page, extent)).collect();
    for (page, outcome) in pages.iter().zip(&outcomes) {
        if outcome.run + outcome.left_out > 0 {
            println!("{}: {} commands run, {} left out", page.path, outcome.run, outcome.left_out);
        }
    }
    println!("{} commands run", outcomes.iter().map(|outcome| outcome.run).sum::<usize>());
    let faults: Vec<String> = outcomes.into_iter().flat_map(|outcome| outcome.faults).collect();
    assert!(faults.is_empty(), "{} faults:\n\n{}", faults.len(), faults.join("\n\n"));
}

#[test]
fn every_command_block_runs_and_prints_what_the_page_says() {
    run_pages(Extent::Short);
}

#[test]
#[ignore = "takes minutes, and uses gmsh, pvpython and pip where they exist; run by `just test-long`"]
fn every_long_block_runs_where_its_tools_exist() {
    run_pages(Extent::All);
}

#[test]
fn no_command_dodges_the_test() {
    let faults: Vec<String> = Page::all().iter().flat_map(Page::hidden_commands).collect();
    assert!(faults.is_empty(), "write these as ```sh or ```console blocks:\n{}", faults.join("\n"));
}

#[test]
fn what_is_never_run_exists() {
    let faults: Vec<String> = Page::all()
        .iter()
        .flat_map(|page| page.blocks.iter().flat_map(page::Block::commands).collect::<Vec<_>>())
        .filter_map(|command| rules::never_run(&command.text).and_then(|rule| rule.fault(&command.text)))
        .collect();
    assert!(faults.is_empty(), "{}", faults.join("\n"));
}
