//! The starting configurations that `fluxmorph init` writes, with the files that belong to them.
//!
//! Their text is in `templates/`. In it `NAME.toml`, `NAME.geo`, `NAME.msh` and `runs/NAME` are replaced by the name that the
//! user chooses; `NAME` alone is text as any other. The mesh is that of the `.geo` beside it, made by Gmsh.

use std::borrow::Cow;

use clap::ValueEnum;

/// A starting configuration.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum Template {
    /// A steel plate that shields a region from a coil, at 60 Hz
    Shield,
    /// A block whose mesh is moved, without a field
    Block,
    /// An own device from a Gmsh file: a round pole over a gap
    Gmsh,
    /// The pole face of a dipole magnet, made of boxes
    Pole,
}

/// One file of a template.
pub(super) struct TemplateFile {
    /// Its extension.
    pub(super) extension: &'static str,
    /// Its content, with `NAME` in it.
    content: &'static [u8],
}

impl Template {
    /// Its name on the command line.
    pub(super) fn name(self) -> &'static str {
        match self {
            Self::Shield => "shield",
            Self::Block => "block",
            Self::Gmsh => "gmsh",
            Self::Pole => "pole",
        }
    }

    /// The template of a name.
    pub(super) fn by_name(name: &str) -> Option<Self> {
        Self::value_variants().iter().copied().find(|template| template.name() == name)
    }

    /// The configuration, then what it needs.
    pub(super) fn files(self) -> Vec<TemplateFile> {
        let file = |extension, content| TemplateFile { extension, content };
        match self {
            Self::Shield => vec![file("toml", include_bytes!("../templates/shield.toml"))],
            Self::Block => vec![file("toml", include_bytes!("../templates/block.toml"))],
            Self::Pole => vec![file("toml", include_bytes!("../templates/pole.toml"))],
            Self::Gmsh => vec![
                file("toml", include_bytes!("../templates/gmsh.toml")),
                file("geo", include_bytes!("../templates/gmsh.geo")),
                file("msh", include_bytes!("../templates/gmsh.msh")),
            ],
        }
    }

    /// The command that does the template's work.
    pub(super) fn command(self) -> &'static str {
        match self {
            Self::Block => "morph",
            Self::Shield | Self::Gmsh | Self::Pole => "run",
        }
    }
}

impl TemplateFile {
    /// The content for a configuration called `name`.
    pub(super) fn content_for(&self, name: &str) -> Cow<'static, [u8]> {
        // A mesh holds no such words, and need not be copied.
        match std::str::from_utf8(self.content) {
            Ok(text) if self.extension != "msh" => {
                let mut text = text.replace("runs/NAME", &format!("runs/{name}"));
                for extension in ["toml", "geo", "msh"] {
                    text = text.replace(&format!("NAME.{extension}"), &format!("{name}.{extension}"));
                }
                Cow::Owned(text.into_bytes())
            }
            _ => Cow::Borrowed(self.content),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_template_is_commented_and_small() {
        for template in Template::value_variants() {
            for file in template.files() {
                assert!(file.content.len() <= 150_000, "{template:?} {}", file.extension);
            }
            let text = template.files()[0].content_for("plate");
            let text = std::str::from_utf8(&text).expect("text");
            assert!(text.starts_with("# fluxmorph generate schema > "), "{template:?}");
            assert_eq!(text.lines().nth(1), Some("#:schema ./fluxmorph.schema.json"), "{template:?}");
            assert!(text.contains("runs/plate") && !text.contains("runs/NAME"), "{template:?}");
            assert!(text.lines().all(|line| line.chars().count() <= 120), "{template:?}");
        }
    }

    #[test]
    fn a_template_is_found_by_its_name() {
        for template in Template::value_variants() {
            assert_eq!(Template::by_name(template.name()), Some(*template));
        }
        assert_eq!(Template::by_name("Shield"), None);
    }
}
