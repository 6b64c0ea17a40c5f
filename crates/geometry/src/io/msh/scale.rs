//! Coordinates between the unit of a file and metres, so that what was read can be written again to the bit.

/// A unit of length in a file.
#[derive(Clone, Copy, Debug)]
pub(super) enum Scale {
    /// A whole number of them is a metre: dividing gives 22 mm the very bits of 0.022.
    PerMetre(f64),
    /// Metres in one.
    Metres(f64),
}

impl Scale {
    /// The unit of so many metres.
    ///
    /// # Panics
    /// If the number is not positive and finite.
    pub(super) fn new(metres_per_unit: f64) -> Self {
        assert!(metres_per_unit > 0.0 && metres_per_unit.is_finite(), "a unit has a length");
        let per_metre = metres_per_unit.recip().round();
        if per_metre >= 1.0 && per_metre.recip() == metres_per_unit {
            Self::PerMetre(per_metre)
        } else {
            Self::Metres(metres_per_unit)
        }
    }

    /// A coordinate of the file in metres.
    #[inline]
    pub(super) fn metres(self, coordinate: f64) -> f64 {
        match self {
            Self::PerMetre(units) => coordinate / units,
            Self::Metres(metres) => coordinate * metres,
        }
    }

    /// A coordinate in metres for the file: one that reads back as the same bits where there is one.
    ///
    /// What was read from such a file always finds one: the product is within two roundings of the number read.
    pub(super) fn units(self, metres: f64) -> f64 {
        let near = match self {
            Self::PerMetre(units) => metres * units,
            Self::Metres(unit) => metres / unit,
        };
        let candidates =
            [near, near.next_up(), near.next_down(), near.next_up().next_up(), near.next_down().next_down()];
        let same = |c: &f64| self.metres(*c).to_bits() == metres.to_bits();
        candidates.into_iter().find(same).unwrap_or(near)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn millimetres_have_the_bits_of_their_decimal_in_metres() {
        let scale = Scale::new(1e-3);
        for (mm, m) in [(22.0, 0.022), (-7.3, -0.0073), (0.1, 1e-4), (0.0, 0.0)] {
            assert_eq!(scale.metres(mm), m);
        }
        assert_eq!(Scale::new(0.0254).metres(1.0), 0.0254);
    }

    #[test]
    fn what_was_read_is_written_so_that_it_reads_back_to_the_bit() {
        let mut random = 1u64;
        for unit in [1.0, 1e-2, 1e-3, 0.0254] {
            let scale = Scale::new(unit);
            for _ in 0..20_000 {
                // A linear congruential generator (Knuth's MMIX constants) will do for scattered mantissas.
                random = random.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
                let coordinate = (random >> 11) as f64 / 9.0e12 - 500.0;
                let read = scale.metres(coordinate);
                assert_eq!(
                    scale.metres(scale.units(read)).to_bits(),
                    read.to_bits(),
                    "{coordinate} of {unit}"
                );
            }
        }
        assert_eq!(Scale::new(1e-3).units(-0.0).to_bits(), (-0.0f64).to_bits());
    }
}
