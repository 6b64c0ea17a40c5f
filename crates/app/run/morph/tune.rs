//! The tuner: elastic parameters that keep the worst element of one motion as good as possible.
//!
//! For every stiffness policy the worst quality after the motion by the linear law, negative while elements are
//! inverted, is made large over the parameters of the subregions: `log10 E` relative to the first, `ν`, and the force
//! along the mean motion of the moved nodes. The unit of force is `E_1 u V / (N L²)`, with `u` the longest prescribed
//! displacement, `V / N` the body's volume per node and `L` its largest extent: a uniform load of that size displaces a
//! body of modulus `E_1` by about `u`, whatever the mesh.

use std::ops::ControlFlow;

use fluxmorph_geometry::box_tree::AxisBox;
use fluxmorph_geometry::quality::QualityReport;
use fluxmorph_geometry::tet4::{Point, add, norm, volume};
use fluxmorph_optimizer::nlopt::{Search, maximise};
use fluxmorph_remesh::{self as remesh, ElasticMap, RemeshSetup, StiffnessPolicy};
use serde::Serialize;

use crate::build::{MotionSetup, set_up_motion};
use crate::config::{Config, Remesh, SourceMap, StiffnessLaw, Subregion, Tune, TunedParameter};
use crate::error::Error;
use crate::show::Observer;
use crate::show::text_table::Table;

/// Gain of worst quality for which another policy is taken: on equal cells the isotropic ones are
/// the same but for rounding.
const WORTHWHILE: f64 = 1e-6;

/// Whether the elastic parameters are taken from the configuration or searched.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Parameters {
    /// As configured.
    Given,
    /// Searched first.
    Tuned,
}

/// A configuration that was found, and how.
#[derive(Debug)]
pub(super) struct Found {
    pub(super) report: TuneReport,
    pub(super) config: Config,
    pub(super) setup: MotionSetup,
    /// The stiffnesses that a signal left out, in whole or in part.
    pub(super) left_out: Vec<&'static str>,
}

/// What the tuner found.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct TuneReport {
    /// Evaluations of the worst quality.
    pub evaluations: usize,
    /// Worst quality with the parameters of the configuration and with the best found.
    pub worst_quality: [f64; 2],
    /// Stiffness policy of the configuration and of the best.
    pub stiffness: [&'static str; 2],
    /// Best worst quality of every policy, in the order tried.
    pub policies: Vec<(&'static str, f64)>,
    /// Parameters of the subregions.
    pub regions: Vec<TunedRegion>,
}

/// Parameters of one subregion, before and after.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct TunedRegion {
    /// Its name.
    pub name: String,
    /// Young's modulus.
    pub young: [f64; 2],
    /// Poisson's ratio.
    pub poisson: [f64; 2],
    /// Fictitious force.
    pub force: [[f64; 3]; 2],
}

impl TunedRegion {
    fn of((was, is): (&remesh::Subregion, &remesh::Subregion)) -> Self {
        Self {
            name: is.name.clone(),
            young: [was.young, is.young],
            poisson: [was.poisson, is.poisson],
            force: [was.force, is.force],
        }
    }
}

impl TuneReport {
    /// The findings as a table.
    pub fn text(&self) -> String {
        let pair = |[was, is]: [f64; 2]| format!("{was:.4} -> {is:.4}");
        let mut text = format!(
            "tuned in {} evaluations: worst quality {}, stiffness {} -> {}\n",
            self.evaluations,
            pair(self.worst_quality),
            self.stiffness[0],
            self.stiffness[1]
        );
        let policies: Vec<String> = self.policies.iter().map(|(name, q)| format!("{name} {q:.4}")).collect();
        text += &format!("best of every stiffness: {}\n", policies.join(", "));
        let force = |f: [f64; 3]| format!("{:.3e} {:.3e} {:.3e}", f[0], f[1], f[2]);
        let row = |region: &TunedRegion| {
            [
                region.name.clone(),
                format!("{:.4e} -> {:.4e}", region.young[0], region.young[1]),
                pair(region.poisson),
                format!("{} -> {}", force(region.force[0]), force(region.force[1])),
            ]
        };
        let names = ["region", "young", "poisson", "force"];
        text + &Table::of_numbers(names, self.regions.iter().map(row)).text() + "\n"
    }
}

