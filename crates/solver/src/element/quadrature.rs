//! Quadrature on the tetrahedron: points in barycentric coordinates, weights that sum to one.

/// A point and its share of the volume.
pub type Node = ([f64; 4], f64);

/// The four vertices, in their order: exact for linear polynomials.
pub fn vertices() -> &'static [Node; 4] {
    const RULE: [Node; 4] = [
        ([1.0, 0.0, 0.0, 0.0], 0.25),
        ([0.0, 1.0, 0.0, 0.0], 0.25),
        ([0.0, 0.0, 1.0, 0.0], 0.25),
        ([0.0, 0.0, 0.0, 1.0], 0.25),
    ];
    &RULE
}

/// Four points, exact for quadratic polynomials (Hammer, Marlowe and Stroud, Math. Tables Aids Comput. 10 (1956) 130).
pub fn degree_2() -> &'static [Node; 4] {
    const NEAR: f64 = 0.585_410_196_624_968_5;
    const FAR: f64 = 0.138_196_601_125_010_5;
    const RULE: [Node; 4] = [
        ([NEAR, FAR, FAR, FAR], 0.25),
        ([FAR, NEAR, FAR, FAR], 0.25),
        ([FAR, FAR, NEAR, FAR], 0.25),
        ([FAR, FAR, FAR, NEAR], 0.25),
    ];
    &RULE
}

/// Fourteen points with positive weights, exact for polynomials of degree 5 (Walkington, Quadrature on simplices of
/// arbitrary dimension, 2000).
pub fn degree_5() -> &'static [Node; 14] {
    const A: f64 = 0.310_885_919_263_300_6;
    const A3: f64 = 1.0 - 3.0 * A;
    const WA: f64 = 0.112_687_925_718_015_85;
    const B: f64 = 0.092_735_250_310_891_23;
    const B3: f64 = 1.0 - 3.0 * B;
    const WB: f64 = 0.073_493_043_116_361_95;
    const C: f64 = 0.045_503_704_125_649_65;
    const C2: f64 = 0.5 - C;
    const WC: f64 = 0.042_546_020_777_081_466;
    const RULE: [Node; 14] = [
        ([A3, A, A, A], WA),
        ([A, A3, A, A], WA),
        ([A, A, A3, A], WA),
        ([A, A, A, A3], WA),
        ([B3, B, B, B], WB),
        ([B, B3, B, B], WB),
        ([B, B, B3, B], WB),
        ([B, B, B, B3], WB),
        ([C, C, C2, C2], WC),
        ([C, C2, C, C2], WC),
        ([C, C2, C2, C], WC),
        ([C2, C, C, C2], WC),
        ([C2, C, C2, C], WC),
        ([C2, C2, C, C], WC),
    ];
    &RULE
}

#[cfg(test)]
mod tests {
    use super::*;

    /// `⟨λ_0^i λ_1^j λ_2^k λ_3^l⟩ = 3! i! j! k! l! / (i + j + k + l + 3)!`.
    fn exact(powers: [u32; 4]) -> f64 {
        let factorial = |n: u32| (1..=n).map(f64::from).product::<f64>();
        6.0 * powers.map(factorial).iter().product::<f64>() / factorial(powers.iter().sum::<u32>() + 3)
    }

    fn check(rule: &[Node], degree: u32) {
        for i in 0..=degree {
            for j in 0..=degree - i {
                for k in 0..=degree - i - j {
                    let powers = [i, j, k, degree - i - j - k];
                    let sum: f64 = rule
                        .iter()
                        .map(|(l, w)| w * (0..4).map(|m| l[m].powi(powers[m] as i32)).product::<f64>())
                        .sum();
                    assert!((sum - exact(powers)).abs() < 1e-15, "{powers:?}");
                }
            }
        }
    }

    #[test]
    fn the_rules_are_exact_up_to_their_degree() {
        check(degree_2(), 2);
        check(degree_5(), 5);
    }
}
