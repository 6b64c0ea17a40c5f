//! `[materials.NAME]` and `[regions.NAME]`: what fills the regions of the mesh.

use std::collections::BTreeMap;
use std::path::PathBuf;

use serde_json::json;

use super::config::Config;
use crate::config::section::Section;
use crate::config::table::rules::{Rules, present};
use crate::config::table::{one_of, table};
use crate::config::value::choice::choice;

table! {
    /// An isotropic material: linear, or with a B–H curve. Any number of them, each with a name of its own. A list or table in
    /// place of a number, an anisotropic material, is refused.
    ///
    /// A curve holds for static fields, and above 0 Hz where the flux density is largest and least in a period, of which the
    /// fundamental alone is computed: at the peak of a field in one direction, all the time in one that turns with constant
    /// size. That is an approximation.
    ///
    /// ```toml
    /// [materials.steel]
    /// relative_permeability = 800
    /// conductivity = "7e6 S/m"
    /// density = "7850 kg/m3"
    /// ```
    pub struct Material {
        /// Permeability over that of vacuum; below 1 too. Most conductors are not magnetic.
        relative_permeability: f64 = number(POSITIVE) => 1.0;
        /// B–H curve of iron that saturates: points `[H, B]` [A/m, T] in ascending order, from the origin, which may be left out, or
        /// the name of a steel that `fluxmorph generate materials` prints. Instead of `relative_permeability`. Between the points
        /// the curve is a smooth monotone cubic, beyond the last one its slope is that of vacuum.
        bh: Option<WrittenCurve> = ONE_OF;
        /// The same from a file, relative to the folder of the configuration: on each line H [A/m] and B [T], with a comma between
        /// them; lines that begin with `#` are comments, and the file has at most 1 MiB. Instead of `bh`.
        bh_file: Option<PathBuf> = TEXT;
        /// Polarisation B − μ0 H at which iron is saturated [T]: a curve in closed form, of which `relative_permeability` is the
        /// initial permeability. Instead of `bh`.
        saturation: Option<f64> = quantity(FluxDensity, POSITIVE);
        /// With `saturation`: how the curve comes to it. Default `"sharp"`.
        knee: Option<KneeWord> = WORD;
        /// Electric conductivity [S/m]. A material conducts only when it is told to.
        conductivity: f64 = quantity(Conductivity, NOT_NEGATIVE) => 0.0;
        /// Mass density [kg/m³]; needed for a mass in `[objective]` or `[[constraints]]`.
        density: Option<f64> = quantity(MassDensity, POSITIVE);
    }
    unused = Material::anisotropic;
    check = Material::check;
    rules = one_law;
}

one_of! {
    /// A B–H curve in the configuration itself.
    pub enum WrittenCurve {
        /// Of a steel that the program knows.
        Named(Steel) = WORD, if text;
        /// Points `[H, B]` [A/m, T].
        Points(Vec<[f64; 2]>) = not_empty(number(FINITE));
    }
}

choice! {
    /// Steels and irons that the program knows, with their sources.
    pub enum Steel {
        /// The construction steel (SS400) of TEAM workshop problem 20.
        Team20 = "team20_steel",
        /// The cold-rolled steel of TEAM workshop problems 10 and 13.
        Team13 = "team13_steel",
        /// The electrical steel M400-50A, not oriented.
        M40050A = "m400_50a",
        /// Pure iron, annealed.
        PureIron = "pure_iron",
    }
}

choice! {
    /// How a curve in closed form comes to saturation.
    pub enum KneeWord {
        /// Straight up to it, with a corner rounded over a twentieth.
        Sharp = "sharp",
        /// Along an arctangent, as soft iron does.
        Arctangent = "arctan",
    }
}

/// A curve comes from one place, and stands in place of the permeability.
fn one_law(rules: Rules) -> Rules {
    let rules =
        rules.not_both(["bh", "bh_file"]).not_both(["bh", "saturation"]).not_both(["bh_file", "saturation"]);
    rules
        .needs("knee", &["saturation"])
        .add(json!({
            "if": { "required": ["saturation"] },
            "then": {
                "required": ["relative_permeability"],
                "properties": { "relative_permeability": { "exclusiveMinimum": 1 } },
            },
        }))
        .add(json!({
            "if": { "anyOf": present(&["bh", "bh_file"]) },
            "then": { "properties": { "relative_permeability": { "const": 1 } } },
        }))
}

choice! {
    /// How a conducting region is modelled.
    pub enum RegionModel {
        /// Meshed, with eddy currents inside where it conducts.
        Volume = "volume",
        /// Replaced by its surface impedance, for conductors of several skin depths; needs a frequency and a conductivity above 0.
        Impedance = "impedance",
        /// Replaced by a surface that no flux crosses, at 0 Hz too: a superconductor, or the limit of a skin depth far below
        /// every size. Its material's permeability and conductivity have no effect.
        Perfect = "perfect",
    }
}

table! {
    /// What a region of the mesh is made of, by the name of the region. A region without a table is air.
    ///
    /// ```toml
    /// [regions.plate]
    /// material = "steel"
    /// model = "volume"
    /// ```
    pub struct Region {
        /// Name of a material of `[materials]`.
        material: String = TEXT, need "\"steel\"";
        /// How a region that conducts is modelled. The default is right for every conductor whose mesh resolves the skin depth.
        model: RegionModel = WORD => RegionModel::Volume;
        /// Remanence B_r of a permanent magnet [T]: B = μ H + B_r, with the permeability of `material`. Not zero, and for
        /// magnetostatics only.
        #[also(not_all_zero)]
        remanence: Option<[f64; 3]> = quantity(FluxDensity, FINITE);
    }
    check = |region, section| {
        if region.remanence == Some([0.0; 3]) {
            let message = format!("`{}.remanence` is zero: the region is no magnet", section.path());
            section.wrong("remanence", message, "a flux density, or no remanence");
        }
    };
}

