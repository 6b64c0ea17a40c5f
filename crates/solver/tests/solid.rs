//! Solid driven conductors: wires and billets against Bessel functions, busbars against an independent integral, circuits, and the
//! gradient where the conductor itself moves.

use std::f64::consts::PI;
use std::sync::Arc;

use fluxmorph_geometry::fem::c64;
use fluxmorph_geometry::generate::Grid;
use fluxmorph_geometry::tet4::Point;
use fluxmorph_geometry::{ElementId, Mesh, RegionId};
use fluxmorph_solver::circuit::{Terminals, terminals};
use fluxmorph_solver::coil::{Coil, Frame, Path, RegionCurrent, SolidConductor};
use fluxmorph_solver::functional::{AtTerminals, Inductive};
use fluxmorph_solver::linear::LinearSolverSettings;
use fluxmorph_solver::material::VACUUM_PERMEABILITY;
use fluxmorph_solver::{
    ElementFamily, FieldModel, FieldModelSetup, Functional, Material, Order, Winding, adjoint,
};

use super::{OUTSIDE, flux_parallel, terminal};

/// Conductivity [S/m] of copper.
const COPPER: f64 = 58e6;

const METAL: Material = Material { relative_permeability: 1.0, conductivity: COPPER };

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
    let grid = Grid::new("wedge", [radii, vec![0.0, OPENING], vec![0.0, height]]).expect("ascending lines");
    let topology = grid.topology(names, |x| RegionId(paint(x[0]))).expect("regions");
    let turned = |[r, angle, z]: Point| [r * angle.cos(), r * angle.sin(), z];
    Mesh::new(Arc::new(topology), grid.points().into_iter().map(turned).collect()).expect("a mesh")
}

/// So many equal parts of an interval, without its first end.
fn parts(from: f64, to: f64, count: usize) -> impl Iterator<Item = f64> {
    (1..=count).map(move |i| from + (to - from) * i as f64 / count as f64)
}

fn solid(mesh: &Mesh, name: &str, [from, to]: [&str; 2]) -> SolidConductor {
    let topology = mesh.topology();
    let elements = topology.elements_of(topology.region(name).expect("a region"));
    let path = Path::Terminals { from: terminal(mesh, from), to: terminal(mesh, to) };
    SolidConductor::new(mesh, name, &elements, &path).expect("a conductor")
}

fn coil(mesh: &Mesh, name: &str, ends: [&str; 2], current: f64) -> Coil {
    Coil { name: name.to_owned(), ampere_turns: c64::from(current), shape: solid(mesh, name, ends).into() }
}

