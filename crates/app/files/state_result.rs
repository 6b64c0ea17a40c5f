//! What `result.json` says of each state: losses, probes, forces, coils, expansions, saturation, and how exact that is.

use std::collections::BTreeMap;

use fluxmorph_optimizer::body::BodyForce;
use serde::{Deserialize, Serialize};

/// What depends on the frequency and on the load.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct StateResult {
    /// The load, where there are some.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub load: Option<String>,
    /// The frequency [Hz].
    pub frequency_hz: f64,
    /// Eddy-current loss by region, of the meshed part [W].
    pub losses_w: BTreeMap<String, f64>,
    /// The field at the probes.
    pub probes: Vec<ProbeResult>,
    /// Force and torque on every body.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub forces: Vec<BodyForce>,
    /// Newton's method and saturation, where there is a B–H curve.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub saturation: Option<SaturationResult>,
    /// What the terminals of the coils with `turns` see.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub coils: Vec<CoilResult>,
    /// The field expanded in circles and balls.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub multipoles: Vec<MultipoleResult>,
    /// Estimated errors of these; `None` where there is no estimate.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub errors: Option<StateErrors>,
    /// What the facets of curved surfaces change of these, about; `None` where none is curved.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub facets_change: Option<StateErrors>,
}

/// Estimated errors of what a state says beside the objective: what true values have more, of vectors and phasors the length of that.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct StateErrors {
    /// Of losses by region [W].
    pub losses_w: BTreeMap<String, f64>,
    /// Of the currents that voltages drive [A].
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub currents_a: BTreeMap<String, f64>,
    /// Of the resistances of solid conductors at 0 Hz [Ω].
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub resistances_ohm: BTreeMap<String, f64>,
    /// Of the flux linkages of coils with `turns` [Wb].
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub flux_linkages_wb: BTreeMap<String, f64>,
    /// Of forces [N] and torques [N m] on every body.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub forces: BTreeMap<String, ForceError>,
    /// Of the terms of expansions [T], by the names of both.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub multipoles_t: BTreeMap<String, BTreeMap<String, f64>>,
    /// Of B at the points of probes [T]; `null` for a point that the moved mesh no longer holds.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub probes_t: BTreeMap<String, Vec<Option<f64>>>,
}

impl StateErrors {
    /// Whether all of them are numbers.
    pub fn is_finite(&self) -> bool {
        let forces = self.forces.values().flat_map(|own| [own.force_n, own.torque_nm]);
        let terms = self.multipoles_t.values().flat_map(|terms| terms.values().copied());
        let probes = self.probes_t.values().flatten().flatten().copied();
        let coils = [&self.currents_a, &self.resistances_ohm, &self.flux_linkages_wb]
            .map(BTreeMap::values)
            .into_iter()
            .flatten();
        let others = self.losses_w.values().chain(coils).copied();
        others.chain(forces).chain(terms).chain(probes).all(f64::is_finite)
    }
}

/// Estimated errors on a body, lengths of vectors.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct ForceError {
    /// [N]
    pub force_n: f64,
    /// [N m]
    pub torque_nm: f64,
}

/// The field at the points of one probe, shapes `(n_points, 3)`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ProbeResult {
    /// The probe's name.
    pub name: String,
    /// The points [m].
    pub points_m: Vec<[f64; 3]>,
    /// Real part of B [T]; `null` for a point that the moved mesh no longer holds.
    pub b_re_t: Vec<Option<[f64; 3]>>,
    /// Imaginary part of B [T]; `null` likewise.
    pub b_im_t: Vec<Option<[f64; 3]>>,
}

/// What the terminals of a coil see; of the meshed part.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct CoilResult {
    /// Its name.
    pub name: String,
    /// Current [A].
    pub current_a: Amplitude,
    /// Flux linkage [Wb].
    pub flux_linkage_wb: Amplitude,
    /// Resistance of the wire, and of the losses that its current alone makes [Ω]; `null` where it is not known.
    pub resistance_ohm: Option<f64>,
    /// Voltage across it [V].
    pub voltage_v: Amplitude,
}

/// A number in statics, the real and imaginary part of a peak phasor in harmonics.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(untagged)]
pub enum Amplitude {
    /// In statics.
    Static(f64),
    /// In harmonics.
    Phasor([f64; 2]),
}

/// An expansion of the flux density.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct MultipoleResult {
    /// Its name.
    pub name: String,
    /// Reference radius [m].
    pub radius_m: f64,
    /// Its terms.
    pub terms: Vec<HarmonicResult>,
}

/// One term of an expansion.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct HarmonicResult {
    /// Its name, such as `b3` or `c2_0`.
    pub name: String,
    /// The coefficient [T].
    pub value_t: Amplitude,
    /// Its magnitude relative to that of the main order, in units of 1e-4; `null` where there is no main field.
    pub units: Option<f64>,
}

/// A nonlinear solution, and how far it goes into the curves.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct SaturationResult {
    /// Steps of Newton's method, its linear start included.
    pub newton_steps: usize,
    /// Every region with a B–H curve.
    pub regions: Vec<SaturatedRegion>,
}

/// How far a region goes into its curve.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct SaturatedRegion {
    /// The region.
    pub region: String,
    /// Largest `|B|` of an element's mean [T].
    pub highest_b_t: f64,
    /// Where [m].
    pub place_m: [f64; 3],
    /// Last `B` of the curve's points [T]; `None` for a curve in closed form.
    pub table_ends_b_t: Option<f64>,
    /// Where its knee is: the `B` beyond which the differential permeability is below a tenth of its largest [T]; `None` where
    /// there is no such field.
    pub knee_b_t: Option<f64>,
    /// Share of its volume beyond the knee: where the differential permeability is below a tenth of its largest.
    pub volume_share_beyond_knee: f64,
}
