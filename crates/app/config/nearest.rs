//! The name that a misspelt one was probably meant to be.
//!
//! Names are compared by the cost of the cheapest way from one to the other, in units of one wrong letter: insertions,
//! deletions, substitutions and exchanges of neighbouring letters (optimal string alignment: no letter is changed twice).
//! What fingers do often is cheaper than what they do seldom, so that of several names one letter away the likely one wins.

/// Longest name that is compared letter by letter [characters]: the comparison takes time by the product of the lengths, and
/// a longer name is no slip of the pen.
const LONGEST_COMPARED: usize = 64;

/// Most names that are compared: a hostile mesh may have as many as it has bytes.
const MOST_COMPARED: usize = 4000;

/// A letter in place of another one.
const WRONG: f64 = 1.0;
/// A letter in place of its neighbour on the keyboard.
const NEIGHBOUR: f64 = 0.8;
/// Two neighbouring letters exchanged.
const EXCHANGED: f64 = 0.7;
/// A letter too many or too few.
const MISSING: f64 = 0.9;
/// The same letter once more, or once less.
const DOUBLED: f64 = 0.6;
/// A separator too many or too few, or a plural `s` at the end.
const SLIGHT: f64 = 0.3;
/// What a difference at the first letter costs more: people get the start of a word right.
const AT_START: f64 = 0.05;
/// Costs that differ by less are equal; the smallest difference of two costs above is 0.05.
const TIE: f64 = 0.01;
/// The cost of an abbreviation, whatever its length: dearer than two wrong letters of a long name.
const ABBREVIATED: f64 = 2.5;

/// Rows of a keyboard; each key lies half a key to the right of the one above it.
const ROWS: [&str; 4] = ["1234567890-", "qwertyuiop", "asdfghjkl", "zxcvbnm"];

/// The candidate that `name` was probably meant to be, if one is near enough.
pub fn nearest<'a>(name: &str, candidates: impl IntoIterator<Item = &'a str>) -> Option<&'a str> {
    nearest_two(name, candidates).into_iter().next()
}

/// The candidates that `name` was probably meant to be: one, or two that are equally near, or none.
///
/// Near means at most one wrong letter for every three (two at least for names of four letters or more), equal but for case
/// and separators, or an abbreviation of each word.
pub fn nearest_two<'a>(name: &str, candidates: impl IntoIterator<Item = &'a str>) -> Vec<&'a str> {
    let wanted = fold(name);
    if wanted.is_empty() || wanted.len() > LONGEST_COMPARED {
        return Vec::new();
    }
    let limit = if wanted.len() >= 4 { (wanted.len() / 3).max(2) as f64 } else { 1.0 + AT_START };
    let mut near: Vec<(f64, &str)> = candidates
        .into_iter()
        .take(MOST_COMPARED)
        .filter(|candidate| candidate.len() <= 4 * LONGEST_COMPARED)
        .filter_map(|candidate| Some((cost(&wanted, &fold(candidate), limit)?, candidate)))
        .collect();
    near.sort_by(|a, b| a.0.total_cmp(&b.0));
    near.dedup_by_key(|(_, candidate)| *candidate);
    let least = near.first().map_or(0.0, |(cost, _)| *cost);
    near.into_iter().take(2).take_while(|(cost, _)| *cost <= least + TIE).map(|(_, name)| name).collect()
}

/// The help that offers what [`nearest_two`] found.
pub(super) fn offer<'a>(name: &str, candidates: impl IntoIterator<Item = &'a str>) -> Option<String> {
    match nearest_two(name, candidates).as_slice() {
        [] => None,
        [one, rest @ ..] => {
            let or = rest.iter().map(|other| format!(" or `{other}`")).collect::<String>();
            Some(format!("did you mean `{one}`{or}?"))
        }
    }
}

/// Lower case, with one kind of separator.
fn fold(text: &str) -> Vec<char> {
    let lower = text.chars().flat_map(char::to_lowercase);
    lower.map(|c| if matches!(c, '-' | ' ' | '.') { '_' } else { c }).collect()
}

/// What the way from one name to the other costs; `None` beyond the limit.
fn cost(wanted: &[char], candidate: &[char], limit: f64) -> Option<f64> {
    let letters = |name: &[char]| name.iter().filter(|c| **c != '_').count();
    let apart = letters(wanted).abs_diff(letters(candidate)) as f64;
    // Every letter too few costs something.
    let by_letters = if apart * SLIGHT > limit { f64::INFINITY } else { way(wanted, candidate) };
    if by_letters <= limit {
        return Some(by_letters);
    }
    abbreviates(wanted, candidate).then_some(ABBREVIATED)
}

