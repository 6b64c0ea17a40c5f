//! Forces on coils against closed forms: two coaxial coils, and a coil over an iron half space.
//!
//! The body is the air that holds a winding: nothing inside it is deformed, so that the force is that on the current. Coaxial
//! loops with the radii `a` and `b` at the distance `z` attract each other by `−I J dM/dz`,
//! `dM/dz = −½ μ0 a b z ∫ cos φ (a² + b² + z² − 2ab cos φ)^(−3/2) dφ` over the circle (Neumann's formula; Jackson, Classical
//! Electrodynamics, section 5.17, has the image of a current in a half space of permeability μr, `(μr − 1)/(μr + 1)` as large).

use fluxmorph_geometry::Mesh;
use fluxmorph_geometry::fem::c64;
use fluxmorph_geometry::generate::{BoxRegion, BoxesParameters, boxes};
use fluxmorph_solver::coil::{Coil, Frame, Racetrack};
use fluxmorph_solver::material::VACUUM_PERMEABILITY;
use fluxmorph_solver::{
    Boundary, ElementFamily, FieldModel, FieldModelSetup, FieldSolution, Functional, Material, Order,
    RigidMotion,
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

/// The force of attraction [N] of two such coils with currents in the same sense, `2 HEIGHT` apart.
fn exact() -> f64 {
    let [inner, width, height] = WINDING;
    let (n, angles) = (6, 240);
    let part = |i: usize, size: f64| size * ((i as f64 + 0.5) / n as f64 - 0.5);
    let filaments: Vec<[f64; 2]> =
        (0..n * n).map(|k| [inner + 0.5 * width + part(k / n, width), part(k % n, height)]).collect();
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

fn solved(
    mesh: &Mesh,
    coils: Vec<Coil>,
    (family, order): (ElementFamily, Order),
) -> (FieldModel, FieldSolution) {
    let surfaces = ["x_min", "y_min", "x_max", "y_max", "z_min", "z_max"];
    let material = |name: &String| {
        let relative_permeability = if name == "iron" { PERMEABILITY } else { 1.0 };
        Material { relative_permeability, conductivity: 0.0 }
    };
    let setup = FieldModelSetup {
        family,
        order,
        materials: mesh.topology().region_names().iter().map(material).collect(),
        coils,
        boundaries: surfaces.map(|surface| (surface.to_owned(), Boundary::FluxParallel)).to_vec(),
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
    4.0 * force.evaluate(model, mesh, solution).expect("finite").value
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
