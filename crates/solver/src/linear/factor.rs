//! A factor as a preconditioner: symmetric diagonal scaling, and the conversion of residuals to the factor's numbers.
//!
//! The scaled matrix `S K S` has diagonal entries of modulus about one, so that single precision has room at both ends; `S` are
//! powers of two, which round nothing. A complex factor takes a residual as one column, a real one (of `Re K + Im K`) its real
//! and imaginary parts as two.

use std::any::Any;
use std::sync::Arc;

use fluxmorph_geometry::MeshError;
use fluxmorph_geometry::fem::{
    CsrMatrix, FactorScalar, Incomplete, IncompleteAnalysis, KeptPanels, Ldlt, LdltAnalysis, c32, c64, norm,
};
use rayon::prelude::*;

/// A preconditioner: `z = M⁻¹ r` with complex symmetric `M`.
pub(super) trait Precondition: std::fmt::Debug + Send + Sync {
    /// Overwrites `z` with `M⁻¹ r`.
    fn apply(&self, r: &[c64], z: &mut [c64]);

    /// Bytes held.
    fn bytes(&self) -> usize;

    /// Moves an initial guess to where the iteration may start.
    fn start(&self, _matrix: &CsrMatrix<c64>, _b: &[c64], _x: &mut [c64]) {}

    /// What the factor of another matrix of the pattern may begin with.
    fn kept(&self) -> Option<KeptPart> {
        None
    }
}

/// The part of a factor that stays as it is while parts of the matrix change: a [`Kept`] of some number type.
pub(super) type KeptPart = Arc<dyn Any + Send + Sync>;

/// Panels of a factor, and the scales with which its matrix was multiplied.
struct Kept<T> {
    scale: Vec<f64>,
    panels: KeptPanels<T>,
}

/// Unknowns of a parallel task.
const UNKNOWNS: usize = 4096;

/// How a complex system is represented in the numbers of a factor.
pub(super) trait Representation: FactorScalar + 'static {
    /// The entry of the factored matrix for an entry of `K`.
    fn of_entry(entry: c64) -> Self;

    /// Columns of right sides for `factor · s_i r_i`.
    fn columns(r: &[c64], scale: &[f64], factor: f64) -> Vec<Self>;

    /// `z_i = s_i x_i / factor` of the solved columns.
    fn read(columns: &[Self], scale: &[f64], factor: f64, z: &mut [c64]);
}

macro_rules! complex_representation {
    ($complex:ty, $real:ty) => {
        impl Representation for $complex {
            fn of_entry(entry: c64) -> Self {
                Self::new(entry.re as $real, entry.im as $real)
            }

            fn columns(r: &[c64], scale: &[f64], factor: f64) -> Vec<Self> {
                let scaled = r.par_iter().zip(scale).with_min_len(UNKNOWNS);
                scaled.map(|(&r, s)| Self::of_entry(r * (s * factor))).collect()
            }

            fn read(columns: &[Self], scale: &[f64], factor: f64, z: &mut [c64]) {
                let solved = z.par_iter_mut().zip(columns).zip(scale).with_min_len(UNKNOWNS);
                solved.for_each(|((z, x), s)| {
                    *z = c64::new(f64::from(x.re), f64::from(x.im)) * (s / factor);
                });
            }
        }
    };
}

macro_rules! real_representation {
    ($real:ty) => {
        impl Representation for $real {
            fn of_entry(entry: c64) -> Self {
                (entry.re + entry.im) as $real
            }

            fn columns(r: &[c64], scale: &[f64], factor: f64) -> Vec<Self> {
                let scaled = || r.par_iter().zip(scale).with_min_len(UNKNOWNS);
                let re = scaled().map(|(r, s)| (r.re * (s * factor)) as $real);
                re.chain(scaled().map(|(r, s)| (r.im * (s * factor)) as $real)).collect()
            }

            fn read(columns: &[Self], scale: &[f64], factor: f64, z: &mut [c64]) {
                let (re, im) = columns.split_at(z.len());
                let solved = z.par_iter_mut().zip(re.par_iter().zip(im)).zip(scale).with_min_len(UNKNOWNS);
                solved.for_each(|((z, (&re, &im)), s)| {
                    *z = c64::new(f64::from(re), f64::from(im)) * (s / factor);
                });
            }
        }
    };
}

