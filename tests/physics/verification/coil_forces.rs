//! Forces on coils against closed forms: two coaxial coils, and a coil over a half space of iron or of a conductor.
//!
//! The body is the air that holds a winding: nothing inside it is deformed, so that the force is that on the current. Coaxial
//! loops with the radii `a` and `b` at the distance `z` attract each other by `−I J dM/dz`,
//! `dM/dz = −½ μ0 a b z ∫ cos φ (a² + b² + z² − 2ab cos φ)^(−3/2) dφ` over the circle (Neumann's formula; Jackson, Classical
//! Electrodynamics, section 5.17, has the image of a current in a half space of permeability μr, `(μr − 1)/(μr + 1)` as large).
//! Over a conductor each wave `J1(kr) e^(−kz)` of the coil's field is reflected (Dodd and Deeds, J. Appl. Phys. 39 (1968) 2829).

use std::f64::consts::PI;

use fluxmorph_geometry::Mesh;
use fluxmorph_geometry::fem::c64;
use fluxmorph_geometry::generate::{BoxRegion, BoxesParameters, boxes};
use fluxmorph_solver::coil::{Coil, Frame, Racetrack};
use fluxmorph_solver::material::VACUUM_PERMEABILITY;
use fluxmorph_solver::{
    Boundary, Conductor, ElementFamily, FieldModel, FieldModelSetup, FieldSolution, Functional, Material,
    Order, RigidMotion, SurfaceLaw,
};

/// Inner radius, width and height of every winding [m].
const WINDING: [f64; 3] = [0.02, 0.004, 0.004];

/// From the middle of a coil to the plane between two of them, or to the iron [m].
const HEIGHT: f64 = 0.01;

/// In every coil [A].
const CURRENT: f64 = 1e3;

/// Of the half space.
const PERMEABILITY: f64 = 1000.0;

/// How far the mesh reaches [m]: thirteen mean radii.
const FAR: f64 = 0.29;

/// Filaments that stand for a winding: their radii and heights over its middle [m].
fn filaments() -> Vec<[f64; 2]> {
    let [inner, width, height] = WINDING;
    let n = 6;
    let part = |i: usize, size: f64| size * ((i as f64 + 0.5) / n as f64 - 0.5);
    (0..n * n).map(|k| [inner + 0.5 * width + part(k / n, width), part(k % n, height)]).collect()
}

/// The force of attraction [N] of two such coils with currents in the same sense, `2 HEIGHT` apart.
fn exact() -> f64 {
    let (filaments, angles) = (filaments(), 240);
    let mut sum = 0.0;
    for [a, lower] in &filaments {
        for [b, upper] in &filaments {
            let z = 2.0 * HEIGHT + upper - lower;
            // The mean over the circle is exact to the last digits.
            let mean = (0..angles)
                .map(|k| (std::f64::consts::TAU * f64::from(k) / f64::from(angles)).cos())
                .map(|cos| cos * (a * a + b * b + z * z - 2.0 * a * b * cos).powf(-1.5))
                .sum::<f64>()
                / f64::from(angles);
            sum += 0.5 * VACUUM_PERMEABILITY * a * b * z * std::f64::consts::TAU * mean;
        }
    }
    sum * CURRENT * CURRENT / (filaments.len() * filaments.len()) as f64
}

/// The mean force [N] that pushes the coil off a half space whose waves are reflected with a factor, under an amplitude of
/// `CURRENT`.
fn pushed_off(reflected: impl Fn(f64) -> c64) -> f64 {
    let filaments = filaments();
    // The mean over the circle is exact to the last digits.
    let bessel = |x: f64| {
        let angles = (0..240).map(|k| PI * (f64::from(k) + 0.5) / 240.0);
        angles.map(|angle| (angle - x * angle.sin()).cos()).sum::<f64>() / 240.0
    };
    let step = 2.0;
    let waves = (1..1000).map(|i| {
        let k = step * f64::from(i);
        let of_filament = |[radius, z]: &[f64; 2]| radius * bessel(k * radius) * (-k * (HEIGHT + z)).exp();
        let of_coil = filaments.iter().map(of_filament).sum::<f64>() / filaments.len() as f64;
        -reflected(k).re * k * of_coil * of_coil
    });
    0.5 * PI * VACUUM_PERMEABILITY * CURRENT * CURRENT * step * waves.sum::<f64>()
}

