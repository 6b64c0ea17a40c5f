//! What excites the field problems of a configuration, and what is refused of it.

use fluxmorph_geometry::fem::c64;
use fluxmorph_solver::{Drive, LoadCase};

use crate::config::{self, Config, Diagnostic, SourceMap};

/// A load case of the configuration as the solver takes it.
pub(super) fn load_case(config: &Config, case: &config::LoadCase<'_>) -> LoadCase {
    let drive = |coil: &config::Coil| {
        let feed = case.feed(coil);
        let phasor = c64::from_polar(feed.amplitude, feed.phase);
        if feed.by_voltage { Drive::Voltage(phasor) } else { Drive::Current(phasor) }
    };
    LoadCase {
        name: case.name().map(str::to_owned),
        frequency: case.frequency,
        drives: config.coils.iter().map(drive).collect(),
    }
}

/// Coils that loads name and that are not there, loads that excite nothing, and drives without a meaning, each once.
pub(super) fn faults(config: &Config, source: &SourceMap) -> Vec<Diagnostic> {
    let mut faults = unknown_coils(config, source);
    for case in config.load_cases() {
        for (index, coil) in config.coils.iter().enumerate() {
            faults.extend(drive_fault(config, source, &case, (index, coil)));
        }
        faults.extend(unexcited(config, source, &case));
    }
    // What `[[coils]]` says holds in several load cases.
    let mut seen: Vec<(String, String)> = Vec::new();
    faults.retain(|fault| {
        let own = (fault.path.clone(), fault.message.clone());
        let is_new = !seen.contains(&own);
        seen.push(own);
        is_new
    });
    faults
}

/// Coils that are not there.
fn unknown_coils(config: &Config, source: &SourceMap) -> Vec<Diagnostic> {
    let known: Vec<&str> = config.coils.iter().map(|coil| coil.name.as_str()).collect();
    let named = config.loads.iter().enumerate().flat_map(|(k, load)| {
        let keys = [("ampere_turns", &load.ampere_turns), ("voltage", &load.voltage), ("phase", &load.phase)];
        keys.into_iter().flat_map(move |(key, values)| values.keys().map(move |name| (k, key, name)))
    });
    named
        .filter(|(_, _, name)| !known.contains(&name.as_str()))
        .map(|(k, key, name)| source.unknown_name(&format!("loads[{k}].{key}.{name}"), "coil", name, &known))
        .collect()
}

/// What is wrong with how a coil is fed.
fn drive_fault(
    config: &Config,
    source: &SourceMap,
    case: &config::LoadCase<'_>,
    (index, coil): (usize, &config::Coil),
) -> Option<Diagnostic> {
    let feed = case.feed(coil);
    let is_static = case.frequency == 0.0;
    if is_static && feed.phase != 0.0 {
        let fault = source.diagnostic(&case.path(coil, index, "phase"), "a static current has no phase");
        return Some(
            fault.expected("no phase, or frequencies above 0 Hz; a reversed current is a negative one"),
        );
    }
    if !feed.by_voltage {
        return None;
    }
    let path = case.path(coil, index, "voltage");
    if coil.turns.is_none() && !coil.is_solid() {
        let message = format!("the coil `{}` has no turns, so no voltage drives it", coil.name);
        let help = format!("add a line like: turns = 10 to coils[{index}]");
        return Some(source.diagnostic(&path, message).help(help));
    }
    let (message, expected) = if config.boundaries.uniform_field.is_some() {
        ("the voltage that an applied field induces is not known to the circuit", "coils alone as sources")
    } else if is_static && coil.resistance.unwrap_or(0.0) == 0.0 && !coil.is_solid() {
        ("at 0 Hz no resistance limits the current", "a resistance in series")
    } else if is_static && coil.series_capacitance.is_some() {
        ("at 0 Hz a capacitance passes no current", "no capacitance in series, or a given current of 0 A")
    } else {
        return None;
    };
    Some(source.diagnostic(&path, message).expected(expected))
}

/// What to say of bounds on the sum over several states of what does not add up.
pub(super) fn sum_warnings(config: &Config) -> Vec<String> {
    let of = |own: &config::Constraint| {
        let functional = own.limit.functional().filter(|own| !own.kind.adds_up_over_states())?;
        let count = config.load_cases().iter().filter(|case| functional.is_taken_under(case)).count();
        (count > 1).then(|| {
            let (name, kind) = (&own.name, functional.kind.name());
            let which = if config.loads.is_empty() { "frequency" } else { "load" };
            format!(
                "the constraint `{name}` bounds the sum of the {kind} over {count} states, and none by itself: give it a {which}, and \
                 each other state a constraint of its own"
            )
        })
    };
    config.constraints.iter().filter_map(of).collect()
}

/// A load under which nothing excites a field.
fn unexcited(config: &Config, source: &SourceMap, case: &config::LoadCase<'_>) -> Option<Diagnostic> {
    let (k, load) = case.load?;
    let is_excited = config.coils.iter().any(|coil| case.feed(coil).amplitude != 0.0)
        || config.boundaries.uniform_field.is_some()
        || config.regions.values().any(|region| region.remanence.is_some());
    (!is_excited).then(|| {
        let message = format!(
            "nothing excites a field under the load `{}`: all currents and voltages are 0",
            load.name
        );
        source
            .diagnostic(&format!("loads[{k}].name"), message)
            .expected("a current or voltage of one coil at least")
    })
}
