//! Coils in a field model: where they may meet the outside of the mesh, and two descriptions of one coil.

use crate::{ALL, OUTSIDE, flux_parallel, painted, terminal};
use fluxmorph_geometry::Mesh;
use fluxmorph_geometry::fem::c64;
use fluxmorph_geometry::generate::{ShieldParameters, shield};
use fluxmorph_solver::coil::{
    Coil, CoilShape, Condition, ConditionedSurface, Corner, Path, PlaneFault, Racetrack, RegionCurrent,
    SourceTerms, planes,
};
use fluxmorph_solver::material::VACUUM_PERMEABILITY;
use fluxmorph_solver::recovery::probe;
use fluxmorph_solver::{Boundary, ElementFamily, FieldModel, FieldModelSetup, Material, Order, SolverError};

/// The shield's coil with conditions of choice on the planes x = 0 and z = z_max.
fn model(x_min: Boundary, centre_z: f64) -> Result<FieldModel, SolverError> {
    let parameters =
        ShieldParameters { refinement: 0.25, skin: vec![], side_skin: vec![], ..ShieldParameters::default() };
    let mesh = shield(&parameters)?;
    let shape = Racetrack::new([0.0, 0.0, centre_z], 2, [0.06, 0.16], 0.02, 0.04, Corner::Mitred)?;
    let mut boundaries = flux_parallel(&OUTSIDE[1..]);
    boundaries.push(("x_min".to_owned(), x_min));
    let setup = FieldModelSetup {
        family: ElementFamily::Nodal,
        materials: vec![Material::AIR; mesh.topology().region_names().len()],
        coils: vec![Coil { name: "coil".to_owned(), ampere_turns: c64::new(1.0, 0.0), shape: shape.into() }],
        boundaries,
        ..FieldModelSetup::default()
    };
    FieldModel::new(&mesh, setup)
}

#[test]
fn a_coil_may_cross_a_flux_parallel_plane() {
    assert!(model(Boundary::FluxParallel, 0.06).is_ok());
}

#[test]
fn a_coil_may_not_cross_a_flux_normal_plane() {
    let err = model(Boundary::FluxNormal, 0.06).unwrap_err();
    assert!(matches!(err, SolverError::SourceOnBoundary { .. }), "{err}");
    assert!(err.to_string().contains("flux-normal surface `x_min`"), "{err}");
    assert!(
        matches!(err, SolverError::SourceOnBoundary { reason: PlaneFault::Crossing { .. }, .. }),
        "{err}"
    );
}

#[test]
fn a_coil_outside_the_mesh_is_no_source() {
    let err = model(Boundary::FluxParallel, 5.0).unwrap_err();
    assert!(matches!(err, SolverError::NoSource { .. }), "{err}");
}

/// A quarter of a square coil about z in a box, the winding a region of a mesh that follows it.
fn quarter_of_a_square_coil() -> Mesh {
    let lines = |fine: f64, outer: f64| -> Vec<f64> {
        let mut lines: Vec<f64> = (0..=12).map(|i| fine * f64::from(i) / 12.0).collect();
        lines.extend((1..=4).map(|i| fine + (outer - fine) * f64::from(i * i) / 16.0));
        lines
    };
    // Window 40 mm, width 20 mm, half height 10 mm.
    let winding = |[x, y, z]: [f64; 3]| u32::from(z < 0.01 && x.max(y) > 0.04 && x.max(y) < 0.06);
    painted([(); 3].map(|()| lines(0.06, 0.2)), &["air", "winding"], winding)
}

fn solved(mesh: &Mesh, shape: CoilShape, ampere_turns: c64) -> Result<[c64; 3], SolverError> {
    let mut boundaries = flux_parallel(&["x_min", "x_max", "y_min", "y_max", "z_max"]);
    boundaries.push(("z_min".to_owned(), Boundary::FluxNormal));
    let setup = FieldModelSetup {
        family: ElementFamily::Nodal,
        materials: vec![Material::AIR; 2],
        coils: vec![Coil { name: "coil".to_owned(), ampere_turns, shape }],
        boundaries,
        ..FieldModelSetup::default()
    };
    let model = FieldModel::new(mesh, setup)?;
    let (field, _) = model.solve(mesh)?;
    Ok(probe((&model, mesh, &field), "centre", &[[1e-4, 1e-4, 1e-4]])?[0])
}

