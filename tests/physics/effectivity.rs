//! Estimated errors against errors: effectivities over families, frequencies and devices, the factor of second order, and how often
//! the truth lies within the error bar of the gain of small devices made at random. All of it is printed; docs/verification.md has
//! the tables.

use std::path::Path;

use fluxmorph::build::{Mode, set_up};
use fluxmorph::config::{Config, ElementOrder, Elements, SolverMethod, SourceMap};
use fluxmorph::run::finer::{Cut, FinerProblem};
use fluxmorph_geometry::Mesh;
use fluxmorph_optimizer::objective::Term;
use fluxmorph_optimizer::problem::{Derivatives, EnrichedModels, NoProgress, Problem, SolverCache};
use fluxmorph_solver::enrichment::Effort;

use crate::support::device::{BLOCK, COILS, SATURATED, written};
use crate::support::folder::{number, read_json};
use crate::support::program::{command, finish, fluxmorph, folder};
use crate::support::{changed, config, parsed, repository};

const BUSBAR: &str = include_str!("../../configs/busbar.toml");

/// A problem with an objective, as read.
struct Device {
    config: Config,
    source: SourceMap,
    /// The same body on a mesh whose halved edges are the reference; `None`: its own.
    reference: Option<Box<Device>>,
}

impl Device {
    fn shipped(name: &str, overrides: &[&str]) -> Self {
        let (config, source) = config(name, overrides);
        Self { config, source, reference: None }
    }

    fn block(changes: &[(&str, &str)]) -> Self {
        Self::of_text(&changed(BLOCK, changes))
    }

    fn of_text(text: &str) -> Self {
        let (config, source) = parsed(text);
        Self { config, source, reference: None }
    }

    fn of_family(&self, elements: Elements) -> Self {
        let mut config = self.config.clone();
        (config.analysis.elements, config.analysis.order) = (elements, ElementOrder::Linear);
        config.accuracy.estimate = Some(true);
        Self { config, source: self.source.clone(), reference: None }
    }

    /// The objective of the undeformed device, its estimated error, and the mesh with all regions and the one that is solved on.
    fn estimated(&self) -> Result<(f64, f64, [Mesh; 2]), String> {
        let said = |error: &dyn std::fmt::Display| error.to_string();
        let setup = set_up(&self.config, &self.source, Mode::Analysis).map_err(|e| said(&e))?;
        let problem = &setup.problem;
        let initial = problem.shape().map(|shape| vec![0.0; shape.initial().len()]).unwrap_or_default();
        let moved = problem.moved(&initial).map_err(|e| said(&e))?;
        let (cache, mut none) = (&mut SolverCache::default(), NoProgress);
        let analysis = problem.analyse(moved, Derivatives::None, cache, &mut none).map_err(|e| said(&e))?;
        let models = &mut EnrichedModels::new(Effort::Any);
        let estimate = problem.estimate_error(&analysis, models, &mut |_, _, _| {}).map_err(|e| said(&e))?;
        let value = analysis.objective.expect("an objective");
        Ok((value, estimate.objective, [setup.full_mesh.clone(), analysis.mesh]))
    }

    /// The objective by edge elements of second order on edges that are halved so often.
    fn by_second_order(&self, [full, solved]: &[Mesh; 2], halvings: u32) -> f64 {
        let mut config = self.config.clone();
        (config.analysis.elements, config.analysis.order) = (Elements::Edge, ElementOrder::Quadratic);
        (config.analysis.penalty, config.analysis.linear_solver.method) = (1.0, SolverMethod::Automatic);
        let finer = FinerProblem::new(&config, &self.source, full, Cut::Halvings(halvings))
            .unwrap_or_else(|e| panic!("{e}"));
        let analysis = finer.analyse(solved, &mut SolverCache::default()).unwrap_or_else(|e| panic!("{e}"));
        analysis.objective.expect("an objective")
    }
}

impl Device {
    /// The objective by second order on halved edges, of the mesh that the device is compared with.
    fn reference(&self, meshes: &[Mesh; 2]) -> f64 {
        let Some(other) = &self.reference else { return self.by_second_order(meshes, 1) };
        let (.., meshes) = other.of_family(Elements::Edge).estimated().unwrap_or_else(|e| panic!("{e}"));
        other.by_second_order(&meshes, 1)
    }
}

