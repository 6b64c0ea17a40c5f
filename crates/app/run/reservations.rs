//! What the field of a design says against the model it was computed with: iron beyond saturation with a linear law, skins that the
//! mesh or the impedance surface of that design does not carry, losses that impedance surfaces leave out.
//!
//! `check` cannot know it. It is said at the end of a run or an analysis, and kept in `result.json`.

use std::collections::BTreeMap;

use fluxmorph_geometry::tet4::{Point, area_vector, centroid, norm, volume};
use fluxmorph_geometry::{ElementId, Readable, millimetres};
use fluxmorph_optimizer::problem::{Analysis, Problem};
use fluxmorph_solver::audit::weighted_median;
use fluxmorph_solver::bh::peak;
use fluxmorph_solver::material::VACUUM_PERMEABILITY;
use fluxmorph_solver::{FieldModel, FieldSolution, FieldState, SurfaceLaw};

use super::reported::under;
use super::{excess, transmission};
use crate::build::{
    Audited, PermeabilityOf, Setup, audit_in_field, least_thickness, material, multipole, overlap_warning,
    result_warnings, skin_warnings,
};
use crate::config::{Config, Goal, RegionModel};
use crate::error::Error;
use crate::files::ObjectiveResult;

/// Polarisation beyond which no iron follows a linear law [T]: electrical steels saturate at 2.0, pure iron at 2.16 (R. M.
/// Bozorth, Ferromagnetism, 1951), ferrites at 0.5.
const SATURATION: f64 = 2.0;

/// Share of a region's volume that must lie beyond it: elements at re-entrant corners have a field that grows with refinement.
const TOLERATED_SHARE: f64 = 1e-3;

/// Iron that is driven beyond saturation.
#[derive(Default)]
struct Saturated {
    /// Highest flux density [T] and the middle of its element [m].
    highest: (f64, Point),
    /// Volume beyond saturation [m³]; of an impedance surface area [m²].
    beyond: f64,
    /// Volume of the region [m³], or area of its surface [m²].
    whole: f64,
}

impl Saturated {
    /// Adds a part of this size with a flux density [T], of which the iron has a `share`.
    fn add(&mut self, size: f64, (flux_density, share): (f64, f64), middle: Point) {
        self.whole += size;
        self.beyond += if share * flux_density > SATURATION { size } else { 0.0 };
        if flux_density > self.highest.0 {
            self.highest = (flux_density, middle);
        }
    }
}

/// All that is to be said of the design of an analysis.
pub(super) fn reservations(
    config: &Config,
    setup: &Setup,
    analysis: &Analysis,
) -> Result<Vec<String>, Error> {
    let problem = &setup.problem;
    let mut all = saturation(config, problem, analysis);
    all.extend(skin_warnings(&skins_of_curves(config, setup, analysis)));
    all.extend(excess::of_conductors(config, problem, analysis));
    all.extend(transmission::warnings(config, problem, analysis));
    let least = problem
        .shape()
        .map(|shape| least_thickness(shape, &setup.full_mesh, |node| analysis.mesh.point(node)));
    all.extend(result_warnings(config, &setup.audits, &analysis.mesh, &least.unwrap_or_default()));
    // Where nothing moves the set-up has looked.
    if problem.shape().is_some() {
        all.extend(multipole::warnings(config, problem, &analysis.mesh)?);
    }
    all.extend(overlap_warning(config, &setup.full_mesh, [problem.original(), &analysis.mesh]));
    Ok(all)
}

/// An objective that is to be made large and is negative at the initial design.
pub(super) fn wrong_sign(config: &Config, objective: &ObjectiveResult) -> Option<String> {
    let own = config.objective.as_ref()?;
    // A term that counts against the others makes the sum negative, whatever their directions.
    let has_negative_weight = own.terms().iter().any(|term| term.weight < 0.0);
    (own.goal == Goal::Maximise && !has_negative_weight && objective.initial < 0.0).then(|| {
        format!(
            "the objective is {:.4e} at the initial design, and to maximise it is to make it smaller in size first: for more of \
             it, reverse its direction or minimise it",
            objective.initial
        )
    })
}

