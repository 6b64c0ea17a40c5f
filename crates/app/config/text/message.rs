//! What messages quote: a text of the user's, and the names that are known.

/// Most names that a fault lists: a mesh may have many, and a hostile one as many as it has bytes.
const MOST_NAMES: usize = 30;

/// A text for a message: escaped, and not longer than a line.
pub(in crate::config) fn shown(text: &str) -> String {
    const LONGEST: usize = 60;
    let cut = text.char_indices().nth(LONGEST).map_or(text.len(), |(end, _)| end);
    let dots = if cut < text.len() { "…" } else { "" };
    format!("{}{dots}", text[..cut].escape_debug())
}

/// The known names in one line.
pub(in crate::config) fn listed(known: &[&str]) -> String {
    match known {
        [] => "none is known here".to_owned(),
        _ if known.len() > MOST_NAMES => {
            format!("known: {} and {} more", known[..MOST_NAMES].join(", "), known.len() - MOST_NAMES)
        }
        _ => format!("known: {}", known.join(", ")),
    }
}
