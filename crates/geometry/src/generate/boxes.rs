//! A box of boxes: regions painted one over the other on a graded grid, for devices with faces along the axes.
//!
//! Every face of every box lies on mesh lines. Sizes are upper limits: within a region, at its faces (the skin), or
//! along a part of an axis; between them cells grow by a ratio (`generate::sizing`). As the grid is a product of three
//! sets of lines, a size counts along its axis throughout the mesh.

use std::collections::BTreeMap;
use std::sync::Arc;

use crate::error::MeshError;
use crate::generate::grading::equal_parts;
use crate::generate::grid::{Division, Grid, check_size};
use crate::generate::sizing::{self, SizeLimit};
use crate::ids::{ElementId, NodeId, RegionId};
use crate::mesh::Mesh;
use crate::tet4::Point;
use crate::topology::Topology;

/// The region of all that no box covers.
pub const BACKGROUND: &str = "air";

/// Lower and upper corner of a box [m].
pub type Corners = [Point; 2];

/// A region, or a part of one: later boxes lie over earlier ones.
#[derive(Clone, Debug, PartialEq)]
pub struct BoxRegion {
    /// Name of the region; several boxes may share it, and one named [`BACKGROUND`] is a hole.
    pub name: String,
    /// Lower and upper corner [m].
    pub corners: Corners,
    /// Largest cell within the box along x, y and z [m]; infinity for no limit.
    pub size: [f64; 3],
    /// Largest first cell on either side of the box's faces across x, y and z [m]; infinity for no limit.
    pub skin: [f64; 3],
    /// Observation cells along x, y and z, `z` fast; without them every element is one.
    pub cells: Option<[usize; 3]>,
}

/// A size along a part of one axis.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AxisSize {
    /// Axis: 0, 1, 2 for x, y, z.
    pub axis: usize,
    /// Where, and how large a cell may be.
    pub limit: SizeLimit,
}

/// A named surface: all faces between regions, or outside, within a box that may be flat.
#[derive(Clone, Debug, PartialEq)]
pub struct SurfacePatch {
    /// Name of the surface.
    pub name: String,
    /// Lower and upper corner [m], equal along an axis for a plane patch.
    pub corners: Corners,
}

/// A graded box with regions.
#[derive(Clone, Debug, PartialEq)]
pub struct BoxesParameters {
    /// Lower and upper corner of the whole [m].
    pub corners: Corners,
    /// Regions; later ones lie over earlier ones.
    pub regions: Vec<BoxRegion>,
    /// Further sizes along the axes.
    pub sizes: Vec<AxisSize>,
    /// Named surfaces beside the six outer faces.
    pub surfaces: Vec<SurfacePatch>,
    /// Ratio of neighbouring cells away from the places that have a size, above 1.
    pub growth: f64,
    /// All sizes are divided by it; the growth ratio becomes its root, so that the far field is refined alike.
    pub refinement: f64,
    /// Cells that are divided beyond that.
    pub division: Option<Division>,
}

