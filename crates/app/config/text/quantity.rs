//! Numbers with a unit: `"10 mm"`, `"7e6 S/m"`, `"40 kA"`, `"60 Hz"`.
//!
//! The unit is converted once, here; everything behind this module is in SI. A decimal prefix is applied to
//! the exponent of the written number before it is parsed, so `"22 mm"` has the very bits of `0.022`.

use std::fmt;

use super::dimension::Dimension::{self, Conductivity};
use super::dimension::UNITS;
use super::message::shown;

/// Spellings of resistivity: common in material tables, and the reciprocal of what is needed.
const RESISTIVITY: &[&str] =
    &["Ohm m", "ohm m", "Ohm*m", "ohm*m", "Ohm.m", "Ohm-m", "\u{3a9} m", "\u{3a9}m", "\u{3a9}\u{b7}m"];

/// Why a text is not a quantity of the wanted dimension.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct QuantityError {
    /// What is wrong, naming the text.
    pub message: String,
    /// What to write instead.
    pub help: String,
}

impl fmt::Display for QuantityError {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(formatter, "{}; {}", self.message, self.help)
    }
}

/// Value in SI of a number with a unit.
///
/// # Errors
/// When the text does not start with a finite decimal number, or the unit is missing, unknown or of another
/// dimension; the message names the accepted units.
pub fn parse_quantity(text: &str, dimension: Dimension) -> Result<f64, QuantityError> {
    let trimmed = text.trim();
    let written = shown(text);
    let (number, unit_text) = split_number(trimmed);
    // Greek mu stands for the sign of micro, and the sign of ohm for Greek omega.
    let unit_text = unit_text.replace('\u{3bc}', "\u{b5}").replace('\u{2126}', "\u{3a9}");
    let unit_text = unit_text.as_str();
    let accepted = || {
        format!("write it like \"{}\"; accepted units: {}", dimension.example(), dimension.accepted_units())
    };
    let fail = |message: String| Err(QuantityError { message, help: accepted() });

    let Some(number) = number else {
        return fail(format!("`{written}` is not {}: it must start with a number", dimension.name()));
    };
    if unit_text.is_empty() {
        return Err(QuantityError {
            message: format!("`{written}` has no unit"),
            help: format!(
                "write its unit behind it, like \"{written} {}\"; accepted units: {}",
                dimension.example().split_once(' ').map_or("", |(_, unit)| unit),
                dimension.accepted_units()
            ),
        });
    }
    let behind_comma = unit_text.strip_prefix(',');
    if let Some(fraction) = behind_comma.filter(|rest| rest.starts_with(|c: char| c.is_ascii_digit())) {
        let digits = fraction.chars().take_while(char::is_ascii_digit).count();
        // Three digits may be thousands.
        let example = match digits != 3 && !number.written.contains('.') {
            true => format!(": \"{}.{}\"", number.written, shown(fraction)),
            false => String::new(),
        };
        return Err(QuantityError {
            message: format!("`{written}` has a comma"),
            help: format!("write a decimal point, and nothing between thousands{example}"),
        });
    }
    if dimension == Conductivity && RESISTIVITY.contains(&unit_text) {
        let help = match number.scaled(0).filter(|rho| *rho > 0.0) {
            Some(rho) => format!("conductivity is its reciprocal: write \"{:.6e} S/m\"", 1.0 / rho),
            None => accepted(),
        };
        return Err(QuantityError {
            message: format!("`{written}` is a resistivity, not a conductivity"),
            help,
        });
    }
    let Some(unit) = UNITS.iter().find(|unit| unit.name == unit_text) else {
        let known: Vec<_> = dimension.units().collect();
        let hint = match meant(unit_text, &known) {
            Some(name) => format!("did you mean \"{} {name}\"? ", number.written),
            None => String::new(),
        };
        return Err(QuantityError {
            message: format!("`{}` in `{written}` is not a unit of {}", shown(unit_text), dimension.noun()),
            help: format!("{hint}{}", accepted()),
        });
    };
    if unit.dimension != dimension {
        return fail(format!("`{written}` is {}, not {}", unit.dimension.name(), dimension.name()));
    }
    match number.scaled(unit.exponent).map(|value| value * unit.factor).filter(|value| value.is_finite()) {
        Some(value) => Ok(value),
        None => fail(format!("`{written}` is too large for a number")),
    }
}

/// Whether a text starts with a number and goes on with a unit of any dimension.
pub(in crate::config) fn is_number_with_unit(text: &str) -> bool {
    let (number, unit) = split_number(text.trim());
    number.is_some() && unit.starts_with(|c: char| c.is_alphabetic() || c == '\u{b0}')
}

