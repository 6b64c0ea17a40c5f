//! What a journal belongs to: the version of the program, the configuration, the mesh, the B–H tables.

use std::collections::BTreeMap;
use std::path::PathBuf;

use fluxmorph_geometry::Mesh;
use serde::{Deserialize, Serialize};

use crate::config::{Config, MeshConfig, Optimizer, Output, resolved_toml};

/// Version of the program that writes.
const VERSION: &str = env!("CARGO_PKG_VERSION");

/// What a journal belongs to.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Identity {
    /// Version of the program.
    pub version: String,
    /// [`configuration_hash`].
    pub configuration: String,
    /// [`mesh_hash`] of the undeformed mesh.
    pub mesh: String,
    /// `tables_hash` of the B–H tables that are read from files; empty where there are none.
    #[serde(default)]
    pub tables: String,
    /// Number of design variables.
    pub variables: usize,
    /// Number of constraints.
    pub constraints: usize,
}

impl Identity {
    /// That of a problem with so many variables and constraints.
    pub fn new(
        config: &Config,
        (mesh, tables): (&Mesh, &BTreeMap<PathBuf, String>),
        variables: usize,
        constraints: usize,
    ) -> Self {
        let (configuration, mesh) = (configuration_hash(config), mesh_hash(mesh));
        let tables = tables_hash(config, tables);
        Self { version: VERSION.to_owned(), configuration, mesh, tables, variables, constraints }
    }

    /// Whether a journal of this identity belongs to the problem that is there now.
    ///
    /// # Errors
    /// The first difference, and what to do.
    pub fn check(&self, now: &Self) -> Result<(), String> {
        let sizes = |identity: &Self| format!("{} and {}", identity.variables, identity.constraints);
        Err(if self.version != now.version {
            format!(
                "it was written by version {} of fluxmorph, this is {}: resume it with that version",
                self.version, now.version
            )
        } else if self.configuration != now.configuration {
            format!(
                "it belongs to another configuration (hash {}, of config.toml and its overrides {}): restore the \
                 config.toml that the run was started with",
                short(&self.configuration),
                short(&now.configuration)
            )
        } else if self.mesh != now.mesh {
            describe_meshes(&self.mesh, &now.mesh)
        } else if self.tables != now.tables {
            "it belongs to other B–H tables: a file that `bh_file` names has changed; restore it, manifest.json has its hash"
                .to_owned()
        } else if sizes(self) != sizes(now) {
            format!("it has {} variables and constraints, the problem has {}", sizes(self), sizes(now))
        } else {
            return Ok(());
        })
    }
}

/// What there is to say of a run whose mesh is another now, by the hashes of both.
pub fn describe_meshes(was: &str, is: &str) -> String {
    format!(
        "it belongs to another mesh (hash {}, now {}): restore the mesh file that the run was started with",
        short(was),
        short(is)
    )
}

/// The head of a hash, for messages.
fn short(hash: &str) -> String {
    hash.chars().take(16).collect()
}

/// BLAKE3 of everything in a configuration that an evaluation or the method depends on, hexadecimal.
///
/// Title, probes, output and the limits of evaluations and time are not in it: with other ones a run may be resumed. Nor are
/// the paths of a mesh file and of B–H tables (`changed_key` names the same): their content is in [`mesh_hash`] and `tables_hash`.
pub fn configuration_hash(config: &Config) -> String {
    let mut bare = config.clone();
    let Optimizer { max_evaluations, max_time, .. } = Optimizer::default();
    (bare.optimizer.max_evaluations, bare.optimizer.max_time) = (max_evaluations, max_time);
    bare.title.clear();
    bare.probes.clear();
    bare.output = Output::default();
    if let MeshConfig::File { path, .. } = &mut bare.mesh {
        path.clear();
    }
    for path in bare.materials.values_mut().filter_map(|material| material.bh_file.as_mut()) {
        path.clear();
    }
    blake3::hash(resolved_toml(&bare).as_bytes()).to_hex().to_string()
}

/// BLAKE3 of the names of the materials with a table from a file and of its content, hexadecimal; empty where there are none.
fn tables_hash(config: &Config, tables: &BTreeMap<PathBuf, String>) -> String {
    let mut hasher = blake3::Hasher::new();
    for (name, material) in &config.materials {
        let Some(hash) = material.bh_file.as_ref().and_then(|path| tables.get(path)) else { continue };
        hasher.update(name.as_bytes()).update(b"\n").update(hash.as_bytes()).update(b"\n");
    }
    if tables.is_empty() { String::new() } else { hasher.finalize().to_hex().to_string() }
}

/// BLAKE3 of points, tetrahedra, regions with their names and cells, and surfaces with their triangles, hexadecimal.
pub fn mesh_hash(mesh: &Mesh) -> String {
    let topology = mesh.topology();
    let mut hasher = blake3::Hasher::new();
    mesh.points().as_flattened().iter().for_each(|c| {
        hasher.update(&c.to_le_bytes());
    });
    let mut number = |n: usize| {
        hasher.update(&(n as u64).to_le_bytes());
    };
    topology.tets().iter().flatten().for_each(|node| number(node.index()));
    topology.region_of().iter().for_each(|region| number(region.index()));
    for name in topology.region_names() {
        number(name.len());
        name.bytes().for_each(|byte| number(usize::from(byte)));
        for cell in topology.given_cells(name).unwrap_or_default() {
            number(cell.len());
            cell.iter().for_each(|element| number(element.index()));
        }
    }
    for name in topology.surface_names() {
        number(name.len());
        name.bytes().for_each(|byte| number(usize::from(byte)));
        let triangles = topology.surface(name).unwrap_or_default();
        number(triangles.len());
        triangles.iter().flatten().for_each(|node| number(node.index()));
    }
    hasher.finalize().to_hex().to_string()
}
