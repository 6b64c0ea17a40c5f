//! What objective and constraints ask of regions, bodies, coils and loads that these cannot give, or that means little of them.

use fluxmorph_geometry::Topology;

use super::super::entries::{density, material, solid_coil};
use super::super::multipole;
use super::super::references::functionals;
use crate::config::{
    self, ABOVE_ZERO_HERTZ, Coil, Config, Diagnostic, LoadCase, ObjectiveKind, RegionModel, SourceMap,
};

/// What objective and constraints ask of regions that these cannot give.
pub(in crate::build) fn faults(config: &Config, source: &SourceMap, topology: &Topology) -> Vec<Diagnostic> {
    let mut faults = Vec::new();
    let known = |name: &&str| topology.region(name).is_ok();
    faults.extend(body_faults(config, source));
    faults.extend(coil_faults(config, source));
    faults.extend(multipole::faults(config, source));
    faults.extend(mass_faults(config, source, topology));
    faults.extend(direct_loss_faults(config, source));
    let is_of_a_region = |f: &config::Functional| f.kind.is_of_a_region() && f.kind.is_of_field();
    for (path, functional) in functionals(config).into_iter().filter(|(_, f)| is_of_a_region(f)) {
        let Some(region) = functional.region.as_deref().filter(known) else { continue };
        let model = config.regions.get(region).map(|entry| entry.model);
        let is_loss = functional.kind == ObjectiveKind::Loss;
        let (message, expected) = match model {
            Some(RegionModel::Perfect) if is_loss => (
                format!("`{region}` is a perfect conductor, so it has no eddy-current loss"),
                "a region whose material conducts, with another model",
            ),
            _ if is_loss && material(config, region).conductivity == 0.0 => (
                format!("`{region}` does not conduct, so it has no eddy-current loss"),
                "a region whose material conducts",
            ),
            Some(RegionModel::Impedance | RegionModel::Perfect) if !is_loss => {
                (format!("`{region}` is replaced by its surface"), "a region that is meshed, such as air")
            }
            _ => continue,
        };
        faults.push(source.diagnostic(&format!("{path}.region"), message).expected(expected));
    }
    faults
}

/// Losses of solid conductors under loads of which one is at 0 Hz: what a direct current loses is none of the field.
fn direct_loss_faults(config: &Config, source: &SourceMap) -> Vec<Diagnostic> {
    let losses = functionals(config).into_iter().filter(|(_, f)| f.kind == ObjectiveKind::Loss);
    let fault = |(path, functional): (String, &config::Functional)| {
        let region = functional.region.as_deref()?;
        let coil = solid_coil(config, region)?;
        let cases = config.load_cases();
        let is_direct = |case: &&LoadCase<'_>| {
            functional.is_taken_under(case) && case.frequency == 0.0 && case.feed(coil).amplitude != 0.0
        };
        let case = cases.iter().find(is_direct)?;
        let message = format!(
            "`{path}` is taken at 0 Hz too{}, and what a direct current loses in the coil `{}` is not counted",
            case.words(),
            coil.name
        );
        let fault = source.diagnostic(&format!("{path}.kind"), message);
        Some(fault.expected(format!("`load` or `frequency` beside it, of one {ABOVE_ZERO_HERTZ}")))
    };
    losses.filter_map(fault).collect()
}

/// Ratios to losses of coils whose wire has none.
pub(in crate::build) fn warnings(config: &Config) -> Vec<String> {
    let is_lossless = |own: &config::Coil| !own.is_solid() && own.resistance.unwrap_or(0.0) == 0.0;
    let lossless: Vec<&String> =
        config.coils.iter().filter(|own| is_lossless(own)).map(|own| &own.name).collect();
    let mut warnings = Vec::new();
    for (path, own) in functionals(config) {
        let what = match own.kind {
            ObjectiveKind::QualityFactor => "quality factor",
            ObjectiveKind::LinkEfficiency => "link efficiency",
            _ => continue,
        };
        for name in own.coils.iter().flatten().filter(|name| lossless.contains(name)) {
            warnings.push(format!(
                "{path}: the coil `{name}` has no resistance, so that the {what} counts losses outside of its winding alone, and \
                 without these has no bound; `resistance` of its [[coils]] is that of its wire"
            ));
        }
    }
    warnings
}

