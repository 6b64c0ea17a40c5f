//! Colour maps: values become colours that grow evenly lighter, so that they read in grey too.
//!
//! Between a few colours chosen for this program a map is linear in OKLab (B. Ottosson, "A perceptual color space for image
//! processing", 2020), where equal steps look equal.

/// A colour map.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum ColourMap {
    /// Lengths: dark blue over green to yellow.
    Length,
    /// Fields: black over red to pale yellow.
    Field,
    /// Signed: blue below zero, red above.
    Signed,
}

/// Colours that a map goes through, evenly spaced.
const LENGTH: &[[u8; 3]] =
    &[[0x26, 0x1c, 0x52], [0x23, 0x55, 0x8e], [0x1b, 0x8f, 0x8f], [0x6c, 0xc2, 0x68], [0xf8, 0xe6, 0x5a]];
const FIELD: &[[u8; 3]] =
    &[[0x14, 0x10, 0x2e], [0x55, 0x1b, 0x6d], [0xb1, 0x35, 0x5f], [0xed, 0x7d, 0x42], [0xfd, 0xec, 0xa6]];
const SIGNED: &[[u8; 3]] =
    &[[0x1c, 0x3f, 0x94], [0x6f, 0x9b, 0xd8], [0xf3, 0xf1, 0xec], [0xe2, 0x8c, 0x6f], [0x9c, 0x24, 0x24]];

impl ColourMap {
    /// The colour at a share of the map, 0 to 1; what lies outside has the colour of the end.
    pub(super) fn at(self, share: f64) -> [u8; 3] {
        let stops = match self {
            Self::Length => LENGTH,
            Self::Field => FIELD,
            Self::Signed => SIGNED,
        };
        let place = share.clamp(0.0, 1.0) * (stops.len() - 1) as f64;
        let first = (place as usize).min(stops.len() - 2);
        let [a, b] = [stops[first], stops[first + 1]].map(to_lab);
        let t = place - first as f64;
        from_lab(std::array::from_fn(|i| a[i] + t * (b[i] - a[i])))
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

/// OKLab of an sRGB colour.
fn to_lab(colour: [u8; 3]) -> [f64; 3] {
    let [r, g, b] = colour.map(|c| {
        let c = f64::from(c) / 255.0;
        if c <= 0.040_45 { c / 12.92 } else { ((c + 0.055) / 1.055).powf(2.4) }
    });
    let l = (0.412_221_470_8 * r + 0.536_332_536_3 * g + 0.051_445_992_9 * b).cbrt();
    let m = (0.211_903_498_2 * r + 0.680_699_545_1 * g + 0.107_396_956_6 * b).cbrt();
    let s = (0.088_302_461_9 * r + 0.281_718_837_6 * g + 0.629_978_700_5 * b).cbrt();
    [
        0.210_454_255_3 * l + 0.793_617_785_0 * m - 0.004_072_046_8 * s,
        1.977_998_495_1 * l - 2.428_592_205_0 * m + 0.450_593_709_9 * s,
        0.025_904_037_1 * l + 0.782_771_766_2 * m - 0.808_675_766_0 * s,
    ]
}

fn from_lab([lightness, a, b]: [f64; 3]) -> [u8; 3] {
    let l = (lightness + 0.396_337_777_4 * a + 0.215_803_757_3 * b).powi(3);
    let m = (lightness - 0.105_561_345_8 * a - 0.063_854_172_8 * b).powi(3);
    let s = (lightness - 0.089_484_177_5 * a - 1.291_485_548_0 * b).powi(3);
    [
        4.076_741_662_1 * l - 3.307_711_591_3 * m + 0.230_969_929_2 * s,
        -1.268_438_004_6 * l + 2.609_757_401_1 * m - 0.341_319_396_5 * s,
        -0.004_196_086_3 * l - 0.703_418_614_7 * m + 1.707_614_701_0 * s,
    ]
    .map(|c| {
        let c = if c <= 0.003_130_8 { 12.92 * c } else { 1.055 * c.powf(1.0 / 2.4) - 0.055 };
        (c.clamp(0.0, 1.0) * 255.0).round() as u8
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_map_goes_through_its_colours() {
        for (map, stops) in
            [(ColourMap::Length, LENGTH), (ColourMap::Field, FIELD), (ColourMap::Signed, SIGNED)]
        {
            for (i, stop) in stops.iter().enumerate() {
                assert_eq!(map.at(i as f64 / (stops.len() - 1) as f64), *stop, "{map:?}");
            }
            assert_eq!((map.at(-3.0), map.at(7.0)), (stops[0], stops[4]));
            assert_eq!(map.palette()[255], stops[4]);
        }
        assert_eq!((ColourMap::index(0.0), ColourMap::index(1.0), ColourMap::index(f64::NAN)), (1, 255, 1));
    }

    #[test]
    fn more_is_lighter() {
        for map in [ColourMap::Length, ColourMap::Field] {
            let lightness: Vec<f64> = (0..=50).map(|i| to_lab(map.at(f64::from(i) / 50.0))[0]).collect();
            assert!(lightness.windows(2).all(|pair| pair[1] > pair[0]), "{map:?}: {lightness:?}");
        }
    }
}
