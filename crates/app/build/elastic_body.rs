//! The elastic body of a configuration: its subregions, boundary kinds and design nodes.

use std::collections::BTreeSet;

use fluxmorph_geometry::tet4::{Point, centroid};
use fluxmorph_geometry::{ElementId, Mesh, NodeId, RegionId};
use fluxmorph_remesh::{
    Boundary, BoundaryKind, KinematicConstraint, Motion, MotionLaw, RemeshSetup, SolverChoice,
    StiffnessPolicy, Subregion,
};

use crate::config::{
    self, Design, DesignDirection, Diagnostic, DirectionWord, Remesh, RemeshExtent, SourceMap, StiffnessLaw,
};
use crate::error::Error;

/// Subregions, boundary kinds and design nodes (ascending) of the elastic body.
pub(super) fn remesh_setup(
    source: &SourceMap,
    remesh: &Remesh,
    mesh: &Mesh,
    design_nodes: &[NodeId],
    (law, kinematic_constraint): (MotionLaw, KinematicConstraint),
    warnings: &mut Vec<String>,
) -> Result<RemeshSetup, Error> {
    let mut subregions = subregions(remesh, mesh, design_nodes, warnings)?;
    // A region that an impedance surface replaces has no elements left, and is no part of the body.
    subregions.retain(|part| !part.elements.is_empty());
    check_subregions(source, remesh, &subregions)?;
    for part in &mut subregions {
        let own = remesh.subregions.iter().find(|own| own.name == part.name);
        part.young = own.and_then(|own| own.young).unwrap_or(remesh.young);
        part.poisson = own.and_then(|own| own.poisson).unwrap_or(remesh.poisson);
        part.force = own.and_then(|own| own.force).unwrap_or(remesh.force);
    }
    let mut boundaries = Vec::new();
    for (names, kind) in [
        (&remesh.slide, BoundaryKind::Slide),
        (&remesh.fixed, BoundaryKind::Fixed),
        (&remesh.free, BoundaryKind::Free),
    ] {
        for name in names {
            boundaries.push(Boundary::of_surface(mesh.topology(), name, kind)?);
        }
    }
    Ok(RemeshSetup {
        subregions,
        policy: stiffness_policy(remesh, law),
        kinematic_constraint,
        law,
        design_nodes: design_nodes.to_vec(),
        boundaries,
        solver: SolverChoice::Automatic,
        ownership: None,
    })
}

/// How stiffness follows element size by a law: as written, or what serves the law best.
pub(crate) fn stiffness_policy(remesh: &Remesh, law: MotionLaw) -> StiffnessPolicy {
    match (remesh.stiffness, law) {
        (Some(StiffnessLaw::Uniform), _) => StiffnessPolicy::Uniform,
        (Some(StiffnessLaw::InverseSize), _) => StiffnessPolicy::InverseSize,
        (Some(StiffnessLaw::InverseVolume), _) => StiffnessPolicy::InverseVolume,
        (Some(StiffnessLaw::Directional), _) => StiffnessPolicy::Directional,
        (None, MotionLaw::Hyperelastic) => StiffnessPolicy::InverseVolume,
        (None, MotionLaw::Linear | MotionLaw::Rails(_)) => StiffnessPolicy::InverseSize,
    }
}

