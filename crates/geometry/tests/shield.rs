//! The shield's mesh: volumes, regions, surfaces, observation cells, counts and refusals.

use fluxmorph_geometry::generate::{ShieldParameters, shield};
use fluxmorph_geometry::quality::QualityReport;
use fluxmorph_geometry::{ElementId, Mesh, MeshError, NodeId, tet4};

fn impedance() -> ShieldParameters {
    ShieldParameters { skin: Vec::new(), side_skin: Vec::new(), ..ShieldParameters::default() }
}

fn volume(mesh: &Mesh, elements: &[ElementId]) -> f64 {
    elements.iter().map(|&e| tet4::volume(mesh.vertices(e))).sum()
}

fn elements(mesh: &Mesh, region: &str) -> Vec<ElementId> {
    mesh.topology().elements_of(mesh.topology().region(region).expect("the shield has it"))
}

fn area(mesh: &Mesh, triangles: &[[NodeId; 3]]) -> [f64; 3] {
    let mut sum = [0.0; 3];
    for t in triangles {
        let a = tet4::area_vector(t.map(|n| mesh.point(n)));
        sum = [sum[0] + a[0], sum[1] + a[1], sum[2] + a[2]];
    }
    sum
}

/// Sums of some 1e5 terms: a few hundred roundings.
fn assert_close(found: f64, expected: f64) {
    assert!((found / expected - 1.0).abs() < 1e-12, "{found} against {expected}");
}

#[test]
fn the_volumes_of_the_regions_are_those_of_their_boxes() {
    for parameters in [ShieldParameters::default(), impedance()] {
        let mesh = shield(&parameters).expect("the default is valid");
        let all: Vec<ElementId> = mesh.topology().elements().collect();
        assert_close(volume(&mesh, &all), 0.6 * 0.72 * 0.88);
        let plate = 0.12 * 0.24 * 0.01;
        assert_close(volume(&mesh, &elements(&mesh, "plate")), plate);
        assert_close(volume(&mesh, &elements(&mesh, "remesh")), 0.16 * 0.28 * 0.07 - plate);
        assert_close(volume(&mesh, &elements(&mesh, "observation")), 0.04 * 0.12 * 0.02);
    }
}

#[test]
fn surfaces_have_their_areas_and_point_outwards() {
    let mesh = shield(&ShieldParameters::default()).expect("the default is valid");
    let expected = [
        ("plate_bottom", [0.0, 0.0, -0.12 * 0.24]),
        ("plate_top", [0.0, 0.0, 0.12 * 0.24]),
        ("plate_side", [0.24 * 0.01, 0.12 * 0.01, 0.0]),
        ("x_min", [-0.72 * 0.88, 0.0, 0.0]),
        ("y_max", [0.0, 0.6 * 0.88, 0.0]),
    ];
    for (name, vector) in expected {
        let found = area(&mesh, mesh.topology().surface(name).expect("the shield has it"));
        for d in 0..3 {
            assert!((found[d] - vector[d]).abs() < 1e-12, "{name}: {found:?}");
        }
    }
    let outside = mesh.topology().outer_facets().count();
    let named: usize = ["x_min", "x_max", "y_min", "y_max", "z_min", "z_max"]
        .iter()
        .map(|name| mesh.topology().surface(name).expect("a grid has it").len())
        .sum();
    assert_eq!(outside, named, "an outside face in the interior would be a gap");
    for name in ["plate_bottom", "plate_top"] {
        let z = if name == "plate_top" { 0.0 } else { -0.01 };
        let triangles = mesh.topology().surface(name).expect("the shield has it");
        assert!(triangles.iter().flatten().all(|&n| mesh.point(n)[2] == z));
    }
}

#[test]
fn observation_cells_are_in_the_order_of_the_reference_points() {
    for refinement in [0.5, 1.0, 1.5] {
        let mesh = shield(&ShieldParameters { refinement, ..impedance() }).expect("valid");
        let region = mesh.topology().region("observation").expect("the shield has it");
        let cells = mesh.topology().cells_of(region);
        assert_eq!(cells.len(), 12);
        for (c, cell) in cells.iter().enumerate() {
            let (i, j) = (c / 6, c % 6);
            assert_close(volume(&mesh, cell), 0.02f64.powi(3));
            let mut centre = [0.0; 3];
            for &e in cell {
                let v = tet4::volume(mesh.vertices(e)) / 0.02f64.powi(3);
                let c = tet4::centroid(mesh.vertices(e));
                centre = [centre[0] + v * c[0], centre[1] + v * c[1], centre[2] + v * c[2]];
                assert_eq!(mesh.topology().region_of()[e.index()], region);
            }
            let expected = [0.01 + 0.02 * i as f64, 0.01 + 0.02 * j as f64, -0.05];
            for d in 0..3 {
                assert!((centre[d] - expected[d]).abs() < 1e-14, "cell {c}: {centre:?}");
            }
        }
    }
}

#[test]
fn design_nodes_are_mesh_nodes_at_every_refinement() {
    for refinement in [0.5, 1.0, 1.7] {
        let mesh = shield(&ShieldParameters { refinement, ..ShieldParameters::default() }).expect("valid");
        let surface = mesh.topology().surface("plate_bottom").expect("the shield has it");
        for (i, j) in (0..7).flat_map(|i| (0..13).map(move |j| (i, j))) {
            let found = surface.iter().flatten().any(|&n| {
                let [x, y, _] = mesh.point(n);
                (x - 0.02 * i as f64).abs() < 1e-15 && (y - 0.02 * j as f64).abs() < 1e-15
            });
            assert!(found, "no node at design node ({i}, {j})");
        }
    }
}