/// A variable of the search.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Variable {
    parameter: TunedParameter,
    subregion: usize,
}

/// Says what to do where no parameter can be searched: all motions are the same when every modulus is doubled.
pub(super) fn nothing_to_search(settings: &Tune, setup: &MotionSetup) -> Option<&'static str> {
    variables(settings, setup.remesh.subregions.len()).is_empty().then_some(
        "the tuner compares the stiffnesses and has no parameter to search: the modulus of a single region changes no \
         motion; add \"poisson\" or \"force\" to morph.tune.parameters, or divide the body into regions",
    )
}

/// Searches elastic parameters for the motion of a set-up, until `interrupted` says so; it is asked before each evaluation
/// but the first.
pub(super) fn tune(
    config: &Config,
    source: &SourceMap,
    setup: &MotionSetup,
    interrupted: &dyn Fn() -> bool,
    observer: &mut dyn Observer,
) -> Result<Found, Error> {
    let settings = &config.morphing(source)?.morph.tune;
    let design = setup.path.at(1.0);
    let given = &setup.remesh;
    let initial = worst_quality(setup, given, &design)?;
    let unit = force_unit(setup, &design);
    let variables = variables(settings, given.subregions.len());
    let search = search(settings, &variables);
    let start: Vec<f64> = variables.iter().map(|v| value(given, v, unit)).collect();

    let mut best = (given.clone(), initial);
    let mut evaluations = 1;
    let mut policies = Vec::new();
    let others = StiffnessPolicy::ALL.into_iter().filter(|policy| *policy != given.policy);
    let mut order = std::iter::once(given.policy).chain(others);
    let mut left_out = Vec::new();
    for policy in order.by_ref() {
        let mut own = f64::NEG_INFINITY;
        let mut stopped = false;
        let mut evaluate = |x: &[f64]| {
            if interrupted() {
                stopped = true;
                return ControlFlow::Break(());
            }
            evaluations += 1;
            let candidate = with_values(given, policy, &variables, x, unit);
            // A body without stiffness has no motion to compare: worse than every inverted mesh.
            let quality = worst_quality(setup, &candidate, &design).unwrap_or(f64::NAN);
            let gain = if policy == best.0.policy { 0.0 } else { WORTHWHILE };
            if quality > best.1 + gain {
                best = (candidate, quality);
            }
            own = own.max(quality);
            ControlFlow::Continue(quality)
        };
        if evaluate(&start).is_continue() {
            maximise(&search, &start, evaluate);
            observer.note(&format!("stiffness {}: worst quality {own:.4}", policy.name()));
            policies.push((policy.name(), own));
        }
        if stopped {
            left_out.push(policy.name());
            break;
        }
    }
    left_out.extend(order.map(StiffnessPolicy::name));
    let (remesh, quality) = best;
    let config = tuned_config(config, &remesh);
    let setup = set_up_motion(&config, source)?;
    let regions = given.subregions.iter().zip(&remesh.subregions).map(TunedRegion::of).collect();
    let stiffness = [given.policy.name(), remesh.policy.name()];
    let report = TuneReport { evaluations, worst_quality: [initial, quality], stiffness, policies, regions };
    Ok(Found { report, config, setup, left_out })
}

/// The search over these variables.
fn search(settings: &Tune, variables: &[Variable]) -> Search {
    let bounds = |v: &Variable| match v.parameter {
        TunedParameter::Young => settings.log10_young,
        TunedParameter::Poisson => settings.poisson,
        TunedParameter::Force => settings.force,
    };
    let [lower, upper] = [0, 1].map(|end| variables.iter().map(|v| bounds(v)[end]).collect());
    Search { lower, upper, evaluations: settings.evaluations }
}

/// The variables of a search over so many subregions: all motions are the same when every modulus is doubled, so that of
/// the first is kept.
fn variables(settings: &Tune, subregions: usize) -> Vec<Variable> {
    let of = |parameter: &TunedParameter| {
        let first = usize::from(*parameter == TunedParameter::Young);
        let parameter = *parameter;
        (first..subregions).map(move |subregion| Variable { parameter, subregion })
    };
    settings.parameters.iter().flat_map(of).collect()
}