/// A quarter of one coil at `HEIGHT`, in air that is a body, in a sleeve of more air; below the plane z = 0 another coil alike,
/// or iron.
fn mesh(is_over_iron: bool) -> Mesh {
    let [inner, width, height] = WINDING;
    let free = [f64::INFINITY; 3];
    let holder = |name: &str, middle: f64, more: f64| {
        let reach = inner + width + 0.002 + more;
        let half = 0.5 * height + 0.002 + more;
        BoxRegion {
            name: name.to_owned(),
            corners: [[0.0, 0.0, middle - half], [reach, reach, middle + half]],
            size: [0.0042, 0.0042, 0.003],
            skin: free,
            cells: None,
        }
    };
    let mut regions = vec![holder("sleeve", HEIGHT, 0.004), holder("upper", HEIGHT, 0.0)];
    if is_over_iron {
        let corners = [[0.0, 0.0, -FAR], [FAR, FAR, 0.0]];
        let skin = [f64::INFINITY, f64::INFINITY, 0.003];
        regions.push(BoxRegion { corners, size: free, skin, ..holder("iron", 0.0, 0.0) });
    } else {
        regions.push(holder("lower", -HEIGHT, 0.0));
    }
    let parameters = BoxesParameters {
        corners: [[0.0, 0.0, -FAR], [FAR, FAR, FAR]],
        regions,
        sizes: Vec::new(),
        surfaces: Vec::new(),
        growth: 1.8,
        refinement: 1.0,
        division: None,
    };
    boxes(&parameters).expect("boxes within the box")
}

fn coil(name: &str, z: f64) -> Coil {
    let [inner, width, height] = WINDING;
    let frame = Frame::new([0.0, 0.0, z], [0.0, 0.0, 1.0], None).expect("a frame");
    let shape = Racetrack::circular(frame, inner, width, height).expect("a coil");
    Coil { name: name.to_owned(), ampere_turns: c64::from(CURRENT), shape: shape.into() }
}

fn solved(mesh: &Mesh, coils: Vec<Coil>, elements: (ElementFamily, Order)) -> (FieldModel, FieldSolution) {
    solved_beside(mesh, coils, elements, (0.0, Vec::new()))
}

/// The field beside conductors at a frequency [Hz].
fn solved_beside(
    mesh: &Mesh,
    coils: Vec<Coil>,
    (family, order): (ElementFamily, Order),
    (frequency, conductors): (f64, Vec<Conductor>),
) -> (FieldModel, FieldSolution) {
    // Below a half space that its surface stands for there is nothing.
    let walls = if conductors.is_empty() { 6 } else { 5 };
    let surfaces = &["x_min", "y_min", "x_max", "y_max", "z_max", "z_min"][..walls];
    let material = |name: &String| {
        let relative_permeability = if name == "iron" { PERMEABILITY } else { 1.0 };
        Material { relative_permeability, conductivity: 0.0 }
    };
    let setup = FieldModelSetup {
        family,
        order,
        materials: mesh.topology().region_names().iter().map(material).collect(),
        coils,
        boundaries: surfaces.iter().map(|name| ((*name).to_owned(), Boundary::FluxParallel)).collect(),
        frequency,
        conductors,
        ..FieldModelSetup::default()
    };
    let model = FieldModel::new(mesh, setup).expect("a sound problem");
    let (solution, _) = model.solve(mesh).expect("it converges");
    (model, solution)
}

/// Four times the force of the quarter along z on a body of some regions.
fn found(mesh: &Mesh, (model, solution): &(FieldModel, FieldSolution), names: &[&str]) -> f64 {
    let regions: Vec<_> =
        names.iter().map(|name| mesh.topology().region(name).expect("it is named")).collect();
    let motion = RigidMotion::Translation([0.0, 0.0, 1.0]);
    let force = Functional::force(model, mesh, names[0], &regions, motion).expect("a layer of air");
    4.0 * force.evaluate((model, mesh, solution)).expect("finite").value
}

const QUADRATIC: [(ElementFamily, Order); 2] =
    [(ElementFamily::Edge, Order::Quadratic), (ElementFamily::Nodal, Order::Quadratic)];

