//! `[mesh.boxes]`: regions painted one over the other on a graded grid.

use fluxmorph_geometry::generate::{AxisSize, BoxRegion, BoxesParameters, SizeLimit, SurfacePatch};

use super::grading::REFINEMENTS;
use crate::config::section::Section;
use crate::config::table::table;
use crate::config::tables::axis::AxisWord;
use crate::config::tables::order::{CORNERS, Corners, box_with_volume, check_within, flat_box};
use crate::config::value::range::Range;

/// Ratios that end: cells that do not grow would fill the air.
const GROWTHS: Range = Range::closed(1.01, 100.0);

table! {
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
    pub struct BoxesMesh: Default {
        /// Lower and upper corner of the whole mesh [m].
        corners["box"]: Corners = length(FINITE), need "[[\"-1 m\", \"-1 m\", \"-1 m\"], [\"1 m\", \"1 m\", \"1 m\"]]";
        /// Ratio of neighbouring cells away from the places that have a size.
        growth: f64 = number(GROWTHS) => 1.6;
        /// All sizes are divided by it, and the growth becomes its root.
        refinement: f64 = number(REFINEMENTS) => 1.0;
        /// Regions; later ones lie over earlier ones.
        regions: Vec<BoxOfRegion> = TABLES => Vec::new();
        /// Sizes along the axes beside those of the regions.
        #[serde(skip_serializing_if = "Vec::is_empty")]
        sizes: Vec<SizeAlong> = TABLES, else Vec::new();
        /// Named surfaces beside the six outer faces.
        #[serde(skip_serializing_if = "Vec::is_empty")]
        surfaces: Vec<Patch> = TABLES, else Vec::new();
    }
    check = BoxesMesh::check;
}

table! {
    /// A region, or a part of one: boxes may share a name. Later boxes lie over earlier ones; one named `air` is a hole.
    pub struct BoxOfRegion {
        /// Name of the region; `air` is a hole.
        name: String = TEXT, need "\"plate\"";
        /// Lower and upper corner [m], within the whole mesh.
        corners["box"]: Corners = length(FINITE), need CORNERS;
        /// Largest cell within the box, along x, y and z [m]. Default: no limit.
        size: Option<[f64; 3]> = length_per_axis(POSITIVE);
        /// Largest first cell on either side of the box's faces, across x, y and z [m]. Default: no limit.
        skin: Option<[f64; 3]> = length_per_axis(POSITIVE);
        /// Observation cells along x, y and z; a mesh cell lies in one of them. Default: every element is one; beside boxes of its name that have some, the whole box.
        cells: Option<[usize; 3]> = integer(1, 1000);
    }
}

table! {
    /// A size along a part of one axis, such as a coil or a line of probes.
    pub struct SizeAlong {
        /// The axis.
        axis: AxisWord = WORD, need "\"z\"";
        /// First coordinate, within the whole mesh [m]; a mesh line lies there.
        from: f64 = length(FINITE), need "\"0 mm\"";
        /// Last coordinate, at least `from`, within the whole mesh [m]; a mesh line lies there. Default: `from`.
        to: f64 = length(FINITE), else from;
        /// Largest cell in between [m]. Default: no limit, and there are only the lines at both ends.
        size: Option<f64> = length(POSITIVE);
    }
}

table! {
    /// A named surface: all faces between two regions, and outer faces, within a box. They point outwards, and between two
    /// regions out of the later one.
    pub struct Patch {
        /// Name of the surface; each once.
        name: String = TEXT, need "\"plate_top\"";
        /// Lower and upper corner [m], within the whole mesh; both are equal along an axis for a plane patch.
        corners["box"]: Corners = length(FINITE), need CORNERS;
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
            division: None,
        }
    }

    fn check(&mut self, section: &Section<'_>) {
        let whole = box_with_volume(section, "box", self.corners);
        for (index, region) in self.regions.iter().enumerate() {
            let Some(table) = section.inner(&format!("regions[{index}]")) else { continue };
            if let (Some(corners), Some(whole)) = (box_with_volume(&table, "box", region.corners), whole) {
                check_within(&table, "box", corners, whole);
            }
        }
        for (index, size) in self.sizes.iter().enumerate() {
            let Some(table) = section.inner(&format!("sizes[{index}]")) else { continue };
            size.check(&table, whole);
        }
        for (index, patch) in self.surfaces.iter().enumerate() {
            let Some(table) = section.inner(&format!("surfaces[{index}]")) else { continue };
            if let (Some(corners), Some(whole)) = (flat_box(&table, "box", patch.corners), whole) {
                check_within(&table, "box", corners, whole);
            }
        }
        let twice = (1..self.surfaces.len())
            .find(|&k| self.surfaces[..k].iter().any(|earlier| earlier.name == self.surfaces[k].name));
        if let Some(twice) = twice {
            section.wrong(
                "surfaces",
                format!("two surfaces are named `{}`", self.surfaces[twice].name),
                "a different name for each surface",
            );
        }
    }
}

impl SizeAlong {
    fn check(&self, section: &Section<'_>, whole: Option<Corners>) {
        let (from, to) = (self.from, self.to);
        let is_faulty = section.is_faulty(section.path());
        if from > to {
            section.wrong(
                "to",
                format!("`{}` runs from {from} m to {to} m", section.path()),
                "the lower end first",
            );
        }
        let Some(whole) = whole.filter(|_| !is_faulty) else { return };
        let d = self.axis.index();
        let mut corners = whole;
        (corners[0][d], corners[1][d]) = (from, to);
        let key = if from < whole[0][d] || !section.has("to") { "from" } else { "to" };
        check_within(section, key, corners, whole);
    }
}