/// The mesh of a box of boxes.
///
/// Regions: `air`, then the others in the order of their first boxes. Surfaces: `x_min` … `z_max` outside, and the
/// named patches, whose triangles point outwards, and between two regions out of the later one.
///
/// # Errors
/// [`MeshError::Parameter`] names the parameter (`boxes.…`).
pub fn boxes(parameters: &BoxesParameters) -> Result<Mesh, MeshError> {
    let grid = grid(parameters)?;

    let names = region_names(&parameters.regions);
    let id_of: BTreeMap<&str, RegionId> =
        names.iter().enumerate().map(|(i, &name)| (name, RegionId::new(i))).collect();
    let painted: Vec<(Corners, RegionId)> =
        parameters.regions.iter().map(|region| (region.corners, id_of[region.name.as_str()])).collect();
    let region_at = |centre: Point| {
        let holds =
            |corners: &Corners| (0..3).all(|d| corners[0][d] < centre[d] && centre[d] < corners[1][d]);
        painted.iter().rev().find(|(corners, _)| holds(corners)).map_or(RegionId(0), |&(_, id)| id)
    };
    let mut topology = grid.topology(&names, region_at)?;
    for (name, cells) in observation_cells(parameters, &grid, &topology, &id_of)? {
        topology = topology.with_cells(name, cells);
    }
    let points = grid.points();
    for patch in &parameters.surfaces {
        if topology.surface(&patch.name).is_ok() {
            let value = format!("`{}`, which is an outer face of the mesh or an earlier patch", patch.name);
            return Err(MeshError::parameter("boxes.surfaces", value, "a name of its own"));
        }
        let triangles = patch_triangles(patch, &topology, &points, tolerance(parameters));
        if triangles.is_empty() {
            let value = format!("`{}` in {:?} m", patch.name, patch.corners);
            let expected = "no face between regions and no outer face lies there; a patch must hold some";
            return Err(MeshError::parameter("boxes.surfaces", value, expected));
        }
        topology = topology.with_surface(&patch.name, triangles)?;
    }
    Mesh::new(Arc::new(topology), points)
}

impl BoxesParameters {
    /// Tetrahedra of the mesh, which is not made.
    ///
    /// # Errors
    /// As [`boxes`].
    pub fn tet_count(&self) -> Result<usize, MeshError> {
        Ok(grid(self)?.tet_count())
    }
}

fn grid(parameters: &BoxesParameters) -> Result<Grid, MeshError> {
    check(parameters)?;
    let axis_lines = |axis| {
        let ends = parameters.corners.map(|corner| corner[axis]);
        let growth = parameters.growth.powf(1.0 / parameters.refinement);
        sizing::lines("boxes", ends, &limits(parameters, axis), growth)
    };
    let lines = [axis_lines(0)?, axis_lines(1)?, axis_lines(2)?];
    check_size("boxes", [0, 1, 2].map(|d| lines[d].len() - 1))?;
    Grid::new("boxes", lines)?.divided("boxes", parameters.division.as_ref())
}

/// Lengths below this are rounding of decimal lengths [m].
fn tolerance(p: &BoxesParameters) -> f64 {
    1e-9 * (0..3).map(|d| p.corners[1][d] - p.corners[0][d]).fold(0.0, f64::max)
}

fn check(p: &BoxesParameters) -> Result<(), MeshError> {
    let [lower, upper] = p.corners;
    if !(0..3).all(|d| lower[d] < upper[d] && lower[d].is_finite() && upper[d].is_finite()) {
        let expected = "the lower corner first, below the upper corner in x, y and z";
        return Err(MeshError::parameter("boxes.box", format!("{:?} m", p.corners), expected));
    }
    if !(p.refinement > 0.0 && p.refinement.is_finite()) {
        return Err(MeshError::parameter("boxes.refinement", p.refinement, "a positive number"));
    }
    let room = tolerance(p);
    let within = |corners: &Corners| {
        (0..3).all(|d| corners[0][d] >= lower[d] - room && corners[1][d] <= upper[d] + room)
    };
    for region in &p.regions {
        let volume = (0..3).all(|d| region.corners[0][d] < region.corners[1][d]);
        if !(volume && within(&region.corners)) {
            let value =
                format!("`{}` from {:?} to {:?} m", region.name, region.corners[0], region.corners[1]);
            let expected = format!("a box with a volume within {lower:?} to {upper:?} m");
            return Err(MeshError::parameter("boxes.regions", value, expected));
        }
        if region.cells.is_some_and(|cells| cells.contains(&0)) {
            let value = format!("`{}`: {:?}", region.name, region.cells);
            let expected = "at least one observation cell along every axis";
            return Err(MeshError::parameter("boxes.regions", value, expected));
        }
    }
    if let Some(size) = p.sizes.iter().find(|size| size.axis > 2) {
        return Err(MeshError::parameter("boxes.sizes", format!("axis {}", size.axis), "axis 0, 1 or 2"));
    }
    Ok(())
}

