//! Where a coil may meet the outside of the mesh.

use fluxmorph_geometry::fem::c64;
use fluxmorph_geometry::generate::{ShieldParameters, shield};
use fluxmorph_solver::coil::{Coil, Corner, Racetrack};
use fluxmorph_solver::{Boundary, FieldModel, FieldModelSetup, Material, SolverError};

/// The shield's coil with conditions of choice on the planes x = 0 and z = z_max.
fn model(x_min: Boundary, centre_z: f64) -> Result<FieldModel, SolverError> {
    let parameters =
        ShieldParameters { refinement: 0.25, skin: vec![], side_skin: vec![], ..ShieldParameters::default() };
    let mesh = shield(&parameters)?;
    let shape = Racetrack::new([0.0, 0.0, centre_z], 2, [0.06, 0.16], 0.02, 0.04, Corner::Mitred)?;
    let mut boundaries = ["x_max", "y_min", "y_max", "z_min", "z_max"]
        .map(|s| (s.to_owned(), Boundary::FluxParallel))
        .to_vec();
    boundaries.push(("x_min".to_owned(), x_min));
    let setup = FieldModelSetup {
        frequency: 0.0,
        penalty: 1.0,
        materials: vec![Material::AIR; mesh.topology().region_names().len()],
        impedance_surfaces: Vec::new(),
        coils: vec![Coil { name: "coil".to_owned(), ampere_turns: c64::new(1.0, 0.0), shape }],
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
}

#[test]
fn a_coil_outside_the_mesh_is_no_source() {
    let err = model(Boundary::FluxParallel, 5.0).unwrap_err();
    assert!(matches!(err, SolverError::NoSource { .. }), "{err}");
}
