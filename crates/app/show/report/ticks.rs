//! Numbers for readers: round places for the ticks of an axis, and numbers as text.

/// How an axis counts.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Count {
    /// Evenly.
    Linear,
    /// By factors.
    Logarithmic,
}

/// Steps from zero beyond which ticks would all look alike.
const LARGEST_COUNT: f64 = 1e12;

/// Round numbers inside `low ..= high`, at most about `most` of them.
pub(crate) fn linear(low: f64, high: f64, most: usize) -> Vec<f64> {
    let span = high - low;
    if span.is_nan() || span <= 0.0 || most == 0 || !span.is_finite() {
        return vec![low];
    }
    let rough = span / most as f64;
    let power = 10f64.powf(rough.log10().floor());
    let step = [1.0, 2.0, 5.0, 10.0].map(|m| m * power).into_iter().find(|s| *s >= rough * (1.0 - 1e-9));
    let step = step.unwrap_or(10.0 * power);
    // A span of the smallest numbers has no steps, one between large neighbours none that rounding leaves.
    if !step.is_normal() || (low / step).abs().max((high / step).abs()) > LARGEST_COUNT {
        return vec![low];
    }
    // The ends belong to the axis though they carry rounding.
    let (first, last) = ((low / step - 1e-6).ceil() as i64, (high / step + 1e-6).floor() as i64);
    (first..=last).map(|k| k as f64 * step).collect()
}

/// Powers of ten inside `low ..= high`, with 2 and 5 times of them where there are few, every second or third where there
/// are many.
pub(crate) fn logarithmic(low: f64, high: f64, most: usize) -> Vec<f64> {
    if !(low > 0.0 && high > low && high.is_finite()) {
        return vec![low];
    }
    let inside = |v: &f64| *v >= low * (1.0 - 1e-6) && *v <= high * (1.0 + 1e-6);
    let (first, last) = (low.log10().floor() as i32, high.log10().ceil() as i32);
    let with = |factors: &[f64]| -> Vec<f64> {
        (first..=last).flat_map(|k| factors.iter().map(move |f| f * 10f64.powi(k))).filter(inside).collect()
    };
    let decades = with(&[1.0]);
    if decades.len() > most {
        let every = decades.len().div_ceil(most);
        return decades.into_iter().step_by(every).collect();
    }
    [&[1.0, 2.0, 5.0][..], &[1.0, 3.0]]
        .into_iter()
        .map(with)
        .find(|ticks| ticks.len() <= most)
        .filter(|ticks| ticks.len() > decades.len())
        .unwrap_or(decades)
}

/// The power of ten that all ticks of an axis are divided by, for texts that are short: none between a thousandth and a
/// million.
pub(crate) fn common_power(ticks: &[f64]) -> Option<i32> {
    let step = ticks.windows(2).map(|pair| pair[1] - pair[0]).fold(f64::INFINITY, f64::min);
    let largest = ticks.iter().fold(0.0_f64, |largest, t| largest.max(t.abs()));
    let is_plain = (1e-3..1e6).contains(&step) && largest < 1e6;
    // Dividing by one makes no text shorter.
    (step.is_finite() && step > 0.0 && !is_plain)
        .then(|| largest.log10().floor() as i32)
        .filter(|power| *power != 0)
}

/// A power of ten.
pub(crate) fn power_of_ten(exponent: i32) -> String {
    format!("10{}", superscript(exponent))
}

/// Ticks of an axis as text, all with as many decimals as their step needs.
pub(crate) fn labels(ticks: &[f64]) -> Vec<String> {
    let step = ticks.windows(2).map(|pair| pair[1] - pair[0]).fold(f64::INFINITY, f64::min);
    let largest = ticks.iter().fold(0.0_f64, |largest, t| largest.max(t.abs()));
    if !step.is_finite() {
        return ticks.iter().map(|t| number(*t, 3)).collect();
    }
    if !(1e-3..1e6).contains(&step) || largest >= 1e6 {
        // As many digits as distinguish neighbours.
        let digits = (largest.log10().floor() - step.log10().floor()).clamp(0.0, 12.0) as usize + 1;
        return ticks.iter().map(|t| number(*t, digits)).collect();
    }
    let decimals = (-step.log10().floor()).max(0.0) as usize;
    ticks.iter().map(|t| minus(&format!("{:.decimals$}", t + 0.0))).collect()
}

/// A number with so many significant digits, by a power of ten where it is very small or large.
pub(crate) fn number(value: f64, digits: usize) -> String {
    let significant = format!("{value:.*e}", digits.saturating_sub(1));
    let Some((mantissa, exponent)) = significant.split_once('e') else { return significant };
    let exponent: i32 = exponent.parse().unwrap_or(0);
    match exponent {
        _ if value == 0.0 => "0".to_owned(),
        -4..=5 => {
            let decimals = (digits as i32 - 1 - exponent).max(0) as usize;
            minus(&format!("{value:.decimals$}"))
        }
        _ if mantissa == "1" => power_of_ten(exponent),
        _ => format!("{} × {}", minus(mantissa), power_of_ten(exponent)),
    }
}

/// `F/F₀` with four digits, and as many as show two of a small gain.
pub(crate) fn ratio(value: f64) -> String {
    let gain = (value - 1.0).abs();
    let decimals = if gain > 0.0 { (1.0 - gain.log10().floor()).clamp(0.0, 8.0) as usize } else { 0 };
    let before = usize::from(value.abs() >= 1.0);
    number(value, 4.max(before + decimals))
}