const STATIC: (&str, &str) = ("frequency = \"50 Hz\"", "frequency = 0");

const ALUMINIUM: [(&str, &str); 3] = [
    ("frequency = \"50 Hz\"", "frequency = \"200 Hz\""),
    ("relative_permeability = 100\n", ""),
    ("1e6 S/m", "3.5e7 S/m"),
];

/// Eight times the elements of the block, which is one or two cells of everything.
const CELLS: [(&str, &str); 3] = [
    ("cells = [1, 1, 1]", "cells = [2, 2, 2]"),
    ("cells = [2, 2, 1]", "cells = [4, 4, 2]"),
    ("cells = [2, 2, 1]", "cells = [4, 4, 2]"),
];

fn blocks() -> Vec<(&'static str, Device)> {
    let block = |changes: &[(&str, &str)]| Device::block(&[&CELLS[..], changes].concat());
    vec![
        ("iron block, static, μr 100", block(&[STATIC])),
        (
            "the same, μr 1000",
            block(&[STATIC, ("relative_permeability = 100\n", "relative_permeability = 1000\n")]),
        ),
        ("conducting iron block, 50 Hz", block(&[])),
        ("aluminium block, 200 Hz", block(&ALUMINIUM)),
        ("block of steel with a B–H curve, static", block(&saturated(&[STATIC]))),
        ("block of steel with a B–H curve, 50 Hz", block(&saturated(&[]))),
    ]
}

/// Steel along a curve, with further changes.
fn saturated(changes: &[(&'static str, &'static str)]) -> Vec<(&'static str, &'static str)> {
    [&SATURATED[..2], changes].concat()
}

fn devices() -> Vec<(&'static str, Device)> {
    let of_region =
        |kind: &str, region: &str| format!("objective={{ kind = \"{kind}\", region = \"{region}\" }}");
    let (loss, energy) = (of_region("loss", "sphere"), of_region("energy", "sphere"));
    let sphere = ["mesh.sphere.divisions=4", "mesh.sphere.skin=[\"3 mm\", \"8 mm\", \"18 mm\"]"];
    let plate = of_region("loss", "plate");
    let team7 = |cells| Device::shipped("team7_50hz.toml", &[cells, &plate]);
    let [coarse, fine] = ["mesh.boxes.refinement=0.25", "mesh.boxes.refinement=0.5"].map(team7);
    let team7 = Device { reference: Some(Box::new(coarse)), ..fine };
    let mut all = blocks();
    all.extend([
        ("sphere, 50 Hz, loss", Device::shipped("sphere.toml", &[sphere[0], sphere[1], &loss])),
        ("sphere, 50 Hz, energy", Device::shipped("sphere.toml", &[sphere[0], sphere[1], &energy])),
        ("iron circuit (pole)", Device::shipped("pole.toml", &[])),
        ("shield, impedance, 60 Hz", Device::shipped("shield_quick.toml", &[])),
        ("plate with a hole and loop (TEAM 7), 50 Hz, loss", team7),
    ]);
    all
}

/// A resumed run may make an estimate anew that an unbroken one made beside others.
#[test]
fn an_estimate_has_the_bits_of_one_alone_whatever_was_estimated_with_its_models_before() {
    let problem = crate::support::setup("shield_two_frequencies.toml", &[]).problem;
    let analysed = |height: f64| {
        let p = vec![height; problem.shape().expect("a design").initial().len()];
        let moved = problem.moved(&p).expect("a sound mesh");
        let cache = &mut SolverCache::default();
        problem.analyse(moved, Derivatives::None, cache, &mut NoProgress).expect("a field")
    };
    let models = &mut EnrichedModels::new(Effort::Any);
    for height in [0.0, 3e-3, 0.0] {
        let analysis = analysed(height);
        let shared = problem.estimate_error(&analysis, models, &mut |_, _, _| {}).expect("an estimate");
        let alone =
            problem.estimate_error(&analysis, &mut EnrichedModels::new(Effort::Any), &mut |_, _, _| {});
        assert_eq!(shared, alone.expect("an estimate"));
    }
}

