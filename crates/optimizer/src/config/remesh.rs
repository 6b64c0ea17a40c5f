//! `[remesh]`: the fictitious elastic body that carries the motion into the mesh (Eq. 3).

use serde::Serialize;

use super::choice::choice;
use super::range::Range;
use super::section::{Section, first_duplicate};

/// Poisson's ratio of a stable body.
const POISSON: Range = Range::open(-1.0, 0.5);

/// The elastic body.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Remesh {
    /// The part of the mesh that moves.
    #[serde(flatten)]
    pub extent: RemeshExtent,
    /// Poisson's ratio. Default 0.3, the paper's.
    pub poisson: f64,
    /// Young's modulus, before it is weighted by `stiffness`. Default 1: without forces its unit cancels.
    pub young: f64,
    /// Fictitious force on every node that is free to move, in units of `young` times square metres. Default none.
    pub force: [f64; 3],
    /// How the modulus depends on the element. Default `inverse_size`: small elements keep their shape and
    /// large ones take the motion.
    pub stiffness: StiffnessLaw,
    /// Which way the nodes may move. Default `free`: the paper's elasticity.
    pub motion: Motion,
    /// Most rounds of an optimisation, each with a new reference mesh. Default 20; 0 keeps the undeformed mesh as the
    /// only reference.
    pub rounds: usize,
    /// Largest share of the way to the first inverted element that a design may lie from the reference of its round, 0
    /// to 1. Default 0.9.
    pub inversion_share: f64,
    /// Surfaces whose nodes stay in their plane. Default none.
    pub slide: Vec<String>,
    /// Surfaces whose nodes stay. Default none; the outside of the body is fixed unless it is named elsewhere.
    pub fixed: Vec<String>,
    /// Surfaces of the body's outside whose nodes move freely. Default none.
    pub free: Vec<String>,
    /// Parts with their own constants. Default none.
    pub subregions: Vec<Subregion>,
}

/// The part of the mesh that moves.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub enum RemeshExtent {
    /// Regions of the mesh.
    #[serde(rename = "region")]
    Regions(Vec<String>),
    /// All elements with their centroid between these corners [m].
    #[serde(rename = "box")]
    Box([[f64; 3]; 2]),
}

choice! {
    /// How Young's modulus depends on the element.
    pub enum StiffnessLaw {
        /// The same everywhere.
        Uniform = "uniform",
        /// Proportional to 1 / smallest altitude: a thin layer counts as thin, however wide.
        InverseSize = "inverse_size",
        /// Proportional to 1 / volume.
        InverseVolume = "inverse_volume",
        /// Each principal direction of an element stiffer the shorter the element is along it.
        Directional = "directional",
    }
}

choice! {
    /// Which way the nodes of the elastic body may move.
    pub enum Motion {
        /// Every way.
        Free = "free",
        /// Along `design.direction` only, which must then be x, y or z.
        AlongDesign = "along_design",
    }
}

/// A region with its own elastic constants; what is `None` is as in the rest of the body.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Subregion {
    /// Name of the region.
    pub name: String,
    /// Young's modulus.
    pub young: Option<f64>,
    /// Poisson's ratio.
    pub poisson: Option<f64>,
    /// Fictitious force on every node.
    pub force: Option<[f64; 3]>,
}

impl StiffnessLaw {
    /// The law of a policy of the elastic map; `None` for one that the configuration has no word for.
    pub fn of_policy(policy: fluxmorph_remesh::StiffnessPolicy) -> Option<Self> {
        let same = |(word, _): &&(&str, Self)| *word == policy.name();
        <Self as super::choice::Choice>::CHOICES.iter().find(same).map(|(_, law)| *law)
    }
}

impl Remesh {
    pub(super) fn read(section: Section<'_>) -> Self {
        let remesh = Self {
            extent: read_extent(&section),
            poisson: section.number("poisson", POISSON).unwrap_or(0.3),
            young: section.number("young", Range::POSITIVE).unwrap_or(1.0),
            force: section.numbers("force", Range::FINITE).unwrap_or([0.0; 3]),
            stiffness: section.choice("stiffness").unwrap_or(StiffnessLaw::InverseSize),
            motion: section.choice("motion").unwrap_or(Motion::Free),
            rounds: section.integer("rounds", 0, 1000).unwrap_or(20),
            inversion_share: section.number("inversion_share", Range::open(0.0, 1.0)).unwrap_or(0.9),
            slide: section.names("slide").unwrap_or_default(),
            fixed: section.names("fixed").unwrap_or_default(),
            free: section.names("free").unwrap_or_default(),
            subregions: section.tables("subregions").into_iter().map(Subregion::read).collect(),
        };
        let lists = [("slide", &remesh.slide), ("fixed", &remesh.fixed), ("free", &remesh.free)];
        for (index, (key, names)) in lists.iter().enumerate() {
            for (earlier_key, earlier) in &lists[..index] {
                if let Some(name) = names.iter().find(|name| earlier.contains(name)) {
                    section.wrong(
                        key,
                        format!("`{name}` stands in remesh.{earlier_key} and remesh.{key}"),
                        "each surface in one of the lists",
                    );
                }
            }
        }
        let names: Vec<_> = remesh.subregions.iter().map(|subregion| subregion.name.clone()).collect();
        if let Some(name) = first_duplicate(&names).filter(|name| !name.is_empty()) {
            section.wrong("subregions", format!("two subregions are named `{name}`"), "each region once");
        }
        section.finish();
        remesh
    }
}

impl Subregion {
    fn read(section: Section<'_>) -> Self {
        let name = section.text("name");
        let subregion = Self {
            name: section.need("name", name, "\"plate\""),
            young: section.number("young", Range::POSITIVE),
            poisson: section.number("poisson", POISSON),
            force: section.numbers("force", Range::FINITE),
        };
        section.finish();
        subregion
    }
}

fn read_extent(section: &Section<'_>) -> RemeshExtent {
    let regions = section.name_or_names("region");
    let corners = section.corners("box");
    match (section.has("region"), section.has("box")) {
        (true, true) => {
            section.wrong("box", "remesh.region and remesh.box are both given", "one of them");
        }
        (false, false) => {
            section.missing("region", "region = \"remesh\", or box = [[0, 0, 0], [1, 1, 1]]");
        }
        _ => {}
    }
    match corners {
        Some(corners) => RemeshExtent::Box(corners),
        None => RemeshExtent::Regions(regions.unwrap_or_default()),
    }
}
