//! Where the estimated error of the objective is made: its density on the plane of the field's figure.

use fluxmorph_geometry::tet4::volume;
use maud::{Markup, html};

use super::data::{RunData, Snapshot};
use super::field::{Drawing, Shown, TALLEST};
use super::field_cut::FieldCut;
use super::frame::Frame;
use super::plot::{LEFT, RIGHT, Scale, WIDTH};
use super::ticks::{Count, number};
use super::window::Window;
use crate::build::Outline;

/// Decades of the scale.
const RANGE: f64 = 1e4;

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
    let window = Window::new(data, outline, field);
    let cut = FieldCut::new(&window, outline, &shares);
    let values = cut.triangles.iter().flat_map(|triangle| triangle.patch.map(|(_, value)| value));
    // Per cent in a cubic centimetre.
    let shown =
        Shown { name: "Share of the estimated error", sign: "share of the error [%/cm³]", factor: 1e-4 };
    let high = shown.factor * values.fold(0.0, f64::max);
    if !(high.is_finite() && high > 0.0) {
        return Err("the estimated error is zero in the plane of the figure".to_owned());
    }
    let scale = Scale { low: high / RANGE, high, count: Count::Logarithmic, pixels: [LEFT, WIDTH - RIGHT] };
    let frame = Frame::new(window.low, window.high, TALLEST);
    let caption = format!(
        "Where the estimated error of the objective at the best design is made, in {}: the sizes of what all elements add, \
         as shares of their sum in each cubic centimetre, logarithmic scale. With their signs they add up to {}, of the \
         {} that they have without.",
        window.describe("mm"),
        number(sum, 3),
        number(total, 3)
    );
    let drawing = Drawing { data, outline, window, frame, scale, shown };
    Ok(html! {
        figure id="error-map" {
            (drawing.draw(&cut, "error-cut"))
            figcaption { (caption) }
        }
    })
}