#[test]
fn counts_are_in_the_range_that_resolves_the_field() {
    let tets = |parameters: &ShieldParameters| shield(parameters).expect("valid").topology().tets().len();
    let (skinned, plain) = (tets(&ShieldParameters::default()), tets(&impedance()));
    assert!((60_000..=72_000).contains(&skinned), "{skinned}");
    assert!((25_000..=32_000).contains(&plain), "{plain}");
    let coarse = tets(&ShieldParameters { refinement: 0.5, ..impedance() });
    let fine = tets(&ShieldParameters { refinement: 2.0, ..impedance() });
    assert!(coarse < plain / 2 && fine > 5 * plain, "{coarse} < {plain} < {fine}");
}

#[test]
fn without_skins_the_plate_is_one_element_thick() {
    let mesh = shield(&impedance()).expect("valid");
    let mut levels: Vec<f64> =
        elements(&mesh, "plate").iter().flat_map(|&e| mesh.vertices(e)).map(|p| p[2]).collect();
    levels.sort_by(f64::total_cmp);
    levels.dedup();
    assert_eq!(levels, [-0.01, 0.0]);
}

#[test]
fn the_flat_remesh_region_has_the_quality_of_its_flattest_cell() {
    let mesh = shield(&impedance()).expect("valid");
    let report = QualityReport::of_elements(&mesh, &elements(&mesh, "remesh")).expect("not empty");
    // A cell of 2 : 2 : 1 halves: V = 4/6, Σ L² = 31 for paths that take the short edge first or last.
    assert!((report.worst - 0.4813).abs() < 1e-4, "{report:?}");
}

#[test]
fn an_observation_area_beside_the_plate_is_possible() {
    let mut parameters = impedance();
    parameters.observation.x = [0.2, 0.24];
    parameters.observation.z = [-0.015, 0.025];
    let mesh = shield(&parameters).expect("beside the remesh region");
    assert_close(volume(&mesh, &elements(&mesh, "observation")), 0.04 * 0.12 * 0.04);
    assert_close(volume(&mesh, &elements(&mesh, "plate")), 0.12 * 0.24 * 0.01);
}

type Spoil = fn(&mut ShieldParameters);

#[test]
fn bad_parameters_are_refused_by_name() {
    let cases: &[(&str, Spoil)] = &[
        ("plate", |p| p.plate[2] = 0.0),
        ("plate", |p| p.plate[0] = f64::NAN),
        ("pitch", |p| p.pitch = 0.017),
        ("pitch", |p| p.pitch = -0.02),
        ("pitch", |p| p.pitch = 1e-9),
        ("pitch", |p| p.pitch = 1.0),
        ("skin", |p| p.skin = vec![1e-3, 0.4e-3]),
        ("skin", |p| p.skin = vec![6e-3]),
        ("skin", |p| p.skin = vec![f64::NAN]),
        ("skin", |p| p.skin = vec![0.0, 1e-3]),
        ("side_skin", |p| p.side_skin = vec![-1e-3]),
        ("side_skin", |p| p.side_skin = vec![0.12]),
        ("coil_half_window", |p| p.coil_half_window[1] = 0.0),
        ("coil_width", |p| p.coil_width = f64::INFINITY),
        ("coil_z", |p| p.coil_z = [0.08, 0.04]),
        ("coil_z", |p| p.coil_z = [-0.02, 0.04]),
        ("remesh_upper", |p| p.remesh_upper[0] = 0.12),
        ("remesh_z", |p| p.remesh_z = [-0.01, 0.03]),
        ("remesh_z", |p| p.remesh_z = [-0.04, 0.0]),
        ("remesh_z", |p| p.remesh_z = [-0.04, f64::INFINITY]),
        ("outer", |p| p.outer[1] = 0.2),
        ("outer", |p| p.coil_width = 0.6),
        ("outer_z", |p| p.outer_z[0] = -0.04),
        ("outer_z", |p| p.outer_z[1] = 0.07),
        ("observation_x", |p| p.observation.x = [-0.04, 0.04]),
        ("observation_y", |p| p.observation.y = [0.0, 0.9]),
        ("observation_z", |p| p.observation.z = [-0.5, -0.04]),
        ("observation_z", |p| p.observation.z = [-0.04, -0.06]),
        ("observation_cells", |p| p.observation.cells = [0, 6]),
        ("observation_cells", |p| p.observation.cells = [2, usize::MAX]),
        ("observation_z", |p| p.observation.z = [-0.05, -0.03]),
        ("in_plane_size", |p| p.in_plane_size = 0.0),
        ("in_plane_size", |p| p.in_plane_size = 1e-12),
        ("air_layer", |p| p.air_layer = 1e-12),
        ("side_air", |p| p.side_air = f64::NAN),
        ("growth", |p| p.growth = 0.9),
        ("refinement", |p| p.refinement = 0.0),
        ("refinement", |p| p.refinement = f64::NAN),
        ("refinement", |p| p.refinement = 20.0),
    ];
    for (name, spoil) in cases {
        let mut parameters = ShieldParameters::default();
        spoil(&mut parameters);
        match shield(&parameters) {
            Err(MeshError::Parameter { parameter, .. }) => {
                assert_eq!(parameter, format!("shield.{name}"), "{parameters:?}");
            }
            Err(other) => panic!("{name}: {other}"),
            Ok(_) => panic!("{name} was accepted"),
        }
    }
}

#[test]
fn an_observation_area_that_would_move_names_both_boxes() {
    let mut parameters = ShieldParameters::default();
    parameters.observation.z = [-0.05, -0.03];
    let text = shield(&parameters).expect_err("it overlaps").to_string();
    assert!(text.contains("shield.observation") && text.contains("remesh_z"), "{text}");
}
