//! A writer of elements: the only place where text becomes markup.
//!
//! What it writes is HTML 5 and well-formed XML at once. Elements are closed by the writer, and all text and every
//! attribute is escaped, so that nothing from a file can become markup.

/// A piece of markup that grows.
#[derive(Debug, Default)]
pub(crate) struct Html {
    text: String,
}

/// Attributes of an element, by name.
pub(crate) type Attributes<'a> = &'a [(&'static str, &'a str)];

impl Html {
    /// An element with what `content` writes into it.
    pub(crate) fn element(
        &mut self,
        tag: &'static str,
        attributes: Attributes<'_>,
        content: impl FnOnce(&mut Self),
    ) {
        self.tag(tag, attributes, ">");
        content(self);
        self.text += "</";
        self.text += tag;
        self.text += ">";
    }

    /// An element with text only.
    pub(crate) fn leaf(&mut self, tag: &'static str, attributes: Attributes<'_>, text: &str) {
        self.element(tag, attributes, |html| html.text(text));
    }

    /// An element without content, such as `meta` or `path`.
    pub(crate) fn void(&mut self, tag: &'static str, attributes: Attributes<'_>) {
        self.tag(tag, attributes, "/>");
    }

    /// Text.
    pub(crate) fn text(&mut self, text: &str) {
        text.chars().for_each(|c| push_escaped(&mut self.text, c));
    }

    /// A line break in the source.
    pub(crate) fn newline(&mut self) {
        self.text.push('\n');
    }

    /// A style sheet of this program.
    pub(crate) fn style(&mut self, code: &'static str) {
        self.element("style", &[], |html| {
            html.text += "/*<![CDATA[*/\n";
            html.text += code;
            html.text += "/*]]>*/";
        });
    }

    /// A script of this program.
    pub(crate) fn script(&mut self, code: &'static str) {
        self.element("script", &[], |html| {
            html.text += "//<![CDATA[\n";
            html.text += code;
            html.text += "//]]>";
        });
    }

    /// Data for a script, as JSON: what could end the element is written by its number.
    pub(crate) fn data(&mut self, id: &str, value: &serde_json::Value) {
        self.element("script", &[("type", "application/json"), ("id", id)], |html| {
            for c in value.to_string().chars() {
                match c {
                    '<' | '>' | '&' => html.text += &format!("\\u{:04x}", u32::from(c)),
                    other => html.text.push(other),
                }
            }
        });
    }

    /// The whole document.
    pub(crate) fn into_document(self) -> String {
        format!("<!DOCTYPE html>\n{}\n", self.text)
    }

    /// The markup so far, for tests.
    #[cfg(test)]
    pub(crate) fn markup(&self) -> &str {
        &self.text
    }

    fn tag(&mut self, tag: &'static str, attributes: Attributes<'_>, end: &str) {
        self.text.push('<');
        self.text += tag;
        for (name, value) in attributes {
            self.text.push(' ');
            self.text += name;
            self.text += "=\"";
            value.chars().for_each(|c| push_escaped(&mut self.text, c));
            self.text.push('"');
        }
        self.text += end;
    }
}

fn push_escaped(text: &mut String, c: char) {
    match c {
        '&' => *text += "&amp;",
        '<' => *text += "&lt;",
        '>' => *text += "&gt;",
        '"' => *text += "&quot;",
        '\'' => *text += "&#39;",
        '\t' | '\n' => text.push(c),
        // No character of XML, whatever the form it is written in.
        c if c.is_control() || matches!(c, '\u{fffe}' | '\u{ffff}') => text.push('\u{fffd}'),
        c => text.push(c),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nothing_from_a_file_becomes_markup() {
        let mut html = Html::default();
        let hostile = "\"><script>alert('x')</script>&\u{1}\u{ffff}";
        html.element("p", &[("title", hostile)], |html| html.text(hostile));
        html.data("d", &serde_json::json!({ "name": "</script><b>&" }));
        let escaped = "&quot;&gt;&lt;script&gt;alert(&#39;x&#39;)&lt;/script&gt;&amp;\u{fffd}\u{fffd}";
        let data = r#"<script type="application/json" id="d">{"name":"\u003c/script\u003e\u003cb\u003e\u0026"}</script>"#;
        assert_eq!(html.markup(), format!("<p title=\"{escaped}\">{escaped}</p>{data}"));
    }
}
