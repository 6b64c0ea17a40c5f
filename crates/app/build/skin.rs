//! Skin-depth audits of the conductors: of the mesh as it is, of the thinnest design allowed, and of a design that was found.

use std::collections::{BTreeMap, BTreeSet};

use fluxmorph_geometry::tet4::{Point, add};
use fluxmorph_geometry::{ElementId, Mesh, NodeId, Readable, RegionId};
use fluxmorph_optimizer::problem::{Problem, Shape};
use fluxmorph_solver::Material;
use fluxmorph_solver::audit::{SkinAudit, conductor_of, first_layer, skin_audit};

use super::curves::Curves;
use super::entries::{material, solid_coil};
use super::field;
use crate::config::{self, Config, Limit, RegionModel};

/// Of which permeability a skin depth is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PermeabilityOf {
    /// That of a linear material.
    Material,
    /// The largest of a B–H curve: what the field leaves of it is not known yet.
    LargestOfCurve,
    /// The median of a B–H curve over the surface of the conductor, in the field of an analysis.
    Field,
}

/// The audit of one conductor and how it is modelled.
#[derive(Debug)]
pub struct Audited {
    /// What was found.
    pub audit: SkinAudit,
    /// Of which permeability.
    pub permeability_of: PermeabilityOf,
    /// At which frequency [Hz].
    pub frequency: f64,
    /// Meshed, or replaced by its impedance surface.
    pub model: RegionModel,
    /// The frequency [Hz] at which something speaks against the other one of these; `None` where nothing does at any.
    pub other_fails_at: Option<f64>,
}

impl Audited {
    /// The warning for the user, if there is one.
    pub fn warning(&self) -> Option<String> {
        let (coarse, thin) = (self.audit.volume_warning(), self.audit.impedance_warning());
        let permeability = self.audit.relative_permeability;
        match (self.model, self.permeability_of) {
            (RegionModel::Volume, PermeabilityOf::LargestOfCurve) => coarse.map(|text| {
                format!(
                    "{}. Refine the skin: the depth is that of the largest permeability of the B–H curve, {permeability:.0}; \
                     where iron saturates it is more, and an analysis says whether the mesh carries that",
                    finding(&text)
                )
            }),
            (RegionModel::Volume, PermeabilityOf::Field) => coarse.map(|text| {
                format!(
                    "{}. Refine the skin: the depth is that of the median permeability that the field leaves at its surface, \
                     {permeability:.0}, and smaller where there is more",
                    finding(&text)
                )
            }),
            // Neither model must send to the other where that one has an objection too.
            (RegionModel::Volume, PermeabilityOf::Material) if thin.is_some() => coarse.map(|text| {
                format!(
                    "{}. Refine the skin; an impedance surface cannot stand for the region, which is too thin for one, {}",
                    finding(&text),
                    self.audit.thinness().unwrap_or_default()
                )
            }),
            (RegionModel::Volume, PermeabilityOf::Material) if self.other_fails_at.is_some() => {
                coarse.map(|text| text.split(", or use model").next().unwrap_or_default().to_owned())
            }
            (RegionModel::Volume, PermeabilityOf::Material) => coarse,
            (RegionModel::Impedance, _) => thin.map(|text| match self.other_fails_at {
                Some(at) => {
                    let at = if at == self.frequency { String::new() } else { format!(" at {} Hz", Readable(at)) };
                    format!("{text} with thinner elements at its surface: these are too thick for the skin depth{at}")
                }
                None => text,
            }),
            (RegionModel::Perfect, _) => None,
        }
    }
}

/// A warning without its advice.
fn finding(warning: &str) -> &str {
    warning.split(". Refine the skin").next().unwrap_or_default()
}

/// The warnings of audits, one a region: of many frequencies and loads that of the worst.
pub(crate) fn warnings<'a>(audits: impl IntoIterator<Item = &'a Audited>) -> Vec<String> {
    worst_of_regions(audits.into_iter().filter_map(|audited| Some((audited, audited.warning()?))))
}

/// Of what is said of audits that of the worst frequency of each region.
fn worst_of_regions<'a>(said: impl Iterator<Item = (&'a Audited, String)>) -> Vec<String> {
    let mut by_region: BTreeMap<&str, Vec<(&Audited, String)>> = BTreeMap::new();
    for (audited, text) in said {
        by_region.entry(&audited.audit.region).or_default().push((audited, text));
    }
    let worst = |of_region: Vec<(&Audited, String)>| {
        let frequencies: BTreeSet<u64> = of_region.iter().map(|(own, _)| own.frequency.to_bits()).collect();
        // A mesh carries the thinnest skin last, an impedance surface stands for the deepest last.
        let badness = |(own, _): &(&Audited, String)| match own.model {
            RegionModel::Impedance => own.audit.skin_depth,
            RegionModel::Volume | RegionModel::Perfect => -own.audit.skin_depth,
        };
        let (audited, text) = of_region.into_iter().max_by(|a, b| badness(a).total_cmp(&badness(b)))?;
        Some(match frequencies.len() {
            1 => text,
            count => {
                format!("at {} Hz, the worst of {count} frequencies: {text}", Readable(audited.frequency))
            }
        })
    };
    by_region.into_values().filter_map(worst).collect()
}

