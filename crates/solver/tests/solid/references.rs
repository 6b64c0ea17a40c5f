//! Solid conductors against what is known: wires and billets against Bessel functions, busbars against an independent integral.

use std::f64::consts::PI;
use std::sync::Arc;

use fluxmorph_geometry::Mesh;
use fluxmorph_geometry::fem::c64;
use fluxmorph_geometry::tet4::Point;
use fluxmorph_solver::circuit::{Winding, terminals};
use fluxmorph_solver::enrichment::Effort;
use fluxmorph_solver::material::VACUUM_PERMEABILITY;
use fluxmorph_solver::{ElementFamily, FieldModel, FieldModelSetup, Material, Order};

use super::super::{OUTSIDE, flux_parallel, painted, solved};
use super::{COPPER, METAL, NO_CIRCUIT, coil, impedance, parts};

/// Opening of a wedge [rad] whose chord stands for an arc: its area is short of the sector's by a square of it over six, 0.08 %.
const OPENING: f64 = 0.07;

/// `J_0(z)` and `J_1(z)` by their series (Abramowitz and Stegun, 9.1.10); rounding grows with `e^|z|`.
fn bessel(z: c64) -> [c64; 2] {
    let (mut term, mut sums) = (c64::from(1.0), [c64::default(); 2]);
    let quarter = -0.25 * z * z;
    for m in 0..80 {
        sums[0] += term;
        sums[1] += term / f64::from(m + 1);
        term *= quarter / f64::from((m + 1) * (m + 1));
    }
    [sums[0], 0.5 * z * sums[1]]
}

/// `k = (1 − j)/δ` [1/m].
fn wave_number(skin_depth: f64) -> c64 {
    c64::new(1.0, -1.0) / skin_depth
}

/// The frequency [Hz] of a skin depth [m].
fn frequency(skin_depth: f64) -> f64 {
    1.0 / (PI * VACUUM_PERMEABILITY * COPPER * skin_depth * skin_depth)
}

/// A wedge of lines along the radius, one cell wide and high, with regions by the radius [m] of a cell.
fn wedge(radii: Vec<f64>, height: f64, names: &[&str], paint: impl Fn(f64) -> u32) -> Mesh {
    let straight = painted([radii, vec![0.0, OPENING], vec![0.0, height]], names, |x| paint(x[0]));
    let turned = |&[r, angle, z]: &Point| [r * angle.cos(), r * angle.sin(), z];
    let points = straight.points().iter().map(turned).collect();
    Mesh::new(Arc::clone(straight.topology()), points).expect("a mesh")
}

/// A wire of 1 mm in a sheath of 2 mm that takes its current back.
fn wire(elements: (ElementFamily, Order), skin_depth: f64, cells: usize) -> [c64; 2] {
    let (radius, sheath, height) = (1e-3, 2e-3, 0.1e-3);
    let hole = 0.01 * radius;
    let radii =
        std::iter::once(hole).chain(parts(hole, radius, cells)).chain(parts(radius, sheath, cells / 2));
    let mesh = wedge(radii.collect(), height, &["wire", "air"], |r| u32::from(r > radius));
    let setup = FieldModelSetup {
        frequency: frequency(skin_depth),
        family: elements.0,
        order: elements.1,
        materials: vec![METAL, Material::AIR],
        coils: vec![coil(&mesh, "wire", ["z_min", "z_max"], 3.0)],
        boundaries: flux_parallel(&["z_min", "z_max", "x_max"]),
        ..FieldModelSetup::default()
    };
    let omega = 2.0 * PI * setup.frequency;
    let (model, state) = solved(&mesh, setup);
    let found = terminals((&model, &mesh, &state)).expect("terminals");
    let k = wave_number(skin_depth);
    let [j0, j1] = bessel(k * radius);
    let inside = k * j0 / (2.0 * PI * radius * COPPER * j1);
    let outside = VACUUM_PERMEABILITY / (2.0 * PI) * (sheath / radius).ln();
    // Of the loss of its own field, and of the voltage: one and the same.
    let loss: f64 = state.losses(&model, &mesh).iter().map(|(_, loss)| loss).sum();
    let by_loss = 2.0 * loss / 9.0;
    let resistance = found.coils[0].resistance.expect("all is linear");
    assert!((by_loss / resistance - 1.0).abs() < 1e-8, "{by_loss} {resistance}");
    let share = height * 2.0 * PI / OPENING;
    let exact = share * (inside + c64::new(0.0, omega * outside));
    let of_air = c64::new(0.0, omega * share * outside);
    [impedance(&found, omega) - of_air, exact - of_air]
}

