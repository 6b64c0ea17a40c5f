//! How homogeneous a field is: its deviation from its own mean, which no change of the current alters.
//!
//! Of samples `b_k` with weights `w_k`, `b̄ = Σ w b / Σ w`, of vectors without what the images beyond symmetry planes cancel:
//!
//! `F = Σ w |b − b̄|² / (Σ w · |b̄|²)`,  `∂F/∂b_k = w_k (conj(b_k − b̄) − F conj(b̄)) / (Σ w · |b̄|²)`
//!
//! in the convention `dF = 2 Re Σ ∂F/∂b·db`. Its root is the relative rms deviation, in parts per million what builders of
//! magnets call homogeneity. Does not live here: where the samples are ([`super::observation`]).

use fluxmorph_geometry::fem::c64;
use fluxmorph_geometry::tet4::Point;

use crate::element::Complex3;

/// What is compared with its mean.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Compared {
    /// The vector `B`.
    Vector,
    /// `B·d` for a unit vector `d`.
    Component(Point),
    /// `|B|`; of phasors the root of the sum of their squared moduli.
    Modulus,
}

impl Compared {
    /// Of a flux density; of a component or the modulus in the first place.
    pub(super) fn of(self, b: &Complex3) -> Complex3 {
        let scalar = |c: c64| [c, c64::default(), c64::default()];
        match self {
            Self::Vector => *b,
            Self::Component(direction) => scalar((0..3).map(|d| b[d] * direction[d]).sum()),
            Self::Modulus => scalar(norm_sqr(b).sqrt().into()),
        }
    }

    /// Whether it is one real number, of which one has more and another less.
    pub(super) fn has_sign(self, is_static: bool) -> bool {
        match self {
            Self::Vector => false,
            Self::Component(_) => is_static,
            Self::Modulus => true,
        }
    }
}

/// The figures of a field's homogeneity.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FieldQuality {
    /// `|b̄|` [T]; of a component that does not alternate `b̄`, with its sign.
    pub mean: f64,
    /// The relative rms deviation from the mean [1].
    pub rms: f64,
    /// Largest less least value over the mean [1]; of vectors, of their part along the mean.
    pub peak_to_peak: f64,
}

/// Weighted samples and their mean.
pub(super) struct Spread<'a> {
    samples: &'a [(Complex3, f64)],
    of: Compared,
    /// `b_k`; of a component or the modulus in the first place.
    compared: Vec<Complex3>,
    weight: f64,
    mean: Complex3,
}

impl<'a> Spread<'a> {
    /// Of samples with their weights, and of vectors the orthonormal directions in which those of the whole device have no mean.
    pub(super) fn new(samples: &'a [(Complex3, f64)], of: Compared, odd: &[Point]) -> Self {
        let compared: Vec<Complex3> = samples.iter().map(|(b, _)| of.of(b)).collect();
        let weight: f64 = samples.iter().map(|(_, w)| w).sum();
        let mut mean = [c64::default(); 3];
        for (b, (_, w)) in compared.iter().zip(samples) {
            (0..3).for_each(|d| mean[d] += w * b[d] / weight);
        }
        for direction in odd {
            let along: c64 = (0..3).map(|d| mean[d] * direction[d]).sum();
            (0..3).for_each(|d| mean[d] -= along * direction[d]);
        }
        Self { samples, of, compared, weight, mean }
    }

    /// `b̄` [T].
    pub(super) fn mean(&self) -> Complex3 {
        self.mean
    }

    /// `F`.
    fn variance(&self) -> f64 {
        let terms = self.compared.iter().zip(self.samples);
        let sum: f64 = terms.map(|(b, (_, w))| w * norm_sqr(&self.deviation(b))).sum();
        sum / (self.weight * norm_sqr(&self.mean))
    }

    fn deviation(&self, b: &Complex3) -> Complex3 {
        std::array::from_fn(|d| b[d] - self.mean[d])
    }

    /// `F` and its derivatives by the samples.
    pub(super) fn variance_with_derivatives(&self) -> (f64, Vec<Complex3>) {
        let variance = self.variance();
        let scale = 1.0 / (self.weight * norm_sqr(&self.mean));
        let of_compared = |b: &Complex3, w: f64| -> Complex3 {
            let deviation = self.deviation(b);
            std::array::from_fn(|d| w * scale * (deviation[d].conj() - variance * self.mean[d].conj()))
        };
        let derivatives = self.compared.iter().zip(self.samples).map(|(b, (sample, w))| {
            let by_compared = of_compared(b, *w);
            match self.of {
                Compared::Vector => by_compared,
                Compared::Component(direction) => direction.map(|d| d * by_compared[0]),
                // d|B| = Re(conj(B)·dB)/|B|; where B vanishes no side is preferred.
                Compared::Modulus if b[0].re > 0.0 => sample.map(|c| by_compared[0].re * c.conj() / b[0].re),
                Compared::Modulus => [c64::default(); 3],
            }
        });
        (variance, derivatives.collect())
    }

