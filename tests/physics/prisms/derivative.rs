//! The exact derivative of a prism's field with respect to a wall that moves.

use fluxmorph_geometry::fem::c64;
use fluxmorph_geometry::tet4::Point;
use fluxmorph_solver::material::VACUUM_PERMEABILITY;

use super::exact::{Kind, Prism, surface_inductance};
use super::polygon::{Place, Polygon, SAME, between, difference, length};

/// A straight wall that moves along its normal: all faces at one coordinate within an interval of the other.
#[derive(Clone, Copy, Debug)]
pub(super) struct Motion {
    /// Direction of the motion: 0 or 1 for x or y.
    pub(super) axis: usize,
    /// Coordinate of the wall [m].
    pub(super) at: f64,
    /// Interval of the other coordinate [m].
    pub(super) from: f64,
    pub(super) to: f64,
    /// Distance at which the mesh stays in place [m].
    pub(super) reach: f64,
}

impl Motion {
    /// Velocity of a vertex of the outline or of a part.
    fn of_vertex(&self, vertex: Place) -> Place {
        let along = vertex[1 - self.axis];
        let on_wall = (vertex[self.axis] - self.at).abs() < SAME
            && (self.from - SAME..=self.to + SAME).contains(&along);
        [0, 1].map(|d| if on_wall && d == self.axis { 1.0 } else { 0.0 })
    }

    /// Velocity of a node of the mesh: one on the wall, falling linearly to zero within the reach.
    pub(super) fn of_node(&self, x: Point) -> Point {
        let along = x[1 - self.axis];
        let beside = (self.from - along).max(along - self.to).max(0.0);
        let share = |distance: f64| (1.0 - distance / self.reach).max(0.0);
        let speed = share((x[self.axis] - self.at).abs()) * share(beside);
        std::array::from_fn(|d| if d == self.axis { speed } else { 0.0 })
    }

    fn moved(&self, polygon: &Polygon, step: f64) -> Polygon {
        let vertices = polygon.vertices().iter().map(|&v| {
            let velocity = self.of_vertex(v);
            [0, 1].map(|d| v[d] + step * velocity[d])
        });
        Polygon::new(&vertices.collect::<Vec<_>>())
    }

    /// The prism with the wall moved by a step [m].
    pub(super) fn applied(&self, prism: &Prism, step: f64) -> Prism {
        let mut moved = prism.clone();
        moved.outline = self.moved(&prism.outline, step);
        for part in &mut moved.parts {
            part.shape = self.moved(&part.shape, step);
        }
        moved
    }
}

impl Prism {
    /// `dc/ds` [A/m²] of a motion by `s`; parts that are meshed conductors stay.
    pub(super) fn constant_derivative(&self, motion: &Motion) -> c64 {
        let c = self.constant();
        let (_, domain) = self.fluxes();
        let mut change = VACUUM_PERMEABILITY * self.area_derivative(&self.outline, motion, c);
        for part in &self.parts {
            let of_area = VACUUM_PERMEABILITY * self.area_derivative(&part.shape, motion, c);
            change += match part.kind {
                Kind::Iron(mu) => (mu - 1.0) * of_area,
                Kind::Perfect => -of_area,
                Kind::Impedance { skin_depth, relative_permeability } => {
                    let edges = self.contour(part);
                    let of_contour: c64 = edges.iter().map(|&e| self.edge_derivative(e, motion, c)).sum();
                    surface_inductance(skin_depth, relative_permeability) * of_contour - of_area
                }
                Kind::Meshed { .. } => {
                    assert_eq!(of_area, c64::default(), "a meshed conductor stays");
                    of_area
                }
            };
        }
        -change / domain
    }

    /// `d/ds ∫(T + c)` at fixed c: the part of the boundary that moves sweeps it.
    fn area_derivative(&self, polygon: &Polygon, motion: &Motion, c: c64) -> c64 {
        let of_edge = |edge: [Place; 2]| {
            let [va, vb] = edge.map(|vertex| motion.of_vertex(vertex));
            let along = difference(edge[1], edge[0]);
            let normal = [along[1], -along[0]].map(|n| n / length(edge));
            self.source.along(edge, |t| {
                let velocity = between([va, vb], t);
                (self.source.at(between(edge, t)) + c) * (velocity[0] * normal[0] + velocity[1] * normal[1])
            })
        };
        polygon.edges().map(of_edge).sum()
    }

    /// `d/ds ∫(T + c) ds` along an edge at fixed c: it stretches, and is carried along.
    fn edge_derivative(&self, edge: [Place; 2], motion: &Motion, c: c64) -> c64 {
        let [va, vb] = edge.map(|vertex| motion.of_vertex(vertex));
        let (along, spread) = (difference(edge[1], edge[0]), difference(vb, va));
        let stretch = (along[0] * spread[0] + along[1] * spread[1]) / length(edge).powi(2);
        self.source.along(edge, |t| {
            let place = between(edge, t);
            let (slope, velocity) = (self.source.slope(place), between([va, vb], t));
            (self.source.at(place) + c) * stretch + slope[0] * velocity[0] + slope[1] * velocity[1]
        })
    }

    /// `∫|B|²` [T² m³] over the observation.
    pub(super) fn square(&self) -> f64 {
        // T is constant there in every case that asks.
        let b = self.observed();
        b.norm_sqr() * self.observation.area() * self.height
    }

    /// `d/ds ∫|B|²` [T² m²] over the observation, which stays.
    pub(super) fn square_derivative(&self, motion: &Motion) -> f64 {
        let change = VACUUM_PERMEABILITY * self.constant_derivative(motion);
        2.0 * (self.observed().conj() * change).re * self.observation.area() * self.height
    }
}
