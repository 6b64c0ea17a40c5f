//! One-edit typos of every key, every word and every name: the suggestion must be the original.
//!
//! Of each name all deletions, exchanges of neighbouring letters, doublings, and substitutions by a neighbour on the keyboard
//! are taken. A typo that gives another name that is known in the same place is none.

use std::collections::{BTreeMap, BTreeSet};

use fluxmorph_optimizer::config::{Config, ConfigError};
use fluxmorph_optimizer::setup::build_mesh;

use crate::case::repository;

/// Rows of a keyboard, each half a key to the right of the one above.
const ROWS: [&str; 4] = ["1234567890", "qwertyuiop", "asdfghjkl", "zxcvbnm"];

/// The keys next to a letter.
fn neighbours(letter: char) -> Vec<char> {
    let at = |letter: char| {
        ROWS.iter().enumerate().find_map(|(row, keys)| {
            keys.find(letter).map(|column| (row as f64, column as f64 + row as f64 / 2.0))
        })
    };
    let Some((row, column)) = at(letter) else { return Vec::new() };
    let near = |other: &char| {
        at(*other)
            .is_some_and(|(r, c)| (r - row).abs() <= 1.0 && (c - column).abs() <= 1.0 && *other != letter)
    };
    ROWS.iter().flat_map(|keys| keys.chars()).filter(near).collect()
}

/// All typos of a name.
fn typos(name: &str) -> BTreeSet<String> {
    let letters: Vec<char> = name.chars().collect();
    let mut typos = BTreeSet::new();
    let mut add = |letters: Vec<char>| {
        typos.insert(letters.into_iter().collect::<String>());
    };
    for i in 0..letters.len() {
        add([&letters[..i], &letters[i + 1..]].concat());
        add([&letters[..=i], &letters[i..]].concat());
        for other in neighbours(letters[i].to_ascii_lowercase()) {
            add([&letters[..i], &[other], &letters[i + 1..]].concat());
        }
        if i > 0 {
            let mut exchanged = letters.clone();
            exchanged.swap(i - 1, i);
            add(exchanged);
        }
    }
    typos.remove(name);
    typos.remove("");
    typos
}

/// What was found for all typos of names that are known in one place.
#[derive(Default)]
struct Tally {
    asked: usize,
    right: usize,
    /// Right, and one of two.
    of_two: usize,
    misses: BTreeMap<&'static str, Vec<String>>,
}

impl Tally {
    /// Counts what is offered for the typos of a name among the known ones.
    fn count(&mut self, name: &str, known: &[String], offered: impl Fn(&str) -> Vec<String>) {
        for typo in typos(name).into_iter().filter(|typo| !known.contains(typo)) {
            // Only bare words can be keys, and names are not blank.
            if typo.trim().is_empty() {
                continue;
            }
            self.asked += 1;
            let offered = offered(&typo);
            if offered.iter().any(|offered| offered == name) {
                self.right += 1;
                self.of_two += usize::from(offered.len() > 1);
                continue;
            }
            let reason = match (offered.is_empty(), name.chars().count() <= 2) {
                (_, true) => "a name of one or two letters",
                (true, _) => "nothing is offered",
                (false, _) => "another name is as near or nearer",
            };
            self.misses.entry(reason).or_default().push(format!("{typo} for {name}: {}", offered.join(", ")));
        }
    }

    fn add(&mut self, other: Self) {
        self.asked += other.asked;
        self.right += other.right;
        self.of_two += other.of_two;
        for (reason, misses) in other.misses {
            self.misses.entry(reason).or_default().extend(misses);
        }
    }

    fn share(&self) -> f64 {
        self.right as f64 / self.asked as f64
    }

    fn print(&self, what: &str) {
        println!(
            "{what}: {} of {} typos get the right suggestion ({:.2} %), {} of them as one of two",
            self.right,
            self.asked,
            100.0 * self.share(),
            self.of_two
        );
        for (reason, misses) in &self.misses {
            println!(
                "  {} misses: {reason}; such as {}",
                misses.len(),
                misses[..misses.len().min(8)].join("; ")
            );
        }
    }
}

/// The names that the help of the fault at a word offers.
fn offered(text: &str, says: &str) -> Vec<String> {
    let error = Config::from_str(text, "typo.toml").expect_err("a fault");
    let ConfigError::Invalid(report) = error else { panic!("{error}") };
    let fault = report.diagnostics.iter().find(|fault| fault.message.contains(says));
    let fault = fault.unwrap_or_else(|| panic!("no `{says}` in\n{report}"));
    named(fault.help.as_deref().unwrap_or_default())
}

/// The names in backticks of `did you mean`.
fn named(help: &str) -> Vec<String> {
    let offer = help.split_once("did you mean ").map_or("", |(_, offer)| offer);
    let offer = offer.split('?').next().unwrap_or_default();
    offer.split('`').skip(1).step_by(2).map(str::to_owned).collect()
}

/// What the reader says that it knows in a place.
fn known(text: &str, says: &str) -> Vec<String> {
    let error = Config::from_str(text, "typo.toml").expect_err("a fault");
    let ConfigError::Invalid(report) = error else { panic!("{error}") };
    let fault = report.diagnostics.iter().find(|fault| fault.message.contains(says));
    let fault = fault.unwrap_or_else(|| panic!("no `{says}` in\n{report}"));
    let expected = fault.expected.as_deref().unwrap_or_default();
    expected.trim_start_matches("known: ").split(", ").map(str::to_owned).collect()
}

