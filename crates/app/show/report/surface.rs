//! The designed body for the three-dimensional view: its boundary before and after, packed for `view.js`.
//!
//! Places and values are whole numbers of 16 bits between the least and the greatest, little endian, in base64. An error is
//! at most half a step, 1/131070 of the extent.

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use fluxmorph_geometry::tet4::{Point, norm};
use fluxmorph_geometry::{NodeId, RegionId};
use serde_json::{Value, json};

use super::colour::ColourMap;
use super::cut::NodeMeans;
use super::data::{RunData, Snapshot};
use super::map::{SurfaceValues, is_along_normals, view_normal};
use super::moment::{Moment, place};
use super::plane::{bounds, extremes, mirrors, with_room};
use super::ticks::Count;
use crate::build::{Outline, OutlinedDesign};

/// Most triangles on a page: about a megabyte.
const MOST_TRIANGLES: usize = 40_000;

/// A motion shorter than this share of the body is drawn larger.
const SEEN: f64 = 0.03;

/// What is drawn in three dimensions.
#[derive(Debug)]
pub(super) struct Surface {
    /// The data of the view.
    pub(super) json: Value,
    pub(super) triangles: usize,
    /// What is shown, in words.
    pub(super) what: String,
    /// How many times the motion is drawn.
    pub(super) exaggeration: f64,
    /// Whether it is another one after than before.
    pub(super) moves: bool,
}

/// Values at the nodes before and after.
struct Colouring {
    name: String,
    unit: &'static str,
    map: ColourMap,
    count: Count,
    values: [Vec<Option<f64>>; 2],
}

impl Surface {
    /// The body of the design surface; the surface alone where the body has too many triangles, or where only the design
    /// is known and no field file.
    pub(super) fn new(data: &RunData, outline: &Outline, design: &OutlinedDesign) -> Result<Self, String> {
        let names = data.config.design.as_ref().map_or(String::new(), |d| d.surface.join(", "));
        let (whole, regions) = boundary(outline, design);
        let after = data.fields[1].as_ref().ok();
        let (triangles, what) = if after.is_none() || whole.is_empty() {
            (design.triangles.clone(), format!("the design surface {names}"))
        } else if whole.len() > MOST_TRIANGLES {
            let what = format!(
                "the design surface {names} alone: the whole boundary of {regions} has {} triangles, too many for this page",
                whole.len()
            );
            (design.triangles.clone(), what)
        } else {
            (whole, format!("the boundary of {regions}"))
        };
        if triangles.len() > MOST_TRIANGLES {
            return Err(format!(
                "the design surface has {} triangles, too many for this page",
                triangles.len()
            ));
        }
        let mut nodes: Vec<NodeId> = triangles.iter().flatten().copied().collect();
        nodes.sort_unstable();
        nodes.dedup();
        let places = places_before_and_after(data, outline, design, &nodes)?;
        let span = |points: &[Point]| {
            let [low, high] = bounds(points.iter().copied());
            norm(std::array::from_fn(|d| high[d] - low[d]))
        };
        let moved = |i: usize| norm(std::array::from_fn(|d| places[1][i][d] - places[0][i][d]));
        let farthest = (0..nodes.len()).map(moved).fold(0.0, f64::max);
        let exaggeration = enlargement(farthest, span(&places[0]));
        let colourings = colourings(data, outline, design, &nodes, &places);
        let json = pack(data, design, (&nodes, &triangles), &places, &colourings, exaggeration);
        let moves = places[0] != places[1];
        Ok(Self { json, triangles: triangles.len(), what, exaggeration, moves })
    }
}

/// How many times a motion is drawn so that it is seen: 1, or a round number.
fn enlargement(motion: f64, extent: f64) -> f64 {
    if motion <= 1e-9 * extent || motion >= SEEN * extent {
        return 1.0;
    }
    let wanted = SEEN * extent / motion;
    let power = 10f64.powf(wanted.log10().floor());
    [1.0, 2.0, 5.0, 10.0].map(|m| m * power).into_iter().find(|m| *m >= wanted).unwrap_or(wanted)
}

