//! How far the current of a coil region is from one without divergence.
//!
//! `J` is constant on each element, so its divergence sits on the faces: the jump of `J·n` between two elements of the
//! region, and `J·n` on its walls. Beside it stand the weak divergence `∫J·∇q` that the projection removes, the share
//! of the projection, and the current through cross-sections.

use std::f64::consts::TAU;
use std::fmt;

use fluxmorph_geometry::tet4::{Point, area_vector, dot, norm, sub};

use super::frame::Frame;
use super::patch::{Patch, PatchFace, direction};
use super::potential::Potential;
use super::region::TerminalFace;

/// Divergence of a current before or after the projection, over the root mean square of `|J|`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Divergence {
    /// Root mean square over inner faces of the jump of `J·n` [1].
    pub jump: f64,
    /// Root mean square over the walls (terminals left out) of `J·n` [1].
    pub wall: f64,
    /// `‖∫J·∇q‖` over all nodal `q`, over the same sum with the absolute values of its terms [1].
    pub weak: f64,
}

/// What a coil region's current is like.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CurrentReport {
    /// Of the direction of conduction with uniform magnitude.
    pub before: Divergence,
    /// Of the current.
    pub after: Divergence,
    /// `‖∇χ‖/‖J‖`: how much the projection changed [1].
    pub correction: f64,
    /// Least and greatest current through cross-sections along the way, for one ampere-turn [A].
    pub through: [f64; 2],
    /// Root mean square of `|J|` for one ampere-turn [A/m²].
    pub current_density: f64,
}

impl fmt::Display for CurrentReport {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let percent = |x: f64| 100.0 * x;
        write!(
            f,
            "residual divergence of the current: jump at inner faces {:.2} %, through walls {:.2} % of its density \
             (before projection {:.2} %, {:.2} %; the projection changed {:.2} %); current through cross-sections \
             {:.2} to {:.2} % of the ampere-turns",
            percent(self.after.jump),
            percent(self.after.wall),
            percent(self.before.jump),
            percent(self.before.wall),
            percent(self.correction),
            percent(self.through[0]),
            percent(self.through[1]),
        )
    }
}

/// Where cross-sections are laid.
#[derive(Clone, Copy, Debug)]
pub(super) enum Section<'a> {
    /// At levels of the potential between terminals.
    LevelsOf(&'a [f64]),
    /// On half-planes from the axis of a ring.
    HalfPlanesOf(&'a Frame),
}

/// Number of cross-sections.
const SECTIONS: usize = 8;

/// Shift of the cross-sections, in their distance: keeps them off the lines of a structured mesh.
const SHIFT: f64 = 0.381_966;

/// The report of a current before and after projection, both scaled.
pub(super) fn report(
    patch: &Patch,
    problem: &Potential<'_>,
    [before, after]: [&[Point]; 2],
    terminals: &[TerminalFace],
    section: Section<'_>,
) -> CurrentReport {
    let change: Vec<Point> = before.iter().zip(after).map(|(b, a)| sub(*b, *a)).collect();
    let sections =
        (0..SECTIONS).map(|k| through(patch, after, section, (k as f64 + SHIFT) / SECTIONS as f64));
    let through =
        sections.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], s| [low.min(s), high.max(s)]);
    CurrentReport {
        before: divergence(patch, problem, before, terminals),
        after: divergence(patch, problem, after, terminals),
        correction: patch.norm(&change) / patch.norm(after),
        through,
        current_density: patch.rms(after),
    }
}

