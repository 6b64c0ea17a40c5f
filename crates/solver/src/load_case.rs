//! What excites a field problem: one frequency, with the currents or voltages of the coils.
//!
//! Load cases of one frequency differ in their right sides alone: where all materials are linear they share matrix, factor and
//! responses, and a further case costs one solution. Permanent magnets and applied fields are those of the set-up in all of them.

use fluxmorph_geometry::fem::c64;
use std::sync::Arc;

use crate::error::SolverError;
use crate::linear::PreparedSystem;
use crate::model::FieldModel;
use crate::setup::FieldModelSetup;

/// How a coil is fed, peak phasors.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Drive {
    /// By given ampere-turns [A].
    Current(c64),
    /// By a voltage [V] across the winding and what is in series with it; of a coil with a winding.
    Voltage(c64),
}

/// A frequency, and how every coil is fed at it.
#[derive(Clone, Debug, PartialEq)]
pub struct LoadCase {
    /// Its name, for messages and arrays; `None` where it has none.
    pub name: Option<String>,
    /// Frequency [Hz]; zero for magnetostatics.
    pub frequency: f64,
    /// By the coils of the set-up, in their order, one for each.
    pub drives: Vec<Drive>,
}

impl LoadCase {
    /// That of a set-up.
    pub(crate) fn of(setup: &FieldModelSetup) -> Self {
        let drive = |(k, coil): (usize, &crate::coil::Coil)| {
            let voltage = setup.windings.get(k).copied().flatten().and_then(|winding| winding.voltage);
            voltage.map_or(Drive::Current(coil.ampere_turns), Drive::Voltage)
        };
        let drives = setup.coils.iter().enumerate().map(drive).collect();
        Self { name: setup.load_case.clone(), frequency: setup.frequency, drives }
    }

    /// A set-up under this load case. A drive by voltage is left out of a coil without a winding.
    pub fn applied_to(&self, setup: &FieldModelSetup) -> FieldModelSetup {
        let Self { name, frequency, drives } = self;
        let mut setup = FieldModelSetup { load_case: name.clone(), frequency: *frequency, ..setup.clone() };
        for (k, (coil, drive)) in setup.coils.iter_mut().zip(drives).enumerate() {
            let (current, voltage) = match *drive {
                Drive::Current(current) => (current, None),
                Drive::Voltage(voltage) => (c64::default(), Some(voltage)),
            };
            coil.ampere_turns = current;
            if let Some(winding) = setup.windings.get_mut(k).and_then(Option::as_mut) {
                winding.voltage = voltage;
            }
        }
        setup
    }
}

/// A frequency [Hz] as a part of names, to a microhertz: `200Hz`.
///
/// ```
/// # use fluxmorph_solver::frequency_label;
/// assert_eq!(frequency_label(8.03 * 1e3), "8030Hz");
/// ```
pub fn frequency_label(frequency: f64) -> String {
    format!("{}Hz", (frequency * 1e6).round() / 1e6)
}

impl FieldModel {
    /// The load case that the problem is solved for.
    pub fn load_case(&self) -> LoadCase {
        LoadCase::of(self.setup())
    }

    /// The load case as a part of names: its name, else its frequency to a microhertz, `200Hz`; without what ParaView's calculator takes
    /// for an operator.
    pub fn label(&self) -> String {
        let name = self.setup().load_case.clone();
        name.unwrap_or_else(|| frequency_label(self.setup().frequency)).replace(['-', '.'], "_")
    }

    /// Whether the matrix is that of another problem on every mesh, so that a system of one serves both.
    pub fn shares_matrix_with(&self, other: &Self) -> bool {
        self.is_linear() && Arc::ptr_eq(self.form(), other.form())
    }

    /// A prepared system of a problem with the same matrix, with the circuits of this one. [`FieldModel::shares_matrix_with`] says whether
    /// it is that; it is not looked at here.
    ///
    /// # Errors
    /// As [`PreparedSystem::solve_field`], for coils that a voltage drives here and not there.
    pub fn take_over(&self, system: PreparedSystem) -> Result<PreparedSystem, SolverError> {
        system.bordered_anew(self.windings(), self.angular_frequency())
    }
}
