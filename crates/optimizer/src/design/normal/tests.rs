//! Edges and corners move with their faces, and smooth surfaces as they would without.

use fluxmorph_geometry::generate::{SphereParameters, sphere};
use fluxmorph_geometry::refine::{RefineLimits, uniform};
use fluxmorph_geometry::tet4::volume;

use super::super::tests::{build, cap, moved_block, outward, quarter};
use super::super::{Control, DesignSetup, DesignSurface, Direction, Mirror};
use super::*;

/// A unit step of all variables.
const STEP: f64 = 0.1;

/// Rounding of places and steps below one.
const ROUNDING: f64 = 1e-15;

fn faces_of(mesh: &Mesh, names: &[&str]) -> Vec<[NodeId; 3]> {
    names.iter().flat_map(|name| outward(mesh, name)).collect()
}

/// What one step of all variables moves the nodes.
fn stepped(surface: &DesignSurface) -> Vec<Point> {
    surface.displacement(&vec![STEP; surface.variable_count()])
}

/// Checks that every node on these faces of the unit cube (axis and place) moves by the step across each of them.
fn moves_by_the_step(mesh: &Mesh, surface: &DesignSurface, faces: &[(usize, f64)]) {
    for (&node, u) in surface.nodes().iter().zip(stepped(surface)) {
        let x = mesh.point(node);
        for &(axis, at) in faces.iter().filter(|(axis, at)| x[*axis] == *at) {
            let outwards = if at > 0.5 { STEP } else { -STEP };
            assert!((u[axis] - outwards).abs() < ROUNDING, "{x:?}: {u:?}");
        }
    }
}

#[test]
fn every_face_of_a_block_moves_by_the_step_to_its_edges_and_corner() {
    let mesh = moved_block(4, |x| x);
    let all = [("x_max", (0, 1.0)), ("y_max", (1, 1.0)), ("z_max", (2, 1.0))];
    for (count, expected) in [(2, 1.1 * 1.1), (3, 1.1 * 1.1 * 1.1)] {
        let (names, faces): (Vec<&str>, Vec<_>) = all[3 - count..].iter().copied().unzip();
        for control in [Control::Nodes, Control::Filter(0.4)] {
            let planes = faces_of(&mesh, &["x_min", "y_min", "z_min"]);
            let surface = build(
                &mesh,
                &DesignSetup {
                    control,
                    kept: planes.clone(),
                    cuts: planes,
                    ..DesignSetup::new(&faces_of(&mesh, &names), Direction::Normal)
                },
            );
            moves_by_the_step(&mesh, &surface, &faces);
            let mut points = mesh.points().to_vec();
            for (node, u) in surface.nodes().iter().zip(stepped(&surface)) {
                let x = mesh.point(*node);
                assert!((0..3).all(|d| x[d] > 0.0 || u[d] == 0.0), "{x:?} must stay on its plane: {u:?}");
                let point = &mut points[node.index()];
                *point = std::array::from_fn(|d| point[d] + u[d]);
            }
            let tets = mesh.topology().tets().iter();
            let found: f64 = tets.map(|tet| volume(tet.map(|n| points[n.index()]))).sum();
            // Sums of some hundred volumes.
            assert!((found - expected).abs() < 1e-13, "{control:?}: {found} {expected}");
        }
    }
}

#[test]
fn mirrored_edges_keep_their_mitre() {
    // The triangles of a block are not laid symmetrically.
    let mesh = moved_block(4, |x| x);
    let setup = DesignSetup {
        mirrors: vec![Mirror { axis: 0, at: 0.5 }],
        ..DesignSetup::new(&faces_of(&mesh, &["x_min", "x_max", "z_max"]), Direction::Normal)
    };
    moves_by_the_step(&mesh, &build(&mesh, &setup), &[(0, 0.0), (0, 1.0), (2, 1.0)]);
}

#[test]
fn a_ridge_on_a_symmetry_plane_moves_with_its_half_of_the_roof() {
    let mesh = moved_block(4, |x| [x[0], x[1], x[2] * (1.0 - 0.75 * x[0])]);
    let surface = build(&mesh, &quarter(&mesh, Direction::Normal, Control::Nodes));
    for (node, u) in surface.nodes().iter().zip(stepped(&surface)) {
        let x = mesh.point(*node);
        assert!((dot(u, [0.6, 0.0, 0.8]) - STEP).abs() < ROUNDING, "{x:?}: {u:?}");
        assert!((0..2).all(|d| x[d] > 0.0 || u[d] == 0.0), "{x:?} must stay on its plane: {u:?}");
    }
}

