//! Which plane through the device is shown, and which part of it: what is observed, what moves, and the coils.

use fluxmorph_geometry::Mesh;
use fluxmorph_geometry::tet4::Point;

use super::coils::extent;
use super::cut::CutPlane;
use super::data::{RunData, Snapshot};
use super::map::view_normal;
use super::observed;
use super::plane::{Plane, bounds};
use crate::build::{Outline, is_open};
use crate::config::{CoilShape, Config};

/// Share of the window that is added around what must be seen.
const ROOM: f64 = 0.12;

/// A part of a plane across a coordinate axis.
#[derive(Debug)]
pub(super) struct Window {
    pub(super) plane: CutPlane,
    pub(super) page: Plane,
    /// Lower left corner [mm].
    pub(super) low: [f64; 2],
    /// Upper right corner [mm].
    pub(super) high: [f64; 2],
}

impl Window {
    /// Through the middle of what is observed, along the axis that the design moves along; of the two such planes the one
    /// that shows the longer side of the design.
    pub(super) fn new(data: &RunData, outline: &Outline, after: &Snapshot) -> Self {
        let topology = outline.mesh.topology();
        let elements = observed::elements(data, outline);
        let vertices = elements.iter().flat_map(|&e| topology.tet(e)).map(|n| after.points[n.index()]);
        let observed = (!elements.is_empty()).then(|| bounds(vertices));
        let moved = outline
            .design
            .as_ref()
            .map(|design| bounds(design.surface.nodes().iter().map(|&n| outline.full_mesh.point(n))));
        let whole = inside(&data.config, &outline.mesh);
        let centre = observed.or(moved).unwrap_or(whole);
        let upwards = outline.design.as_ref().map_or([0.0, 0.0, 1.0], |d| view_normal(data, d));
        let up = (0..3).fold(2, |best, d| if upwards[d].abs() > upwards[best].abs() { d } else { best });
        let shown = moved.unwrap_or(centre);
        let [a, b] = [(up + 1) % 3, (up + 2) % 3];
        let length = |d: usize| shown[1][d] - shown[0][d];
        let [axis, right] = if length(a) > length(b) { [b, a] } else { [a, b] };
        let page = Plane::of_axes(right, up, axis);
        let coils = data.config.coils.iter().filter_map(extent);
        let regions = region_bounds(data, outline, after);
        let corners: Vec<Point> =
            observed.into_iter().chain(moved).chain(coils).chain(regions).flatten().collect();
        let around = if corners.is_empty() { whole } else { bounds(corners) };
        let room = (0..3).map(|d| ROOM * (around[1][d] - around[0][d])).fold(0.0, f64::max);
        let low = std::array::from_fn(|d| (around[0][d] - room).max(whole[0][d]));
        let high = std::array::from_fn(|d| (around[1][d] + room).min(whole[1][d]));
        Self {
            plane: CutPlane { axis, at: 0.5 * centre[0][axis] + 0.5 * centre[1][axis] },
            low: page.flat(low),
            high: page.flat(high),
            page,
        }
    }

    /// Whether the rectangle around points reaches into the window.
    pub(super) fn shows(&self, points: &[Point]) -> bool {
        let flat: Vec<[f64; 2]> = points.iter().map(|p| self.page.flat(*p)).collect();
        (0..2).all(|d| flat.iter().any(|p| p[d] >= self.low[d]) && flat.iter().any(|p| p[d] <= self.high[d]))
    }

    /// Whether a place [mm] lies in the window.
    pub(super) fn holds(&self, place: [f64; 2]) -> bool {
        (0..2).all(|d| self.low[d] <= place[d] && place[d] <= self.high[d])
    }

    /// The plane in words: `y = 12.5`, in the unit of `millimetres`.
    pub(super) fn describe(&self, millimetres: &str) -> String {
        let axis = ["x", "y", "z"][self.plane.axis];
        format!("the plane {axis} = {} {millimetres}", super::ticks::trim_zeros(1e3 * self.plane.at, 1))
    }
}

/// Lower and upper corners around a mesh without the shell of open space.
pub(super) fn inside(config: &Config, mesh: &Mesh) -> [Point; 2] {
    let topology = mesh.topology();
    let regions = topology.region_names().iter().filter(|name| !is_open(config, name));
    let regions = regions.filter_map(|name| topology.region(name).ok());
    let elements = regions.flat_map(|region| topology.elements_of(region));
    bounds(elements.flat_map(|e| mesh.vertices(e)))
}

/// Lower and upper corners around the designed bodies and the coils that are regions of the mesh, as they are after.
fn region_bounds(data: &RunData, outline: &Outline, after: &Snapshot) -> Vec<[Point; 2]> {
    let (topology, full) = (outline.mesh.topology(), outline.full_mesh.topology());
    let bodies = outline.design.iter().flat_map(|design| &design.bodies);
    let bodies = bodies.map(|region| full.region_names()[region.index()].as_str());
    let coils = data.config.coils.iter().filter_map(|coil| match &coil.shape {
        CoilShape::Region(own) => Some(own.region.as_str()),
        _ => None,
    });
    let regions = bodies.chain(coils).filter_map(|name| topology.region(name).ok());
    regions
        .map(|region| topology.elements_of(region))
        .filter(|elements| !elements.is_empty())
        .map(|elements| {
            bounds(elements.iter().flat_map(|&e| topology.tet(e)).map(|n| after.points[n.index()]))
        })
        .collect()
}
