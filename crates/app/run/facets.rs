//! How far the facets of a mesh are from the curved surfaces that they stand for, and what that does to the objective: the
//! error of the geometry, which no refinement of the mesh takes away, since new nodes lie on the facets, and which is in no
//! estimate of the field.
//!
//! What it does is found by trying: with the nodes of curved surfaces moved until the facets lie on these in the mean
//! ([`CurvedSurfaces::onto_surfaces`]) bodies have the volume that they are meant to have, and the objective is computed once more, of
//! an analysis what its states report too.

use std::sync::Arc;

use fluxmorph_geometry::curved::CurvedSurfaces;
use fluxmorph_geometry::tet4::{Point, centroid, volume};
use fluxmorph_geometry::{Mesh, Millimetres, NodeId, RegionId, Topology, millimetres};
use fluxmorph_optimizer::Error as OptimizerError;
use fluxmorph_optimizer::problem::{Analysis, Problem, SolverCache};

use super::Session;
use super::finer::{Cut, FinerProblem};
use super::reported::Reported;
use crate::build::{
    functionals, is_air, is_open, is_pushed, is_wound, memory_limit, region_in_mesh, remaining_nodes,
};
use crate::config::Config;
use crate::error::Error;
use crate::files::{CurvedFacets, OverwritePolicy, SAFETY, StateErrors};
use crate::show::Observer;

/// Share of its volume that an element keeps at least when nodes move: where its facets are farther off than that, nodes go a part
/// of the way, and the objective's change is taken to go on as it began.
const KEPT_VOLUME: f64 = 0.5;

/// Share of a value below which nothing is said of its change.
const LITTLE: f64 = 5e-5;

/// Share of a value that facets may change beyond its error bar before this is a warning.
const MATTERS: f64 = 0.01;

/// The least part of the way: less would be noise of the linear solver.
const LEAST_PART: f64 = 1.0 / 8.0;

/// Why it is not known what facets change.
#[derive(Debug, thiserror::Error)]
enum NotMeasured {
    /// Several ranks share the mesh.
    #[error("that takes one process")]
    OnRanks,
    /// A signal came first.
    #[error("it was stopped before")]
    CutShort,
    /// Elements would lose too much of their volume.
    #[error("elements beside them are too thin to follow")]
    TooThin,
    /// The objective leaves the range of numbers.
    #[error("it is no number")]
    NotFinite,
    /// The moved problem cannot be set up or solved.
    #[error(transparent)]
    Failed(#[from] Error),
}

impl From<OptimizerError> for NotMeasured {
    fn from(error: OptimizerError) -> Self {
        Self::Failed(error.into())
    }
}

/// A shape of which it is asked what its facets change.
pub(super) struct Shape<'a> {
    /// The mesh that it was solved on.
    pub(super) mesh: &'a Mesh,
    /// The objective on it, where that is of the field, with its estimated error where there is one [its unit].
    pub(super) objective: Option<(f64, Option<f64>)>,
    /// Its fields, where what they report is looked at too, with the estimated errors of that where there are some.
    pub(super) analysis: Option<(&'a Analysis, Option<&'a [Option<StateErrors>]>)>,
}

/// What is found of facets.
pub(super) struct Found {
    /// Those farthest off their surface, with what all change of the objective.
    pub(super) facets: CurvedFacets,
    /// What all change of what the states of the last shape report.
    pub(super) of_states: Vec<Option<StateErrors>>,
}

/// What the facets of a shape change.
#[derive(Default)]
struct Change {
    /// Of the objective [its unit]; zero without one.
    objective: f64,
    of_states: Vec<Option<StateErrors>>,
    /// Of what is reported that which changes most, with the change relative to it.
    most: Option<(String, f64)>,
    /// Whether something of it changes by more than its error bar.
    exceeds: bool,
}

/// The facets of a mesh with all its regions, as it was read or generated.
#[derive(Debug)]
pub(super) struct FirstFacets {
    topology: Arc<Topology>,
    /// Of every node that the mesh has more by now, the two in whose middle it lies.
    parents: Vec<[NodeId; 2]>,
    /// Those farthest off their surface; `None` where none is curved.
    farthest: Option<CurvedFacets>,
}

impl FirstFacets {
    /// Those of a mesh.
    pub(super) fn of(config: &Config, mesh: &Mesh) -> Self {
        Self { topology: Arc::clone(mesh.topology()), parents: Vec::new(), farthest: farthest(config, mesh) }
    }

    /// Goes on to a finer mesh, whose new nodes have these parents.
    pub(super) fn refine(&mut self, parents: Vec<[NodeId; 2]>) {
        self.parents = parents;
    }

