//! `fluxmorph generate`: what other programs want to know about this one.

use std::path::Path;

use clap::{Command, CommandFactory};

use super::args::{Cli, GenerateArgs, Generated};
use super::stdout;
use crate::build::steels;
use crate::config::Steel;
use crate::error::Error;
use crate::exit_code::ExitCode;
use crate::files::{OutputError, system_disk, write_whole};
use crate::schema;

/// Print what is asked for.
pub(super) fn generate(args: &GenerateArgs) -> Result<ExitCode, Error> {
    let mut bytes = Vec::new();
    match &args.what {
        Generated::Schema => bytes.extend_from_slice(schema::text().as_bytes()),
        Generated::Materials { name: Some(name) } => {
            let named = steels::ALL.into_iter().filter(|steel| steel.name() == name);
            named.for_each(|steel| bytes.extend_from_slice(steels::table(steel).as_bytes()));
        }
        Generated::Materials { name: None } => bytes.extend_from_slice(materials().as_bytes()),
        Generated::Man { out: Some(folder) } => write_pages(folder)?,
        Generated::Man { out: None } => pages().into_iter().for_each(|(_, page)| bytes.extend(page)),
        Generated::Completions { shell } => {
            clap_complete::generate(*shell, &mut Cli::command(), "fluxmorph", &mut bytes);
        }
    }
    stdout::print(&String::from_utf8_lossy(&bytes))?;
    Ok(ExitCode::Success)
}

/// All steels, as a part of a configuration.
fn materials() -> String {
    let points = |table: &str| -> String {
        table.lines().filter(|line| steels::is_row(line)).map(|line| format!("    [{line}],\n")).collect()
    };
    let comments = |table: &str| -> String {
        table.lines().filter(|line| line.starts_with('#')).map(|line| format!("{line}\n")).collect()
    };
    let of = |steel: Steel| {
        let (name, table) = (steel.name(), steels::table(steel));
        format!(
            "{}# The same as bh = \"{name}\".\n[materials.{name}]\nbh = [\n{}]\n",
            comments(table),
            points(table)
        )
    };
    steels::ALL.map(of).join("\n")
}

/// One man page for the program and each of its commands, by the name of its file.
fn pages() -> Vec<(String, Vec<u8>)> {
    let mut program = Cli::command().disable_help_subcommand(true);
    program.build();
    let mut pages = Vec::new();
    add_pages(&program, "fluxmorph".to_owned(), &mut pages);
    pages
}

fn add_pages(command: &Command, name: String, pages: &mut Vec<(String, Vec<u8>)>) {
    let mut page = Vec::new();
    let version = concat!("fluxmorph ", env!("CARGO_PKG_VERSION"));
    let man = clap_mangen::Man::new(command.clone()).title(name.to_uppercase()).source(version);
    man.render(&mut page).expect("a vector takes all that is written");
    pages.push((format!("{name}.1"), page));
    for inner in command.get_subcommands() {
        add_pages(inner, format!("{name}-{}", inner.get_name()), pages);
    }
}

fn write_pages(folder: &Path) -> Result<(), OutputError> {
    let disk = system_disk();
    disk.create_dir(folder).map_err(OutputError::io("create the folder", folder))?;
    pages().into_iter().try_for_each(|(name, page)| write_whole(&*disk, &folder.join(name), &page))
}
