//! Injected failures of the mesh motion: numbers that are none, laws that no factor exists of, steps that invert. Each is an
//! error that names its cause, and never a mesh.

use crate::support::{Point, at, nodes_where, shaken, unit_cells, whole};
use fluxmorph_geometry::{Mesh, MeshError};
use fluxmorph_remesh::{
    ElasticMap, KinematicConstraint, Motion, MotionLaw, RemeshError, RemeshSetup, SolverChoice,
    StiffnessPolicy, Subregion, check_step, step_to_inversion,
};

const SOLVERS: [SolverChoice; 2] = [SolverChoice::Direct, SolverChoice::ComponentBlocks];

fn mesh() -> Mesh {
    shaken(&unit_cells([5, 4, 4]), 0.1)
}

/// The top designed, all other outer faces held.
fn setup(mesh: &Mesh, solver: SolverChoice, subregions: Vec<Subregion>) -> RemeshSetup {
    RemeshSetup {
        subregions,
        policy: StiffnessPolicy::Uniform,
        design_nodes: nodes_where(mesh, |p| p[2] == 4.0),
        solver,
        ..RemeshSetup::default()
    }
}

fn motion(solver: SolverChoice) -> Motion {
    let mesh = mesh();
    let setup = setup(&mesh, solver, whole(&mesh));
    Motion::new(mesh, setup).unwrap()
}

fn top(motion: &Motion, by: Point) -> Vec<Point> {
    at(motion.original(), motion.map().design_nodes(), |_| by)
}

#[test]
fn an_axis_that_is_none_is_refused() {
    let mesh = mesh();
    for axis in [3, 64, usize::MAX] {
        let sound = setup(&mesh, SolverChoice::Direct, whole(&mesh));
        let along = KinematicConstraint::Axis(axis);
        let error = ElasticMap::new(&mesh, RemeshSetup { kinematic_constraint: along, ..sound.clone() });
        assert!(matches!(error, Err(RemeshError::Axis { .. })), "{axis}");
        let error = Motion::new(mesh.clone(), RemeshSetup { law: MotionLaw::Rails(axis), ..sound });
        assert!(matches!(error, Err(RemeshError::Axis { .. })), "{axis}");
    }
}

#[test]
fn a_design_that_is_no_number_is_refused_by_both_solvers() {
    for solver in SOLVERS {
        let motion = motion(solver);
        for bad in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
            let mut design = top(&motion, [0.0; 3]);
            design[7][1] = bad;
            let error = motion.moved(&design).unwrap_err();
            let named = matches!(error, RemeshError::NotFinite { what: "displacement", .. });
            assert!(named && !error.to_string().is_empty(), "{solver:?}: {error}");
        }
    }
}

#[test]
fn a_design_beyond_every_mesh_is_refused_by_both_solvers() {
    for solver in SOLVERS {
        let motion = motion(solver);
        for far in [1e60, 1e120, 1e200, 1e307] {
            let error = motion.moved(&top(&motion, [0.0, 0.0, -far])).unwrap_err();
            let named = matches!(
                error,
                RemeshError::Inverted { .. }
                    | RemeshError::NotFinite { .. }
                    | RemeshError::NotConverged { .. }
            );
            assert!(named, "{solver:?} by {far:e}: {error}");
        }
        // Upwards nothing inverts, until volumes are no numbers.
        assert!(motion.moved(&top(&motion, [0.0, 0.0, 1e200])).is_err());
    }
}

#[test]
fn a_derivative_that_is_no_number_is_refused_by_both_solvers() {
    for solver in SOLVERS {
        let motion = motion(solver);
        for bad in [f64::NAN, f64::INFINITY] {
            let mut nodal = vec![[1.0; 3]; motion.original().points().len()];
            let free = motion
                .original()
                .topology()
                .nodes()
                .find(|&n| motion.map().unknown_part(n, [1.0, 0.0, 0.0])[0] != 0.0)
                .unwrap();
            nodal[free.index()][0] = bad;
            let error = motion.map().gradient(&nodal).unwrap_err();
            assert!(
                matches!(error, RemeshError::NotFinite { what: "derivative", .. }),
                "{solver:?}: {error}"
            );
        }
    }
}

#[test]
fn a_stiffness_that_overflows_has_no_factor_of_either_solver() {
    for solver in SOLVERS {
        let mesh = mesh();
        let stiff = Subregion { young: 1e308, poisson: 0.49, ..whole(&mesh).remove(0) };
        let setup = setup(&mesh, solver, vec![stiff]);
        let error = ElasticMap::new(&mesh, setup).unwrap_err();
        let RemeshError::Mesh(MeshError::Factorisation { cause, .. }) = &error else { panic!("{error}") };
        assert!(!cause.is_empty(), "{solver:?}");
    }
}

