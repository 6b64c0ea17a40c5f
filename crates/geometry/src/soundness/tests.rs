//! Small blocks with one thing wrong.

use std::sync::Arc;

use super::*;
use crate::generate::{BlockParameters, block};
use crate::ids::{ElementId, NodeId, RegionId};
use crate::mesh::Mesh;
use crate::tet4::{Point, centroid};
use crate::topology::Topology;

/// A block of 4 x 4 x 4 cells of a metre.
fn cube() -> Mesh {
    block(&BlockParameters { size: [4.0; 3], cells: [4; 3] }).expect("a block")
}

/// A mesh of these elements; a function says the region of each, 0 or 1, by its middle.
fn mesh(points: Vec<Point>, tets: Vec<[NodeId; 4]>, region: impl Fn(Point) -> u32) -> Mesh {
    let region_of =
        tets.iter().map(|tet| RegionId(region(centroid(tet.map(|n| points[n.index()]))))).collect();
    let names = vec!["one".to_owned(), "other".to_owned()];
    let topology = Topology::new(points.len(), tets, names, region_of).expect("a topology");
    Mesh::new(Arc::new(topology), points).expect("positive volumes")
}

/// Two meshes as one, the second shifted along x; the second is region 1.
fn both(first: &Mesh, second: &Mesh, shift: f64) -> Mesh {
    let count = first.points().len() as u32;
    let mut points = first.points().to_vec();
    points.extend(second.points().iter().map(|[x, y, z]| [x + shift, *y, *z]));
    let mut tets = first.topology().tets().to_vec();
    tets.extend(second.topology().tets().iter().map(|tet| tet.map(|n| NodeId(n.0 + count))));
    let own = first.topology().tets().len();
    let region_of = (0..tets.len()).map(|e| RegionId(u32::from(e >= own))).collect();
    let topology = Topology::new(points.len(), tets, vec!["one".into(), "other".into()], region_of);
    Mesh::new(Arc::new(topology.expect("a topology")), points).expect("positive volumes")
}

fn contacts_of(mesh: &Mesh) -> Vec<Contact> {
    let hull = Hull::new(mesh);
    contacts(&hull, &vec![false; hull.faces().len()])
}

/// The block without the elements around its middle, whose node is then no corner of any.
fn hollow() -> Mesh {
    let cube = cube();
    let middle = cube.topology().nodes().find(|&n| cube.point(n) == [2.0; 3]).expect("a node");
    let last = NodeId::new(cube.points().len() - 1);
    let renumber = |n: NodeId| if n == last { middle } else { n };
    let mut points = cube.points().to_vec();
    points.swap_remove(middle.index());
    let kept = cube.topology().tets().iter().filter(|tet| !tet.contains(&middle));
    mesh(points, kept.map(|tet| tet.map(renumber)).collect(), |_| 0)
}

#[test]
fn a_sound_block_has_no_contact_and_is_one_part() {
    assert_eq!(contacts_of(&cube()), []);
    assert_eq!(contacts_of(&hollow()), []);
    assert_eq!(separate_parts(&cube()).len(), 1);
}

#[test]
fn blocks_side_by_side_touch_on_their_face() {
    let found = contacts_of(&both(&cube(), &cube(), 4.0));
    assert_eq!(found.len(), 1);
    let Contact { meeting, regions, faces, area, nodes, doubled, place } = &found[0];
    assert_eq!((*meeting, *regions), (Meeting::Touching, [RegionId(0), RegionId(1)]));
    // Both faces of 4 x 4 m, 32 triangles each; 25 nodes of each lie at the other's.
    assert!((area - 32.0).abs() < 1e-12 && (*faces, *nodes, *doubled) == (64, 50, 50), "{found:?}");
    assert!((place[0] - 4.0).abs() < 1e-12, "{place:?}");
}

#[test]
fn blocks_that_do_not_match_touch_too() {
    let fine = block(&BlockParameters { size: [4.0; 3], cells: [3, 7, 5] }).expect("a block");
    let found = contacts_of(&both(&cube(), &fine, 4.0));
    assert!(found.len() == 1 && found[0].meeting == Meeting::Touching, "{found:?}");
    assert!((found[0].area - 32.0).abs() < 1e-12 && found[0].nodes > found[0].doubled, "{found:?}");
}

#[test]
fn blocks_in_each_other_overlap_and_apart_they_are_parts() {
    for shift in [0.0, 0.03, 1.7, 3.9] {
        let found = contacts_of(&both(&cube(), &cube(), shift));
        assert!(found.iter().any(|contact| contact.meeting == Meeting::Overlapping), "{shift}: {found:?}");
    }
    let apart = both(&cube(), &cube(), 4.1);
    assert_eq!(contacts_of(&apart), []);
    let parts = separate_parts(&apart);
    let elements = cube().topology().tets().len();
    assert_eq!(parts.iter().map(|part| part.elements).collect::<Vec<_>>(), [elements; 2]);
    assert_eq!((&parts[1].regions[..], parts[1].first), (&[RegionId(1)][..], ElementId::new(elements)));
}

#[test]
fn two_sides_of_a_sheet_with_conditions_may_touch() {
    let mesh = both(&cube(), &cube(), 4.0);
    let hull = Hull::new(&mesh);
    let at_sheet = |x: f64| (x - 4.0).abs() < 1e-12;
    let conditions: Vec<bool> =
        hull.faces().iter().map(|f| f.nodes.iter().all(|&n| at_sheet(mesh.point(n)[0]))).collect();
    assert_eq!(contacts(&hull, &conditions), []);
}

