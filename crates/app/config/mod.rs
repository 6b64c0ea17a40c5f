//! The configuration: a TOML text becomes a typed [`Config`] in SI, or a report of all that is wrong with it.
//!
//! The text is parsed into a tree that knows the place of every value (`tree`); overrides are laid over it; the
//! readers of the single tables (`mesh`, `design`, …) walk it through `section`, which gathers faults.
//! Names of regions and surfaces are known once the mesh is: [`Source`] keeps the places for those checks.

mod analysis;
mod boundary;
mod choice;
mod coil;
mod confinement;
mod constraint;
mod design;
mod fault;
mod functional;
mod initial;
mod keys;
mod linear_solver;
mod material;
mod mesh;
mod morph;
mod nearest;
mod objective;
mod optimizer;
mod output;
mod petsc;
mod quantity;
pub(crate) mod range;
mod remesh;
pub(crate) mod section;
mod source;
mod syntax;
mod tree;

use std::collections::{BTreeMap, HashSet};
use std::io::Read;
use std::path::{Path, PathBuf};

use fluxmorph_geometry::io::open_regular;
use schemars::{JsonSchema, Schema};
use serde::Serialize;
use serde_json::json;

pub use analysis::{Analysis, ElementOrder, Frequencies};
pub use boundary::{Boundaries, UniformField};
pub use coil::{
    Axis, AxisWord, Circular, Coil, CoilPath, CoilShape, Corner, CornerWord, Racetrack, Rectangular,
    RegionCoil, ShapeWord,
};
pub use confinement::OutputNamedBy;
pub use constraint::{BodyKind, Constraint, Limit, ThicknessKind, UpperBound};
pub use design::{Design, DesignDirection, DirectionWord, RimMotion, SymmetryPlane};
pub use fault::{Fault, Place};
pub use functional::{Functional, ObjectiveKind, Weighting};
pub use initial::InitialDesign;
pub use linear_solver::{FactorReuse, LinearSolver, SolverMethod};
pub use material::{Material, Region, RegionModel};
pub use mesh::{
    BlockMesh, BoxOfRegion, BoxesMesh, Generator, LengthUnit, MeshConfig, Patch, ShieldMesh, SizeAlong,
    SphereMesh,
};
pub use morph::{
    AutoWord, Case, DesignMotion, DesignWord, Increments, Morph, Paper, PrescribedMotion, Rotation, Scale,
    Target, Tune, TunedParameter,
};
pub use nearest::{nearest, nearest_two};
pub use objective::{Goal, Objective, Probe, Sum, Term};
pub use optimizer::{Algorithm, MOST_EVALUATIONS, Optimizer};
pub use output::{FieldsKept, Output};
pub use petsc::{Petsc, PetscKrylov, PetscSolver, PetscSubSolver};
pub use quantity::{Dimension, QuantityError, parse_quantity};
pub use remesh::{Motion, Remesh, RemeshExtent, StiffnessLaw, Subregion};
pub use source::{ConfigError, Document, FaultReport, Faulty, Source};

use confinement::WrittenPaths;
use fault::Faults;
use section::Section;

use crate::schema::form::a_text;
use crate::schema::rules::Rules;

/// Largest configuration that is read [bytes]: a hundred times the longest sensible one.
const LARGEST_FILE: u64 = 1024 * 1024;

/// Most values that the cases of a motion may repeat: every case is the whole configuration again, with the places of its
/// values, and this many take a hundred megabytes.
const MOST_REPEATED: usize = 500_000;

/// Faults of a configuration from which on its cases are not read: each would find them again.
const MANY_FAULTS: usize = 100;

/// The tables that only mean something to a field problem.
const OF_THE_FIELD: [&str; 6] = ["coils", "objective", "boundaries", "constraints", "materials", "regions"];