/// All limits along an axis, refined; the faces of every box and observation cell among them.
fn limits(p: &BoxesParameters, axis: usize) -> Vec<SizeLimit> {
    let growth = p.growth.powf(1.0 / p.refinement);
    let mut limits = Vec::new();
    for region in &p.regions {
        let interval = region.corners.map(|corner| corner[axis]);
        limits.push(SizeLimit { interval, size: region.size[axis] / p.refinement });
        // Divided by the growth, because cells beside a limit start at `growth` times its size.
        let size = region.skin[axis] / p.refinement / growth;
        limits.extend(interval.map(|face| SizeLimit { interval: [face, face], size }));
        if let Some(cells) = region.cells {
            let ends = equal_parts(interval, cells[axis]);
            limits.extend(ends.iter().map(|&at| SizeLimit { interval: [at, at], size: f64::INFINITY }));
        }
    }
    let along = p.sizes.iter().filter(|size| size.axis == axis).map(|size| size.limit);
    limits.extend(along.map(|limit| SizeLimit { size: limit.size / p.refinement, ..limit }));
    limits
}

fn region_names(regions: &[BoxRegion]) -> Vec<&str> {
    let mut names = vec![BACKGROUND];
    for region in regions {
        if !names.contains(&region.name.as_str()) {
            names.push(&region.name);
        }
    }
    names
}

/// The observation cells by region; of a region with some, a box without is one cell.
fn observation_cells<'a>(
    p: &'a BoxesParameters,
    grid: &Grid,
    topology: &Topology,
    id_of: &BTreeMap<&str, RegionId>,
) -> Result<BTreeMap<&'a str, Vec<Vec<ElementId>>>, MeshError> {
    let mut cells_of: BTreeMap<&str, Vec<Vec<ElementId>>> = BTreeMap::new();
    let divided = |name: &str| p.regions.iter().any(|region| region.name == name && region.cells.is_some());
    let mut is_in_one = vec![false; topology.tets().len()];
    for region in p.regions.iter().filter(|region| divided(&region.name)) {
        let counts = region.cells.unwrap_or([1; 3]);
        let refuse = |expected: &str| {
            let value = format!("`{}` with cells = {counts:?}", region.name);
            MeshError::parameter("boxes.regions", value, expected)
        };
        let lines: [Vec<usize>; 3] = [0, 1, 2].map(|d| {
            let ends = equal_parts([region.corners[0][d], region.corners[1][d]], counts[d]);
            ends.iter().map(|&at| grid.nearest_line(d, at)).collect()
        });
        let all = cells_of.entry(&region.name).or_default();
        for i in lines[0].windows(2) {
            for j in lines[1].windows(2) {
                for k in lines[2].windows(2) {
                    let mut cell = grid.elements_within([[i[0], i[1]], [j[0], j[1]], [k[0], k[1]]]);
                    cell.retain(|e| topology.region_of()[e.index()] == id_of[region.name.as_str()]);
                    if cell.is_empty() {
                        let expected = "a later box covers one of its observation cells; move one of them";
                        return Err(refuse(expected));
                    }
                    if cell.iter().any(|e| std::mem::replace(&mut is_in_one[e.index()], true)) {
                        let expected =
                            "boxes of one name do not overlap where one of them has observation cells";
                        return Err(refuse(expected));
                    }
                    all.push(cell);
                }
            }
        }
    }
    Ok(cells_of)
}

