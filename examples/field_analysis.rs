//! One field analysis over the library: mesh, materials, coil, solution, flux density at a point, loss.
//!
//! `cargo run --release --example field_analysis`

use fluxmorph_geometry::fem::c64;
use fluxmorph_geometry::generate::{ShieldParameters, shield};
use fluxmorph_solver::coil::{Coil, Corner, Racetrack};
use fluxmorph_solver::{Boundary, FieldModel, FieldModelSetup, Material, SolverError, recovery};

pub(crate) fn main() -> Result<(), SolverError> {
    // A coarse mesh of the shield with three element layers under each face of the plate.
    let parameters =
        ShieldParameters { refinement: 0.5, skin: vec![0.5e-3, 1.5e-3, 5e-3], ..ShieldParameters::default() };
    let mesh = shield(&parameters)?;

    let steel = Material { relative_permeability: 800.0, conductivity: 7e6 };
    let materials = mesh
        .topology()
        .region_names()
        .iter()
        .map(|name| if name == "plate" { steel } else { Material::AIR })
        .collect();
    let shape = Racetrack::new([0.0, 0.0, 0.06], 2, [0.06, 0.16], 0.02, 0.04, Corner::Mitred)?;
    let coil = Coil { name: "coil".to_owned(), ampere_turns: c64::new(40e3, 0.0), shape: shape.into() };
    let model = FieldModel::new(
        &mesh,
        FieldModelSetup {
            frequency: 60.0,
            materials,
            coils: vec![coil],
            boundaries: ["x_min", "x_max", "y_min", "y_max", "z_min", "z_max"]
                .map(|surface| (surface.to_owned(), Boundary::FluxParallel))
                .to_vec(),
            ..FieldModelSetup::default()
        },
    )?;
    let (field, _) = model.solve(&mesh)?;

    let b = recovery::probe((&model, &mesh, &field), "behind the plate", &[[0.0, 0.0, -0.05]])?[0];
    println!("{} unknowns, residual {:.1e}", model.unknown_count(), field.report().residual);
    println!("Bz behind the plate: {:.3} {:+.3}j mT", b[2].re * 1e3, b[2].im * 1e3);
    for (region, loss) in field.losses(&model, &mesh) {
        println!("loss in the {region}: {loss:.1} W (quarter model)");
        assert!(loss > 0.0);
    }
    // The reference has 17.0 mT there on a fine mesh.
    assert!((b[2].norm() - 17.0e-3).abs() < 3e-3);
    assert!(field.report().residual <= 1e-9);
    Ok(())
}
