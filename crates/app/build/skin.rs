//! Skin-depth audits of the conductors: of the mesh as it is, of the thinnest design allowed, and of a design that was found.

use std::collections::{BTreeMap, BTreeSet};

use fluxmorph_geometry::tet4::{Point, add};
use fluxmorph_geometry::{ElementId, Mesh, NodeId, Readable, RegionId};
use fluxmorph_optimizer::problem::{Problem, Shape};
use fluxmorph_solver::Material;
use fluxmorph_solver::audit::{SkinAudit, conductor_of, first_layer, skin_audit};

use super::curves::Curves;
use super::entries::material;
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
                    "{}. Refine the skin: the region is too thin for an impedance surface, {}",
                    finding(&text),
                    self.audit.thinness().unwrap_or_default()
                )
            }),
            (RegionModel::Volume, PermeabilityOf::Material) => coarse,
            (RegionModel::Impedance, _) if coarse.is_some() => thin.map(|text| {
                format!("{text} with thinner elements at its surface: these are too thick for the skin depth")
            }),
            (RegionModel::Impedance, _) => thin,
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
    let mut by_region: BTreeMap<&str, Vec<(&Audited, String)>> = BTreeMap::new();
    for audited in audits {
        if let Some(warning) = audited.warning() {
            by_region.entry(&audited.audit.region).or_default().push((audited, warning));
        }
    }
    let worst = |of_region: Vec<(&Audited, String)>| {
        let frequencies: BTreeSet<u64> = of_region.iter().map(|(own, _)| own.frequency.to_bits()).collect();
        // A mesh carries the thinnest skin last, an impedance surface stands for the deepest last.
        let badness = |(own, _): &(&Audited, String)| match own.model {
            RegionModel::Impedance => own.audit.skin_depth,
            RegionModel::Volume | RegionModel::Perfect => -own.audit.skin_depth,
        };
        let (audited, warning) = of_region.into_iter().max_by(|a, b| badness(a).total_cmp(&badness(b)))?;
        Some(match frequencies.len() {
            1 => warning,
            count => {
                format!("at {} Hz, the worst of {count} frequencies: {warning}", Readable(audited.frequency))
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
        let at = |&frequency: &f64| {
            let audit = audit(config, mesh, &conductor, &material, frequency)?;
            Some(Audited { audit, permeability_of, frequency, model: region.model })
        };
        Some(frequencies.iter().filter_map(at).collect::<Vec<_>>())
    };
    let has_skin = |(_, region): &(&String, &config::Region)| region.model != RegionModel::Perfect;
    config.regions.iter().filter(has_skin).filter_map(of).flatten().collect()
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
    let thin = sound.filter_map(|own| wall_warning(own, &left[at]));
    let mut warnings: Vec<String> = thin
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
    sound.filter_map(|own| wall_warning(own, thinnest)).chain(new_objections(config, linear, mesh)).collect()
}

/// Objections to meshed conductors of a moved mesh to which there was none at the start.
fn new_objections<'a>(
    config: &Config,
    audits: impl Iterator<Item = &'a Audited>,
    mesh: &Mesh,
) -> Vec<String> {
    let is_looked_at = |own: &&Audited| own.model == RegionModel::Volume && own.warning().is_none();
    let again = |then: &Audited| {
        let name = &then.audit.region;
        let relative_permeability = then.audit.relative_permeability;
        let material = Material { relative_permeability, ..material(config, name) };
        let audit = audit(config, mesh, &conductor(config, mesh, name)?, &material, then.frequency)?;
        Some(Audited { audit, ..*then })
    };
    let moved: Vec<Audited> = audits.filter(is_looked_at).filter_map(again).collect();
    warnings(&moved)
}

/// The least thickness [m] of every designed body, by the names of their regions.
pub(crate) type LeastThickness = BTreeMap<String, f64>;

/// What an impedance surface assumes in vain of the wall that it stands for.
fn wall_warning(audited: &Audited, least: &LeastThickness) -> Option<String> {
    let thickness = *least.get(&audited.audit.region)?;
    (audited.model == RegionModel::Impedance).then(|| audited.audit.wall_warning(thickness)).flatten()
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
