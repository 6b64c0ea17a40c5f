//! Volume and thickness of a plate; Taylor remainders of both are in `gradient`.

use fluxmorph::build::{Mode, Setup, set_up};
use fluxmorph_optimizer::constraint::{Constraint, Limit, Quantity};
use fluxmorph_optimizer::geometric::{MARGIN, ThicknessBound, ThicknessLimit};
use fluxmorph_optimizer::problem::Problem;
use fluxmorph_solver::functional::Volume;

use crate::problems::variables;
use crate::support::{self, parsed, repository_text, setup};

fn shield(overrides: &[&str]) -> Setup {
    setup("shield_quick.toml", overrides)
}

/// A design inside the bounds that is flat nowhere.
fn wavy(problem: &Problem) -> Vec<f64> {
    (0..variables(problem)).map(|k| 4e-3 + 3e-3 * (1.7 * k as f64).sin()).collect()
}

const MESHED: [&str; 2] = ["regions.plate.model=\"volume\"", "remesh.region=[\"plate\", \"remesh\"]"];

fn volume(setup: &Setup) -> Volume {
    Volume::new(setup.problem.original(), &setup.full_mesh, "plate").expect("a plate has a volume")
}

#[test]
fn a_quarter_plate_has_its_volume_and_grows_with_its_face() {
    for overrides in [&[][..], &MESHED] {
        let setup = shield(overrides);
        let (problem, plate) = (&setup.problem, volume(&setup));
        let shape = problem.shape().expect("a shape");
        let uniform = vec![3e-3; shape.surface().variable_count()];
        let moved = problem.moved(&uniform).expect("inside the bounds");
        let quantity = Quantity::Volume(plate.clone());
        let limit = Constraint { name: "volume".to_owned(), quantity, limit: Limit::AtMost(1.0) };
        let (value, gradient) = limit.of_shape(&moved, shape).expect("a direct solve").expect("of the shape");
        // 120 × 240 × (10 + 3) mm³; a uniform motion sweeps the face of 120 × 240 mm².
        assert!((value - 0.12 * 0.24 * 0.013).abs() < 1e-12 * value, "{value}");
        let swept: f64 = gradient.iter().sum();
        assert!((swept - 0.12 * 0.24).abs() < 1e-12, "{swept}");
        let mass = plate.with_density(7850.0).value(&moved.mesh);
        assert!((mass - 7850.0 * value).abs() < 1e-12 * mass);
    }
}

fn bound_of(setup: &Setup, limit: ThicknessLimit) -> ThicknessBound {
    ThicknessBound::new(setup.problem.shape().expect("a shape"), limit).expect("a thickness")
}

/// A bound and its gradient at a design.
fn evaluate(setup: &Setup, bound: &ThicknessBound, p: &[f64]) -> (f64, Vec<f64>) {
    let moved = setup.problem.moved(p).expect("inside the bounds");
    bound.evaluate(setup.problem.shape().expect("a shape"), &moved).expect("a direct solve")
}

/// Least and greatest thickness of a design.
fn range(setup: &Setup, p: &[f64]) -> (f64, f64) {
    let shape = setup.problem.shape().expect("a shape");
    let mesh = setup.problem.moved(p).expect("inside the bounds").mesh;
    shape.thickness().expect("a plate has one").range(&mesh)
}

#[test]
fn the_bound_is_conservative_by_no_more_than_its_margin() {
    let setup = shield(&[]);
    let p = wavy(&setup.problem);
    let (least, most) = range(&setup, &p);
    for (limit, excess, value) in [
        (ThicknessLimit::Minimum(0.012), 0.012 - least, 0.012),
        (ThicknessLimit::Maximum(0.014), most - 0.014, 0.014),
    ] {
        let (found, _) = evaluate(&setup, &bound_of(&setup, limit), &p);
        assert!(excess <= found && found <= excess + MARGIN * value, "{limit:?}: {excess} {found}");
    }
}

#[test]
fn a_uniform_plate_meets_its_limit_by_the_margin() {
    let setup = shield(&[]);
    let bound = bound_of(&setup, ThicknessLimit::Minimum(0.008));
    let (value, gradient) = evaluate(&setup, &bound, &vec![0.0; variables(&setup.problem)]);
    // 8 mm − 10 mm, and all nodes count alike: the whole margin of 0.08 mm.
    assert!((value + 0.002 - 0.00008).abs() < 1e-12, "{value}");
    let sum: f64 = gradient.iter().sum();
    assert!((sum + 1.0).abs() < 1e-12, "a uniform motion changes all alike: {sum}");
}