fn patch_triangles(
    patch: &SurfacePatch,
    topology: &Topology,
    points: &[Point],
    tolerance: f64,
) -> Vec<[NodeId; 3]> {
    let [lower, upper] = patch.corners;
    let within = |node: &NodeId| {
        let point = points[node.index()];
        (0..3).all(|d| point[d] >= lower[d] - tolerance && point[d] <= upper[d] + tolerance)
    };
    let region_at = |e: ElementId| topology.region_of()[e.index()];
    topology
        .facets()
        .iter()
        .filter(|facet| facet.nodes.iter().all(within))
        .map(|facet| {
            let [a, b, c] = facet.nodes;
            match facet.outside {
                Some(outside) if region_at(outside) > region_at(facet.inside) => [a, c, b],
                _ => [a, b, c],
            }
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::generate::measures::{area, volume};
    use crate::tet4;

    const FREE: [f64; 3] = [f64::INFINITY; 3];

    fn region(name: &str, corners: Corners) -> BoxRegion {
        BoxRegion { name: name.into(), corners, size: FREE, skin: FREE, cells: None }
    }

    /// A plate of 6 x 4 x 1 with a hole of 2 x 2 through it, in a box of 20.
    fn plate() -> BoxesParameters {
        BoxesParameters {
            corners: [[-10.0; 3], [10.0; 3]],
            regions: vec![
                BoxRegion {
                    size: [1.0, 1.0, 0.5],
                    skin: [f64::INFINITY, f64::INFINITY, 0.2],
                    ..region("plate", [[-3.0, -2.0, 0.0], [3.0, 2.0, 1.0]])
                },
                region("air", [[-2.0, -1.0, 0.0], [0.0, 1.0, 1.0]]),
            ],
            sizes: vec![],
            surfaces: vec![],
            growth: 2.0,
            refinement: 1.0,
            division: None,
        }
    }

    #[test]
    fn a_later_box_is_a_hole_in_an_earlier_one() {
        let mesh = boxes(&plate()).expect("valid");
        assert_eq!(mesh.topology().region_names(), ["air", "plate"]);
        assert!((volume(&mesh, "plate") - 20.0).abs() < 1e-10);
        assert!((volume(&mesh, "air") - 7980.0).abs() < 1e-8);
    }

    #[test]
    fn the_skin_limits_the_cells_at_both_sides_of_a_face() {
        let mesh = boxes(&plate()).expect("valid");
        let mut z: Vec<f64> = mesh.points().iter().map(|p| p[2]).collect();
        z.sort_by(f64::total_cmp);
        z.dedup();
        for face in [0.0, 1.0] {
            let at = z.iter().position(|&c| c == face).expect("faces are lines");
            assert!(z[at] - z[at - 1] <= 0.211 && z[at + 1] - z[at] <= 0.211, "{z:?}");
        }
    }

    #[test]
    fn patches_hold_the_faces_within_them_oriented_out_of_the_later_region() {
        let mut parameters = plate();
        let patch = |name: &str, corners| SurfacePatch { name: name.into(), corners };
        parameters.surfaces = vec![
            patch("top", [[-3.0, -2.0, 1.0], [3.0, 2.0, 1.0]]),
            patch("bottom", [[-3.0, -2.0, 0.0], [3.0, 2.0, 0.0]]),
            patch("hole", [[-2.0, -1.0, 0.0], [0.0, 1.0, 1.0]]),
            patch("ground", [[-10.0, -10.0, -10.0], [10.0, 10.0, -10.0]]),
        ];
        let mesh = boxes(&parameters).expect("valid");
        let close = |found: Point, expected: Point| {
            (0..3).for_each(|d| assert!((found[d] - expected[d]).abs() < 1e-9, "{found:?} {expected:?}"));
        };
        close(area(&mesh, "top"), [0.0, 0.0, 20.0]);
        close(area(&mesh, "bottom"), [0.0, 0.0, -20.0]);
        close(area(&mesh, "hole"), [0.0; 3]);
        close(area(&mesh, "ground"), [0.0, 0.0, -400.0]);
        parameters.surfaces = vec![patch("nowhere", [[5.0; 3], [6.0; 3]])];
        let refused = boxes(&parameters).expect_err("no face lies there").to_string();
        assert!(refused.contains("boxes.surfaces") && refused.contains("`nowhere`"), "{refused}");
        let top = [[-1.0, -1.0, 1.0], [1.0, 1.0, 1.0]];
        parameters.surfaces = vec![patch("x_max", top)];
        let refused = boxes(&parameters).expect_err("the name of a side").to_string();
        assert!(refused.contains("`x_max`, which is an outer face"), "{refused}");
    }

    #[test]
    fn observation_cells_fill_their_box_in_order() {
        let mut parameters = plate();
        parameters.regions.push(BoxRegion {
            cells: Some([2, 3, 1]),
            ..region("observation", [[0.0, 0.0, 4.0], [2.0, 3.0, 5.0]])
        });
        let mesh = boxes(&parameters).expect("valid");
        let topology = mesh.topology();
        let cells = topology.cells_of(topology.region("observation").expect("it has it"));
        assert_eq!(cells.len(), 6);
        for (number, cell) in cells.iter().enumerate() {
            let volume: f64 = cell.iter().map(|&e| tet4::volume(mesh.vertices(e))).sum();
            assert!((volume - 1.0).abs() < 1e-10);
            let (i, j) = (number / 3, number % 3);
            for &e in cell {
                for p in mesh.vertices(e) {
                    assert!((i as f64..=i as f64 + 1.0).contains(&p[0]));
                    assert!((j as f64..=j as f64 + 1.0).contains(&p[1]));
                }
            }
        }
        let refused = |over: BoxRegion| {
            let regions = [parameters.regions.clone(), vec![over]].concat();
            boxes(&BoxesParameters { regions, ..parameters.clone() }).expect_err("over a cell").to_string()
        };
        let of_air = refused(region("air", [[0.0, 0.0, 4.0], [1.0, 1.0, 5.0]]));
        assert!(of_air.contains("covers one of its observation cells"), "{of_air}");
        let twice = refused(region("observation", [[1.0, 0.0, 4.0], [3.0, 3.0, 5.0]]));
        assert!(twice.contains("do not overlap"), "{twice}");
    }

    #[test]
    fn refinement_halves_the_cells_everywhere() {
        let coarse = boxes(&plate()).expect("valid").topology().tets().len();
        let fine =
            boxes(&BoxesParameters { refinement: 2.0, ..plate() }).expect("valid").topology().tets().len();
        assert!((5.0..12.0).contains(&(fine as f64 / coarse as f64)), "{coarse} {fine}");
    }

    #[test]
    fn what_makes_no_mesh_is_refused_by_name() {
        let refused = |change: &dyn Fn(&mut BoxesParameters)| {
            let mut parameters = plate();
            change(&mut parameters);
            match boxes(&parameters) {
                Err(MeshError::Parameter { parameter, .. }) => parameter,
                other => panic!("{other:?}"),
            }
        };
        assert_eq!(refused(&|p| p.corners[1][2] = -10.0), "boxes.box");
        assert_eq!(refused(&|p| p.corners[1][2] = f64::NAN), "boxes.box");
        assert_eq!(refused(&|p| p.refinement = 0.0), "boxes.refinement");
        assert_eq!(refused(&|p| p.growth = 1.0), "boxes");
        assert_eq!(refused(&|p| p.regions[0].corners[1][0] = 11.0), "boxes.regions");
        assert_eq!(refused(&|p| p.regions[0].corners[1][0] = -3.0), "boxes.regions");
        assert_eq!(refused(&|p| p.regions[0].cells = Some([1, 0, 1])), "boxes.regions");
        assert_eq!(refused(&|p| p.regions[0].size[0] = 1e-4), "boxes");
        let far = AxisSize { axis: 3, limit: SizeLimit { interval: [0.0; 2], size: 1.0 } };
        assert_eq!(refused(&|p| p.sizes = vec![far]), "boxes.sizes");
    }
}
