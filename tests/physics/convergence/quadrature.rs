//! Integration over intervals.

/// `∫ f` over `[from, to]` by Gauss's five-point rule on `parts` equal parts.
pub(crate) fn line_integral([from, to]: [f64; 2], parts: usize, f: impl Fn(f64) -> f64) -> f64 {
    const NODES: [(f64, f64); 5] = [
        (0.0, 0.568_888_888_888_888_9),
        (0.538_469_310_105_683_1, 0.478_628_670_499_366_47),
        (-0.538_469_310_105_683_1, 0.478_628_670_499_366_47),
        (0.906_179_845_938_664, 0.236_926_885_056_189_08),
        (-0.906_179_845_938_664, 0.236_926_885_056_189_08),
    ];
    let half = 0.5 * (to - from) / parts as f64;
    (0..parts)
        .flat_map(|i| {
            let middle = from + half * (2 * i + 1) as f64;
            NODES.map(|(x, w)| (middle + half * x, half * w))
        })
        .map(|(x, w)| w * f(x))
        .sum()
}