fn divergence(
    patch: &Patch,
    problem: &Potential<'_>,
    field: &[Point],
    terminals: &[TerminalFace],
) -> Divergence {
    let scale = patch.rms(field);
    let mut terminals: Vec<_> = terminals.iter().map(|t| t.nodes).collect();
    terminals.sort_unstable();
    let is_terminal = |f: &PatchFace| terminals.binary_search(&f.key).is_ok();
    // Sums of A (ΔJ·n)² and of A, on inner faces and on walls.
    let (mut inner, mut wall) = ([0.0; 2], [0.0; 2]);
    for face in &patch.faces {
        let area = norm(face.area);
        let (sum, across) = match face.outside {
            Some(outside) => (&mut inner, dot(sub(field[outside], field[face.inside]), face.area)),
            None if is_terminal(face) => continue,
            None => (&mut wall, dot(field[face.inside], face.area)),
        };
        sum[0] += across * across / area;
        sum[1] += area;
    }
    let rms = |[squares, area]: [f64; 2]| if area > 0.0 { (squares / area).sqrt() / scale } else { 0.0 };
    let residual = problem.residual(field).iter().map(|r| r * r).sum::<f64>().sqrt();
    let terms: f64 = patch
        .tets
        .iter()
        .zip(field)
        .flat_map(|(tet, j)| tet.gradients.map(|g| (tet.volume * dot(*j, g)).powi(2)))
        .sum();
    Divergence { jump: rms(inner), wall: rms(wall), weak: residual / terms.sqrt() }
}

/// The current through one cross-section, the mean over separate parts [A]; `share` from 0 to 1 places it.
fn through(patch: &Patch, field: &[Point], section: Section<'_>, share: f64) -> f64 {
    let mut current = 0.0;
    match section {
        Section::LevelsOf(potential) => {
            let gradients = patch.gradient(potential);
            for (e, nodes) in patch.connectivity.iter().enumerate() {
                let values = nodes.map(|n| potential[n.index()] - share);
                let area = cut(patch.vertices(e), values).map_or(0.0, |(area, _)| area);
                current -= area * dot(field[e], direction(gradients[e], 0.0));
            }
        }
        Section::HalfPlanesOf(frame) => {
            let (s, c) = (TAU * share).sin_cos();
            let (along, across) = (frame.vector([c, s, 0.0]), frame.vector([-s, c, 0.0]));
            for (e, j) in field.iter().enumerate() {
                let vertices = patch.vertices(e);
                let values = vertices.map(|x| dot(sub(x, frame.centre()), across));
                // The half-plane on the other side of the axis is another cross-section.
                let Some((area, _)) = cut(vertices, values)
                    .filter(|(_, middle)| dot(sub(*middle, frame.centre()), along) > 0.0)
                else {
                    continue;
                };
                current += area * dot(*j, across);
            }
        }
    }
    current / patch.parts as f64
}

/// Area and middle of the polygon in a tet on which the linear function with these vertex values is zero.
fn cut(vertices: [Point; 4], values: [f64; 4]) -> Option<(f64, Point)> {
    let (above, below): (Vec<usize>, Vec<usize>) = (0..4).partition(|&a| values[a] > 0.0);
    let crossing = |a: usize, b: usize| -> Point {
        let t = values[a] / (values[a] - values[b]);
        std::array::from_fn(|d| vertices[a][d] + t * (vertices[b][d] - vertices[a][d]))
    };
    let polygon: Vec<Point> = match (above.as_slice(), below.as_slice()) {
        ([a], others) | (others, [a]) => others.iter().map(|&b| crossing(*a, b)).collect(),
        ([a, b], [c, d]) => vec![crossing(*a, *c), crossing(*a, *d), crossing(*b, *d), crossing(*b, *c)],
        _ => return None,
    };
    let first = polygon[0];
    let area: f64 = polygon[1..].windows(2).map(|pair| norm(area_vector([first, pair[0], pair[1]]))).sum();
    let middle = std::array::from_fn(|d| polygon.iter().map(|x| x[d]).sum::<f64>() / polygon.len() as f64);
    Some((area, middle))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_cut_of_the_unit_tetrahedron_has_the_area_of_its_triangle_or_quadrilateral() {
        let unit = [[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
        let area = |f: fn(Point) -> f64| cut(unit, unit.map(f)).map(|(area, _)| area);
        // z = ½: a right triangle with legs ½.
        assert!((area(|x| x[2] - 0.5).unwrap() - 0.125).abs() < 1e-15);
        // x + y = ½: a rectangle less a triangle: corners (½,0,0), (0,½,0), (0,½,½), (½,0,½).
        assert!((area(|x| x[0] + x[1] - 0.5).unwrap() - 0.5 * 0.5f64.sqrt()).abs() < 1e-15);
        assert_eq!(area(|x| x[2] - 2.0), None);
    }
}
