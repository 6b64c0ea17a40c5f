//! What the dimensions of a shield must satisfy; every refusal names the parameter and says what to do.

use crate::error::MeshError;
use crate::generate::shield::ShieldParameters;

/// Smallest and largest refinement: below, no size matters any more; above, no mesh is small enough to be made.
const REFINEMENTS: [f64; 2] = [0.25, 20.0];

/// More design nodes or observation cells along one axis than this are taken for a mistake.
const NODES_LIMIT: f64 = 10_000.0;

/// Lengths closer than this [m] are taken for the same: decimal lengths are not exact in binary.
pub(super) fn tolerance(p: &ShieldParameters) -> f64 {
    1e-9 * p.plate[2]
}

fn refuse(parameter: &'static str, value: impl std::fmt::Debug, expected: &str) -> MeshError {
    MeshError::Parameter { parameter, value: format!("{value:?}"), expected: expected.to_owned() }
}

fn check_positive(parameter: &'static str, lengths: &[f64]) -> Result<(), MeshError> {
    match lengths.iter().find(|l| !(**l > 0.0 && l.is_finite())) {
        Some(_) => Err(refuse(parameter, lengths, "lengths must be positive and finite [m]")),
        None => Ok(()),
    }
}

fn check_ascending(parameter: &'static str, interval: [f64; 2], gap: f64) -> Result<(), MeshError> {
    if interval.iter().all(|c| c.is_finite()) && interval[0] + gap < interval[1] {
        return Ok(());
    }
    Err(refuse(parameter, interval, "two finite coordinates in ascending order are needed [m]"))
}

/// Refuses parameters that make no mesh.
///
/// # Errors
/// [`MeshError::Parameter`].
pub(super) fn check(p: &ShieldParameters) -> Result<(), MeshError> {
    check_numbers(p)?;
    check_pitch(p)?;
    check_skins(p)?;
    check_nesting(p)?;
    check_observation(p)
}

fn check_numbers(p: &ShieldParameters) -> Result<(), MeshError> {
    check_positive("shield.plate", &p.plate)?;
    check_positive("shield.pitch", &[p.pitch])?;
    check_positive("shield.coil_half_window", &p.coil_half_window)?;
    check_positive("shield.coil_width", &[p.coil_width])?;
    check_positive("shield.remesh_upper", &p.remesh_upper)?;
    check_positive("shield.outer", &p.outer)?;
    check_positive("shield.in_plane_size", &[p.in_plane_size])?;
    check_positive("shield.air_layer", &[p.air_layer])?;
    check_positive("shield.side_air", &[p.side_air])?;
    let gap = tolerance(p);
    check_ascending("shield.coil_z", p.coil_z, gap)?;
    check_ascending("shield.remesh_z", p.remesh_z, gap)?;
    check_ascending("shield.outer_z", p.outer_z, gap)?;
    check_ascending("shield.observation_x", p.observation.x, gap)?;
    check_ascending("shield.observation_y", p.observation.y, gap)?;
    check_ascending("shield.observation_z", p.observation.z, gap)?;
    if !(1.0..=100.0).contains(&p.growth) {
        return Err(refuse("shield.growth", p.growth, "a ratio between 1 and 100 is needed; 1.6 is usual"));
    }
    let [least, most] = REFINEMENTS;
    if !(least..=most).contains(&p.refinement) {
        let expected =
            format!("a number from {least} to {most} is needed; 1 is the default mesh, 2 halves all sizes");
        return Err(refuse("shield.refinement", p.refinement, &expected));
    }
    Ok(())
}

fn check_pitch(p: &ShieldParameters) -> Result<(), MeshError> {
    for extent in [p.plate[0], p.plate[1]] {
        let nodes = extent / p.pitch;
        // 1e-6 of a pitch is far beyond the rounding of decimal lengths and far below any intended remainder.
        if nodes.round() < 1.0 || nodes > NODES_LIMIT || (nodes - nodes.round()).abs() > 1e-6 {
            return Err(refuse(
                "shield.pitch",
                p.pitch,
                &format!(
                    "it must divide the plate's half length {extent} m into 1 to {NODES_LIMIT} whole parts"
                ),
            ));
        }
    }
    Ok(())
}

