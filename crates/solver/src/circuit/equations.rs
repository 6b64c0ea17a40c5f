//! The equations of circuits beside those of the field, on one mesh.
//!
//! With `F = −c` of a solid conductor and `y` for `U` and `I` the system is `K u − F y = f`, `Fᵀu + D y = r`: see the modules
//! above for its entries. Written symmetrically, as loads and the right sides of adjoint problems are, the second is
//! `−Fᵀu − D y = −r`.

use std::sync::Arc;

use fluxmorph_geometry::fem::c64;
use fluxmorph_geometry::fem::scalar::{axpy, norm};

use super::{SolidRows, Windings, product};

/// The circuits of a model: solid conductors first, then voltage-driven coils.
#[derive(Clone, Debug)]
pub(crate) struct Equations {
    windings: Arc<Windings>,
    solids: SolidRows,
    angular_frequency: f64,
}

/// What is on the right side of the circuits' equations.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Excitation<'a> {
    /// The voltages of the sources, as of a state.
    Voltages,
    /// These entries, as of an adjoint, zero where they end.
    Given(&'a [c64]),
    /// No current flows in them, as of the response to 1 A.
    Open,
}

impl Equations {
    /// `None` where there is neither solid conductor nor driven current.
    pub(crate) fn new(windings: &Arc<Windings>, solids: SolidRows, angular_frequency: f64) -> Option<Self> {
        let exist = angular_frequency > 0.0 && solids.count() + windings.source_count() > 0;
        exist.then(|| Self { windings: Arc::clone(windings), solids, angular_frequency })
    }

    /// The windings with those that a voltage drives.
    pub(super) fn windings(&self) -> &Windings {
        &self.windings
    }

    /// Whether the reactance of something in series is that of a capacitance.
    pub(crate) fn have_capacitance(&self) -> bool {
        let mut driven = self.windings.with_source().map(|(driven, _)| driven);
        driven.any(|own| own.winding.impedance(self.angular_frequency).im < 0.0)
    }

    /// What solid conductors add to the field's matrix.
    pub(crate) fn solids(&self) -> &SolidRows {
        &self.solids
    }

    /// `F` of every unknown, as far as it is in the field's equations.
    pub(super) fn loads(&self) -> impl Iterator<Item = &[c64]> {
        let of_coils = self.windings.with_source().map(|(driven, _)| driven.field_load());
        self.solids.loads.iter().map(Vec::as_slice).chain(of_coils)
    }

    /// `D` [H], by rows.
    pub(super) fn block(&self) -> Vec<Vec<c64>> {
        let solids = self.solids.count();
        let size = solids + self.windings.source_count();
        let mut block = vec![vec![c64::default(); size]; size];
        for (k, diagonal) in self.solids.diagonal.iter().enumerate() {
            block[k][k] = -diagonal;
        }
        for (k, (driven, _)) in self.windings.with_source().enumerate() {
            let own = solids + k;
            block[own][own] =
                driven.winding.impedance(self.angular_frequency) / c64::new(0.0, self.angular_frequency);
            for segment in driven.solid.clone().into_iter().flatten() {
                block[own][segment] += 1.0;
                block[segment][own] += 1.0;
            }
        }
        block
    }

    /// `r`; `of_solids` are those of solid conductors written symmetrically, zero where they end.
    pub(super) fn right_sides(&self, of_solids: &[c64], right_side: Excitation<'_>) -> Vec<c64> {
        let entry = |entries: &[c64], k: usize| entries.get(k).map_or(c64::default(), |entry| -entry);
        let sources = self.windings.with_source().enumerate().map(|(d, (_, voltage))| match right_side {
            Excitation::Voltages => voltage / c64::new(0.0, self.angular_frequency),
            Excitation::Given(entries) => entry(entries, d),
            Excitation::Open => c64::default(),
        });
        (0..self.solids.count()).map(|k| entry(of_solids, k)).chain(sources).collect()
    }

    /// Adds `F y` to a load of the field.
    pub(crate) fn add_loads(&self, y: &[c64], sum: &mut [c64]) {
        self.loads().zip(y).for_each(|(load, y)| axpy(*y, load, &mut sum[..load.len()]));
    }

    /// A size of what circuits add to the rows of the field, whatever of it cancels.
    pub(crate) fn size(&self, y: &[c64]) -> f64 {
        self.loads().zip(y).map(|(load, y)| y.norm() * norm(load)).sum()
    }

    /// What is left of the circuits' equations with these unknowns, written symmetrically, with the sign of a right side; and the
    /// largest of these over its parts [1], whatever of them cancels.
    pub(crate) fn residual(&self, (u, y): (&[c64], &[c64]), of_solids: &[c64]) -> (Vec<c64>, f64) {
        let block = self.block();
        let right = self.right_sides(of_solids, Excitation::Voltages);
        let uncancelled =
            |load: &[c64]| -> f64 { load.iter().zip(u).map(|(load, u)| load.norm() * u.norm()).sum() };
        let of_field: Vec<f64> = self.loads().map(uncancelled).collect();
        // A voltage between what drives a conductor and what its eddy currents take may be rounding of both.
        let solids = self.solids.count();
        let least = |j: usize| {
            if j < solids { (of_field[j] + right[j].norm()) / block[j][j].norm() } else { 0.0 }
        };
        let sizes: Vec<f64> = y.iter().enumerate().map(|(j, y)| y.norm().max(least(j))).collect();
        let mut most: f64 = 0.0;
        let rows = self.loads().zip(&block).zip(&right).zip(&of_field);
        let rows = rows.map(|(((load, row), r), of_field)| {
            let of_circuits: c64 = row.iter().zip(y).map(|(entry, y)| entry * y).sum();
            let size: f64 = row.iter().zip(&sizes).map(|(entry, size)| entry.norm() * size).sum();
            let left = product(load, u) + of_circuits - r;
            let size = size + of_field + r.norm();
            most = most.max(if size > 0.0 { left.norm() / size } else { 0.0 });
            left
        });
        let rows = rows.collect();
        (rows, most)
    }
}