/// A number with as many decimals as asked for, without trailing zeros.
pub(crate) fn trim_zeros(value: f64, decimals: usize) -> String {
    let text = format!("{:.decimals$}", value);
    let text = if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.') } else { &text };
    minus(if text == "-0" { "0" } else { text })
}

/// So many decimals, and more where the largest of some values shows less than two digits by them.
pub(super) fn decimals_of(values: &[f64], usual: usize) -> usize {
    let largest = values.iter().fold(0.0_f64, |largest, value| largest.max(value.abs()));
    let needed = if largest > 0.0 { (1.0 - largest.log10().floor()).clamp(0.0, 12.0) as usize } else { 0 };
    usual.max(needed)
}

/// So many threads.
pub(super) fn threads(count: usize) -> String {
    if count == 1 { "1 thread".to_owned() } else { format!("{count} threads") }
}

/// A value of the configuration with all digits that it has, by a power of ten where it is very small or large.
pub(super) fn given(value: f64) -> String {
    match value.abs() {
        0.0 => "0".to_owned(),
        1e-4..1e6 => trim_zeros(value, 12),
        _ => number(value, 6),
    }
}

/// Thousands set apart by thin spaces.
pub(crate) fn group_digits(count: usize) -> String {
    let digits = count.to_string();
    if digits.len() < 5 {
        return digits;
    }
    let mut text = String::new();
    for (i, digit) in digits.chars().enumerate() {
        if i > 0 && (digits.len() - i).is_multiple_of(3) {
            text.push('\u{202f}');
        }
        text.push(digit);
    }
    text
}

/// A time [s] in words.
pub(crate) fn duration(seconds: f64) -> String {
    match seconds {
        s if s < 60.0 => format!("{} s", number(s, 3)),
        s if s < 3600.0 => format!("{} min {:02} s", (s / 60.0) as u64, (s % 60.0) as u64),
        s => format!("{} h {:02} min", (s / 3600.0) as u64, (s % 3600.0 / 60.0) as u64),
    }
}

/// The sign of typography.
fn minus(text: &str) -> String {
    text.replace('-', "−")
}

fn superscript(exponent: i32) -> String {
    let digit = |c: char| match c {
        '-' => '⁻',
        '1' => '¹',
        '2' => '²',
        '3' => '³',
        '0' => '⁰',
        c => char::from_u32(0x2070 + c.to_digit(10).unwrap_or(0)).unwrap_or(c),
    };
    exponent.to_string().chars().map(digit).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_ratio_shows_its_gain() {
        let shown = [0.510_67, 1.000_214, 0.999_998_76, 1.0, 12.345_6].map(ratio);
        assert_eq!(shown, ["0.5107", "1.00021", "0.9999988", "1.000", "12.35"]);
    }

    #[test]
    fn ticks_are_round_and_inside() {
        assert_eq!(linear(0.0, 15.0, 5), [0.0, 5.0, 10.0, 15.0]);
        assert_eq!(labels(&linear(0.5, 1.0, 5)), ["0.5", "0.6", "0.7", "0.8", "0.9", "1.0"]);
        assert_eq!(labels(&linear(-240.0, 240.0, 5)), ["−200", "−100", "0", "100", "200"]);
        assert_eq!(labels(&[1.0e-3, 1.05e-3]), ["0.00100", "0.00105"]);
        assert_eq!(labels(&[0.0, 2e-7, 4e-7]), ["0", "2 × 10⁻⁷", "4 × 10⁻⁷"]);
        assert_eq!(logarithmic(1e-3, 1.0, 5), [1e-3, 1e-2, 1e-1, 1.0]);
        assert_eq!(logarithmic(1.0, 20.0, 5), [1.0, 2.0, 5.0, 10.0, 20.0]);
        assert!(logarithmic(1e-12, 1e12, 5).len() <= 5);
        for (low, high) in [(0.0, 0.0), (1.0, f64::INFINITY), (f64::NAN, 1.0), (3.0, 2.0)] {
            assert_eq!((linear(low, high, 5).len(), logarithmic(low, high, 5).len()), (1, 1));
        }
    }

    #[test]
    fn numbers_read_as_in_print() {
        let of = |v| number(v, 3);
        assert_eq!(
            (of(0.5104223), of(-17.571), of(72_576.0)),
            ("0.510".into(), "−17.6".into(), "72576".into())
        );
        assert_eq!((of(3.704e-9), of(0.0), of(1e7)), ("3.70 × 10⁻⁹".into(), "0".into(), "1.00 × 10⁷".into()));
        assert_eq!(number(1e-9, 1), "10⁻⁹");
        assert_eq!(
            (trim_zeros(30.0, 1), trim_zeros(-0.01, 1), trim_zeros(2.50, 2)),
            ("30".into(), "0".into(), "2.5".into())
        );
        assert_eq!(
            (group_digits(9999), group_digits(1_234_567)),
            ("9999".into(), "1\u{202f}234\u{202f}567".into())
        );
        assert_eq!(
            (duration(9.87), duration(61.5), duration(7325.0)),
            ("9.87 s".into(), "1 min 01 s".into(), "2 h 02 min".into())
        );
    }
}