/// The parts of the body with their elements: the regions named and those at the design surface, or what a box holds of
/// each region.
fn subregions(
    remesh: &Remesh,
    mesh: &Mesh,
    design_nodes: &[NodeId],
    warnings: &mut Vec<String>,
) -> Result<Vec<Subregion>, Error> {
    let topology = mesh.topology();
    match &remesh.extent {
        RemeshExtent::Regions(names) => {
            let mut names: BTreeSet<&str> = names.iter().map(String::as_str).collect();
            for region in regions_at(mesh, design_nodes) {
                let name = &topology.region_names()[region.index()];
                if names.insert(name) {
                    warnings.push(format!(
                        "the region `{name}` touches the design surface and moves with it: it is taken into the remesh \
                         region"
                    ));
                }
            }
            names.into_iter().map(|name| Ok(Subregion::of_region(topology, name)?)).collect()
        }
        RemeshExtent::Box([lower, upper]) => {
            let inside = |e: &ElementId| {
                let c = centroid(mesh.vertices(*e));
                (0..3).all(|d| lower[d] <= c[d] && c[d] <= upper[d])
            };
            let elements = |i| topology.elements_of(RegionId::new(i)).into_iter().filter(inside);
            let parts = topology.region_names().iter().enumerate();
            Ok(parts.map(|(i, name)| Subregion::new(name, elements(i).collect())).collect())
        }
    }
}

/// Refuses an entry for a region that is no part of the body, and a body without elements.
fn check_subregions(source: &SourceMap, remesh: &Remesh, subregions: &[Subregion]) -> Result<(), Error> {
    let outside: Vec<Diagnostic> = remesh
        .subregions
        .iter()
        .enumerate()
        .filter(|(_, own)| subregions.iter().all(|part| part.name != own.name))
        .map(|(i, own)| {
            let message = format!("the region `{}` is no part of the remesh region", own.name);
            source
                .diagnostic(&format!("remesh.subregions[{i}].name"), message)
                .help("name it in remesh.region too, or take the subregion out")
        })
        .collect();
    source.check(outside)?;
    if !subregions.is_empty() {
        return Ok(());
    }
    let (key, expected) = match &remesh.extent {
        RemeshExtent::Regions(_) => ("remesh.region", "at least one region that is meshed"),
        RemeshExtent::Box(_) => ("remesh.box", "a box that holds the centroid of some element"),
    };
    let fault = source.diagnostic(key, format!("`{key}` holds no element of the mesh")).expected(expected);
    Err(source.error(vec![fault]).into())
}

/// Largest component across an axis of a direction along it: far above what is left of the normals of a plane by rounding.
const ALONG: f64 = 1e-9;

/// The coordinate axis that all directions are along, those without length aside.
pub(super) fn common_axis(directions: &[Point]) -> Option<usize> {
    let largest = directions.iter().flatten().fold(0.0_f64, |largest, c| largest.max(c.abs()));
    let is_across = |axis: usize, u: &Point| (0..3).any(|d| d != axis && u[d].abs() > ALONG * largest);
    (0..3).find(|&axis| largest > 0.0 && !directions.iter().any(|u| is_across(axis, u)))
}

/// What a motion is prescribed by: it decides the law where none is written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Mover {
    /// A design, whose mesh should be one function of it.
    Design,
    /// `[morph]`, the paper's method.
    Morph,
}

/// The law of the motion for nodes that all move along `axis`, if there is one.
pub(super) fn motion_law(
    source: &SourceMap,
    remesh: &Remesh,
    axis: Option<usize>,
    mover: Mover,
) -> Result<MotionLaw, Error> {
    let has_force = has_force(remesh);
    let fault = match (remesh.law, axis) {
        (None, _) if mover == Mover::Morph || has_force => return Ok(MotionLaw::Linear),
        (Some(config::MotionLaw::Linear), _) => return Ok(MotionLaw::Linear),
        (Some(law), _) if has_force => {
            let message = format!("motion by the law `{}` knows no force", law.name());
            source.diagnostic("remesh.law", message).expected("law = \"linear\", or no `force`")
        }
        (None | Some(config::MotionLaw::Rails), Some(axis)) => return Ok(MotionLaw::Rails(axis)),
        (None | Some(config::MotionLaw::Hyperelastic), _) => return Ok(MotionLaw::Hyperelastic),
        (Some(config::MotionLaw::Rails), None) => source
            .diagnostic("remesh.law", "not all nodes move along one of x, y and z")
            .expected("law = \"hyperelastic\" or \"linear\", or a motion along one axis"),
    };
    Err(source.error(vec![fault]).into())
}

