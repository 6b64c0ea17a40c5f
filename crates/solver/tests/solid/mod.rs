//! Solid driven conductors as coils among others: circuits, rings, what is refused, and the gradient where the conductor itself
//! moves; against closed forms in `references`.

mod references;
mod saturating;

use std::f64::consts::PI;

use fluxmorph_geometry::fem::c64;
use fluxmorph_geometry::tet4::{Point, centroid, volume};
use fluxmorph_geometry::{ElementId, Mesh, RegionId};
use fluxmorph_solver::circuit::{CoilTerminals, Terminals, terminals};
use fluxmorph_solver::coil::{Coil, Connection, Frame, Path, RegionCurrent, SolidConductor};
use fluxmorph_solver::enrichment::Effort;
use fluxmorph_solver::functional::{AtTerminals, Inductive};
use fluxmorph_solver::linear::LinearSolverSettings;
use fluxmorph_solver::{
    Drive, ElementFamily, FieldModel, FieldModelSetup, FieldSolution, Functional, Material, Order, Winding,
};

use super::estimate::{estimate, value};
use super::{
    ALL, NO_CIRCUIT, OUTSIDE, derivatives_match, displaced, flux_parallel, painted, solved, terminal,
};

/// Conductivity [S/m] of copper.
const COPPER: f64 = 58e6;

const METAL: Material = Material { relative_permeability: 1.0, conductivity: COPPER };

/// So many equal parts of an interval, without its first end.
fn parts(from: f64, to: f64, count: usize) -> impl Iterator<Item = f64> {
    (1..=count).map(move |i| from + (to - from) * i as f64 / count as f64)
}

fn solid(mesh: &Mesh, name: &str, [from, to]: [&str; 2]) -> SolidConductor {
    let topology = mesh.topology();
    let elements = topology.elements_of(topology.region(name).expect("a region"));
    let path = Path::Terminals { from: terminal(mesh, from), to: terminal(mesh, to) };
    SolidConductor::new(mesh, name, &elements, (&path, Connection::Series)).expect("a conductor")
}

fn coil(mesh: &Mesh, name: &str, ends: [&str; 2], current: f64) -> Coil {
    Coil { name: name.to_owned(), ampere_turns: c64::from(current), shape: solid(mesh, name, ends).into() }
}

/// `L + R/(jω)` of the first coil times `jω` [Ω].
fn impedance(found: &Terminals, omega: f64) -> c64 {
    c64::new(found.coils[0].resistance.expect("all is linear"), omega * found.inductance[0][0])
}

/// A bar through a box, beside a plate and a coil of a region; cells of 5 mm, and so many in each.
fn bar_in_a_box() -> Mesh {
    let line = || std::iter::once(0.0).chain(parts(0.0, 30e-3, 6)).collect::<Vec<_>>();
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
    painted([line(), line(), line()], &names, paint)
}

fn with_a_bar(
    mesh: &Mesh,
    elements: (ElementFamily, Order),
    frequency: f64,
    driven: (f64, Winding),
) -> FieldModel {
    FieldModel::new(mesh, setup_with_a_bar(mesh, elements, frequency, driven)).expect("a model")
}

fn setup_with_a_bar(
    mesh: &Mesh,
    elements: (ElementFamily, Order),
    frequency: f64,
    (current, winding): (f64, Winding),
) -> FieldModelSetup {
    let topology = mesh.topology();
    let region = topology.elements_of(topology.region("winding").expect("a region"));
    let path = Path::Terminals { from: terminal(mesh, "x_min"), to: terminal(mesh, "x_max") };
    let stranded = RegionCurrent::new(mesh, "winding", &region, &path).expect("a winding");
    let stranded = Coil { name: "winding".to_owned(), ampere_turns: c64::from(40.0), shape: stranded.into() };
    FieldModelSetup {
        frequency,
        family: elements.0,
        order: elements.1,
        materials: vec![Material::AIR, METAL, METAL, Material::AIR],
        coils: vec![coil(mesh, "bar", ["x_min", "x_max"], current), stranded],
        windings: vec![Some(winding), Some(Winding { turns: 20.0, ..NO_CIRCUIT })],
        boundaries: flux_parallel(&OUTSIDE),
        linear_solver: LinearSolverSettings { tolerance: 1e-13, ..LinearSolverSettings::default() },
        ..FieldModelSetup::default()
    }
}