complex_representation!(c64, f64);
complex_representation!(c32, f32);
real_representation!(f64);
real_representation!(f32);

/// A factor of the scaled matrix.
#[derive(Debug)]
pub(super) struct Scaled<T> {
    scale: Vec<f64>,
    /// Brings the largest scale to between one and two: a power of two, which rounds nothing.
    shift: f64,
    factor: Ldlt<T>,
}

impl<T: Representation> Scaled<T> {
    /// The complete factor, with what is kept of another one.
    pub(super) fn complete(
        analysis: &Arc<LdltAnalysis>,
        matrix: &CsrMatrix<c64>,
        kept: Option<&KeptPart>,
    ) -> Result<Self, MeshError> {
        let kept = kept.and_then(|kept| kept.downcast_ref::<Kept<T>>());
        let kept = kept.filter(|kept| kept.panels.are_of(analysis));
        let mut scale = scaling(matrix)?;
        if let Some(kept) = kept {
            // Powers of two round nothing: solutions have the same bits with any of them, unless one leaves the range of numbers.
            let is_near = |own: f64, other: f64| (1.0 / NEAR..=NEAR).contains(&(own / other));
            for (own, &other) in scale.iter_mut().zip(&kept.scale) {
                *own = if is_near(*own, other) { other } else { *own };
            }
        }
        let entry = |row, k| scaled_entry(matrix, &scale, row, k);
        let factor = Ldlt::new_keeping(analysis, entry, kept.map(|kept| &kept.panels))?;
        let largest = scale.iter().fold(0.0_f64, |largest, s| largest.max(*s));
        let shift = if largest > 0.0 { (-largest.log2().floor()).exp2() } else { 1.0 };
        Ok(Self { scale, shift, factor })
    }
}

/// How far the scale of a row may be from its own, so that the rows that are coupled with it stay as they were: elements at its node
/// may shrink to a 60 000th, and single precision has 38 decades.
const NEAR: f64 = 256.0;

impl<T: Representation> Precondition for Scaled<T> {
    fn apply(&self, r: &[c64], z: &mut [c64]) {
        // Where the matrix is far from one, so is the scale: its product with a residual must not leave single precision.
        let factor = self.shift * magnification(r);
        let mut columns = T::columns(r, &self.scale, factor);
        self.factor.solve_in_place(&mut columns);
        T::read(&columns, &self.scale, factor, z);
    }

    fn bytes(&self) -> usize {
        self.factor.bytes() + size_of_val(self.scale.as_slice())
    }

    fn kept(&self) -> Option<KeptPart> {
        let panels = self.factor.kept()?;
        Some(Arc::new(Kept { scale: self.scale.clone(), panels }))
    }
}

/// An incomplete factor: it scales the matrix itself.
#[derive(Debug)]
pub(super) struct Unscaled(Incomplete<c32>);

impl Unscaled {
    /// The incomplete factor of a matrix whose diagonal is multiplied by `diagonal_factor` first.
    ///
    /// # Errors
    /// As [`Incomplete::new`].
    pub(super) fn new(
        analysis: &Arc<IncompleteAnalysis>,
        matrix: &CsrMatrix<c64>,
        diagonal_factor: f64,
    ) -> Result<Self, MeshError> {
        let entry = |_: usize, k: usize| c32::of_entry(matrix.values[k]);
        Ok(Self(Incomplete::new(analysis, entry, diagonal_factor)?))
    }
}

impl Precondition for Unscaled {
    fn apply(&self, r: &[c64], z: &mut [c64]) {
        let factor = magnification(r);
        self.0.solve(|i| c32::of_entry(r[i] * factor), z, |x| double(x) / factor);
    }

    fn bytes(&self) -> usize {
        self.0.bytes()
    }
}

/// What brings a residual to norm one: at the end of an iteration it is far below what single precision can hold.
pub(super) fn magnification(r: &[c64]) -> f64 {
    let size = norm(r);
    if size > 0.0 && size.is_finite() { 1.0 / size } else { 1.0 }
}

/// An entry of the scaled matrix; `k` is its place among all.
pub(super) fn scaled_entry<T: Representation>(
    matrix: &CsrMatrix<c64>,
    scale: &[f64],
    row: usize,
    k: usize,
) -> T {
    T::of_entry(matrix.values[k] * (scale[row] * scale[matrix.structure.columns[k] as usize]))
}

