//! The shield of the paper's example 2: a plate between a coil and an observation area, quarter model.
//!
//! The symmetry planes are `x = 0` and `y = 0`; the plate lies under `z = 0`, the coil above it, the observation cells
//! below. The paper's figures are lost: the default dimensions are this project's reconstruction.
//!
//! Where the lines lie and why: the design nodes sit at the crossings of the pitch, so lines at its multiples make the
//! bilinear design surface exact. The field in iron decays over the skin depth (0.87 mm at 60 Hz), so lines follow the
//! plate's faces at given depths. The air under the plate is in few thick layers, because the plate may grow into it
//! by two thirds of its height. Beyond the remesh region cells grow by a constant ratio.

use std::sync::Arc;

use crate::error::MeshError;
use crate::generate::grading::{self, Fine, Growth, Skin};
use crate::generate::grid::{Division, Grid};
use crate::generate::shield_checks;
use crate::ids::RegionId;
use crate::mesh::Mesh;
use crate::tet4::Point;

/// Blocks in which `Σ B·B*` is observed.
#[derive(Clone, Debug, PartialEq)]
pub struct ObservationBox {
    /// First and last coordinate along x [m].
    pub x: [f64; 2],
    /// First and last coordinate along y [m].
    pub y: [f64; 2],
    /// First and last coordinate along z [m].
    pub z: [f64; 2],
    /// Cells along x and y; one along z.
    pub cells: [usize; 2],
}

/// Dimensions and mesh sizes of the shield; `Default` is the reconstructed example 2.
#[derive(Clone, Debug, PartialEq)]
pub struct ShieldParameters {
    /// Half length along x, half length along y and thickness of the plate [m]; its coil side is `z = 0`.
    pub plate: [f64; 3],
    /// Distance of the design nodes [m]; 20 mm makes the paper's 91 = 7 × 13. The mesh has lines at its multiples.
    pub pitch: f64,
    /// Depths of mesh lines under the two large faces [m], ascending, at most half the thickness. Empty: one layer.
    /// The default has two layers in the first skin depth and eight in all.
    pub skin: Vec<f64>,
    /// Depths of mesh lines under the free side faces [m], ascending. Empty: none.
    pub side_skin: Vec<f64>,
    /// Inner half sizes of the coil along x and y [m]. The coil is an analytic source; the mesh only has lines along it.
    pub coil_half_window: [f64; 2],
    /// Radial width of the coil [m].
    pub coil_width: f64,
    /// Lower and upper end of the coil [m].
    pub coil_z: [f64; 2],
    /// Where the field is observed.
    pub observation: ObservationBox,
    /// Upper ends of the remesh region along x and y [m].
    pub remesh_upper: [f64; 2],
    /// Lower and upper end of the remesh region [m].
    pub remesh_z: [f64; 2],
    /// Upper ends of the whole box along x and y [m].
    pub outer: [f64; 2],
    /// Lower and upper end of the whole box [m].
    pub outer_z: [f64; 2],
    /// Size of the cells over the plate, the coil and the observation area [m]; the pitch is the largest useful one.
    pub in_plane_size: f64,
    /// Height of the air layers of the remesh region [m]; 10 mm leaves three layers below the plate, which survive that
    /// its lower face moves by 20 mm, and quality 0.48 under cells of 20 mm.
    pub air_layer: f64,
    /// First air cell beside the plate's free sides [m], where they have a skin.
    pub side_air: f64,
    /// Ratio of neighbouring cells of growing air, at least 1.
    pub growth: f64,
    /// All sizes are divided by it, and the layers of a skin into as many (rounded); the growth ratio becomes its
    /// root, so that the far field is refined alike. Between 0.25 and 20.
    pub refinement: f64,
    /// Cells that are divided beyond that.
    pub division: Option<Division>,
}

impl Default for ShieldParameters {
    fn default() -> Self {
        Self {
            plate: [0.12, 0.24, 0.01],
            pitch: 0.02,
            skin: vec![0.4e-3, 1.2e-3, 2.5e-3, 5e-3],
            side_skin: vec![0.5e-3, 1.5e-3, 4e-3],
            coil_half_window: [0.06, 0.16],
            coil_width: 0.02,
            coil_z: [0.04, 0.08],
            observation: ObservationBox { x: [0.0, 0.04], y: [0.0, 0.12], z: [-0.06, -0.04], cells: [2, 6] },
            remesh_upper: [0.16, 0.28],
            remesh_z: [-0.04, 0.03],
            outer: [0.6, 0.72],
            outer_z: [-0.4, 0.48],
            in_plane_size: 0.02,
            air_layer: 0.01,
            side_air: 0.008,
            growth: 1.6,
            refinement: 1.0,
            division: None,
        }
    }
}

