//! Who moves, slides and stays: on the shield in both models, and at the corners of the rules.

use std::collections::BTreeSet;

use crate::support::{self, Point, hollow_shield, meshed_shield, nodes_where, unit_cells, whole};
use fluxmorph_geometry::{ElementId, Mesh, NodeId};
use fluxmorph_remesh::{
    Boundary, BoundaryKind, ElasticMap, Motion, MotionLaw, RemeshError, RemeshSetup, StiffnessPolicy,
    Subregion,
};

const TIGHT: f64 = 1e-9;

fn near(a: f64, b: f64) -> bool {
    (a - b).abs() < TIGHT
}

/// Components free to move at a point of the mesh, as a string such as `yz`; `design` at design nodes.
fn freedom(mesh: &Mesh, map: &ElasticMap, at: Point) -> String {
    let node = mesh.topology().nodes().find(|&n| (0..3).all(|d| near(mesh.point(n)[d], at[d])));
    let node = node.unwrap_or_else(|| panic!("no node at {at:?}"));
    if map.design_nodes().contains(&node) {
        return "design".to_owned();
    }
    (0..3).filter(|&c| map.unknown_part(node, [1.0; 3])[c] != 0.0).map(|c| ['x', 'y', 'z'][c]).collect()
}

#[test]
fn the_shield_moves_slides_and_stays_as_intended_in_both_models() {
    let (meshed, hollow) = (meshed_shield(), hollow_shield());
    for (mesh, regions) in [(&meshed, &["plate", "remesh"][..]), (&hollow, &["remesh"])] {
        let setup = support::shield_setup(mesh, regions, StiffnessPolicy::InverseSize, 0.3);
        let map = ElasticMap::new(mesh, setup).unwrap();
        let free = |at| freedom(mesh, &map, at);
        assert_eq!(free([0.1, 0.2, -0.01]), "design");
        assert_eq!(free([0.12, 0.24, -0.01]), "design", "the design goes before sliding");
        assert_eq!(free([0.0, 0.0, -0.01]), "design", "and before symmetry");
        assert_eq!(free([0.1, 0.2, 0.0]), "", "the upper face is a contour and stays");
        assert_eq!(free([0.12, 0.1, 0.0]), "", "with its edges");
        assert_eq!(free([0.0, 0.1, 0.0]), "", "and its line on the symmetry plane");
        assert_eq!(free([0.0, 0.1, -0.02]), "yz", "symmetry planes slide");
        assert_eq!(free([0.1, 0.0, -0.02]), "xz");
        assert_eq!(free([0.0, 0.0, -0.02]), "z");
        assert_eq!(free([0.0, 0.1, -0.04]), "", "up to the end of the region");
        assert_eq!(free([0.16, 0.1, -0.02]), "", "the end of the region stays");
        assert_eq!(free([0.1, 0.2, -0.02]), "xyz");
        assert_eq!(free([0.1, 0.2, -0.06]), "", "nothing moves outside");
    }
    let map = ElasticMap::new(
        &meshed,
        support::shield_setup(&meshed, &["plate", "remesh"], Default::default(), 0.3),
    )
    .unwrap();
    let free = |at| freedom(&meshed, &map, at);
    assert_eq!(free([0.12, 0.1, -0.005]), "yz", "each side of the plate keeps to its own plane");
    assert_eq!(free([0.1, 0.24, -0.005]), "xz");
    assert_eq!(free([0.12, 0.24, -0.005]), "z");
    assert_eq!(free([0.12, 0.0, -0.005]), "z", "a side meets a symmetry plane");
    assert_eq!(free([0.1, 0.1, -0.005]), "xyz");
}

#[test]
fn sliding_nodes_stay_in_their_plane() {
    let mesh = meshed_shield();
    let setup = support::shield_setup(&mesh, &["plate", "remesh"], StiffnessPolicy::InverseSize, 0.3);
    let map = ElasticMap::new(&mesh, setup).unwrap();
    let design: Vec<Point> = map.design_nodes().iter().map(|_| [0.0, 0.0, -0.02]).collect();
    let u = map.displacement(&design).unwrap();
    let mut moved = 0;
    for (p, u) in mesh.points().iter().zip(&u) {
        let side = p[0] < 0.12 + TIGHT && p[1] < 0.24 + TIGHT && (-0.01 - TIGHT..TIGHT).contains(&p[2]);
        for (d, edge) in [(0, 0.12), (1, 0.24)] {
            if near(p[d], 0.0) || (side && near(p[d], edge)) {
                assert_eq!(u[d], 0.0);
                moved += usize::from(u[2] != 0.0);
            }
        }
    }
    assert!(moved > 100, "{moved}");
}

