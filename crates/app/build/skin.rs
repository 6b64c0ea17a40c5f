//! Skin-depth audits of the conductors: of the mesh as it is, of the thinnest design allowed, and of a design that was found.

use std::collections::BTreeMap;

use fluxmorph_geometry::tet4::{Point, add};
use fluxmorph_geometry::{Mesh, NodeId, RegionId};
use fluxmorph_optimizer::problem::{Problem, Shape};
use fluxmorph_solver::audit::{SkinAudit, conductor_of, skin_audit};

use super::entries::material;
use super::field;
use crate::config::{self, Config, Limit, RegionModel};

/// The audit of one conductor and how it is modelled.
#[derive(Debug)]
pub struct Audited {
    /// What was found.
    pub audit: SkinAudit,
    /// Meshed, or replaced by its impedance surface.
    pub model: RegionModel,
}

impl Audited {
    /// The warning for the user, if there is one.
    pub fn warning(&self) -> Option<String> {
        let (coarse, thin) = (self.audit.volume_warning(), self.audit.impedance_warning());
        let depths = self.audit.thickness_in_skin_depths;
        match self.model {
            // Neither model must send to the other where that one has an objection too.
            RegionModel::Volume if thin.is_some() => coarse.map(|text| {
                let what = text.split(". Refine the skin").next().unwrap_or_default();
                format!(
                    "{what}. Refine the skin: at {depths:.1} skin depths on average the region is too thin for an impedance \
                     surface"
                )
            }),
            RegionModel::Volume => coarse,
            RegionModel::Impedance if coarse.is_some() => thin.map(|text| {
                format!("{text} with thinner elements at its surface: these are too thick for the skin depth")
            }),
            RegionModel::Impedance => thin,
            RegionModel::Perfect => None,
        }
    }
}

/// Audits of all conductors that a mesh holds, at all frequencies.
pub(super) fn audits(config: &Config, mesh: &Mesh) -> Vec<Audited> {
    let frequencies = config.frequencies();
    let of = |(name, region): (&String, &config::Region)| {
        let id = mesh.topology().region(name).ok()?;
        let material = material(config, name);
        let conductor = conductor_of(mesh, id, &alike(config, mesh, region));
        let at = |&frequency: &f64| {
            let audit = skin_audit(mesh, (id, &conductor), &material, frequency, field::order(config))?;
            Some(Audited { audit, model: region.model })
        };
        Some(frequencies.iter().filter_map(at).collect::<Vec<_>>())
    };
    let has_skin = |(_, region): &(&String, &config::Region)| region.model != RegionModel::Perfect;
    config.regions.iter().filter(has_skin).filter_map(of).flatten().collect()
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
        warnings.extend(new_objections(config, audits, &moved.mesh).map(|text| format!("at {key}: {text}")));
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

/// Objections to meshed conductors of a moved mesh to which there was none at the start.
fn new_objections<'a>(
    config: &'a Config,
    audits: &'a [Audited],
    mesh: &'a Mesh,
) -> impl Iterator<Item = String> + 'a {
    let meshed = |own: &&Audited| own.model == RegionModel::Volume && own.warning().is_none();
    let is_new = move |now: &Audited| {
        let same = |then: &&Audited| {
            (&then.audit.region, then.audit.skin_depth) == (&now.audit.region, now.audit.skin_depth)
        };
        audits.iter().filter(meshed).any(|then| same(&then))
    };
    self::audits(config, mesh).into_iter().filter(is_new).filter_map(|now| now.warning())
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
