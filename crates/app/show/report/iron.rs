//! Iron with a B–H curve, and forces: how far it goes into its curve, where it is saturated, what acts on bodies.

use std::collections::BTreeMap;

use fluxmorph_geometry::RegionId;
use fluxmorph_optimizer::body::BodyForce;
use maud::{Markup, html};

use super::colour::ColourMap;
use super::data::RunData;
use super::field_cut::{CutTriangle, FieldCut};
use super::markup::{Card, note, table};
use super::picture::Picture;
use super::plot::path;
use super::tables::{ERROR_BAR, bar, behind_title, of_first_state};
use super::ticks::{Count, number, trim_zeros};
use super::window::Window;
use crate::build::Outline;
use crate::files::SaturatedRegion;
use crate::show::states::State;

/// Forces of at most so many bodies have a card.
const MOST_CARDS: usize = 2;

/// The figures that the head of the page shows: forces, and the highest flux density in iron.
pub(super) fn cards(data: &RunData) -> Vec<Card> {
    let Some(result) = &data.result else { return Vec::new() };
    let state = of_first_state(result);
    // Of a body that planes of symmetry cut, components cancel which its size would hide.
    let of_body = |body: &BodyForce| {
        let [x, y, z] = body.force_n.map(|component| number(component, 3));
        ("force", format!("({x}, {y}, {z}) N"), format!("on {}, of the meshed part{state}", body.name))
    };
    let mut cards: Vec<Card> = result.forces.iter().take(MOST_CARDS).map(of_body).collect();
    let states = State::all(result);
    let regions = states.iter().flat_map(|state| {
        let own = state.saturation.into_iter().flat_map(|saturation| &saturation.regions);
        own.map(move |region| (region, behind_title(state)))
    });
    let highest = regions.max_by(|a, b| a.0.highest_b_t.total_cmp(&b.0.highest_b_t));
    cards.extend(highest.map(|(region, state)| {
        let end = region.table_ends_b_t.map(|end| format!(", whose curve ends at {} T", trim_zeros(end, 3)));
        let remark = format!("in {}{}{state}", region.region, end.unwrap_or_default());
        ("highest B in iron", format!("{} T", number(region.highest_b_t, 3)), remark)
    }));
    cards
}

/// Forces and torques on every body; nothing where there are none.
pub(super) fn forces(state: &State<'_>) -> Markup {
    let row = |body: &BodyForce| {
        let own = state.errors.and_then(|errors| errors.forces.get(&body.name));
        let bars = [own.map(|own| &own.force_n), own.map(|own| &own.torque_nm)].map(|error| bar(error, 1.0));
        let numbers = |vector: &[f64; 3]| vector.map(|v| number(v, 5));
        let mut row = vec![body.name.clone()];
        for (vector, bar) in [&body.force_n, &body.torque_nm].into_iter().zip(bars) {
            row.extend(numbers(vector));
            row.push(bar);
        }
        row
    };
    let rows: Vec<Vec<String>> = state.forces.iter().map(row).collect();
    let head =
        ["body", "Fx [N]", "Fy [N]", "Fz [N]", ERROR_BAR, "Mx [N m]", "My [N m]", "Mz [N m]", ERROR_BAR];
    html! {
        @if !rows.is_empty() {
            h3 { "Forces and torques on the part that is modelled" (behind_title(state)) }
            (table(&head, &rows, None))
        }
    }
}

/// How far every region goes into its curve; nothing where all is linear.
pub(super) fn saturation(state: &State<'_>) -> Markup {
    let row = |region: &SaturatedRegion| {
        let tesla = |b: Option<f64>| b.map_or("–".to_owned(), |b| number(b, 4));
        vec![
            region.region.clone(),
            number(region.highest_b_t, 4),
            region.place_m.map(|c| trim_zeros(1e3 * c, 2)).join(", "),
            tesla(region.table_ends_b_t),
            tesla(region.knee_b_t),
            format!("{} %", trim_zeros(100.0 * region.volume_share_beyond_knee, 1)),
        ]
    };
    let head = [
        "region",
        "highest B [T]",
        "at x, y, z [mm]",
        "curve ends at [T]",
        "knee [T]",
        "volume beyond the knee",
    ];
    html! {
        @if let Some(saturation) = state.saturation {
            h3 { "Saturation" (behind_title(state)) }
            (table(&head, &saturation.regions.iter().map(row).collect::<Vec<_>>(), None))
            (note(&format!(
                "Newton's method took {} steps. Beyond the knee the differential permeability is below a tenth of its largest.",
                saturation.newton_steps
            )))
        }
    }
}

/// |B| in iron on the plane of the field's figure, with what is beyond the knee marked; `None` where the plane meets no iron.
pub(super) fn figure(data: &RunData, outline: &Outline) -> Option<Markup> {
    let saturation = data.result.as_ref()?.saturation.as_ref()?;
    let field = data.fields[1].as_ref().ok()?;
    let topology = outline.mesh.topology();
    let knee = |region: &SaturatedRegion| Some((topology.region(&region.region).ok()?, region.knee_b_t));
    let knees: BTreeMap<RegionId, Option<f64>> = saturation.regions.iter().filter_map(knee).collect();
    let window = Window::new(data, outline, field);
    let cut = FieldCut::new(&window, outline, field);
    let iron: Vec<&CutTriangle> =
        cut.triangles.iter().filter(|triangle| knees.contains_key(&triangle.region)).collect();
    let highest = iron.iter().flat_map(|t| t.patch).map(|(_, b)| b).fold(0.0, f64::max);
    if highest == 0.0 {
        return None;
    }
    let picture =
        Picture::new(outline, window, (0.0, highest, Count::Linear), ColourMap::Field, "|B| in iron [T]");
    let Picture { window, frame, .. } = &picture;
    let is_saturated = |triangle: &&&CutTriangle| {
        let mean = triangle.patch.iter().map(|(_, b)| b).sum::<f64>() / 3.0;
        knees[&triangle.region].is_some_and(|knee| mean > knee)
    };
    let outline_of = |triangle: &&CutTriangle| {
        format!("{}Z", path(&triangle.patch.map(|(p, _)| frame.at(window.page.flat(p)))))
    };
    let saturated: String = iron.iter().filter(is_saturated).map(outline_of).collect();
    let hatched = html! {
        defs {
            pattern id="hatch" width="5" height="5" patternUnits="userSpaceOnUse" patternTransform="rotate(45)" {
                path class="hatch" d="M0 0V5" {}
            }
        }
        @if !saturated.is_empty() { path class="saturated" fill="url(#hatch)" d=(saturated) {} }
    };
    let caption = format!(
        "|B| in iron with a B–H curve, in {}, evaluation {}. Hatched: beyond the knee of the curve.",
        window.describe("mm"),
        field.evaluation
    );
    Some(html! {
        figure id="saturation" {
            h3 { "Saturation of iron" }
            (picture.draw((field, iron.iter().map(|t| t.patch)), "iron", &caption, [&hatched, &html! {}]))
            figcaption { (caption) }
        }
    })
}
