//! Integration over tetrahedra and intervals.

use fluxmorph_geometry::tet4::Point;

/// Barycentric coordinates and weights (sum 1) of the 14-point rule of degree 5 on the tetrahedron (Walkington 2000).
pub(crate) fn tet_rule() -> Vec<([f64; 4], f64)> {
    let mut rule = Vec::with_capacity(14);
    for (near, weight) in [
        (0.310_885_919_263_300_6, 0.112_687_925_718_015_85),
        (0.092_735_250_310_891_23, 0.073_493_043_116_361_95),
    ] {
        for corner in 0..4 {
            let mut point = [near; 4];
            point[corner] = 1.0 - 3.0 * near;
            rule.push((point, weight));
        }
    }
    let near = 0.045_503_704_125_649_65;
    for [a, b] in fluxmorph_geometry::tet4::EDGES {
        let mut point = [near; 4];
        point[a] = 0.5 - near;
        point[b] = 0.5 - near;
        rule.push((point, 0.042_546_020_777_081_466));
    }
    rule
}

/// The point with barycentric coordinates `bary`.
pub(crate) fn point_in(vertices: [Point; 4], bary: [f64; 4]) -> Point {
    std::array::from_fn(|d| (0..4).map(|a| bary[a] * vertices[a][d]).sum())
}

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

#[test]
fn the_tet_rule_is_exact_to_degree_five() {
    // ∫ Π λ_a^{m_a} / V = 6 Π m_a! / (3 + Σ m_a)!
    let factorial = |n: i32| f64::from((1..=n).product::<i32>());
    for powers in [[5, 0, 0, 0], [3, 2, 0, 0], [2, 2, 1, 0], [2, 1, 1, 1], [4, 0, 0, 0], [1, 1, 1, 1]] {
        let sum: f64 = tet_rule()
            .into_iter()
            .map(|(bary, w)| w * (0..4).map(|a| bary[a].powi(powers[a])).product::<f64>())
            .sum();
        let exact =
            6.0 * powers.map(factorial).iter().product::<f64>() / factorial(3 + powers.iter().sum::<i32>());
        // The rule's constants carry 16 digits.
        assert!((sum / exact - 1.0).abs() < 1e-13, "{powers:?}: {sum} {exact}");
    }
}