/// The unit of a few that another text stands for, written otherwise: in other case, in full, with a sign for the power or as a
/// plural. None is offered that differs in its prefix or in a letter: those are powers of ten.
fn meant<'a>(text: &str, known: &[&'a str]) -> Option<&'a str> {
    let bare = text.replace(['^', '*', '.', ' '], "");
    let singular = bare.strip_suffix('s').unwrap_or(&bare);
    let written = [text, &bare, singular];
    let named = |own: &str| {
        SPELLED_OUT.iter().find(|(name, _)| own.eq_ignore_ascii_case(name)).map(|(_, unit)| *unit)
    };
    let has_other_prefix = |unit: &str, own: &str| {
        let has_prefix = unit.len() > 1 && unit.starts_with(['m', 'M']) && !ALSO_UPPER_CASE.contains(&unit);
        has_prefix && unit.get(..1) != own.get(..1)
    };
    let is_it = |unit: &str, own: &str| unit.eq_ignore_ascii_case(own) && !has_other_prefix(unit, own);
    let of = |is: &dyn Fn(&str) -> bool| known.iter().copied().find(|unit| is(unit));
    of(&|unit| written.iter().any(|own| is_it(unit, own)))
        .or_else(|| of(&|unit| written.iter().any(|own| named(own) == Some(unit))))
}

/// Units with an m before them that have no relative with an M.
const ALSO_UPPER_CASE: [&str; 2] = ["mm", "min"];

/// Units by their full names.
const SPELLED_OUT: &[(&str, &str)] = &[
    ("meter", "m"),
    ("metre", "m"),
    ("millimeter", "mm"),
    ("millimetre", "mm"),
    ("micron", "um"),
    ("inch", "in"),
    ("inches", "in"),
    ("hertz", "Hz"),
    ("ampere", "A"),
    ("amp", "A"),
    ("tesla", "T"),
    ("gauss", "G"),
    ("degree", "deg"),
    ("\u{b0}", "deg"),
    ("second", "s"),
    ("sec", "s"),
    ("minute", "min"),
    ("hour", "h"),
    ("hours", "h"),
    ("watt", "W"),
    ("joule", "J"),
];

/// A decimal number as written: mantissa digits and the power of ten behind them.
struct Number<'a> {
    /// All of it.
    written: &'a str,
    mantissa: &'a str,
    exponent: i32,
}

impl Number<'_> {
    /// The number times `10^shift`, rounded once.
    fn scaled(&self, shift: i32) -> Option<f64> {
        let exponent = self.exponent.saturating_add(shift);
        format!("{}e{exponent}", self.mantissa).parse().ok().filter(|value: &f64| value.is_finite())
    }
}

