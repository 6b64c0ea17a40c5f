//! Where the estimated error of the objective is made: its density on the plane of the field's figure.

use fluxmorph_geometry::tet4::volume;
use maud::{Markup, html};

use super::colour::ColourMap;
use super::data::{RunData, Snapshot};
use super::field::draw;
use super::field_cut::FieldCut;
use super::picture::Picture;
use super::ticks::{Count, number};
use super::window::Window;
use crate::build::Outline;

/// Decades of the scale.
const RANGE: f64 = 1e4;

/// From shares in a cubic metre to per cent in a cubic centimetre.
const PERCENT_PER_CM3: f64 = 1e-4;

/// The figure with its caption; `None` where the field of the best design has no estimated error.
pub(super) fn figure(data: &RunData, outline: &Outline) -> Option<Result<Markup, String>> {
    let field = data.fields[1].as_ref().ok()?;
    let error = data.error.as_ref()?;
    Some(drawn(data, outline, field, error))
}

fn drawn(data: &RunData, outline: &Outline, field: &Snapshot, error: &[f64]) -> Result<Markup, String> {
    let total: f64 = error.iter().map(|error| error.abs()).sum();
    let density = |(tet, error): (&[_; 4], &f64)| {
        let corners = tet.map(|n: fluxmorph_geometry::NodeId| field.points[n.index()]);
        error.abs() / (total * volume(corners))
    };
    let densities: Vec<f64> = outline.mesh.topology().tets().iter().zip(error).map(density).collect();
    let sum: f64 = error.iter().sum();
    let shares = Snapshot {
        evaluation: field.evaluation,
        points: field.points.clone(),
        flux_density: densities,
        deviation: None,
    };
    let estimate = data.accuracy().and_then(|accuracy| accuracy.error_estimate).map(|[_, best]| best);
    let window = Window::new(data, outline, field);
    let cut = FieldCut::new(&window, outline, &shares);
    let values = cut.triangles.iter().flat_map(|triangle| triangle.patch.map(|(_, value)| value));
    let high = PERCENT_PER_CM3 * values.fold(0.0, f64::max);
    if !(high.is_finite() && high > 0.0) {
        return Err("the estimated error is zero in the plane of the figure".to_owned());
    }
    let caption = format!(
        "Where the estimated error of the objective at the best design is made, in {}: the sizes of what all elements add, \
         as shares of their sum in each cubic centimetre, logarithmic scale. With their signs they add up to {}, of the \
         {} that they have without{}.",
        window.describe("mm"),
        number(sum, 3),
        number(total, 3),
        estimate.map_or_else(String::new, |estimate| format!("; the estimate is {}", number(estimate, 3)))
    );
    let range = (high / RANGE, high, Count::Logarithmic);
    let picture = Picture::new(outline, window, range, ColourMap::Field, "share of the error [%/cm³]");
    Ok(html! {
        figure id="error-map" class="narrow" {
            (draw(data, &picture, &cut, ("error-cut", "Share of the estimated error", PERCENT_PER_CM3)))
            figcaption { (caption) }
        }
    })
}
