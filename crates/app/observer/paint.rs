//! The few colours of messages: a verdict, a warning, what matters most.

use crate::diagnostics::Style;

/// What a text means.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Colour {
    /// As it should be: green.
    Good,
    /// To be looked at: yellow.
    Warning,
    /// Wrong: red.
    Bad,
    /// The most important number: bold.
    Strong,
    /// Less important than the rest: faint.
    Faint,
}

impl Colour {
    /// Parameters of the control sequence "select graphic rendition" (ECMA-48, 8.3.117).
    fn code(self) -> &'static str {
        match self {
            Self::Good => "32",
            Self::Warning => "1;33",
            Self::Bad => "1;31",
            Self::Strong => "1",
            Self::Faint => "2",
        }
    }
}

/// Whether there are colours.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Paint(Style);

impl Paint {
    /// Text only.
    pub const PLAIN: Self = Self(Style::Plain);
    /// Colours.
    pub const COLOURED: Self = Self(Style::Coloured);

    /// Colours on a terminal that shows them, unless `NO_COLOR` is set to something.
    pub fn for_stderr() -> Self {
        Self(Style::for_stderr())
    }

    /// A text in its colour.
    pub fn paint(self, colour: Colour, text: &str) -> String {
        match self.0 {
            Style::Coloured if !text.is_empty() => format!("\u{1b}[{}m{text}\u{1b}[0m", colour.code()),
            _ => text.to_owned(),
        }
    }

    /// The line of a warning.
    pub fn warning(self, message: &str) -> String {
        format!("{} {message}", self.paint(Colour::Warning, "warning:"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn colours_end_where_their_text_ends() {
        assert_eq!(Paint::COLOURED.paint(Colour::Strong, "0.5"), "\u{1b}[1m0.5\u{1b}[0m");
        assert_eq!(Paint::COLOURED.paint(Colour::Bad, ""), "");
        assert_eq!(Paint::PLAIN.warning("no air"), "warning: no air");
    }
}
