//! Functions of the inductances `L_jk = F_jᵀ K⁻¹ F_k` [H] of coils with a winding, whatever currents flow.
//!
//! `F` is the load of 1 A and stays; `W = K⁻¹F` is the field of that ampere, the response. As `K` is complex symmetric,
//! `dL_jk = −W_jᵀ dK W_k`: the responses are state and adjoint in one, and a value says [`FunctionalValue::inductances`], its
//! derivatives by the `L_jk`, instead of `∂F/∂u`. In harmonics losses make `L` complex: `Re L` is the inductance, `Re(jωL)` a
//! resistance.

use fluxmorph_geometry::fem::c64;

use super::FunctionalValue;
use crate::circuit::product;
use crate::error::SolverError;
use crate::model::FieldModel;
use crate::solution::FieldSolution;

/// What is made of the inductances of one coil or a pair.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Inductive {
    /// `Re L_jj` [H] of one coil.
    Inductance,
    /// `R + Re(jωL_jj)` [Ω] of one coil: its wire, and the losses that its current makes in the field.
    Resistance,
    /// `ω Re L_jj` over the resistance [1] of one coil.
    QualityFactor,
    /// `Re L_jk` [H] of two coils.
    MutualInductance,
    /// `Re L_jk / √(Re L_jj Re L_kk)` [1] of two coils.
    Coupling,
    /// The largest share [1] of the power into one coil that a load at the other can have: of the two-port `Z = diag(R) + jωL` with
    /// any compensation, `κ − √(κ² − 1)`, `κ = (2 Re Z_jj Re Z_kk − Re Z_jk²)/|Z_jk|²`; of two coils that heat nothing but their
    /// wires `(s − 1)/(s + 1)`, `s² = 1 + (ωM)²/(R_j R_k)`.
    LinkEfficiency,
}

impl Inductive {
    /// How many coils it is of.
    pub fn coils(self) -> usize {
        match self {
            Self::Inductance | Self::Resistance | Self::QualityFactor => 1,
            Self::MutualInductance | Self::Coupling | Self::LinkEfficiency => 2,
        }
    }

    /// Whether it has a meaning at 0 Hz.
    pub fn is_static(self) -> bool {
        matches!(self, Self::Inductance | Self::MutualInductance | Self::Coupling)
    }
}

/// A function of inductances.
#[derive(Clone, Debug)]
pub struct InductanceFunctional {
    /// Places of the windings: one, or two that differ.
    windings: Vec<usize>,
    of: Inductive,
}

impl InductanceFunctional {
    pub(super) fn new(model: &FieldModel, coils: &[&str], of: Inductive) -> Result<Self, SolverError> {
        let refuse =
            |what: String, value: String, expected: &str| Err(SolverError::parameter(what, value, expected));
        let windings = super::windings_of(model, coils)?;
        if windings.len() != of.coils() || windings.len() == 2 && windings[0] == windings[1] {
            let expected = if of.coils() == 1 { "one coil" } else { "two different coils" };
            return refuse(format!("coils of {of:?}"), coils.join(", "), expected);
        }
        if !model.is_linear() {
            let expected =
                "a flux linkage: with a B–H curve there is no inductance that does not depend on the current";
            return refuse("functional".to_owned(), format!("{of:?}"), expected);
        }
        if model.angular_frequency() == 0.0 && !of.is_static() {
            return refuse(format!("frequency of {of:?}"), "0".to_owned(), "a frequency above 0 Hz");
        }
        Ok(Self { windings, of })
    }

    /// Places of the windings whose responses the state must have.
    pub(super) fn windings(&self) -> &[usize] {
        &self.windings
    }

    pub(super) fn evaluate(
        &self,
        model: &FieldModel,
        state: &FieldSolution,
    ) -> Result<FunctionalValue, SolverError> {
        let windings = model.windings();
        let inductance = |j: usize, k: usize| -> Result<c64, SolverError> {
            let expected = "that of every coil of the functional (FieldModel::respond)";
            let missing = || SolverError::parameter("response to 1 A", "none", expected);
            let response = state.response(k).ok_or_else(missing)?;
            Ok(product(windings.load(j), response.values()))
        };
        let omega = model.angular_frequency();
        let wire = |k: usize| windings.winding(k).resistance;
        let j = self.windings[0];
        let own = inductance(j, j)?;
        let Some(&k) = self.windings.get(1) else {
            let (value, slope) = of_one(self.of, omega, wire(j), own);
            return Ok(FunctionalValue { value, inductances: vec![(j, j, slope)], ..Default::default() });
        };
        let numbers = [own, inductance(j, k)?, inductance(k, k)?];
        let (value, [a, b, c]) = of_two(self.of, omega, [wire(j), wire(k)], numbers);
        let inductances = vec![(j, j, a), (j, k, b), (k, k, c)];
        Ok(FunctionalValue { value, inductances, ..Default::default() })
    }
}