/// Two regions side by side: the contour between them, and what overrides it.
#[test]
fn a_contour_inside_the_region_moves_only_when_listed() {
    let mesh = support::painted(&unit_cells([4, 4, 4]), &["left", "right"], |c| u32::from(c[0] > 2.0));
    let topology = mesh.topology();
    let interface: Vec<_> =
        topology.facets().iter().filter(|f| f.outside.is_some()).map(|f| f.nodes).collect();
    let free_at = |boundaries: Vec<Boundary>| {
        let setup = RemeshSetup { subregions: whole(&mesh), boundaries, ..RemeshSetup::default() };
        let map = ElasticMap::new(&mesh, setup).unwrap();
        [[2.0, 2.0, 2.0], [2.0, 2.0, 0.0], [1.0, 2.0, 2.0]].map(|p| freedom(&mesh, &map, p))
    };
    let listed = |kind| vec![Boundary { name: "contour".into(), kind, triangles: interface.clone() }];
    assert_eq!(free_at(Vec::new()), ["", "", "xyz"]);
    assert_eq!(free_at(listed(BoundaryKind::Free)), ["xyz", "", "xyz"]);
    assert_eq!(free_at(listed(BoundaryKind::Slide)), ["yz", "", "xyz"]);
    assert_eq!(free_at(listed(BoundaryKind::Design)), ["design", "design", "xyz"]);
    let both = [listed(BoundaryKind::Free), listed(BoundaryKind::Fixed)].concat();
    assert_eq!(free_at(both), ["", "", "xyz"], "fixed goes before free");
}

#[test]
fn laws_that_differ_inside_one_region_are_no_contour() {
    let mesh = unit_cells([4, 4, 4]);
    let (left, right) =
        mesh.topology().elements().partition(|&e| mesh.vertices(e).iter().all(|x| x[0] <= 2.0));
    let subregions =
        vec![Subregion::new("left", left), Subregion { young: 9.0, ..Subregion::new("right", right) }];
    let map = ElasticMap::new(&mesh, RemeshSetup { subregions, ..RemeshSetup::default() }).unwrap();
    assert_eq!(freedom(&mesh, &map, [2.0, 2.0, 2.0]), "xyz");
}

#[test]
fn a_region_without_unknowns_still_maps() {
    let mesh = unit_cells([1, 1, 1]);
    let setup = support::outer_design(&mesh, whole(&mesh), StiffnessPolicy::Uniform);
    let map = ElasticMap::new(&mesh, setup).unwrap();
    let design = support::random(8, 1);
    assert_eq!(map.equation_count(), 0);
    assert_eq!(map.displacement(&design).unwrap(), design);
    assert_eq!(map.gradient(&design).unwrap(), design);
}

fn refused(mesh: &Mesh, change: impl FnOnce(&mut RemeshSetup)) -> RemeshError {
    let mut setup = RemeshSetup { subregions: whole(mesh), ..RemeshSetup::default() };
    change(&mut setup);
    ElasticMap::new(mesh, setup).unwrap_err()
}

#[test]
fn every_fault_of_a_set_up_names_its_culprit() {
    let mesh = unit_cells([3, 3, 3]);
    let surface = |name: &str, kind| Boundary::of_surface(mesh.topology(), name, kind).unwrap();
    let sides = ["x_min", "x_max", "y_min", "y_max", "z_min", "z_max"];

    let err = refused(&mesh, |s| s.subregions.clear());
    assert!(matches!(err, RemeshError::EmptyRegion));
    let err = refused(&mesh, |s| s.subregions.push(Subregion::new("again", vec![ElementId(5)])));
    assert!(matches!(&err, RemeshError::Overlap { element: ElementId(5), .. }), "{err}");
    let err = refused(&mesh, |s| s.subregions[0].elements.push(ElementId(1000)));
    assert!(matches!(&err, RemeshError::DanglingElement { element: ElementId(1000), .. }), "{err}");
    let err = refused(&mesh, |s| s.subregions[0].poisson = 0.5);
    assert!(matches!(&err, RemeshError::Parameter { parameter: "poisson", .. }), "{err}");
    let err = refused(&mesh, |s| s.design_nodes.push(NodeId(64)));
    assert!(matches!(&err, RemeshError::DanglingNode { node: NodeId(64), .. }), "{err}");
    let err = refused(&mesh, |s| s.design_nodes = vec![NodeId(3), NodeId(3)]);
    assert!(matches!(&err, RemeshError::RepeatedDesignNode { node: NodeId(3) }), "{err}");
    let err = refused(&mesh, |s| {
        s.subregions = vec![Subregion::new("corner", vec![ElementId(0)])];
        s.design_nodes = vec![NodeId(63)];
    });
    assert!(matches!(&err, RemeshError::DesignNodeOutside { node: NodeId(63), .. }), "{err}");
    let err = refused(&mesh, |s| {
        s.subregions = vec![Subregion::new("corner", vec![ElementId(0)])];
        s.boundaries = vec![surface("x_max", BoundaryKind::Slide)];
    });
    assert!(matches!(&err, RemeshError::SurfaceElsewhere { .. }), "{err}");
    assert!(err.to_string().contains("`x_max` (slide)"), "{err}");
    let err = refused(&mesh, |s| s.boundaries = sides.map(|n| surface(n, BoundaryKind::Free)).to_vec());
    assert!(matches!(&err, RemeshError::Unrestrained { .. }), "{err}");
    let err = refused(&mesh, |s| {
        s.boundaries = sides.map(|n| surface(n, BoundaryKind::Free)).to_vec();
        s.boundaries[0].kind = BoundaryKind::Slide;
        s.boundaries[2].kind = BoundaryKind::Slide;
    });
    assert!(matches!(&err, RemeshError::Unrestrained { .. }), "two planes leave one translation: {err}");
}