pub(super) fn double(x: c32) -> c64 {
    c64::new(f64::from(x.re), f64::from(x.im))
}

/// The powers of two next to `1/√(Re k_ii + Im k_ii)`.
///
/// # Errors
/// [`MeshError::Factorisation`] where that is not positive.
pub(super) fn scaling(matrix: &CsrMatrix<c64>) -> Result<Vec<f64>, MeshError> {
    let n = matrix.structure.row_count();
    let failed = |row: usize, value: f64| MeshError::Factorisation {
        unknowns: n,
        cause: format!("the diagonal entry of unknown {row} is {value}, not positive"),
    };
    let of = |row: usize| {
        let diagonal = matrix.entry(row, row).unwrap_or_default();
        let sum = diagonal.re + diagonal.im;
        if sum > 0.0 && sum.is_finite() {
            Ok((-0.5 * sum.log2()).round().exp2())
        } else {
            Err(failed(row, sum))
        }
    };
    (0..n).map(of).collect()
}

#[cfg(test)]
mod tests {
    use fluxmorph_geometry::fem::{Changes, kept_first};

    use super::*;

    /// Springs between the points of a grid of `n` by `n`, those beyond half of the first axis `stiffer` times as stiff.
    fn springs(n: usize, stiffer: f64) -> CsrMatrix<c64> {
        let row = |v: usize| {
            let (x, y) = (v % n, v / n);
            let near = [
                (y > 0, v.wrapping_sub(n)),
                (x > 0, v.wrapping_sub(1)),
                (x + 1 < n, v + 1),
                (y + 1 < n, v + n),
            ];
            let stiffness = |other: usize| if 2 * (other % n).max(x) > n + 1 { stiffer } else { 1.0 };
            let near: Vec<_> =
                near.into_iter().filter(|near| near.0).map(|near| (near.1, stiffness(near.1))).collect();
            let own = near.iter().map(|(_, k)| k).sum::<f64>() * c64::new(1.1, 0.2);
            let mut row: Vec<_> = near.into_iter().map(|(other, k)| (other, c64::from(-k))).collect();
            row.push((v, own));
            row.sort_by_key(|entry| entry.0);
            row
        };
        CsrMatrix::from_rows(n * n, (0..n * n).map(row))
    }

    #[test]
    fn what_rests_is_found_though_the_rows_beside_it_have_other_scales() {
        let n = 40;
        let before = springs(n, 1.0);
        let rows: Vec<bool> = (0..n * n).map(|v| 2 * (v % n) >= n).collect();
        let changes = Changes { rows: &rows, max_rim_multiplications: 1e9 };
        let order = kept_first(&before.structure, None, changes);
        let analysis = LdltAnalysis::keeping(&before.structure, order, &rows).expect("a symmetric pattern");
        let kept = Scaled::<c32>::complete(&analysis, &before, None).expect("a factor").kept();
        let b: Vec<c64> = (0..n * n).map(|v| c64::new((v as f64).sin(), 1.0)).collect();
        let count_in = |factor: &Scaled<c32>| {
            let kept = kept.as_ref().and_then(|kept| kept.downcast_ref::<Kept<c32>>());
            kept.expect("a part").panels.found_in(&factor.factor)
        };
        let all = count_in(&Scaled::complete(&analysis, &before, kept.as_ref()).expect("a factor"));
        assert!(all > 0);
        for stiffer in [5.0, 40.0, 1e6] {
            let after = springs(n, stiffer);
            let own = Scaled::<c32>::complete(&analysis, &after, None).expect("a factor");
            let found = Scaled::<c32>::complete(&analysis, &after, kept.as_ref()).expect("a factor");
            // Beyond the bound of scales those of the rim are its own, and nothing next to it can be as it was.
            let count = count_in(&found);
            assert_eq!(count == all, stiffer < 1e5, "{stiffer}: {count} of {all}");
            assert_eq!(found.scale != own.scale, stiffer < 1e5, "{stiffer}");
            let [mut x, mut y] = [vec![c64::default(); n * n], vec![c64::default(); n * n]];
            own.apply(&b, &mut x);
            found.apply(&b, &mut y);
            assert_eq!(x, y, "{stiffer}");
        }
    }
}
