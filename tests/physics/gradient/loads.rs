//! Several loads in one problem: sums, single loads and the worst of them have exact gradients, whatever drives the coils; loads
//! of one frequency share a matrix, and what they share changes no result.

use fluxmorph_optimizer::problem::{Analysis, Problem};
use fluxmorph_optimizer::verify::Settings;

use super::{MESHED, all_hold, all_hold_on, uneven, wavy};
use crate::problems::analysed;
use crate::support::device::COILS;
use crate::support::folder::read_text;
use crate::support::{changed, repository, setup, setup_of};

/// The objective of that device.
const COUPLING: &str = "goal = \"maximise\"\nkind = \"coupling\"\ncoils = [\"one\", \"two\"]\n";

/// Two loads of one frequency and one of another.
const LOADS: &str = r#"
loads = [
    { name = "both" },
    { name = "reversed", ampere_turns = { two = "-60 A" }, phase = { two = "0 deg" } },
    { name = "fast", frequency = "500 Hz", amplitude = 0.5, ampere_turns = { two = "0 A" } },
]
"#;

/// Terms of some loads and of all.
const TERMS: &str = r#"
terms = [
    { kind = "loss", region = "plate", load = "reversed", weight = 2 },
    { kind = "energy", load = "both", weight = 100 },
    { kind = "flux_linkage", coils = ["two"], weight = 800 },
    { kind = "resistance", coils = ["one"], load = "fast" },
]
"#;

/// Constraints of some loads and of all.
const BOUNDS: &str = r#"
constraints = [
    { kind = "loss", region = "plate", upper_ratio = 2 },
    { name = "loss_fast", kind = "loss", region = "plate", load = "fast", upper_ratio = 2 },
    { kind = "voltage", coils = ["one"], load = "reversed", upper_ratio = 2 },
    { kind = "coupling", coils = ["one", "two"], load = "reversed", upper = 1 },
]
"#;

/// The device with an objective, and with lists before its tables.
fn problem(objective: &str, lists: &str) -> Problem {
    setup_of(&format!("{lists}{}", changed(COILS, &[(COUPLING, objective)]))).problem
}

#[test]
fn sums_over_loads_and_quantities_of_one_are_exact() {
    let problem = problem(TERMS, &format!("{LOADS}{BOUNDS}"));
    assert_eq!(problem.states().len(), 3);
    let states = problem.states();
    assert!(states[0].shares_matrix_with(&states[1]) && !states[0].shares_matrix_with(&states[2]));
    let analysis = analysed(&problem, &uneven(&problem));
    for (term, value) in problem.objective().expect("an objective").terms.iter().zip(&analysis.terms) {
        let share = term.weight * value / analysis.objective.expect("an objective");
        println!("{} {:?}: {share:.3}", term.label.kind, term.label.load);
        assert!(share > 0.05, "every term has a say");
    }
    all_hold_on(&problem, uneven);
}

/// The worse of the losses under two loads, the second one with a weight.
fn worse_of_two(weight: f64) -> Problem {
    let terms = format!(
        "combine = \"worst_case\"\n[[objective.terms]]\nkind = \"loss\"\nregion = \"plate\"\nload = \"both\"\n\
         [[objective.terms]]\nkind = \"loss\"\nregion = \"plate\"\nload = \"fast\"\nweight = {weight:e}\n"
    );
    problem(&terms, LOADS)
}

/// Where two terms are equal the worst of them has a kink, and what is certified is the one whose gradient is taken.
#[test]
fn the_gradient_at_a_tie_is_that_of_one_term() {
    let alone = worse_of_two(1.0);
    let [both, fast] = analysed(&alone, &uneven(&alone)).member_values()[..] else { panic!("two terms") };
    let tied = worse_of_two(both / fast);
    let [first, second] = analysed(&tied, &uneven(&tied)).member_values()[..] else { panic!("two terms") };
    assert!((first / second - 1.0).abs() < 1e-14);
    all_hold_on(&tied, uneven);
}