/// A complete configuration in SI, every default filled in.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
#[schemars(
    description = "The configuration of a run of Fluxmorph. A quantity is a text with a unit, such as \"10 mm\", or a bare number in SI.",
    transform = tables_together
)]
pub struct Config {
    /// What the run is called in messages. Default: the name of the file.
    #[schemars(with = "Option<String>")]
    pub title: String,
    /// The mesh.
    pub mesh: MeshConfig,
    /// The field problem.
    #[schemars(with = "Option<Analysis>")]
    pub analysis: Analysis,
    /// Materials by name.
    #[schemars(default, extend("propertyNames" = a_text()))]
    pub materials: BTreeMap<String, Material>,
    /// Regions of the mesh by name; a region that is not here is air.
    #[schemars(default, extend("propertyNames" = a_text()))]
    pub regions: BTreeMap<String, Region>,
    /// The sources.
    #[schemars(default)]
    pub coils: Vec<Coil>,
    /// The boundary conditions.
    #[schemars(default)]
    pub boundaries: Boundaries,
    /// What is optimised; needed by `run` and `gradient`.
    pub objective: Option<Objective>,
    /// What must keep within bounds meanwhile.
    #[schemars(default)]
    pub constraints: Vec<Constraint>,
    /// What moves; needed by `run` and `gradient`.
    pub design: Option<Design>,
    /// How the mesh follows; needed with `[design]` and with `[morph]`.
    pub remesh: Option<Remesh>,
    /// A prescribed motion; needed by `morph`.
    pub morph: Option<Morph>,
    /// The algorithm.
    #[schemars(default)]
    pub optimizer: Optimizer,
    /// Points at which the flux density is reported.
    #[schemars(default)]
    pub probes: Vec<Probe>,
    /// Where results go.
    #[schemars(default)]
    pub output: Output,
}

/// What moves needs a body to move in, and what belongs to a field needs the field.
fn tables_together(schema: &mut Schema) {
    let of_the_field = OF_THE_FIELD.map(|table| json!({ "required": [table] }));
    Rules::of(schema).needs("design", &["remesh"]).needs("morph", &["remesh"]).add(json!({
        "if": { "required": ["morph"], "not": { "anyOf": of_the_field } },
        "else": { "required": ["analysis"] },
    }));
}

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

impl Config {
    /// Read a file, and lay overrides `key=value` over it.
    ///
    /// Paths in the file are relative to its folder, and absolute in the result.
    ///
    /// # Errors
    /// When the file cannot be read, or with all faults of its content at once.
    pub fn from_file(path: &Path, overrides: &[String]) -> Result<(Self, Source), ConfigError> {
        let text = read_text(path)?;
        if overrides.iter().map(String::len).sum::<usize>() as u64 > LARGEST_FILE {
            return Err(ConfigError::TooManyOverrides { limit: LARGEST_FILE });
        }
        let absolute = std::path::absolute(path)
            .map_err(|source| ConfigError::Read { path: path.to_owned(), source })?;
        let directory = absolute.parent().map(Path::to_owned).unwrap_or_default();
        let stem = path.file_stem().map_or_else(|| "run".into(), |stem| stem.to_string_lossy());
        read(path.display().to_string(), text, directory, &stem, overrides)
    }

    /// Read again the text of a configuration that a run has saved: `name` stands for the file in messages, paths are
    /// relative to `directory`, `stem` is the name of the file that it was read from, without extension.
    ///
    /// # Errors
    /// All faults of the text at once.
    pub fn again(
        name: String,
        text: String,
        directory: PathBuf,
        stem: &str,
        overrides: &[String],
    ) -> Result<(Self, Source), ConfigError> {
        read(name, text, directory, stem, overrides)
    }

    /// Read a text; `name` stands for the file in messages, and paths stay relative.
    ///
    /// # Errors
    /// All faults of the text at once.
    pub fn from_str(text: &str, name: &str) -> Result<(Self, Source), ConfigError> {
        let stem = Path::new(name).file_stem().map_or_else(|| "run".into(), |stem| stem.to_string_lossy());
        read(name.to_owned(), text.to_owned(), PathBuf::new(), &stem, &[])
    }

    /// The tables an optimisation needs.
    ///
    /// # Errors
    /// A fault for each table that is missing.
    pub fn optimisation(&self, source: &Source) -> Result<Optimisation<'_>, ConfigError> {
        if let (Some(objective), Some(design), Some(remesh)) = (&self.objective, &self.design, &self.remesh) {
            return Ok(Optimisation { objective, design, remesh });
        }
        let tables = [
            ("objective", self.objective.is_none()),
            ("design", self.design.is_none()),
            ("remesh", self.remesh.is_none()),
        ];
        let fault = |(name, _): &(&str, bool)| {
            source
                .fault(name, format!("missing table `{name}`: there is nothing to optimise without it"))
                .help(match self.morph {
                    Some(_) => {
                        format!("add a table [{name}]; or move the mesh as [morph] says: fluxmorph morph")
                    }
                    None => format!("add a table [{name}]"),
                })
        };
        Err(source.error(tables.iter().filter(|(_, missing)| *missing).map(fault).collect()))
    }

    /// The tables a prescribed motion needs.
    ///
    /// # Errors
    /// A fault with an example when they are missing.
    pub fn morphing(&self, source: &Source) -> Result<Morphing<'_>, ConfigError> {
        if let (Some(morph), Some(remesh)) = (&self.morph, &self.remesh) {
            return Ok(Morphing { morph, remesh });
        }
        let example = match self.design {
            Some(_) => "design = \"upper\": the design of [design] with all variables at the upper bound",
            None => "surface = \"top\" and displacement = [\"0 mm\", \"0 mm\", \"5 mm\"]",
        };
        let fault = source
            .fault("morph", "missing table `morph`: there is no motion to prescribe without it")
            .help(format!("add a table [morph], and a table [[morph.motion]] with {example}"));
        Err(source.error(vec![fault]))
    }
}

