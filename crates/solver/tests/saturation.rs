//! Iron with a B–H law: the linear limit, Newton's convergence, and derivatives against differences, for all elements.

use std::sync::Arc;

use fluxmorph_geometry::fem::c64;
use fluxmorph_geometry::tet4::Point;
use fluxmorph_geometry::{ElementId, Mesh, RegionId};
use fluxmorph_solver::coil::{Coil, Corner, Racetrack};
use fluxmorph_solver::element::Complex3;
use fluxmorph_solver::functional::{Follow, Observed, Weighting};
use fluxmorph_solver::linear::{LinearSolver, LinearSolverCache, LinearSolverSettings, Method, SolverEvent};
use fluxmorph_solver::material::VACUUM_PERMEABILITY;
use fluxmorph_solver::newton::NewtonProgress;
use fluxmorph_solver::{
    BhCurve, ElementFamily, FieldModel, FieldModelSetup, Functional, Material, Order, RigidMotion,
    SolverError,
};

use crate::{ALL, OUTSIDE, derivatives_match, flux_parallel, lines, painted};

/// An iron block under a coil, with cells of air that are observed; some hundred nodes.
fn mesh() -> Mesh {
    let region = |x: Point| {
        let iron = (0.02..0.04).contains(&x[2]) && x[0] > 0.012 && x[1] > 0.012 && x[0] < 0.048;
        u32::from(iron) + 2 * u32::from(x[2] < 0.01 && x[0] < 0.03)
    };
    painted([lines(5, 0.012), lines(5, 0.012), lines(7, 0.01)], &["air", "iron", "observed"], region)
}

/// A law that saturates at 1.8 T with an initial permeability of 2000, in steps of a tenth of its field strength.
pub(crate) fn law() -> BhCurve {
    let point = |i: i32| {
        let h = 20.0 * (1.3_f64.powi(i) - 1.0);
        [h, VACUUM_PERMEABILITY * h + 1.8 * (1.0 - (-h / 700.0).exp())]
    };
    BhCurve::new(&(0..32).map(point).collect::<Vec<_>>()).expect("a sound table")
}

/// The law of a linear material as a table.
pub(crate) fn straight(material: Material) -> BhCurve {
    BhCurve::new(&[0.3, 1.0, 9.0].map(|b| [b * material.reluctivity(), b])).expect("a sound table")
}

fn setup((family, order): (ElementFamily, Order), iron: Material, bh: Option<BhCurve>) -> FieldModelSetup {
    let shape = Racetrack::new([0.03, 0.03, 0.06], 2, [0.008, 0.008], 0.01, 0.01, Corner::Mitred)
        .expect("a racetrack inside the mesh");
    FieldModelSetup {
        family,
        order,
        materials: vec![Material::AIR, iron, Material::AIR],
        bh: vec![None, bh.map(Arc::new)],
        coils: vec![Coil { name: "coil".to_owned(), ampere_turns: c64::from(600e3), shape: shape.into() }],
        boundaries: flux_parallel(&OUTSIDE),
        // Differences of functionals need the last digits.
        linear_solver: LinearSolverSettings { tolerance: 1e-13, ..LinearSolverSettings::default() },
        ..FieldModelSetup::default()
    }
}

/// The material of the linear part: any one will do.
const SOFT: Material = Material { relative_permeability: 2000.0, conductivity: 0.0 };

/// The largest difference of two fields, one times a factor, of the largest of the first.
fn off(field: &[Complex3], factor: c64, other: &[Complex3]) -> f64 {
    let largest = field.iter().flatten().map(|c| c.norm()).fold(0.0, f64::max);
    let off = field.iter().flatten().zip(other.iter().flatten()).map(|(a, b)| (a * factor - b).norm());
    off.fold(0.0, f64::max) / largest
}

