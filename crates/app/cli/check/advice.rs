//! Advice from the sizes before anything is solved: what is allowed, but rarely intended.
//!
//! Does not live here: what is wrong (`build`), and the audit of skin depths (`fluxmorph_solver::audit`).

use fluxmorph_geometry::quality::qualities;
use fluxmorph_geometry::tet4::{EDGES, FACES, Point, area_vector, centroid, norm, sub, volume};
use fluxmorph_geometry::{ElementId, Mesh, millimetres};

use crate::build::Setup;
use crate::config::{Config, ElementOrder, MeshConfig};

/// Worst quality (Eq. 4) below which a mesh from a file should be regenerated. Generated meshes are layered on purpose, and
/// move along their layers.
const POOR: f64 = 0.05;

/// Sentences for what looks unlike what is meant; none for most configurations.
pub(super) fn advice(config: &Config, setup: &Setup) -> Vec<String> {
    let mut all = Vec::new();
    let is_file = matches!(config.mesh, MeshConfig::File { .. });
    let has_field = !config.coils.is_empty() || config.objective.is_some();
    if is_file && has_field && config.analysis.order == ElementOrder::Linear {
        all.push(
            "the elements are linear: B is constant in each of them, and on a mesh that was not made for that it may be far \
             off; compare `fluxmorph solve` with analysis.order = 2"
                .to_owned(),
        );
    }
    let mesh = setup.problem.original();
    if let Some((worst, quality)) = worst_without_layers(mesh).filter(|_| is_file) {
        all.push(format!(
            "the worst element that belongs to no thin layer has a quality of {quality:.1e}, in `{}` at {}; regenerate a mesh file whose \
             worst quality is below {POOR}",
            mesh.topology().region_name_at(worst),
            millimetres(centroid(mesh.vertices(worst)))
        ));
    }
    all
}

/// The worst of the poor elements that are not flat because a layer is thin, as layers are that follow a skin depth, with its quality.
fn worst_without_layers(mesh: &Mesh) -> Option<(ElementId, f64)> {
    let poor = mesh.topology().elements().zip(qualities(mesh)).filter(|(_, quality)| *quality < POOR);
    let slivers = poor.filter(|(e, _)| !is_layered(mesh.vertices(*e)));
    slivers.min_by(|a, b| a.1.total_cmp(&b.1))
}

/// Whether a flat element is as flat as its shortest edge is short: one edge stands on a layer, where those of a sliver lie in it.
fn is_layered(vertices: [Point; 4]) -> bool {
    let largest =
        FACES.map(|face| norm(area_vector(face.map(|v| vertices[v])))).into_iter().fold(0.0, f64::max);
    let shortest =
        EDGES.map(|[a, b]| norm(sub(vertices[a], vertices[b]))).into_iter().fold(f64::INFINITY, f64::min);
    shortest <= 2.0 * 3.0 * volume(vertices) / largest
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;
    use crate::build::{Mode, set_up};

    fn of(configuration: &str, overrides: &[&str]) -> Vec<String> {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("configs").join(configuration);
        let overrides: Vec<String> = overrides.iter().map(|o| (*o).to_owned()).collect();
        let (config, source) = Config::from_file(&path, &overrides).expect("shipped");
        let setup = set_up(&config, &source, Mode::Inspection).expect("sound");
        advice(&config, &setup)
    }

    #[test]
    fn shipped_devices_are_as_meant() {
        assert_eq!(of("shield_quick.toml", &[]), Vec::<String>::new());
    }

    #[test]
    fn a_thin_layer_is_no_sliver() {
        let layer = [[0.0; 3], [1.0, 0.0, 0.0], [0.3, 1.0, 0.0], [0.0, 0.0, 0.01]];
        assert!(is_layered(layer) && is_layered([layer[3], [0.3, 1.0, 0.01], [1.0, 0.0, 0.01], layer[1]]));
        let sliver = [[0.0; 3], [1.0, 0.0, 0.01], [1.0, 1.0, 0.0], [0.0, 1.0, 0.01]];
        assert!(!is_layered(sliver));
    }

    #[test]
    fn linear_elements_and_poor_ones_of_a_file_are_told() {
        let advice = of("inductor.toml", &["analysis.order=1"]);
        assert!(advice.iter().any(|line| line.contains("analysis.order = 2")), "{advice:?}");
        assert!(!of("inductor.toml", &[]).iter().any(|line| line.contains("analysis.order = 2")));
    }
}
