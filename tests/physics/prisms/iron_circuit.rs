//! An iron circuit with an air gap: no closed form, but a number on which other codes agree.
//!
//! A C-core of relative permeability 2000: pole of 80 × 60 mm (half), gap of 15 mm (half), yoke and leg of 70 mm, one coil
//! of 6.2 kA around the pole; a quarter, mirrored at y = 0 and at z = 0. `μ0 NI/g` is 0.519 T, of which iron and fringe
//! take 3 %.

use fluxmorph_geometry::Mesh;
use fluxmorph_geometry::fem::c64;
use fluxmorph_geometry::generate::{BoxRegion, BoxesParameters, boxes};
use fluxmorph_geometry::tet4::{Point, volume};
use fluxmorph_solver::coil::{Coil, Corner, Racetrack};
use fluxmorph_solver::{Boundary, FieldModel, FieldModelSetup, Material};

use super::discretisation::Discretisation;

/// Mean `B_z` in the gap under the pole [T]: 0.50286 by edge elements of order 3 in NGSolve, on two meshes.
pub(super) const GAP_FIELD: f64 = 0.5029;

/// Half the gap [m].
const GAP: f64 = 0.015;

/// The circuit in cells of about 25 mm in the iron, over `refinement`.
pub(super) fn mesh(refinement: f64) -> Mesh {
    let free = [f64::INFINITY; 3];
    let region = |name: &str, lower: Point, upper: Point, size: [f64; 3]| BoxRegion {
        name: name.to_owned(),
        corners: [lower, upper],
        size,
        skin: free,
        cells: None,
    };
    let iron = |lower, upper| region("iron", lower, upper, [0.04, 0.03, 0.04]);
    let parameters = BoxesParameters {
        corners: [[-0.25, 0.0, 0.0], [0.5, 0.3, 0.4]],
        regions: vec![
            region("gap", [0.0; 3], [0.08, 0.06, GAP], [0.02, 0.02, 0.0075]),
            iron([0.0, 0.0, GAP], [0.08, 0.06, 0.12]),
            iron([0.0, 0.0, 0.12], [0.27, 0.06, 0.19]),
            iron([0.2, 0.0, 0.0], [0.27, 0.06, 0.12]),
        ],
        sizes: Vec::new(),
        surfaces: Vec::new(),
        growth: 1.7,
        refinement,
        division: None,
    };
    boxes(&parameters).expect("boxes within the box")
}

/// What a discretisation makes of it.
pub(super) struct GapField {
    /// Mean `B_z` in the gap [T].
    pub(super) mean: f64,
    pub(super) unknowns: usize,
    pub(super) cpu_seconds: f64,
}

/// Solves the circuit.
pub(super) fn solve(mesh: &Mesh, discretisation: Discretisation, penalty: f64) -> GapField {
    let coil = Racetrack::new([0.04, 0.0, 0.07], 2, [0.045, 0.065], 0.03, 0.08, Corner::Mitred);
    let parallel = ["x_min", "x_max", "y_min", "y_max", "z_max"].map(|name| (name, Boundary::FluxParallel));
    let boundaries = parallel.into_iter().chain([("z_min", Boundary::FluxNormal)]);
    let iron = Material { relative_permeability: 2000.0, conductivity: 0.0 };
    let setup = FieldModelSetup {
        penalty,
        materials: vec![Material::AIR, Material::AIR, iron],
        coils: vec![Coil {
            name: "coil".to_owned(),
            ampere_turns: c64::from(6200.0),
            shape: coil.expect("a coil with a size").into(),
        }],
        boundaries: boundaries.map(|(name, kind)| (name.to_owned(), kind)).collect(),
        ..FieldModelSetup::default()
    };
    let clock = cpu_time::ProcessTime::now();
    let model = FieldModel::new(mesh, discretisation.of(setup)).expect("a sound problem");
    let (solution, _) = model.solve(mesh).expect("it converges");
    let cpu_seconds = clock.elapsed().as_secs_f64();
    let elements = mesh.topology().elements_of(mesh.topology().region("gap").expect("it is named"));
    let fields = solution.flux_densities_of(&model, mesh, &elements);
    let (mut flux, mut size) = (0.0, 0.0);
    for (&e, b) in elements.iter().zip(fields) {
        let v = volume(mesh.vertices(e));
        flux += v * b[2].re;
        size += v;
    }
    GapField { mean: flux / size, unknowns: model.unknown_count(), cpu_seconds }
}
