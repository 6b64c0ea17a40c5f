//! `[remesh]`: the fictitious elastic body that carries the motion into the mesh (Eq. 3).

use serde::Serialize;

use super::order::box_with_volume;
use crate::config::section::Section;
use crate::config::table::{Group, table};
use crate::config::value::choice::choice;
use crate::config::value::choice_named;
use crate::config::value::range::Range;

/// Poisson's ratio of a stable body.
pub(super) const POISSON: Range = Range::open(-1.0, 0.5);

/// Poisson's ratio of the body where none is written: the paper's.
pub const DEFAULT_POISSON: f64 = 0.3;

table! {
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
    pub struct Remesh {
        /// The part of the mesh that moves.
        #[serde(flatten)]
        extent: RemeshExtent = KEYS;
        /// How the mesh follows the design. Default: `"rails"` where all nodes of the design move along one of x, y and z,
        /// `"hyperelastic"` where they do not, `"linear"` where a `force` acts; for `[morph]` `"linear"`.
        law: Option<MotionLaw> = WORD;
        /// Poisson's ratio of the body, with the law `"linear"`. The default is the paper's.
        poisson: f64 = number(POISSON) => DEFAULT_POISSON;
        /// Young's modulus of the body, before `stiffness` weights it. Without forces its unit cancels.
        young: f64 = number(POSITIVE) => 1.0;
        /// Fictitious force on every node that is free to move, in units of `young` times square metres.
        force: [f64; 3] = number(FINITE) => [0.0; 3];
        /// How the modulus depends on the element: small elements stay stiff and keep their shape, large ones take the motion.
        /// Default: `"inverse_volume"` with the law `"hyperelastic"`, else `"inverse_size"`.
        stiffness: Option<StiffnessLaw> = WORD;
        /// Which way nodes may move. The default is the paper's elasticity.
        motion: Motion = WORD => Motion::Free;
        /// Surfaces whose nodes stay in their planes, at any angle: the sides of a sector among them. A curved surface cannot slide.
        slide: Vec<String> = NAMES => Vec::new();
        /// Surfaces whose nodes stay. The body's outside, and faces between two regions inside it, are fixed where nothing else
        /// is said.
        fixed: Vec<String> = NAMES => Vec::new();
        /// Such surfaces whose nodes move freely, for example along the side of a core whose end face moves.
        free: Vec<String> = NAMES => Vec::new();
        /// Regions of the body with their own constants.
        subregions: Vec<Subregion> = TABLES => Vec::new();
    }
    former = [
        ("rounds", "a design has one mesh, and no rounds"),
        ("inversion_share", "how far the mesh goes is measured by the room that elements keep"),
    ];
    check = Remesh::check;
}

table! {
    /// The part of the mesh that moves, as it is written.
    pub(in crate::config) struct ExtentKeys {
        /// The regions of the mesh that move. Either this or `box`.
        region: Option<Vec<String>> = NAME_OR_NAMES;
        /// Instead of `region`: all elements with their centroid between these two corners [m], the lower one first.
        corners["box"]: Option<[[f64; 3]; 2]> = length(FINITE);
    }
    rules = |rules| rules.exactly_one(&["region", "box"]);
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
    /// How the mesh follows the design.
    pub enum MotionLaw {
        /// All nodes move along the axis of the design, by a convex energy that keeps elements from being squeezed. `poisson`
        /// and `motion` have no meaning.
        Rails = "rails",
        /// All nodes move in all directions, by a hyperelastic energy that knows finite rotations and keeps elements from being
        /// squeezed. `poisson` and `motion` have no meaning.
        Hyperelastic = "hyperelastic",
        /// Linear elasticity on the undeformed mesh (Eq. 3). Nothing keeps elements from being squeezed but their stiffness.
        Linear = "linear",
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

table! {
    /// A region of the body with its own constants; what is left out is as in the rest of the body.
    ///
    /// ```toml
    /// [[remesh.subregions]]
    /// name = "plate"
    /// young = 100
    /// ```
    pub struct Subregion {
        /// Name of the region; each once.
        name: String = TEXT, need "\"plate\"";
        /// Young's modulus. Default: `remesh.young`.
        young: Option<f64> = number(POSITIVE);
        /// Poisson's ratio. Default: `remesh.poisson`.
        poisson: Option<f64> = number(POISSON);
        /// Fictitious force on every node. Default: `remesh.force`.
        force: Option<[f64; 3]> = number(FINITE);
    }
}

impl StiffnessLaw {
    /// The law of a policy of the elastic map; `None` for one that the configuration has no word for.
    pub fn of_policy(policy: fluxmorph_remesh::StiffnessPolicy) -> Option<Self> {
        choice_named(policy.name())
    }
}

impl Remesh {
    fn check(&mut self, section: &Section<'_>) {
        let lists = [("slide", &self.slide), ("fixed", &self.fixed), ("free", &self.free)];
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
        let names = self.subregions.iter().map(|subregion| &subregion.name);
        section.named_twice("subregions", names, "subregions", "each region once");
    }
}

impl Group for RemeshExtent {
    type Written = ExtentKeys;

    fn of(written: ExtentKeys, section: &Section<'_>) -> Self {
        let example = "region = \"remesh\", or box = [[0, 0, 0], [1, 1, 1]]";
        section.exactly_one(&["region", "box"], example, "one of them");
        match written.corners.and_then(|corners| box_with_volume(section, "box", corners)) {
            Some(corners) => Self::Box(corners),
            None => Self::Regions(written.region.unwrap_or_default()),
        }
    }
}
