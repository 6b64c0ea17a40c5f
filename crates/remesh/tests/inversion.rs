//! Step to inversion against closed forms and brute force, and the guard of a move.

use std::sync::Arc;

use crate::support::{self, Point, random, unit_cells};
use fluxmorph_geometry::tet4::volume;
use fluxmorph_geometry::{ElementId, Mesh, NodeId, RegionId, Topology};
use fluxmorph_remesh::{RemeshError, check_step, step_to_inversion};

fn unit_tet() -> Mesh {
    let tets = vec![[0, 1, 2, 3].map(NodeId)];
    let topology = Topology::new(4, tets, vec!["coil gap".into()], vec![RegionId(0)]).unwrap();
    let points = vec![[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
    Mesh::new(Arc::new(topology), points).unwrap()
}

#[test]
fn a_single_tetrahedron_inverts_where_its_volume_formula_says() {
    let step = |displacement: [Point; 4]| step_to_inversion(&unit_tet(), &displacement).step;
    let zero = [0.0; 3];
    // Linear: the apex sinks by 2.5 a unit step. V = (1 − 2.5 s)/6.
    assert!((step([zero, zero, zero, [0.0, 0.0, -2.5]]) - 0.4).abs() < 1e-15);
    // Quadratic: V = (1 − s)(1 + 2 s)/6. Cubic: (1 − s)(1 − s/2)(1 + s)/6.
    assert!((step([zero, [-1.0, 0.0, 0.0], [0.0, 2.0, 0.0], zero]) - 1.0).abs() < 1e-15);
    let cubic = [zero, [-1.0, 0.0, 0.0], [0.0, -0.5, 0.0], [0.0, 0.0, 1.0]];
    assert!((step(cubic) - 1.0).abs() < 1e-15);
    // Shrinking to a point, V = (1 − s)³/6: a triple root is found to the cube root of the rounding.
    let shrink = [zero, [-1.0, 0.0, 0.0], [0.0, -1.0, 0.0], [0.0, 0.0, -1.0]];
    assert!((step(shrink) - 1.0).abs() < 1e-5);
    // Growth, translation and rest never invert.
    assert_eq!(step([zero, [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]), f64::INFINITY);
    assert_eq!(step([[3.0, 1.0, 2.0]; 4]), f64::INFINITY);
    assert_eq!(step([zero; 4]), f64::INFINITY);
    assert_eq!(step([[f64::NAN; 3], zero, zero, zero]), 0.0);
}

#[test]
fn the_first_inversion_equals_a_brute_force_scan() {
    let mesh = support::shaken(&unit_cells([5, 4, 3]), 0.2);
    let topology = mesh.topology();
    for seed in 1..=20 {
        let displacement = random(mesh.points().len(), seed);
        let found = step_to_inversion(&mesh, &displacement);
        let volume_at = |e: ElementId, s: f64| {
            let [low, high] = [mesh.vertices(e), topology.tet(e).map(|n| displacement[n.index()])];
            volume(std::array::from_fn(|v| std::array::from_fn(|d| low[v][d] + s * high[v][d])))
        };
        // The scan: first sign change on a grid of 1e-3, then bisection.
        let (mut first, mut culprit) = (f64::INFINITY, None);
        for e in topology.elements() {
            let Some(i) = (1..2000).find(|&i| volume_at(e, f64::from(i) * 1e-3) <= 0.0) else { continue };
            let (mut low, mut high) = (f64::from(i - 1) * 1e-3, f64::from(i) * 1e-3);
            for _ in 0..60 {
                let middle = 0.5 * (low + high);
                if volume_at(e, middle) <= 0.0 { high = middle } else { low = middle }
            }
            if high < first {
                (first, culprit) = (high, Some(e));
            }
        }
        assert!((found.step / first - 1.0).abs() < 1e-12, "seed {seed}: {} against {first}", found.step);
        assert_eq!(found.element, culprit);
    }
}

#[test]
fn the_step_has_the_same_bits_for_any_number_of_threads() {
    let mesh = unit_cells([12, 12, 12]);
    let displacement = random(mesh.points().len(), 9);
    let found = || {
        let found = step_to_inversion(&mesh, &displacement);
        (found.step.to_bits(), found.element)
    };
    assert_eq!(support::on_threads(1, found), support::on_threads(4, found));
    // Every tetrahedron of a regular grid inverts at once: the first is named.
    let flat: Vec<Point> = mesh.points().iter().map(|p| [0.0, 0.0, -2.0 * p[2]]).collect();
    assert_eq!(step_to_inversion(&mesh, &flat).element, Some(ElementId(0)));
}

#[test]
fn a_step_that_inverts_is_refused_with_element_region_place_and_share() {
    let displacement = [[0.0; 3], [0.0; 3], [0.0; 3], [0.0, 0.0, -4.0]];
    let err = check_step(&unit_tet(), &displacement).unwrap_err();
    assert!(
        matches!(&err, RemeshError::Inverted { element: ElementId(0), region, centroid: [0.25, 0.25, 0.25], fraction }
            if region == "coil gap" && (fraction - 0.25).abs() < 1e-15),
        "{err}"
    );
    assert!(err.to_string().contains("only 0.2500 of it can be taken"), "{err}");
    let almost = displacement.map(|u| u.map(|u| 0.249_999 * u));
    assert!(check_step(&unit_tet(), &almost).is_ok());
    let flat = displacement.map(|u| u.map(|u| 0.25 * u));
    assert!(matches!(check_step(&unit_tet(), &flat), Err(RemeshError::Inverted { .. })));
    let wrong = [[0.0; 3], [f64::NAN; 3], [0.0; 3], [0.0; 3]];
    assert!(matches!(check_step(&unit_tet(), &wrong), Err(RemeshError::Mesh(_))));
    assert!(matches!(check_step(&unit_tet(), &wrong[..3]), Err(RemeshError::Mesh(_))));
}