impl Material {
    /// Whether it has a B–H curve.
    pub fn saturates(&self) -> bool {
        self.bh.is_some() || self.bh_file.is_some() || self.saturation.is_some()
    }

    /// A curve comes from one place, and stands in place of the permeability.
    fn check(&mut self, section: &Section<'_>) {
        section.at_most_one(&["bh", "bh_file", "saturation"], "one of them");
        if self.bh.is_some() || self.bh_file.is_some() {
            if self.relative_permeability != 1.0 {
                let message = format!(
                    "`{}` has a relative permeability beside its B–H curve, which says it for every field",
                    section.path()
                );
                section.wrong("relative_permeability", message, "one of the two");
            }
        } else if section.has("saturation") && self.relative_permeability <= 1.0 {
            let message = format!(
                "`{}` saturates, but its initial relative permeability is {}",
                section.path(),
                self.relative_permeability
            );
            section.wrong("saturation", message, "relative_permeability above 1, such as 1000");
        }
        if section.has("knee") && !section.has("saturation") {
            let message = format!("`{}` has a knee without `saturation`", section.path());
            section.wrong("knee", message, "saturation = \"2.1 T\" beside it");
        }
    }

    /// Refuses anisotropic materials by name.
    fn anisotropic(section: &Section<'_>) -> Vec<&'static str> {
        let examples = [("relative_permeability", "800"), ("conductivity", "\"7e6 S/m\"")];
        let several = examples.into_iter().filter(|(key, _)| section.has_several(key));
        several
            .map(|(key, example)| {
                section.refuse(
                    key,
                    format!(
                        "`{}.{key}` has several values: anisotropic materials are not supported",
                        section.path()
                    ),
                    format!("one number, such as {key} = {example}"),
                );
                key
            })
            .collect()
    }
}

/// Checks `[regions]` against the materials and the frequencies [Hz], none where they are unknown.
pub(super) fn check_regions(
    root: &Section<'_>,
    regions: &BTreeMap<String, Region>,
    materials: &BTreeMap<String, Material>,
    frequencies: &[f64],
) {
    let least = frequencies.iter().copied().fold(f64::NAN, f64::min);
    let largest = frequencies.iter().copied().fold(f64::NAN, f64::max);
    let known: Vec<_> = materials.keys().map(String::as_str).collect();
    let Some(tables) = root.inner("regions") else { return };
    for (name, region) in regions {
        let Some(section) = tables.named(name) else { continue };
        if section.has("remanence") && largest > 0.0 && region.remanence.is_some() {
            section.wrong(
                "remanence",
                format!(
                    "`{}` is a permanent magnet, but the frequency is {largest} Hz: its field does not alternate",
                    section.path()
                ),
                "analysis.frequency = 0, or no remanence",
            );
        }
        if region.remanence.is_some() && region.model == RegionModel::Perfect {
            section.wrong(
                "remanence",
                format!("`{}` is a perfect conductor, and no flux leaves it as a magnet", section.path()),
                "model = \"volume\", or no remanence",
            );
        }
        // A material that is missing or faulty is empty, and has been reported.
        if region.material.is_empty() {
            continue;
        }
        match materials.get(&region.material) {
            Some(material) => {
                if material.saturates() {
                    check_curve(&section, region);
                }
                if region.model == RegionModel::Impedance {
                    check_impedance(&section, &region.material, material, least);
                }
            }
            None => {
                let message = format!("there is no material `{}`", region.material.escape_debug());
                section.unknown_name("material", message, &region.material, &known);
            }
        }
    }
}

impl Config {
    /// Whether a region is meshed, and not replaced by its surface.
    pub fn is_meshed(&self, region: &str) -> bool {
        self.regions.get(region).is_none_or(|own| own.model == RegionModel::Volume)
    }

    /// The first meshed region whose material has a B–H curve.
    pub fn saturating_region(&self) -> Option<&String> {
        let saturates =
            |region: &Region| self.materials.get(&region.material).is_some_and(Material::saturates);
        self.regions
            .iter()
            .find(|(name, region)| self.is_meshed(name) && saturates(region))
            .map(|(name, _)| name)
    }
}

fn check_impedance(section: &Section<'_>, name: &str, material: &Material, frequency: f64) {
    if frequency == 0.0 {
        section.wrong(
            "model",
            format!("`{}` has an impedance surface, but the frequency is 0 Hz", section.path()),
            "model = \"volume\", or analysis.frequency above 0 Hz",
        );
    }
    // A conductivity may be there, misspelt.
    if material.conductivity == 0.0 && !section.is_faulty(&format!("materials.{name}")) {
        section.wrong(
            "model",
            format!("`{}` has an impedance surface, but `{name}` does not conduct", section.path()),
            format!("a conductivity above 0 S/m in materials.{name}, or model = \"volume\""),
        );
    }
}

/// A B–H curve is a law of what is meshed, and a magnet has a straight recoil line.
fn check_curve(section: &Section<'_>, region: &Region) {
    let name = &region.material;
    if region.model == RegionModel::Impedance {
        section.wrong(
            "model",
            format!(
                "`{}` has an impedance surface, which takes one permeability, but `{name}` has a B–H curve",
                section.path()
            ),
            "model = \"volume\", or a material with a relative_permeability",
        );
    }
    if region.remanence.is_some() {
        section.wrong(
            "remanence",
            format!("`{}` is a permanent magnet, but `{name}` has a B–H curve", section.path()),
            "a material with the relative_permeability of the recoil line, about 1.05",
        );
    }
}
