//! Coils as parts of circuits: what their terminals see of the field, and currents that a voltage drives.
//!
//! A coil of `N` turns carries `I` [A]; `F` is the load of 1 A in it, so that its flux linkage is `λ = Fᵀu` [Wb], be it
//! `∫T·B` or `∫J·A` for one ampere, and `L_jk = F_jᵀ K⁻¹ F_k` [H]. With a voltage source `V` and a series impedance `Z = R +
//! jωL_s + 1/(jωC)` the current is unknown too, one equation a coil, `V = Z I + jωλ`, which makes the system
//!
//! `[ K  −F ; −Fᵀ  −Z/(jω) ] [ u ; I ] = [ f ; −V/(jω) ]`:
//!
//! complex symmetric as `K` is, so that the adjoint has the same matrix, and as `F` does not move with the design, the
//! derivative of `K` remains all there is. It is solved by eliminating `u`: one further solution a coil. All values are those
//! of the meshed part. At 0 Hz a voltage drives `V/R`.
//! Lives here: windings, the elimination, what the terminals see. Does not live here: the loads (`crate::load`).

use std::sync::Arc;

use fluxmorph_geometry::fem::c64;
use fluxmorph_geometry::{ElementId, Mesh};

use crate::coil::Coil;
use crate::error::SolverError;
use crate::linear::{LinearSolverReport, PreparedSystem};
use crate::load::Sources;
use crate::model::FieldModel;
use crate::solution::FieldSolution;
use crate::space::Space;
use crate::unknowns::Unknowns;

/// A coil's winding, and the circuit that it is in.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Winding {
    /// Turns.
    pub turns: f64,
    /// Resistance of the wire, and of what is in series with it [Ω].
    pub resistance: f64,
    /// Inductance in series [H].
    pub series_inductance: f64,
    /// Capacitance in series [F]; `None`: none.
    pub series_capacitance: Option<f64>,
    /// Voltage of the source, peak phasor [V]; `None`: the coil's current is given.
    pub voltage: Option<c64>,
}

impl Winding {
    /// `R + jωL_s + 1/(jωC)` [Ω].
    pub fn impedance(&self, angular_frequency: f64) -> c64 {
        let capacitive = self.series_capacitance.map_or(0.0, |c| -1.0 / (angular_frequency * c));
        c64::new(self.resistance, angular_frequency * self.series_inductance + capacitive)
    }
}

/// The loads of 1 A in each coil that has a winding.
#[derive(Debug)]
pub(crate) struct Windings {
    coils: Vec<Driven>,
}

/// A winding with its load.
#[derive(Debug)]
struct Driven {
    /// Place of its coil in the model.
    coil: usize,
    winding: Winding,
    sources: Sources,
    /// `F` [m per unit of a test function].
    load: Vec<c64>,
}

impl Windings {
    /// Of the coils with a winding, in their order.
    ///
    /// # Errors
    /// As [`Sources::new`].
    pub(crate) fn new(
        mesh: &Mesh,
        coils: &[Coil],
        windings: &[Option<Winding>],
        (space, unknowns): (&Space, &Unknowns),
    ) -> Result<Self, SolverError> {
        let of = |(coil, winding): (usize, &Option<Winding>)| -> Option<Result<Driven, SolverError>> {
            let (winding, unit) = (
                (*winding)?,
                Coil { ampere_turns: c64::from(winding.as_ref()?.turns), ..coils.get(coil)?.clone() },
            );
            Some(Sources::new(mesh, &[unit], &[]).map(|sources| {
                let mut load = vec![c64::default(); unknowns.dofs.count()];
                sources.add_load(space, unknowns, mesh, &mut load);
                Driven { coil, winding, sources, load }
            }))
        };
        let coils = windings.iter().enumerate().filter_map(of).collect::<Result<_, _>>()?;
        Ok(Self { coils })
    }

