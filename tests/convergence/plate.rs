//! An infinite conducting plate between a circular coil and a point on its axis.
//!
//! A racetrack whose corners are as round as its window is square is a circle. A quarter of the space: two flux-parallel
//! symmetry planes, which all currents cross at right angles. The plate ends on the outer faces, ten coil radii away,
//! flux-parallel too. The coil has a cross-section; it is small enough to be a filament at its mean radius to 0.1 %.

use fluxmorph_geometry::fem::c64;
use fluxmorph_geometry::generate::grading::{Fine, Growth, growing, uniform};
use fluxmorph_solver::coil::{Coil, Corner, Racetrack};
use fluxmorph_solver::recovery::probe;
use fluxmorph_solver::{Boundary, FieldModel, FieldModelSetup, Material};

use crate::meshes::{FACES, boxed};
use crate::references::{named, number, reference};

/// Side of the coil's square cross-section [m].
const WINDING: f64 = 0.008;
/// Where the plate begins, above the middle of the coil [m].
const PLATE: f64 = 0.05;
const OUTER: f64 = 1.0;

/// Lines that grow from `start`, the first cell of `first`.
fn outwards(start: f64, end: f64, first: f64, ratio: f64, fine: Fine) -> Vec<f64> {
    let growth = Growth { first, ratio, largest: f64::INFINITY };
    growing("outside", &[start, end], fine, growth).expect("lines")
}

/// Lines of neighbouring intervals, joined.
fn joined(parts: &[Vec<f64>]) -> Vec<f64> {
    let mut lines = parts[0].clone();
    for part in &parts[1..] {
        lines.extend(&part[1..]);
    }
    lines
}

/// `B_z` [T] behind a plate, and the closed form.
fn behind(name: &str) -> (c64, c64) {
    let file = reference("plate.json");
    let plate = named(&file["plates"], name);
    let (radius, distance) = (number(&file, "radius_m"), number(&file, "distance_m"));
    let thickness = number(plate, "thickness_m");
    let material = Material {
        relative_permeability: number(plate, "relative_permeability"),
        conductivity: number(plate, "conductivity_S_per_m"),
    };
    let exact = plate["flux_density_T"].as_array().expect("two numbers");
    let exact = c64::new(exact[0].as_f64().expect("a number"), exact[1].as_f64().expect("a number"));

    let across = joined(&[
        uniform("coil", [0.0, 0.14], 0.0117).expect("lines"),
        outwards(0.14, OUTER, 0.015, 1.5, Fine::Start),
    ]);
    let top = PLATE + thickness;
    let along = joined(&[
        outwards(-OUTER, -0.03, 0.015, 1.6, Fine::End),
        uniform("coil", [-0.03, PLATE], 0.01).expect("lines"),
        uniform("plate", [PLATE, top], thickness / 8.0).expect("lines"),
        uniform("behind", [top, distance + 0.03], 0.009).expect("lines"),
        outwards(distance + 0.03, OUTER, 0.015, 1.6, Fine::Start),
    ]);
    let (_, mesh) = boxed([across.clone(), across, along], &["air", "plate"], |[_, _, z]| {
        u32::from(z > PLATE && z < top)
    });
    let window = radius - 0.5 * WINDING;
    let corner = Corner::Round { inner_radius: window };
    let shape = Racetrack::new([0.0; 3], 2, [window; 2], WINDING, WINDING, corner).expect("a coil");
    let setup = FieldModelSetup {
        frequency: number(plate, "frequency_Hz"),
        penalty: 1.0,
        materials: vec![Material::AIR, material],
        impedance_surfaces: Vec::new(),
        coils: vec![Coil { name: "loop".to_owned(), ampere_turns: c64::from(1.0), shape }],
        boundaries: FACES.map(|face| (face.to_owned(), Boundary::FluxParallel)).to_vec(),
        ..FieldModelSetup::default()
    };
    let model = FieldModel::new(&mesh, setup).expect("a sound problem");
    let (solution, _) = model.solve(&mesh).expect("it converges");
    let field =
        probe(&solution, &model, &mesh, "axis", &[[0.0, 0.0, distance]]).expect("a point of the mesh");
    println!("    {name}: {} tets, {} unknowns", mesh.topology().tets().len(), model.unknown_count());
    (field[0][2], exact)
}

#[test]
fn the_field_behind_an_infinite_plate_is_the_closed_form() {
    for name in ["10 mm, mu_r = 1", "19 mm aluminium"] {
        let (computed, exact) = behind(name);
        let error = (computed - exact).norm() / exact.norm();
        println!("    {name}: {computed:.5e} T, closed form {exact:.5e} T, {:.2} %", 100.0 * error);
        // The plate is 0.4 and 1.6 skin depths thick; cells of 10 mm around a coil of 100 mm leave about one per cent.
        assert!(error < 0.02, "{name}: {error}");
    }
}