fn check_skins(p: &ShieldParameters) -> Result<(), MeshError> {
    let ascending = |depths: &[f64]| {
        depths.iter().all(|d| *d > 0.0 && d.is_finite()) && depths.windows(2).all(|pair| pair[0] < pair[1])
    };
    let deepest = |depths: &[f64]| depths.last().copied().unwrap_or(0.0);
    if !ascending(&p.skin) || deepest(&p.skin) > 0.5 * p.plate[2] + tolerance(p) {
        return Err(refuse(
            "shield.skin",
            &p.skin,
            "depths under the plate's faces must be positive, ascending and at most half its thickness; leave lines out \
             or order them",
        ));
    }
    let narrow = p.plate[0].min(p.plate[1]);
    if !ascending(&p.side_skin) || deepest(&p.side_skin) >= narrow - tolerance(p) {
        return Err(refuse(
            "shield.side_skin",
            &p.side_skin,
            "depths under the plate's sides must be positive, ascending and less than its half lengths; leave lines out \
             or order them",
        ));
    }
    Ok(())
}

fn check_nesting(p: &ShieldParameters) -> Result<(), MeshError> {
    let gap = tolerance(p);
    if (0..2).any(|d| p.remesh_upper[d] <= p.plate[d] + gap) {
        return Err(refuse(
            "shield.remesh_upper",
            p.remesh_upper,
            &format!("the remesh region must reach beyond the plate's half lengths {:?} m", &p.plate[..2]),
        ));
    }
    if p.remesh_z[0] >= -p.plate[2] - gap || p.remesh_z[1] <= gap {
        return Err(refuse(
            "shield.remesh_z",
            p.remesh_z,
            &format!(
                "the remesh region must reach below and above the plate, which lies from {} m to 0",
                -p.plate[2]
            ),
        ));
    }
    if p.coil_z[0] < 0.0 {
        return Err(refuse("shield.coil_z", p.coil_z, "the coil must lie above the plate, that is, above 0"));
    }
    let beyond = |d: usize| {
        let coil = p.coil_half_window[d] + p.coil_width;
        p.outer[d] <= p.remesh_upper[d].max(coil) + gap
    };
    if beyond(0) || beyond(1) {
        return Err(refuse(
            "shield.outer",
            p.outer,
            "the whole box must reach beyond the remesh region and the coil; enlarge it",
        ));
    }
    if p.outer_z[0] >= p.remesh_z[0] - gap || p.outer_z[1] <= p.remesh_z[1].max(p.coil_z[1]) + gap {
        return Err(refuse(
            "shield.outer_z",
            p.outer_z,
            "the whole box must reach below and above the remesh region and the coil; enlarge it",
        ));
    }
    Ok(())
}

fn check_observation(p: &ShieldParameters) -> Result<(), MeshError> {
    let (box_, gap) = (&p.observation, tolerance(p));
    if box_.cells.iter().any(|&n| n == 0 || n as f64 > NODES_LIMIT) {
        let expected = format!("1 to {NODES_LIMIT} cells are needed along x and along y");
        return Err(refuse("shield.observation_cells", box_.cells, &expected));
    }
    let inside =
        "the observation area must lie inside the whole box and on the meshed side of the symmetry planes";
    if box_.x[0] < 0.0 || box_.x[1] >= p.outer[0] - gap {
        return Err(refuse("shield.observation_x", box_.x, inside));
    }
    if box_.y[0] < 0.0 || box_.y[1] >= p.outer[1] - gap {
        return Err(refuse("shield.observation_y", box_.y, inside));
    }
    if box_.z[0] <= p.outer_z[0] + gap || box_.z[1] >= p.outer_z[1] - gap {
        return Err(refuse("shield.observation_z", box_.z, inside));
    }
    let beside = box_.x[0] >= p.remesh_upper[0] - gap || box_.y[0] >= p.remesh_upper[1] - gap;
    let apart = box_.z[1] <= p.remesh_z[0] + gap || box_.z[0] >= p.remesh_z[1] - gap;
    if !beside && !apart {
        return Err(refuse(
            "shield.observation_z",
            box_.z,
            &format!(
                "it overlaps the remesh region, remesh_z = {:?} m: observation cells must not move; separate \
                 the two along z",
                p.remesh_z
            ),
        ));
    }
    Ok(())
}
