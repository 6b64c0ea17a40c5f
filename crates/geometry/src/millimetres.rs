//! Lengths and places in messages and tables: in millimetres, whatever the size of the device.

use std::fmt::{self, Display, Formatter};

/// A number for people: as a power of ten where it has more than nine digits before the point or zeros behind it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Readable(pub f64);

impl Display for Readable {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        let is_usual = self.0 == 0.0 || (1e-9..1e9).contains(&self.0.abs());
        if is_usual { write!(f, "{}", self.0) } else { write!(f, "{:e}", self.0) }
    }
}

/// A length [m], and no position, in millimetres, without the unit: with the decimals that the format asks for, three by default,
/// and as a power of ten where these would show less than two digits of it, or from a thousand kilometres on.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Millimetres(pub f64);

impl Display for Millimetres {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        let (length, decimals) = (1e3 * self.0 + 0.0, f.precision().unwrap_or(3));
        if length != 0.0 && !(10f64.powi(1 - decimals as i32)..1e9).contains(&length.abs()) {
            return write!(f, "{length:.1e}");
        }
        write!(f, "{length:.decimals$}")
    }
}

/// A place [m], to a micrometre; to a nanometre where it lies within a tenth of a millimetre of the origin.
pub fn millimetres([x, y, z]: [f64; 3]) -> String {
    let digits = if [x, y, z].iter().all(|c| c.abs() < 1e-4) && [x, y, z] != [0.0; 3] { 6 } else { 3 };
    let scale = 10f64.powi(digits + 3);
    let round = |c: f64| (c * scale).round() / scale * 1e3 + 0.0;
    let digits = digits as usize;
    format!("({:.digits$}, {:.digits$}, {:.digits$}) mm", round(x), round(y), round(z))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn small_lengths_keep_two_digits() {
        let shown = |length: f64| format!("{:.3}", Millimetres(length));
        assert_eq!([1.2345, 0.010e-3, -0.0, -0.25e-6].map(shown), ["1234.500", "0.010", "0.000", "-2.5e-4"]);
        assert_eq!(format!("{:.2} {}", Millimetres(2.5e-5), Millimetres(2.5e-5)), "2.5e-2 0.025");
        assert_eq!(format!("{} {}", Millimetres(9.9e5), Millimetres(2.25e300)), "990000000.000 2.2e303");
    }

    #[test]
    fn numbers_of_many_digits_are_powers_of_ten() {
        let shown = |number: f64| Readable(number).to_string();
        assert_eq!(
            [60.0, 0.0, -1e8, 1e308, 2.5e-300].map(shown),
            ["60", "0", "-100000000", "1e308", "2.5e-300"]
        );
    }
}
