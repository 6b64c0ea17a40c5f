//! Coils as parts of circuits: inductances against filaments, voltages against currents.

use std::f64::consts::PI;

use fluxmorph_geometry::Mesh;
use fluxmorph_geometry::fem::c64;
use fluxmorph_geometry::generate::{BlockParameters, OpenShellParameters, block, open_shell};
use fluxmorph_geometry::tet4::Point;
use fluxmorph_solver::circuit::terminals;
use fluxmorph_solver::coil::{Coil, Corner, Frame, Racetrack};
use fluxmorph_solver::functional::{Follow, MirrorPlane, Multipoles};
use fluxmorph_solver::material::VACUUM_PERMEABILITY;
use fluxmorph_solver::multipole::{Expansion, Harmonic};
use fluxmorph_solver::{
    ElementFamily, FieldModel, FieldModelSetup, Functional, Material, OpenRegion, Order, Winding,
};

use super::{NO_CIRCUIT, coarse_shield, flux_parallel, over_a_plate};

/// Complete elliptic integrals `K(m)` and `E(m)` by the arithmetic-geometric mean (Abramowitz and Stegun, 17.6).
fn elliptic(m: f64) -> (f64, f64) {
    let (mut a, mut b, mut sum, mut power) = (1.0f64, (1.0 - m).sqrt(), 0.5 * m, 0.5);
    while (a - b).abs() > 1e-15 * a {
        let c = 0.5 * (a - b);
        (a, b) = (0.5 * (a + b), (a * b).sqrt());
        power *= 2.0;
        sum += power * c * c;
    }
    let k = 0.5 * PI / a;
    (k, k * (1.0 - sum))
}

/// Maxwell's mutual inductance [H] of coaxial circles of radii `a` and `b` at the distance `d` [m].
fn mutual(a: f64, b: f64, d: f64) -> f64 {
    let m = 4.0 * a * b / ((a + b).powi(2) + d * d);
    let (k, e) = elliptic(m);
    VACUUM_PERMEABILITY * (a * b).sqrt() * ((2.0 / m.sqrt() - m.sqrt()) * k - 2.0 / m.sqrt() * e)
}

/// The mean over all pairs of filaments of two sections of one width and height [m]; filaments by their places in the section, each
/// with the geometric mean distance of its cell from itself, 0.2235 of width plus height (Grover, Inductance Calculations, 1946).
fn of_filaments([width, height]: [f64; 2], pair: impl Fn([f64; 2], [f64; 2], f64) -> f64) -> f64 {
    // Cells that are about square; of a thin sheet more, whose neighbours are not as far apart as their middles.
    let along = if width < 0.05 * height { 150.0 } else { 20.0 };
    let count = |side: f64| (along * side / width.max(height)).ceil() as usize;
    let counts = [count(width), count(height)];
    let place = |i: usize, d: usize| ((i as f64 + 0.5) / counts[d] as f64 - 0.5) * [width, height][d];
    let cells = || (0..counts[0]).flat_map(|i| (0..counts[1]).map(move |j| [place(i, 0), place(j, 1)]));
    let own = 0.2235 * (width / counts[0] as f64 + height / counts[1] as f64);
    let sum: f64 = cells().flat_map(|p| cells().map(move |q| (p, q))).map(|(p, q)| pair(p, q, own)).sum();
    sum / ((counts[0] * counts[1]) as f64).powi(2)
}

/// Inductance [H] per turn squared of two coaxial rings at the distance `d`; of one where they coincide.
fn of_rings([a, b]: [f64; 2], section: [f64; 2], d: f64) -> f64 {
    of_filaments(section, |[r, z], [s, y], own| {
        let (distance, radius) = (d + z - y, a + r);
        if distance == 0.0 && radius == b + s {
            VACUUM_PERMEABILITY * radius * ((8.0 * radius / own).ln() - 2.0)
        } else {
            mutual(radius, b + s, distance)
        }
    })
}

/// The same of coaxial rectangles of half sizes `a` and `b`: of Neumann's integral over parallel sides, `x asinh(x/d) − √(x² + d²)`.
fn of_rectangles([a, b]: [[f64; 2]; 2], section: [f64; 2], d: f64) -> f64 {
    let parallel = |l: f64, m: f64, d: f64| {
        let g = |x: f64| x * (x / d).asinh() - x.hypot(d);
        VACUUM_PERMEABILITY / (2.0 * PI) * (g(l + m) - g(l - m))
    };
    of_filaments(section, |[r, z], [s, y], own| {
        let (a, b) = (a.map(|c| c + r), b.map(|c| c + s));
        let sides = [(0, 1), (1, 0)].map(|(across, along)| {
            let beside = (a[across] - b[across]).hypot(d + z - y).max(own);
            let opposite = (a[across] + b[across]).hypot(d + z - y);
            parallel(a[along], b[along], beside) - parallel(a[along], b[along], opposite)
        });
        2.0 * (sides[0] + sides[1])
    })
}

