//! Expansions of a configuration on its mesh and states.

use std::collections::HashSet;

use fluxmorph_geometry::box_tree::AxisBox;
use fluxmorph_geometry::depth::nearest_on_triangle;
use fluxmorph_geometry::topology::face_key;
use fluxmorph_geometry::{Mesh, millimetres};
use fluxmorph_optimizer::problem::Problem;
use fluxmorph_solver::coil::Frame;
use fluxmorph_solver::functional::{MirrorPlane, Multipoles, OfTerms};
use fluxmorph_solver::multipole::{Expansion, Harmonic};
use fluxmorph_solver::{FieldModel, Functional, SolverError};

use super::functional::follow;
use super::locate_error::DiagnosticSink;
use super::references::{expansion_of, functionals};
use super::soundness::faces_of;
use crate::config::{self, Config, Diagnostic, ExpansionShape, MultipoleSet, ObjectiveKind, SourceMap};
use crate::error::Error;

/// Share of the reference radius by which a plane may miss the centre.
const OFF_CENTRE: f64 = 1e-9;

/// A term as it is written: `b3`, `a2`, `c2_0`, `s2_1`; `None` for what is none.
fn parse(text: &str) -> Option<Harmonic> {
    let (letter, numbers) = text.split_at_checked(1)?;
    let is_plain = |number: &&str| !number.starts_with('0') || *number == "0";
    let whole = |number: &str| Some(number).filter(is_plain)?.parse::<usize>().ok();
    match (letter, numbers.split_once('_')) {
        ("b", None) => whole(numbers).map(Harmonic::Normal),
        ("a", None) => whole(numbers).map(Harmonic::Skew),
        ("c", Some((n, m))) => Some(Harmonic::Cosine(whole(n)?, whole(m)?)),
        ("s", Some((n, m))) => Some(Harmonic::Sine(whole(n)?, whole(m)?)),
        _ => None,
    }
}

/// All terms of an expansion, in its order.
fn terms(set: &MultipoleSet) -> Vec<Harmonic> {
    match set.shape {
        ExpansionShape::Circle => {
            (1..=set.order).flat_map(|n| [Harmonic::Normal(n), Harmonic::Skew(n)]).collect()
        }
        ExpansionShape::Ball => {
            let cosines = |n: usize| (0..=n).map(move |m| Harmonic::Cosine(n, m));
            let sines = |n: usize| (1..=n).map(move |m| Harmonic::Sine(n, m));
            (0..=set.order).flat_map(|n| cosines(n).chain(sines(n))).collect()
        }
    }
}

/// Those of the main order.
pub(crate) fn main_terms(set: &MultipoleSet) -> Vec<Harmonic> {
    let order = |term: &Harmonic| match *term {
        Harmonic::Normal(n) | Harmonic::Skew(n) | Harmonic::Cosine(n, _) | Harmonic::Sine(n, _) => n,
    };
    terms(set).into_iter().filter(|term| Some(order(term)) == set.main).collect()
}

/// Expansions that are not there, and terms that they do not have.
pub(super) fn faults(config: &Config, source: &SourceMap) -> Vec<Diagnostic> {
    let mut faults = Vec::new();
    for (k, set) in config.multipoles.iter().enumerate() {
        if let Err(SolverError::Parameter { what, value, expected }) = frame(set) {
            let message = format!("`multipoles[{k}].{what}` is {value}, which gives no directions");
            faults.push(source.diagnostic(&format!("multipoles[{k}].{what}"), message).expected(expected));
        }
    }
    let known: Vec<&str> = config.multipoles.iter().map(|set| set.name.as_str()).collect();
    for (path, functional) in functionals(config).into_iter().filter(|(_, f)| f.kind.is_of_terms()) {
        let wanted = functional.region.as_deref().unwrap_or_default();
        let Some(set) = config.multipoles.iter().find(|set| set.name == wanted) else {
            if !wanted.is_empty() {
                let what = "expansion of [[multipoles]]";
                faults.push(source.unknown_name(&format!("{path}.region"), what, wanted, &known));
            }
            continue;
        };
        let all = terms(set);
        for (k, written) in functional.harmonics.iter().flatten().enumerate() {
            if !parse(written).is_some_and(|term| all.contains(&term)) {
                let message = format!("`{written}` is no term of the expansion `{wanted}`");
                let [first, last] =
                    [all.first(), all.last()].map(|term| term.map(Harmonic::to_string).unwrap_or_default());
                let fault = source.diagnostic(&format!("{path}.harmonics[{k}]"), message);
                faults.push(
                    fault.expected(format!("a term from {first} to {last}, or a higher `order` there")),
                );
            }
        }
    }
    faults
}