/// The tables a prescribed motion needs.
#[derive(Debug, Clone, Copy)]
pub struct Morphing<'a> {
    /// What moves, and the cases.
    pub morph: &'a Morph,
    /// How the mesh follows.
    pub remesh: &'a Remesh,
}

/// The configuration as TOML with every default written out, in SI; it reads back as the same [`Config`].
pub fn resolved_toml(config: &Config) -> String {
    toml::to_string(config).expect("every value of a configuration has a TOML form")
}

fn read_text(path: &Path) -> Result<String, ConfigError> {
    if let Some(extension) = path.extension().filter(|e| *e == "geo" || *e == "msh") {
        let extension = extension.to_string_lossy().into_owned();
        return Err(ConfigError::GmshFile { path: path.to_owned(), extension });
    }
    let unreadable = |source| ConfigError::Read { path: path.to_owned(), source };
    let mut bytes = Vec::new();
    // One byte more than allowed tells a file that is too large, without trusting the size it reports.
    let file = open_regular(path).map_err(unreadable)?;
    file.take(LARGEST_FILE + 1).read_to_end(&mut bytes).map_err(unreadable)?;
    if bytes.len() as u64 > LARGEST_FILE {
        return Err(ConfigError::TooLarge { path: path.to_owned(), limit: LARGEST_FILE });
    }
    String::from_utf8(bytes).map_err(|error| ConfigError::NotText {
        path: path.to_owned(),
        offset: error.utf8_error().valid_up_to(),
    })
}

fn read(
    name: String,
    text: String,
    directory: PathBuf,
    stem: &str,
    overrides: &[String],
) -> Result<(Config, Source), ConfigError> {
    let mut documents = vec![Document::whole(name, text)];
    documents.extend(overrides.iter().map(|typed| tree::override_document(typed)));
    let bare = Source {
        documents: documents.into(),
        places: BTreeMap::new(),
        written: WrittenPaths::default(),
        directory,
        stem: stem.to_owned(),
        cases: [].into(),
    };
    let root = parse_documents(&bare).map_err(|faults| bare.error(faults))?;
    let mut source = bare.of_tree(&root);
    let mut cases = Vec::new();

    let (mut config, mut faults) = read_tree(&root, &source);
    let (count, values) = (morph::case_count(&root), tree::value_count(&root));
    if count.saturating_mul(values) > MOST_REPEATED {
        let message = format!("{count} cases repeat a configuration of {values} values");
        let most = format!("at most {MOST_REPEATED} values in all cases together");
        faults.push(source.fault("morph.case", message).expected(most));
        fault::sort(&mut faults);
        return Err(source.error(faults));
    }
    if faults.len() > MANY_FAULTS {
        return Err(source.error(faults));
    }
    let mut known: HashSet<Fault> = faults.iter().cloned().collect();
    for (index, tree) in morph::case_trees(root).enumerate() {
        let (tree, overlay) = match tree {
            Ok(tree) => tree,
            Err(fault) => {
                faults.push(*fault);
                continue;
            }
        };
        let (case, own) = read_tree(&tree, &bare);
        // What is wrong without the case has been said.
        faults.extend(own.into_iter().filter(|fault| known.insert(fault.clone())));
        cases.push(bare.of_tree(&tree));
        let slot = config.as_mut().and_then(|config| config.morph.as_mut()?.cases.get_mut(index));
        if let (Some(slot), Some(case)) = (slot, case) {
            slot.complete(overlay, case);
        }
    }
    source.cases = cases.into();
    match config {
        Some(config) if faults.is_empty() => Ok((config, source)),
        unfinished => {
            fault::sort(&mut faults);
            let unfinished = unfinished.map(Box::new);
            Err(ConfigError::Faults(Box::new(FaultReport { unfinished, ..FaultReport::new(source, faults) })))
        }
    }
}

