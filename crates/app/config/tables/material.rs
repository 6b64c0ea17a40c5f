//! `[materials.NAME]` and `[regions.NAME]`: what fills the regions of the mesh.

use std::collections::BTreeMap;

use crate::config::section::Section;
use crate::config::table::table;
use crate::config::value::choice::choice;

table! {
    /// A linear, isotropic material. Any number of them, each with a name of its own. A list or table in place of a number, an
    /// anisotropic material, is refused.
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
        /// Electric conductivity [S/m]. A material conducts only when it is told to.
        conductivity: f64 = quantity(Conductivity, NOT_NEGATIVE) => 0.0;
        /// Mass density [kg/m³]; needed where `[[constraints]]` limit a mass.
        density: Option<f64> = quantity(MassDensity, POSITIVE);
    }
    unused = Material::anisotropic;
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
        // A material that is missing or faulty is empty, and has been reported.
        if region.material.is_empty() {
            continue;
        }
        match materials.get(&region.material) {
            Some(material) if region.model == RegionModel::Impedance => {
                check_impedance(&section, &region.material, material, least);
            }
            Some(_) => {}
            None => {
                let message = format!("there is no material `{}`", region.material.escape_debug());
                section.unknown_name("material", message, &region.material, &known);
            }
        }
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
