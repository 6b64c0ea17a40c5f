//! The exact field of a prism.
//!
//! Over a planar polygon, between two flux-normal planes, with flux-parallel walls and a source `T = (0, 0, T(x, y))`, the
//! field is `H = (0, 0, T + c)` whatever the shape, its iron and its blocks: its curl is that of `T`, and it has no
//! component across any face between materials. One complex number is left, and Faraday's law around the domain has it:
//!
//! `∫ μ (T + c) dΩ + Σ_blocks Zs/(jω) ∮ (T + c) ds = 0`,   `Zs/(jω) = μ0 μr δ/(1 + j)`.
//!
//! A perfect conductor is `Zs = 0`: a wall. A meshed rectangular block has `μ ∫u` in place of the integral over its
//! contour, where `u` is the field inside a conductor with 1 on its surface (`diffusion`).

use fluxmorph_geometry::fem::c64;
use fluxmorph_solver::Material;
use fluxmorph_solver::material::VACUUM_PERMEABILITY;

use super::diffusion::field_integral;
use super::polygon::{Place, Polygon, SAME, between, cross, difference, length};
use super::source::Source;

/// Of everything that conducts [Hz].
pub(super) const FREQUENCY: f64 = 50.0;

/// What a part of a prism is made of.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Kind {
    /// A material that does not conduct, by its relative permeability.
    Iron(f64),
    /// A perfect conductor: flux-parallel.
    Perfect,
    /// A conductor replaced by its surface.
    Impedance { skin_depth: f64, relative_permeability: f64 },
    /// A conducting rectangle, meshed, that `T` does not reach.
    Meshed { skin_depth: f64, relative_permeability: f64 },
}

/// A part of a prism.
#[derive(Clone, Debug)]
pub(super) struct Part {
    /// Name of its region.
    pub(super) name: &'static str,
    pub(super) shape: Polygon,
    pub(super) kind: Kind,
}

/// A prism; its exact field is known.
#[derive(Clone, Debug)]
pub(super) struct Prism {
    pub(super) name: String,
    /// All of it, blocks included.
    pub(super) outline: Polygon,
    /// Along z, from 0 [m].
    pub(super) height: f64,
    pub(super) source: Source,
    /// Disjoint parts; the rest is air.
    pub(super) parts: Vec<Part>,
    /// Where the field is observed, in air.
    pub(super) observation: Polygon,
}

/// `Zs/(jω)` [H]: flux per length and field of an impedance surface.
pub(super) fn surface_inductance(skin_depth: f64, relative_permeability: f64) -> c64 {
    VACUUM_PERMEABILITY * relative_permeability * skin_depth / c64::new(1.0, 1.0)
}

impl Kind {
    /// The material that the program is given for it.
    pub(super) fn material(self) -> Material {
        match self {
            Self::Iron(relative_permeability) => Material { relative_permeability, conductivity: 0.0 },
            Self::Perfect => Material::AIR,
            Self::Impedance { skin_depth, relative_permeability }
            | Self::Meshed { skin_depth, relative_permeability } => {
                let permeability = VACUUM_PERMEABILITY * relative_permeability;
                let conductivity = 2.0 / (angular_frequency() * permeability * skin_depth * skin_depth);
                Material { relative_permeability, conductivity }
            }
        }
    }
}

/// `ω` [rad/s].
pub(super) fn angular_frequency() -> f64 {
    2.0 * std::f64::consts::PI * FREQUENCY
}

impl Prism {
    /// The frequency it is solved at [Hz]: zero unless something conducts.
    pub(super) fn frequency(&self) -> f64 {
        let conducts = |part: &Part| part.kind.material().conductivity > 0.0;
        if self.parts.iter().any(conducts) { FREQUENCY } else { 0.0 }
    }

    /// The edges of a part at which the rest of the prism lies.
    pub(super) fn contour(&self, part: &Part) -> Vec<[Place; 2]> {
        let outwards = |[a, b]: [Place; 2]| {
            let middle = between([a, b], 0.5);
            let step = 1e3 * SAME / length([a, b]);
            [middle[0] + step * (b[1] - a[1]), middle[1] - step * (b[0] - a[0])]
        };
        part.shape.edges().filter(|edge| self.outline.contains(outwards(*edge))).collect()
    }

    /// The number of edges, along z, at which walls and conductors turn into the domain.
    pub(super) fn re_entrant_edges(&self) -> usize {
        let turns = |[a, b]: [Place; 2], [_, c]: [Place; 2]| cross(difference(b, a), difference(c, b));
        let pairs = |edges: &[[Place; 2]]| {
            let next = edges.iter().cycle().skip(1);
            edges.iter().zip(next).map(|(e, f)| (*e, *f)).collect::<Vec<_>>()
        };
        let outline: Vec<_> = self.outline.edges().collect();
        // A corner of the outline that a block fills is none of the domain.
        let filled = |corner: Place| {
            self.blocks().any(|block| block.shape.vertices().iter().any(|v| length([*v, corner]) < SAME))
        };
        let mut count =
            pairs(&outline).into_iter().filter(|(e, f)| turns(*e, *f) < 0.0 && !filled(e[1])).count();
        for block in self.blocks() {
            let contour = self.contour(block);
            let meets = |e: [Place; 2], f: [Place; 2]| length([e[1], f[0]]) < SAME;
            count +=
                pairs(&contour).into_iter().filter(|(e, f)| meets(*e, *f) && turns(*e, *f) > 0.0).count();
        }
        count
    }