/// The inductance matrix with a coil of strands is symmetric, the power that goes in at the terminals is lost, and the voltage that
/// a current needs drives it, through what is in series.
#[test]
fn a_bar_is_a_coil_among_others() {
    let mesh = bar_in_a_box();
    for elements in ALL {
        let given = with_a_bar(&mesh, elements, 300.0, (100.0, NO_CIRCUIT));
        let (state, _) = given.solve(&mesh).expect("a field");
        let found = terminals((&given, &mesh, &state)).expect("terminals");
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
            let seen = terminals((&driven, &mesh, &state)).expect("terminals");
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
        terminals((&model, &mesh, &state)).expect("terminals")
    };
    for elements in ALL {
        let [rest, slow] = [0.0, 0.1].map(|frequency| of(elements, frequency));
        for found in [&rest, &slow] {
            let current = found.coils[0].current;
            let of_bar = found.coils[0].resistance.expect("all is linear");
            assert!((of_bar / (3.0 * resistance) - 1.0).abs() < 1e-6, "{found:?}");
            // ωL is 1.4e-4 of the resistance, of which |Z| has half the square.
            assert!((current.norm() * 3.0 * resistance / 0.1 - 1.0).abs() < 1e-7, "{found:?}");
        }
        // The skin depth is 0.2 m: what it does is of the fourth power of its ratio to the bar's width.
        for (a, b) in rest.inductance.iter().flatten().zip(slow.inductance.iter().flatten()) {
            assert!((a / b - 1.0).abs() < 1e-6, "{elements:?}: {rest:?} {slow:?}");
        }
    }
}

/// A right-angled bend has `1 − (2/π) ln 2` squares in its corner (a conformal map; P. M. Hall, Thin Solid Films 1 (1968) 277), and two
/// in each arm, whose ends are planes of equal potential to 1e-6. At its inner corner the current density has no bound: cells that
/// are half as wide leave `2^(−4/3)` of the error with any order.
#[test]
fn a_bend_has_the_resistance_of_its_squares() {
    let exact = (5.0 - 2.0 / PI * 2.0_f64.ln()) / (COPPER * 5e-3);
    let errors = [2, 4].map(|cells| {
        let line = || std::iter::once(0.0).chain(parts(0.0, 30e-3, 3 * cells)).collect::<Vec<_>>();
        let paint = |[x, y, _]: Point| u32::from(x < 10e-3 || y < 10e-3);
        let mesh = painted([line(), line(), vec![0.0, 5e-3]], &["air", "bend"], paint);
        let bend = solid(&mesh, "bend", ["x_max", "y_max"]);
        [Order::Linear, Order::Quadratic].map(|order| {
            let resistance = bend.direct_resistance(&mesh, order, COPPER).expect("a conductor");
            1.0 - resistance / exact
        })
    });
    println!("{errors:?}");
    for [linear, quadratic] in errors {
        assert!(0.0 < quadratic && quadratic < 0.4 * linear && linear < 0.05, "{errors:?}");
    }
    for order in [0, 1] {
        let left = errors[1][order] / errors[0][order];
        assert!((0.35..0.45).contains(&left), "order {}: {left}", order + 1);
    }
}

/// A closed ring has the impedance of its half between terminals, twice.
#[test]
fn a_closed_ring_is_two_halves_in_series() {
    let ring = |half: bool| -> (c64, f64) {
        let line = |from: f64| {
            std::iter::once(from).chain(parts(from, 30e-3, ((30e-3 - from) / 5e-3).round() as usize))
        };
        let whole: Vec<f64> = line(-30e-3).collect();
        let first = if half { line(0.0).collect() } else { whole.clone() };
        let within = |x: Point, r: f64| x[0].abs() < r && x[1].abs() < r && x[2] > 0.0 && x[2] < 5e-3;
        let paint = |x: Point| u32::from(within(x, 20e-3) && !within(x, 10e-3));
        let mesh = painted([first, whole, vec![-5e-3, 0.0, 5e-3, 10e-3]], &["air", "ring"], paint);
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
        let conductor =
            SolidConductor::new(&mesh, "ring", &elements, (&path, Connection::Series)).expect("a ring");
        let direct = conductor.direct_resistance(&mesh, Order::Quadratic, COPPER).expect("a conductor");
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
        let (model, state) = solved(&mesh, setup);
        // Nothing but the ring excites it: what is solved for are the responses.
        let report = state.report();
        assert!(report.iterations > 0 && report.residual > 0.0 && report.residual < 1e-12, "{report:?}");
        let found = terminals((&model, &mesh, &state)).expect("terminals");
        let voltage = found.coils[0].voltage / 2.0;
        assert!((voltage - impedance(&found, omega)).norm() < 1e-9 * voltage.norm());
        (voltage, direct)
    };
    let [(whole, of_whole), (half, of_half)] = [ring(false), ring(true)];
    println!("{whole} {half}, at rest {of_whole} {of_half}");
    assert!((of_whole / of_half - 2.0).abs() < 0.002, "at rest: {of_whole} {of_half}");
    // The cells of the two halves are not mirrored: what is left is the discretisation's.
    assert!((whole / half - 2.0).norm() < 0.02, "{whole} {half}");
}

