//! A page of Markdown: its blocks of code, and its text without them.

use std::fs;
use std::path::Path;

use crate::repository;
use crate::support::repository_text;

/// A page with the path that it has in the repository.
pub(crate) struct Page {
    pub(crate) path: String,
    pub(crate) blocks: Vec<Block>,
    /// Lines outside of blocks, with their numbers from 1.
    pub(crate) text: Vec<(usize, String)>,
}

/// A block of code.
pub(crate) struct Block {
    /// Number of the line that opens it.
    pub(crate) line: usize,
    pub(crate) language: String,
    /// What follows the language: `long`, `tools=gmsh`, `file=PATH`.
    flags: Vec<String>,
    pub(crate) lines: Vec<String>,
}

/// A command of a block, and what it should do.
pub(crate) struct Command {
    pub(crate) line: usize,
    pub(crate) text: String,
    pub(crate) exit_code: i32,
    /// Lines that it prints; `None`: the page does not say.
    pub(crate) prints: Option<Vec<String>>,
}

/// Languages of blocks that hold commands but are none of the two that are run.
const DODGING: [&str; 8] =
    ["bash", "shell", "zsh", "fish", "shell-session", "shellsession", "terminal", "powershell"];
/// How a line of a command begins.
const PROGRAMS: [&str; 9] =
    ["$ ", "fluxmorph ", "cargo ", "just ", "gmsh ", "pvpython ", "paraview ", "python3 ", "pip "];

impl Page {
    /// README.md and all pages below docs/.
    pub(crate) fn all() -> Vec<Self> {
        let mut paths = vec!["README.md".to_owned()];
        markdown_below("docs", &mut paths);
        paths.sort();
        paths.iter().map(|path| Self::read(path)).collect()
    }

    /// # Panics
    /// When the page cannot be read, or a block of it is not closed.
    pub(crate) fn read(path: &str) -> Self {
        let content = repository_text(path);
        let mut page = Self { path: path.to_owned(), blocks: Vec::new(), text: Vec::new() };
        let mut open: Option<(Block, usize)> = None;
        for (number, line) in (1..).zip(content.lines()) {
            let indent = line.len() - line.trim_start().len();
            match (&mut open, line.trim_start().strip_prefix("```")) {
                (None, Some(info)) => open = Some((Block::new(number, info), indent)),
                (None, None) => page.text.push((number, line.to_owned())),
                (Some(_), Some("")) => page.blocks.extend(open.take().map(|(block, _)| block)),
                (Some((block, indent)), _) => block.lines.push(line.chars().skip(*indent).collect()),
            }
        }
        assert!(open.is_none(), "{path}: a block is not closed");
        page
    }

    /// Commands in blocks that no test would run.
    pub(crate) fn hidden_commands(&self) -> Vec<String> {
        let command_page = self.path == crate::command_pages::PATH;
        let hidden = |block: &Block| match block.language.as_str() {
            "sh" | "console" => None,
            language if DODGING.contains(&language) => Some(format!("a block in `{language}`")),
            "" | "text" | "txt" if !command_page => block
                .lines
                .iter()
                .find(|line| PROGRAMS.iter().any(|program| line.starts_with(program)))
                .map(|line| format!("`{line}`")),
            _ => None,
        };
        let place = |block: &Block| hidden(block).map(|what| format!("{}:{}: {what}", self.path, block.line));
        self.blocks.iter().filter_map(place).collect()
    }
}

impl Block {
    fn new(line: usize, info: &str) -> Self {
        let mut words = info.trim().split(',').map(|word| word.trim().to_owned());
        Self { line, language: words.next().unwrap_or_default(), flags: words.collect(), lines: Vec::new() }
    }

    /// Whether it takes too long for every change.
    pub(crate) fn is_long(&self) -> bool {
        self.flags.iter().any(|flag| flag == "long")
    }

    /// Programs that it needs beside those of every machine that builds this one.
    pub(crate) fn tools(&self) -> Vec<&str> {
        let tools = self.flags.iter().find_map(|flag| flag.strip_prefix("tools="));
        tools.map_or_else(Vec::new, |tools| tools.split('+').collect())
    }

    /// The file whose content it shows.
    pub(crate) fn file(&self) -> Option<&str> {
        self.flags.iter().find_map(|flag| flag.strip_prefix("file="))
    }

    /// Flags that mean nothing.
    pub(crate) fn unknown_flags(&self) -> Vec<&str> {
        let known = |flag: &&String| {
            *flag == "long"
                || flag.starts_with("tools=")
                || flag.starts_with("file=")
                || self.language == "rust"
        };
        self.flags.iter().filter(|flag| !known(flag)).map(String::as_str).collect()
    }

    /// Its commands in order; none unless it is a block of commands.
    pub(crate) fn commands(&self) -> Vec<Command> {
        let mut commands: Vec<Command> = Vec::new();
        let mut unfinished = false;
        for (line, text) in (self.line + 1..).zip(&self.lines) {
            let command = match self.language.as_str() {
                _ if unfinished => Some(text.trim()),
                "console" => text.strip_prefix("$ "),
                "sh" => Some(text.trim()).filter(|text| !text.is_empty() && !text.starts_with('#')),
                _ => return Vec::new(),
            };
            match (command, commands.last_mut()) {
                (Some(command), Some(last)) if unfinished => last.text += command,
                (Some(command), _) => commands.push(Command::new(line, command)),
                (None, Some(last)) if self.language == "console" => {
                    last.prints.get_or_insert_default().push(text.clone());
                }
                (None, _) => {}
            }
            unfinished = false;
            if let (Some(last), Some(_)) = (commands.last_mut(), command)
                && let Some(beginning) = last.text.strip_suffix('\\')
            {
                last.text = beginning.to_owned();
                unfinished = true;
            }
        }
        for command in &mut commands {
            command.take_exit_code();
        }
        commands
    }
}

impl Command {
    fn new(line: usize, text: &str) -> Self {
        Self { line, text: text.trim().to_owned(), exit_code: 0, prints: None }
    }

    /// `command  # exit code 1: why` states the code and is no part of the command.
    fn take_exit_code(&mut self) {
        let Some((command, comment)) = self.text.split_once(" # ") else { return };
        if let Some(code) = comment.trim().strip_prefix("exit code ") {
            let digits: String = code.chars().take_while(char::is_ascii_digit).collect();
            self.exit_code = digits.parse().expect("a number behind `exit code`");
        }
        self.text = command.trim().to_owned();
    }
}

fn markdown_below(folder: &str, paths: &mut Vec<String>) {
    let entries = fs::read_dir(repository(folder)).unwrap_or_else(|error| panic!("{folder}: {error}"));
    for entry in entries {
        let entry = entry.expect("a folder of the repository can be read");
        let path = format!("{folder}/{}", entry.file_name().to_string_lossy());
        if entry.path().is_dir() {
            markdown_below(&path, paths);
        } else if Path::new(&path).extension().is_some_and(|extension| extension == "md") {
            paths.push(path);
        }
    }
}
