//! The tables that a task needs: they are optional in the file, and asked for by the command.

use super::error::ConfigError;
use super::tables::{Config, Design, Morph, Objective, Remesh};
use super::text::source::SourceMap;

/// The tables an optimisation needs.
#[derive(Debug, Clone, Copy)]
pub struct Optimisation<'a> {
    /// What is optimised.
    pub objective: &'a Objective,
    /// What moves.
    pub design: &'a Design,
    /// How the mesh follows.
    pub remesh: &'a Remesh,
}

/// The tables a prescribed motion needs.
#[derive(Debug, Clone, Copy)]
pub struct Morphing<'a> {
    /// What moves, and the cases.
    pub morph: &'a Morph,
    /// How the mesh follows.
    pub remesh: &'a Remesh,
}

impl Config {
    /// The tables an optimisation needs.
    ///
    /// # Errors
    /// A fault for each table that is missing.
    pub fn optimisation(&self, source: &SourceMap) -> Result<Optimisation<'_>, ConfigError> {
        if let (Some(objective), Some(design), Some(remesh)) = (&self.objective, &self.design, &self.remesh) {
            return Ok(Optimisation { objective, design, remesh });
        }
        let tables = [
            ("objective", self.objective.is_none()),
            ("design", self.design.is_none()),
            ("remesh", self.remesh.is_none()),
        ];
        let diagnostic = |(name, _): &(&str, bool)| {
            source
                .diagnostic(name, format!("missing table `{name}`: there is nothing to optimise without it"))
                .help(match self.morph {
                    Some(_) => {
                        format!("add a table [{name}]; or move the mesh as [morph] says: fluxmorph morph")
                    }
                    None => format!("add a table [{name}]"),
                })
        };
        Err(source.error(tables.iter().filter(|(_, missing)| *missing).map(diagnostic).collect()))
    }

    /// The tables a prescribed motion needs.
    ///
    /// # Errors
    /// A fault with an example when they are missing.
    pub fn morphing(&self, source: &SourceMap) -> Result<Morphing<'_>, ConfigError> {
        if let (Some(morph), Some(remesh)) = (&self.morph, &self.remesh) {
            return Ok(Morphing { morph, remesh });
        }
        let example = match self.design {
            Some(_) => "design = \"upper\": the design of [design] with all variables at the upper bound",
            None => "surface = \"top\" and displacement = [\"0 mm\", \"0 mm\", \"5 mm\"]",
        };
        let diagnostic = source
            .diagnostic("morph", "missing table `morph`: there is no motion to prescribe without it")
            .help(format!("add a table [morph], and a table [[morph.motion]] with {example}"));
        Err(source.error(vec![diagnostic]))
    }
}