/// Optimal string alignment with the costs above.
fn way(from: &[char], to: &[char]) -> f64 {
    let width = to.len() + 1;
    let mut rows = vec![vec![0.0_f64; width]; 3];
    for j in 1..width {
        rows[0][j] = rows[0][j - 1] + gap(to, j - 1);
    }
    for i in 1..=from.len() {
        let start = |at: usize| if at == 0 { AT_START } else { 0.0 };
        let a = from[i - 1];
        // Three rows take turns; the one to be filled next is that of two letters before.
        let (row, previous, before) = (i % 3, (i - 1) % 3, (i + 1) % 3);
        rows[row][0] = rows[previous][0] + gap(from, i - 1);
        for j in 1..width {
            let b = to[j - 1];
            let changed = if a == b { 0.0 } else { substituted(a, b) + start((i - 1).min(j - 1)) };
            let mut least = (rows[previous][j - 1] + changed)
                .min(rows[previous][j] + gap(from, i - 1))
                .min(rows[row][j - 1] + gap(to, j - 1));
            if i > 1 && j > 1 && a != b && a == to[j - 2] && b == from[i - 2] {
                least = least.min(rows[before][j - 2] + EXCHANGED);
            }
            rows[row][j] = least;
        }
    }
    rows[from.len() % 3][to.len()]
}

/// The cost of a letter of a name that the other does not have.
fn gap(name: &[char], at: usize) -> f64 {
    let letter = name[at];
    let repeats = (at > 0 && name[at - 1] == letter) || name.get(at + 1) == Some(&letter);
    match letter {
        '_' => SLIGHT,
        's' if at > 0 && matches!(name.get(at + 1), None | Some('_')) => SLIGHT,
        _ if repeats => DOUBLED,
        _ if at == 0 => MISSING + AT_START,
        _ => MISSING,
    }
}

/// The cost of one letter in place of another.
fn substituted(a: char, b: char) -> f64 {
    // British and American spellings differ by these.
    if matches!((a, b), ('s', 'z') | ('z', 's')) {
        return SLIGHT;
    }
    match (key(a), key(b)) {
        (Some([x, y]), Some([u, v])) if (x - u).abs() <= 1.0 && (y - v).abs() <= 1.0 => NEIGHBOUR,
        _ => WRONG,
    }
}

/// Where a letter lies on the keyboard [keys].
fn key(letter: char) -> Option<[f64; 2]> {
    let lies = |(row, keys): (usize, &&str)| {
        keys.find(letter).map(|column| [column as f64 + 0.5 * row as f64, row as f64])
    };
    ROWS.iter().enumerate().find_map(lies)
}

/// Whether every word of a name starts the word of the candidate at the same place: `min_qual` for `minimum_quality`, `freq`
/// for `frequency`. Fewer than three letters say too little.
fn abbreviates(name: &[char], candidate: &[char]) -> bool {
    let (short, long): (Vec<_>, Vec<_>) =
        (name.split(|c| *c == '_').collect(), candidate.split(|c| *c == '_').collect());
    short.len() <= long.len()
        && short.iter().zip(&long).all(|(short, long)| short.len() >= 3 && long.starts_with(short))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_nearest_name_is_suggested_only_when_it_is_near() {
        let names = ["frequency", "penalty", "x_min", "x_max"];
        assert_eq!(nearest("freqency", names), Some("frequency"));
        assert_eq!(nearest("Frequency", names), Some("frequency"));
        assert_eq!(nearest("x-min", names), Some("x_min"));
        assert_eq!(nearest("conductivity", names), None);
        assert_eq!(nearest("", names), None);
    }

    #[test]
    fn what_fingers_do_often_decides_between_names_one_letter_away() {
        // Exchanged letters before a wrong one, a neighbouring key before a distant one, a doubled letter before both.
        assert_eq!(nearest_two("form", ["from", "fork"]), ["from"]);
        assert_eq!(nearest_two("x_mim", ["x_min", "x_mid"]), ["x_min"]);
        assert_eq!(nearest_two("coill", ["coil", "coild"]), ["coil"]);
        assert_eq!(nearest_two("coil", ["coils", "coin"]), ["coils"]);
        // The first letter is seldom wrong.
        assert_eq!(nearest_two("lawer", ["lower", "sawer"]), ["lower"]);
        // Separators and case count for little or nothing.
        assert_eq!(nearest_two("MinimumQuality", ["minimum_quality", "minimum"]), ["minimum_quality"]);
        assert_eq!(nearest_two("optimiser", ["optimizer", "optimised"]), ["optimizer"]);
    }

    #[test]
    fn names_that_are_equally_near_are_both_offered() {
        assert_eq!(nearest_two("x_mn", ["x_man", "x_min"]), ["x_man", "x_min"]);
        assert_eq!(offer("x_mn", ["x_man", "x_min"]).as_deref(), Some("did you mean `x_man` or `x_min`?"));
        assert_eq!(offer("x_mn", ["penalty"]), None);
    }

    #[test]
    fn abbreviations_are_understood_word_by_word() {
        let names = ["frequency", "minimum_quality", "max_evaluations"];
        assert_eq!(nearest("freq", names), Some("frequency"));
        assert_eq!(nearest("min_quality", names), Some("minimum_quality"));
        assert_eq!(nearest("max_eval", names), Some("max_evaluations"));
        assert_eq!(nearest("fr", names), None);
    }

    #[test]
    fn long_names_are_not_compared() {
        // Compared letter by letter, these two would take minutes.
        let (name, other) = ("a".repeat(32_000), "b".repeat(32_000));
        assert_eq!(nearest(&name, [other.as_str(), "x_min"]), None);
        assert_eq!(nearest("x_mim", [other.as_str(), "x_min"]), Some("x_min"));
    }
}
