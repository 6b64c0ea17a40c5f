//! The name that a misspelt one was probably meant to be.

use strsim::{jaro_winkler, osa_distance};

/// Longest name that is compared letter by letter [bytes]: the comparison takes time by the product of the lengths, and a
/// longer name is no slip of the pen.
const LONGEST_COMPARED: usize = 256;

/// Most names that are compared: a hostile mesh may have as many as it has bytes.
pub(super) const MOST_COMPARED: usize = 4000;

/// The candidate that `name` was probably meant to be, if one is near enough.
pub fn nearest<'a>(name: &str, candidates: impl IntoIterator<Item = &'a str>) -> Option<&'a str> {
    nearest_two(name, candidates).into_iter().next()
}

/// The candidates that `name` was probably meant to be: one, or two that are equally near, or none.
///
/// Near means at most one wrong, missing or exchanged letter for every three (two at least for names of four letters or
/// more), whatever its case and separators, or an abbreviation of each word. Of several equally near those come first that
/// are as long, then those that the name contains, then the most similar: those that begin alike.
pub fn nearest_two<'a>(name: &str, candidates: impl IntoIterator<Item = &'a str>) -> Vec<&'a str> {
    let wanted = fold(name);
    if wanted.is_empty() || wanted.len() > LONGEST_COMPARED {
        return Vec::new();
    }
    let limit = if wanted.len() >= 4 { (wanted.len() / 3).max(2) } else { 1 };
    let candidates = candidates.into_iter().take(MOST_COMPARED).filter(|name| name.len() <= LONGEST_COMPARED);
    let mut near: Vec<(usize, [bool; 2], f64, &str)> = candidates
        .filter_map(|candidate| {
            let folded = fold(candidate);
            let distance = match osa_distance(&wanted, &folded) {
                distance if distance <= limit => distance,
                _ if abbreviates(&wanted, &folded) => limit,
                _ => return None,
            };
            let is_apart = [wanted.chars().count() != folded.chars().count(), !wanted.contains(&folded)];
            Some((distance, is_apart, jaro_winkler(&wanted, &folded), candidate))
        })
        .collect();
    near.sort_by(|a, b| (a.0, a.1).cmp(&(b.0, b.1)).then(b.2.total_cmp(&a.2)));
    near.dedup_by_key(|(.., candidate)| *candidate);
    let least = near.first().map_or(0, |(distance, ..)| *distance);
    near.into_iter().take(2).take_while(|(distance, ..)| *distance == least).map(|(.., name)| name).collect()
}

/// The help that offers what [`nearest_two`] found.
pub(in crate::config) fn offer<'a>(
    name: &str,
    candidates: impl IntoIterator<Item = &'a str>,
) -> Option<String> {
    let near = nearest_two(name, candidates);
    let named = near.iter().map(|name| format!("`{name}`")).collect::<Vec<_>>().join(" or ");
    (!near.is_empty()).then(|| format!("did you mean {named}?"))
}

/// Lower case, with one kind of separator.
fn fold(text: &str) -> String {
    text.to_lowercase().replace(['-', ' ', '.'], "_")
}

/// Whether the words of a name start words of the candidate, in their order: `min_qual` for `minimum_quality`, `freq` for
/// `frequency`, `permeability` for `relative_permeability`. Fewer than three letters say too little.
fn abbreviates(name: &str, candidate: &str) -> bool {
    let mut words = candidate.split('_');
    name.split('_').all(|short| short.len() >= 3 && words.any(|long| long.starts_with(short)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_nearest_name_is_suggested_only_when_it_is_near() {
        let names = ["frequency", "penalty", "x_min", "x_max"];
        assert_eq!(nearest("freqency", names), Some("frequency"));
        assert_eq!(nearest("x-min", names), Some("x_min"));
        assert_eq!(nearest("conductivity", names), None);
        assert_eq!(nearest("", names), None);
    }

    #[test]
    fn names_that_are_equally_near_are_both_offered() {
        assert_eq!(offer("x_mn", ["x_man", "x_min"]).as_deref(), Some("did you mean `x_man` or `x_min`?"));
        assert_eq!(offer("x_mn", ["penalty"]), None);
    }

    #[test]
    fn abbreviations_are_understood_word_by_word() {
        let names = ["frequency", "minimum_quality", "max_evaluations"];
        assert_eq!(nearest("freq", names), Some("frequency"));
        assert_eq!(nearest("min_quality", names), Some("minimum_quality"));
        assert_eq!(nearest("quality", names), Some("minimum_quality"));
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