#[test]
fn a_coil_region_makes_the_field_of_the_analytic_coil() {
    let mesh = quarter_of_a_square_coil();
    let racetrack = Racetrack::new([0.0; 3], 2, [0.04; 2], 0.02, 0.02, Corner::Mitred).expect("a coil");
    let analytic = solved(&mesh, racetrack.into(), c64::from(1000.0)).expect("a field");

    let region = mesh.topology().region("winding").expect("a region");
    // Anticlockwise about z: from the positive x axis (on y = 0) to the positive y axis. The upper half of the coil
    // carries half of the ampere-turns.
    let path = Path::Terminals { from: terminal(&mesh, "y_min"), to: terminal(&mesh, "x_min") };
    let elements = mesh.topology().elements_of(region);
    let current = RegionCurrent::new(&mesh, "coil", &elements, &path).expect("a coil");
    println!("quarter of a square coil: {}", current.report());
    let meshed = solved(&mesh, current.into(), c64::from(500.0)).expect("a field");
    println!("B_z in the centre: region {:.6e} T, analytic {:.6e} T", meshed[2].re, analytic[2].re);
    // The same current but for the corners, where that of the region takes the shorter way; their distance from the
    // centre is the largest: 2 %.
    assert!((meshed[2] / analytic[2] - 1.0).norm() < 0.02, "{meshed:?} {analytic:?}");
}

#[test]
fn the_terminals_of_a_region_lie_on_flux_parallel_surfaces() {
    let mesh = quarter_of_a_square_coil();
    let elements: Vec<_> = mesh.topology().elements_of(mesh.topology().region("winding").expect("a region"));
    let path = Path::Terminals { from: terminal(&mesh, "x_min"), to: terminal(&mesh, "y_min") };
    let current = RegionCurrent::new(&mesh, "coil", &elements, &path).expect("a coil");
    let surface = |name, condition| ConditionedSurface {
        name,
        condition,
        triangles: mesh.topology().surface(name).expect("a surface"),
    };
    let coils = [Coil { name: "coil".to_owned(), ampere_turns: c64::from(1.0), shape: current.into() }];
    let with = |x_min: Condition, z_min: Condition| {
        let surfaces =
            [surface("x_min", x_min), surface("y_min", Condition::FluxParallel), surface("z_min", z_min)];
        planes::check(&mesh, &coils, &surfaces)
    };
    assert!(with(Condition::FluxParallel, Condition::FluxNormal).is_ok());
    // Of a coil that only touches a flux-parallel plane, the mirror image runs beside it.
    assert!(with(Condition::FluxParallel, Condition::FluxParallel).is_ok());
    for condition in [Condition::FluxNormal, Condition::Open, Condition::Prescribed] {
        let err = with(condition, Condition::FluxNormal).unwrap_err();
        let SolverError::SourceOnBoundary { reason: PlaneFault::EndsAtTerminal, .. } = err else {
            panic!("{err}")
        };
        assert!(err.to_string().contains("its terminal `x_min`"), "{err}");
    }
}

#[test]
fn the_sources_of_several_coils_add_up() {
    let mesh = quarter_of_a_square_coil();
    let racetrack = Racetrack::new([0.0; 3], 2, [0.04; 2], 0.02, 0.02, Corner::Mitred).expect("a coil");
    let coil = |ampere_turns| Coil { name: "coil".to_owned(), ampere_turns, shape: racetrack.clone().into() };
    let (a, b) = (c64::new(1.0, 2.0), c64::new(-3.0, 0.5));
    let both = SourceTerms::new(&mesh, &[coil(a), coil(b)]).expect("two coils");
    let sum = SourceTerms::new(&mesh, &[coil(a + b)]).expect("one coil");
    assert_eq!(both.elements(), sum.elements());
    for ((_, x), (_, y)) in both.moments.iter().zip(&sum.moments) {
        for (x, y) in x.iter().flatten().zip(y.iter().flatten()) {
            assert!((x - y).norm() <= 1e-14 * y.norm());
        }
    }
}