#[test]
fn a_straight_table_gives_the_field_of_the_linear_material() {
    let mesh = mesh();
    let steel = Material { relative_permeability: 500.0, conductivity: 0.0 };
    let straight = straight(steel);
    for elements in ALL {
        // Of nodal elements with the same penalty, of edge elements with any linear part.
        let part = if elements.0 == ElementFamily::Nodal { steel } else { SOFT };
        let solved = |iron: Material, bh: Option<BhCurve>| {
            let (model, solution) = crate::solved(&mesh, setup(elements, iron, bh));
            (solution.flux_densities(&model, &mesh), solution.newton_steps())
        };
        let (linear, _) = solved(steel, None);
        let (newton, steps) = solved(part, Some(straight.clone()));
        assert!((1..=3).contains(&steps), "{steps}");
        let worst = off(&linear, 1.0.into(), &newton);
        assert!(worst < 1e-10, "{elements:?}: {worst:e}");
    }
}

#[test]
fn newton_converges_to_the_same_field_whatever_the_linear_part() {
    let mesh = mesh();
    for elements in ALL {
        let solved = |relative_permeability: f64| {
            let iron = Material { relative_permeability, conductivity: 0.0 };
            let model = FieldModel::new(&mesh, setup(elements, iron, Some(law()))).expect("a sound problem");
            let mut progress: Vec<NewtonProgress> = Vec::new();
            let observer = &mut |step| progress.push(step);
            let solved = model.solve_nonlinear(&mesh, (&mut LinearSolverCache::default(), None), observer);
            (solved.expect("it converges").0.flux_densities(&model, &mesh), progress)
        };
        let (field, progress) = solved(2000.0);
        let residuals: Vec<String> =
            progress.iter().map(|p| format!("{:.1e}/{}", p.residual, p.damping)).collect();
        let iron = mesh.topology().elements_of(RegionId(1));
        let most = iron.iter().map(|e| field[e.index()].iter().map(|c| c.norm_sqr()).sum::<f64>().sqrt());
        let most = most.fold(0.0, f64::max);
        println!("{elements:?}: up to {most:.2} T, {residuals:?}");
        assert!(most > 2.0, "it saturates");
        assert!(progress.len() <= 16, "{elements:?}: {} steps", progress.len() - 1);
        let energies: Vec<f64> = progress.iter().filter_map(|p| p.energy).collect();
        assert!(energies.len() == progress.len(), "statics minimise it");
        assert!(energies.windows(2).all(|pair| pair[1] <= pair[0] + 1e-9 * pair[0].abs()));
        if elements.0 == ElementFamily::Edge {
            let (other, _) = solved(50.0);
            // The residuals of two solutions to 1e-13, over the conditioning of the block.
            assert!(off(&field, 1.0.into(), &other) < 1e-9);
        }
    }
}

/// A smooth motion of the inside of the mesh off the coil.
fn velocity([x, y, z]: Point) -> Point {
    let bump = |x: f64, l: f64| (std::f64::consts::PI * x / l).sin();
    let height = if z < 0.0501 { bump((z - 0.01).max(0.0), 0.04).max(0.0) } else { 0.0 };
    let shift = bump(x, 0.06) * bump(y, 0.06) * height;
    [0.4 * shift, -0.3 * shift, shift]
}

#[test]
fn derivatives_of_every_functional_match_differences() {
    of_every_functional(0.0, Material { conductivity: 0.0, ..SOFT }, &ALL);
}

/// Iron of a tenth of the conductivity of steel, whose skin at 50 Hz is a few millimetres where it does not saturate.
const LOSSY: Material = Material { conductivity: 5e5, ..SOFT };

#[test]
fn derivatives_of_every_functional_of_a_phasor_match_differences() {
    of_every_functional(50.0, LOSSY, &[ALL[0], ALL[2]]);
}

#[test]
#[ignore = "minutes: dozens of steps of Newton's method for every difference"]
fn so_do_those_of_a_phasor_on_quadratic_elements() {
    of_every_functional(50.0, LOSSY, &[ALL[1], ALL[3]]);
}

