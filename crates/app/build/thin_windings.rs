//! Analytic windings that are thinner than the elements in which they lie: what is said of their inductances.

use fluxmorph_geometry::tet4::{dot, norm, volume};
use fluxmorph_geometry::{ElementId, Mesh, Millimetres};
use fluxmorph_solver::coil::Racetrack;
use rayon::prelude::*;

use crate::config::{Coil, CoilShape, Config};

/// Width of the elements over that of a winding, for first order, above which its inductance is off by a twentieth or more: a ring
/// of 100 mm in open space has 0.90, 0.83, 0.75 and 0.64 of it in cells of 1, 2, 4 and 10 times its width, and with second order
/// 0.93, 0.86 and 0.75 in those of 2, 4 and 10 times; a rectangular coil of 80 mm by 60 mm 0.98, 0.95 and 0.91 in those of 0.5, 0.7
/// and 1 times. In cells of 5 times its width a square coil of 16, 8, 4 and 1.6 cells across has 0.64, 0.57, 0.49 and 0.19 of it, and
/// with second order 0.79, 0.75, 0.69 and 0.53.
const THIN: f64 = 0.7;

/// Share of the length of a winding in such elements that is not spoken of.
const FEW: f64 = 0.3;

/// What to say of a winding whose inductance is asked for and that is thinner than the elements in which it lies.
pub(super) fn warning(config: &Config, mesh: &Mesh, coil: &Coil, winding: &Racetrack) -> Option<String> {
    coil.turns?;
    let lengths = || section(coil).into_iter().map(|(_, length)| length);
    let (across, thinnest) = (lengths().product::<f64>().sqrt(), lengths().fold(f64::INFINITY, f64::min));
    // What windings beside each other differ by is the field in and between them, which goes by the thinner side.
    let has_leakage = config.coils.iter().filter(|coil| coil.turns.is_some()).count() > 1;
    let least = if has_leakage { thinnest.min(THIN * across) } else { THIN * across };
    // Along the current, and across it: of six tetrahedra that are a brick.
    let sizes = |e: ElementId| {
        let vertices = mesh.vertices(e);
        let current = winding.current_density(winding.wound_place(vertices)?);
        let along = vertices.map(|x| dot(x, current) / norm(current));
        let length = along.into_iter().fold(f64::MIN, f64::max) - along.into_iter().fold(f64::MAX, f64::min);
        Some((length, (6.0 * volume(vertices) / length).sqrt()))
    };
    let elements: Vec<ElementId> = mesh.topology().elements().collect();
    let found: Vec<(f64, f64)> = elements.into_par_iter().filter_map(sizes).collect();
    let limit = f64::from(u8::from(config.analysis.order)) * least;
    let wide = || found.iter().filter(|(_, width)| *width > limit);
    let widest = wide().map(|(_, width)| *width).fold(0.0, f64::max);
    let share =
        wide().map(|(length, _)| length).sum::<f64>() / found.iter().map(|(length, _)| length).sum::<f64>();
    (share > FEW).then(|| {
        format!(
            "the winding of `{}` is {:.3} mm across in cells of up to {:.3} mm: the field in and beside it is that of a thicker \
             one, and its own inductance in air too small, of a large ring with first order by a tenth in cells as wide as it and by \
             a third in those of ten times its width, of a coil as small as its cells by four fifths, with second order by about half \
             of that{}; elements as small as it is thin cure that",
            coil.name,
            Millimetres(if has_leakage { thinnest } else { across }),
            Millimetres(widest),
            if has_leakage { "; a leakage inductance and the current of a short circuit may be off by half and more" } else { "" }
        )
    })
}

/// The sizes of an analytic coil's winding by their keys [m].
pub(super) fn section(coil: &Coil) -> Vec<(&'static str, f64)> {
    let (width, height) = match &coil.shape {
        CoilShape::Racetrack(c) => (c.width, c.height),
        CoilShape::Circular(c) => (c.width, c.height),
        CoilShape::Region(_) => return Vec::new(),
    };
    vec![("width", width), ("height", height)]
}