/// Every table, and what must stand before the key.
const TABLES: &[&str] = &[
    "",
    "[mesh]\n",
    "[mesh.shield]\n",
    "[mesh.block]\n",
    "[mesh.sphere]\n",
    "[mesh.boxes]\n",
    "[[mesh.boxes.regions]]\n",
    "[[mesh.boxes.sizes]]\n",
    "[[mesh.boxes.surfaces]]\n",
    "[analysis]\n",
    "[analysis.linear_solver]\n",
    "[materials.a]\n",
    "[regions.a]\n",
    "[[coils]]\nshape = \"racetrack\"\n",
    "[[coils]]\nshape = \"circular\"\n",
    "[[coils]]\nregion = \"a\"\n",
    "[boundaries]\n",
    "[boundaries.uniform_field]\n",
    "[objective]\n",
    "[[objective.terms]]\n",
    "[[constraints]]\nkind = \"uniformity\"\n",
    "[[constraints]]\nkind = \"mass\"\n",
    "[[constraints]]\nkind = \"thickness\"\n",
    "[design]\n",
    "[[design.symmetry]]\n",
    "[remesh]\n",
    "[[remesh.subregions]]\n",
    "[morph]\n",
    "[[morph.motion]]\n",
    "[[morph.motion]]\n[morph.motion.rotation]\n",
    "[[morph.motion]]\n[morph.motion.scale]\n",
    "[morph.tune]\n",
    "[[morph.case]]\n",
    "[[morph.case]]\n[morph.case.paper]\n",
    "[optimizer]\n",
    "[[probes]]\n",
    "[output]\n",
];

/// Every key that takes one of a few words.
const WORDS: &[(&str, &str)] = &[
    ("[mesh]\n", "generator"),
    ("[mesh]\nfile = \"a.msh\"\n", "unit"),
    ("[[mesh.boxes.sizes]]\n", "axis"),
    ("[analysis.linear_solver]\n", "method"),
    ("[analysis.linear_solver]\n", "reuse"),
    ("[materials.b]\n[regions.a]\nmaterial = \"b\"\n", "model"),
    ("[[coils]]\n", "shape"),
    ("[[coils]]\nshape = \"racetrack\"\n", "axis"),
    ("[[coils]]\nshape = \"racetrack\"\n", "corner"),
    ("[objective]\n", "goal"),
    ("[objective]\n", "kind"),
    ("[objective]\n", "weighting"),
    ("[[constraints]]\n", "kind"),
    ("[design]\n", "direction"),
    ("[design]\n", "rim"),
    ("[[design.symmetry]]\n", "axis"),
    ("[remesh]\n", "motion"),
    ("[remesh]\n", "stiffness"),
    ("[morph]\n", "increments"),
    ("[[morph.motion]]\n", "design"),
    ("[optimizer]\n", "algorithm"),
    ("[output]\n", "fields"),
];

fn keys() -> Tally {
    let mut tally = Tally::default();
    for table in TABLES {
        let text = |key: &str| format!("{table}{key} = 1\n");
        let known = known(&text("zzzzzzzzzz"), "unknown key `zzzzzzzzzz`");
        assert!(!known.is_empty(), "{table}");
        for key in &known {
            // One of the context is there already; a typo of it comes beside it.
            let is_there = table.contains(&format!("\n{key} = "));
            if !is_there {
                tally.count(key, &known, |typo| offered(&text(typo), &format!("unknown key `{typo}`")));
            }
        }
    }
    tally
}

fn words() -> Tally {
    let mut tally = Tally::default();
    for (context, key) in WORDS {
        let text = |word: &str| format!("{context}{key} = \"{word}\"\n");
        let known = known(&text("zzzzzzzzzz"), "cannot be `zzzzzzzzzz`");
        for word in &known {
            tally.count(word, &known, |typo| offered(&text(typo), &format!("cannot be `{typo}`")));
        }
    }
    tally
}

/// Regions, surfaces and materials of the shipped configurations.
fn names() -> Tally {
    let mut tally = Tally::default();
    let mut seen = BTreeSet::new();
    for name in ["shield_quick.toml", "inductor.toml", "sphere.toml", "pole.toml", "torture_block.toml"] {
        let (config, source) = Config::from_file(&repository("configs").join(name), &[])
            .unwrap_or_else(|error| panic!("{error}"));
        let mesh = build_mesh(&config, &source).unwrap_or_else(|error| panic!("{error}"));
        let topology = mesh.topology();
        let lists = [
            ("region", topology.region_names().to_vec()),
            ("surface", topology.surface_names().map(str::to_owned).collect()),
            ("material", config.materials.keys().cloned().collect::<Vec<_>>()),
        ];
        for (what, known) in lists.into_iter().filter(|(_, known)| seen.insert(known.clone())) {
            let list: Vec<&str> = known.iter().map(String::as_str).collect();
            for name in &known {
                tally.count(name, &known, |typo| {
                    let fault = source.unknown_name("mesh", what, typo, &list);
                    named(fault.help.as_deref().unwrap_or_default())
                });
            }
        }
    }
    tally
}

#[test]
fn nearly_all_typos_get_the_right_suggestion() {
    let mut all = Tally::default();
    for (what, tally) in [("keys", keys()), ("words", words()), ("names", names())] {
        tally.print(what);
        all.add(tally);
    }
    all.print("all");
    assert!(all.asked >= 3000, "{}", all.asked);
    assert!(all.share() >= 0.95, "{}", all.share());
}

#[test]
fn typos_are_single_edits() {
    let of = typos("mma");
    for typo in ["ma", "mm", "mmma", "mmaa", "mam", "nma", "mka", "mms"] {
        assert!(of.contains(typo), "{typo}: {of:?}");
    }
    assert!(!of.contains("mma") && of.iter().all(|typo| (2..=4).contains(&typo.len())));
}