/// Audits of all conductors that a mesh holds, at all frequencies. Iron with a B–H curve has the largest permeability of it; where
/// the curve could not be read there is none.
pub(super) fn audits(config: &Config, mesh: &Mesh, curves: &Curves) -> Vec<Audited> {
    let frequencies = config.frequencies();
    let of = |(name, region): (&String, &config::Region)| {
        let conductor = conductor(config, mesh, name)?;
        let linear = material(config, name);
        let saturates = config.materials.get(&region.material).is_some_and(config::Material::saturates);
        let (material, permeability_of) = if saturates {
            let relative_permeability = curves.of(config, name)?.largest_permeability();
            (Material { relative_permeability, ..linear }, PermeabilityOf::LargestOfCurve)
        } else {
            (linear, PermeabilityOf::Material)
        };
        let at = |&frequency: &f64| Some((frequency, audit(config, mesh, &conductor, &material, frequency)?));
        let own: Vec<(f64, SkinAudit)> = frequencies.iter().filter_map(at).collect();
        let other_fails_at = match region.model {
            RegionModel::Volume if frequencies.contains(&0.0) => Some(0.0),
            RegionModel::Volume if solid_coil(config, name).is_some() => frequencies.first().copied(),
            RegionModel::Volume => first(&own, |audit| audit.thinness().is_some()),
            RegionModel::Impedance | RegionModel::Perfect => {
                first(&own, |audit| audit.volume_warning().is_some())
            }
        };
        let audited = |(frequency, audit)| Audited {
            audit,
            permeability_of,
            frequency,
            model: region.model,
            other_fails_at,
        };
        Some(own.into_iter().map(audited).collect::<Vec<_>>())
    };
    let has_skin = |(_, region): &(&String, &config::Region)| region.model != RegionModel::Perfect;
    config.regions.iter().filter(has_skin).filter_map(of).flatten().collect()
}

/// The frequency [Hz] of the first audit that is so.
fn first(audits: &[(f64, SkinAudit)], is_so: impl Fn(&SkinAudit) -> bool) -> Option<f64> {
    audits.iter().find(|(_, audit)| is_so(audit)).map(|(frequency, _)| *frequency)
}

/// An audit of iron with a B–H curve in the mesh and the field of an analysis, which leaves the elements of its first layer, with the
/// areas [m²] of their faces, this permeability.
pub(crate) fn audit_in_field(
    (config, mesh): (&Config, &Mesh),
    supposed: &Audited,
    relative_permeability: impl Fn(&[(ElementId, f64)]) -> Option<f64>,
) -> Option<Audited> {
    let (name, frequency) = (&supposed.audit.region, supposed.frequency);
    let conductor = conductor(config, mesh, name)?;
    let faces = first_layer(mesh, (conductor.0, &conductor.1));
    let layer: Vec<(ElementId, f64)> = faces.iter().map(|face| (face.element, face.area)).collect();
    let material =
        Material { relative_permeability: relative_permeability(&layer)?, ..material(config, name) };
    let audit = audit(config, mesh, &conductor, &material, frequency)?;
    Some(Audited { audit, permeability_of: PermeabilityOf::Field, ..*supposed })
}

fn audit(
    config: &Config,
    mesh: &Mesh,
    (id, conductor): &(RegionId, Vec<RegionId>),
    material: &Material,
    frequency: f64,
) -> Option<SkinAudit> {
    skin_audit(mesh, (*id, conductor), material, frequency, field::order(config))
}

/// A region with an entry and a mesh, and the conductor that it is a part of.
fn conductor(config: &Config, mesh: &Mesh, name: &str) -> Option<(RegionId, Vec<RegionId>)> {
    let id = mesh.topology().region(name).ok()?;
    Some((id, conductor_of(mesh, id, &alike(config, mesh, config.regions.get(name)?))))
}

/// Regions of the same material and model.
fn alike(config: &Config, mesh: &Mesh, region: &config::Region) -> Vec<RegionId> {
    let is_alike =
        |other: &config::Region| (&other.material, other.model) == (&region.material, region.model);
    let others = config.regions.iter().filter(|(_, other)| is_alike(other));
    others.filter_map(|(name, _)| mesh.topology().region(name).ok()).collect()
}

