//! Parts that pages of this program have in common: the document, its sections, cards, tables and links.
//!
//! maud writes all markup and escapes all text and every attribute, so that nothing from a file can become markup; what is
//! not escaped (`PreEscaped`) stands in this file alone.

use maud::{DOCTYPE, Markup, PreEscaped, Render, html};

/// How pages of this program look.
const STYLE: &str = include_str!("style.css");

/// A key figure: name, value, remark.
pub(crate) type Card = (&'static str, String, String);

/// What says in the head of a page whose it is.
pub(super) const GENERATOR: &str = "<meta name=\"generator\" content=\"fluxmorph\">";

/// The whole document; `style` and `script` are files of this program.
pub(crate) fn document(title: &str, style: &'static str, script: &'static str, content: &Markup) -> String {
    let page = html! {
        (DOCTYPE)
        html lang="en" {
            head {
                meta charset="utf-8";
                meta name="viewport" content="width=device-width, initial-scale=1";
                meta name="color-scheme" content="light dark";
                (PreEscaped(GENERATOR))
                title { (title) }
                style { (PreEscaped(STYLE)) (PreEscaped(style)) }
            }
            body {
                main { (content) }
                @if !script.is_empty() { script { (PreEscaped(script)) } }
            }
        }
    };
    // Control characters from a file belong to no document, whatever the form they are written in.
    let is_allowed =
        |c: char| c == '\n' || c == '\t' || !(c.is_control() || matches!(c, '\u{fffe}' | '\u{ffff}'));
    let page = page.into_string() + "\n";
    page.chars().map(|c| if is_allowed(c) { c } else { '\u{fffd}' }).collect()
}

/// Data for a script, as JSON: what could end the element is written by its number.
pub(super) fn json(id: &str, value: &serde_json::Value) -> Markup {
    let text = value.to_string().replace('<', "\\u003c").replace('>', "\\u003e").replace('&', "\\u0026");
    html! { script type="application/json" id=(id) { (PreEscaped(text)) } }
}

/// Cards side by side: at most five, and never one alone in the last row.
fn columns(cards: usize) -> usize {
    if cards <= 5 { cards } else { cards.div_ceil(2).min(5) }
}

/// What stands above the sections: kind and title of the work, a class with the status in words, a sentence, key figures.
pub(crate) fn header(
    kind: &str,
    title: &str,
    (class, status): (&str, &str),
    lead: &str,
    cards: &[Card],
) -> Markup {
    html! {
        header {
            p class="kind" { (kind) }
            h1 { (title) }
            p class={ "status " (class) } { (status) }
            p class="lead" { (lead) }
            div class={ "cards columns-" (columns(cards.len())) } {
                @for (name, value, remark) in cards {
                    div class="card" {
                        span class="name" { (name) }
                        strong { (value) }
                        span class="note" { (remark) }
                    }
                }
            }
        }
    }
}

/// A section with its title.
pub(crate) fn section(id: &str, title: &str, content: &Markup) -> Markup {
    html! { section id=(id) { h2 { (title) } (content) } }
}

/// A remark below a table or a figure.
pub(crate) fn note(text: &str) -> Markup {
    html! { p class="note" { (text) } }
}

/// A sentence in the place of what cannot be shown.
pub(crate) fn missing(what: &str, cause: &str) -> Markup {
    html! { p class="missing" { "Not shown: " (what) ". Reason: " (cause) "." } }
}

/// The end of a page that was made from files of `what`.
pub(crate) fn footer(what: &str) -> Markup {
    html! { footer { "Written by fluxmorph " (env!("CARGO_PKG_VERSION")) " from the files of " (what) "." } }
}

/// A table in a box of its own, which scrolls where the page is narrower; one row may be marked.
pub(crate) fn table<Cell: Render>(head: &[&str], rows: &[Vec<Cell>], marked: Option<usize>) -> Markup {
    html! {
        div class="scroll" tabindex="0" {
            table {
                thead { tr { @for cell in head { th scope="col" { (cell) } } } }
                tbody {
                    @for (i, row) in rows.iter().enumerate() {
                        tr class=[(marked == Some(i)).then_some("marked")] { @for cell in row { td { (cell) } } }
                    }
                }
            }
        }
    }
}

/// A path as an address: what is not plain is written by its bytes.
pub(crate) fn address(path: &str) -> String {
    let is_plain = |byte: u8| byte.is_ascii_alphanumeric() || b"/._-~".contains(&byte);
    path.bytes().map(|b| if is_plain(b) { char::from(b).to_string() } else { format!("%{b:02X}") }).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nothing_from_a_file_becomes_markup() {
        let hostile = "\"><script>alert('x')</script>&\u{1}\u{ffff}";
        let escaped = "&quot;&gt;&lt;script&gt;alert('x')&lt;/script&gt;&amp;\u{fffd}\u{fffd}";
        let page = document(hostile, "", "", &html! { p title=(hostile) {} });
        assert!(page.contains(&format!("<title>{escaped}</title>")), "{page}");
        assert!(page.ends_with(&format!("<p title=\"{escaped}\"></p></main></body></html>\n")), "{page}");
        let data = json("d", &serde_json::json!({ "name": "</script><b>&" })).into_string();
        let expected = r#"{"name":"\u003c/script\u003e\u003cb\u003e\u0026"}</script>"#;
        assert_eq!(data, format!(r#"<script type="application/json" id="d">{expected}"#));
    }

    #[test]
    fn an_address_has_plain_characters_only() {
        assert_eq!(address("a b/ü?.stl"), "a%20b/%C3%BC%3F.stl");
    }
}