/// Two coils over a plate that saturates, one driven by a voltage and the other short-circuited.
fn driven_coils() -> Device {
    Device::of_text(&changed(
        COILS,
        &[
            ("relative_permeability = 2\n", "relative_permeability = 20\nsaturation = \"5 mT\"\n"),
            ("ampere_turns = \"100 A\"", "voltage = \"1 V\"\nphase = \"20 deg\"\nseries_capacitance = 0.2"),
            ("ampere_turns = \"20 A\"", "voltage = \"0 V\"\nseries_inductance = \"1 uH\""),
            ("kind = \"coupling\"\ncoils = [\"one\", \"two\"]", "kind = \"power\"\ncoils = [\"one\"]"),
        ],
    ))
}

/// A busbar of steel that saturates, with a voltage at its ends.
fn driven_bar() -> Device {
    Device::of_text(&changed(
        BUSBAR,
        &[
            (
                "conductivity = \"5.8e7 S/m\"",
                "conductivity = \"5e6 S/m\"\nrelative_permeability = 20\nsaturation = \"0.2 T\"",
            ),
            ("ampere_turns = \"1 kA\"", "voltage = \"5 mV\""),
            ("kind = \"resistance\"", "kind = \"power\""),
        ],
    ))
}

/// At rest, for phasors, where eddy currents flow, and where circuits drive them. Solutions to a thousandth and their product leave
/// less than a hundredth of an error.
#[test]
fn along_a_curve_an_estimate_is_what_second_order_has_more() {
    let insulating = ("conductivity = \"1e6 S/m\"\n", "");
    for (name, device) in [
        ("at rest", Device::block(&saturated(&[STATIC]))),
        ("a phasor without eddy currents", Device::block(&saturated(&[insulating]))),
        ("eddy currents", Device::block(&saturated(&[]))),
        ("driven coils", driven_coils()),
        ("a driven bar", driven_bar()),
    ] {
        let (value, error, meshes) =
            device.of_family(Elements::Edge).estimated().unwrap_or_else(|e| panic!("{name}: {e}"));
        let more = device.by_second_order(&meshes, 0) - value;
        println!("{name}: {value:e}, estimated {error:+.4e}, second order has {more:+.4e} more");
        assert!(more.abs() > 1e-3 * value.abs(), "{name}: {more:e} is no error");
        assert!((error / more - 1.0).abs() < 0.01, "{name}: {error:e}, {more:e}");
    }
}

/// Two terms that are equal on the mesh, of which the second has the larger error.
#[test]
fn the_error_of_a_worst_case_knows_the_terms_that_are_the_worst_without_theirs() {
    let worst = "objective.combine=\"worst_case\"";
    let mut problem = crate::support::setup("shield_two_frequencies.toml", &[worst]).problem;
    let analysed = |problem: &Problem| {
        let moved = problem.moved(problem.shape().expect("a design").initial()).expect("a sound mesh");
        let cache = &mut SolverCache::default();
        problem.analyse(moved, Derivatives::None, cache, &mut NoProgress).expect("a field")
    };
    let estimated = |problem: &Problem| {
        let estimate = problem.estimate_error(
            &analysed(problem),
            &mut EnrichedModels::new(Effort::Any),
            &mut |_, _, _| {},
        );
        estimate.expect("an estimate").objective
    };
    let values = analysed(&problem).terms;
    let all = problem.objective().expect("a worst case").terms.clone();
    let terms =
        |problem: &mut Problem, terms: &[Term]| problem.objective_mut().expect("one").terms = terms.to_vec();
    let mut alone = [0, 1].map(|k| {
        let equal = Term { weight: 1.0 / values[k], ..all[k].clone() };
        terms(&mut problem, std::slice::from_ref(&equal));
        (estimated(&problem), equal)
    });
    alone.sort_by(|(a, _), (b, _)| a.total_cmp(b));
    let [(less, first), (more, second)] = alone;
    assert!(more - less > 1e-3, "errors of {less} and {more} tell the terms apart");
    // The first is the larger one on the mesh by half of that.
    let lead = 0.5 * (more - less);
    let first = Term { weight: (1.0 + lead) * first.weight, ..first };
    terms(&mut problem, &[first, second]);
    let found = estimated(&problem);
    println!("errors {less:.4} and {more:.4} of the terms, {found:.4} of the worst case");
    assert!((found - (1.0 + more - (1.0 + lead))).abs() < 1e-9, "{found}");
}

