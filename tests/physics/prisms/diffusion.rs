//! The field inside a conducting rectangle between equal fields on its exposed sides.

use fluxmorph_geometry::fem::c64;

/// `∫u` [m²] over a rectangle where `∇²u = k²u`, `u = 1` on the exposed faces and `∂u/∂n = 0` on the others.
///
/// `sides`: length [m] of the rectangle along x and y, and how many of the two faces across are exposed, at least one
/// along x and y together. With `a` the length after mirroring at the faces that are not exposed and `q² = k² + π²m²/a²`,
/// `∫u / (a b) = 1 − Σ_{m odd} 8 k²/(π² m² q²) · (1 − tanh(q b/2)/(q b/2))`: sine series along x, closed form along y.
pub(super) fn field_integral(sides: [(f64, usize); 2], k: c64) -> c64 {
    let area = sides[0].0 * sides[1].0;
    let mirrored = |(length, faces): (f64, usize)| length * (3 - faces) as f64;
    match sides.map(|(_, faces)| faces) {
        [0, 0] => panic!("a face is exposed"),
        [_, 0] => area * slab(0.5 * k * mirrored(sides[0])),
        [0, _] => area * slab(0.5 * k * mirrored(sides[1])),
        _ => {
            let [a, b] = sides.map(mirrored);
            let pi = std::f64::consts::PI;
            // Terms fall with the fourth power beyond |k| a; the rest is below 1e-10 of the first.
            let terms = 2000 + (20.0 * k.norm() * a) as usize;
            let sum: c64 = (0..terms)
                .rev()
                .map(|i| {
                    let m = (2 * i + 1) as f64;
                    let q2 = k * k + (pi * m / a).powi(2);
                    8.0 * k * k / (pi * pi * m * m * q2) * (1.0 - slab(0.5 * q2.sqrt() * b))
                })
                .sum();
            area * (1.0 - sum)
        }
    }
}

/// `tanh z / z`: the mean of `cosh(zx)/cosh z` over −1 to 1.
fn slab(z: c64) -> c64 {
    let decayed = (-2.0 * z).exp();
    (1.0 - decayed) / (1.0 + decayed) / z
}

#[test]
fn a_thick_block_is_its_surface_and_a_thin_one_is_filled() {
    let k = c64::new(1.0, 1.0) / 0.001;
    // Two faces of 1 m: δ/(1+j) each; their corner is of the order of δ².
    let corner = field_integral([(1.0, 1), (1.0, 1)], k) - 2.0 / k;
    assert!((corner * k * k).norm() < 2.0 && (corner * k * k).norm() > 0.1, "{}", corner * k * k);
    // Four faces of a block of twice the size: four of these corners and eight of the lengths.
    let whole = field_integral([(2.0, 2), (2.0, 2)], k);
    assert!((whole / 4.0 - 2.0 / k - corner).norm() < 1e-12);
    // A skin of ten metres: u = 1 up to k² times the square of the size.
    assert!((field_integral([(1.0, 1), (0.5, 2)], c64::new(1e-3, 1e-3)) / 0.5 - 1.0).norm() < 1e-6);
    // Long along y: the slab, and the two ends.
    let slab = field_integral([(0.02, 2), (1.0, 0)], c64::new(100.0, 100.0));
    let long = field_integral([(0.02, 2), (50.0, 2)], c64::new(100.0, 100.0)) / 50.0;
    assert!((long / slab - 1.0).norm() < 1e-3, "{slab} {long}");
}