/// At a frequency [Hz].
fn of_every_functional(frequency: f64, iron_material: Material, families: &[(ElementFamily, Order)]) {
    let start = mesh();
    let direction: Vec<Point> = start.points().iter().copied().map(velocity).collect();
    let topology = start.topology();
    let moving: Vec<ElementId> =
        topology.elements().filter(|&e| start.vertices(e).iter().all(|x| x[2] < 0.0501)).collect();
    for &elements in families {
        let setup = FieldModelSetup { frequency, ..setup(elements, iron_material, Some(law())) };
        let model = FieldModel::new(&start, setup).expect("a sound problem");
        let observed = topology.region("observed").expect("it is named");
        let iron = topology.region("iron").expect("it is named");
        let square = Observed::Deviation { target: [0.0; 3], weighting: Weighting::Volume };
        let functionals = [
            Functional::observation(&start, observed, square, Follow::Held),
            Functional::observation(
                &start,
                observed,
                Observed::Component { direction: [0.0, 0.0, 1.0] },
                Follow::Held,
            ),
            Functional::energy(&model, None),
            Functional::energy(&model, Some(iron)),
            Functional::force(&model, &start, "iron", &[iron], RigidMotion::Translation([0.36, 0.48, 0.8])),
            Functional::force(
                &model,
                &start,
                "iron",
                &[iron],
                RigidMotion::Rotation { axis: [0.6, 0.0, 0.8], about: [0.01, 0.05, 0.0] },
            ),
        ]
        .map(|functional| functional.expect("a functional"))
        .into_iter()
        .chain((frequency > 0.0).then(|| Functional::loss(&model, "iron").expect("it conducts")))
        .collect::<Vec<_>>();
        derivatives_match(&model, &start, &functionals, (&moving, &direction, 5e-7));
    }
}

/// Where the field is weak the law is straight, and a phasor is solved as with the linear material.
#[test]
fn a_straight_table_gives_the_phasor_of_the_linear_material() {
    let mesh = mesh();
    let steel = Material { relative_permeability: 500.0, conductivity: 2e6 };
    let straight = straight(steel);
    for elements in ALL {
        let part =
            if elements.0 == ElementFamily::Nodal { steel } else { Material { conductivity: 2e6, ..SOFT } };
        let solved = |iron: Material, bh: Option<BhCurve>| {
            let mut setup = FieldModelSetup { frequency: 50.0, ..setup(elements, iron, bh) };
            // Far below the end of the table, also where eddy currents crowd the field.
            setup.coils[0].ampere_turns *= 0.02;
            let (model, solution) = crate::solved(&mesh, setup);
            solution.flux_densities(&model, &mesh)
        };
        let (linear, newton) = (solved(steel, None), solved(part, Some(straight.clone())));
        let worst = off(&linear, 1.0.into(), &newton);
        println!("{elements:?}: {worst:.1e}");
        assert!(worst < 1e-9, "{elements:?}: {worst:e}");
    }
}

/// Without eddy currents all phasors have the phase of the current, and their amplitude is the static field of that current.
#[test]
fn the_phasor_of_iron_that_does_not_conduct_is_the_static_field_of_its_amplitude() {
    let mesh = mesh();
    for elements in ALL {
        let solved = |frequency: f64, phase: c64| {
            let mut setup = FieldModelSetup { frequency, ..setup(elements, SOFT, Some(law())) };
            setup.coils[0].ampere_turns *= phase;
            let model = FieldModel::new(&mesh, setup).expect("a sound problem");
            let mut progress: Vec<NewtonProgress> = Vec::new();
            let observer = &mut |step| progress.push(step);
            let solved = model.solve_nonlinear(&mesh, (&mut LinearSolverCache::default(), None), observer);
            let residuals: Vec<String> =
                progress.iter().map(|p| format!("{:.1e}/{}", p.residual, p.damping)).collect();
            println!("{elements:?}, {frequency} Hz: {residuals:?}");
            solved.expect("it converges").0.flux_densities(&model, &mesh)
        };
        let phase = c64::from_polar(1.0, 0.6);
        let (at_rest, phasor) = (solved(0.0, c64::from(1.0)), solved(50.0, phase));
        let worst = off(&at_rest, phase, &phasor);
        assert!(worst < 1e-8, "{elements:?}: {worst:e}");
    }
}