    /// The motion of all nodes [m] that brings the facets onto their surfaces, where the nodes lie so [m]; new ones stay in the middle.
    fn onto_surfaces(&self, config: &Config, points: &[Point]) -> Vec<Point> {
        let topology = &self.topology;
        let first = &points[..topology.node_count()];
        let mut motion = CurvedSurfaces::new(topology, first, counted(config, topology)).onto_surfaces();
        for &[a, b] in &self.parents {
            motion.push(centroid([motion[a.index()], motion[b.index()]]));
        }
        motion
    }
}

/// The edge whose middle is farthest off the surface that its facets stand for; `None` where no surface is curved.
fn farthest(config: &Config, mesh: &Mesh) -> Option<CurvedFacets> {
    let topology = mesh.topology();
    let found = CurvedSurfaces::new(topology, mesh.points(), counted(config, topology)).farthest()?;
    let name = |region: RegionId| topology.region_names()[region.index()].as_str();
    let (own, other) = found.between;
    Some(CurvedFacets {
        surface: format!("{}|{}", name(own), other.map_or("outside", name)),
        off_m: found.off,
        at_m: centroid(found.ends.map(|n| mesh.point(n))),
        change: None,
    })
}

/// Which surfaces count, by the regions on both sides: not where both are alike to the field or replaced by their surfaces, nor the
/// end of open space, whose shell maps its own shape, nor the outside of a region that is replaced.
fn counted(config: &Config, topology: &Topology) -> impl Fn(RegionId, Option<RegionId>) -> bool {
    let names = topology.region_names();
    let of = |is: &dyn Fn(&str) -> bool| -> Vec<bool> { names.iter().map(|name| is(name)).collect() };
    let is_replaced = |name: &str| !config.is_meshed(name);
    let is_hidden = of(&|name| is_replaced(name) || is_open(config, name));
    let (empty, replaced) = (of(&|name| is_empty(config, name)), of(&is_replaced));
    // The first region with the same settings, in which nothing is observed or wound.
    let settings = |name: &String| config.regions.get(name);
    let is_plain = of(&|name| !is_wound(config, name) && !is_observed(config, name));
    let alike: Vec<usize> = (0..names.len())
        .map(|k| {
            let same = |&j: &usize| is_plain[j] && is_plain[k] && settings(&names[j]) == settings(&names[k]);
            (0..k).find(same).unwrap_or(k)
        })
        .collect();
    move |own, other| {
        let own = own.index();
        let Some(other) = other.map(RegionId::index) else { return !is_hidden[own] };
        !(empty[own] && empty[other] || replaced[own] && replaced[other] || alike[own] == alike[other])
    }
}

/// Whether a region is air in which nothing flows and nothing is measured.
fn is_empty(config: &Config, name: &str) -> bool {
    is_air(config, name) && !is_wound(config, name) && !is_observed(config, name)
}

/// Whether a force or a functional is of a region.
fn is_observed(config: &Config, name: &str) -> bool {
    is_pushed(config, name) || functionals(config).iter().any(|(_, own)| region_in_mesh(own) == Some(name))
}

/// The nodes of the design surface on a mesh with all its regions, where they are the variables: their facets are the design. With a
/// control grid, which has a shape between the nodes, none.
fn designed_nodes(config: &Config, topology: &Topology) -> Vec<NodeId> {
    let design = config.design.iter().filter(|design| design.grid.is_none());
    let surfaces = design.flat_map(|design| &design.surface).filter_map(|name| topology.surface(name).ok());
    surfaces.flatten().flatten().copied().collect()
}

/// What no refinement takes away, in words, with a cure where it matters; of these objectives of one design or of two, and of what is
/// reported that which changes most.
fn described(found: &CurvedFacets, objectives: &[f64], most: Option<&(String, f64)>) -> String {
    let head = format!(
        "`{}` is curved, and its facets are up to {:.3} mm off it, at {}",
        found.surface,
        Millimetres(found.off_m),
        millimetres(found.at_m)
    );
    let percent = |change: f64, of: f64| format!("{:+.2} %", 100.0 * change / of.abs());
    let of_objective = match (found.change, objectives) {
        (Some([change, _]), &[objective]) => {
            Some(format!("the objective by about {}", percent(change, objective)))
        }
        (Some([first, last]), &[initial, best]) => Some(format!(
            "the objective by about {} at the initial and {} at the best design, relative to the larger of both, and F/F0 from {:.5} \
             to {:.5}",
            percent(first, initial),
            percent(last, initial.abs().max(best.abs())),
            best / initial,
            (best + last) / (initial + first)
        )),
        _ => None,
    };
    let of_reported = most.map(|(name, change)| {
        format!("{name} by about {:.2} %, most of what is reported", 100.0 * change.abs())
    });
    let changed: Vec<String> = [of_objective, of_reported].into_iter().flatten().collect();
    if changed.is_empty() {
        return format!(
            "{head}: no error bar counts that, and refined meshes and cut elements keep the facets; begin with smaller faces there \
             to see what it does"
        );
    }
    let largest = objectives.iter().map(|value| value.abs()).fold(0.0, f64::max);
    let of_largest = found.change.into_iter().flatten().map(|change| change.abs() / largest);
    let matters = of_largest.chain(most.map(|own| own.1.abs())).any(|share| share >= MATTERS);
    format!(
        "{head}: the facets of all curved surfaces, on these in the mean, change {}, which no error bar counts and no refinement takes \
         away{}",
        changed.join(", and "),
        if matters { "; begin with smaller faces on them, first near what is observed" } else { "" }
    )
}