#[test]
#[ignore = "second order on halved edges of ten devices, minutes"]
fn estimates_are_half_to_twice_the_error_where_the_mesh_shows_the_device() {
    println!("| case | elements | tetrahedra | F, first order | η | reference | effectivity |");
    println!("|---|---|---|---|---|---|---|");
    let (mut count, mut within) = (0, 0);
    for (name, device) in devices() {
        let mut reference = None;
        for (family, word) in [(Elements::Edge, "edge"), (Elements::Nodal, "nodal")] {
            match device.of_family(family).estimated() {
                Ok((value, error, meshes)) => {
                    let exact = *reference.get_or_insert_with(|| device.reference(&meshes));
                    let effectivity = error / (exact - value);
                    let tets = meshes[1].topology().tets().len();
                    println!(
                        "| {name} | {word} | {tets} | {value:.5e} | {error:+.3e} | {exact:.5e} | {effectivity:.2} |"
                    );
                    count += 1;
                    within += usize::from((0.5..=2.0).contains(&effectivity));
                }
                Err(cause) => {
                    let cause = cause.lines().next().unwrap_or_default();
                    println!("| {name} | {word} | | refused: {cause} | | | |");
                }
            }
        }
    }
    println!("{within} of {count} effectivities lie between 0.5 and 2");
    assert!(4 * within >= 3 * count, "{within} of {count}");
}

/// The error of second order over what halved edges change: 4/3 is what the program takes.
#[test]
#[ignore = "second order on edges halved twice, minutes"]
fn the_error_of_second_order_is_about_four_thirds_of_what_halved_edges_change() {
    println!("| case | F(h) | F(h/2) | F(h/4) | order | error over change |");
    println!("|---|---|---|---|---|---|");
    for (name, device) in blocks() {
        let (.., meshes) =
            device.of_family(Elements::Edge).estimated().unwrap_or_else(|e| panic!("{name}: {e}"));
        let [a, b, c] = [0, 1, 2].map(|halvings| device.by_second_order(&meshes, halvings));
        let rest = (c - b) / (b - a);
        // A geometric series of changes.
        let factor = 1.0 / (1.0 - rest);
        println!("| {name} | {a:.6e} | {b:.6e} | {c:.6e} | {:.2} | {factor:.2} |", -rest.abs().log2());
        assert!((0.8..2.0).contains(&factor), "{name}: {factor}");
    }
}

impl Device {
    /// Unknowns and objective by edge elements of first order on edges that are halved so often.
    fn uniformly(&self, meshes: &[Mesh; 2], halvings: u32) -> (f64, f64) {
        let own = self.of_family(Elements::Edge);
        let finer = FinerProblem::new(&own.config, &own.source, &meshes[0], Cut::Halvings(halvings))
            .unwrap_or_else(|e| panic!("{e}"));
        let analysis =
            finer.analyse(&meshes[1], &mut SolverCache::default()).unwrap_or_else(|e| panic!("{e}"));
        (finer.setup.problem.states()[0].unknown_count() as f64, analysis.objective.expect("an objective"))
    }
}

/// Unknowns, objective and its estimated error where a run with a tolerance begins its search.
fn refined_for_objective(file: &Path, tolerance: &str) -> [f64; 3] {
    let home = folder();
    let out = home.path().join("out");
    let mut run = command(&[&"run", &file, &"--max-evaluations", &"1", &"--out", &out]);
    let tolerance = format!("accuracy.tolerance={tolerance}");
    for set in ["analysis.elements=edge", "analysis.order=1", "output.verify_refinement=0", &tolerance] {
        run.args(["--set", set]);
    }
    finish(&mut run).completed();
    let result = read_json(&out.join("result.json"));
    ["/mesh/unknowns", "/objective/initial", "/accuracy/error_estimate/0"].map(|key| number(&result, key))
}