#[test]
fn a_curved_surface_cannot_slide_and_is_named() {
    let mesh = unit_cells([2, 2, 2]);
    let bulged: Vec<Point> = mesh.points().iter().map(|p| [0.0, 0.0, 0.1 * p[0] * p[0]]).collect();
    let mesh = mesh.moved(&bulged).unwrap();
    let err = refused(&mesh, |s| {
        s.boundaries = vec![Boundary::of_surface(mesh.topology(), "z_max", BoundaryKind::Slide).unwrap()];
    });
    assert!(matches!(&err, RemeshError::SlideCurved { surface, .. } if surface == "z_max"), "{err}");
    // What the design prescribes need not slide.
    let boundaries = vec![Boundary::of_surface(mesh.topology(), "z_max", BoundaryKind::Slide).unwrap()];
    let nodes: BTreeSet<NodeId> = boundaries[0].triangles.iter().flatten().copied().collect();
    let design_nodes = nodes.into_iter().collect();
    let setup = RemeshSetup { subregions: whole(&mesh), boundaries, design_nodes, ..RemeshSetup::default() };
    assert!(ElasticMap::new(&mesh, setup).is_ok());
}

/// Turned by .3 and then by .4 about two axes: no face of a cube is normal to an axis.
fn turned([x, y, z]: Point) -> Point {
    let about =
        |angle: f64, a: f64, b: f64| (angle.cos() * a - angle.sin() * b, angle.sin() * a + angle.cos() * b);
    let (x, y) = about(0.3, x, y);
    let (y, z) = about(0.4, y, z);
    [x, y, z]
}

#[test]
fn what_slides_in_oblique_planes_moves_as_what_slides_in_those_of_the_axes() {
    let mesh = unit_cells([3, 3, 3]);
    let to: Vec<Point> = mesh.points().iter().map(|&p| turned(p)).collect();
    let oblique = Mesh::new(std::sync::Arc::clone(mesh.topology()), to).unwrap();
    let top = |p: Point| near(p[2], 1.0);
    let design_nodes = nodes_where(&mesh, top);
    let [push, nodal] = [1.0, 7.0].map(|k: f64| {
        move |p: &Point| [0.02 * (k * p[0]).sin(), 0.03 * (k + p[1]).cos(), 0.05 * (p[0] + k * p[1])]
    });
    for law in [MotionLaw::Linear, MotionLaw::Hyperelastic] {
        let moved = |mesh: &Mesh, push: &dyn Fn(&Point) -> Point, design: &[Point], nodal: &[Point]| {
            let boundaries = ["x_min", "x_max", "y_min", "z_min"]
                .map(|name| Boundary::of_surface(mesh.topology(), name, BoundaryKind::Slide).unwrap())
                .to_vec();
            let subregions = whole(mesh);
            let design_nodes = design_nodes.clone();
            let setup = RemeshSetup { subregions, boundaries, design_nodes, law, ..RemeshSetup::default() };
            let moved = Motion::new(mesh.clone(), setup)
                .unwrap()
                .moved(&design.iter().map(push).collect::<Vec<_>>())
                .unwrap();
            let gradient = moved.pull_back(nodal).unwrap();
            (moved.displacement, gradient)
        };
        let places: Vec<Point> = design_nodes.iter().map(|&n| mesh.point(n)).collect();
        let derivative: Vec<Point> = mesh.points().iter().map(nodal).collect();
        let turned_derivative: Vec<Point> = derivative.iter().map(|&g| turned(g)).collect();
        let (displacement, gradient) = moved(&mesh, &push, &places, &derivative);
        let (other, other_gradient) = moved(&oblique, &|p| turned(push(p)), &places, &turned_derivative);
        for (own, other) in displacement.iter().zip(&other).chain(gradient.iter().zip(&other_gradient)) {
            let own = turned(*own);
            assert!((0..3).all(|d| (own[d] - other[d]).abs() < TIGHT), "{law:?}: {own:?}, {other:?}");
        }
        let most = |d: usize| {
            displacement
                .iter()
                .zip(mesh.points())
                .filter(|(_, p)| !top(**p))
                .map(|(u, _)| u[d].abs())
                .fold(0.0, f64::max)
        };
        assert!((0..3).all(|d| most(d) > 1e-3), "nodes slide: {:?}", [0, 1, 2].map(most));
    }
}