#[test]
fn linear_limits_and_bounds_keep_the_smooth_bound() {
    let (grid, surface) = ("grid = [7, 13]\n", "surface = \"plate_bottom\"\ndirection = [0.0, 0.0, -1.0]");
    let both = "surface = [\"plate_bottom\", \"plate_top\"]\ndirection = \"normal\"";
    let meshed = [
        ("model = \"impedance\"", "model = \"volume\""),
        ("region = \"remesh\"", "region = [\"plate\", \"remesh\"]"),
        ("lower = \"-5 mm\"", "lower = \"-4 mm\""),
    ];
    let free = (grid, "filter_radius = 0\n");
    for (changes, has_limits) in
        [(&[free][..], false), (&[(grid, "grid = [5, 9]\n")], true), (&[free, (surface, both)], true)]
    {
        let text = repository_text("configs/shield_quick.toml");
        let (config, source) = parsed(&support::changed(&text, &[&meshed[..], changes].concat()));
        let mut setup =
            set_up(&config, &source, Mode::Optimisation).unwrap_or_else(|error| panic!("{error}"));
        let count = variables(&setup.problem);
        for (limit, step) in [(ThicknessLimit::Minimum(0.008), -1e-4), (ThicknessLimit::Maximum(0.012), 1e-4)]
        {
            let mut bound = bound_of(&setup, limit);
            bound.restrict(setup.problem.shape_mut().expect("a shape"));
            let shape = setup.problem.shape().expect("a shape");
            let (lower, upper) = (shape.lower().to_vec(), shape.upper().to_vec());
            let excess = |p: &[f64]| {
                let limits = bound.limits(p).expect("linear ones");
                assert_eq!(!limits.is_empty(), has_limits, "{changes:?}");
                let beyond = |k: usize| (lower[k] - p[k]).max(p[k] - upper[k]);
                let of_bounds = (0..count).map(beyond).fold(f64::NEG_INFINITY, f64::max);
                limits.iter().map(|(c, _)| *c).fold(of_bounds, f64::max)
            };
            // Up to where the first of them ends the way.
            let mut p = vec![0.0; count];
            while excess(&p) <= 0.0 {
                p.iter_mut().enumerate().for_each(|(k, p)| *p += step * (1.0 + 0.3 * (k as f64).sin()));
            }
            let (beyond, _) = evaluate(&setup, &bound, &p);
            p.iter_mut().enumerate().for_each(|(k, p)| *p -= step * (1.0 + 0.3 * (k as f64).sin()));
            let (within, _) = evaluate(&setup, &bound, &p);
            println!("{changes:?}, {limit:?}: {within} {beyond}");
            assert!(within <= 0.0 && within > -1e-3 && within < beyond, "{within} {beyond}");
            // The derivatives of the limits are those of their values.
            let q: Vec<f64> = p.iter().enumerate().map(|(k, p)| p + 1e-3 * (k as f64).cos()).collect();
            let [here, there] = [&p, &q].map(|p| bound.limits(p).expect("linear ones"));
            for ((c, gradient), (d, _)) in here.iter().zip(&there) {
                let change: f64 = gradient.iter().zip(&q).zip(&p).map(|((g, q), p)| g * (q - p)).sum();
                assert!((d - c - change).abs() < 1e-12, "{c} {d} {change}");
            }
        }
    }
    let mut free = shield(&FREE);
    let mut bound = bound_of(&free, ThicknessLimit::Minimum(0.008));
    bound.restrict(free.problem.shape_mut().expect("a shape"));
    assert!(
        bound.limits(&vec![0.0; variables(&free.problem)]).is_none(),
        "the map decides about the upper face"
    );
    // In its own plane it may slide.
    let mut sliding = shield(&[MESHED[0], MESHED[1], "remesh.slide=[\"plate_top\"]"]);
    bound.restrict(sliding.problem.shape_mut().expect("a shape"));
    assert!(bound.limits(&vec![0.0; variables(&sliding.problem)]).is_some(), "it stays as far away");
}

/// A limit of micrometres is held as one of metres, to a hundredth.
#[test]
fn a_small_limit_gives_away_a_hundredth_of_itself() {
    let setup = shield(&[]);
    let p = vec![0.0; variables(&setup.problem)];
    for limit in [3e-7, 3e-3] {
        let (found, _) = evaluate(&setup, &bound_of(&setup, ThicknessLimit::Minimum(limit)), &p);
        let given_away = found - (limit - 0.01);
        assert!((given_away / (MARGIN * limit) - 1.0).abs() < 1e-6, "{limit}: {given_away}");
    }
}

/// The upper face of the plate follows the elastic body.
const FREE: [&str; 3] = [MESHED[0], MESHED[1], "remesh.free=[\"plate_top\"]"];

#[test]
fn a_thickness_counts_the_motion_of_the_opposite_face() {
    let [held, free] = [&MESHED[..], &FREE].map(|overrides| {
        let setup = shield(overrides);
        let p = wavy(&setup.problem);
        let mesh = setup.problem.moved(&p).expect("inside the bounds").mesh;
        // Along z, straight from the coordinates: from every node of the lower face to the upper one above it.
        let height = |name: &str| -> Vec<[f64; 3]> {
            let surface = mesh.topology().surface(name).expect("a face of the plate");
            let nodes: std::collections::BTreeSet<_> = surface.iter().flatten().copied().collect();
            nodes.into_iter().map(|n| mesh.point(n)).collect()
        };
        let (bottom, top) = (height("plate_bottom"), height("plate_top"));
        let across = |p: &[f64; 3]| {
            let beside = |q: &&[f64; 3]| (q[0] - p[0]).hypot(q[1] - p[1]);
            let above = top.iter().min_by(|a, b| beside(a).total_cmp(&beside(b))).expect("a node");
            above[2] - p[2]
        };
        let least = bottom.iter().map(across).fold(f64::INFINITY, f64::min);
        (range(&setup, &p).0, least)
    });
    println!("held {held:?}, free {free:?}");
    // Held, the nodes of both faces lie above each other.
    assert!((held.0 - held.1).abs() < 1e-12, "{held:?}");
    // Free, nodes slip sideways by a share of a millimetre, on a face that slopes by a tenth.
    assert!((free.0 - free.1).abs() < 1e-4, "{free:?}");
    assert!((free.0 - held.0).abs() > 1e-3, "the upper face follows the lower one: {free:?} {held:?}");
}