/// Either term of a worst case has its own exact gradient, on both sides of where they meet.
#[test]
fn the_worst_of_loads_has_the_gradient_of_that_load() {
    for (weight, worst) in [(1.0, "both"), (40.0, "fast")] {
        let problem = worse_of_two(weight);
        let analysis = analysed(&problem, &uneven(&problem));
        let objective = problem.objective().expect("an objective");
        let values: Vec<f64> = analysis.members.iter().map(|member| member.value).collect();
        println!("{values:?}");
        assert_eq!(objective.terms[objective.worst(&values)].label.load.as_deref(), Some(worst));
        all_hold_on(&problem, uneven);
    }
}

/// Without `load` a term of a worst case is one under each load.
#[test]
fn a_worst_case_is_over_all_loads() {
    let terms = "combine = \"worst_case\"\nkind = \"loss\"\nregion = \"plate\"\n";
    let problem = problem(terms, LOADS);
    let labels = problem.objective().expect("an objective").terms.iter();
    let loads: Vec<&str> = labels.filter_map(|term| term.label.load.as_deref()).collect();
    assert_eq!(loads, ["both", "reversed", "fast"]);
}

/// An open secondary under one load, short-circuited under the other, while voltage or current drives the primary: the circuits
/// on the shared matrix are others under each.
const DRIVEN: [&str; 3] = [
    r#"{ name = "open", voltage = { one = "1 V" }, ampere_turns = { two = "0 A" } }"#,
    r#"{ name = "short", voltage = { two = "0 V" } }"#,
    r#"{ name = "both", voltage = { one = "2 V", two = "1 V" }, phase = { two = "60 deg" } }"#,
];