    /// Derivatives of `F` by the weights: `(|b_k − b̄|² − F (|b̄|² + 2 Re b̄·conj(b_k − b̄))) / (Σ w · |b̄|²)`.
    pub(super) fn variance_by_weights(&self) -> Vec<f64> {
        let (variance, square) = (self.variance(), norm_sqr(&self.mean));
        let of = |b: &Complex3| {
            let deviation = self.deviation(b);
            let along: f64 = (0..3).map(|d| (self.mean[d].conj() * deviation[d]).re).sum();
            (norm_sqr(&deviation) - variance * (square + 2.0 * along)) / (self.weight * square)
        };
        self.compared.iter().map(of).collect()
    }

    /// The figures.
    pub(super) fn quality(&self) -> FieldQuality {
        let square = norm_sqr(&self.mean);
        let along = |b: &Complex3| (0..3).map(|d| (b[d] * self.mean[d].conj()).re).sum::<f64>() / square;
        let values = self.compared.iter().map(along);
        let (least, most) =
            values.fold((f64::INFINITY, f64::NEG_INFINITY), |(least, most), v| (least.min(v), most.max(v)));
        let mean = match self.of {
            Compared::Component(_) if self.mean[0].im == 0.0 => self.mean[0].re,
            _ => square.sqrt(),
        };
        FieldQuality { mean, rms: self.variance().sqrt(), peak_to_peak: most - least }
    }
}

fn norm_sqr(b: &Complex3) -> f64 {
    b.iter().map(|c| c.norm_sqr()).sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    const OF: [Compared; 3] = [Compared::Vector, Compared::Component([0.6, 0.0, 0.8]), Compared::Modulus];

    const ODD: &[Point] = &[[0.0, 0.6, -0.8]];

    fn samples() -> Vec<(Complex3, f64)> {
        let value = |k: usize| c64::new((12.9898 * k as f64 + 1.0).sin(), (78.233 * k as f64 + 2.0).sin());
        (0..7)
            .map(|k| ([2.0 + value(3 * k), value(3 * k + 1), value(3 * k + 2)], 1.0 + 0.3 * k as f64))
            .collect()
    }

    #[test]
    fn the_derivatives_match_central_differences() {
        // Truncation and rounding of a central difference of values of order one balance near 1e-5.
        let h = 1e-5;
        for (of, odd) in OF.map(|of| (of, &[][..])).into_iter().chain([(Compared::Vector, ODD)]) {
            let exact = Spread::new(&samples(), of, odd).variance_with_derivatives().1;
            for (k, d) in (0..7).flat_map(|k| (0..3).map(move |d| (k, d))) {
                for direction in [c64::new(1.0, 0.0), c64::new(0.0, 1.0)] {
                    let at = |s: f64| {
                        let mut moved = samples();
                        moved[k].0[d] += s * direction;
                        Spread::new(&moved, of, odd).variance()
                    };
                    let difference = (at(h) - at(-h)) / (2.0 * h);
                    let derivative = 2.0 * (exact[k][d] * direction).re;
                    assert!((difference - derivative).abs() < 1e-9, "{of:?}: {difference} {derivative}");
                }
            }
        }
    }

    #[test]
    fn so_do_those_by_the_weights() {
        let h = 1e-5;
        for (of, odd) in OF.map(|of| (of, &[][..])).into_iter().chain([(Compared::Vector, ODD)]) {
            let exact = Spread::new(&samples(), of, odd).variance_by_weights();
            for (k, exact) in exact.into_iter().enumerate() {
                let at = |s: f64| {
                    let mut other = samples();
                    other[k].1 += s;
                    Spread::new(&other, of, odd).variance()
                };
                let difference = (at(h) - at(-h)) / (2.0 * h);
                assert!((difference - exact).abs() < 1e-9, "{of:?}: {difference} {exact}");
            }
        }
    }

    #[test]
    fn no_current_changes_it_and_a_uniform_field_has_none() {
        let scaled = |factor: c64| -> Vec<(Complex3, f64)> {
            samples().into_iter().map(|(b, w)| (b.map(|c| factor * c), w)).collect()
        };
        for of in OF {
            let [one, other] = [c64::new(1.0, 0.0), c64::new(-30.0, 4.0)]
                .map(|factor| Spread::new(&scaled(factor), of, &[]).variance());
            assert!((one / other - 1.0).abs() < 1e-13, "{of:?}");
            let uniform: Vec<(Complex3, f64)> = samples().iter().map(|(_, w)| (samples()[0].0, *w)).collect();
            assert!(Spread::new(&uniform, of, &[]).variance() < 1e-30);
        }
    }

    #[test]
    fn two_samples_have_the_figures_of_a_textbook() {
        // 1 T and 3 T: mean 2 T, standard deviation 1 T, range 2 T.
        let samples: Vec<(Complex3, f64)> =
            [1.0, 3.0].map(|b: f64| ([c64::default(), c64::from(b), c64::default()], 2.0)).to_vec();
        for of in [Compared::Vector, Compared::Component([0.0, 1.0, 0.0]), Compared::Modulus] {
            let quality = Spread::new(&samples, of, &[]).quality();
            let figures = [quality.mean, quality.rms, quality.peak_to_peak];
            assert!(figures.iter().zip([2.0, 0.5, 1.0]).all(|(a, b)| (a - b).abs() < 1e-15), "{quality:?}");
        }
    }
}