/// Whether facets change objectives, of one design or of two, by more than an error bar, and by more than a share of the larger one that
/// matters.
fn exceeds_a_bar(changes: &[Change], objectives: &[(f64, Option<f64>)]) -> bool {
    let largest = objectives.iter().map(|(value, _)| value.abs()).fold(0.0, f64::max);
    changes.iter().zip(objectives).any(|(Change { objective: change, .. }, (_, error))| {
        change.abs() > (SAFETY * error.unwrap_or_default().abs()).max(MATTERS * largest)
    })
}

impl Session<'_> {
    /// What no estimate and no refinement has of the geometry, initially and at a `cut` shape with facets of its own, with what it
    /// does to some shapes, none to two; which is reported.
    pub(super) fn facets_of(
        &self,
        cut: Option<&Mesh>,
        shapes: &[Shape<'_>],
        observer: &mut dyn Observer,
    ) -> Option<Found> {
        let own = self.facets.farthest.clone();
        let of_shape = cut.and_then(|mesh| farthest(self.config, mesh));
        let off = |facets: &Option<CurvedFacets>| facets.as_ref().map_or(0.0, |facets| facets.off_m);
        let mut facets = if off(&of_shape) > off(&own) { of_shape } else { own }?;
        let mut changes = Vec::new();
        if !shapes.is_empty() {
            observer.phase("measuring what the facets of curved surfaces change");
            match self.changes(shapes) {
                Ok(found) => changes = found,
                Err(why) => {
                    observer
                        .notice(&format!("what the facets of curved surfaces change is not known: {why}"));
                }
            }
        }
        let objectives: Vec<(f64, Option<f64>)> = shapes.iter().filter_map(|shape| shape.objective).collect();
        if let ([first, ..], [_, ..]) = (&*changes, &*objectives) {
            facets.change = Some([first.objective, changes[changes.len() - 1].objective]);
        }
        let exceeds = exceeds_a_bar(&changes, &objectives);
        let is_little =
            |(change, (value, _)): (&Change, &(f64, _))| change.objective.abs() < LITTLE * value.abs();
        let of_objective = !changes.is_empty() && changes.iter().zip(&objectives).all(is_little);
        let Change { of_states, most, exceeds: reported, .. } = changes.pop().unwrap_or_default();
        let of_reported = most.as_ref().map_or(!objectives.is_empty(), |(_, share)| share.abs() < LITTLE);
        if of_objective && of_reported {
            return Some(Found { facets, of_states });
        }
        let values: Vec<f64> = objectives.iter().map(|(value, _)| *value).collect();
        let text = described(&facets, &values, most.as_ref());
        if exceeds || reported {
            observer.warning(&text)
        } else {
            observer.notice(&text)
        }
        Some(Found { facets, of_states })
    }

    /// What shapes have more where the facets of all curved surfaces lie on these in the mean, about.
    fn changes(&self, shapes: &[Shape<'_>]) -> Result<Vec<Change>, NotMeasured> {
        if self.setup.problem.share().is_some() {
            return Err(NotMeasured::OnRanks);
        }
        let check_interrupted = || if (self.interrupted)() { Err(NotMeasured::CutShort) } else { Ok(()) };
        check_interrupted()?;
        let (config, full, first) = (self.config, &self.setup.full_mesh, &self.facets);
        let remaining = remaining_nodes(config, full.topology());
        let designed = designed_nodes(config, full.topology());
        let of_full = first.onto_surfaces(config, full.points());
        let of_shape = |shape: &Shape<'_>| -> Vec<Point> {
            let mut points = full.points().to_vec();
            remaining.iter().zip(shape.mesh.points()).for_each(|(node, point)| points[node.index()] = *point);
            let mut motion = first.onto_surfaces(config, &points);
            designed.iter().for_each(|node| motion[node.index()] = of_full[node.index()]);
            remaining.iter().map(|node| motion[node.index()]).collect()
        };
        let of_shapes: Vec<Vec<Point>> = shapes.iter().map(of_shape).collect();
        let motions = shapes.iter().zip(&of_shapes).map(|(shape, motion)| (shape.mesh, motion));
        let part = part_of_the_way(motions.chain([(full, &of_full)])).ok_or(NotMeasured::TooThin)?;
        let moved = |mesh: &Mesh, motion: &[Point]| {
            let motion: Vec<Point> = motion.iter().map(|m| m.map(|c| part * c)).collect();
            mesh.moved(&motion).map_err(OptimizerError::from)
        };
        // Solved as the run was: what is left of its residual is in the objective, and cancels.
        let config = Config { constraints: Vec::new(), ..config.clone() };
        let problem = FinerProblem::new(&config, self.source, &moved(full, &of_full)?, Cut::Halvings(0))?;
        memory_limit::check_problem(&problem.setup.problem, self.source, OverwritePolicy::Keep)
            .map_err(Error::from)?;
        let (cache, mut changes) = (&mut SolverCache::default(), Vec::new());
        for (shape, motion) in shapes.iter().zip(&of_shapes) {
            if motion.iter().all(|own| *own == [0.0; 3]) {
                changes.push(Change::default());
                continue;
            }
            check_interrupted()?;
            let found = problem.analyse(&moved(shape.mesh, motion)?, cache)?;
            let of_problem = (&problem.setup.problem, &found);
            let mut change =
                shape.analysis.map_or_else(Change::default, |own| self.of_reported(own, of_problem, part));
            if let Some((value, _)) = shape.objective {
                change.objective = (found.objective.unwrap_or(f64::NAN) - value) / part;
            }
            changes.push(change);
        }
        if changes.iter().all(|change| change.objective.is_finite()) {
            Ok(changes)
        } else {
            Err(NotMeasured::NotFinite)
        }
    }

    /// What the states of an analysis report more on a mesh that is moved this part of the way.
    fn of_reported(
        &self,
        (own, estimated): (&Analysis, Option<&[Option<StateErrors>]>),
        (problem, moved): (&Problem, &Analysis),
        part: f64,
    ) -> Change {
        let before = Reported::of_states(self.config, &self.setup.problem, own);
        let after = Reported::of_states(self.config, problem, moved);
        let mut change = Change::default();
        for (state, (before, after)) in before.into_iter().zip(after).enumerate() {
            let found = before.zip(after).and_then(|(own, on)| Some((own.errors(&on, 1.0 / part)?, own)));
            if let Some((found, own)) = &found {
                let bars = estimated.and_then(|all| Some(own.shares(all.get(state)?.as_ref()?)));
                change.enter(own.shares(found), bars.as_deref());
            }
            change.of_states.push(found.map(|(found, _)| found));
        }
        change
    }
}