/// Unknowns at which an error is reached, by a power law through the two last rows of unknowns and error.
fn unknowns_at(error: f64, rows: &[(f64, f64)]) -> f64 {
    let [.., (n, e), (m, f)] = rows else { panic!("two rows") };
    m * (error / f).powf((m / n).ln() / (f / e).ln())
}

/// The most halvings of all edges, the tolerance, and the least of what uniform meshes need more at the error that it leaves.
type Race = (&'static str, Vec<(&'static str, &'static str)>, u32, &'static str, f64);

/// Beside edges of iron uniform meshes converge with `h^1.2`, refined ones as if the field were smooth.
#[test]
#[ignore = "edges halved twice, a minute"]
fn meshes_refined_for_the_objective_need_a_fifth_of_the_unknowns_at_singular_edges() {
    let block = |changes: &[(&'static str, &'static str)]| [&CELLS[..], changes].concat();
    let iron = block(&[STATIC, ("relative_permeability = 100\n", "relative_permeability = 1000\n")]);
    let races: [Race; 4] = [
        ("iron block, static, μr 1000", iron, 2, "0.005", 5.0),
        ("conducting iron block, 50 Hz", block(&[]), 2, "0.005", 5.0),
        ("aluminium block, 200 Hz: smooth", block(&ALUMINIUM), 2, "0.01", 1.0),
        ("iron circuit (pole)", Vec::new(), 1, "0.02", 5.0),
    ];
    println!("| case | mesh | unknowns | F | error |");
    println!("|---|---|---|---|---|");
    for (name, changes, most, tolerance, least) in races {
        let home = folder();
        let (device, file) = if changes.is_empty() {
            (Device::shipped("pole.toml", &[]), repository("configs/pole.toml"))
        } else {
            (Device::block(&changes), written("block", home.path(), &changes).config)
        };
        let [unknowns, value, estimate] = refined_for_objective(&file, tolerance);
        let reference = value + estimate;
        let error = |value: f64| (value / reference - 1.0).abs();
        let (.., meshes) = device.of_family(Elements::Edge).estimated().unwrap_or_else(|e| panic!("{e}"));
        let mut uniform = Vec::new();
        for halvings in 0..=most {
            let (n, f) = device.uniformly(&meshes, halvings);
            println!(
                "| {name} | edges halved {halvings} times | {n} | {f:.5e} | {:.2} % |",
                100.0 * error(f)
            );
            uniform.push((n, error(f)));
        }
        let reached = error(value);
        let more = unknowns_at(reached, &uniform) / unknowns;
        println!(
            "| {name} | tolerance {tolerance} | {unknowns} | {value:.5e} | {:.2} %, {more:.1} times fewer |",
            100.0 * reached
        );
        assert!(more >= least, "{name}: {more}");
    }
}

/// The same numbers on every machine.
struct Chance(u64);

impl Chance {
    fn next(&mut self, low: f64, high: f64) -> f64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        low + (high - low) * (self.0 >> 11) as f64 / (1_u64 << 53) as f64
    }

    fn one<T: Copy>(&mut self, of: &[T]) -> T {
        of[(self.next(0.0, of.len() as f64) as usize).min(of.len() - 1)]
    }
}