    /// Parts that are not meshed.
    fn blocks(&self) -> impl Iterator<Item = &Part> {
        self.parts.iter().filter(|part| matches!(part.kind, Kind::Perfect | Kind::Impedance { .. }))
    }

    /// The least skin depth of what is meshed [m]; infinity where nothing conducts there.
    pub(super) fn meshed_skin_depth(&self) -> f64 {
        let of = |part: &Part| {
            if let Kind::Meshed { skin_depth, .. } = part.kind { skin_depth } else { f64::INFINITY }
        };
        self.parts.iter().map(of).fold(f64::INFINITY, f64::min)
    }

    /// The largest relative permeability of what is meshed.
    pub(super) fn permeability(&self) -> f64 {
        let of = |part: &Part| if let Kind::Iron(mu) = part.kind { mu } else { 1.0 };
        self.parts.iter().map(of).fold(1.0, f64::max)
    }

    /// `∫μT` [Wb] and `∫μ` [H] per unit height of everything, so that `c` is minus their ratio.
    pub(super) fn fluxes(&self) -> (c64, c64) {
        let of = |polygon: &Polygon| [self.source.over(polygon), polygon.area()];
        let air = of(&self.outline).map(|i| c64::from(VACUUM_PERMEABILITY * i));
        let mut sum = air;
        for part in &self.parts {
            let whole = of(&part.shape);
            let add: [c64; 2] = match part.kind {
                Kind::Iron(mu) => whole.map(|i| c64::from((mu - 1.0) * VACUUM_PERMEABILITY * i)),
                Kind::Perfect => whole.map(|i| c64::from(-VACUUM_PERMEABILITY * i)),
                Kind::Impedance { skin_depth, relative_permeability } => {
                    let inductance = surface_inductance(skin_depth, relative_permeability);
                    let contour = self.contour(part);
                    let along = [
                        contour.iter().map(|&edge| self.source.along_segment(edge)).sum::<f64>(),
                        contour.iter().map(|&edge| length(edge)).sum::<f64>(),
                    ];
                    [0, 1].map(|i| inductance * along[i] - VACUUM_PERMEABILITY * whole[i])
                }
                Kind::Meshed { relative_permeability, .. } => {
                    assert_eq!(whole[0], 0.0, "no T in a meshed conductor");
                    let permeability = VACUUM_PERMEABILITY * relative_permeability;
                    [c64::default(), permeability * self.diffused(part) - VACUUM_PERMEABILITY * whole[1]]
                }
            };
            (0..2).for_each(|i| sum[i] += add[i]);
        }
        (sum[0], sum[1])
    }

    /// `∫u` [m²] of a meshed rectangle: faces at walls are mirrors.
    fn diffused(&self, part: &Part) -> c64 {
        let Kind::Meshed { skin_depth, .. } = part.kind else { panic!("it is meshed") };
        assert!(part.shape.is_rectangle(), "a meshed conductor is a rectangle");
        let [lower, upper] = part.shape.bounds();
        let contour = self.contour(part);
        let exposed = |axis: usize, at: f64| {
            contour.iter().any(|edge| edge.iter().all(|place| (place[axis] - at).abs() < SAME))
        };
        let sides = [0, 1].map(|axis| {
            let faces = usize::from(exposed(axis, lower[axis])) + usize::from(exposed(axis, upper[axis]));
            (upper[axis] - lower[axis], faces)
        });
        field_integral(sides, c64::new(1.0, 1.0) / skin_depth)
    }

    /// `c` [A/m].
    pub(super) fn constant(&self) -> c64 {
        let (source, domain) = self.fluxes();
        -source / domain
    }

    /// `B_z` [T] at a place of a relative permeability outside conductors; `B_x = B_y = 0`.
    pub(super) fn flux_density(&self, place: Place, relative_permeability: f64) -> c64 {
        VACUUM_PERMEABILITY * relative_permeability * (self.source.at(place) + self.constant())
    }

    /// The mean of `B_z` [T] over the observation.
    pub(super) fn observed(&self) -> c64 {
        let mean = self.source.over(&self.observation) / self.observation.area();
        VACUUM_PERMEABILITY * (mean + self.constant())
    }

    /// The loss [W] of every part that conducts, by name.
    pub(super) fn losses(&self) -> Vec<(&'static str, f64)> {
        let c = self.constant();
        let omega = c64::new(0.0, angular_frequency());
        let loss = |part: &Part| match part.kind {
            Kind::Impedance { skin_depth, relative_permeability } => {
                let impedance = omega * surface_inductance(skin_depth, relative_permeability);
                let square = |edge: [Place; 2]| {
                    self.source.along(edge, |t| (self.source.at(between(edge, t)) + c).norm_sqr())
                };
                Some(
                    0.5 * impedance.re
                        * self.contour(part).into_iter().map(square).sum::<f64>()
                        * self.height,
                )
            }
            Kind::Meshed { relative_permeability, .. } => {
                let inductance = VACUUM_PERMEABILITY * relative_permeability * self.diffused(part);
                Some(0.5 * (omega * inductance).re * c.norm_sqr() * self.height)
            }
            Kind::Iron(_) | Kind::Perfect => None,
        };
        self.parts.iter().filter_map(|part| Some((part.name, loss(part)?))).collect()
    }
}
