//! What passes through impedance surfaces to where the field is observed ([`transmissions`]), in words: every mesh and all elements
//! leave it out alike, and behind a closed wall there is nothing else.

use fluxmorph_geometry::locate::locate;
use fluxmorph_geometry::tet4::{Point, centroid};
use fluxmorph_geometry::{Readable, millimetres};
use fluxmorph_optimizer::problem::{Analysis, Problem};
use fluxmorph_solver::audit::{Transmission, transmissions};
use fluxmorph_solver::element::amplitude;
use fluxmorph_solver::{FieldModel, FieldState};

use super::reported::{probes, under};
use crate::build::observed_regions;
use crate::config::Config;

/// Share of the field at a place that passes through walls from which on it is said.
const LEAST: f64 = 0.05;

/// Cells of a region, and points of a probe, at which this is looked at.
const MOST_PLACES: usize = 200;

/// Where B is observed.
struct Observed {
    /// In words, and which point of a probe it is.
    name: String,
    at: String,
    places: Vec<Point>,
    /// Amplitude of B at each [T].
    flux_densities: Vec<f64>,
}

/// What passes to probes and observed regions, of each the point, the conductor and the state where that is the largest share.
pub(super) fn warnings(config: &Config, problem: &Problem, analysis: &Analysis) -> Vec<String> {
    let mut worst: Vec<(String, f64, String)> = Vec::new();
    for (model, solution) in problem.states().iter().zip(&analysis.solutions) {
        if model.conductors().is_empty() {
            continue;
        }
        let observed = observed(config, (model, &analysis.mesh, solution));
        let places: Vec<Point> = observed.iter().flat_map(|own| own.places.iter().copied()).collect();
        for found in transmissions((model, &analysis.mesh, solution), &places) {
            let mut passing = &found.flux_densities[..];
            for own in &observed {
                let (here, rest) = passing.split_at(own.places.len());
                passing = rest;
                let [own_b, passing_b] = [&own.flux_densities, here].map(rms);
                let share = passing_b / own_b;
                if share.is_nan() || share <= LEAST {
                    continue;
                }
                let text = text(own, (&found, model), [own_b, passing_b]);
                match worst.iter_mut().find(|(name, ..)| *name == own.name) {
                    Some(known) if known.1 >= share => {}
                    Some(known) => *known = (own.name.clone(), share, text),
                    None => worst.push((own.name.clone(), share, text)),
                }
            }
        }
    }
    worst.into_iter().map(|(.., text)| text).collect()
}

fn text(own: &Observed, (found, model): (&Transmission, &FieldModel), [b, passing]: [f64; 2]) -> String {
    format!(
        "B {}{} is {} T{} at {} Hz, and about {passing:.1e} T more passes through `{}`, which its impedance surface leaves out and no \
         error bar counts: mesh it (model = \"volume\")",
        own.name,
        own.at,
        if b == 0.0 { "0".to_owned() } else { format!("{b:.2e}") },
        under(model),
        Readable(model.setup().frequency),
        found.region
    )
}

/// The points of probes, and every region whose field is part of the objective or of a constraint.
fn observed(config: &Config, (model, mesh, solution): FieldState<'_>) -> Vec<Observed> {
    let points: Vec<Point> = config.probes.iter().flat_map(|probe| probe.points.iter().copied()).collect();
    let located = locate(mesh, &points);
    let mut all = Vec::new();
    for (probe, (_, values)) in config.probes.iter().zip(probes(config, &located, (model, mesh, solution))) {
        let stride = values.len().div_ceil(MOST_PLACES).max(1);
        for (place, b) in probe.points.iter().zip(values).step_by(stride) {
            let Some(b) = b else { continue };
            all.push(Observed {
                name: format!("at the probe `{}`", probe.name),
                at: format!(" at {}", millimetres(*place)),
                places: vec![*place],
                flux_densities: vec![amplitude(&b)],
            });
        }
    }
    for region in observed_regions(config, mesh) {
        let elements = mesh.topology().elements_of(region);
        let stride = elements.len().div_ceil(MOST_PLACES).max(1);
        let (places, flux_densities) = elements
            .into_iter()
            .step_by(stride)
            .map(|e| (centroid(mesh.vertices(e)), amplitude(&solution.flux_density(model, mesh, e))))
            .unzip();
        let name = format!("in `{}`", mesh.topology().region_names()[region.index()]);
        all.push(Observed { name, at: String::new(), places, flux_densities });
    }
    all
}

fn rms(values: &[f64]) -> f64 {
    (values.iter().map(|b| b * b).sum::<f64>() / values.len() as f64).sqrt()
}