#[test]
fn a_fold_is_no_orientation() {
    // The cube's middle node, pushed out through its neighbours: elements turned around to be positive.
    let cube = cube();
    let middle = cube.topology().nodes().find(|&n| cube.point(n) == [2.0; 3]).expect("a node");
    let mut points = cube.points().to_vec();
    points[middle.index()] = [3.4, 2.1, 2.2];
    let turned = |tet: &[NodeId; 4]| {
        let [a, b, c, d] = *tet;
        let volume = crate::tet4::volume(tet.map(|n| points[n.index()]));
        if volume < 0.0 { [a, b, d, c] } else { *tet }
    };
    let tets: Vec<_> = cube.topology().tets().iter().map(turned).collect();
    let regions = vec![RegionId(0); tets.len()];
    let error = Topology::new(points.len(), tets, vec!["one".into()], regions).expect_err("a fold");
    assert!(matches!(error, crate::MeshError::Folded { .. }), "{error}");
}

#[test]
fn open_patches_say_where_they_lie() {
    let cube = cube();
    let situations = |mesh: &Mesh, open: &dyn Fn(Point) -> bool| -> Vec<(Situation, f64)> {
        let hull = Hull::new(mesh);
        let middle = |face: usize| centroid(hull.faces()[face].nodes.map(|n| mesh.point(n)));
        let conditions: Vec<bool> = (0..hull.faces().len()).map(|face| !open(middle(face))).collect();
        open_patches(&hull, &conditions).iter().map(|p| (p.situation, (p.area * 1e9).round() / 1e9)).collect()
    };
    assert_eq!(situations(&cube, &|_| false), []);
    assert_eq!(situations(&cube, &|x| x[2] == 0.0), [(Situation::Side, 16.0)]);
    assert_eq!(situations(&cube, &|x| x[2] == 0.0 && x[0] < 1.0), [(Situation::BesideCondition, 4.0)]);
    // All of the outside open but for one face: five sides, and none beside it.
    assert_eq!(situations(&cube, &|x| x[2] != 0.0).len(), 5);
    let inside = |x: Point| x.iter().all(|c| (0.5..3.5).contains(c));
    // One hole has one wall, with all its corners.
    let holes = situations(&hollow(), &inside);
    assert!(matches!(holes[..], [(Situation::Hole, _)]), "{holes:?}");

    // An L: the walls of the notch stand into the mesh.
    let kept = cube.topology().elements().filter(|&e| {
        let [x, _, z] = centroid(cube.vertices(e));
        x < 2.0 || z < 2.0
    });
    let tets = kept.map(|e| cube.topology().tet(e)).collect();
    let l = mesh(cube.points().to_vec(), tets, |_| 0);
    let at_two = |c: f64| (c - 2.0).abs() < 1e-9;
    let notch = |x: Point| (at_two(x[0]) && x[2] > 2.0) || (at_two(x[2]) && x[0] > 2.0);
    assert_eq!(situations(&l, &notch), [(Situation::Inward, 8.0); 2]);
}

#[test]
fn layers_lean_where_their_columns_do() {
    let layered = |lean: f64| {
        let block = block(&BlockParameters { size: [4.0, 4.0, 0.4], cells: [8, 8, 4] }).expect("a block");
        let sheared = block.points().iter().map(|[x, y, z]| [x + lean * z, *y, *z]).collect();
        Mesh::new(Arc::clone(block.topology()), sheared).expect("a shear keeps volumes")
    };
    let top = |mesh: &Mesh| -> Vec<[NodeId; 3]> {
        let hull = Hull::new(mesh);
        let is_top = |f: &&crate::Facet| f.nodes.iter().all(|&n| mesh.point(n)[2] == 0.4);
        hull.faces().iter().filter(is_top).map(|f| f.nodes).collect()
    };
    let upright = layered(0.0);
    assert_eq!(leaning_layers(&upright, &top(&upright)), None);
    let leaning = layered(4.0);
    let found = leaning_layers(&leaning, &top(&leaning)).expect("by 0.4 m over 0.1 m");
    assert!(found.share > 0.4 && (found.height - 0.1).abs() < 1e-12 && found.lean > 0.2, "{found:?}");
}

/// The apex of the first tetrahedron lies behind the fourth corner of the surface's quadrangle.
#[test]
fn a_prism_along_the_surface_does_not_lean() {
    let points = |y: f64| [[0.0, y, 0.1], [1.0, y, 0.1], [0.0, y, 0.0]];
    let points: Vec<Point> = points(0.0).into_iter().chain(points(1.0)).collect();
    let positive = |[a, b, c, d]: [usize; 4]| {
        let volume = crate::tet4::volume([a, b, c, d].map(|n| points[n]));
        if volume < 0.0 { [a, b, d, c] } else { [a, b, c, d] }.map(NodeId::new)
    };
    let tets = [[0, 1, 4, 5], [0, 3, 4, 5], [0, 1, 2, 5]].map(positive).to_vec();
    let prism = mesh(points.clone(), tets, |_| 0);
    let top = [[0, 1, 4], [0, 3, 4]].map(|face| face.map(NodeId::new));
    assert_eq!(leaning_layers(&prism, &top), None);
    assert!(leaning_layers(&prism, &top[..1]).is_some(), "without the node that the apex lies behind");
}
