//! `[remesh]`: the fictitious elastic body that carries the motion into the mesh (Eq. 3).

use schemars::{JsonSchema, Schema};
use serde::Serialize;

use super::choice::choice;
use super::range::Range;
use super::section::Section;
use crate::schema::form::{integer, length, name_or_names, names, number};
use crate::schema::rules::Rules;

/// Poisson's ratio of a stable body.
pub(super) const POISSON: Range = Range::open(-1.0, 0.5);

/// The fictitious elastic body that carries the motion of the design into the mesh (Eq. 3). Either `region` or `box` says
/// which part of the mesh moves.
///
/// ```toml
/// [remesh]
/// region = ["plate", "remesh"]
/// poisson = 0.0
/// stiffness = "inverse_volume"
/// slide = ["x_min", "y_min"]
/// ```
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct Remesh {
    /// The part of the mesh that moves.
    #[serde(flatten)]
    #[schemars(with = "ExtentKeys")]
    pub extent: RemeshExtent,
    /// Poisson's ratio of the body. The default is the paper's.
    #[schemars(transform = number(POISSON), extend("default" = 0.3))]
    pub poisson: f64,
    /// Young's modulus of the body, before `stiffness` weights it. Without forces its unit cancels.
    #[schemars(transform = number(Range::POSITIVE), extend("default" = 1))]
    pub young: f64,
    /// Fictitious force on every node that is free to move, in units of `young` times square metres.
    #[schemars(transform = number(Range::FINITE), extend("default" = [0, 0, 0]))]
    pub force: [f64; 3],
    /// How the modulus depends on the element: small elements stay stiff and keep their shape, large ones take the motion.
    #[schemars(extend("default" = StiffnessLaw::InverseSize))]
    pub stiffness: StiffnessLaw,
    /// Which way nodes may move. The default is the paper's elasticity.
    #[schemars(extend("default" = Motion::Free))]
    pub motion: Motion,
    /// Most rounds of an optimisation: in each the mesh moves from a reference mesh of its own (`docs/theory.md`, section
    /// 5.5). 0: all designs move from the undeformed mesh, and bounds that it does not reach in one step are refused.
    #[schemars(transform = integer(0, 1000), extend("default" = 20))]
    pub rounds: usize,
    /// How far a design may lie from the reference of its round: largest share of the way to the first inverted element.
    #[schemars(transform = number(Range::open(0.0, 1.0)), extend("default" = 0.9))]
    pub inversion_share: f64,
    /// Surfaces whose nodes stay in their plane.
    #[schemars(default, transform = names)]
    pub slide: Vec<String>,
    /// Surfaces whose nodes stay. The body's outside, and faces between two regions inside it, are fixed where nothing else
    /// is said.
    #[schemars(default, transform = names)]
    pub fixed: Vec<String>,
    /// Such surfaces whose nodes move freely, for example along the side of a core whose end face moves.
    #[schemars(default, transform = names)]
    pub free: Vec<String>,
    /// Regions of the body with their own constants.
    #[schemars(default)]
    pub subregions: Vec<Subregion>,
}

/// The part of the mesh that moves, as it is written.
#[derive(JsonSchema)]
#[schemars(transform = one_extent)]
#[allow(dead_code, reason = "stands for the keys of `RemeshExtent` in the schema")]
struct ExtentKeys {
    /// The regions of the mesh that move. Either this or `box`.
    #[schemars(transform = name_or_names)]
    region: Option<Vec<String>>,
    /// Instead of `region`: all elements with their centroid between these two corners [m], the lower one first.
    #[schemars(transform = length(Range::FINITE))]
    r#box: Option<[[f64; 3]; 2]>,
}

fn one_extent(schema: &mut Schema) {
    Rules::of(schema).exactly_one(&["region", "box"]);
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
        /// Each principal direction of an element stiffer the shorter the element is along it: for thin layers that cross.
        Directional = "directional",
    }
}

choice! {
    /// Which way the nodes of the elastic body may move.
    pub enum Motion {
        /// Every way.
        Free = "free",
        /// Along `design.direction` only, which must then be a vector along x, y or z. It keeps thin columns of cells from
        /// inverting sideways.
        AlongDesign = "along_design",
    }
}

/// A region of the body with its own constants; what is left out is as in the rest of the body.
///
/// ```toml
/// [[remesh.subregions]]
/// name = "plate"
/// young = 100
/// ```
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct Subregion {
    /// Name of the region; each once.
    pub name: String,
    /// Young's modulus. Default: `remesh.young`.
    #[schemars(transform = number(Range::POSITIVE))]
    pub young: Option<f64>,
    /// Poisson's ratio. Default: `remesh.poisson`.
    #[schemars(transform = number(POISSON))]
    pub poisson: Option<f64>,
    /// Fictitious force on every node. Default: `remesh.force`.
    #[schemars(transform = number(Range::FINITE))]
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
                for (i, name) in names.iter().enumerate().take_while(|_| !section.is_crowded()) {
                    let Some(k) = earlier.iter().position(|earlier| earlier == name) else { continue };
                    section.clash(
                        [&format!("{earlier_key}[{k}]"), &format!("{key}[{i}]")],
                        format!("`{name}` stands in remesh.{earlier_key} and remesh.{key}"),
                        "each surface in one of the lists",
                    );
                }
            }
        }
        let names: Vec<_> = remesh.subregions.iter().map(|subregion| subregion.name.clone()).collect();
        section.named_twice("subregions", &names, "subregions", "each region once");
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
            section.clash(["region", "box"], "remesh.region and remesh.box are both given", "one of them");
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