/// The middle of the block in which coils lie [m].
const MIDDLE: Point = [0.0, 0.0, 0.06];

/// A quarter of coils around the axis of a block in open space, with turns and ampere-turns of each.
fn in_open_space(coils: Vec<(Racetrack, f64, f64)>, cells: usize) -> (Mesh, FieldModel) {
    // The block stands on z = 0.
    let parameters =
        BlockParameters { size: [0.075, 0.075, 2.0 * MIDDLE[2]], cells: [cells, cells, 2 * cells] };
    let half = block(&parameters).expect("a box");
    let surfaces = ["x_max", "y_max", "z_min", "z_max"].map(str::to_owned).to_vec();
    let shell = OpenShellParameters {
        surfaces,
        centre: MIDDLE,
        layers: 4,
        region: "open".into(),
        outer: "infinity".into(),
    };
    let mesh = open_shell(&half, &shell).expect("a shell");
    let winding = |coil: &(Racetrack, f64, f64)| Some(Winding { turns: coil.1, ..NO_CIRCUIT });
    let setup = FieldModelSetup {
        family: ElementFamily::Edge,
        order: Order::Quadratic,
        materials: vec![Material::AIR; 2],
        windings: coils.iter().map(winding).collect(),
        coils: (0..)
            .zip(coils)
            .map(|(k, (shape, _, ampere_turns))| Coil {
                name: format!("coil {k}"),
                ampere_turns: c64::from(ampere_turns),
                shape: shape.into(),
            })
            .collect(),
        boundaries: flux_parallel(&["x_min", "y_min", "infinity"]),
        open: Some(OpenRegion { region: mesh.topology().region("open").expect("the shell"), centre: MIDDLE }),
        ..FieldModelSetup::default()
    };
    let model = FieldModel::new(&mesh, setup).expect("a sound problem");
    (mesh, model)
}

/// A round coil at a height over the middle.
fn ring(radius: f64, [width, height]: [f64; 2], z: f64) -> Racetrack {
    let frame = Frame::new([0.0, 0.0, MIDDLE[2] + z], [0.0, 0.0, 1.0], None).expect("a frame");
    Racetrack::circular(frame, radius - 0.5 * width, width, height).expect("a coil")
}

/// Two coaxial coils of square section at `z = ±d/2`.
fn two_coils(radii: [f64; 2], side: f64, d: f64, cells: usize) -> (Mesh, FieldModel) {
    let [one, two] = [0, 1].map(|k| ring(radii[k], [side; 2], [0.5 * d, -0.5 * d][k]));
    in_open_space(vec![(one, 10.0, 7.0), (two, 4.0, 3.0)], cells)
}

