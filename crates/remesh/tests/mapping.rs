//! The elastic map of Eq. 3 as a linear map: patch test, scaling laws of section 2 of the paper, transpose, bits.

use crate::support::{
    self, Point, at, largest_difference, nodes_where, on_threads, outer_design, product, random, unit_cells,
    whole,
};
use fluxmorph_geometry::{Mesh, NodeId};
use fluxmorph_remesh::{
    Boundary, BoundaryKind, ElasticMap, KinematicConstraint, RemeshSetup, SolverChoice, StiffnessPolicy,
    Subregion,
};

/// A block with crooked elements.
fn distorted(cells: [usize; 3]) -> Mesh {
    support::shaken(&unit_cells(cells), 0.15)
}

/// A distorted block, one mesh region, cut into two subregions of different law across x.
fn two_laws(mesh: &Mesh, young: [f64; 2], poisson: [f64; 2]) -> Vec<Subregion> {
    let centre = mesh.bounding_box()[1][0] / 2.0;
    let side = |e| mesh.vertices(e).iter().map(|x| x[0]).sum::<f64>() < 4.0 * centre;
    let (left, right) = mesh.topology().elements().partition(|&e| side(e));
    let law = |i: usize, elements| Subregion {
        young: young[i],
        poisson: poisson[i],
        ..Subregion::new(["left", "right"][i], elements)
    };
    vec![law(0, left), law(1, right)]
}

/// Roller sides, a designed square on the top, a free rest of the top: every kind of boundary at once.
fn mixed(mesh: &Mesh, subregions: Vec<Subregion>, policy: StiffnessPolicy) -> RemeshSetup {
    let top = mesh.bounding_box()[1][2];
    let kinds = [
        ("x_min", BoundaryKind::Slide),
        ("x_max", BoundaryKind::Slide),
        ("y_min", BoundaryKind::Slide),
        ("z_max", BoundaryKind::Free),
    ];
    let boundary = |(name, kind)| Boundary::of_surface(mesh.topology(), name, kind).unwrap();
    RemeshSetup {
        subregions,
        policy,
        kinematic_constraint: KinematicConstraint::Free,
        design_nodes: nodes_where(mesh, |p| p[2] == top && (2.0..=3.0).contains(&p[0])),
        boundaries: kinds.map(boundary).to_vec(),
        ..RemeshSetup::default()
    }
}

#[test]
fn affine_motion_of_the_boundary_is_reproduced_by_any_one_law() {
    let mesh = distorted([6, 5, 4]);
    let affine = |x: Point| {
        [
            0.1 + 0.3 * x[0] - 0.2 * x[1] + 0.05 * x[2],
            -0.2 + 0.1 * x[0] + 0.4 * x[1] - 0.1 * x[2],
            0.7 - 0.3 * x[0] + 0.02 * x[1] - 0.25 * x[2],
        ]
    };
    for (young, poisson) in [(1.0, 0.3), (1e8, 0.3), (2.0, 0.0), (2.0, 0.45)] {
        let subregions = vec![Subregion { young, poisson, ..whole(&mesh).remove(0) }];
        let map = ElasticMap::new(&mesh, outer_design(&mesh, subregions, StiffnessPolicy::Uniform)).unwrap();
        let u = map.displacement(&at(&mesh, map.design_nodes(), affine)).unwrap();
        // Displacements of up to 3 m on a mesh of 6 m: 1e-12 is rounding.
        assert!(largest_difference(&u, &at(&mesh, &all(&mesh), affine)) < 1e-12);
    }
}

