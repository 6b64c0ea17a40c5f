//! The whole configuration, and what its tables ask of each other.

use std::collections::BTreeMap;

use serde_json::json;

use super::accuracy::Accuracy;
use super::analysis::Analysis;
use super::boundary::Boundaries;
use super::coil::{Coil, IN_SERIES};
use super::constraint::{Constraint, Limit, check_bounds};
use super::design::Design;
use super::force::ForceBody;
use super::load::Load;
use super::material::{self, Material, Region};
use super::mesh::MeshConfig;
use super::morph::Morph;
use super::multipole::MultipoleSet;
use super::objective::{Combination, Objective, Probe};
use super::open::Open;
use super::optimizer::Optimizer;
use super::output::Output;
use super::remesh::Remesh;
use crate::config::section::Section;
use crate::config::table::rules::{Rules, present};
use crate::config::table::table;
use crate::config::text::source::SourceMap;

/// The tables that only mean something to a field problem.
const OF_THE_FIELD: [&str; 10] = [
    "coils",
    "loads",
    "forces",
    "multipoles",
    "objective",
    "boundaries",
    "open",
    "constraints",
    "materials",
    "regions",
];

table! {
    /// The configuration of a run of Fluxmorph. A quantity is a text with a unit, such as "10 mm", or a bare number in SI.
    pub struct Config {
        /// What the run is called in messages. Default: the name of the file.
        title: String = TEXT, else String::new();
        /// The mesh.
        mesh: MeshConfig = TABLE, need "[mesh]";
        /// The field problem.
        analysis: Analysis = TABLE, else Analysis::static_field();
        /// Materials by name.
        materials: BTreeMap<String, Material> = NAMED => BTreeMap::new();
        /// Regions of the mesh by name; a region that is not here is air.
        regions: BTreeMap<String, Region> = NAMED => BTreeMap::new();
        /// The sources.
        coils: Vec<Coil> = TABLES => Vec::new();
        /// Load cases.
        loads: Vec<Load> = TABLES => Vec::new();
        /// The boundary conditions.
        boundaries: Boundaries = TABLE => Boundaries::default();
        /// Bodies on which the force is reported.
        forces: Vec<ForceBody> = TABLES => Vec::new();
        /// Circles and balls in which the field is expanded.
        multipoles: Vec<MultipoleSet> = TABLES => Vec::new();
        /// Open space around the mesh.
        open: Option<Open> = TABLE;
        /// What is optimised; needed by `run` and `gradient`.
        objective: Option<Objective> = TABLE;
        /// What must keep within bounds meanwhile.
        constraints: Vec<Constraint> = TABLES => Vec::new();
        /// What moves; needed by `run` and `gradient`.
        design: Option<Design> = TABLE;
        /// How the mesh follows; needed with `[design]` and with `[morph]`.
        remesh: Option<Remesh> = TABLE;
        /// A prescribed motion; needed by `morph`.
        morph: Option<Morph> = TABLE;
        /// The algorithm.
        optimizer: Optimizer = TABLE => Optimizer::default();
        /// How exact the result is to be, and what is done to know it.
        accuracy: Accuracy = TABLE => Accuracy::default();
        /// Points at which the flux density is reported.
        probes: Vec<Probe> = TABLES => Vec::new();
        /// Where results go.
        output: Output = TABLE => Output::default();
    }
    check = Config::check;
    rules = tables_together;
}

/// What moves needs a body to move in, and what belongs to a field needs the field.
fn tables_together(rules: Rules) -> Rules {
    let several = json!({ "required": ["frequencies"] });
    let with_loads = json!({ "required": ["loads", "analysis"], "properties": {
        "loads": { "minItems": 1 }, "analysis": several,
    } });
    // Under a load a voltage may drive what a current drives in `[[coils]]`.
    let in_series: BTreeMap<&str, [&str; 1]> = IN_SERIES.into_iter().map(|key| (key, ["voltage"])).collect();
    rules
        .needs("design", &["remesh"])
        .needs("morph", &["remesh"])
        .add(json!({ "not": with_loads }))
        .add(json!({
            "if": { "required": ["morph"], "not": { "anyOf": present(&OF_THE_FIELD) } },
            "else": { "required": ["analysis"] },
        }))
        .add(json!({
            "if": { "required": ["loads"] },
            "else": { "properties": { "coils": { "items": { "dependentRequired": in_series } } } },
        }))
}