#[test]
fn laws_are_refused_where_they_have_no_meaning() {
    let mesh = mesh();
    let refused = |change: &dyn Fn(&mut FieldModelSetup)| {
        let mut setup = setup(ALL[2], SOFT, Some(law()));
        change(&mut setup);
        match FieldModel::new(&mesh, setup) {
            Err(SolverError::Parameter { what, .. }) => what,
            other => panic!("{other:?}"),
        }
    };
    assert_eq!(refused(&|setup| setup.remanence = vec![[0.0; 3], [0.0, 0.0, 1.0]]), "remanence");
    assert_eq!(refused(&|setup| setup.bh.extend([None, None])), "number of B–H laws");
}

/// The iron under the coil, cut by a slit so narrow that its elements are nearly flat.
fn slit_mesh(width: f64) -> Mesh {
    let mut z = lines(7, 0.01);
    z.extend([0.03 + width, 0.03 + 2.0 * width]);
    z.sort_by(f64::total_cmp);
    let region = |x: Point| {
        let iron = (0.02..0.04).contains(&x[2]) && !(0.03..0.03 + width).contains(&x[2]);
        u32::from(iron && x[0] > 0.012 && x[1] > 0.012 && x[0] < 0.048)
    };
    painted([lines(5, 0.012), lines(5, 0.012), z], &["air", "iron"], region)
}

/// Its own solutions are as good as rounding lets them be: right sides that are rounding themselves have none to the last digit.
#[test]
fn a_state_beside_nearly_flat_elements_is_found_whatever_the_linear_method() {
    let mesh = slit_mesh(1e-7);
    for elements in [ALL[0], ALL[2]] {
        let fields = [Method::RealFactorSingle, Method::Direct].map(|method| {
            let mut setup = setup(elements, SOFT, Some(law()));
            setup.materials.truncate(2);
            setup.linear_solver = LinearSolverSettings {
                method: LinearSolver::Fixed(method),
                ..LinearSolverSettings::default()
            };
            let model = FieldModel::new(&mesh, setup).expect("a sound problem");
            let (state, system) =
                model.solve(&mesh).unwrap_or_else(|e| panic!("{elements:?} {method:?}: {e}"));
            println!("{elements:?} {method:?}: {:?}, {:?}", state.report(), system.events());
            state.flux_densities(&model, &mesh)
        });
        let worst = off(&fields[1], 1.0.into(), &fields[0]);
        println!("{elements:?}: {worst:.1e}");
        assert!(worst < 1e-4, "{elements:?}: {worst:e}");
    }
}

/// What happened in the system of a step is said with the state.
#[test]
fn a_method_that_fails_within_a_step_is_named() {
    let mesh = mesh();
    let mut setup = setup(ALL[2], SOFT, Some(law()));
    setup.linear_solver = LinearSolverSettings {
        method: LinearSolver::Fixed(Method::Incomplete),
        max_iterations: Some(4),
        ..LinearSolverSettings::default()
    };
    let model = FieldModel::new(&mesh, setup).expect("a sound problem");
    let (_, system) = model.solve(&mesh).expect("factors need no more");
    let SolverEvent::FellBack { from, to, .. } = &system.events()[0];
    assert_eq!((*from, *to), (Method::Incomplete, Method::RealFactorSingle));
    assert_eq!(system.events().len(), 1, "{:?}", system.events());
}