#[test]
fn a_mesh_that_lies_in_the_window_of_a_coil_has_no_current() {
    let mesh = quarter_of_a_square_coil();
    let terms = |half_window: f64| {
        let winding =
            Racetrack::new([0.0; 3], 2, [half_window; 2], 0.02, 0.4, Corner::Mitred).expect("a coil");
        SourceTerms::new(
            &mesh,
            &[Coil { name: "ring".to_owned(), ampere_turns: c64::from(1.0), shape: winding.into() }],
        )
    };
    let [_, most] = mesh.bounding_box();
    assert!(terms(0.9 * most[0]).is_ok());
    let refused = terms(1.1 * most[0].max(most[1])).expect_err("the winding lies outside").to_string();
    assert!(refused.contains("the winding of the coil `ring` lies outside the mesh"), "{refused}");
}

/// A sheet of current between two walls: `B_y` is constant beside it and linear inside, `±½ μ0 J d` at its faces, where its slope
/// jumps. The value at a point is that of its own side.
#[test]
fn no_value_at_a_point_is_mixed_with_those_across_the_face_of_a_winding() {
    let (current, thickness) = (1e3, 0.02);
    let sheet = |[x, ..]: [f64; 3]| u32::from(x > 0.02 && x < 0.04);
    let across = vec![0.0, 0.01, 0.02, 0.03, 0.04, 0.05, 0.06];
    let along = vec![0.0, 0.013, 0.021, 0.04];
    let mesh = painted([across, along.clone(), along], &["air", "sheet"], sheet);
    let winding = mesh.topology().region("sheet").expect("a region");
    let path = Path::Terminals { from: terminal(&mesh, "z_min"), to: terminal(&mesh, "z_max") };
    let elements = mesh.topology().elements_of(winding);
    let shape = RegionCurrent::new(&mesh, "sheet", &elements, &path).expect("a bar");
    let mut boundaries = flux_parallel(&["x_min", "x_max", "z_min", "z_max"]);
    boundaries.extend(["y_min", "y_max"].map(|name| (name.to_owned(), Boundary::FluxNormal)));
    // Ampere-turns over the section of the sheet.
    let density = current / (thickness * 0.04);
    let at_face = 0.5 * VACUUM_PERMEABILITY * density * thickness;
    let points = [0.003, 0.017, 0.0199, 0.022, 0.027, 0.033, 0.041, 0.055].map(|x| [x, 0.018, 0.023]);
    for (family, order) in ALL {
        let coil = Coil {
            name: "sheet".to_owned(),
            ampere_turns: c64::new(current, 0.0),
            shape: shape.clone().into(),
        };
        let setup = FieldModelSetup {
            family,
            order,
            materials: vec![Material::AIR; 2],
            coils: vec![coil],
            boundaries: boundaries.clone(),
            ..FieldModelSetup::default()
        };
        let model = FieldModel::new(&mesh, setup).expect("a sound problem");
        let (field, _) = model.solve(&mesh).expect("solved");
        let found = probe((&model, &mesh, &field), "line", &points).expect("inside");
        // Second order has A exactly; of first order B is the mean of an element, and off by half a cell's change of it.
        let allowed = if order == Order::Quadratic { 1e-7 } else { 0.06 };
        for (b, x) in found.iter().zip(points.map(|p| p[0])) {
            let exact = at_face * ((x - 0.03) / (0.5 * thickness)).clamp(-1.0, 1.0);
            println!("{family:?} {order:?} x = {x}: {:.6e} of {exact:.6e} T", b[1].re);
            assert!(
                (b[1].re - exact).abs() < allowed * at_face,
                "{family:?} {order:?} {x}: {} {exact}",
                b[1].re
            );
        }
    }
}
