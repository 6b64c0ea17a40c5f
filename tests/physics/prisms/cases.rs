//! Prisms with sides along the axes: from one that every discretisation must solve to those that few can.
//!
//! All lie in the square from −1 to 1 m and are 0.1 m high. The source is in the upper right, the observation in the arm
//! farthest from it, where the field is weak.

use super::derivative::Motion;
use super::exact::{Kind, Part, Prism};
use super::polygon::{Place, Polygon};
use super::source::Source;

const HEIGHT: f64 = 0.1;

/// Lower and upper corner of the square.
const LOWER: Place = [-1.0, -1.0];
const UPPER: Place = [1.0, 1.0];

fn square() -> Polygon {
    Polygon::rectangle(LOWER, UPPER)
}

/// Its lower right quarter.
pub(super) const QUARTER: [Place; 2] = [[0.0, -1.0], [1.0, 0.0]];

/// A coil around (0.5, 0.5), half a metre across.
fn source() -> Source {
    Source::new([0.5, 0.5], [0.15, 0.15], 0.1)
}

/// A rectangle of a kind.
fn part(name: &'static str, lower: Place, upper: Place, kind: Kind) -> Part {
    Part { name, shape: Polygon::rectangle(lower, upper), kind }
}

/// The lower right quarter of the square.
fn quarter(kind: Kind) -> Part {
    part("block", QUARTER[0], QUARTER[1], kind)
}

/// An impedance surface without iron.
fn impedance(skin_depth: f64) -> Kind {
    Kind::Impedance { skin_depth, relative_permeability: 1.0 }
}

/// A prism in a given outline with parts.
fn prism(name: &str, outline: Polygon, parts: Vec<Part>) -> Prism {
    let observation = Polygon::rectangle([-0.7, -0.7], [-0.5, -0.5]);
    Prism { name: name.to_owned(), outline, height: HEIGHT, source: source(), parts, observation }
}

/// A square of air.
pub(super) fn air() -> Prism {
    prism("square", square(), Vec::new())
}

/// A square whose right wall cuts the coil in two.
pub(super) fn cut_coil() -> Prism {
    Prism {
        source: Source::new([1.0, 0.4], [0.2, 0.15], 0.1),
        ..prism("square, half a coil", square(), Vec::new())
    }
}

/// A square with an impedance surface over the whole of its right side: no edge.
pub(super) fn side(skin_depth: f64, relative_permeability: f64) -> Prism {
    let kind = Kind::Impedance { skin_depth, relative_permeability };
    let name = format!("block along a side, δ {skin_depth} m, μr {relative_permeability}");
    let source = Source::new([0.2, 0.5], [0.15, 0.15], 0.1);
    Prism { source, ..prism(&name, square(), vec![part("block", [0.8, -1.0], UPPER, kind)]) }
}

/// A square with iron in one corner (the lower right quarter).
pub(super) fn iron_corner(relative_permeability: f64) -> Prism {
    let iron = Part { name: "iron", ..quarter(Kind::Iron(relative_permeability)) };
    prism(&format!("iron in a quarter, μr {relative_permeability}"), square(), vec![iron])
}

/// A square with a small piece of iron in the far corner, across it.
pub(super) fn iron_far(relative_permeability: f64) -> Prism {
    let iron = part("iron", [-1.0, -1.0], [-0.8, -0.4], Kind::Iron(relative_permeability));
    prism(&format!("iron in the far corner, μr {relative_permeability}"), square(), vec![iron])
}

/// A square whose lower right quarter is an impedance surface.
pub(super) fn impedance_quarter(skin_depth: f64, relative_permeability: f64) -> Prism {
    let kind = Kind::Impedance { skin_depth, relative_permeability };
    let name = format!("impedance quarter, δ {skin_depth} m, μr {relative_permeability}");
    prism(&name, square(), vec![quarter(kind)])
}

/// The same as a perfect conductor: an L with one re-entrant wall.
pub(super) fn perfect_quarter() -> Prism {
    prism("perfect quarter (L)", square(), vec![quarter(Kind::Perfect)])
}

/// The same, meshed.
pub(super) fn meshed_quarter(skin_depth: f64) -> Prism {
    meshed(QUARTER, skin_depth, 1.0)
}

/// A square with a meshed conductor between these corners.
pub(super) fn meshed([lower, upper]: [Place; 2], skin_depth: f64, relative_permeability: f64) -> Prism {
    let kind = Kind::Meshed { skin_depth, relative_permeability };
    let name = format!("meshed {lower:?} to {upper:?}, δ {skin_depth} m, μr {relative_permeability}");
    let block = part("block", lower, upper, kind);
    // The coil beside the conductor.
    let centre = if lower[1] < 0.5 && upper[0] > 0.5 && upper[1] > 0.5 { [0.2, 0.5] } else { [0.5, 0.5] };
    Prism { source: Source::new(centre, [0.15, 0.15], 0.1), ..prism(&name, square(), vec![block]) }
}

