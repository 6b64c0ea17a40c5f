//! An infinite conducting plate between a circular coil and a point on its axis.
//!
//! A racetrack whose corners are as round as its window is square is a circle. A quarter of the space: two flux-parallel
//! symmetry planes, which all currents cross at right angles. The plate ends on the outer faces, ten coil radii away,
//! flux-parallel too. The coil has a cross-section; it is small enough to be a filament at its mean radius to 0.1 %.

use fluxmorph_geometry::fem::c64;
use fluxmorph_geometry::generate::grading::{Fine, Growth, growing, uniform};
use fluxmorph_solver::coil::{Coil, Corner, Racetrack};
use fluxmorph_solver::recovery::probe;
use fluxmorph_solver::{Boundary, FieldModel, FieldModelSetup, Material, Order};

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

/// How fine a mesh is, and on what elements.
#[derive(Clone, Copy)]
struct Resolution {
    order: Order,
    /// Cell size over that of the mesh described above.
    size: f64,
    /// Layers through the plate.
    layers: f64,
    /// Half width of the box [m].
    outer: f64,
}

/// `B_z` [T] behind a plate, and the closed form.
fn behind(name: &str, resolution: Resolution) -> (c64, c64) {
    let Resolution { order, size, layers, outer } = resolution;
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
        uniform("coil", [0.0, 0.14], 0.0117 * size).expect("lines"),
        outwards(0.14, outer, 0.015 * size, 1.5, Fine::Start),
    ]);
    let top = PLATE + thickness;
    let along = joined(&[
        outwards(-outer, -0.03, 0.015 * size, 1.6, Fine::End),
        uniform("coil", [-0.03, PLATE], 0.01 * size).expect("lines"),
        uniform("plate", [PLATE, top], thickness / layers).expect("lines"),
        uniform("behind", [top, distance + 0.03], 0.009 * size).expect("lines"),
        outwards(distance + 0.03, outer, 0.015 * size, 1.6, Fine::Start),
    ]);
    let (_, mesh) = boxed([across.clone(), across, along], &["air", "plate"], |[_, _, z]| {
        u32::from(z > PLATE && z < top)
    });
    let window = radius - 0.5 * WINDING;
    let corner = Corner::Round { inner_radius: window };
    let shape = Racetrack::new([0.0; 3], 2, [window; 2], WINDING, WINDING, corner).expect("a coil");
    let setup = FieldModelSetup {
        frequency: number(plate, "frequency_Hz"),
        order,
        materials: vec![Material::AIR, material],
        coils: vec![Coil { name: "loop".to_owned(), ampere_turns: c64::from(1.0), shape: shape.into() }],
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
#[ignore]
fn explore() {
    for (name, order, size, layers, outer) in [
        ("10 mm, static, mu_r = 800", Order::Linear, 1.0, 8.0, 1.0),
        ("10 mm, static, mu_r = 800", Order::Quadratic, 1.6, 2.0, 1.0),
        ("10 mm, static, mu_r = 800", Order::Quadratic, 1.6, 2.0, 3.0),
        ("10 mm, static, mu_r = 800", Order::Quadratic, 1.6, 2.0, 10.0),
        ("10 mm, static, mu_r = 800", Order::Linear, 1.6, 2.0, 10.0),
        ("10 mm, mu_r = 1", Order::Linear, 1.6, 2.0, 1.0),
        ("10 mm, mu_r = 1", Order::Quadratic, 1.6, 2.0, 1.0),
        ("19 mm aluminium", Order::Linear, 1.6, 4.0, 1.0),
        ("19 mm aluminium", Order::Quadratic, 1.6, 4.0, 1.0),
        ("19 mm aluminium, 200 Hz", Order::Quadratic, 1.6, 6.0, 1.0),
        ("5 mm steel", Order::Quadratic, 1.6, 8.0, 1.0),
    ] {
        let clock = std::time::Instant::now();
        let (computed, exact) = behind(name, Resolution { order, size, layers, outer });
        println!(
            "    {name} {order:?} {size} {layers} {outer}: {computed:.5e} T, closed form {exact:.5e} T, {:.2} %  {:.1} s",
            100.0 * (computed - exact).norm() / exact.norm(),
            clock.elapsed().as_secs_f64()
        );
    }
}
