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
//! of the meshed part. At 0 Hz a voltage drives `V/R`. A solid conductor is a coil of one turn, whose `λ = V/(jω)` is itself an
//! unknown of the field (`solids`).
//! Lives here: windings (`mod`), their equations (`equations`), the elimination (`border`), solid conductors (`solids`), what the
//! terminals see (`terminals`). Does not live here: the loads (`crate::load`), functionals of terminals and inductances (`crate::functional`).

mod border;
mod equations;
pub(crate) mod solids;
mod terminals;

use std::ops::Range;
use std::sync::Arc;

use fluxmorph_geometry::Mesh;
use fluxmorph_geometry::fem::c64;

use crate::coil::{Coil, CoilShape};
use crate::elements::Order;
use crate::error::SolverError;
use crate::load::Sources;
use crate::material::Material;
use crate::space::Space;
use crate::unknowns::Unknowns;
pub(crate) use border::Border;
pub(crate) use equations::{Equations, Excitation};
pub(crate) use solids::{SolidRows, Solids};
pub use terminals::{
    CoilTerminals, Terminals, currents, direct_resistances, flux_linkages, powers, terminals,
};

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
    /// Of a solid conductor with nothing in series, whose current is given.
    const SOLID: Self =
        Self { turns: 1.0, resistance: 0.0, series_inductance: 0.0, series_capacitance: None, voltage: None };

    /// `R + jωL_s + 1/(jωC)` [Ω].
    pub fn impedance(&self, angular_frequency: f64) -> c64 {
        let capacitive = self.series_capacitance.map_or(0.0, |c| -1.0 / (angular_frequency * c));
        c64::new(self.resistance, angular_frequency * self.series_inductance + capacitive)
    }
}

/// The loads of 1 A in each coil that has a winding.
#[derive(Clone, Debug)]
pub(crate) struct Windings {
    coils: Vec<Driven>,
}

/// A winding with its load.
#[derive(Clone, Debug)]
struct Driven {
    /// Place of its coil in the model.
    coil: usize,
    winding: Winding,
    /// Of a solid conductor above 0 Hz, its segments by their numbers: it is in the field, and no source.
    solid: Option<Range<usize>>,
    sources: Arc<Sources>,
    /// `F` [m per unit of a test function]; of a solid conductor 1 in its own rows behind those of the field.
    load: Arc<Vec<c64>>,
}

impl Driven {
    /// `F` as far as it is in the field's equations: nothing of a solid conductor.
    fn field_load(&self) -> &[c64] {
        if self.solid.is_some() { &[] } else { &self.load }
    }
}

impl Windings {
    /// Of the coils with a winding, in their order. `known` are the windings of the same coils on the same mesh, whose sources are
    /// shared.
    ///
    /// # Errors
    /// As [`Sources::new`].
    pub(crate) fn new(
        mesh: &Mesh,
        coils: &[Coil],
        (windings, known): (&[Option<Winding>], Option<&Self>),
        (space, unknowns, solids): (&Space, &Unknowns, &Solids),
    ) -> Result<Self, SolverError> {
        let of = |(coil, winding): (usize, &Option<Winding>)| -> Option<Result<Driven, SolverError>> {
            let winding = (*winding)?;
            let solid = solids.of_coil(coil);
            let own = coils.get(coil)?;
            let known = known.and_then(|known| known.coils.iter().find(|driven| driven.coil == coil));
            let sources = match known {
                Some(driven) => Ok(Arc::clone(&driven.sources)),
                None if solid.is_some() => Sources::new(mesh, &[], &[]).map(Arc::new),
                None => {
                    let unit = Coil { ampere_turns: c64::from(winding.turns), ..own.clone() };
                    Sources::new(mesh, &[unit], &[]).map(Arc::new)
                }
            };
            Some(sources.map(|sources| {
                let mut load = vec![c64::default(); unknowns.dofs.count()];
                sources.add_load(space, unknowns, mesh, &mut load);
                if let Some(segments) = &solid {
                    load.resize(load.len() + segments.start, c64::default());
                    load.resize(load.len() + segments.len(), c64::from(1.0));
                }
                Driven { coil, winding, solid, sources, load: Arc::new(load) }
            }))
        };
        let coils = windings.iter().enumerate().filter_map(of).collect::<Result<_, _>>()?;
        Ok(Self { coils })
    }

    /// The same with other voltages, by the place of the coil; the loads are shared.
    pub(crate) fn driven_as(&self, windings: &[Option<Winding>]) -> Self {
        let of = |driven: &Driven| {
            let winding = windings.get(driven.coil).copied().flatten().unwrap_or(driven.winding);
            Driven { winding, ..driven.clone() }
        };
        Self { coils: self.coils.iter().map(of).collect() }
    }