/// A block in the middle, all around which the field is.
pub(super) fn island(kind: Kind, what: &str) -> Prism {
    prism(&format!("island, {what}"), square(), vec![part("block", [-0.3, -0.3], [0.1, 0.1], kind)])
}

/// A T on its side: two re-entrant walls, the observation in its stem.
pub(super) fn tee() -> Prism {
    let outline = Polygon::new(&[
        [0.2, -1.0],
        [1.0, -1.0],
        [1.0, 1.0],
        [0.2, 1.0],
        [0.2, -0.3],
        [-1.0, -0.3],
        [-1.0, -0.8],
        [0.2, -0.8],
    ]);
    Prism { source: Source::new([0.6, 0.5], [0.12, 0.15], 0.1), ..prism("T", outline, Vec::new()) }
}

/// A U with an iron corner and an impedance block in its bend.
pub(super) fn u_shape(relative_permeability: f64, skin_depth: f64) -> Prism {
    let outline = Polygon::new(&[
        [-1.0, -1.0],
        [1.0, -1.0],
        [1.0, 1.0],
        [0.1, 1.0],
        [0.1, 0.0],
        [-0.3, 0.0],
        [-0.3, 1.0],
        [-1.0, 1.0],
    ]);
    let parts = vec![
        part("iron", [0.7, -1.0], [1.0, -0.6], Kind::Iron(relative_permeability)),
        part("block", [-0.3, -0.4], [0.1, 0.0], impedance(skin_depth)),
    ];
    Prism {
        source: Source::new([0.55, 0.5], [0.15, 0.15], 0.1),
        observation: Polygon::rectangle([-0.7, 0.5], [-0.5, 0.7]),
        ..prism(&format!("U, iron μr {relative_permeability}, impedance δ {skin_depth} m"), outline, parts)
    }
}

/// A comb of four teeth: six re-entrant walls, iron in one tooth, an impedance block at the root of another.
pub(super) fn comb(relative_permeability: f64, kind: Kind, what: &str) -> Prism {
    let outline = Polygon::new(&[
        [-1.0, -1.0],
        [-0.7, -1.0],
        [-0.7, 0.1],
        [-0.4, 0.1],
        [-0.4, -1.0],
        [-0.1, -1.0],
        [-0.1, 0.1],
        [0.2, 0.1],
        [0.2, -1.0],
        [0.5, -1.0],
        [0.5, 0.1],
        [0.8, 0.1],
        [0.8, -1.0],
        [1.0, -1.0],
        [1.0, 1.0],
        [-1.0, 1.0],
    ]);
    let parts = vec![
        part("iron", [-0.4, -1.0], [-0.1, -0.6], Kind::Iron(relative_permeability)),
        part("block", [-0.1, 0.1], [0.2, 0.3], kind),
    ];
    Prism {
        source: Source::new([0.6, 0.65], [0.15, 0.15], 0.1),
        observation: Polygon::rectangle([-1.0, -0.7], [-0.7, -0.5]),
        ..prism(&format!("comb, iron μr {relative_permeability}, {what}"), outline, parts)
    }
}

/// All of them.
pub(super) fn all() -> Vec<Prism> {
    let mut cases = vec![air(), cut_coil(), side(0.1, 1.0), side(0.001, 800.0)];
    cases.extend([10.0, 1e3, 1e5].map(iron_corner));
    cases.extend([1e3, 1e5].map(iron_far));
    cases.push(perfect_quarter());
    cases.extend([1e-6, 0.01, 0.1, 1.0].map(|depth| impedance_quarter(depth, 1.0)));
    cases.push(impedance_quarter(0.001, 800.0));
    cases.extend([0.1, 0.01].map(meshed_quarter));
    cases.extend([island(Kind::Perfect, "perfect"), island(impedance(0.01), "δ 0.01 m")]);
    cases.extend([tee(), u_shape(1000.0, 0.01)]);
    cases.extend([comb(1.0, Kind::Perfect, "perfect"), comb(1000.0, impedance(0.01), "δ 0.01 m")]);
    cases
}

/// Prisms with a wall, or a face of a part, that moves while source and observation stay.
pub(super) fn moving() -> Vec<(Prism, Motion)> {
    let wall = |axis, at, from, to| Motion { axis, at, from, to, reach: 0.2 };
    vec![
        (air(), wall(0, -1.0, -1.0, 1.0)),
        (side(0.1, 1.0), wall(0, 0.8, -1.0, 1.0)),
        // The face of a block that another face meets, which grows with it.
        (impedance_quarter(0.1, 1.0), wall(0, 0.0, -1.0, 0.0)),
        (impedance_quarter(0.01, 1.0), wall(1, 0.0, 0.0, 1.0)),
        (perfect_quarter(), wall(1, 0.0, 0.0, 1.0)),
        (iron_far(1e3), Motion { reach: 0.1, ..wall(0, -0.8, -1.0, -0.4) }),
        (tee(), wall(1, -0.3, -1.0, 0.2)),
    ]
}