#[test]
fn coaxial_coils_attract_each_other_with_the_force_of_their_mutual_inductance_in_any_layer() {
    let (mesh, exact) = (mesh(false), exact());
    for elements in QUADRATIC {
        let field = solved(&mesh, vec![coil("upper", HEIGHT), coil("lower", -HEIGHT)], elements);
        let near = -found(&mesh, &field, &["upper"]);
        let far = -found(&mesh, &field, &["upper", "sleeve"]);
        let other = found(&mesh, &field, &["lower"]);
        println!(
            "{elements:?}: {near:.6} N, {far:.6} N further out, {other:.6} N on the other, exact {exact:.6} N"
        );
        for force in [near, far, other] {
            assert!((force / exact - 1.0).abs() < 0.01, "{elements:?}: {force} against {exact}");
        }
        assert!((near / far - 1.0).abs() < 0.01, "{elements:?}: two layers");
    }
}

#[test]
fn a_coil_and_an_iron_half_space_attract_each_other_as_the_coil_and_its_image_do() {
    let mesh = mesh(true);
    let exact = exact() * (PERMEABILITY - 1.0) / (PERMEABILITY + 1.0);
    let field = solved(&mesh, vec![coil("upper", HEIGHT)], QUADRATIC[0]);
    let near = -found(&mesh, &field, &["upper"]);
    let far = -found(&mesh, &field, &["upper", "sleeve"]);
    let on_the_iron = found(&mesh, &field, &["iron"]);
    println!("{near:.6} N, {far:.6} N further out, {on_the_iron:.6} N on the iron, exact {exact:.6} N");
    for force in [near, far, on_the_iron] {
        assert!((force / exact - 1.0).abs() < 0.01, "{force} against {exact}");
    }
}

/// The body is its surface alone, and what flows there is pushed as much as the coil.
#[test]
fn a_coil_and_the_surface_of_a_half_space_push_each_other_as_its_reflected_waves_say() {
    let frequency = 1e3;
    let angular_frequency = 2.0 * PI * frequency;
    let full = mesh(true);
    let half_space = full.topology().region("iron").expect("it is named");
    let (mesh, surface) = full.without_region(half_space).expect("what is left");
    let conductor = |relative_permeability: f64, skin_depth: f64| {
        let permeability = VACUUM_PERMEABILITY * relative_permeability;
        let conductivity = 2.0 / (angular_frequency * permeability * skin_depth * skin_depth);
        // Waves in the half space.
        let inside = move |k: f64| c64::new(k * k, 2.0 / (skin_depth * skin_depth)).sqrt();
        let reflected = move |k: f64| {
            let outside = c64::from(relative_permeability * k);
            (outside - inside(k)) / (outside + inside(k))
        };
        let law = SurfaceLaw::Impedance(Material { relative_permeability, conductivity });
        (law, frequency, pushed_off(reflected))
    };
    // Constant in time, so that the mean is twice that of an amplitude.
    let perfect = (SurfaceLaw::Perfect, 0.0, 2.0 * pushed_off(|_| c64::from(-1.0)));
    let (copper, iron) = (conductor(1.0, 1e-3), conductor(30.0, 0.3e-3));
    assert!((perfect.2 / exact() - 1.0).abs() < 1e-4, "{} against {} of the image", perfect.2, exact());
    let [edge, nodal] = QUADRATIC;
    for ((law, frequency, exact), elements) in
        [(perfect, edge), (copper, edge), (copper, nodal), (iron, edge), (iron, nodal)]
    {
        let conductors = vec![Conductor { name: "iron".to_owned(), surface: surface.clone(), law }];
        let coils = vec![coil("upper", HEIGHT)];
        let field = solved_beside(&mesh, coils, elements, (frequency, conductors));
        let near = found(&mesh, &field, &["upper"]);
        let on_the_surface = -found(&mesh, &field, &["iron"]);
        println!(
            "{law:?}, {elements:?}: {near:.6} N, {on_the_surface:.6} N on the surface, exact {exact:.6} N"
        );
        for force in [near, on_the_surface] {
            assert!((force / exact - 1.0).abs() < 0.01, "{law:?}, {elements:?}: {force} against {exact}");
        }
    }
}