const REGIONS: [&str; 4] = ["air", "remesh", "plate", "observation"];
const AIR: RegionId = RegionId(0);
const REMESH: RegionId = RegionId(1);
const PLATE: RegionId = RegionId(2);
const OBSERVATION: RegionId = RegionId(3);

/// The mesh of the shield.
///
/// Regions: `plate`, `remesh` (the air that moves), `observation` and `air` (the rest, the coil's place included).
/// Surfaces: `x_min` … `z_max` outside (`x_min`, `y_min` are the symmetry planes), and of the plate, oriented out of
/// it, `plate_bottom` (the design surface), `plate_top` and `plate_side` (the two free sides). The region
/// `observation` has one cell per block, `y` fast.
///
/// # Errors
/// [`MeshError::Parameter`] names the parameter (`shield.…`).
pub fn shield(parameters: &ShieldParameters) -> Result<Mesh, MeshError> {
    let grid = grid(parameters)?;
    let mut topology = grid.topology(&REGIONS, |centre| region_at(parameters, centre))?;
    let [edge_x, edge_y, thickness] = parameters.plate;
    let face = |axis, at| grid.region_surface(&topology, PLATE, axis, grid.nearest_line(axis, at));
    let (bottom, top) = (face(2, -thickness), face(2, 0.0));
    let side = [face(0, edge_x), face(1, edge_y)].concat();
    topology = topology
        .with_surface("plate_bottom", bottom)?
        .with_surface("plate_top", top)?
        .with_surface("plate_side", side)?
        .with_cells("observation", observation_cells(&grid, &parameters.observation));
    Mesh::new(Arc::new(topology), grid.points())
}

impl ShieldParameters {
    /// Tetrahedra of the mesh, which is not made.
    ///
    /// # Errors
    /// As [`shield`].
    pub fn tet_count(&self) -> Result<usize, MeshError> {
        Ok(grid(self)?.tet_count())
    }
}

fn grid(parameters: &ShieldParameters) -> Result<Grid, MeshError> {
    shield_checks::check(parameters)?;
    let [x, y] = [horizontal_lines(parameters, 0)?, horizontal_lines(parameters, 1)?];
    let grid = Grid::new("shield.refinement", [x, y, vertical_lines(parameters)?])?;
    grid.divided("shield.refinement", parameters.division.as_ref())
}

fn region_at(p: &ShieldParameters, [x, y, z]: Point) -> RegionId {
    let within = |[low, high]: [f64; 2], c: f64| low < c && c < high;
    let box_ = &p.observation;
    if within([-p.plate[2], 0.0], z) && x < p.plate[0] && y < p.plate[1] {
        PLATE
    } else if within(p.remesh_z, z) && x < p.remesh_upper[0] && y < p.remesh_upper[1] {
        REMESH
    } else if within(box_.z, z) && within(box_.x, x) && within(box_.y, y) {
        OBSERVATION
    } else {
        AIR
    }
}

fn observation_cells(grid: &Grid, box_: &ObservationBox) -> Vec<Vec<crate::ids::ElementId>> {
    let line = |axis, at| grid.nearest_line(axis, at);
    let x: Vec<usize> = grading::equal_parts(box_.x, box_.cells[0]).iter().map(|&c| line(0, c)).collect();
    let y: Vec<usize> = grading::equal_parts(box_.y, box_.cells[1]).iter().map(|&c| line(1, c)).collect();
    let z = box_.z.map(|c| line(2, c));
    let mut cells = Vec::with_capacity(box_.cells[0] * box_.cells[1]);
    for i in x.windows(2) {
        cells.extend(y.windows(2).map(|j| grid.elements_within([[i[0], i[1]], [j[0], j[1]], z])));
    }
    cells
}

/// Target sizes after refinement.
struct Sizes {
    in_plane: f64,
    air_layer: f64,
    side_air: f64,
    growth: f64,
    skin_parts: usize,
}

impl Sizes {
    fn of(p: &ShieldParameters) -> Self {
        Self {
            in_plane: p.in_plane_size / p.refinement,
            air_layer: p.air_layer / p.refinement,
            side_air: p.side_air / p.refinement,
            growth: p.growth.powf(1.0 / p.refinement),
            skin_parts: (p.refinement.round() as usize).max(1),
        }
    }

    /// Cells beyond the remesh region.
    fn far(&self) -> Growth {
        Growth { first: self.in_plane * self.growth, ratio: self.growth, largest: f64::INFINITY }
    }
}

/// Lines of every interval between neighbouring breakpoints, joined.
fn join(
    breakpoints: &[f64],
    mut interval: impl FnMut([f64; 2]) -> Result<Vec<f64>, MeshError>,
) -> Result<Vec<f64>, MeshError> {
    let mut lines: Vec<f64> = breakpoints.first().copied().into_iter().collect();
    for pair in breakpoints.windows(2) {
        lines.extend(&interval([pair[0], pair[1]])?[1..]);
    }
    Ok(lines)
}

