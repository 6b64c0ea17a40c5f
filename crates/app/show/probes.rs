//! The flux density at probes as a small table.

use crate::files::{ProbeResult, SAFETY, StateErrors};
use crate::printable::printable;

/// Points of a probe that are shown; all are in `result.json`.
const MOST_POINTS: usize = 8;

/// The lines of all probes, with error bars where errors are known; empty where there are none. At 0 Hz components have a sign, else
/// they are amplitudes.
pub(super) fn lines(probes: &[ProbeResult], errors: Option<&StateErrors>, frequency: f64) -> Vec<String> {
    let is_static = frequency == 0.0;
    let field = |probe: &ProbeResult, k: usize| -> Option<[f64; 4]> {
        let (re, im) = (probe.b_re_t[k]?, probe.b_im_t[k]?);
        let component = |d: usize| if is_static { re[d] } else { re[d].hypot(im[d]) };
        let norm = (0..3).map(|d| re[d].powi(2) + im[d].powi(2)).sum::<f64>().sqrt();
        Some([component(0), component(1), component(2), norm])
    };
    let largest = probes
        .iter()
        .flat_map(|probe| (0..probe.points_m.len()).filter_map(move |k| field(probe, k)))
        .fold(0.0, |largest: f64, b| largest.max(b[3]));
    let (scale, unit) = match largest {
        b if b >= 1.0 => (1.0, "T"),
        b if b >= 1e-3 || b == 0.0 => (1e3, "mT"),
        b if b >= 1e-6 => (1e6, "uT"),
        _ => (1e9, "nT"),
    };
    let names = if is_static { ["Bx", "By", "Bz", "|B|"] } else { ["|Bx|", "|By|", "|Bz|", "|B|"] };
    let mut lines = Vec::new();
    for probe in probes {
        let errors = errors.and_then(|errors| errors.probes_t.get(&probe.name));
        let heads = names.map(|name| format!("{:>10}", format!("{name} {unit}"))).concat();
        let head_of_bar = errors.map_or(String::new(), |_| format!("{:>10}", format!("± {unit}")));
        lines.push(format!("{:<30}{heads}", format!("probe {:.22}", printable(&probe.name))) + &head_of_bar);
        for (k, point) in probe.points_m.iter().enumerate().take(MOST_POINTS) {
            let [x, y, z] = point.map(|c| (c * 1e6).round() / 1e3 + 0.0);
            let at = format!("  ({x}, {y}, {z}) mm");
            let bar = |k: usize| match errors.and_then(|errors| *errors.get(k)?) {
                Some(error) => format!("{:>10.1e}", SAFETY * error * scale),
                None => String::new(),
            };
            let values = match field(probe, k) {
                Some(b) => b.map(|b| format!("{:>10.4}", b * scale)).concat() + &bar(k),
                None => format!("{:>10}", "left out"),
            };
            lines.push(format!("{at:<30}{values}"));
        }
        let more = probe.points_m.len().saturating_sub(MOST_POINTS);
        if more > 0 {
            lines.push(format!("  and {more} more points in result.json"));
        }
    }
    lines
}

#[cfg(test)]
mod tests {
    use super::*;

    fn probe(points: usize, b_im: f64) -> ProbeResult {
        ProbeResult {
            name: "behind the plate".to_owned(),
            points_m: vec![[0.02, 0.0, -0.05]; points],
            b_re_t: vec![Some([0.0, -3e-3, 0.0]); points],
            b_im_t: vec![Some([0.0, b_im, 0.0]); points],
        }
    }

    #[test]
    fn components_are_signed_at_rest_and_amplitudes_otherwise() {
        let at_rest = lines(&[probe(1, 0.0)], None, 0.0);
        assert!(at_rest[0].contains("By mT") && at_rest[1].contains("(20, 0, -50) mm"), "{at_rest:?}");
        assert!(at_rest[1].contains("-3.0000") && at_rest[1].ends_with(" 3.0000"), "{at_rest:?}");
        // 3, 4, 5.
        let harmonic = lines(&[probe(1, 4e-3)], None, 60.0);
        assert!(
            harmonic[0].contains("|By| mT") && harmonic[1].matches("5.0000").count() == 2,
            "{harmonic:?}"
        );
    }

    #[test]
    fn many_points_are_cut_and_lost_ones_said() {
        let mut probe = probe(MOST_POINTS + 3, 0.0);
        probe.b_re_t[0] = None;
        let lines = lines(&[probe], None, 0.0);
        assert_eq!(lines.len(), MOST_POINTS + 2);
        assert!(lines[1].ends_with("left out") && lines[MOST_POINTS + 1].contains("3 more"), "{lines:?}");
    }

    #[test]
    fn a_known_error_has_a_column() {
        let errors = StateErrors {
            probes_t: [("behind the plate".to_owned(), vec![Some(1e-4), None])].into(),
            ..StateErrors::default()
        };
        let lines = lines(&[probe(2, 0.0)], Some(&errors), 0.0);
        assert!(lines[0].ends_with("± mT") && lines[1].ends_with("    2.0e-1"), "{lines:?}");
        assert!(lines[2].ends_with(" 3.0000"), "{lines:?}");
    }
}