/// Split `7e6 S/m` into the number and the trimmed rest; no number gives `None`.
fn split_number(text: &str) -> (Option<Number<'_>>, &str) {
    let bytes = text.as_bytes();
    let digits = |from: usize| from + bytes[from..].iter().take_while(|byte| byte.is_ascii_digit()).count();

    let start = usize::from(matches!(bytes.first(), Some(b'+' | b'-')));
    let whole = digits(start);
    let fraction = if bytes.get(whole) == Some(&b'.') { digits(whole + 1) } else { whole };
    let has_digits = whole > start || fraction > whole + 1;
    if !has_digits {
        return (None, text);
    }
    let mut end = fraction;
    let mut exponent = 0;
    if matches!(bytes.get(fraction), Some(b'e' | b'E')) {
        let sign = fraction + 1 + usize::from(matches!(bytes.get(fraction + 1), Some(b'+' | b'-')));
        if sign <= bytes.len() && digits(sign) > sign {
            end = digits(sign);
            // More digits than an i32 holds saturate: the value is zero or infinite all the same.
            let sign_is_minus = bytes[fraction + 1] == b'-';
            exponent =
                text[fraction + 1..end].parse().unwrap_or(if sign_is_minus { -100_000 } else { 100_000 });
        }
    }
    (Some(Number { written: &text[..end], mantissa: &text[..fraction], exponent }), text[end..].trim_start())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::config::text::dimension::Dimension::*;

    #[test]
    fn decimal_units_have_the_bits_of_the_si_literal() {
        let cases = [
            ("22 mm", Length, 0.022),
            ("0.4mm", Length, 0.0004),
            ("-5 mm", Length, -0.005),
            ("1.5e1 cm", Length, 0.15),
            ("3 um", Length, 3e-6),
            ("3 \u{b5}m", Length, 3e-6),
            ("3 \u{3bc}H", Inductance, 3e-6),
            ("5 m\u{2126}", Resistance, 5e-3),
            ("5 \u{3bc}\u{3a9}", Resistance, 5e-6),
            (".5 m", Length, 0.5),
            ("5. m", Length, 5.0),
            ("7e6 S/m", Conductivity, 7e6),
            ("5.8 MS/m", Conductivity, 5.8e6),
            ("40 kA", Current, 40e3),
            ("40 kAT", Current, 40e3),
            (" +60 Hz ", Frequency, 60.0),
            ("10 G", FluxDensity, 1e-3),
            ("2 min", Duration, 120.0),
            ("180 deg", Angle, std::f64::consts::PI),
            ("1 in", Length, 0.0254),
            ("3 mT\u{b2}", FluxDensitySquared, 3e-6),
            ("2e-9 T2 m3", FluxDensityIntegral, 2e-9),
            ("20 mW", Power, 0.02),
            ("1.5 kJ", Energy, 1500.0),
            ("22 cm\u{b3}", Volume, 22e-6),
            ("2 l", Volume, 2e-3),
            ("300 g", Mass, 0.3),
            ("7.85 g/cm3", MassDensity, 7850.0),
            ("7.85 kg/dm3", MassDensity, 7850.0),
            ("7.85 kg/l", MassDensity, 7850.0),
            ("7.85 t/m3", MassDensity, 7850.0),
            ("180 ml", Volume, 180e-6),
        ];
        for (text, dimension, expected) in cases {
            assert_eq!(parse_quantity(text, dimension), Ok(expected), "{text}");
        }
    }

    #[test]
    fn wrong_quantities_say_what_is_accepted() {
        let cases = [
            ("10", Length, "has no unit"),
            ("mm", Length, "must start with a number"),
            ("nan mm", Length, "must start with a number"),
            ("inf mm", Length, "must start with a number"),
            ("- 5 mm", Length, "must start with a number"),
            (".", Length, "must start with a number"),
            ("60 Hz", Length, "is a frequency, not a length"),
            ("60 hz", Frequency, "did you mean \"60 Hz\"?"),
            ("10 MM", Length, "did you mean \"10 mm\"?"),
            ("5 MT", FluxDensity, "not a unit of flux density; write it like"),
            ("1e3 millimetres", Length, "did you mean \"1e3 mm\"?"),
            ("1 MOhm", Resistance, "not a unit of resistance; write it like"),
            ("5 Mhz", Frequency, "did you mean \"5 MHz\"?"),
            ("4 Ma", Current, "did you mean \"4 MA\"?"),
            ("3 mi", Length, "not a unit of length; write it like"),
            ("22 cm^3", Volume, "did you mean \"22 cm3\"?"),
            ("7.85 g/cm^3", MassDensity, "did you mean \"7.85 g/cm3\"?"),
            ("5 Ohms", Resistance, "did you mean \"5 ohm\"?"),
            // A letter away from another unit, and a power of ten.
            ("0.18 ul", Volume, "not a unit of volume; write it like"),
            ("4.8 g/mm3", MassDensity, "not a unit of mass density; write it like"),
            ("58 S/mm", Conductivity, "not a unit of conductivity; write it like"),
            ("58 MS/cm", Conductivity, "not a unit of conductivity; write it like"),
            ("10", Length, "write its unit behind it, like \"10 mm\""),
            ("1.4e-7 Ohm m", Conductivity, "is a resistivity"),
            ("0 Ohm m", Conductivity, "is a resistivity"),
            ("0,8 mm", Length, "nothing between thousands: \"0.8 mm\""),
            (
                "1,000 mm",
                Length,
                "`1,000 mm` has a comma; write a decimal point, and nothing between thousands",
            ),
            ("1e400 m", Length, "too large"),
            ("1e99999999999 m", Length, "too large"),
            ("10 parsec", Length, "accepted units: m, cm, mm"),
            ("1e m", Length, "not a unit of length"),
        ];
        for (text, dimension, fragment) in cases {
            let message = parse_quantity(text, dimension).expect_err(text).to_string();
            assert!(message.contains(fragment), "{text}: {message}");
        }
    }

    #[test]
    fn a_resistivity_is_answered_with_its_reciprocal() {
        let error = parse_quantity("1.25e-7 Ohm m", Conductivity).expect_err("a resistivity");
        assert!(error.help.contains("8.000000e6 S/m"), "{}", error.help);
    }
}