fn frame(set: &MultipoleSet) -> Result<Frame, SolverError> {
    Frame::new(set.center, set.axis.vector(), set.direction)
}

/// The expansion that a table asks for, in space.
fn expansion(set: &MultipoleSet) -> Result<Expansion, Error> {
    let frame = frame(set)?;
    Ok(match set.shape {
        ExpansionShape::Circle => Expansion::circle(&frame, set.radius, set.order),
        ExpansionShape::Ball => Expansion::ball(&frame, set.radius, set.order),
    })
}

/// Refuses the expansions of a problem of which a point lies outside the mesh, which would fail when the run is over, and those
/// that hold matter, whose terms mean nothing.
pub(super) fn check_all(config: &Config, source: &SourceMap, problem: &Problem) -> Result<(), Error> {
    let (mesh, states) = (problem.original(), problem.states());
    let mut sink = DiagnosticSink::new(config, source, Vec::new());
    for (k, set) in config.multipoles.iter().enumerate() {
        let planes = Planes::of(config, set, (&states[0], mesh));
        if let Some(axis) = planes.divided {
            let message = format!(
                "the expansion `{}` ends at a plane across {} that is flux-parallel and flux-normal within its radius",
                set.name,
                ["x", "y", "z"][axis]
            );
            let fault = source.diagnostic(&format!("multipoles[{k}].radius"), message);
            sink.push(
                fault.expected("one condition in a plane through its centre, beyond which it has an image"),
            );
            continue;
        }
        let Some((message, what)) = disturbance(set, (problem, mesh), &planes)? else {
            sink.take(multipoles(config, set, mesh, &states[0]))?;
            continue;
        };
        let expected = match set.shape {
            ExpansionShape::Circle => "a circle in air, on which B is that of sources beside it",
            ExpansionShape::Ball => "air alone in it: only there is B a sum of the terms of sources outside",
        };
        let fault = source.diagnostic(&format!("multipoles[{k}].radius"), message);
        let help = match what {
            Multipoles::NOWHERE => {
                "take a smaller radius, another center, or a model that ends in planes of constant coordinate alone: an expansion has \
                 images in these"
            }
            _ => "take a smaller radius, or another center",
        };
        sink.push(fault.expected(expected).help(help));
    }
    sink.check()
}

/// Matter in an expansion, in words, and what it is.
fn disturbance(
    set: &MultipoleSet,
    (problem, mesh): (&Problem, &Mesh),
    planes: &Planes,
) -> Result<Option<(String, &'static str)>, Error> {
    let bounds = AxisBox::around(mesh.bounding_box());
    let disturbed = Multipoles::disturbance(problem.states(), mesh, &expansion(set)?, &planes.mirrors);
    // Beyond the box of the mesh it is no hole.
    Ok(disturbed.filter(|(place, _)| bounds.contains(*place)).map(|(place, what)| {
        let shape = match set.shape {
            ExpansionShape::Circle => "circle",
            ExpansionShape::Ball => "ball",
        };
        let place = millimetres(place);
        (format!("the {shape} of the expansion `{}` holds {what}, at {place}", set.name), what)
    }))
}

/// The expansions into which a design, on its mesh, has brought matter.
pub(crate) fn warnings(config: &Config, problem: &Problem, mesh: &Mesh) -> Result<Vec<String>, Error> {
    let of = |set| {
        let planes = Planes::of(config, set, (&problem.states()[0], mesh));
        Ok(disturbance(set, (problem, mesh), &planes)?.map(|(message, _)| message))
    };
    let found: Result<Vec<Option<String>>, Error> = config.multipoles.iter().map(of).collect();
    let advice = "in this design: its terms are not those of sources beside it; keep the surface out of it by bounds of the design, or take \
                  a smaller radius";
    Ok(found?.into_iter().flatten().map(|message| format!("{message}, {advice}")).collect())
}