/// `L + R/(jω)` of the first coil times `jω` [Ω].
fn impedance(found: &Terminals, omega: f64) -> c64 {
    c64::new(found.coils[0].resistance, omega * found.inductance[0][0])
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
    let model = FieldModel::new(&mesh, setup).expect("a model");
    let (state, _) = model.solve(&mesh).expect("a field");
    let found = terminals(&model, &mesh, &state).expect("terminals");
    let k = wave_number(skin_depth);
    let [j0, j1] = bessel(k * radius);
    let inside = k * j0 / (2.0 * PI * radius * COPPER * j1);
    let outside = VACUUM_PERMEABILITY / (2.0 * PI) * (sheath / radius).ln();
    // Of the loss of its own field, and of the voltage: one and the same.
    let loss: f64 = state.losses(&model, &mesh).iter().map(|(_, loss)| loss).sum();
    let by_loss = 2.0 * loss / 9.0;
    assert!(
        (by_loss / found.coils[0].resistance - 1.0).abs() < 1e-8,
        "{by_loss} {}",
        found.coils[0].resistance
    );
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
        let model = FieldModel::new(&mesh, setup).expect("a model");
        let (state, _) = model.solve(&mesh).expect("a field");
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

/// A bar through a box, beside a plate and a coil of a region; cells of 5 mm, and so many in each.
fn bar_in_a_box() -> Mesh {
    let lines = |length: f64| std::iter::once(0.0).chain(parts(0.0, length, 6)).collect::<Vec<_>>();
    let grid = Grid::new("box", [lines(30e-3), lines(30e-3), lines(30e-3)]).expect("ascending lines");
    let names = ["air", "bar", "plate", "winding"];
    let within = |[x, y]: [f64; 2], [low, high]: [[f64; 2]; 2]| {
        x > low[0] * 5e-3 && x < high[0] * 5e-3 && y > low[1] * 5e-3 && y < high[1] * 5e-3
    };
    let paint = |[x, y, z]: Point| {
        if within([y, z], [[1.0, 2.0], [2.0, 4.0]]) {
            1
        } else if within([y, z], [[3.0, 4.0], [5.0, 5.0]]) && x > 5e-3 && x < 25e-3 {
            2
        } else if within([y, z], [[4.0, 1.0], [5.0, 2.0]]) {
            3
        } else {
            0
        }
    };
    let topology = grid.topology(&names, |x| RegionId(paint(x))).expect("regions");
    Mesh::new(Arc::new(topology), grid.points()).expect("a mesh")
}

const NO_CIRCUIT: Winding =
    Winding { turns: 1.0, resistance: 0.0, series_inductance: 0.0, series_capacitance: None, voltage: None };

fn with_a_bar(
    mesh: &Mesh,
    elements: (ElementFamily, Order),
    frequency: f64,
    (current, winding): (f64, Winding),
) -> FieldModel {
    let topology = mesh.topology();
    let region = topology.elements_of(topology.region("winding").expect("a region"));
    let path = Path::Terminals { from: terminal(mesh, "x_min"), to: terminal(mesh, "x_max") };
    let stranded = RegionCurrent::new(mesh, "winding", &region, &path).expect("a winding");
    let stranded = Coil { name: "winding".to_owned(), ampere_turns: c64::from(40.0), shape: stranded.into() };
    let setup = FieldModelSetup {
        frequency,
        family: elements.0,
        order: elements.1,
        materials: vec![Material::AIR, METAL, METAL, Material::AIR],
        coils: vec![coil(mesh, "bar", ["x_min", "x_max"], current), stranded],
        windings: vec![Some(winding), Some(Winding { turns: 20.0, ..NO_CIRCUIT })],
        boundaries: flux_parallel(&OUTSIDE),
        linear_solver: LinearSolverSettings { tolerance: 1e-13, ..LinearSolverSettings::default() },
        ..FieldModelSetup::default()
    };
    FieldModel::new(mesh, setup).expect("a model")
}

const FAMILIES: [(ElementFamily, Order); 4] = [
    (ElementFamily::Edge, Order::Linear),
    (ElementFamily::Edge, Order::Quadratic),
    (ElementFamily::Nodal, Order::Linear),
    (ElementFamily::Nodal, Order::Quadratic),
];

/// The inductance matrix with a coil of strands is symmetric, the power that goes in at the terminals is lost, and the voltage that
/// a current needs drives it, through what is in series.
#[test]
fn a_bar_is_a_coil_among_others() {
    let mesh = bar_in_a_box();
    for elements in FAMILIES {
        let given = with_a_bar(&mesh, elements, 300.0, (100.0, NO_CIRCUIT));
        let (state, _) = given.solve(&mesh).expect("a field");
        let found = terminals(&given, &mesh, &state).expect("terminals");
        let [l, m] = [found.inductance[0][1], found.inductance[1][0]];
        println!("{elements:?}: {:?} M = {l:e}", found.coils[0]);
        assert!((l / m - 1.0).abs() < 1e-9, "{l} {m}");
        let losses: f64 = state.losses(&given, &mesh).iter().map(|(_, loss)| loss).sum();
        let power: f64 = found.coils.iter().map(|coil| 0.5 * (coil.voltage * coil.current.conj()).re).sum();
        assert!((power / losses - 1.0).abs() < 1e-9, "{power} {losses}");
        let bar = &found.coils[0];
        for series in [
            NO_CIRCUIT,
            Winding {
                resistance: 1e-3,
                series_inductance: 2e-7,
                series_capacitance: Some(0.3),
                ..NO_CIRCUIT
            },
        ] {
            let source = bar.voltage + series.impedance(given.angular_frequency()) * bar.current;
            let winding = Winding { voltage: Some(source), ..series };
            let driven = with_a_bar(&mesh, elements, 300.0, (0.0, winding));
            let (state, _) = driven.solve(&mesh).expect("a field");
            let seen = terminals(&driven, &mesh, &state).expect("terminals");
            let (same, other) = (&seen.coils[0], &seen.coils[1]);
            let pairs = [
                (bar.current, same.current),
                (bar.flux_linkage, same.flux_linkage),
                (found.coils[1].flux_linkage, other.flux_linkage),
            ];
            for (a, b) in pairs {
                assert!((a - b).norm() < 1e-9 * a.norm(), "{elements:?}: {a} {b}");
            }
            for (a, b) in found.inductance.iter().flatten().zip(seen.inductance.iter().flatten()) {
                assert!((a / b - 1.0).abs() < 1e-9, "{a} {b}");
            }
        }
    }
}

/// At 0 Hz the resistance is that of the section, and a low frequency comes to it and to the inductance at rest.
#[test]
fn at_rest_a_bar_has_the_resistance_of_its_section() {
    let mesh = bar_in_a_box();
    let section = 5e-3 * 10e-3;
    let resistance = 30e-3 / (COPPER * section);
    let of = |elements, frequency| {
        let winding = Winding { voltage: Some(c64::from(0.1)), resistance: 2.0 * resistance, ..NO_CIRCUIT };
        let model = with_a_bar(&mesh, elements, frequency, (0.0, winding));
        let (state, _) = model.solve(&mesh).expect("a field");
        terminals(&model, &mesh, &state).expect("terminals")
    };
    for elements in FAMILIES {
        let [rest, slow] = [0.0, 0.1].map(|frequency| of(elements, frequency));
        for found in [&rest, &slow] {
            let current = found.coils[0].current;
            assert!((found.coils[0].resistance / (3.0 * resistance) - 1.0).abs() < 1e-6, "{found:?}");
            // ωL is 1.4e-4 of the resistance, of which |Z| has half the square.
            assert!((current.norm() * 3.0 * resistance / 0.1 - 1.0).abs() < 1e-7, "{found:?}");
        }
        // The skin depth is 0.2 m: what it does is of the fourth power of its ratio to the bar's width.
        for (a, b) in rest.inductance.iter().flatten().zip(slow.inductance.iter().flatten()) {
            assert!((a / b - 1.0).abs() < 1e-6, "{elements:?}: {rest:?} {slow:?}");
        }
    }
}

/// A closed ring has the impedance of its half between terminals, twice.
#[test]
fn a_closed_ring_is_two_halves_in_series() {
    let ring = |half: bool| -> c64 {
        let line = |from: f64| {
            std::iter::once(from).chain(parts(from, 30e-3, ((30e-3 - from) / 5e-3).round() as usize))
        };
        let whole: Vec<f64> = line(-30e-3).collect();
        let first = if half { line(0.0).collect() } else { whole.clone() };
        let grid = Grid::new("box", [first, whole, vec![-5e-3, 0.0, 5e-3, 10e-3]]).expect("ascending lines");
        let within = |x: Point, r: f64| x[0].abs() < r && x[1].abs() < r && x[2] > 0.0 && x[2] < 5e-3;
        let paint = |x: Point| RegionId(u32::from(within(x, 20e-3) && !within(x, 10e-3)));
        let topology = grid.topology(&["air", "ring"], paint).expect("regions");
        let mesh = Mesh::new(Arc::new(topology), grid.points()).expect("a mesh");
        let elements = mesh.topology().elements_of(RegionId(1));
        let path = if half {
            let ends = |name: &str, sign: f64| {
                let mut end = terminal(&mesh, name);
                end.triangles.retain(|t| sign * mesh.point(t[0])[1] > 0.0);
                end
            };
            Path::Terminals { from: ends("x_min", -1.0), to: ends("x_min", 1.0) }
        } else {
            Path::Closed(Frame::new([1e-3, -2e-3, 0.0], [0.0, 0.0, 1.0], None).expect("a frame"))
        };
        let conductor = SolidConductor::new(&mesh, "ring", &elements, &path).expect("a ring");
        let setup = FieldModelSetup {
            frequency: 500.0,
            materials: vec![Material::AIR, METAL],
            coils: vec![Coil {
                name: "ring".to_owned(),
                ampere_turns: c64::from(2.0),
                shape: conductor.into(),
            }],
            windings: vec![Some(NO_CIRCUIT)],
            boundaries: flux_parallel(&OUTSIDE),
            linear_solver: LinearSolverSettings { tolerance: 1e-13, ..LinearSolverSettings::default() },
            ..FieldModelSetup::default()
        };
        let omega = 2.0 * PI * setup.frequency;
        let model = FieldModel::new(&mesh, setup).expect("a model");
        let (state, _) = model.solve(&mesh).expect("a field");
        let found = terminals(&model, &mesh, &state).expect("terminals");
        let voltage = found.coils[0].voltage / 2.0;
        assert!((voltage - impedance(&found, omega)).norm() < 1e-9 * voltage.norm());
        voltage
    };
    let [whole, half] = [ring(false), ring(true)];
    println!("{whole} {half}");
    // The cells of the two halves are not mirrored: what is left is the discretisation's.
    assert!((whole / half - 2.0).norm() < 0.02, "{whole} {half}");
}

/// The loss in the bar, its resistance, voltage and current follow its own surface, in both families and orders.
#[test]
fn the_gradient_of_a_bar_that_moves_matches_central_differences() {
    let mesh = bar_in_a_box();
    let winding = mesh.topology().region("winding").expect("a region");
    let is_held = |e: &ElementId| mesh.topology().region_of()[e.index()] == winding;
    let moving: Vec<_> = mesh.topology().elements().filter(|e| !is_held(e)).collect();
    let held = |n| mesh.topology().elements_around(n).iter().any(is_held);
    let sway = |n| -> Point {
        let [x, y, z] = mesh.point(n);
        let off = |c: f64| c * (30e-3 - c) * 4e3;
        if held(n) {
            return [0.0; 3];
        }
        let wave = (90.0 * x + 60.0 * z).sin() + 0.3 * (110.0 * y).cos();
        [off(x) * wave, off(y) * (1.0 + wave), off(z) * (80.0 * x - 50.0 * y).cos()]
    };
    let direction: Vec<Point> = mesh.topology().nodes().map(sway).collect();
    for elements in FAMILIES {
        let winding = Winding {
            voltage: Some(c64::new(0.02, 0.01)),
            resistance: 1e-5,
            series_inductance: 1e-8,
            ..NO_CIRCUIT
        };
        for winding in [NO_CIRCUIT, winding] {
            let is_driven = winding.voltage.is_some();
            let model = with_a_bar(&mesh, elements, 300.0, (if is_driven { 0.0 } else { 100.0 }, winding));
            let mut functionals = vec![
                Functional::loss(&model, "bar").expect("it conducts"),
                Functional::loss(&model, "plate").expect("it conducts"),
                Functional::at_terminals(&model, "bar", AtTerminals::Power).expect("a winding"),
                Functional::of_inductances(&model, &["bar"], Inductive::Resistance).expect("a winding"),
                Functional::of_inductances(&model, &["bar", "winding"], Inductive::Coupling)
                    .expect("windings"),
            ];
            let last = if is_driven { AtTerminals::Current } else { AtTerminals::Voltage };
            functionals.push(Functional::at_terminals(&model, "bar", last).expect("a winding"));
            let solve = |step: f64| {
                let moved: Vec<Point> = direction.iter().map(|v| v.map(|c| step * c)).collect();
                let mesh = mesh.moved(&moved).expect("small");
                let (mut state, mut system) = model.solve(&mesh).expect("a field");
                for winding in [0, 1] {
                    model.respond(&mut system, winding, &mut state).expect("a response");
                }
                (mesh, state, system)
            };
            let step = 1e-6;
            let (at, state, mut system) = solve(0.0);
            let sides = [solve(step), solve(-step)];
            for functional in functionals {
                let value = functional.evaluate(&model, &at, &state).expect("finite");
                let mut gradient = value.explicit.unwrap_or_else(|| vec![[0.0; 3]; direction.len()]);
                let mut add = |own: Vec<Point>| {
                    gradient.iter_mut().flatten().zip(own.as_flattened()).for_each(|(sum, own)| *sum += own)
                };
                if !value.derivative.is_empty() {
                    let lambda = adjoint::solve(&mut system, &value.derivative).expect("an adjoint");
                    add(adjoint::node_gradient(&model, &at, &state, &lambda, &moving).expect("one process"));
                }
                let of_inductances =
                    adjoint::inductance_gradient(&model, &at, &state, &value.inductances, &moving);
                add(of_inductances.expect("one process"));
                let terms = gradient.iter().zip(&direction);
                let exact: f64 = terms.map(|(g, v)| (0..3).map(|d| g[d] * v[d]).sum::<f64>()).sum();
                let [plus, minus] = sides
                    .each_ref()
                    .map(|(mesh, state, _)| functional.evaluate(&model, mesh, state).expect("finite").value);
                let difference = (plus - minus) / (2.0 * step);
                println!("{elements:?}: {exact:e} {:e}", difference / exact - 1.0);
                // Truncation by the square of a step of some micrometres on cells of 5 mm; rounding of the solver over the step.
                assert!((difference / exact - 1.0).abs() < 1e-6, "{elements:?}: {difference} {exact}");
            }
        }
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
    let grid = Grid::new("slice", [x.collect(), y.collect(), vec![0.0, height]]).expect("ascending lines");
    let in_bar = |[x, y, _]: Point| x > gap && x < gap + width && y < half;
    let topology = grid.topology(&["air", "bar"], |x| RegionId(u32::from(in_bar(x)))).expect("regions");
    let mesh = Mesh::new(Arc::new(topology), grid.points()).expect("a mesh");
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
    let model = FieldModel::new(&mesh, setup).expect("a model");
    let (state, _) = model.solve(&mesh).expect("a field");
    let found = terminals(&model, &mesh, &state).expect("terminals");
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