/// The value of a variable in a set-up; `unit` is the force of 1.
fn value(setup: &RemeshSetup, variable: &Variable, unit: Point) -> f64 {
    let subregion = &setup.subregions[variable.subregion];
    match variable.parameter {
        TunedParameter::Young => (subregion.young / setup.subregions[0].young).log10(),
        TunedParameter::Poisson => subregion.poisson,
        TunedParameter::Force => {
            let square: f64 = unit.iter().map(|c| c * c).sum();
            let along: f64 = unit.iter().zip(subregion.force).map(|(u, f)| u * f).sum();
            if square > 0.0 { along / square } else { 0.0 }
        }
    }
}

/// The set-up with a policy and the values of the variables.
fn with_values(
    setup: &RemeshSetup,
    policy: StiffnessPolicy,
    variables: &[Variable],
    x: &[f64],
    unit: Point,
) -> RemeshSetup {
    let mut setup = RemeshSetup { policy, ..setup.clone() };
    let first = setup.subregions[0].young;
    for (variable, &x) in variables.iter().zip(x) {
        let subregion = &mut setup.subregions[variable.subregion];
        match variable.parameter {
            TunedParameter::Young => subregion.young = first * 10f64.powf(x),
            TunedParameter::Poisson => subregion.poisson = x,
            TunedParameter::Force => subregion.force = unit.map(|unit| x * unit),
        }
    }
    setup
}

/// The force of 1, along the mean motion (see the module); along z where the motion has no mean.
fn force_unit(setup: &MotionSetup, design: &[Point]) -> Point {
    let mesh = &setup.mesh;
    let mean = design.iter().fold([0.0; 3], |sum, u| add(sum, *u));
    let direction = if norm(mean) > 0.0 { mean.map(|c| c / norm(mean)) } else { [0.0, 0.0, 1.0] };
    let (mut whole, mut nodes) = (0.0, Vec::new());
    for &element in setup.remesh.subregions.iter().flat_map(|subregion| &subregion.elements) {
        whole += volume(mesh.vertices(element));
        nodes.extend(mesh.topology().tet(element));
    }
    nodes.sort_unstable();
    nodes.dedup();
    let extent = AxisBox::around(nodes.iter().map(|&n| mesh.point(n))).extent();
    let young = setup.remesh.subregions[0].young;
    let size = young * setup.path.largest() * whole / (nodes.len() as f64 * extent * extent);
    direction.map(|c| size * c)
}

/// Worst quality of the body after the whole motion by the linear law; negative where elements are inverted.
fn worst_quality(setup: &MotionSetup, remesh: &RemeshSetup, design: &[Point]) -> Result<f64, Error> {
    let map = ElasticMap::new(&setup.mesh, remesh.clone())?;
    let displacement = map.displacement(design)?;
    let points: Vec<Point> =
        setup.mesh.points().iter().zip(&displacement).map(|(x, u)| add(*x, *u)).collect();
    let report = QualityReport::of_points(setup.mesh.topology(), &points, map.elements());
    Ok(report.map_or(f64::NAN, |report| report.worst))
}

/// The configuration with the values of a set-up and without cases. It writes into a directory of
/// its own: that of the search holds the file it is read from.
fn tuned_config(config: &Config, setup: &RemeshSetup) -> Config {
    let mut config = config.clone();
    if let Some(remesh) = &mut config.remesh {
        let Remesh { stiffness, subregions, .. } = remesh;
        *stiffness = StiffnessLaw::of_policy(setup.policy).or(*stiffness);
        *subregions = setup
            .subregions
            .iter()
            .map(|subregion| Subregion {
                name: subregion.name.clone(),
                young: Some(subregion.young),
                poisson: Some(subregion.poisson),
                force: Some(subregion.force),
            })
            .collect();
    }
    if let Some(morph) = &mut config.morph {
        morph.cases.clear();
    }
    config.output.directory.push("tuned");
    config
}
