//! Places in texts for people.

/// A point for messages, to a micrometre.
pub(crate) fn millimetres([x, y, z]: [f64; 3]) -> String {
    let round = |c: f64| (c * 1e6).round() * 1e-3 + 0.0;
    format!("({:.3}, {:.3}, {:.3}) mm", round(x), round(y), round(z))
}
