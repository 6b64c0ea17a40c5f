//! Colour maps: perceptually even ones that grow lighter with the value, so that they read in grey too.

use colorous::{Gradient, INFERNO, RED_BLUE, VIRIDIS};

/// A colour map.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum ColourMap {
    /// Lengths: dark violet over green to yellow (viridis).
    Length,
    /// Fields: black over red to pale yellow (inferno).
    Field,
    /// Signed: blue below zero, red above.
    Signed,
}

impl ColourMap {
    /// The colour at a share of the map, 0 to 1; what lies outside has the colour of the end.
    pub(super) fn at(self, share: f64) -> [u8; 3] {
        let (gradient, share): (Gradient, f64) = match self {
            Self::Length => (VIRIDIS, share),
            Self::Field => (INFERNO, share),
            Self::Signed => (RED_BLUE, 1.0 - share),
        };
        gradient.eval_continuous(share.clamp(0.0, 1.0)).as_array()
    }

    /// Palette of an image: index 0 is nothing, 1 to 255 are the map.
    pub(super) fn palette(self) -> [[u8; 3]; 256] {
        std::array::from_fn(|i| self.at(i.saturating_sub(1) as f64 / 254.0))
    }

    /// Index in the palette of a share of the map.
    pub(super) fn index(share: f64) -> u8 {
        1 + (share.clamp(0.0, 1.0) * 254.0).round() as u8
    }

    /// The colour as CSS writes it.
    pub(super) fn css(self, share: f64) -> String {
        let [r, g, b] = self.at(share);
        format!("#{r:02x}{g:02x}{b:02x}")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn more_is_lighter_up_to_the_ends() {
        for map in [ColourMap::Length, ColourMap::Field] {
            let lightness =
                |[r, g, b]: [u8; 3]| 0.21 * f64::from(r) + 0.72 * f64::from(g) + 0.07 * f64::from(b);
            let all: Vec<f64> = (0..=50).map(|i| lightness(map.at(f64::from(i) / 50.0))).collect();
            assert!(all.windows(2).all(|pair| pair[1] > pair[0]), "{map:?}: {all:?}");
            assert_eq!((map.at(-3.0), map.at(7.0)), (map.palette()[1], map.palette()[255]));
        }
        assert_eq!((ColourMap::index(0.0), ColourMap::index(1.0), ColourMap::index(f64::NAN)), (1, 255, 1));
    }

    #[test]
    fn below_zero_is_blue_and_above_is_red() {
        let [[r, _, b], [r_above, _, b_above]] = [0.1, 0.9].map(|share| ColourMap::Signed.at(share));
        assert!(b > r && r_above > b_above);
    }
}