/// Triangles around the bodies, on nodes of the full mesh, and their names. A face of which no motion is known, inside a
/// region that its impedance surface replaces, is left out.
fn boundary(outline: &Outline, design: &OutlinedDesign) -> (Vec<[NodeId; 3]>, String) {
    let topology = outline.full_mesh.topology();
    let is_body = |region: RegionId| design.shown.contains(&region);
    let region_of = |e: fluxmorph_geometry::ElementId| topology.region_of()[e.index()];
    let triangles = topology.facets().iter().filter(|facet| {
        let outside = facet.outside.is_some_and(|e| is_body(region_of(e)));
        is_body(region_of(facet.inside)) != outside
            && facet.nodes.iter().all(|n| outline.node_of[n.index()].is_some())
    });
    let names: Vec<&str> = design.shown.iter().map(|r| topology.region_names()[r.index()].as_str()).collect();
    (triangles.map(|facet| facet.nodes).collect(), names.join(" and "))
}

/// Where some nodes are before and after [m]; undeformed before where nothing is known of that.
fn places_before_and_after(
    data: &RunData,
    outline: &Outline,
    design: &OutlinedDesign,
    nodes: &[NodeId],
) -> Result<[Vec<Point>; 2], String> {
    let of = |moment: Moment| {
        let place = place(data, outline, design, moment)?;
        Some(nodes.iter().map(|n| place(*n)).collect())
    };
    let undeformed = || nodes.iter().map(|n| outline.full_mesh.point(*n)).collect();
    let after =
        of(Moment::After).ok_or_else(|| data.fields[1].as_ref().err().cloned().unwrap_or_default())?;
    Ok([of(Moment::Before).unwrap_or_else(undeformed), after])
}

fn colourings(
    data: &RunData,
    outline: &Outline,
    design: &OutlinedDesign,
    nodes: &[NodeId],
    places: &[Vec<Point>; 2],
) -> Vec<Colouring> {
    let mut all = Vec::new();
    let thickness = SurfaceValues::thickness(data, outline, design).map(|surface| {
        let at = |values: &Option<Vec<Option<f64>>>| -> Vec<Option<f64>> {
            let of = |n: &NodeId| values.as_ref()?[design.surface.nodes().binary_search(n).ok()?];
            nodes.iter().map(of).collect()
        };
        Colouring {
            name: "thickness".to_owned(),
            unit: "mm",
            map: surface.colours(),
            count: Count::Linear,
            values: surface.values.each_ref().map(at),
        }
    });
    let undeformed = nodes.iter().map(|n| outline.full_mesh.point(*n));
    let undeformed: Vec<Point> = undeformed.collect();
    let motion = |points: &Vec<Point>| -> Vec<Option<f64>> {
        let of = |(a, b): (&Point, &Point)| Some(1e3 * norm(std::array::from_fn(|d| b[d] - a[d])));
        undeformed.iter().zip(points).map(of).collect()
    };
    let values = places.each_ref().map(motion);
    if values.iter().flatten().flatten().any(|length| *length > 0.0) {
        all.push(Colouring {
            name: "displacement".to_owned(),
            unit: "mm",
            map: ColourMap::Length,
            count: Count::Linear,
            values,
        });
    }
    // What the map shows comes first.
    let place = if is_along_normals(data) { all.len() } else { 0 };
    all.splice(place..place, thickness);
    if let Ok(after) = &data.fields[1] {
        let before = data.fields[0].as_ref().ok();
        let of = |field: &Snapshot| flux_density(outline, design, nodes, field);
        let values = [before.map_or_else(|| vec![None; nodes.len()], of), of(after)];
        all.push(Colouring {
            name: "|B|".to_owned(),
            unit: "mT",
            map: ColourMap::Field,
            count: Count::Logarithmic,
            values,
        });
    }
    all
}

/// |B| at nodes [mT]: of the body where it is meshed, else of what surrounds it.
fn flux_density(
    outline: &Outline,
    design: &OutlinedDesign,
    nodes: &[NodeId],
    field: &Snapshot,
) -> Vec<Option<f64>> {
    let topology = outline.mesh.topology();
    let full = outline.full_mesh.topology();
    let means = NodeMeans { topology, points: &field.points, values: &field.flux_density };
    let bodies: Vec<RegionId> =
        design.shown.iter().filter_map(|r| topology.region(&full.region_names()[r.index()]).ok()).collect();
    let of = |node: &NodeId| {
        let own = outline.node_of[node.index()]?;
        let in_body = |e: &fluxmorph_geometry::ElementId| bodies.contains(&topology.region_of()[e.index()]);
        let meshed = topology.elements_around(own).iter().any(in_body);
        Some(1e3 * if meshed { means.at(own, in_body) } else { means.at(own, |_| true) })
    };
    nodes.iter().map(of).collect()
}

