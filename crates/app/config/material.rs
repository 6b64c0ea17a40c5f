//! `[materials.NAME]` and `[regions.NAME]`: what fills the regions of the mesh.

use std::collections::BTreeMap;

use schemars::JsonSchema;
use serde::Serialize;

use super::Dimension;
use super::choice::choice;
use super::fault::Fault;
use super::range::Range;
use super::section::Section;
use super::source::suggest;
use crate::schema::form::{not_all_zero, number, quantity};

/// A linear, isotropic material. Any number of them, each with a name of its own. A list or table in place of a number, an
/// anisotropic material, is refused.
///
/// ```toml
/// [materials.steel]
/// relative_permeability = 800
/// conductivity = "7e6 S/m"
/// density = "7850 kg/m3"
/// ```
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct Material {
    /// Permeability over that of vacuum; below 1 too. Most conductors are not magnetic.
    #[schemars(transform = number(Range::POSITIVE), extend("default" = 1))]
    pub relative_permeability: f64,
    /// Electric conductivity [S/m]. A material conducts only when it is told to.
    #[schemars(transform = quantity(Dimension::Conductivity, Range::NOT_NEGATIVE), extend("default" = 0))]
    pub conductivity: f64,
    /// Mass density [kg/m³]; needed where `[[constraints]]` limit a mass.
    #[schemars(transform = quantity(Dimension::MassDensity, Range::POSITIVE))]
    pub density: Option<f64>,
}

choice! {
    /// How a conducting region is modelled.
    pub enum RegionModel {
        /// Meshed, with eddy currents inside where it conducts.
        Volume = "volume",
        /// Replaced by its surface impedance, for conductors of several skin depths; needs a frequency and a conductivity above 0.
        Impedance = "impedance",
    }
}

/// What a region of the mesh is made of, by the name of the region. A region without a table is air.
///
/// ```toml
/// [regions.plate]
/// material = "steel"
/// model = "volume"
/// ```
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct Region {
    /// Name of a material of `[materials]`.
    pub material: String,
    /// How a region that conducts is modelled. The default is right for every conductor whose mesh resolves the skin depth.
    #[schemars(extend("default" = RegionModel::Volume))]
    pub model: RegionModel,
    /// Remanence B_r of a permanent magnet [T]: B = μ H + B_r, with the permeability of `material`. Not zero, and for
    /// magnetostatics only.
    #[schemars(transform = quantity(Dimension::FluxDensity, Range::FINITE), transform = not_all_zero)]
    pub remanence: Option<[f64; 3]>,
}

/// Read `[materials]`.
pub(super) fn read_materials(root: &Section<'_>) -> BTreeMap<String, Material> {
    let read = |(name, section): (String, Section<'_>)| {
        let relative_permeability = isotropic(&section, "relative_permeability", "800")
            .and_then(|key| section.number(key, Range::POSITIVE))
            .unwrap_or(1.0);
        // A conductivity that is written but wrong stays unknown: nothing follows from it.
        let left_out = if section.has("conductivity") { f64::NAN } else { 0.0 };
        let conductivity = isotropic(&section, "conductivity", "\"7e6 S/m\"")
            .and_then(|key| section.quantity(key, Dimension::Conductivity, Range::NOT_NEGATIVE))
            .unwrap_or(left_out);
        let density = section.quantity("density", Dimension::MassDensity, Range::POSITIVE);
        section.finish();
        (name, Material { relative_permeability, conductivity, density })
    };
    root.named_tables("materials").into_iter().map(read).collect()
}

/// The key, if its value is not one of an anisotropic material: several numbers, which are refused by name.
fn isotropic(section: &Section<'_>, key: &'static str, example: &str) -> Option<&'static str> {
    if !section.is_list(key) && !section.is_table(key) {
        return Some(key);
    }
    section.refuse(
        key,
        format!("`{}.{key}` has several values: anisotropic materials are not supported", section.path()),
        format!("one number, such as {key} = {example}"),
    );
    None
}

/// Read `[regions]`, and check it against the materials and the frequencies [Hz].
pub(super) fn read_regions(
    root: &Section<'_>,
    materials: &BTreeMap<String, Material>,
    frequencies: &[f64],
) -> BTreeMap<String, Region> {
    let least = frequencies.iter().copied().fold(f64::NAN, f64::min);
    let largest = frequencies.iter().copied().fold(f64::NAN, f64::max);
    let known: Vec<_> = materials.keys().map(String::as_str).collect();
    let read = |(name, section): (String, Section<'_>)| {
        let material = section.text("material");
        let model = section.choice("model").unwrap_or(RegionModel::Volume);
        if let Some(material) = &material {
            check_region(&section, material, model, materials.get(material), &known, least);
        }
        let material = section.need("material", material, "\"steel\"");
        let remanence = read_remanence(&section, largest);
        section.finish();
        (name, Region { material, model, remanence })
    };
    root.named_tables("regions").into_iter().map(read).collect()
}

fn read_remanence(section: &Section<'_>, frequency: f64) -> Option<[f64; 3]> {
    let remanence = section.quantities("remanence", Dimension::FluxDensity, Range::FINITE)?;
    if remanence == [0.0; 3] {
        let message = format!("`{}.remanence` is zero: the region is no magnet", section.path());
        section.wrong("remanence", message, "a flux density, or no remanence");
    }
    if frequency > 0.0 {
        section.wrong(
            "remanence",
            format!(
                "`{}` is a permanent magnet, but the frequency is {frequency} Hz: its field does not alternate",
                section.path()
            ),
            "analysis.frequency = 0, or no remanence",
        );
    }
    Some(remanence)
}

fn check_region(
    section: &Section<'_>,
    name: &str,
    model: RegionModel,
    material: Option<&Material>,
    known: &[&str],
    frequency: f64,
) {
    let Some(material) = material else {
        section.fault("material", |fault| {
            let message = format!("there is no material `{}`", name.escape_debug());
            suggest(Fault { message, ..fault }, name, known)
        });
        return;
    };
    if model != RegionModel::Impedance {
        return;
    }
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
