//! `[materials.NAME]` and `[regions.NAME]`: what fills the regions of the mesh.

use std::collections::BTreeMap;

use serde::Serialize;

use super::Dimension;
use super::choice::choice;
use super::fault::Fault;
use super::range::Range;
use super::section::Section;
use super::source::suggest;

/// A linear, isotropic material.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Material {
    /// Permeability over that of vacuum. Default 1: most conductors are not magnetic.
    pub relative_permeability: f64,
    /// Conductivity [S/m]. Default 0: a material conducts only when it is told to.
    pub conductivity: f64,
    /// Mass density [kg/m³]; needed where a mass is limited.
    pub density: Option<f64>,
}

choice! {
    /// How a conducting region is modelled.
    pub enum RegionModel {
        /// Meshed: A–ψ inside the conductor.
        Volume = "volume",
        /// Replaced by its surface impedance; nothing inside is solved for.
        Impedance = "impedance",
    }
}

/// What a region of the mesh is made of.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Region {
    /// Name of a material of the configuration.
    pub material: String,
    /// Default `volume`: right for every conductor whose mesh resolves the skin depth.
    pub model: RegionModel,
    /// Remanence `B_r` of a permanent magnet [T]: `B = μ H + B_r`. Default none.
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
    if material.conductivity == 0.0 {
        section.wrong(
            "model",
            format!("`{}` has an impedance surface, but `{name}` does not conduct", section.path()),
            format!("a conductivity above 0 S/m in materials.{name}, or model = \"volume\""),
        );
    }
}