/// What is said of keys of `[remesh]` that only the linear law knows, beside another law; not where they stand at their defaults.
pub(super) fn unused_keys(source: &SourceMap, remesh: &Remesh, law: MotionLaw) -> Option<String> {
    let name = match law {
        MotionLaw::Linear => return None,
        MotionLaw::Rails(_) => config::MotionLaw::Rails.name(),
        MotionLaw::Hyperelastic => config::MotionLaw::Hyperelastic.name(),
    };
    let own = [
        ("remesh.poisson", remesh.poisson != config::DEFAULT_POISSON),
        ("remesh.motion", remesh.motion != config::Motion::Free),
    ];
    let own = own.into_iter().filter(|(_, is_other)| *is_other).map(|(path, _)| path.to_owned());
    let of_parts = (0..remesh.subregions.len()).map(|i| format!("remesh.subregions[{i}].poisson"));
    let written: Vec<String> = own.chain(of_parts).filter(|path| source.is_written(path)).collect();
    (!written.is_empty()).then(|| {
        let verb = if written.len() == 1 { "has" } else { "have" };
        format!(
            "{} {verb} no effect: the mesh moves by the law `{name}`; take the key out, or write remesh.law = \"linear\"",
            written.join(", ")
        )
    })
}

/// How the mesh of a design moves, and why so where the configuration leaves it open.
pub(crate) fn motion_in_words(remesh: &Remesh, motion: &Motion) -> String {
    let why = |reason: &str| if remesh.law.is_none() { format!(", as {reason}") } else { String::new() };
    let several = "the design moves in several directions";
    match motion.law() {
        MotionLaw::Rails(axis) => {
            let axis = ["x", "y", "z"][axis];
            let why = why(&format!("the design moves along {axis} alone"));
            format!("rails along {axis}, one mesh a design{why}")
        }
        MotionLaw::Hyperelastic => format!("hyperelastic, one mesh a design{}", why(several)),
        MotionLaw::Linear => {
            let reason = if has_force(remesh) { "a force acts" } else { several };
            format!("linear elasticity, one mesh a design{}", why(reason))
        }
    }
}

/// Whether a fictitious force acts on some part of the body.
fn has_force(remesh: &Remesh) -> bool {
    let own = remesh.subregions.iter().filter_map(|own| own.force);
    own.chain([remesh.force]).any(|force| force != [0.0; 3])
}

/// The axis of the design's direction where the motion is to follow it.
pub(super) fn guidance(
    source: &SourceMap,
    design: Option<&Design>,
    remesh: &Remesh,
) -> Result<KinematicConstraint, Error> {
    let axis = match design.map(|design| design.direction) {
        Some(DesignDirection::Vector(direction)) => (0..3).find(|&d| direction[d].abs() == 1.0),
        Some(DesignDirection::Word(DirectionWord::Normal)) | None => None,
    };
    match remesh.motion {
        config::Motion::Free => Ok(KinematicConstraint::Free),
        config::Motion::AlongDesign => match axis {
            Some(axis) => Ok(KinematicConstraint::Axis(axis)),
            None => {
                let fault = source
                    .diagnostic("remesh.motion", "the design does not move along a coordinate axis")
                    .expected("motion = \"free\", or a design.direction along x, y or z");
                Err(source.error(vec![fault]).into())
            }
        },
    }
}

/// Regions with an element that has a face between design nodes, which are ascending.
pub(super) fn regions_at(mesh: &Mesh, design_nodes: &[NodeId]) -> BTreeSet<RegionId> {
    let topology = mesh.topology();
    topology
        .facets()
        .iter()
        .filter(|f| f.nodes.iter().all(|n| design_nodes.binary_search(n).is_ok()))
        .flat_map(|f| std::iter::once(f.inside).chain(f.outside))
        .map(|e| topology.region_of()[e.index()])
        .collect()
}