/// Value of a function of one coil with the inductance `l`, and its derivative `s`: `dF = 2 Re(s dl)`.
fn of_one(of: Inductive, omega: f64, wire: f64, l: c64) -> (f64, c64) {
    let jw = c64::new(0.0, omega);
    let resistance = wire + (jw * l).re;
    match of {
        Inductive::Resistance => (resistance, 0.5 * jw),
        Inductive::QualityFactor => {
            let quality = omega * l.re / resistance;
            (quality, 0.5 * (omega - quality * jw) / resistance)
        }
        _ => (l.re, c64::new(0.5, 0.0)),
    }
}

/// Value of a function of two coils with the inductances `l_11, l_12, l_22`, and its derivatives by these.
fn of_two(of: Inductive, omega: f64, wires: [f64; 2], l: [c64; 3]) -> (f64, [c64; 3]) {
    let zero = c64::default();
    let half = c64::new(0.5, 0.0);
    match of {
        Inductive::Coupling => {
            let root = (l[0].re * l[2].re).sqrt();
            let coupling = l[1].re / root;
            let by_own = |own: c64| -half * (0.5 * coupling / own.re);
            (coupling, [by_own(l[0]), half / root, by_own(l[2])])
        }
        Inductive::LinkEfficiency => {
            let jw = c64::new(0.0, omega);
            let r = [wires[0] + (jw * l[0]).re, wires[1] + (jw * l[2]).re];
            let z = jw * l[1];
            let square = z.norm_sqr();
            if square == 0.0 {
                return (0.0, [zero; 3]);
            }
            let kappa = (2.0 * r[0] * r[1] - (z * z).re) / square;
            // Without losses all power arrives, and nothing can be gained.
            if kappa <= 1.0 {
                return (1.0, [zero; 3]);
            }
            let root = (kappa * kappa - 1.0).sqrt();
            let efficiency = 1.0 / (kappa + root);
            let slope = -efficiency / root;
            let by_pair = -(z + kappa * z.conj()) / square * jw;
            (efficiency, [r[1] / square * jw, by_pair, r[0] / square * jw].map(|d| slope * d))
        }
        _ => (l[1].re, [zero, half, zero]),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const OMEGA: f64 = 3.0;
    const WIRES: [f64; 2] = [0.4, 0.7];
    /// Of two coils that heat something: `Im L < 0`.
    const L: [c64; 3] = [c64::new(2.0, -0.1), c64::new(0.6, -0.05), c64::new(1.5, -0.08)];

    #[test]
    fn the_derivatives_match_central_differences() {
        // Truncation and rounding of a central difference of values of order one balance near 1e-5.
        let h = 1e-5;
        let all = |of: Inductive, l: [c64; 3]| match of.coils() {
            1 => {
                let (value, slope) = of_one(of, OMEGA, WIRES[0], l[0]);
                (value, [slope, c64::default(), c64::default()])
            }
            _ => of_two(of, OMEGA, WIRES, l),
        };
        for of in [
            Inductive::Inductance,
            Inductive::Resistance,
            Inductive::QualityFactor,
            Inductive::MutualInductance,
            Inductive::Coupling,
            Inductive::LinkEfficiency,
        ] {
            for (k, direction) in (0..3).flat_map(|k| [(k, c64::new(1.0, 0.0)), (k, c64::new(0.0, 1.0))]) {
                let at = |s: f64| {
                    let mut l = L;
                    l[k] += s * direction;
                    all(of, l).0
                };
                let difference = (at(h) - at(-h)) / (2.0 * h);
                let exact = 2.0 * (all(of, L).1[k] * direction).re;
                let size = exact.abs().max(1.0);
                assert!((difference - exact).abs() < 1e-8 * size, "{of:?} {k}: {difference} {exact}");
            }
        }
    }

    #[test]
    fn a_link_of_wires_alone_has_the_efficiency_of_textbooks() {
        let l = L.map(|l| c64::from(l.re));
        let s = (1.0 + (OMEGA * l[1].re).powi(2) / (WIRES[0] * WIRES[1])).sqrt();
        let (found, _) = of_two(Inductive::LinkEfficiency, OMEGA, WIRES, l);
        assert!((found - (s - 1.0) / (s + 1.0)).abs() < 1e-14);
    }

    /// The best load of a two-port, found by trying all of a fine grid, takes the share that the formula says.
    #[test]
    fn no_load_takes_more_than_the_link_efficiency() {
        let jw = c64::new(0.0, OMEGA);
        let z = [WIRES[0] + jw * L[0], jw * L[1], WIRES[1] + jw * L[2]];
        let share = |load: c64| {
            // i_2 = −z_12 i_1/(z_22 + load); power into port one for i_1 = 1 A.
            let i2 = -z[1] / (z[2] + load);
            load.re * i2.norm_sqr() / (z[0] + z[1] * i2).re
        };
        let grid =
            (1..400).flat_map(|i| (0..400).map(move |j| (0.01 * f64::from(i), -6.0 + 0.01 * f64::from(j))));
        let best = grid.map(|(r, x)| share(c64::new(r, x))).fold(0.0, f64::max);
        let (found, _) = of_two(Inductive::LinkEfficiency, OMEGA, WIRES, L);
        // Near the optimum the share is flat: a grid of 0.01 of loads of order one misses it by some 1e-5.
        assert!(best <= found * (1.0 + 1e-12) && best > found * (1.0 - 1e-4), "{best} {found}");
    }
}
