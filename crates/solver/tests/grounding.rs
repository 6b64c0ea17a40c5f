//! ψ of several conductors: one grounded node for each that no plane fixes.

use fluxmorph_geometry::topology::face_key;
use fluxmorph_geometry::{Mesh, NodeId, RegionId};
use fluxmorph_solver::unknowns::PSI;
use fluxmorph_solver::{
    Boundary, Conductor, ElementFamily, FieldModel, FieldModelSetup, Material, SolverError, SurfaceLaw,
};

use crate::{STEEL, lines, painted};

const COPPER: Material = Material { relative_permeability: 1.0, conductivity: 6e7 };

/// Seven layers along x, the region of each by `paint`; `regions` materials in order.
fn model(paint: [u32; 7], materials: Vec<Material>, boundaries: &[(&str, Boundary)]) -> FieldModel {
    let names = ["air", "one", "two", "three"];
    let mesh = painted([7, 2, 2].map(|n| lines(n, 0.01)), &names[..materials.len()], |x| {
        paint[(100.0 * x[0]) as usize]
    });
    let setup = FieldModelSetup {
        family: ElementFamily::Nodal,
        frequency: 50.0,
        materials,
        boundaries: boundaries.iter().map(|(name, b)| ((*name).to_owned(), *b)).collect(),
        ..FieldModelSetup::default()
    };
    FieldModel::new(&mesh, setup).expect("a model")
}

fn grounded(model: &FieldModel) -> usize {
    let unknowns = model.unknowns();
    assert!(unknowns.grounded.iter().all(|n| unknowns.dofs.equation(*n, PSI).is_none()));
    unknowns.grounded.len()
}

#[test]
fn conductors_apart_and_parts_of_one_region_are_grounded_each() {
    let apart = model([0, 1, 0, 2, 0, 3, 0], vec![Material::AIR, COPPER, STEEL, COPPER], &[]);
    let parts = model([0, 1, 0, 0, 1, 1, 0], vec![Material::AIR, COPPER], &[]);
    assert_eq!([grounded(&apart), grounded(&parts)], [3, 2]);
}

#[test]
fn conductors_that_touch_share_one_ground() {
    let model = model([0, 1, 2, 3, 0, 0, 0], vec![Material::AIR, COPPER, STEEL, COPPER], &[]);
    assert_eq!(grounded(&model), 1);
    let psi = model.topology().nodes().filter(|n| model.unknowns().dofs.equation(*n, PSI).is_some()).count();
    assert_eq!(psi, 4 * 9 - 1, "ψ on the four layers of nodes of the conductors, less the grounded one");
}

#[test]
fn a_conductor_that_a_flux_parallel_plane_cuts_needs_no_ground() {
    let materials = vec![Material::AIR, COPPER, STEEL];
    let one = model([1, 0, 0, 2, 0, 0, 0], materials.clone(), &[("x_min", Boundary::FluxParallel)]);
    assert_eq!(grounded(&one), 1);
    let both = model([1, 0, 0, 2, 0, 0, 0], materials.clone(), &[("y_min", Boundary::FluxParallel)]);
    assert_eq!(grounded(&both), 0);
    let neither = model([1, 0, 0, 2, 0, 0, 0], materials, &[("y_min", Boundary::FluxNormal)]);
    assert_eq!(grounded(&neither), 2);
}

/// A cube of 27 cells without the middle one, with a conductor's surface on the given faces and one condition at most.
fn around_a_hole(
    law: SurfaceLaw,
    faces: impl Fn(&Mesh, Vec<[NodeId; 3]>) -> Vec<[NodeId; 3]>,
    boundary: Option<Boundary>,
) -> Result<FieldModel, SolverError> {
    let hole = |x: [f64; 3]| u32::from(x.iter().all(|c| (0.01..0.02).contains(c)));
    let whole = painted([3; 3].map(|n| lines(n, 0.01)), &["air", "hole"], hole);
    let (mesh, exposed) = whole.without_region(RegionId(1))?;
    let surface = faces(&mesh, exposed);
    let setup = FieldModelSetup {
        family: ElementFamily::Nodal,
        frequency: if law == SurfaceLaw::Perfect { 0.0 } else { 50.0 },
        materials: vec![Material::AIR; 2],
        conductors: vec![Conductor { name: "conductor".to_owned(), surface, law }],
        boundaries: boundary.into_iter().map(|b| ("x_min".to_owned(), b)).collect(),
        ..FieldModelSetup::default()
    };
    FieldModel::new(&mesh, setup)
}

fn psi_count(model: &FieldModel) -> usize {
    model.topology().nodes().filter(|n| model.unknowns().dofs.equation(*n, PSI).is_some()).count()
}

#[test]
fn the_surface_of_a_conductor_with_edges_has_a_potential_and_one_ground() {
    for law in [SurfaceLaw::Impedance(COPPER), SurfaceLaw::Perfect] {
        let model = around_a_hole(law, |_, hole| hole, Some(Boundary::FluxNormal)).expect("a model");
        assert_eq!((grounded(&model), psi_count(&model)), (1, 7), "eight corners");
    }
}

#[test]
fn the_inner_surface_of_a_box_has_no_potential() {
    let inner = |mesh: &Mesh, hole: Vec<[NodeId; 3]>| -> Vec<[NodeId; 3]> {
        let outer = mesh.topology().outer_facets();
        let is_hole = |face: [NodeId; 3]| hole.iter().any(|&other| face_key(other) == face_key(face));
        outer.map(|facet| facet.nodes).filter(|&nodes| !is_hole(nodes)).collect()
    };
    let model = around_a_hole(SurfaceLaw::Impedance(COPPER), inner, None).expect("a model");
    assert_eq!((grounded(&model), psi_count(&model)), (0, 0));
}

#[test]
fn a_surface_with_edges_and_nothing_else_is_refused() {
    let err = around_a_hole(SurfaceLaw::Impedance(COPPER), |_, hole| hole, None).unwrap_err();
    assert!(err.to_string().contains("a condition on an outer surface"), "{err}");
}