#[test]
fn resistance_and_inner_inductance_of_a_round_wire_are_those_of_bessel_functions() {
    let cases = [
        (ElementFamily::Edge, Order::Linear, 40),
        (ElementFamily::Edge, Order::Quadratic, 16),
        (ElementFamily::Nodal, Order::Quadratic, 16),
        // Three cells in the thinnest skin, and one.
        (ElementFamily::Edge, Order::Linear, 15),
        (ElementFamily::Edge, Order::Quadratic, 5),
    ];
    for (family, order, cells) in cases {
        for skin_depth in [0.2, 0.4, 1.0, 3.0] {
            let [found, exact] = wire((family, order), skin_depth * 1e-3, cells);
            let (r, l) = (found.re / exact.re - 1.0, found.im / exact.im - 1.0);
            println!(
                "{family:?} {order:?} δ = {skin_depth} a: R {:+.3} %, L_i {:+.3} %",
                100.0 * r,
                100.0 * l
            );
            assert!(r.abs() < 0.02 && l.abs() < 0.02, "{family:?} {order:?} {skin_depth}: {r} {l}");
        }
    }
}

/// The power [W] per height [m] that an axial field of amplitude `H0` [A/m] loses in a long cylinder.
fn billet_power(radius: f64, material: Material, omega: f64, strength: f64) -> f64 {
    let k = wave_number(material.skin_depth(omega).expect("it conducts"));
    let [j0, j1] = bessel(k * radius);
    PI * radius * strength * strength * (k * j1 / j0).re.abs() / material.conductivity
}

/// A steel billet of 20 mm in a long induction coil: a solid ring, cut by planes through the axis.
#[test]
fn an_induction_coil_heats_a_billet_by_the_power_of_bessel_functions() {
    let steel = Material { relative_permeability: 40.0, conductivity: 2e6 };
    let (radius, height, current) = (20e-3, 2e-3, 500.0);
    let hole = 0.01 * radius;
    let radii = std::iter::once(hole).chain(parts(hole, radius, 30));
    let radii = radii.chain(parts(radius, 24e-3, 2)).chain(parts(24e-3, 30e-3, 12));
    let paint = |r: f64| if r < radius { 0 } else { 1 + u32::from(r > 24e-3) };
    let mesh = wedge(radii.collect(), height, &["billet", "air", "turn"], paint);
    for (order, hertz) in [(Order::Linear, 50.0), (Order::Quadratic, 50.0), (Order::Quadratic, 1000.0)] {
        let setup = FieldModelSetup {
            frequency: hertz,
            order,
            materials: vec![steel, Material::AIR, METAL],
            coils: vec![coil(&mesh, "turn", ["y_min", "y_max"], current)],
            // The axis, and the planes through it.
            boundaries: flux_parallel(&["x_min", "y_min", "y_max"]),
            ..FieldModelSetup::default()
        };
        let (model, state) = solved(&mesh, setup);
        let power = state.losses(&model, &mesh)[0].1;
        let exact =
            billet_power(radius, steel, 2.0 * PI * hertz, current / height) * height * OPENING / (2.0 * PI);
        println!(
            "{order:?} {hertz} Hz: {power:.6e} W, exact {exact:.6e} ({:+.3} %)",
            100.0 * (power / exact - 1.0)
        );
        assert!((power / exact - 1.0).abs() < 0.02, "{order:?} {hertz}: {power} {exact}");
    }
}

/// `∫∫ ln √(x² + y²) dx dy` from the origin to a corner.
fn log_potential([x, y]: [f64; 2]) -> f64 {
    let product = if x * y == 0.0 { 0.0 } else { x * y * (x * x + y * y).ln() };
    0.5 * (product - 3.0 * x * y + x * x * (y / x).atan() + y * y * (x / y).atan())
}