impl Change {
    /// Enters what a state reports more, as shares, beside the estimated errors of the same. What changes by more than itself cancels,
    /// and says nothing of the facets.
    fn enter(&mut self, shares: Vec<(String, f64)>, estimated: Option<&[(String, f64)]>) {
        for (k, (name, share)) in shares.into_iter().enumerate().filter(|(_, (_, share))| share.abs() < 1.0) {
            let bar = estimated.map_or(0.0, |all| SAFETY * all[k].1.abs());
            self.exceeds |= share.abs() > bar.max(MATTERS);
            // A quantity whose error bar is as large may be zero, and is not named.
            if bar < 1.0 && share.abs() > self.most.as_ref().map_or(0.0, |(_, most)| most.abs()) {
                self.most = Some((name, share));
            }
        }
    }
}

/// The largest part of motions, halved as often as it takes, that leaves every element enough of its volume.
fn part_of_the_way<'a>(motions: impl Iterator<Item = (&'a Mesh, &'a Vec<Point>)>) -> Option<f64> {
    let mut part: f64 = 1.0;
    for (mesh, motion) in motions {
        let topology = mesh.topology();
        for e in topology.elements() {
            let (nodes, vertices) = (topology.tet(e), mesh.vertices(e));
            let at = |part: f64| {
                let of = |a: usize, d: usize| vertices[a][d] + part * motion[nodes[a].index()][d];
                volume(std::array::from_fn(|a| std::array::from_fn(|d| of(a, d))))
            };
            while at(part) < KEPT_VOLUME * volume(vertices) {
                part /= 2.0;
                if part < LEAST_PART {
                    return None;
                }
            }
        }
    }
    Some(part)
}