/// Halves of the block that differ by up to 600 digits: solved, or refused by name.
#[test]
fn an_enormous_contrast_of_stiffness_is_solved_or_refused() {
    for solver in SOLVERS {
        for young in [1e-12, 1e-30, 1e-150, 1e-300, 1e30, 1e300] {
            let mesh = mesh();
            let (soft, stiff) = mesh
                .topology()
                .elements()
                .partition(|&e| fluxmorph_geometry::tet4::centroid(mesh.vertices(e))[2] < 2.0);
            let subregions =
                vec![Subregion { young, ..Subregion::new("below", soft) }, Subregion::new("above", stiff)];
            match Motion::new(mesh.clone(), setup(&mesh, solver, subregions)) {
                Ok(motion) => match motion.moved(&top(&motion, [0.0, 0.0, -0.1])) {
                    Ok(moved) => assert!(moved.displacement.iter().flatten().all(|u| u.is_finite())),
                    Err(error) => assert!(
                        matches!(
                            error,
                            RemeshError::NotConverged { .. }
                                | RemeshError::NotFinite { .. }
                                | RemeshError::Inverted { .. }
                        ),
                        "{solver:?} {young:e}: {error}"
                    ),
                },
                Err(error) => assert!(
                    matches!(error, RemeshError::Mesh(MeshError::Factorisation { .. })),
                    "{solver:?} {young:e}: {error}"
                ),
            }
        }
    }
}

#[test]
fn a_body_that_is_nearly_incompressible_is_solved_or_said_not_to_converge() {
    for poisson in [0.499, 0.499_999_9, 0.499_999_999_999_9] {
        let mesh = mesh();
        let subregions = vec![Subregion { poisson, ..whole(&mesh).remove(0) }];
        let made = Motion::new(mesh.clone(), setup(&mesh, SolverChoice::ComponentBlocks, subregions));
        match made.and_then(|motion| motion.displacement(&top(&motion, [0.0, 0.0, -0.1]))) {
            Ok(step) => assert!(step.iter().flatten().all(|u| u.is_finite())),
            Err(RemeshError::NotConverged { residual, tolerance, iterations, .. }) => {
                assert!(residual.is_finite() && residual > tolerance && iterations > 0);
            }
            Err(error) => panic!("{poisson}: {error}"),
        }
    }
}

#[test]
fn a_force_that_overflows_is_refused() {
    for solver in SOLVERS {
        let mesh = mesh();
        // On the softest law there is.
        let pushed = Subregion { young: 1e-200, force: [0.0, 0.0, 1e200], ..whole(&mesh).remove(0) };
        let error = ElasticMap::new(&mesh, setup(&mesh, solver, vec![pushed])).unwrap_err();
        let named = matches!(
            error,
            RemeshError::NotFinite { .. }
                | RemeshError::NotConverged { .. }
                | RemeshError::Mesh(MeshError::Factorisation { .. })
        );
        assert!(named, "{solver:?}: {error}");
    }
}

#[test]
fn a_motion_through_the_floor_names_the_element_and_how_far_it_may_go() {
    let motion = motion(SolverChoice::Direct);
    let design = top(&motion, [0.0, 0.0, -6.0]);
    let error = motion.moved(&design).unwrap_err();
    let RemeshError::Inverted { fraction, .. } = error else { panic!("{error}") };
    // The sides are held: the uppermost layer of unit cells takes all of it.
    assert!((0.1..0.2).contains(&fraction), "{fraction}");
    let share = |share: f64| top(&motion, [0.0, 0.0, -6.0 * share]);
    assert!(
        motion.moved(&share(0.999 * fraction)).is_ok() && motion.moved(&share(1.001 * fraction)).is_err()
    );
}

#[test]
fn a_path_that_is_no_number_ends_with_an_error() {
    let motion = motion(SolverChoice::Direct);
    let nodes = motion.map().design_nodes().len();
    let path = |t: f64| vec![[0.0, 0.0, if t > 0.5 { f64::NAN } else { 0.0 }]; nodes];
    assert!(matches!(motion.carried_along(&path), Err(RemeshError::NotFinite { .. })));
}

#[test]
fn steps_that_are_no_numbers_invert_at_once_and_make_no_mesh() {
    let mesh = mesh();
    for bad in [f64::NAN, f64::INFINITY, 1e200] {
        let mut displacement = vec![[0.0; 3]; mesh.points().len()];
        displacement[40] = [0.0, bad, -bad];
        assert!(step_to_inversion(&mesh, &displacement).step.abs() < 1e-100, "{bad}");
        let error = check_step(&mesh, &displacement).unwrap_err();
        match error {
            RemeshError::Mesh(MeshError::NotFinite { node, .. }) => {
                assert!(node.index() == 40 && !bad.is_normal())
            }
            RemeshError::Inverted { fraction, .. } => {
                assert!(bad.is_normal() && (0.0..1e-100).contains(&fraction))
            }
            other => panic!("{other}"),
        }
    }
}