/// A motion of all of the box but the winding, with the elements that move.
fn sway(mesh: &Mesh) -> (Vec<ElementId>, Vec<Point>) {
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
    let direction = mesh.topology().nodes().map(sway).collect();
    (moving, direction)
}

/// The loss in the bar, its resistance, voltage and current follow its own surface, in both families and orders.
#[test]
fn the_gradient_of_a_bar_that_moves_matches_central_differences() {
    let mesh = bar_in_a_box();
    let motion = sway(&mesh);
    for elements in ALL {
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
            if elements.1 == Order::Linear {
                // A model on a mesh that has moved finds the conductor's walls connected still.
                model.enriched(&displaced(&mesh, &motion.1, 1e-6), Effort::Any).expect("a sound problem");
            }
            derivatives_match(&model, &mesh, &functionals, (&motion.0, &motion.1, 1e-6));
        }
    }
}

/// The current through every section of the bar is the net current: `J` of first order is linear, and its divergence is tested by
/// all linear functions.
#[test]
fn the_net_current_passes_every_section() {
    let mesh = bar_in_a_box();
    let bar = mesh.topology().elements_of(mesh.topology().region("bar").expect("a region"));
    for elements in [ALL[2], ALL[0]] {
        let model = with_a_bar(&mesh, elements, 2000.0, (100.0, NO_CIRCUIT));
        let (state, _) = model.solve(&mesh).expect("a field");
        let densities = state.current_densities_of(&model, &mesh, &bar);
        let mut through = [c64::default(); 6];
        for (&e, density) in bar.iter().zip(densities) {
            let vertices = mesh.vertices(e);
            let slab = (centroid(vertices)[0] / 5e-3) as usize;
            through[slab] += volume(vertices) / 5e-3 * density[0];
        }
        for current in through {
            assert!((current - 100.0).norm() < 1e-8, "{elements:?}: {through:?}");
        }
    }
}

/// The estimated error of resistance, inductance and loss of first order against second order on the same mesh.
#[test]
fn the_error_of_a_bar_is_estimated() {
    let mesh = bar_in_a_box();
    for family in [ElementFamily::Edge, ElementFamily::Nodal] {
        let of = |order| setup_with_a_bar(&mesh, (family, order), 300.0, (100.0, NO_CIRCUIT));
        let model = with_a_bar(&mesh, (family, Order::Linear), 300.0, (100.0, NO_CIRCUIT));
        let functional = Functional::at_terminals(&model, "bar", AtTerminals::Voltage).expect("a winding");
        let [coarse, estimated, _] = estimate(&mesh, &of(Order::Linear), &functional);
        let error = value(&mesh, &of(Order::Quadratic), &functional) - coarse;
        println!("{family:?}: {estimated:e} of {error:e}");
        // Both corrections are solved for to a thousandth.
        assert!((estimated / error - 1.0).abs() < 0.01, "{family:?}: {estimated} {error}");
    }
}

/// What has no meaning says so, and what to do.
#[test]
fn solid_conductors_that_cannot_be_are_refused() {
    let mesh = bar_in_a_box();
    let sound = with_a_bar(&mesh, ALL[2], 300.0, (100.0, NO_CIRCUIT)).setup().clone();
    type Change = fn(&mut FieldModelSetup);
    for (change, expected) in [
        ((|own| own.boundaries = flux_parallel(&["x_min", "x_max"])) as Change, "nothing connects"),
        (|own| own.materials[0] = METAL, "another conductor touches it"),
        (|own| (own.materials[0], own.frequency) = (METAL, 0.0), "another conductor touches it"),
        (|own| own.materials[1] = Material::AIR, "the same positive number in all of its elements"),
        (|own| own.coils.push(own.coils[0].clone()), "the coil `bar` is of the same elements"),
    ] {
        let mut setup = sound.clone();
        change(&mut setup);
        let said = FieldModel::new(&mesh, setup).expect_err("it is refused").to_string();
        assert!(said.contains(expected), "{said}");
    }
}

