//! `[mesh.boxes]`: regions painted one over the other on a graded grid.

use std::collections::BTreeSet;

use fluxmorph_geometry::generate::{AxisSize, BoxRegion, BoxesParameters, SizeLimit, SurfacePatch};
use schemars::JsonSchema;
use serde::Serialize;

use crate::config::Dimension;
use crate::config::coil::AxisWord;
use crate::config::range::Range;
use crate::config::section::Section;
use crate::schema::form::{integer, length, length_per_axis, number};

use super::REFINEMENTS;

/// Default ratio of neighbouring cells.
const GROWTH: f64 = 1.6;
/// Ratios that end: cells that do not grow would fill the air.
const GROWTHS: Range = Range::closed(1.01, 100.0);

/// Any device with faces along the axes: boxes of regions, laid one over the other on a graded grid. Every face of every
/// box lies on mesh lines. Sizes are upper limits; away from the places that have one, cells grow by a constant ratio, so
/// that the outer air needs no size. The grid is a product of lines along x, y and z: a size along one axis holds across
/// the whole mesh.
///
/// Regions: `air`, and those of `[[mesh.boxes.regions]]`. Surfaces: `x_min`, `x_max`, `y_min`, `y_max`, `z_min`, `z_max`,
/// and those of `[[mesh.boxes.surfaces]]`.
///
/// ```toml
/// [mesh]
/// generator = "boxes"
///
/// [mesh.boxes]
/// box = [["-1 m", "-1 m", "-1 m"], ["1 m", "1 m", "1 m"]]
///
/// [[mesh.boxes.regions]]
/// name = "plate"
/// box = [["-100 mm", "-100 mm", "0 mm"], ["100 mm", "100 mm", "10 mm"]]
/// size = ["20 mm", "20 mm", "5 mm"]
/// skin = "2 mm"
///
/// [[mesh.boxes.sizes]]
/// axis = "z"
/// from = "10 mm"
/// to = "60 mm"
/// size = "10 mm"
///
/// [[mesh.boxes.surfaces]]
/// name = "plate_top"
/// box = [["-100 mm", "-100 mm", "10 mm"], ["100 mm", "100 mm", "10 mm"]]
/// ```
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct BoxesMesh {
    /// Lower and upper corner of the whole mesh [m].
    #[serde(rename = "box")]
    #[schemars(transform = length(Range::FINITE))]
    pub corners: [[f64; 3]; 2],
    /// Ratio of neighbouring cells away from the places that have a size.
    #[schemars(transform = number(GROWTHS), extend("default" = GROWTH))]
    pub growth: f64,
    /// All sizes are divided by it, and the growth becomes its root.
    #[schemars(transform = number(REFINEMENTS), extend("default" = 1))]
    pub refinement: f64,
    /// Regions; later ones lie over earlier ones.
    #[schemars(default)]
    pub regions: Vec<BoxOfRegion>,
    /// Sizes along the axes beside those of the regions.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    #[schemars(default)]
    pub sizes: Vec<SizeAlong>,
    /// Named surfaces beside the six outer faces.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    #[schemars(default)]
    pub surfaces: Vec<Patch>,
}

/// A region, or a part of one: boxes may share a name. Later boxes lie over earlier ones; one named `air` is a hole.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct BoxOfRegion {
    /// Name of the region; `air` is a hole.
    pub name: String,
    /// Lower and upper corner [m], within the whole mesh.
    #[serde(rename = "box")]
    #[schemars(transform = length(Range::FINITE))]
    pub corners: [[f64; 3]; 2],
    /// Largest cell within the box, along x, y and z [m]. Default: no limit.
    #[schemars(transform = length_per_axis)]
    pub size: Option<[f64; 3]>,
    /// Largest first cell on either side of the box's faces, across x, y and z [m]. Default: no limit.
    #[schemars(transform = length_per_axis)]
    pub skin: Option<[f64; 3]>,
    /// Observation cells along x, y and z; a mesh cell lies in one of them. Default: every element is one.
    #[schemars(transform = integer(1, 1000))]
    pub cells: Option<[usize; 3]>,
}

/// A size along a part of one axis, such as a coil or a line of probes.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct SizeAlong {
    /// The axis.
    pub axis: AxisWord,
    /// First coordinate, within the whole mesh [m]; a mesh line lies there.
    #[schemars(transform = length(Range::FINITE))]
    pub from: f64,
    /// Last coordinate, at least `from`, within the whole mesh [m]; a mesh line lies there. Default: `from`.
    #[schemars(with = "Option<f64>", transform = length(Range::FINITE))]
    pub to: f64,
    /// Largest cell in between [m]. Default: no limit, and there are only the lines at both ends.
    #[schemars(transform = length(Range::POSITIVE))]
    pub size: Option<f64>,
}

/// A named surface: all faces between two regions, and outer faces, within a box. They point outwards, and between two
/// regions out of the later one.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct Patch {
    /// Name of the surface; each once.
    pub name: String,
    /// Lower and upper corner [m], within the whole mesh; both are equal along an axis for a plane patch.
    #[serde(rename = "box")]
    #[schemars(transform = length(Range::FINITE))]
    pub corners: [[f64; 3]; 2],
}

impl Default for BoxesMesh {
    /// An empty cube of one metre: what stands in for a table that is missing.
    fn default() -> Self {
        Self {
            corners: [[0.0; 3], [1.0; 3]],
            growth: GROWTH,
            refinement: 1.0,
            regions: Vec::new(),
            sizes: Vec::new(),
            surfaces: Vec::new(),
        }
    }
}