/// The unit mean normals without any edge; nodes at x = 0 and y = 0 stay there if asked.
fn mean_normals(mesh: &Mesh, triangles: &[[NodeId; 3]], nodes: &[NodeId], keeps: bool) -> Vec<Point> {
    let mut sums = vec![[0.0; 3]; nodes.len()];
    for triangle in triangles {
        let area = area_vector(triangle.map(|n| mesh.point(n)));
        for n in triangle {
            let own = &mut sums[nodes.binary_search(n).expect("a node of the surface")];
            (0..3).for_each(|d| own[d] += area[d]);
        }
    }
    for (own, node) in sums.iter_mut().zip(nodes).filter(|_| keeps) {
        (0..2).filter(|&d| mesh.point(*node)[d] == 0.0).for_each(|d| own[d] = 0.0);
    }
    sums.into_iter().map(unit).collect()
}

#[test]
fn a_smooth_surface_moves_along_its_mean_normals_to_the_last_bit() {
    let same = |mesh: &Mesh, setup: &DesignSetup, keeps: bool| {
        let surface = build(mesh, setup);
        let expected = mean_normals(mesh, &setup.triangles, surface.nodes(), keeps);
        assert_eq!(surface.directions(), expected);
        let p: Vec<f64> = (0..surface.variable_count()).map(|k| (k as f64 * 0.7).sin()).collect();
        let heights = surface.normal_displacements(&p);
        let moved: Vec<Point> = expected.iter().zip(heights).map(|(d, h)| d.map(|c| h * c)).collect();
        assert_eq!(surface.displacement(&p), moved);
    };
    // Facets of 22.5 degrees and less.
    for divisions in [4, 7] {
        let mesh = sphere(&SphereParameters { divisions, ..SphereParameters::default() }).expect("a ball");
        let faces = mesh.topology().faces_between("sphere|air").expect("they touch");
        same(&mesh, &DesignSetup::new(&faces, Direction::Normal), false);
    }
    let mesh = moved_block(6, cap);
    same(&mesh, &quarter(&mesh, Direction::Normal, Control::Filter(0.4)), true);
}

#[test]
fn a_finer_mesh_moves_its_faces_by_the_step_too() {
    let mesh = moved_block(3, |x| x);
    let names = ["x_max", "y_max", "z_max"];
    let setup = DesignSetup::new(&faces_of(&mesh, &names), Direction::Normal);
    let refinement = uniform(&mesh, RefineLimits::default()).expect("eight for each");
    let fine = refinement.mesh();
    let triangles = faces_of(fine, &names);
    let coarse = build(&mesh, &setup);
    let surface = coarse.refined(&triangles, mesh.points().len(), refinement.parents());
    moves_by_the_step(fine, &surface, &[(0, 1.0), (1, 1.0), (2, 1.0)]);
    // Of a uniform step the facets of both meshes are the same.
    let mut all = vec![[0.0; 3]; mesh.points().len()];
    for (node, u) in coarse.nodes().iter().zip(stepped(&coarse)) {
        all[node.index()] = u;
    }
    let facets = refinement.prolong(&all);
    for (node, u) in surface.nodes().iter().zip(stepped(&surface)) {
        let own = facets[node.index()];
        assert!((0..3).all(|d| (u[d] - own[d]).abs() < ROUNDING), "{u:?} {own:?}");
    }
}

#[test]
fn a_knife_edge_moves_by_two_steps_and_coplanar_normals_span_a_plane() {
    let at = |degrees: f64| {
        let (sine, cosine) = degrees.to_radians().sin_cos();
        [cosine, 0.0, sine]
    };
    let off = |v: Point, expected: Point| norm(std::array::from_fn(|d| v[d] - expected[d]));
    // Walls of 60 degrees and more are moved by the step, thinner ones by less.
    assert!(off(mitred(&[at(60.0), at(-60.0)], &[]), [2.0, 0.0, 0.0]) < 1e-14);
    assert!(off(mitred(&[at(75.0), at(-75.0)], &[]), [2.0, 0.0, 0.0]) < 1e-14);
    let facets = mitred(&[at(-45.0), at(0.0), at(45.0)], &[]);
    assert!(off(facets, [0.5 * (1.0 + 2.0_f64.sqrt()), 0.0, 0.0]) < 1e-14, "{facets:?}");
    // At a plane that the node keeps, of one face and of two.
    assert!(off(mitred(&[at(45.0)], &[[1.0, 0.0, 0.0]]), [0.0, 0.0, 2.0_f64.sqrt()]) < 1e-14);
    assert!(off(mitred(&[at(0.0), at(45.0)], &[[1.0, 0.0, 0.0]]), [0.0, 0.0, 2.0_f64.sqrt()]) < 1e-14);
}