/// What the audits, without objection to the mesh as it is, have against the thinnest design that the bounds allow.
pub(super) fn bound_warnings(
    config: &Config,
    audits: &[Audited],
    (problem, full_mesh): (&Problem, &Mesh),
) -> Vec<String> {
    let Some(shape) = problem.shape() else { return Vec::new() };
    let bounds = [("design.lower", shape.lower()), ("design.upper", shape.upper())];
    let left = bounds.map(|(_, p)| thinnest(config, (problem.original(), full_mesh), shape, p));
    // The bound at which least is left of a body; without a thickness the lower one.
    let least = left.each_ref().map(|bodies| bodies.values().copied().fold(f64::INFINITY, f64::min));
    let at = usize::from(least[1] < least[0]);
    let (key, p) = bounds[at];
    let sound = audits.iter().filter(|audited| audited.warning().is_none());
    let mut warnings: Vec<String> = wall_warnings(sound, &left[at])
        .into_iter()
        .map(|text| {
            format!(
                "at {key} {text}. Take a bound nearer to zero, or a constraint of kind = \"thickness\" with a minimum"
            )
        })
        .collect();
    // Where the mesh does not come to a bound in one step, the audit of the result is the next one.
    if let Ok(moved) = problem.moved(p) {
        warnings.extend(
            new_objections(config, audits.iter(), &moved.mesh)
                .into_iter()
                .map(|text| format!("at {key}: {text}")),
        );
    }
    warnings
}

/// What the audits have against the mesh and the least thickness [m] of a design, but for what they had against the mesh at
/// the start.
pub(crate) fn result_warnings(
    config: &Config,
    audits: &[Audited],
    mesh: &Mesh,
    thinnest: &LeastThickness,
) -> Vec<String> {
    let sound = audits.iter().filter(|audited| audited.warning().is_none());
    // What iron with a B–H curve has is said of its field.
    let linear = audits.iter().filter(|own| own.permeability_of == PermeabilityOf::Material);
    [wall_warnings(sound, thinnest), new_objections(config, linear, mesh)].concat()
}

/// Objections to meshed conductors of a moved mesh to which there was none at the start.
fn new_objections<'a>(
    config: &Config,
    audits: impl Iterator<Item = &'a Audited>,
    mesh: &Mesh,
) -> Vec<String> {
    let again = |then: &Audited| {
        let name = &then.audit.region;
        let relative_permeability = then.audit.relative_permeability;
        let material = Material { relative_permeability, ..material(config, name) };
        let audit = audit(config, mesh, &conductor(config, mesh, name)?, &material, then.frequency)?;
        Some((then.warning().is_none(), Audited { audit, ..*then }))
    };
    let moved: Vec<(bool, Audited)> =
        audits.filter(|own| own.model == RegionModel::Volume).filter_map(again).collect();
    let is_thin = |(_, own): &&(bool, Audited)| own.audit.thinness().is_some();
    let now_thin: BTreeMap<String, f64> =
        moved.iter().filter(is_thin).map(|(_, own)| (own.audit.region.clone(), own.frequency)).collect();
    let looked_at = moved.into_iter().filter(|(was_sound, _)| *was_sound).map(|(_, own)| Audited {
        other_fails_at: own.other_fails_at.or(now_thin.get(&own.audit.region).copied()),
        ..own
    });
    warnings(&looked_at.collect::<Vec<_>>())
}

/// The least thickness [m] of every designed body, by the names of their regions.
pub(crate) type LeastThickness = BTreeMap<String, f64>;

/// What impedance surfaces assume in vain of the walls that they stand for.
fn wall_warnings<'a>(audits: impl Iterator<Item = &'a Audited>, least: &LeastThickness) -> Vec<String> {
    worst_of_regions(audits.filter(|own| own.model == RegionModel::Impedance).filter_map(|own| {
        let thickness = *least.get(&own.audit.region)?;
        Some((own, own.audit.wall_warning(thickness)?))
    }))
}

/// The least thickness [m] of the designed bodies where every node is at `place` [m].
pub(crate) fn least_thickness(
    shape: &Shape,
    full_mesh: &Mesh,
    place: impl Fn(NodeId) -> Point,
) -> LeastThickness {
    let Some(thickness) = shape.thickness() else { return BTreeMap::new() };
    let name = |region: RegionId| full_mesh.topology().region_names()[region.index()].clone();
    let least = thickness.least_of_bodies(place);
    least.into_iter().map(|(region, least)| (name(region), least)).collect()
}

/// That for the variables `p`, with all nodes but those of the design as they were, or the least that a constraint allows.
fn thinnest(config: &Config, (mesh, full_mesh): (&Mesh, &Mesh), shape: &Shape, p: &[f64]) -> LeastThickness {
    let surface = shape.surface();
    let displacement = shape.displacement(p);
    let place = |node: NodeId| -> Point {
        match surface.nodes().binary_search(&node) {
            Ok(i) => add(mesh.point(node), displacement[i]),
            Err(_) => mesh.point(node),
        }
    };
    let least = least_thickness(shape, full_mesh, place);
    let minimum = |constraint: &config::Constraint| match constraint.limit {
        Limit::Thickness { minimum, .. } => minimum,
        _ => None,
    };
    let minima: Vec<f64> = config.constraints.iter().filter_map(minimum).collect();
    let allowed = |least: f64| minima.iter().copied().fold(least, f64::max);
    least.into_iter().map(|(name, least)| (name, allowed(least))).collect()
}