#[test]
fn translation_and_rotation_are_reproduced_by_any_law() {
    let mesh = distorted([6, 5, 4]);
    for policy in StiffnessPolicy::ALL {
        let subregions = two_laws(&mesh, [1.0, 40.0], [0.0, 0.45]);
        let map = ElasticMap::new(&mesh, outer_design(&mesh, subregions, policy)).unwrap();
        // A linearised rotation has no strain in any law; a finite one is affine, and needs one law.
        let turn =
            |x: Point| [0.3 - 0.2 * x[1] + 0.1 * x[2], 0.2 * x[0] - 0.4 * x[2], 0.4 * x[1] - 0.1 * x[0]];
        let u = map.displacement(&at(&mesh, map.design_nodes(), turn)).unwrap();
        assert!(largest_difference(&u, &at(&mesh, &all(&mesh), turn)) < 1e-12, "{policy:?}");
    }
    let map = ElasticMap::new(&mesh, outer_design(&mesh, whole(&mesh), StiffnessPolicy::Uniform)).unwrap();
    let turn = support::rotation(1.0);
    let u = map.displacement(&at(&mesh, map.design_nodes(), &turn)).unwrap();
    assert!(largest_difference(&u, &at(&mesh, &all(&mesh), &turn)) < 1e-12);
}

#[test]
fn without_force_the_motion_is_independent_of_young() {
    let mesh = distorted([6, 5, 4]);
    for policy in StiffnessPolicy::ALL {
        let motion = |scale: f64| {
            let subregions = two_laws(&mesh, [0.5 * scale, 3.0 * scale], [0.3, 0.1]);
            let map = ElasticMap::new(&mesh, mixed(&mesh, subregions, policy)).unwrap();
            map.displacement(&random(map.design_nodes().len(), 1)).unwrap()
        };
        assert!(largest_difference(&motion(1.0), &motion(1e9)) < 1e-12);
    }
}

#[test]
fn motion_depends_on_force_over_young_and_force_is_the_constant_part() {
    let mesh = distorted([6, 5, 4]);
    let map = |scale: f64| {
        let mut subregions = two_laws(&mesh, [0.5 * scale, 3.0 * scale], [0.3, 0.1]);
        subregions[0].force = [0.0, 0.0, -8e-3 * scale];
        subregions[1].force = [2e-3 * scale, 0.0, 1e-3 * scale];
        ElasticMap::new(&mesh, mixed(&mesh, subregions, StiffnessPolicy::InverseSize)).unwrap()
    };
    let (one, large) = (map(1.0), map(1e6));
    let design = random(one.design_nodes().len(), 2);
    let (u, v) = (one.displacement(&design).unwrap(), large.displacement(&design).unwrap());
    assert!(largest_difference(&u, &v) < 1e-12);

    assert!(largest_difference(one.offset(), &vec![[0.0; 3]; u.len()]) > 1e-3);
    assert_eq!(one.displacement(&vec![[0.0; 3]; design.len()]).unwrap(), one.offset());
    let sum: Vec<Point> = one
        .linear(&design)
        .unwrap()
        .iter()
        .zip(one.offset())
        .map(|(a, b)| [a[0] + b[0], a[1] + b[1], a[2] + b[2]])
        .collect();
    assert_eq!(u, sum);
}

#[test]
fn the_gradient_is_the_transposed_map() {
    let mesh = distorted([6, 5, 4]);
    for policy in StiffnessPolicy::ALL {
        let mut setup = mixed(&mesh, two_laws(&mesh, [0.5, 30.0], [0.3, 0.1]), policy);
        setup.subregions[0].force = [0.0, 0.0, -1.0];
        setup.design_nodes.reverse();
        let map = ElasticMap::new(&mesh, setup).unwrap();
        for seed in 0..5 {
            let x = random(map.design_nodes().len(), 2 * seed + 1);
            let y = random(mesh.points().len(), 2 * seed + 2);
            let forward = product(&map.linear(&x).unwrap(), &y);
            let transposed = product(&x, &map.gradient(&y).unwrap());
            assert!((forward - transposed).abs() <= 1e-12 * forward.abs().max(1.0), "{forward} {transposed}");
        }
    }
}