/// Masses of regions without density.
fn mass_faults(config: &Config, source: &SourceMap, topology: &Topology) -> Vec<Diagnostic> {
    let masses = functionals(config).into_iter().filter(|(_, f)| f.kind == ObjectiveKind::Mass);
    let fault = |(path, functional): (String, &config::Functional)| {
        let region = functional.region.as_deref().filter(|name| topology.region(name).is_ok())?;
        if density(config, region).is_some() {
            return None;
        }
        let entry = config.regions.get(region);
        let what = if entry.is_some() { "its material has no density" } else { "it has no material" };
        let message = format!("the mass of `{region}` is asked for, but {what}");
        let fault = source.diagnostic(&format!("{path}.kind"), message);
        Some(match entry {
            Some(entry) => fault.help(format!(
                "add a line like: density = \"7850 kg/m3\" to [materials.{}], or take the volume",
                entry.material
            )),
            None => fault.expected("a region with a material, or kind = \"volume\""),
        })
    };
    masses.filter_map(fault).collect()
}

/// Bodies that are not there, and bodies that are not meshed.
fn body_faults(config: &Config, source: &SourceMap) -> Vec<Diagnostic> {
    let mut faults = Vec::new();
    let known: Vec<&str> = config.forces.iter().map(|force| force.name.as_str()).collect();
    for (path, functional) in functionals(config).into_iter().filter(|(_, f)| f.kind.is_of_a_body()) {
        let name = functional.region.as_deref().unwrap_or_default();
        if !name.is_empty() && !known.contains(&name) {
            faults.push(source.unknown_name(&format!("{path}.region"), "body of [[forces]]", name, &known));
        }
    }
    faults
}

/// Coils that are not there, have no winding, or are asked for what they do not have.
fn coil_faults(config: &Config, source: &SourceMap) -> Vec<Diagnostic> {
    let mut faults = Vec::new();
    let known: Vec<&str> = config.coils.iter().map(|coil| coil.name.as_str()).collect();
    for (path, functional) in functionals(config) {
        let kind = functional.kind.name();
        let given: Vec<LoadCase<'_>> =
            config.load_cases().into_iter().filter(|case| functional.is_taken_under(case)).collect();
        for (k, name) in functional.coils.iter().flatten().enumerate() {
            let path = format!("{path}.coils[{k}]");
            let Some(index) = known.iter().position(|known| known == name) else {
                faults.push(source.unknown_name(&path, "coil", name, &known));
                continue;
            };
            let coil = &config.coils[index];
            if coil.turns.is_none() {
                let message = format!("the coil `{name}` has no turns, so there is no {kind} of it");
                let help = format!("add a line like: turns = 10 to coils[{index}]");
                faults.push(source.diagnostic(&path, message).help(help));
            } else {
                faults.extend(
                    given.iter().find_map(|case| unchanging(functional.kind, coil, case, (source, &path))),
                );
            }
        }
        if functional.kind.is_of_inductances() && config.saturating_region().is_some() {
            let message = format!(
                "`{path}` is of inductances, which a B–H curve does not have: they depend on the current"
            );
            let fault = source.diagnostic(&format!("{path}.kind"), message);
            let instead = "flux_linkage, above 0 Hz power or loss, or materials with a permeability";
            faults.push(fault.expected(instead));
        }
    }
    faults
}

/// What no shape changes under a load, of a coil at this path.
fn unchanging(
    kind: ObjectiveKind,
    coil: &Coil,
    case: &LoadCase<'_>,
    (source, path): (&SourceMap, &str),
) -> Option<Diagnostic> {
    let (feed, name, words) = (case.feed(coil), &coil.name, case.words());
    let is_bare = coil.series_inductance.is_none() && coil.series_capacitance.is_none();
    let (message, expected) = match kind {
        ObjectiveKind::Current if !feed.by_voltage => (
            format!("the current of the coil `{name}` is given{words}: no shape changes it"),
            "a coil that a voltage drives",
        ),
        ObjectiveKind::Voltage if feed.by_voltage && is_bare => (
            format!("the voltage of the coil `{name}` is given{words}: no shape changes it"),
            "a coil with a current, or one that a voltage drives through a reactance in series",
        ),
        ObjectiveKind::Power | ObjectiveKind::PowerFactor if feed.amplitude == 0.0 => {
            let state = if feed.by_voltage { "short-circuited" } else { "open" };
            (
                format!("the coil `{name}` is {state}{words}: no power comes in"),
                "a coil with a current or a voltage; `load` chooses one of several loads",
            )
        }
        _ => return None,
    };
    Some(source.diagnostic(path, message).expected(expected))
}