    /// Elements that a voltage-driven coil meets: these must not move.
    pub(crate) fn fixed_elements(&self) -> impl Iterator<Item = ElementId> + '_ {
        self.with_source().flat_map(|(driven, _)| driven.sources.fixed_elements())
    }

    /// Whether a voltage excites a field.
    pub(crate) fn is_driven(&self) -> bool {
        self.with_source().next().is_some()
    }

    /// The voltage-driven ones.
    fn with_source(&self) -> impl Iterator<Item = (&Driven, c64)> {
        self.coils.iter().filter_map(|driven| Some((driven, driven.winding.voltage?)))
    }
}

/// The coils with the currents that are known before the field is: those that a voltage drives carry none in harmonics, and `V/R`
/// in statics.
pub(crate) fn given_currents(
    coils: &[Coil],
    windings: &[Option<Winding>],
    angular_frequency: f64,
) -> Vec<Coil> {
    let mut coils = coils.to_vec();
    for (coil, winding) in coils.iter_mut().zip(windings) {
        let Some((winding, voltage)) = winding.and_then(|winding| Some((winding, winding.voltage?))) else {
            continue;
        };
        let current = if angular_frequency == 0.0 { voltage / winding.resistance } else { c64::default() };
        coil.ampere_turns = winding.turns * current;
    }
    coils.retain(|coil| coil.ampere_turns != c64::default());
    coils
}

/// Solves the field's system for a right side.
type Solve<'a> = dyn FnMut(&[c64]) -> Result<(Vec<c64>, LinearSolverReport), SolverError> + 'a;

/// The elimination of the field for the currents of voltage-driven coils, on one mesh.
#[derive(Debug)]
pub struct Border {
    windings: Arc<Windings>,
    /// `W = K⁻¹ F`.
    responses: Vec<Vec<c64>>,
    /// `FᵀW + Z/(jω)` [H], by rows.
    schur: Vec<Vec<c64>>,
    angular_frequency: f64,
}

impl Border {
    /// Solves for 1 A in each; `None` where no voltage drives a current.
    ///
    /// # Errors
    /// As [`PreparedSystem::solve`].
    pub(crate) fn new(
        windings: &Arc<Windings>,
        angular_frequency: f64,
        solve: &mut Solve<'_>,
    ) -> Result<Option<Self>, SolverError> {
        if angular_frequency == 0.0 || windings.with_source().next().is_none() {
            return Ok(None);
        }
        let responses: Vec<Vec<c64>> = windings
            .with_source()
            .map(|(driven, _)| Ok(solve(&driven.load)?.0))
            .collect::<Result<_, SolverError>>()?;
        let mut schur: Vec<Vec<c64>> = windings
            .with_source()
            .map(|(driven, _)| responses.iter().map(|w| product(&driven.load, w)).collect())
            .collect();
        for (k, (driven, _)) in windings.with_source().enumerate() {
            schur[k][k] += driven.winding.impedance(angular_frequency) / c64::new(0.0, angular_frequency);
        }
        Ok(Some(Self { windings: Arc::clone(windings), responses, schur, angular_frequency }))
    }

    /// Completes `u_0 = K⁻¹ f` to the solution of the whole system; the currents [A]. `sources`: with the voltages, as of a
    /// state, or without, as of an adjoint.
    pub(crate) fn complete(&self, values: &mut [c64], sources: Excitation) -> Vec<c64> {
        let right: Vec<c64> = self
            .windings
            .with_source()
            .map(|(driven, voltage)| {
                let source = match sources {
                    Excitation::Voltages => voltage / c64::new(0.0, self.angular_frequency),
                    Excitation::Shorted => c64::default(),
                };
                source - product(&driven.load, values)
            })
            .collect();
        let currents = solve_dense(self.schur.clone(), right);
        for (current, response) in currents.iter().zip(&self.responses) {
            for (value, w) in values.iter_mut().zip(response) {
                *value += current * w;
            }
        }
        currents
    }
}

/// What is on the right side of the circuits' equations.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Excitation {
    /// The voltages of the sources.
    Voltages,
    /// Nothing: the sources are shorted.
    Shorted,
}