/// `L` of a solenoid and `L` and `M` of a pair of racetracks to 1 %; the filaments of a thin solenoid have the inductance of its
/// current sheet.
#[test]
fn inductances_of_a_solenoid_and_of_racetracks_are_those_of_their_filaments() {
    let (radius, height): (f64, f64) = (0.03, 0.06);
    // Lorenz's formula, by the modulus of the two ends.
    let k = 2.0 * radius / (2.0 * radius).hypot(height);
    let (first, second) = elliptic(k * k);
    let sheet = 8.0 * VACUUM_PERMEABILITY * radius.powi(3) / (3.0 * height * height)
        * (((2.0 * k * k - 1.0) * second + (1.0 - k * k) * first) / k.powi(3) - 1.0);
    // Filaments of a hundredth of the length.
    let thin = of_rings([radius; 2], [1e-4, height], 0.0);
    println!("current sheet {sheet:e}, its filaments {:.2e} more", thin / sheet - 1.0);
    assert!((thin / sheet - 1.0).abs() < 5e-3);

    let matrix = |coils: Vec<(Racetrack, f64, f64)>| {
        let (mesh, model) = in_open_space(coils, 8);
        let (solution, _) = model.solve(&mesh).expect("it is solved");
        terminals((&model, &mesh, &solution)).expect("they are solved for").inductance
    };
    let check = |what: &str, found: f64, exact: f64| {
        println!("{what}: {found:e} H, filaments {exact:e} H, {:+.2} %", 100.0 * (found / exact - 1.0));
        assert!((found / exact - 1.0).abs() < 0.01, "{what}: {found} {exact}");
    };
    // A quarter is meshed.
    let section = [0.012, height];
    let solenoid = matrix(vec![(ring(radius, section, 0.0), 20.0, 1.0)]);
    check("solenoid", solenoid[0][0], 0.25 * 400.0 * of_rings([radius; 2], section, 0.0));

    let (windows, side, d) = ([[0.02, 0.035], [0.014, 0.03]], 0.014, 0.04);
    let racetrack = |k: usize| {
        let place = [0.0, 0.0, MIDDLE[2] + [0.5 * d, -0.5 * d][k]];
        Racetrack::new(place, 2, windows[k], side, side, Corner::Mitred).expect("a racetrack")
    };
    let turns = [10.0, 4.0];
    let pair = matrix(vec![(racetrack(0), turns[0], 1.0), (racetrack(1), turns[1], 2.0)]);
    for (j, k, distance) in [(0, 0, 0.0), (1, 1, 0.0), (0, 1, d)] {
        let middles = [j, k].map(|i: usize| windows[i].map(|c| c + 0.5 * side));
        let exact = 0.25 * turns[j] * turns[k] * of_rectangles(middles, [side; 2], distance);
        check(&format!("racetracks {j} {k}"), pair[j][k], exact);
    }
    assert!((pair[0][1] / pair[1][0] - 1.0).abs() < 1e-9);
}

/// `L` and `M` of coaxial coils to 1 %, the matrix symmetric to 1e-9, `½ I L I` the energy of the field to 1e-8, and the flux
/// linkages of the state those of the matrix.
#[test]
fn inductances_of_coaxial_coils_are_those_of_their_filaments() {
    let (radii, side, d) = ([0.045, 0.035], 0.014, 0.04);
    let (mesh, model) = two_coils(radii, side, d, 8);
    let (solution, _) = model.solve(&mesh).expect("it is solved");
    let seen = terminals((&model, &mesh, &solution)).expect("they are solved for");
    let matrix = &seen.inductance;
    let turns = [10.0, 4.0];
    // A quarter is meshed.
    for (j, k, distance) in [(0, 0, 0.0), (1, 1, 0.0), (0, 1, d)] {
        let exact = 0.25 * turns[j] * turns[k] * of_rings([radii[j], radii[k]], [side; 2], distance);
        let deviation = matrix[j][k] / exact - 1.0;
        assert!(deviation.abs() < 0.01, "{j} {k}: {} and {exact}", matrix[j][k]);
    }
    assert!((matrix[0][1] / matrix[1][0] - 1.0).abs() < 1e-9);
    let currents: Vec<f64> = seen.coils.iter().map(|coil| coil.current.re).collect();
    let pairs = [(0, 0), (0, 1), (1, 0), (1, 1)];
    let energy: f64 = pairs.iter().map(|&(j, k)| 0.5 * currents[j] * matrix[j][k] * currents[k]).sum();
    let field = Functional::energy(&model, None).expect("an energy");
    let field = field.evaluate((&model, &mesh, &solution)).expect("finite").value;
    assert!((energy / field - 1.0).abs() < 1e-8, "{energy} {field}");
    let linkage = matrix[0][0] * currents[0] + matrix[0][1] * currents[1];
    assert!((seen.coils[0].flux_linkage.re / linkage - 1.0).abs() < 1e-9);
}