fn saturation(config: &Config, problem: &Problem, analysis: &Analysis) -> Vec<String> {
    let states = problem.states().iter().zip(&analysis.solutions);
    states
        .flat_map(|(model, solution)| {
            let frequency = model.setup().frequency;
            let under = under(model);
            let beyond = saturated(config, model, solution, analysis);
            beyond.into_iter().map(move |(region, found)| {
                let under = &under;
                let is_surface = config.regions.get(&region).is_some_and(|own| own.model == RegionModel::Impedance);
                let (part, cure) = if is_surface { ("its surface", "Mesh the region and give") } else { ("it", "Give") };
                let (highest, place) = found.highest;
                let weaker = if config.coils.is_empty() { "" } else { ", lower the ampere-turns" };
                format!(
                    "iron beyond saturation: |B| in `{region}` reaches {highest:.2} T at {} Hz{under}, at {}, and \
                     {:.1} % of {part} are polarised beyond {SATURATION} T, where no iron follows the linear law of its permeability: the field is \
                     that of a material that does not exist. {cure} the material its curve (bh){weaker}, or give \
                     the iron more section",
                    Readable(frequency),
                    millimetres(place),
                    100.0 * found.beyond / found.whole
                )
            })
        })
        .collect()
}

/// Skin audits of iron with a B–H curve, of the permeability that the fields leave at its surface.
fn skins_of_curves(config: &Config, setup: &Setup, analysis: &Analysis) -> Vec<Audited> {
    let mesh = &analysis.mesh;
    let states = setup.problem.states().iter().zip(&analysis.solutions);
    let of = |(model, solution): (&FieldModel, &FieldSolution)| {
        let is_supposed = |own: &&Audited| {
            own.permeability_of == PermeabilityOf::LargestOfCurve && own.frequency == model.setup().frequency
        };
        let permeability = |layer: &[(ElementId, f64)]| median_permeability((model, mesh, solution), layer);
        let supposed = setup.audits.iter().filter(is_supposed);
        supposed.filter_map(|own| audit_in_field((config, mesh), own, permeability)).collect::<Vec<_>>()
    };
    states.flat_map(of).collect()
}

/// The median of the relative permeability in elements with a B–H curve, by what they weigh.
fn median_permeability((model, mesh, solution): FieldState<'_>, weighed: &[(ElementId, f64)]) -> Option<f64> {
    let curve = model.curve_of(weighed.first()?.0)?;
    let permeability = |b: f64| match curve.at(b).field_strength {
        h if h > 0.0 => b / (VACUUM_PERMEABILITY * h),
        _ => curve.largest_permeability(),
    };
    let elements: Vec<ElementId> = weighed.iter().map(|own| own.0).collect();
    let fields = solution.flux_densities_of(model, mesh, &elements);
    let of = |(b, own): (_, &(ElementId, f64))| (permeability(peak(b)), own.1);
    weighted_median(&mut fields.into_iter().zip(weighed).map(of).collect::<Vec<_>>())
}

/// Iron beyond saturation, by region.
fn saturated(
    config: &Config,
    model: &FieldModel,
    solution: &FieldSolution,
    analysis: &Analysis,
) -> BTreeMap<String, Saturated> {
    let mesh = &analysis.mesh;
    let topology = mesh.topology();
    let share = |name: &String| polarised_share(material(config, name).relative_permeability);
    let shares: Vec<f64> = topology.region_names().iter().map(share).collect();
    let share_at = |e: &ElementId| shares[topology.region_of()[e.index()].index()];
    // With a B–H curve the polarisation is that of the steel.
    let is_iron = |e: &ElementId| share_at(e) > 0.0 && model.curve_of(*e).is_none();
    let iron: Vec<ElementId> = topology.elements().filter(is_iron).collect();
    let mut found: BTreeMap<String, Saturated> = BTreeMap::new();
    for (&e, b) in iron.iter().zip(solution.flux_densities_of(model, mesh, &iron)) {
        let own = found.entry(topology.region_name_at(e).to_owned()).or_default();
        own.add(volume(mesh.vertices(e)), (peak(b), share_at(&e)), centroid(mesh.vertices(e)));
    }
    for (index, nodes, loss) in solution.surface_losses(model, mesh) {
        let conductor = &model.conductors()[index];
        let SurfaceLaw::Impedance(material) = conductor.law else { continue };
        let Some(depth) = material.skin_depth(model.angular_frequency()) else { continue };
        let vertices = nodes.map(|n| mesh.point(n));
        let area = norm(area_vector(vertices));
        // The loss of a field H along the surface is ½|H|²/(σδ) an area.
        let field = (2.0 * loss / area * material.conductivity * depth).sqrt();
        let flux_density = VACUUM_PERMEABILITY * material.relative_permeability * field;
        let share = polarised_share(material.relative_permeability);
        let own = found.entry(conductor.name.clone()).or_default();
        own.add(area, (flux_density, share), centroid(vertices));
    }
    found.retain(|_, own| own.beyond > TOLERATED_SHARE * own.whole);
    found
}

/// The polarisation is `B (1 − 1/µ)`: what the region adds to the field of air.
fn polarised_share(relative_permeability: f64) -> f64 {
    1.0 - 1.0 / relative_permeability
}