/// `xᵀy`, without conjugation; summed in order.
fn product(x: &[c64], y: &[c64]) -> c64 {
    x.iter().zip(y).map(|(x, y)| x * y).sum()
}

/// Gaussian elimination with row pivoting, for the few equations of circuits.
fn solve_dense(mut matrix: Vec<Vec<c64>>, mut right: Vec<c64>) -> Vec<c64> {
    let n = right.len();
    for k in 0..n {
        let pivot = (k..n).fold(k, |p, i| if matrix[i][k].norm() > matrix[p][k].norm() { i } else { p });
        matrix.swap(k, pivot);
        right.swap(k, pivot);
        for i in k + 1..n {
            let factor = matrix[i][k] / matrix[k][k];
            for j in k..n {
                let above = matrix[k][j];
                matrix[i][j] -= factor * above;
            }
            let above = right[k];
            right[i] -= factor * above;
        }
    }
    for k in (0..n).rev() {
        let known: c64 = (k + 1..n).map(|j| matrix[k][j] * right[j]).sum();
        right[k] = (right[k] - known) / matrix[k][k];
    }
    right
}

/// What the terminals of a coil see, peak phasors.
#[derive(Clone, Debug, PartialEq)]
pub struct CoilTerminals {
    /// Name of the coil.
    pub name: String,
    /// Current [A].
    pub current: c64,
    /// Flux linkage [Wb].
    pub flux_linkage: c64,
    /// Resistance [Ω]: that of the winding, and that of the losses that its current alone makes in the field.
    pub resistance: f64,
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

/// `F_jᵀ K⁻¹ F_k` [H], by rows.
fn mutual(model: &FieldModel, mesh: &Mesh, coils: &[Driven]) -> Result<Vec<Vec<c64>>, SolverError> {
    let mut system: PreparedSystem = model.prepare(model.assembled(mesh))?;
    let unit: Vec<Vec<c64>> = coils
        .iter()
        .map(|driven| Ok(system.solve_field(&driven.load)?.0))
        .collect::<Result<_, SolverError>>()?;
    Ok(coils.iter().map(|driven| unit.iter().map(|u| product(&driven.load, u)).collect()).collect())
}

/// What the terminals see of a state; solves for 1 A in each coil with the state's matrix.
///
/// # Errors
/// As [`FieldModel::prepare`] and [`PreparedSystem::solve`].
pub fn terminals(
    model: &FieldModel,
    mesh: &Mesh,
    solution: &FieldSolution,
) -> Result<Terminals, SolverError> {
    let coils = &model.windings().coils;
    if coils.is_empty() {
        return Ok(Terminals::default());
    }
    let angular_frequency = model.angular_frequency();
    let mutual = if model.is_linear() { mutual(model, mesh, coils)? } else { Vec::new() };
    let mut driven_currents = solution.currents().iter();
    let of = |(k, driven): (usize, &Driven)| {
        let flux_linkage = driven.sources.linkage(model.space(), mesh, |e| solution.element(model, e));
        let current = match (driven.winding.voltage, angular_frequency == 0.0) {
            (None, _) => model.coils()[driven.coil].ampere_turns / driven.winding.turns,
            (Some(voltage), true) => voltage / driven.winding.resistance,
            (Some(_), false) => driven_currents.next().copied().unwrap_or_default(),
        };
        let wire = driven.winding.resistance;
        CoilTerminals {
            name: model.coils()[driven.coil].name.clone(),
            current,
            flux_linkage,
            // Re(jωL) = −ω Im L.
            resistance: wire - mutual.get(k).map_or(0.0, |row| angular_frequency * row[k].im),
            voltage: wire * current + c64::new(0.0, angular_frequency) * flux_linkage,
        }
    };
    Ok(Terminals {
        coils: coils.iter().enumerate().map(of).collect(),
        inductance: mutual.iter().map(|row| row.iter().map(|l| l.re).collect()).collect(),
    })
}