/// What `view.js` reads; lengths in millimetres.
fn pack(
    data: &RunData,
    design: &OutlinedDesign,
    (nodes, triangles): (&[NodeId], &[[NodeId; 3]]),
    places: &[Vec<Point>; 2],
    colourings: &[Colouring],
    exaggeration: f64,
) -> Value {
    let [low, high] = bounds(places.iter().flatten().copied());
    let packed = |points: &Vec<Point>| {
        let axis = |d: usize, p: &Point| quantise(p[d], [low[d], high[d]], u16::MAX);
        encode(points.iter().flat_map(|p| (0..3).map(move |d| axis(d, p))))
    };
    let index = |n: &NodeId| nodes.binary_search(n).unwrap_or(0);
    let wide = nodes.len() > usize::from(u16::MAX);
    let corners = triangles.iter().flatten().map(index);
    let triangles = if wide {
        let bytes: Vec<u8> = corners.flat_map(|i| (i as u32).to_le_bytes()).collect();
        STANDARD.encode(bytes)
    } else {
        encode(corners.map(|i| i as u16))
    };
    let mirrors: Vec<Value> = mirrors(&data.config).iter().map(|m| json!([m.axis, 1e3 * m.at])).collect();
    let millimetres = |p: Point| p.map(|c| 1e3 * c);
    json!({
        "nodes": nodes.len(),
        "low": millimetres(low),
        "high": millimetres(high),
        "before": packed(&places[0]),
        "after": packed(&places[1]),
        "wide": wide,
        "triangles": triangles,
        "up": view_normal(data, design),
        "exaggeration": exaggeration,
        "mirrors": mirrors,
        "colours": colourings.iter().filter_map(Colouring::pack).collect::<Vec<_>>(),
    })
}

impl Colouring {
    /// `None` where no node has a value.
    fn pack(&self) -> Option<Value> {
        let [least, most] = extremes(self.values.iter().flatten().flatten().copied());
        if !(least.is_finite() && most.is_finite()) {
            return None;
        }
        let [least, most] = with_room([least, most]);
        let logarithmic = self.count == Count::Logarithmic && most > 0.0 && least < most / 30.0;
        let [low, high] = if logarithmic { [least.max(1e-4 * most), most] } else { [least.min(most), most] };
        let form = |v: f64| if logarithmic { v.max(low).ln() } else { v };
        // The last number stands for no value.
        let one = |v: &Option<f64>| match v {
            Some(v) => quantise(form(*v), [form(low), form(high)], u16::MAX - 1),
            None => u16::MAX,
        };
        let packed = |values: &Vec<Option<f64>>| encode(values.iter().map(one));
        Some(json!({
            "name": self.name,
            "unit": self.unit,
            "low": low,
            "high": high,
            "logarithmic": logarithmic,
            "map": STANDARD.encode(self.map.palette()[1..].as_flattened()),
            "before": packed(&self.values[0]),
            "after": packed(&self.values[1]),
        }))
    }
}

/// A value between two others as a number from 0 to `most`.
fn quantise(value: f64, [low, high]: [f64; 2], most: u16) -> u16 {
    let share = if high > low { (value - low) / (high - low) } else { 0.0 };
    (share.clamp(0.0, 1.0) * f64::from(most)).round() as u16
}

fn encode(numbers: impl Iterator<Item = u16>) -> String {
    STANDARD.encode(numbers.flat_map(u16::to_le_bytes).collect::<Vec<u8>>())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_packed_number_is_off_by_half_a_step_at_most() {
        let (low, high) = (-0.013, 0.24);
        let step = (high - low) / 65_535.0;
        for i in 0..=1000 {
            let value = low + (high - low) * f64::from(i) / 1000.0;
            let back = low + f64::from(quantise(value, [low, high], u16::MAX)) * step;
            // Half a step, and the rounding of the sums here.
            assert!((back - value).abs() <= 0.5 * step + 1e-16, "{value}: {back}");
        }
        assert_eq!((quantise(5.0, [1.0, 1.0], 9), quantise(f64::NAN, [0.0, 1.0], 9)), (0, 0));
        assert_eq!(encode([1u16, 0x0203].into_iter()), STANDARD.encode([1, 0, 3, 2]));
    }

    #[test]
    fn a_small_motion_is_drawn_larger_by_a_round_number() {
        assert_eq!(
            (enlargement(0.02, 0.3), enlargement(0.001, 0.3), enlargement(0.0, 0.3)),
            (1.0, 10.0, 1.0)
        );
        assert_eq!(enlargement(0.0001, 0.3), 100.0);
    }
}