/// The impedance per length [Ω/m] of a quarter of a pair of long bars by the integral equation of their current densities
/// (Silvester, Modern Electromagnetic Fields, 1968): `J/σ − jωμ0/(2π) ∫J ln r = V`, constant on `n` by `m` cells, met at their centres.
/// The bar is `[gap, gap + width] × [0, half]`; the sign is that of the current beyond x = 0.
fn bars_by_filaments([gap, width, half]: [f64; 3], sign: f64, omega: f64, [n, m]: [usize; 2]) -> c64 {
    // Fine near the faces, as the current is.
    let lines = |from: f64, length: f64, count: usize, both: bool| -> Vec<f64> {
        let at = |t: f64| if both { 0.5 - 0.5 * (PI * t).cos() } else { (0.5 * PI * t).sin() };
        (0..=count).map(|i| from + length * at(i as f64 / count as f64)).collect()
    };
    let (x, y) = (lines(gap, width, n, true), lines(0.0, half, m, false));
    let cells: Vec<[[f64; 2]; 2]> =
        x.windows(2).flat_map(|a| y.windows(2).map(move |b| [[a[0], a[1]], [b[0], b[1]]])).collect();
    let centre = |[a, b]: [f64; 2]| 0.5 * (a + b);
    let entry = |to: &[[f64; 2]; 2], from: &[[f64; 2]; 2]| -> f64 {
        let [u, v] = to.map(centre);
        let image = |sx: f64, sy: f64| -> f64 {
            let corner = |i: usize, j: usize| log_potential([from[0][i] - sx * u, from[1][j] - sy * v]);
            corner(1, 1) - corner(0, 1) - corner(1, 0) + corner(0, 0)
        };
        image(1.0, 1.0) + image(1.0, -1.0) + sign * (image(-1.0, 1.0) + image(-1.0, -1.0))
    };
    let factor = c64::new(0.0, -omega * VACUUM_PERMEABILITY / (2.0 * PI));
    let mut rows: Vec<Vec<c64>> = cells
        .iter()
        .enumerate()
        .map(|(i, to)| {
            let own =
                |(j, from): (usize, _)| factor * entry(to, from) + if i == j { 1.0 / COPPER } else { 0.0 };
            cells.iter().enumerate().map(own).chain([c64::from(1.0)]).collect()
        })
        .collect();
    for k in 0..rows.len() {
        let (above, below) = rows.split_at_mut(k + 1);
        let pivot = &above[k];
        for row in below {
            let part = row[k] / pivot[k];
            row[k..].iter_mut().zip(&pivot[k..]).for_each(|(value, own)| *value -= part * own);
        }
    }
    let mut density = vec![c64::default(); cells.len()];
    for k in (0..cells.len()).rev() {
        let known: c64 = (k + 1..cells.len()).map(|j| rows[k][j] * density[j]).sum();
        density[k] = (rows[k][cells.len()] - known) / rows[k][k];
    }
    let area = |[a, b]: &[[f64; 2]; 2]| (a[1] - a[0]) * (b[1] - b[0]);
    1.0 / density.iter().zip(&cells).map(|(j, cell)| j * area(cell)).sum::<c64>()
}

/// The same by elements: a slice in a box that is far away.
fn bars_by_elements([gap, width, half]: [f64; 3], is_pair: bool, hertz: f64, cells: [usize; 2]) -> c64 {
    let far = |from: f64| {
        let step = |i: i32| from + 4e-3 * (1.5_f64.powi(i) - 1.0);
        (1..12).map(step).collect::<Vec<_>>()
    };
    let x: Vec<f64> = if gap > 0.0 { vec![0.0, 0.5 * gap, gap] } else { vec![0.0] };
    let x = x.into_iter().chain(parts(gap, gap + width, cells[0])).chain(far(gap + width));
    let y = std::iter::once(0.0).chain(parts(0.0, half, cells[1])).chain(far(half));
    let height = 2e-3;
    let in_bar = |[x, y, _]: Point| u32::from(x > gap && x < gap + width && y < half);
    let mesh = painted([x.collect(), y.collect(), vec![0.0, height]], &["air", "bar"], in_bar);
    let mut boundaries = flux_parallel(&["z_min", "z_max", "x_max", "y_max"]);
    boundaries.extend(is_pair.then(|| flux_parallel(&["x_min"])).into_iter().flatten());
    let setup = FieldModelSetup {
        frequency: hertz,
        order: Order::Quadratic,
        materials: vec![Material::AIR, METAL],
        coils: vec![coil(&mesh, "bar", ["z_min", "z_max"], 1.0)],
        boundaries,
        ..FieldModelSetup::default()
    };
    let (model, state) = solved(&mesh, setup);
    let found = terminals((&model, &mesh, &state)).expect("terminals");
    impedance(&found, 2.0 * PI * hertz) / height
}

