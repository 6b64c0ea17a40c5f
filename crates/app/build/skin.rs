//! Skin-depth audits of the conductors: of the mesh as it is, of the thinnest design allowed, and of a design that was found.

use std::collections::BTreeMap;

use fluxmorph_geometry::tet4::{Point, add};
use fluxmorph_geometry::{Mesh, NodeId, RegionId};
use fluxmorph_optimizer::problem::{Problem, Shape};
use fluxmorph_solver::Material;
use fluxmorph_solver::audit::{SkinAudit, conductor_of, skin_audit};

use super::curves::Curves;
use super::entries::material;
use super::field;
use crate::config::{self, Config, Limit, RegionModel};

/// Of which permeability a skin depth is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SkinOf {
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
    pub skin_of: SkinOf,
    /// At which frequency [Hz].
    pub frequency: f64,
    /// Meshed, or replaced by its impedance surface.
    pub model: RegionModel,
}

impl Audited {
    /// The warning for the user, if there is one.
    pub fn warning(&self) -> Option<String> {
        let (coarse, thin) = (self.audit.volume_warning(), self.audit.impedance_warning());
        let depths = self.audit.thickness_in_skin_depths;
        let permeability = self.audit.relative_permeability;
        match (self.model, self.skin_of) {
            (RegionModel::Volume, SkinOf::LargestOfCurve) => coarse.map(|text| {
                format!(
                    "{}. Refine the skin: the depth is that of the largest permeability of the B–H curve, {permeability:.0}; \
                     where iron saturates it is more, and an analysis says whether the mesh carries that",
                    finding(&text)
                )
            }),
            (RegionModel::Volume, SkinOf::Field) => coarse.map(|text| {
                format!(
                    "{}. Refine the skin: the depth is that of the median permeability that the field leaves at its surface, \
                     {permeability:.0}",
                    finding(&text)
                )
            }),
            // Neither model must send to the other where that one has an objection too.
            (RegionModel::Volume, SkinOf::Material) if thin.is_some() => coarse.map(|text| {
                format!(
                    "{}. Refine the skin: at {depths:.1} skin depths on average the region is too thin for an impedance surface",
                    finding(&text)
                )
            }),
            (RegionModel::Volume, SkinOf::Material) => coarse,
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

/// The warnings of audits, one a region: of many frequencies that of the worst.
pub(crate) fn warnings<'a>(audits: impl IntoIterator<Item = &'a Audited>) -> Vec<String> {
    let mut by_region: BTreeMap<&str, Vec<(&Audited, String)>> = BTreeMap::new();
    for audited in audits {
        if let Some(warning) = audited.warning() {
            by_region.entry(&audited.audit.region).or_default().push((audited, warning));
        }
    }
    let worst = |of_region: Vec<(&Audited, String)>| {
        let count = of_region.len();
        // A mesh carries the thinnest skin last, an impedance surface stands for the deepest last.
        let extent = |(own, _): &(&Audited, String)| match own.model {
            RegionModel::Impedance => own.audit.skin_depth,
            RegionModel::Volume | RegionModel::Perfect => -own.audit.skin_depth,
        };
        let (audited, warning) = of_region.into_iter().max_by(|a, b| extent(a).total_cmp(&extent(b)))?;
        Some(match count {
            1 => warning,
            _ => format!("at {} Hz, the worst of {count} frequencies: {warning}", audited.frequency),
        })
    };
    by_region.into_values().filter_map(worst).collect()
}

/// Audits of all conductors that a mesh holds, at all frequencies. Iron with a B–H curve has the largest permeability of it.
pub(super) fn audits(config: &Config, mesh: &Mesh, curves: &Curves) -> Vec<Audited> {
    let frequencies = config.frequencies();
    let of = |(name, region): (&String, &config::Region)| {
        let conductor = conductor(config, mesh, name)?;
        let linear = material(config, name);
        let (material, skin_of) = match curves.of(config, name) {
            None => (linear, SkinOf::Material),
            Some(curve) => {
                let relative_permeability = curve.largest_permeability();
                (Material { relative_permeability, ..linear }, SkinOf::LargestOfCurve)
            }
        };
        let at = |&frequency: &f64| {
            let audit = audit(config, mesh, &conductor, &material, frequency)?;
            Some(Audited { audit, skin_of, frequency, model: region.model })
        };
        Some(frequencies.iter().filter_map(at).collect::<Vec<_>>())
    };
    let has_skin = |(_, region): &(&String, &config::Region)| region.model != RegionModel::Perfect;
    config.regions.iter().filter(has_skin).filter_map(of).flatten().collect()
}

/// The audit of a meshed conductor whose surface has this permeability in the field of an analysis.
pub(crate) fn audited_in_field(
    (config, mesh): (&Config, &Mesh),
    name: &str,
    relative_permeability: f64,
    frequency: f64,
) -> Option<Audited> {
    let material = Material { relative_permeability, ..material(config, name) };
    let audit = audit(config, mesh, &conductor(config, mesh, name)?, &material, frequency)?;
    Some(Audited { audit, skin_of: SkinOf::Field, frequency, model: RegionModel::Volume })
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
            new_objections(config, audits, &moved.mesh).into_iter().map(|text| format!("at {key}: {text}")),
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
    sound.filter_map(|own| wall_warning(own, thinnest)).chain(new_objections(config, audits, mesh)).collect()
}

/// Objections to meshed conductors of a moved mesh to which there was none at the start. What iron with a B–H curve has there is
/// known from its field alone.
fn new_objections(config: &Config, audits: &[Audited], mesh: &Mesh) -> Vec<String> {
    let is_looked_at = |own: &&Audited| {
        own.model == RegionModel::Volume && own.skin_of == SkinOf::Material && own.warning().is_none()
    };
    let again = |then: &Audited| {
        let (name, frequency) = (&then.audit.region, then.frequency);
        let audit = audit(config, mesh, &conductor(config, mesh, name)?, &material(config, name), frequency)?;
        Some(Audited { audit, ..*then })
    };
    let moved: Vec<Audited> = audits.iter().filter(is_looked_at).filter_map(again).collect();
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
    let least = thickness.least_of_bodies(shape.surface(), place);
    least.into_iter().map(|(region, least)| (name(region), least)).collect()
}

/// That for the variables `p`, with opposite faces as they were, or the least that a constraint allows.
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
