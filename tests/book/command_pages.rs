//! docs/commands.md is what the program itself says about its commands.

use std::fmt::Write;
use std::fs;

use crate::repository;
use crate::support::program::{finish, program};
use crate::support::repository_text;

/// The page that is written here.
pub(crate) const PATH: &str = "docs/commands.md";

const HEAD: &str = "# Commands\n\n\
    What `fluxmorph --help` and `fluxmorph COMMAND --help` print; written by `just commands` and not by hand. \
    `fluxmorph generate man` prints the same as a man page.\n";

/// What `fluxmorph ARGUMENTS --help` prints.
fn help(arguments: &[String]) -> String {
    let mut help = program();
    let text = finish(help.args(arguments).arg("--help").env_remove("COLUMNS")).exits_with(0).stdout;
    text.lines().map(|line| format!("{}\n", line.trim_end())).collect()
}

/// Names in the list below `Commands:`, but for `help`.
fn subcommands(help: &str) -> Vec<String> {
    let list = help.lines().skip_while(|line| *line != "Commands:").skip(1);
    let entries = list.take_while(|line| line.starts_with("  "));
    let name = |line: &str| {
        line.strip_prefix("  ").filter(|l| !l.starts_with(' '))?.split(' ').next().map(str::to_owned)
    };
    entries.filter_map(name).filter(|name| name != "help").collect()
}

fn write_command(page: &mut String, arguments: &[String]) {
    let text = help(arguments);
    let name = std::iter::once("fluxmorph")
        .chain(arguments.iter().map(String::as_str))
        .collect::<Vec<_>>()
        .join(" ");
    write!(page, "\n## `{name}`\n\n```text\n{}```\n", text).expect("a string");
    for subcommand in subcommands(&text) {
        let arguments: Vec<String> = arguments.iter().cloned().chain([subcommand]).collect();
        write_command(page, &arguments);
    }
}

fn page() -> String {
    let mut page = HEAD.to_owned();
    write_command(&mut page, &[]);
    page
}

#[test]
fn the_page_of_commands_is_what_the_program_says() {
    assert!(repository_text(PATH) == page(), "{PATH} is stale: `just commands` writes it");
}

#[test]
#[ignore = "writes docs/commands.md: just commands"]
fn write_the_commands() {
    fs::write(repository(PATH), page()).expect("the page can be written");
}
