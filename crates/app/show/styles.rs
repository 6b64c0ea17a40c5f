//! The few styles of messages: a verdict, a warning, what matters most.

use anstyle::{AnsiColor, Style};

use crate::diagnostics;
use crate::printable::printable;

/// What a text looks like by its meaning. Without colours, as by default, all of them change nothing.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Styles {
    /// As it should be.
    pub good: Style,
    /// To be looked at.
    pub warning: Style,
    /// Wrong.
    pub bad: Style,
    /// The most important number.
    pub strong: Style,
    /// Less important than the rest.
    pub faint: Style,
}

impl Styles {
    /// With colours.
    pub const COLOURED: Self = Self {
        good: AnsiColor::Green.on_default(),
        warning: AnsiColor::Yellow.on_default().bold(),
        bad: AnsiColor::Red.on_default().bold(),
        strong: Style::new().bold(),
        faint: Style::new().dimmed(),
    };

    /// Colours on a terminal that shows them, unless `NO_COLOR` is set to something.
    pub fn for_stderr() -> Self {
        match diagnostics::Style::for_stderr() {
            diagnostics::Style::Plain => Self::default(),
            diagnostics::Style::Coloured => Self::COLOURED,
        }
    }

    /// The line of a warning.
    pub fn warning_line(&self, message: &str) -> String {
        format!("{} {}", styled(self.warning, "warning:"), printable(message))
    }
}

/// A text in a style; of its own letters none acts on a terminal.
pub(super) fn styled(style: Style, text: &str) -> String {
    format!("{style}{}{style:#}", printable(text))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_style_ends_where_its_text_ends() {
        assert_eq!(styled(Styles::COLOURED.strong, "0.5"), "\u{1b}[1m0.5\u{1b}[0m");
        assert_eq!(Styles::default().warning_line("no air"), "warning: no air");
    }
}
