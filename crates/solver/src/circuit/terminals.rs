//! What the terminals of coils see of a state, and the matrix of their inductances.

use fluxmorph_geometry::fem::c64;

use super::{Driven, Windings, product};
use crate::coil::CoilShape;
use crate::error::SolverError;
use crate::linear::PreparedSystem;
use crate::model::FieldModel;
use crate::solution::{FieldSolution, FieldState};

/// What the terminals of a coil see, peak phasors.
#[derive(Clone, Debug, PartialEq)]
pub struct CoilTerminals {
    /// Name of the coil.
    pub name: String,
    /// Current [A].
    pub current: c64,
    /// Flux linkage [Wb].
    pub flux_linkage: c64,
    /// Resistance [Ω]: that of the winding, and that of the losses that its current alone makes in the field; above 0 Hz beside iron
    /// that saturates `Re(V/I)` of the state, and `None` without a current or a voltage of its own.
    pub resistance: Option<f64>,
    /// Voltage across the coil with its resistance, without what else is in series [V].
    pub voltage: c64,
}

/// The coils with a winding, and their inductance matrix [H], in their order: its real part in harmonics, where losses make it
/// complex; empty where iron saturates, which has no such matrix.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Terminals {
    /// What each sees.
    pub coils: Vec<CoilTerminals>,
    /// `L_jk`, by rows.
    pub inductance: Vec<Vec<f64>>,
}

impl Driven {
    /// Across the coil with its resistance, without what else is in series [V].
    fn voltage(&self, model: &FieldModel, current: c64, linkage: c64) -> c64 {
        self.winding.resistance * current + c64::new(0.0, model.angular_frequency()) * linkage
    }
}

impl Windings {
    /// The place among these of the coil with a name.
    pub(crate) fn position(&self, model: &FieldModel, name: &str) -> Option<usize> {
        self.coils.iter().position(|driven| model.coils()[driven.coil].name == name)
    }

    /// Current [A] of a winding in a state.
    pub(crate) fn current(&self, k: usize, model: &FieldModel, state: &FieldSolution) -> c64 {
        let Driven { coil, winding, .. } = &self.coils[k];
        match (winding.voltage, model.angular_frequency() == 0.0) {
            (None, _) => model.coils()[*coil].ampere_turns / winding.turns,
            (Some(voltage), true) => voltage / winding.resistance,
            (Some(_), false) => {
                self.source_position(k).and_then(|d| state.currents().get(d)).copied().unwrap_or_default()
            }
        }
    }

    /// Flux linkage [Wb] of a winding in a state.
    pub(crate) fn linkage(&self, k: usize, (model, mesh, state): FieldState<'_>) -> c64 {
        if let Some(segments) = &self.coils[k].solid {
            return state.solid_unknowns(model)[segments.clone()].iter().sum();
        }
        self.coils[k].sources.linkage(model.space(), mesh, |e| state.element(model, e))
    }
}

/// `F_jᵀ K⁻¹ F_k` [H], by rows; the responses are those of the state, or solved for.
fn mutual((model, mesh, state): FieldState<'_>, coils: &[Driven]) -> Result<Vec<Vec<c64>>, SolverError> {
    let mut system: Option<PreparedSystem> = None;
    let mut respond = |(k, driven): (usize, &Driven)| -> Result<Vec<c64>, SolverError> {
        if let Some(response) = state.response(k) {
            return Ok(response.values().to_vec());
        }
        if system.is_none() {
            system = Some(model.prepare(model.assembled(mesh))?);
        }
        let system = system.as_mut().expect("it has just been prepared");
        Ok(system.solve_field(&driven.load)?.0)
    };
    let unit = coils.iter().enumerate().map(&mut respond).collect::<Result<Vec<_>, SolverError>>()?;
    Ok(coils.iter().map(|driven| unit.iter().map(|u| product(&driven.load, u)).collect()).collect())
}

/// Flux linkages [Wb] of the coils with windings in a state, with their names.
pub fn flux_linkages((model, mesh, solution): FieldState<'_>) -> Vec<(String, c64)> {
    let windings = model.windings();
    let of = |(k, driven): (usize, &Driven)| {
        (model.coils()[driven.coil].name.clone(), windings.linkage(k, (model, mesh, solution)))
    };
    windings.coils.iter().enumerate().map(of).collect()
}

/// Currents [A] of the coils with windings in a state, with their names: those that a voltage drives are found with the field.
pub fn currents(model: &FieldModel, solution: &FieldSolution) -> Vec<(String, c64)> {
    let windings = model.windings();
    let of = |(k, driven): (usize, &Driven)| {
        (model.coils()[driven.coil].name.clone(), windings.current(k, model, solution))
    };
    windings.coils.iter().enumerate().map(of).collect()
}

/// Complex powers `½ V I*` [W] of the coils with windings in a state, with their names: of the voltage across a coil with its
/// resistance.
pub fn powers((model, mesh, solution): FieldState<'_>) -> Vec<(String, c64)> {
    let windings = model.windings();
    let of = |(k, driven): (usize, &Driven)| {
        let current = windings.current(k, model, solution);
        let voltage = driven.voltage(model, current, windings.linkage(k, (model, mesh, solution)));
        (model.coils()[driven.coil].name.clone(), 0.5 * voltage * current.conj())
    };
    windings.coils.iter().enumerate().map(of).collect()
}

/// Resistances [Ω] of the solid conductors in statics with what is in series, by their names: they are known without the field. None
/// above 0 Hz.
pub fn direct_resistances(model: &FieldModel) -> Vec<(String, f64)> {
    let is_direct = |driven: &&Driven| {
        let shape = &model.coils()[driven.coil].shape;
        model.angular_frequency() == 0.0 && matches!(shape, CoilShape::Solid(_))
    };
    let of = |driven: &Driven| (model.coils()[driven.coil].name.clone(), driven.winding.resistance);
    model.windings().coils.iter().filter(is_direct).map(of).collect()
}

/// What the terminals see of a state; solves for 1 A in each coil with the state's matrix.
///
/// # Errors
/// As [`FieldModel::prepare`] and [`PreparedSystem::solve`].
pub fn terminals((model, mesh, solution): FieldState<'_>) -> Result<Terminals, SolverError> {
    let windings = model.windings();
    let coils = &windings.coils;
    if coils.is_empty() {
        return Ok(Terminals::default());
    }
    let angular_frequency = model.angular_frequency();
    let mutual = if model.is_linear() { mutual((model, mesh, solution), coils)? } else { Vec::new() };
    let of = |(k, driven): (usize, &Driven)| {
        let flux_linkage = windings.linkage(k, (model, mesh, solution));
        let current = windings.current(k, model, solution);
        let wire = driven.winding.resistance;
        let is_at_rest = current == c64::default() || driven.winding.voltage == Some(c64::default());
        let is_known = model.is_linear() || angular_frequency == 0.0 || !is_at_rest;
        let apparent = if current == c64::default() { current } else { flux_linkage / current };
        let inductance = mutual.get(k).map_or(apparent, |row| row[k]);
        CoilTerminals {
            name: model.coils()[driven.coil].name.clone(),
            current,
            flux_linkage,
            // Re(jωL) = −ω Im L.
            resistance: is_known.then_some(wire - angular_frequency * inductance.im),
            voltage: driven.voltage(model, current, flux_linkage),
        }
    };
    Ok(Terminals {
        coils: coils.iter().enumerate().map(of).collect(),
        inductance: mutual.iter().map(|row| row.iter().map(|l| l.re).collect()).collect(),
    })
}
