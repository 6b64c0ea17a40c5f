//! One-edit typos of every key, every word and every name: what is suggested must be the original.
//!
//! Of each name all deletions, doublings and exchanges of neighbouring letters are taken, and substitutions by a neighbour on
//! the keyboard. A typo that gives another name that is known in the same place is none.

use std::collections::BTreeSet;

use fluxmorph::build::build_mesh;
use fluxmorph::config::Config;

use crate::looks::report;
use crate::support::repository;

/// Least share of typos for which the original is suggested.
///
/// Not all: a name of one or two letters keeps too little after an edit, and where names lie one letter apart (`x_min`,
/// `z_min`) a typo is as near to one as to the other. A distance that counts all edits alike leaves more of these open than
/// one that knows the keyboard; one typo in twenty is granted for both.
const RIGHT: f64 = 0.95;

/// Least number of typos that are asked for, so that the share means something.
const ASKED: usize = 3000;

/// Rows of a keyboard, each half a key to the right of the one above.
const ROWS: [&str; 4] = ["1234567890", "qwertyuiop", "asdfghjkl", "zxcvbnm"];

/// Every table, with the keys that choose its kind.
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
    "[[constraints]]\nkind = \"target_field\"\n",
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

/// Every key that takes one of a few words, with what stands before it.
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
    ("[[morph.motion]]\n", "design"),
    ("[optimizer]\n", "algorithm"),
    ("[output]\n", "fields"),
];

/// The keys next to a letter.
fn neighbours(letter: char) -> Vec<char> {
    let at = |letter: char| {
        ROWS.iter().enumerate().find_map(|(row, keys)| {
            keys.find(letter).map(|column| (row as f64, column as f64 + row as f64 / 2.0))
        })
    };
    let Some((row, column)) = at(letter) else { return Vec::new() };
    let is_near = |other: &char| {
        let near = |(r, c): (f64, f64)| (r - row).abs() <= 1.0 && (c - column).abs() <= 1.0;
        *other != letter && at(*other).is_some_and(near)
    };
    ROWS.iter().flat_map(|keys| keys.chars()).filter(is_near).collect()
}

/// All typos of a name.
fn typos(name: &str) -> BTreeSet<String> {
    let letters: Vec<char> = name.chars().collect();
    let mut typos = BTreeSet::new();
    for i in 0..letters.len() {
        let (before, behind) = (&letters[..i], &letters[i + 1..]);
        let mut add =
            |middle: &[char]| typos.insert([before, middle, behind].concat().iter().collect::<String>());
        add(&[]);
        add(&[letters[i]; 2]);
        for other in neighbours(letters[i].to_ascii_lowercase()) {
            add(&[other]);
        }
        if i > 0 {
            let mut exchanged = letters.clone();
            exchanged.swap(i - 1, i);
            typos.insert(exchanged.iter().collect());
        }
    }
    typos.remove(name);
    typos.remove("");
    typos
}

/// What was found for the typos of names.
#[derive(Default)]
struct Tally {
    asked: usize,
    right: usize,
    misses: Vec<String>,
}

impl Tally {
    /// Counts what is offered for the typos of a name among the known ones.
    fn count(&mut self, name: &str, known: &[String], offered: impl Fn(&str) -> Vec<String>) {
        // Names are not blank.
        for typo in typos(name).into_iter().filter(|typo| !known.contains(typo) && !typo.trim().is_empty()) {
            let offered = offered(&typo);
            let is_right = offered.iter().any(|offered| offered == name);
            self.asked += 1;
            self.right += usize::from(is_right);
            if !is_right {
                self.misses.push(format!("{typo} for {name}: {}", offered.join(", ")));
            }
        }
    }

    fn share(&self) -> f64 {
        self.right as f64 / self.asked as f64
    }
}

/// The names in backticks of `did you mean`.
fn named(help: Option<&str>) -> Vec<String> {
    let offer = help.and_then(|help| help.split_once("did you mean ")).map_or("", |(_, offer)| offer);
    let offer = offer.split('?').next().unwrap_or_default();
    offer.split('`').skip(1).step_by(2).map(str::to_owned).collect()
}

/// What the reader knows in a place, and what it offers there, from the fault that says some words.
fn answer(text: &str, says: &str) -> (Vec<String>, Vec<String>) {
    let report = report(text);
    let fault = report.diagnostics.iter().find(|fault| fault.message.contains(says));
    let fault = fault.unwrap_or_else(|| panic!("no `{says}` in\n{report}"));
    let known = fault.expected.as_deref().unwrap_or_default().trim_start_matches("known: ");
    (known.split(", ").map(str::to_owned).collect(), named(fault.help.as_deref()))
}

fn keys(tally: &mut Tally) {
    for table in TABLES {
        let ask = |key: &str| answer(&format!("{table}{key} = 1\n"), &format!("unknown key `{key}`"));
        let (known, _) = ask("zzzzzzzzzz");
        assert!(known.len() > 1, "{table}");
        // A key of the context is there already; a typo of it would come beside it.
        for key in known.iter().filter(|key| !table.contains(&format!("\n{key} = "))) {
            tally.count(key, &known, |typo| ask(typo).1);
        }
    }
}

fn words(tally: &mut Tally) {
    for (context, key) in WORDS {
        let ask =
            |word: &str| answer(&format!("{context}{key} = \"{word}\"\n"), &format!("cannot be `{word}`"));
        let (known, _) = ask("zzzzzzzzzz");
        for word in &known {
            tally.count(word, &known, |typo| ask(typo).1);
        }
    }
}

/// Regions, surfaces and materials of shipped configurations.
fn names(tally: &mut Tally) {
    let mut seen = BTreeSet::new();
    for name in ["shield_quick.toml", "inductor.toml", "sphere.toml", "pole.toml", "torture_block.toml"] {
        let read = Config::from_file(&repository("configs").join(name), &[]);
        let (config, source) = read.unwrap_or_else(|error| panic!("{error}"));
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
                let ask = |typo: &str| named(source.unknown_name("mesh", what, typo, &list).help.as_deref());
                tally.count(name, &known, ask);
            }
        }
    }
}

#[test]
fn nearly_all_typos_get_the_right_suggestion() {
    let mut all = Tally::default();
    keys(&mut all);
    words(&mut all);
    names(&mut all);
    println!("{} of {} typos get the right suggestion ({:.4})", all.right, all.asked, all.share());
    println!("misses, such as {}", all.misses.iter().step_by(10).cloned().collect::<Vec<_>>().join("; "));
    assert!(all.asked >= ASKED, "{}", all.asked);
    assert!(all.share() >= RIGHT, "{}", all.share());
}