#[test]
fn guided_motion_stays_on_its_axis_and_keeps_patch_test_and_transpose() {
    let mesh = distorted([6, 5, 4]);
    let affine = |x: Point| [0.0, 0.0, 0.7 - 0.3 * x[0] + 0.02 * x[1] - 0.25 * x[2]];
    let constrained =
        |setup: RemeshSetup| RemeshSetup { kinematic_constraint: KinematicConstraint::Axis(2), ..setup };
    let setup = constrained(outer_design(&mesh, whole(&mesh), StiffnessPolicy::Uniform));
    let map = ElasticMap::new(&mesh, setup).unwrap();
    let free = ElasticMap::new(&mesh, outer_design(&mesh, whole(&mesh), StiffnessPolicy::Uniform)).unwrap();
    assert_eq!(3 * map.equation_count(), free.equation_count());
    let u = map.displacement(&at(&mesh, map.design_nodes(), affine)).unwrap();
    assert!(largest_difference(&u, &at(&mesh, &all(&mesh), affine)) < 1e-12);

    for policy in StiffnessPolicy::ALL {
        let map = ElasticMap::new(&mesh, constrained(mixed(&mesh, whole(&mesh), policy))).unwrap();
        let along =
            |points: Vec<Point>| -> Vec<Point> { points.into_iter().map(|p| [0.0, 0.0, p[2]]).collect() };
        let x = along(random(map.design_nodes().len(), 5));
        let y = random(mesh.points().len(), 6);
        let (tx, ty) = (map.linear(&x).unwrap(), map.gradient(&y).unwrap());
        assert!(tx.iter().all(|u| u[0] == 0.0 && u[1] == 0.0));
        let (left, right) = (product(&tx, &y), product(&x, &ty));
        assert!((left - right).abs() < 1e-12 * (1.0 + left.abs()), "{policy:?}: {left} {right}");
    }
}

/// Asserts that map and transpose have the same bits on one, two and four threads.
fn assert_same_bits(mesh: &Mesh, setup: &RemeshSetup) {
    let bits = || {
        let map = ElasticMap::new(mesh, setup.clone()).unwrap();
        let u = map.displacement(&random(map.design_nodes().len(), 3)).unwrap();
        let g = map.gradient(&random(u.len(), 4)).unwrap();
        u.iter().chain(&g).flatten().map(|v| v.to_bits()).collect::<Vec<_>>()
    };
    let one = on_threads(1, bits);
    assert_eq!(one, on_threads(2, bits));
    assert_eq!(one, on_threads(4, bits));
}

#[test]
fn map_and_transpose_have_the_same_bits_for_any_number_of_threads() {
    let mesh = distorted([16, 16, 14]);
    let setup = mixed(&mesh, two_laws(&mesh, [0.5, 30.0], [0.3, 0.1]), StiffnessPolicy::InverseSize);
    assert_same_bits(&mesh, &setup);
}

/// The iterative solver stands in for the direct one: map and transpose agree to its tolerance times the condition.
#[test]
fn component_blocks_give_the_direct_solution_and_its_transpose() {
    let mesh = distorted([8, 7, 6]);
    for policy in StiffnessPolicy::ALL {
        // Sliding sides split the patterns of the components; the outer design leaves them one.
        let split = mixed(&mesh, two_laws(&mesh, [0.5, 30.0], [0.3, 0.1]), policy);
        let alike = outer_design(&mesh, two_laws(&mesh, [0.5, 30.0], [0.0, 0.45]), policy);
        for setup in [split, alike] {
            let solved = |solver| {
                let map = ElasticMap::new(&mesh, RemeshSetup { solver, ..setup.clone() }).unwrap();
                let u = map.displacement(&random(map.design_nodes().len(), 3)).unwrap();
                (u, map.gradient(&random(mesh.points().len(), 4)).unwrap())
            };
            let (u, g) = solved(SolverChoice::Direct);
            let (v, h) = solved(SolverChoice::ComponentBlocks);
            // Values of order one, a condition of some hundred.
            assert!(largest_difference(&u, &v) < 1e-10, "{policy:?}");
            assert!(largest_difference(&g, &h) < 1e-10, "{policy:?}");
        }
    }
}

#[test]
fn component_blocks_have_the_same_bits_for_any_number_of_threads() {
    let mesh = distorted([12, 11, 10]);
    let setup = mixed(&mesh, whole(&mesh), StiffnessPolicy::Directional);
    assert_same_bits(&mesh, &RemeshSetup { solver: SolverChoice::ComponentBlocks, ..setup });
}

fn all(mesh: &Mesh) -> Vec<NodeId> {
    mesh.topology().nodes().collect()
}
