//! What a result says of each of its states, and what tells one from the others, for summary and page.

use std::collections::BTreeMap;

use fluxmorph_optimizer::body::BodyForce;

use crate::files::{
    Amplitude, CoilResult, MultipoleResult, ProbeResult, RunResult, SaturationResult, StateErrors,
    StateResult,
};

/// A state: a load, or a frequency.
pub(super) struct State<'a> {
    /// Its load; `None` where there are no loads.
    pub(super) load: Option<&'a str>,
    /// [Hz]
    pub(super) frequency: f64,
    /// Whether there are others.
    pub(super) is_one_of_several: bool,
    pub(super) losses: &'a BTreeMap<String, f64>,
    pub(super) forces: &'a [BodyForce],
    pub(super) saturation: Option<&'a SaturationResult>,
    pub(super) coils: &'a [CoilResult],
    pub(super) multipoles: &'a [MultipoleResult],
    pub(super) probes: &'a [ProbeResult],
    pub(super) errors: Option<&'a StateErrors>,
}

impl<'a> State<'a> {
    /// The states of a result, at least one.
    pub(super) fn all(result: &'a RunResult) -> Vec<Self> {
        if result.states.is_empty() {
            return vec![Self::only(result)];
        }
        result.states.iter().map(Self::of).collect()
    }

    /// The only one.
    fn only(result: &'a RunResult) -> Self {
        Self {
            load: result.loads.first().map(String::as_str),
            frequency: result.frequencies_hz.first().copied().unwrap_or_default(),
            is_one_of_several: false,
            losses: &result.losses_w,
            forces: &result.forces,
            saturation: result.saturation.as_ref(),
            coils: &result.coils,
            multipoles: &result.multipoles,
            probes: &result.probes,
            errors: result.errors.as_ref(),
        }
    }

    /// One of several.
    fn of(state: &'a StateResult) -> Self {
        Self {
            load: state.load.as_deref(),
            frequency: state.frequency_hz,
            is_one_of_several: true,
            losses: &state.losses_w,
            forces: &state.forces,
            saturation: state.saturation.as_ref(),
            coils: &state.coils,
            multipoles: &state.multipoles,
            probes: &state.probes,
            errors: state.errors.as_ref(),
        }
    }
}

/// What is said behind values of a coil: that those of a phasor are peaks.
pub(super) fn peaks(amplitude: Amplitude) -> &'static str {
    match amplitude {
        Amplitude::Static(_) => "",
        Amplitude::Phasor(_) => ", peak values",
    }
}