/// Texts that make another device of the block: material, frequency, cells, what is observed, how far it may move.
fn random_device(chance: &mut Chance) -> Vec<(&'static str, String)> {
    let permeability = chance.one(&[10.0, 50.0, 200.0, 1000.0]);
    let frequency = chance.one(&["0", "\"20 Hz\"", "\"50 Hz\"", "\"200 Hz\""]);
    let conductivity = chance.one(&["1e5", "1e6", "7e6"]);
    let cells = chance.one(&[1, 2, 2]);
    let range = chance.next(1.0, 4.0);
    let observed = match chance.one(&[0, 1, 2]) {
        0 => "kind = \"flux_density_squared\"".to_owned(),
        1 => format!("kind = \"target_field\"\ntarget = [0.0, 0.0, {:.3}]", chance.next(0.1, 0.2)),
        _ => "kind = \"flux_density_squared\"\ngoal = \"maximise\"".to_owned(),
    };
    let iron = chance.next(12.0, 20.0);
    vec![
        ("relative_permeability = 100\n", format!("relative_permeability = {permeability}\n")),
        ("frequency = \"50 Hz\"", format!("frequency = {frequency}")),
        ("1e6 S/m", format!("{conductivity} S/m")),
        ("cells = [1, 1, 1]", format!("cells = [{cells}, {cells}, {cells}]")),
        ("cells = [2, 2, 1]", format!("cells = [{0}, {0}, {1}]", 2 * cells, cells)),
        (
            "\"20 mm\", \"20 mm\", \"30 mm\"]]\ncells = [2, 2, 1]",
            format!("\"20 mm\", \"20 mm\", \"30 mm\"]]\ncells = [{0}, {0}, {1}]", 2 * cells, cells),
        ),
        (
            "[[\"0 mm\", \"0 mm\", \"0 mm\"], [\"30 mm\", \"30 mm\", \"40 mm\"]]",
            format!("[[\"0 mm\", \"0 mm\", \"0 mm\"], [\"30 mm\", \"30 mm\", \"{:.1} mm\"]]", iron + 24.0),
        ),
        ("kind = \"flux_density_squared\"", observed),
        ("lower = \"-4 mm\"", format!("lower = \"-{range:.2} mm\"")),
        ("upper = \"4 mm\"", format!("upper = \"{range:.2} mm\"")),
    ]
}

/// The gain of a run with its error bar, and by second order on halved edges; `None` where nothing was gained.
fn gain(folder: &Path, changes: &[(&str, &str)]) -> Option<[f64; 3]> {
    let mut device = written("block", folder, changes);
    for item in ["analysis.elements=edge", "analysis.order=1", "accuracy.estimate=true", "output.fields=none"]
    {
        device = device.with(item);
    }
    let out = folder.join("out");
    finish(&mut device.with("output.verify_refinement=1").command("run", &out)).completed();
    let result = read_json(&out.join("result.json"));
    let ratio = number(&result, "/objective/ratio");
    if ratio == 1.0 {
        return None;
    }
    let bar = 2.0 * ratio * number(&result, "/accuracy/error_estimate_relative");
    let value = |path: &Path, name: &str| {
        let out = folder.join(name);
        let sets =
            ["analysis.order=2", "analysis.elements=edge", "output.fields=none", "accuracy.estimate=false"];
        let mut arguments: Vec<&dyn AsRef<std::ffi::OsStr>> =
            vec![&"solve", &path, &"--refine", &"1", &"--out", &out];
        for set in &sets {
            arguments.extend([&"--set" as &dyn AsRef<std::ffi::OsStr>, set]);
        }
        fluxmorph(&arguments).completed();
        number(&read_json(&out.join("result.json")), "/objective/best")
    };
    let exact = value(&out.join("result.json"), "best") / value(&folder.join("block.toml"), "first");
    Some([ratio, bar, exact])
}

#[test]
#[ignore = "forty optimisations, each checked by second order on halved edges: minutes"]
fn of_forty_random_devices_nine_in_ten_have_their_true_gain_within_the_error_bar() {
    let mut chance = Chance(23);
    let (mut count, mut within) = (0, 0);
    println!("| device | F/F0 | error bar | by second order | distance over bar |");
    println!("|---|---|---|---|---|");
    while count < 40 {
        let changes = random_device(&mut chance);
        let changes: Vec<(&str, &str)> = changes.iter().map(|(from, to)| (*from, to.as_str())).collect();
        let home = folder();
        let Some([ratio, bar, exact]) = gain(home.path(), &changes) else { continue };
        count += 1;
        let distance = (exact - ratio).abs() / bar;
        within += usize::from(distance <= 1.0);
        println!("| {count} | {ratio:.4} | {bar:.4} | {exact:.4} | {distance:.2} |");
    }
    println!("{within} of {count} true gains lie within the error bar");
    assert!(10 * within >= 9 * count, "{within} of {count}");
}