/// A bar of 8 by 40 mm alone, and a pair of them 8 mm apart.
#[test]
fn busbars_have_the_resistance_of_their_integral_equation() {
    for (size, is_pair) in [([0.0, 4e-3, 20e-3], false), ([4e-3, 8e-3, 20e-3], true)] {
        for hertz in [50.0, 400.0, 2000.0] {
            let omega = 2.0 * PI * hertz;
            let sign = if is_pair { -1.0 } else { 1.0 };
            let [coarse, exact] =
                [[12, 16], [20, 26]].map(|cells| bars_by_filaments(size, sign, omega, cells));
            let found = bars_by_elements(size, is_pair, hertz, [8, 14]);
            let direct = 1.0 / (COPPER * size[1] * size[2]);
            let error = found.re / exact.re - 1.0;
            println!(
                "pair {is_pair} {hertz} Hz: R/R0 {:.4}, integral {:.4} ({:+.3} %, coarse {:+.3} %), X {:+.3} %",
                found.re / direct,
                exact.re / direct,
                100.0 * error,
                100.0 * (coarse.re / exact.re - 1.0),
                100.0 * (found.im / exact.im - 1.0)
            );
            assert!(error.abs() < 0.02, "{hertz}: {error}");
            // Alone, a bar has an inductance only with where its current returns.
            assert!(!is_pair || (found.im / exact.im - 1.0).abs() < 0.02, "{found} {exact}");
        }
    }
}

/// At rest second order has another resistance of a bend, and so has the current that a voltage drives through it: the model of an
/// estimate knows both, and its winding that of its own.
#[test]
fn what_a_voltage_drives_at_rest_is_that_of_the_order_of_an_estimate() {
    let line = || [-10e-3, 0.0].into_iter().chain(parts(0.0, 30e-3, 6)).collect::<Vec<_>>();
    let is_bend = |[x, y, z]: Point| x.min(y) > 0.0 && x.min(y) < 10e-3 && z > 0.0 && z < 5e-3;
    let mesh =
        painted([line(), line(), vec![-5e-3, 0.0, 5e-3, 10e-3]], &["air", "bend"], |x| u32::from(is_bend(x)));
    let of = |order| {
        let driven = Winding { voltage: Some(c64::from(1e-3)), ..NO_CIRCUIT };
        let setup = FieldModelSetup {
            order,
            materials: vec![Material::AIR, METAL],
            coils: vec![coil(&mesh, "bend", ["x_max", "y_max"], 0.0)],
            windings: vec![Some(driven)],
            boundaries: flux_parallel(&OUTSIDE),
            ..FieldModelSetup::default()
        };
        FieldModel::new(&mesh, setup).expect("a sound problem")
    };
    let coarse = of(Order::Linear);
    let linkage = |model: &FieldModel| {
        let (state, _) = model.solve(&mesh).expect("a field");
        let found = terminals((model, &mesh, &state)).expect("terminals");
        (found.coils[0].flux_linkage.re, found.coils[0].current.re)
    };
    let enriched = coarse.enriched(&mesh, Effort::Any).expect("a model");
    let [first, second, estimated] = [&coarse, &of(Order::Quadratic), &enriched].map(linkage);
    println!("{first:?} {second:?} {estimated:?}");
    assert!((first.1 / second.1 - 1.0).abs() > 0.01, "the orders differ");
    assert!((estimated.1 / second.1 - 1.0).abs() < 1e-12);
    // An estimate solves to a thousandth.
    assert!((estimated.0 / second.0 - 1.0).abs() < 2e-3);
}