    /// What makes the loads.
    pub(crate) fn sources(&self) -> impl Iterator<Item = &Sources> {
        self.coils.iter().map(|driven| &*driven.sources)
    }

    /// Whether a voltage or the current of a solid conductor excites a field.
    pub(crate) fn is_driven(&self, coils: &[Coil]) -> bool {
        self.with_source().next().is_some() || self.solid_currents(coils).any(|i| i != c64::default())
    }

    /// How many coils have a winding.
    pub(crate) fn count(&self) -> usize {
        self.coils.len()
    }

    /// The winding at a place.
    pub(crate) fn winding(&self, k: usize) -> &Winding {
        &self.coils[k].winding
    }

    /// `F` of the winding at a place, one entry per unknown.
    pub(crate) fn load(&self, k: usize) -> &[c64] {
        &self.coils[k].load
    }

    /// Number of voltage-driven coils.
    pub(crate) fn source_count(&self) -> usize {
        self.with_source().count()
    }

    /// The place of a winding among the voltage-driven ones; `None` where its current is given.
    pub(crate) fn source_position(&self, k: usize) -> Option<usize> {
        self.coils[k].winding.voltage?;
        Some(self.coils[..k].iter().filter(|driven| driven.winding.voltage.is_some()).count())
    }

    /// Adds the loads of currents [A] in the voltage-driven coils to one of the field.
    pub(crate) fn add_driven_load(&self, currents: &[c64], load: &mut [c64]) {
        for ((driven, _), current) in self.with_source().zip(currents) {
            load.iter_mut().zip(driven.load.iter()).for_each(|(sum, own)| *sum += current * own);
        }
    }

    /// Net currents [A] of the solid conductors whose current is given, zero of the others: behind the load of the field.
    pub(crate) fn solid_currents<'a>(&'a self, coils: &'a [Coil]) -> impl Iterator<Item = c64> + 'a {
        let solids = self.coils.iter().filter_map(|driven| Some((driven, driven.solid.clone()?)));
        solids.flat_map(|(driven, segments)| {
            let current = match driven.winding.voltage {
                None => coils[driven.coil].ampere_turns,
                Some(_) => c64::default(),
            };
            segments.map(move |_| current)
        })
    }

    /// The voltage-driven ones.
    fn with_source(&self) -> impl Iterator<Item = (&Driven, c64)> {
        self.coils.iter().filter_map(|driven| Some((driven, driven.winding.voltage?)))
    }
}

/// The windings of all coils: that of a solid conductor has one turn, and at 0 Hz the resistance of its conduction.
///
/// # Errors
/// [`SolverError::Parameter`] for a solid conductor of a material that does not conduct, or of several; else as
/// [`SolidConductor::direct_resistance`](crate::coil::SolidConductor::direct_resistance).
pub(crate) fn windings(
    mesh: &Mesh,
    order: Order,
    (coils, windings): (&[Coil], &[Option<Winding>]),
    materials: &[Material],
    angular_frequency: f64,
) -> Result<Vec<Option<Winding>>, SolverError> {
    let mut windings = windings.to_vec();
    for (coil, conductor) in solids::conductors(coils) {
        let regions = conductor.potential().iter().map(|(e, _)| mesh.topology().region_of()[e.index()]);
        let mut conductivities = regions.map(|region| materials[region.index()].conductivity);
        let conductivity = conductivities.next().unwrap_or(0.0);
        if conductivity == 0.0 || conductivities.any(|other| other != conductivity) {
            let what = format!("conductivity of the solid conductor `{}`", coils[coil].name);
            return Err(SolverError::parameter(
                what,
                conductivity,
                "the same positive number in all of its elements",
            ));
        }
        if windings.len() <= coil {
            windings.resize(coil + 1, None);
        }
        let winding = windings[coil].get_or_insert(Winding::SOLID);
        winding.turns = 1.0;
        if angular_frequency == 0.0 {
            winding.resistance += conductor.direct_resistance(mesh, order, conductivity)?;
        }
    }
    Ok(windings)
}

/// The coils with the currents that are known before the field is: those that a voltage drives carry none in harmonics, and `V/R`
/// in statics; those of solid conductors are no sources in harmonics.
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
    let is_source = |coil: &Coil| angular_frequency == 0.0 || !matches!(coil.shape, CoilShape::Solid(_));
    coils.retain(|coil| coil.ampere_turns != c64::default() && is_source(coil));
    coils
}

/// `xᵀy`, without conjugation; summed in order.
pub(crate) fn product(x: &[c64], y: &[c64]) -> c64 {
    x.iter().zip(y).map(|(x, y)| x * y).sum()
}