/// The field along the axis of two coils in a ball between them, against the Gegenbauer series of their filaments.
#[test]
fn spherical_harmonics_between_two_coils_are_those_of_their_filaments() {
    let (radii, side, d) = ([0.045, 0.035], 0.014, 0.04);
    let (mesh, model) = two_coils(radii, side, d, 8);
    let (solution, _) = model.solve(&mesh).expect("it is solved");
    let (centre, radius, order) = ([0.0, 0.0, 0.06], 0.012, 3);
    let frame = Frame::new(centre, [0.0, 0.0, 1.0], None).expect("a frame");
    let planes = [0, 1].map(|axis| MirrorPlane { axis, at: 0.0, across: -1.0 });
    let expansion = Expansion::ball(&frame, radius, order);
    let multipoles =
        Multipoles::new(&model, &mesh, "ball", &expansion, (&planes, Follow::Held)).expect("inside");
    // B_z on the axis of a circle of radius a at the distance h: μ0 I a²/(2 s³) Σ (z/s)^n C_n(h/s), s² = a² + h².
    let series = |n: usize, a: f64, h: f64| {
        let s = a.hypot(h);
        let x = h / s;
        let (mut before, mut value) = (0.0, 1.0);
        for k in 1..=n {
            let next = ((2 * k + 1) as f64 * x * value - (k + 1) as f64 * before) / k as f64;
            (before, value) = (value, next);
        }
        0.5 * VACUUM_PERMEABILITY * a * a / s.powi(3) * (radius / s).powi(n as i32) * value
    };
    let parts = 20;
    let place = |i: usize| ((i as f64 + 0.5) / f64::from(parts) - 0.5) * side;
    let winding = |n: usize, a: f64, h: f64| {
        let cells = (0..parts as usize).flat_map(|i| (0..parts as usize).map(move |j| (i, j)));
        cells.map(|(i, j)| series(n, a + place(i), h + place(j))).sum::<f64>() / f64::from(parts * parts)
    };
    let found = multipoles.coefficients((&model, &mesh, &solution)).expect("nothing moves");
    let main = found[0].1.re;
    for (term, value) in found {
        let exact = match term {
            Harmonic::Cosine(n, 0) => {
                7.0 * winding(n, radii[0], 0.5 * d) + 3.0 * winding(n, radii[1], -0.5 * d)
            }
            _ => 0.0,
        };
        println!("{term:?}: {:.6e}, exact {exact:.6e}", value.re);
        // A quarter of a percent of the main field: a cell is as long as the radius, and what is recovered is linear.
        assert!((value.re - exact).abs() < 0.0025 * main, "{term:?}: {value} {exact}");
    }
}

fn wound_over_a_plate(mesh: &Mesh, winding: Winding, ampere_turns: f64) -> FieldModel {
    let plate = Material { relative_permeability: 1.0, conductivity: 3e7 };
    let order = Order::Linear;
    let windings = vec![Some(winding)];
    let setup = FieldModelSetup { order, windings, ..over_a_plate(mesh, plate, ampere_turns, 60.0) };
    FieldModel::new(mesh, setup).expect("a sound problem")
}

/// The voltage that a current needs over a conducting plate drives that current, its field and its losses, to 1e-9; the power
/// that goes in is what is lost.
#[test]
fn a_voltage_drives_the_current_that_needs_it() {
    let mesh = coarse_shield();
    let winding = Winding { turns: 50.0, resistance: 0.02, ..NO_CIRCUIT };
    let given = wound_over_a_plate(&mesh, winding, 1000.0);
    let (state, _) = given.solve(&mesh).expect("it is solved");
    let by_current = terminals((&given, &mesh, &state)).expect("solved").coils[0].clone();
    let series = Winding { series_inductance: 3e-5, series_capacitance: Some(0.1), ..winding };
    let omega = given.angular_frequency();
    let source = by_current.voltage + (series.impedance(omega) - winding.resistance) * by_current.current;
    let driven = wound_over_a_plate(&mesh, Winding { voltage: Some(source), ..series }, 0.0);
    let (by_voltage_state, _) = driven.solve(&mesh).expect("it is solved");
    let by_voltage = terminals((&driven, &mesh, &by_voltage_state)).expect("solved").coils[0].clone();
    for (a, b) in [
        (by_current.current, by_voltage.current),
        (by_current.flux_linkage, by_voltage.flux_linkage),
        (by_current.voltage, by_voltage.voltage),
    ] {
        assert!((a - b).norm() < 1e-9 * a.norm(), "{a} {b}");
    }
    let losses = [&given, &driven].map(|model| {
        let solution = if std::ptr::eq(model, &given) { &state } else { &by_voltage_state };
        solution.losses(model, &mesh)[0].1
    });
    assert!((losses[0] / losses[1] - 1.0).abs() < 1e-9);
    // ½ Re(V I*) = losses in the plate and in the wire; the solver's residual is 1e-9 or better.
    let power = 0.5 * (by_voltage.voltage * by_voltage.current.conj()).re;
    let wire = 0.5 * winding.resistance * by_voltage.current.norm_sqr();
    assert!((power / (losses[1] + wire) - 1.0).abs() < 1e-7, "{power} {losses:?} {wire}");
    let resistance = by_voltage.resistance.expect("all is linear");
    assert!((resistance / (2.0 * (losses[1] + wire) / by_voltage.current.norm_sqr()) - 1.0).abs() < 1e-7);
}