/// The breakpoints between two of them, both included; `tolerance` covers those that were merged.
fn between(breakpoints: &[f64], [low, high]: [f64; 2], tolerance: f64) -> Vec<f64> {
    let inside = |c: &&f64| **c >= low - tolerance && **c <= high + tolerance;
    breakpoints.iter().filter(inside).copied().collect()
}

/// Lines along x (`axis` 0) or y (1).
fn horizontal_lines(p: &ShieldParameters, axis: usize) -> Result<Vec<f64>, MeshError> {
    const IN_PLANE: &str = "shield.in_plane_size";
    let sizes = Sizes::of(p);
    let (edge, remesh, outer) = (p.plate[axis], p.remesh_upper[axis], p.outer[axis]);
    let tolerance = shield_checks::tolerance(p);
    let box_ = &p.observation;
    let observed = if axis == 0 { box_.x } else { box_.y };
    let inner_coil = p.coil_half_window[axis];

    let mut breakpoints = grading::equal_parts([0.0, edge], (edge / p.pitch).round() as usize);
    breakpoints.extend([remesh, outer]);
    breakpoints.extend(grading::skin("shield.side_skin", [0.0, edge], Skin::AtEnd, &p.side_skin)?);
    breakpoints.extend(grading::equal_parts(observed, box_.cells[axis]));
    breakpoints.extend([inner_coil, inner_coil + p.coil_width]);
    let breakpoints = grading::merge(&breakpoints, tolerance);

    let skin_start = edge - p.side_skin.last().copied().unwrap_or(0.0) - tolerance;
    let mut lines = join(&between(&breakpoints, [0.0, edge], tolerance), |interval| {
        if interval[0] >= skin_start {
            Ok(grading::equal_parts(interval, sizes.skin_parts))
        } else {
            grading::uniform(IN_PLANE, interval, sizes.in_plane)
        }
    })?;
    let beside = between(&breakpoints, [edge, remesh], tolerance);
    let beside = if p.side_skin.is_empty() {
        join(&beside, |interval| grading::uniform(IN_PLANE, interval, sizes.in_plane))?
    } else {
        let growth = Growth { first: sizes.side_air, ratio: sizes.growth, largest: sizes.in_plane };
        grading::growing("shield.side_air", &beside, Fine::Start, growth)?
    };
    lines.extend(&beside[1..]);
    let far = between(&breakpoints, [remesh, outer], tolerance);
    lines.extend(&grading::growing(IN_PLANE, &far, Fine::Start, sizes.far())?[1..]);
    Ok(lines)
}

/// Lines along z.
fn vertical_lines(p: &ShieldParameters) -> Result<Vec<f64>, MeshError> {
    const IN_PLANE: &str = "shield.in_plane_size";
    let sizes = Sizes::of(p);
    let tolerance = shield_checks::tolerance(p);
    let observed = p.observation.z;
    let plate = [-p.plate[2], 0.0];

    let mut breakpoints = plate.to_vec();
    breakpoints.extend(p.remesh_z);
    breakpoints.extend(p.outer_z);
    breakpoints.extend(grading::skin("shield.skin", plate, Skin::AtBothEnds, &p.skin)?);
    breakpoints.extend(observed);
    breakpoints.extend(p.coil_z);
    let breakpoints = grading::merge(&breakpoints, tolerance);
    let near = [p.remesh_z[0].min(observed[0]), p.remesh_z[1].max(observed[1]).max(p.coil_z[1])];

    let below = between(&breakpoints, [p.outer_z[0], near[0]], tolerance);
    let mut lines = grading::growing(IN_PLANE, &below, Fine::End, sizes.far())?;
    let middle = join(&between(&breakpoints, near, tolerance), |interval| {
        let centre = 0.5 * (interval[0] + interval[1]);
        if plate[0] < centre && centre < plate[1] {
            let parts = if p.skin.is_empty() { 1 } else { sizes.skin_parts };
            Ok(grading::equal_parts(interval, parts))
        } else if p.remesh_z[0] < centre && centre < p.remesh_z[1] {
            grading::uniform("shield.air_layer", interval, sizes.air_layer)
        } else {
            grading::uniform(IN_PLANE, interval, sizes.in_plane)
        }
    })?;
    lines.extend(&middle[1..]);
    let above = between(&breakpoints, [near[1], p.outer_z[1]], tolerance);
    lines.extend(&grading::growing(IN_PLANE, &above, Fine::Start, sizes.far())?[1..]);
    Ok(lines)
}