/// An expansion on a mesh.
pub(crate) fn multipoles(
    config: &Config,
    set: &MultipoleSet,
    mesh: &Mesh,
    model: &FieldModel,
) -> Result<Multipoles, Error> {
    let expansion = expansion(set)?;
    let planes = Planes::of(config, set, (model, mesh)).mirrors;
    // What is reported is what is made of it.
    let functionals = functionals(config).into_iter().map(|(_, own)| own);
    let of_set =
        |own: &&config::Functional| expansion_of(config, own).is_some_and(|found| found.name == set.name);
    let written = functionals.filter(of_set).find_map(|own| own.follow);
    Ok(Multipoles::new(model, mesh, &set.name, &expansion, (&planes, follow(written)))?)
}

/// A functional of terms.
pub(super) fn functional(
    config: &Config,
    wanted: &config::Functional,
    mesh: &Mesh,
    model: &FieldModel,
) -> Result<Functional, Error> {
    let set = expansion_of(config, wanted).expect("checked with the names");
    let harmonics: Vec<Harmonic> = wanted.harmonics.iter().flatten().filter_map(|text| parse(text)).collect();
    let of = match (wanted.kind, harmonics.first()) {
        (ObjectiveKind::Multipole, Some(first)) => OfTerms::Coefficient(*first),
        _ => OfTerms::Content { terms: harmonics, main: main_terms(set) },
    };
    Ok(Functional::multipole(multipoles(config, set, mesh, model)?, of)?)
}

/// The planes through the centre of an expansion, as its images see them.
struct Planes {
    /// Those of symmetry.
    mirrors: Vec<MirrorPlane>,
    /// The axis of one of which faces within the radius have both conditions.
    divided: Option<usize>,
}

impl Planes {
    /// By the outer faces that reach within the radius: what holds elsewhere in such a plane is no matter of the images of a circle or
    /// ball. A face without condition is flux-normal beside others, and makes no plane alone.
    fn of(config: &Config, set: &MultipoleSet, (model, mesh): (&FieldModel, &Mesh)) -> Self {
        let boundaries = &config.boundaries;
        let named = |names: &[String]| faces_of(mesh.topology(), names.iter().map(String::as_str));
        let (parallel, normal) = (named(&boundaries.flux_parallel), named(&boundaries.flux_normal));
        let replaced = model.conductors().iter().flat_map(|own| &own.surface);
        let replaced: HashSet<_> = replaced.map(|face| face_key(*face)).collect();
        // By axis: whether faces are flux-parallel, flux-normal, and so without a word.
        let mut found = [[false; 3]; 3];
        for facet in mesh.topology().outer_facets() {
            let (key, corners) = (face_key(facet.nodes), facet.nodes.map(|node| mesh.point(node)));
            let off = |axis: usize| {
                corners.iter().map(|x| (x[axis] - set.center[axis]).abs()).fold(0.0_f64, f64::max)
            };
            let Some(axis) = (0..3).find(|&axis| off(axis) <= OFF_CENTRE * set.radius) else { continue };
            let kind = if parallel.contains(&key) {
                0
            } else if normal.contains(&key) {
                1
            } else if replaced.contains(&key) {
                continue;
            } else {
                2
            };
            found[axis][kind] |= nearest_on_triangle(set.center, &corners).1 < set.radius;
        }
        let mirrors = (0..3).filter(|&axis| found[axis][0] || found[axis][1]).map(|axis| {
            let across = if found[axis][0] { -1.0 } else { 1.0 };
            MirrorPlane { axis, at: set.center[axis], across }
        });
        let is_divided = |axis: &usize| found[*axis][0] && (found[*axis][1] || found[*axis][2]);
        Self { mirrors: mirrors.collect(), divided: (0..3).find(is_divided) }
    }
}