/// What is bounded, each under the load of that place.
const OF_DRIVEN: [(usize, &str); 4] = [
    (0, r#"{ kind = "current", coils = ["one"], load = "open", upper_ratio = 2 }"#),
    (1, r#"{ kind = "current", coils = ["two"], load = "short", upper_ratio = 2 }"#),
    (2, r#"{ kind = "power", coils = ["one"], load = "both", upper_ratio = 2 }"#),
    (0, r#"{ kind = "voltage", coils = ["two"], load = "open", upper_ratio = 2 }"#),
];

#[test]
fn loads_that_voltages_drive_are_exact_and_those_of_each_alone() {
    let of = |loads: &str, bounds: &str| {
        let lists = format!("loads = [{loads}]\nconstraints = [{bounds}]\n");
        problem("kind = \"loss\"\nregion = \"plate\"\n", &lists)
    };
    let together = of(&DRIVEN.join(", "), &OF_DRIVEN.map(|(_, bound)| bound).join(", "));
    let states = together.states();
    assert!(states[0].shares_matrix_with(&states[1]) && states[1].shares_matrix_with(&states[2]));
    let p = uneven(&together);
    let values: Vec<f64> = analysed(&together, &p).constraints.iter().map(|c| c.value).collect();
    // Each load as the only one of a device of its own.
    assert_eq!(values.len(), OF_DRIVEN.len());
    for ((load, bound), value) in OF_DRIVEN.into_iter().zip(values) {
        let own = analysed(&of(DRIVEN[load], bound), &p).constraints[0].value;
        println!("{own:e} {value:e}");
        // Both within the tolerance of the linear solver.
        assert!((own / value - 1.0).abs() < 1e-10, "{own:e} {value:e}");
    }
    all_hold_on(&together, uneven);
}

/// In a linear problem the field under all currents is the sum of those under each.
#[test]
fn fields_under_loads_of_one_frequency_superpose() {
    let loads = r#"
loads = [
    { name = "both" },
    { name = "one", ampere_turns = { two = "0 A" } },
    { name = "two", ampere_turns = { one = "0 A" } },
]
"#;
    let problem = problem("kind = \"energy\"\n", loads);
    let analysis = analysed(&problem, &uneven(&problem));
    let [both, one, two] = [0, 1, 2].map(|k| analysis.solutions[k].values());
    let size = both.iter().map(|u| u.norm_sqr()).sum::<f64>().sqrt();
    let rest = both.iter().zip(one).zip(two).map(|((u, a), b)| (u - a - b).norm_sqr()).sum::<f64>().sqrt();
    println!("{:e}", rest / size);
    assert!(rest < 1e-10 * size, "the linear solver leaves 1e-13 of each residual");
}

/// Loads of the coils as they are, one at each frequency, are the frequencies: the same bits.
#[test]
fn loads_of_equal_sources_are_frequencies() {
    let several = setup("shield_two_frequencies.toml", &[]).problem;
    let text = read_text(&repository("configs/shield_two_frequencies.toml"));
    let as_loads =
        "[[loads]]\nname = \"slow\"\n[[loads]]\nname = \"fast\"\nfrequency = \"200 Hz\"\n[materials.steel]";
    let text = changed(
        &text,
        &[
            ("frequencies = [\"60 Hz\", \"200 Hz\"]", "frequency = \"60 Hz\""),
            ("[materials.steel]", as_loads),
            ("frequency = \"60 Hz\"\n\n[[objective.terms]]", "load = \"slow\"\n\n[[objective.terms]]"),
            ("frequency = \"200 Hz\"\nweight = 2", "load = \"fast\"\nweight = 2"),
        ],
    );
    let loaded = setup_of(&text).problem;
    let p = wavy(&several);
    let [of_frequencies, of_loads] = [&several, &loaded].map(|problem| analysed(problem, &p));
    assert_eq!(of_frequencies.terms, of_loads.terms);
    assert_eq!(of_frequencies.gradient, of_loads.gradient);
    let values =
        |analysis: &Analysis| analysis.solutions.iter().map(|s| s.values().to_vec()).collect::<Vec<_>>();
    assert_eq!(values(&of_frequencies), values(&of_loads));
}

/// Iron with a B–H curve has a state of its own under each load, and no matrix in common with another.
#[test]
fn loads_of_saturated_iron_are_exact() {
    let overrides = [
        &MESHED[..],
        &[
            "analysis.frequency=0",
            "analysis.elements=\"edge\"",
            "mesh.shield.refinement=0.3",
            "mesh.shield.skin=[\"4 mm\"]",
            "analysis.linear_solver.tolerance=1e-13",
            "materials.steel.relative_permeability=1",
            "materials.steel={ bh = [[80, 0.1], [160, 0.3], [250, 0.6], [400, 0.95], [700, 1.25], [1500, 1.5], [4e3, 1.65], \
             [1.2e4, 1.85], [4e4, 2.08], [1e5, 2.2], [2e5, 2.36]] }",
            "loads=[{ name = \"weak\", ampere_turns = { coil = \"20 kA\" } }, { name = \"strong\", amplitude = 3 }]",
            "constraints=[\
             { kind = \"energy\", name = \"of_weak\", region = \"plate\", load = \"weak\", upper = \"1 kJ\" }, \
             { kind = \"energy\", name = \"of_strong\", region = \"plate\", load = \"strong\", upper = \"1 kJ\" }]",
        ],
    ]
    .concat();
    let problem = setup("shield_quick.toml", &overrides).problem;
    let states = problem.states();
    assert!(states.len() == 2 && !states[0].shares_matrix_with(&states[1]));
    let p = wavy(&problem);
    let analysis = analysed(&problem, &p);
    let steps: Vec<usize> = analysis.solutions.iter().map(|solution| solution.newton_steps()).collect();
    let energies: Vec<f64> = analysis.constraints.iter().map(|c| c.value).collect();
    println!("{steps:?} steps, {energies:?} J");
    assert!(steps.iter().all(|&steps| steps > 2), "both are nonlinear");
    // Six times the current: 36 times the energy if all were linear.
    assert!(energies[1] / energies[0] > 36.0 * 1.01 || energies[1] / energies[0] < 36.0 * 0.99);
    // As in `saturation`: the second derivative of h jumps at the points of the curve.
    let settings = Settings { directions: 1, difference_step: 1e-5, ..Settings::default() };
    all_hold(&problem, &p, &settings);
}