/// Two bars as one region: in series they need the sum of their voltages, in parallel they take the sum of their currents.
#[test]
fn parts_of_a_conductor_are_in_series_or_in_parallel() {
    let mesh = bar_in_a_box();
    let bars = ["bar", "winding"];
    let solve = |coils: Vec<Coil>, voltage: Option<c64>, frequency: f64| {
        let setup = FieldModelSetup {
            frequency,
            materials: vec![Material::AIR, METAL, METAL, METAL],
            windings: vec![Some(Winding { voltage, ..NO_CIRCUIT }); coils.len()],
            coils,
            boundaries: flux_parallel(&OUTSIDE),
            linear_solver: LinearSolverSettings { tolerance: 1e-13, ..LinearSolverSettings::default() },
            ..FieldModelSetup::default()
        };
        let (model, state) = solved(&mesh, setup);
        terminals((&model, &mesh, &state)).expect("terminals").coils
    };
    let topology = mesh.topology();
    let both: Vec<ElementId> =
        bars.iter().flat_map(|name| topology.elements_of(topology.region(name).expect("a region"))).collect();
    let path = Path::Terminals { from: terminal(&mesh, "x_min"), to: terminal(&mesh, "x_max") };
    let joined = |connection| {
        let shape =
            SolidConductor::new(&mesh, "both", &both, (&path, connection)).expect("a conductor").into();
        vec![Coil { name: "both".to_owned(), ampere_turns: c64::from(10.0), shape }]
    };
    let apart = || bars.map(|name| coil(&mesh, name, ["x_min", "x_max"], 10.0)).to_vec();
    for frequency in [0.0, 400.0] {
        let series = &solve(joined(Connection::Series), None, frequency)[0];
        let voltage: c64 = solve(apart(), None, frequency).iter().map(|coil| coil.voltage).sum();
        assert!(
            (series.voltage - voltage).norm() < 1e-9 * voltage.norm(),
            "{frequency}: {series:?} {voltage}"
        );
        let driven = &solve(joined(Connection::Series), Some(voltage), frequency)[0];
        assert!((driven.current - 10.0).norm() < 1e-8, "{frequency}: {driven:?}");
        let parallel = &solve(joined(Connection::Parallel), None, frequency)[0];
        let currents = solve(apart(), Some(parallel.voltage), frequency);
        let current: c64 = currents.iter().map(|coil| coil.current).sum();
        assert!((current - 10.0).norm() < 1e-8, "{frequency}: {current}");
    }
}

/// A load case that shares the matrix of another has the state of a model made for it: with the current of the bar given and not,
/// with harmonics and at rest.
#[test]
fn load_cases_of_a_bar_are_those_of_models_of_their_own() {
    let mesh = bar_in_a_box();
    let volt = c64::new(0.02, 0.0);
    let driven = Winding { voltage: Some(volt), ..NO_CIRCUIT };
    let seen = |model: &FieldModel, state: &FieldSolution| {
        let of = |coil: CoilTerminals| [coil.current, coil.voltage];
        let coils = terminals((model, &mesh, state)).expect("terminals").coils;
        coils.into_iter().flat_map(of).collect::<Vec<_>>()
    };
    for frequency in [0.0, 300.0] {
        let first = with_a_bar(&mesh, ALL[2], frequency, (100.0, NO_CIRCUIT));
        let mut case = first.load_case();
        case.drives[0] = Drive::Voltage(volt);
        let second = first.at_load_case(&mesh, &case).expect("a model");
        let (_, system) = first.solve(&mesh).expect("a field");
        let mut system = second.take_over(system).expect("the responses of the case");
        let state = second.solve_prepared(&mut system, &second.load(&mesh)).expect("a field");
        let own = with_a_bar(&mesh, ALL[2], frequency, (0.0, driven));
        let (expected, _) = own.solve(&mesh).expect("a field");
        for (a, b) in seen(&second, &state).iter().zip(&seen(&own, &expected)) {
            assert!((a - b).norm() <= 1e-9 * b.norm(), "{frequency}: {a} {b}");
        }
    }
}