impl Config {
    /// What tables ask of each other.
    fn check(&mut self, root: &Section<'_>) {
        self.check_analysis(root);
        // Unknown frequencies are NaN: nothing is said of them, and nothing follows from them.
        self.check_loads(root);
        self.check_series(root);
        let frequencies = self.frequencies();
        let is_known = root.has("analysis") && frequencies.iter().all(|frequency| !frequency.is_nan());
        let frequencies = if is_known { &frequencies[..] } else { &[] };
        material::check_regions(root, &self.regions, &self.materials, frequencies);
        let coils = self.coils.iter().map(|coil| &coil.name);
        root.named_twice("coils", coils, "coils", "a different name for each coil");
        let forces = self.forces.iter().map(|force| &force.name);
        root.named_twice("forces", forces, "forces", "a different name for each body");
        let multipoles = self.multipoles.iter().map(|set| &set.name);
        root.named_twice("multipoles", multipoles, "multipoles", "a different name for each expansion");
        self.check_functionals(root, is_known);
        let constraints = self.constraints.iter().map(|constraint| &constraint.name);
        root.named_twice("constraints", constraints, "constraints", "a different `name` for each constraint");
        check_bounds(root, &self.constraints);
        // One of an unknown kind has no name.
        self.constraints.retain(|constraint| !constraint.name.is_empty());
        if let Some(mover) = ["design", "morph"].into_iter().find(|key| root.has(key))
            && !root.has("remesh")
        {
            let why = if mover == "design" { "the design" } else { "the motion" };
            let example = format!("[remesh] with region = \"remesh\": the mesh must follow {why}");
            root.missing(&["remesh"], &example);
        }
        if !self.constraints.is_empty()
            && !self.optimizer.algorithm.takes_constraints()
            && let Some(section) = root.inner("optimizer")
        {
            let message = format!("`{}` cannot keep constraints", self.optimizer.algorithm.name());
            section.wrong("algorithm", message, "mma, ccsaq or slsqp, or no [[constraints]]");
        }
        if self.objective.as_ref().is_some_and(|objective| objective.combine == Combination::WorstCase)
            && !self.optimizer.algorithm.takes_constraints()
            && let Some(section) = root.inner("optimizer")
        {
            let message =
                format!("`{}` has no bound on the terms of a worst case", self.optimizer.algorithm.name());
            section.wrong("algorithm", message, "mma, ccsaq or slsqp, or objective.combine = \"sum\"");
        }
        let probes = self.probes.iter().map(|probe| &probe.name);
        root.named_twice("probes", probes, "probes", "a different name for each probe");
    }

    /// Only a motion alone may be without a field problem.
    fn check_analysis(&self, root: &Section<'_>) {
        if root.has("analysis") {
            return;
        }
        if !root.has("morph") {
            root.missing(&["analysis"], "[analysis]");
        } else if let Some(table) = OF_THE_FIELD.into_iter().find(|table| root.has(table)) {
            let example = format!(
                "[analysis] with frequency = \"60 Hz\", as there is `{table}`: only a motion alone needs none"
            );
            root.missing(&["analysis"], &example);
        }
    }

    fn check_functionals(&self, root: &Section<'_>, is_known: bool) {
        let cases = if is_known { self.load_cases() } else { Vec::new() };
        if let Some(objective) = &self.objective {
            if !objective.is_of_field()
                && self.accuracy.tolerance.is_some()
                && let Some(section) = root.inner("accuracy")
            {
                let message =
                    "the objective is of the shape alone, and has no error that a mesh could be refined for";
                section.wrong("tolerance", message, "no such key, or an objective of the field");
            }
            for (index, term) in objective.terms().iter().enumerate() {
                if let Some(section) = root.inner(&objective.path(index)) {
                    term.functional.check_load(&section, &cases);
                }
            }
        }
        for (index, constraint) in self.constraints.iter().enumerate() {
            if let Limit::Functional { functional, .. } = &constraint.limit
                && let Some(section) = root.inner(&format!("constraints[{index}]"))
            {
                functional.check_load(&section, &cases);
            }
        }
    }

    /// Completes what follows from the folder and the name of the file.
    pub(in crate::config) fn complete(&mut self, root: &Section<'_>, source: &SourceMap) {
        if self.title.is_empty() {
            self.title.clone_from(&source.stem);
        }
        if let MeshConfig::File { path, .. } = &mut self.mesh {
            *path = source.directory.join(&*path);
        }
        for path in self.materials.values_mut().filter_map(|material| material.bh_file.as_mut()) {
            *path = source.directory.join(&*path);
        }
        let surfaces = self.design.as_ref().map(|design| design.surface.as_slice()).unwrap_or_default();
        let most_evaluations = self.optimizer.max_evaluations;
        self.output.complete(root, &source.directory, &source.stem, surfaces, most_evaluations);
    }
}