/// The configuration of one tree, and its faults in the order of the text.
fn read_tree(tree: &tree::Table, source: &Source) -> (Option<Config>, Vec<Fault>) {
    let faults = Faults::default();
    let place = Place { document: 0, span: 0..0 };
    let config = read_root(Section::new(String::new(), tree, place, &faults), source);
    (config, faults.into_sorted())
}

/// Parse the file and lay the overrides over it.
fn parse_documents(source: &Source) -> Result<tree::Table, Vec<Fault>> {
    let mut root = tree::Table::new();
    let mut faults = Vec::new();
    for (index, document) in source.documents.iter().enumerate() {
        match tree::parse(index, &document.text) {
            Ok(table) if index == 0 => root = table,
            Ok(table) => faults.extend(tree::overlay(&mut root, table, "").err().map(|fault| *fault)),
            Err(errors) => faults.extend(errors),
        }
    }
    if faults.is_empty() { Ok(root) } else { Err(faults) }
}

/// Read all tables; `None` when one that is required is missing, which then is among the faults.
fn read_root(root: Section<'_>, source: &Source) -> Option<Config> {
    let title = root.text("title").unwrap_or_else(|| source.stem.clone());
    let mesh = required(&root, "mesh", |section| MeshConfig::read(section, &source.directory));
    let analysis = read_analysis(&root);
    // Unknown frequencies are NaN: nothing is said of them, and nothing follows from them.
    let frequencies = analysis.as_ref().map_or(&[][..], Analysis::frequencies);
    let frequencies = if frequencies.iter().any(|f| f.is_nan()) { &[] } else { frequencies };
    let materials = material::read_materials(&root);
    let regions = material::read_regions(&root, &materials, frequencies);
    let coils = coil::read_coils(&root);
    let boundaries = match root.table("boundaries") {
        Some(section) => {
            let boundaries = Boundaries::read(&section);
            section.finish();
            boundaries
        }
        None => Boundaries::default(),
    };
    let objective = root.table("objective").map(|section| Objective::read(section, frequencies));
    let constraints = constraint::read_constraints(&root, frequencies);
    let design = root.table("design").map(Design::read);
    let remesh = root.table("remesh").map(Remesh::read);
    if let Some(mover) = ["design", "morph"].into_iter().find(|key| root.has(key))
        && !root.has("remesh")
    {
        let why = if mover == "design" { "the design" } else { "the motion" };
        root.missing("remesh", &format!("[remesh] with region = \"remesh\": the mesh must follow {why}"));
    }
    let morph = root.table("morph").map(Morph::read);
    let optimizer =
        root.table("optimizer").map(|s| Optimizer::read(s, constraints.len())).unwrap_or_default();
    let probes = objective::read_probes(&root);
    let surfaces = design.as_ref().map(|design| design.surface.as_slice()).unwrap_or_default();
    let output = match root.table("output") {
        Some(section) => Output::read(section, &source.directory, &source.stem, surfaces),
        None => Output::new(&source.directory, &source.stem, surfaces),
    };
    root.finish();
    Some(Config {
        title,
        mesh: mesh?,
        analysis: analysis?,
        materials,
        regions,
        coils,
        boundaries,
        objective,
        constraints,
        design,
        remesh,
        morph,
        optimizer,
        probes,
        output,
    })
}

/// The field problem; only a motion alone may be without.
fn read_analysis(root: &Section<'_>) -> Option<Analysis> {
    if root.has("analysis") || !root.has("morph") {
        return required(root, "analysis", Analysis::read);
    }
    let Some(table) = OF_THE_FIELD.into_iter().find(|table| root.has(table)) else {
        return Some(Analysis::default());
    };
    root.missing(
        "analysis",
        &format!(
            "[analysis] with frequency = \"60 Hz\", as there is `{table}`: only a motion alone needs none"
        ),
    );
    None
}

fn required<T>(root: &Section<'_>, key: &'static str, read: impl FnOnce(&Section<'_>) -> T) -> Option<T> {
    if !root.has(key) {
        root.missing(key, &format!("[{key}]"));
    }
    let section = root.table(key)?;
    let value = read(&section);
    section.finish();
    Some(value)
}
