//! A generator says how many tetrahedra it makes without making them.

use fluxmorph_geometry::Mesh;
use fluxmorph_geometry::generate::{
    BlockParameters, BoxRegion, BoxesParameters, ShieldParameters, SphereParameters, block, boxes, shield,
    sphere,
};

#[track_caller]
fn agrees(count: usize, mesh: &Mesh) {
    assert_eq!(count, mesh.topology().tets().len());
}

#[test]
fn the_count_is_that_of_the_mesh() {
    let p = BlockParameters { cells: [3, 4, 5], ..BlockParameters::default() };
    agrees(p.tet_count().expect("valid"), &block(&p).expect("valid"));
    for refinement in [0.5, 1.0] {
        let p =
            ShieldParameters { refinement, skin: vec![], side_skin: vec![], ..ShieldParameters::default() };
        agrees(p.tet_count().expect("valid"), &shield(&p).expect("valid"));
    }
    for (inner_radius, skin) in [(None, vec![]), (None, vec![1e-3, 3e-3]), (Some(0.03), vec![])] {
        let p = SphereParameters { divisions: 4, inner_radius, skin, ..SphereParameters::default() };
        agrees(p.tet_count().expect("valid"), &sphere(&p).expect("valid"));
    }
    let region = BoxRegion {
        name: "iron".into(),
        corners: [[0.1; 3], [0.3; 3]],
        size: [0.1; 3],
        skin: [f64::INFINITY; 3],
        cells: None,
    };
    let p = BoxesParameters {
        corners: [[0.0; 3], [1.0; 3]],
        regions: vec![region],
        sizes: vec![],
        surfaces: vec![],
        growth: 1.5,
        refinement: 1.0,
        division: None,
    };
    agrees(p.tet_count().expect("valid"), &boxes(&p).expect("valid"));
}

#[test]
fn parameters_that_are_refused_have_no_count() {
    assert!(BlockParameters { cells: [1000; 3], ..BlockParameters::default() }.tet_count().is_err());
    assert!(SphereParameters { divisions: 1000, ..SphereParameters::default() }.tet_count().is_err());
}