impl BoxesMesh {
    /// The same for the generator.
    pub fn parameters(&self) -> BoxesParameters {
        let free = [f64::INFINITY; 3];
        let region = |region: &BoxOfRegion| BoxRegion {
            name: region.name.clone(),
            corners: region.corners,
            size: region.size.unwrap_or(free),
            skin: region.skin.unwrap_or(free),
            cells: region.cells,
        };
        let size = |size: &SizeAlong| AxisSize {
            axis: size.axis.index(),
            limit: SizeLimit { interval: [size.from, size.to], size: size.size.unwrap_or(f64::INFINITY) },
        };
        let patch = |patch: &Patch| SurfacePatch { name: patch.name.clone(), corners: patch.corners };
        BoxesParameters {
            corners: self.corners,
            regions: self.regions.iter().map(region).collect(),
            sizes: self.sizes.iter().map(size).collect(),
            surfaces: self.surfaces.iter().map(patch).collect(),
            growth: self.growth,
            refinement: self.refinement,
        }
    }

    pub(super) fn read(section: Section<'_>) -> Self {
        let default = Self::default();
        let corners = section.corners("box");
        let boxes = Self {
            growth: section.number("growth", GROWTHS).unwrap_or(default.growth),
            refinement: section.number("refinement", REFINEMENTS).unwrap_or(default.refinement),
            regions: section.tables("regions").into_iter().map(|s| BoxOfRegion::read(s, corners)).collect(),
            sizes: section.tables("sizes").into_iter().map(|s| SizeAlong::read(s, corners)).collect(),
            surfaces: section.tables("surfaces").into_iter().map(|s| Patch::read(s, corners)).collect(),
            corners: section.need(
                "box",
                corners,
                "[[\"-1 m\", \"-1 m\", \"-1 m\"], [\"1 m\", \"1 m\", \"1 m\"]]",
            ),
        };
        let mut names = BTreeSet::new();
        if let Some(patch) = boxes.surfaces.iter().find(|patch| !names.insert(&patch.name)) {
            section.wrong(
                "surfaces",
                format!("two surfaces are named `{}`", patch.name),
                "a different name for each surface",
            );
        }
        section.finish();
        boxes
    }
}

/// An example for messages.
const CORNERS: &str = "[[\"0 mm\", \"0 mm\", \"0 mm\"], [\"10 mm\", \"10 mm\", \"10 mm\"]]";

/// Records a fault where a box, or a part of an axis, leaves the whole one.
fn check_within(
    section: &Section<'_>,
    key: &str,
    corners: Option<[[f64; 3]; 2]>,
    whole: Option<[[f64; 3]; 2]>,
) {
    let (Some([lower, upper]), Some([least, most])) = (corners, whole) else { return };
    // Room for rounding of decimal lengths.
    let outside = (0..3).find(|&d| {
        let room = 1e-9 * (most[d] - least[d]);
        lower[d] < least[d] - room || upper[d] > most[d] + room
    });
    if let Some(d) = outside {
        let axis = ["x", "y", "z"][d];
        section.wrong(
            key,
            format!("`{}.{key}` runs from {axis} = {} m to {} m", section.path(), lower[d], upper[d]),
            format!("within `mesh.boxes.box`, which goes from {axis} = {} m to {} m", least[d], most[d]),
        );
    }
}

impl BoxOfRegion {
    fn read(section: Section<'_>, whole: Option<[[f64; 3]; 2]>) -> Self {
        let corners = section.corners("box");
        check_within(&section, "box", corners, whole);
        let name = section.text("name");
        let region = Self {
            size: section.length_per_axis("size", Range::POSITIVE),
            skin: section.length_per_axis("skin", Range::POSITIVE),
            cells: section.integers("cells", 1, 1000),
            name: section.need("name", name, "\"plate\""),
            corners: section.need("box", corners, CORNERS),
        };
        section.finish();
        region
    }
}

impl SizeAlong {
    fn read(section: Section<'_>, whole: Option<[[f64; 3]; 2]>) -> Self {
        let axis = section.choice("axis");
        if axis.is_none() && !section.has("axis") {
            section.missing("axis", "axis = \"z\"");
        }
        let length = |key| section.quantity(key, Dimension::Length, Range::FINITE);
        let (from, to) = (length("from"), length("to"));
        let size = section.quantity("size", Dimension::Length, Range::POSITIVE);
        let first = section.need("from", from, "\"0 mm\"");
        if let (Some(from), Some(to)) = (from, to)
            && from > to
        {
            section.wrong(
                "to",
                format!("`{}` runs from {from} m to {to} m", section.path()),
                "the lower end first",
            );
        }
        let last = to.or(from);
        if let (Some(axis), Some(from), Some(to), Some(mut corners)) = (axis, from, last, whole) {
            let d = axis as usize;
            (corners[0][d], corners[1][d]) = (from, to);
            let key = if whole.is_some_and(|whole| from < whole[0][d]) { "from" } else { "to" };
            check_within(&section, if section.has(key) { key } else { "from" }, Some(corners), whole);
        }
        let along = Self { axis: axis.unwrap_or(AxisWord::Z), from: first, to: last.unwrap_or(first), size };
        section.finish();
        along
    }
}

impl Patch {
    fn read(section: Section<'_>, whole: Option<[[f64; 3]; 2]>) -> Self {
        let corners = section.flat_corners("box");
        check_within(&section, "box", corners, whole);
        let name = section.text("name");
        let patch = Self {
            name: section.need("name", name, "\"plate_top\""),
            corners: section.need("box", corners, CORNERS),
        };
        section.finish();
        patch
    }
}
