//! An octant of a ball, solid or hollow, in a larger ball: the sphere of the closed forms.
//!
//! The core is a cube of `n³` cells whose shells `max(i, j, k) = m` are mapped to spheres; beyond the core the three
//! outer faces of the cube go on as radial layers of `3 n²` cells. A cell is cut into the six monotone paths from its
//! lowest to its highest corner (Kuhn 1960), in the core along (x, y, z), in a layer along (radius, and the two axes
//! of its face); on a face between two cells both rules draw the same diagonal, because each runs from the corner
//! with the lower indices to the one with the higher. Every node is on a sphere, every tetrahedron has a face on one.
//!
//! Numbers and places of the nodes are in `sphere_nodes`.

use std::f64::consts::FRAC_PI_4;
use std::sync::Arc;

use crate::error::MeshError;
use crate::generate::grading::{self, LINES_LIMIT, Skin};
use crate::generate::grid::{PATHS, TETS_PER_CELL, check_tets};
use crate::generate::sphere_nodes::Numbering;
use crate::ids::{NodeId, RegionId};
use crate::mesh::Mesh;
use crate::tet4::{self, Point};
use crate::topology::Topology;

/// Radii and layers of the sphere.
#[derive(Clone, Debug, PartialEq)]
pub struct SphereParameters {
    /// Outer radius of the sphere [m].
    pub radius: f64,
    /// Radius of the cavity of a hollow sphere [m].
    pub inner_radius: Option<f64>,
    /// Radius of the whole mesh [m]; five radii leave 1 % of a dipole's field.
    pub outer_radius: f64,
    /// Cells along an eighth of a great circle, and along the radius of the core.
    pub divisions: usize,
    /// Depths of layers under the surface [m], ascending; of a hollow sphere under both surfaces. Empty: none.
    pub skin: Vec<f64>,
    /// Equal layers of the wall of a hollow sphere without `skin`.
    pub wall_layers: usize,
    /// Thickness of the first layer outside [m]; `None`: the length of the surface's cells.
    pub air_layer: Option<f64>,
    /// Ratio of neighbouring layers outside, at least 1; far out they grow as their cells do.
    pub growth: f64,
    /// Divisions are multiplied and layers divided by it; the growth ratio becomes its root.
    pub refinement: f64,
}

impl Default for SphereParameters {
    fn default() -> Self {
        Self {
            radius: 0.05,
            inner_radius: None,
            outer_radius: 0.25,
            divisions: 10,
            skin: Vec::new(),
            wall_layers: 4,
            air_layer: None,
            growth: 1.3,
            refinement: 1.0,
        }
    }
}

const AIR: RegionId = RegionId(0);
const SPHERE: RegionId = RegionId(1);
const CAVITY: RegionId = RegionId(2);

/// Largest thickness of a layer outside over the length of its cells: thicker ones would have a quality below 0.1.
const THICKEST: f64 = 3.5;

/// The mesh of a sphere: the octant `x, y, z ≥ 0`.
///
/// Regions: `air`, `sphere`, and `cavity` of a hollow one. Surfaces: `x_min`, `y_min`, `z_min` (the symmetry planes) and
/// `outer`, oriented outwards; `sphere` and, of a hollow one, `cavity`, oriented out of the region `sphere`.
///
/// # Errors
/// [`MeshError::Parameter`] names the parameter (`sphere.…`).
pub fn sphere(parameters: &SphereParameters) -> Result<Mesh, MeshError> {
    let (n, radii) = shells(parameters)?;
    let numbering = Numbering { n };
    let (mut tets, mut region_of) = (Vec::new(), Vec::new());
    let mut cell = |corner: &dyn Fn([usize; 3]) -> NodeId, region| {
        tets.extend(PATHS.map(|path| kuhn(path, corner)));
        region_of.extend([region; TETS_PER_CELL]);
    };
    let region_within = |outer: f64| match parameters.inner_radius {
        Some(inner) if outer <= inner => CAVITY,
        _ if outer <= parameters.radius => SPHERE,
        _ => AIR,
    };
    for i in 0..n {
        for j in 0..n {
            for k in 0..n {
                let region = region_within(radii[i.max(j).max(k) + 1]);
                cell(&|[a, b, c]| numbering.core([i + a, j + b, k + c]), region);
            }
        }
    }
    for layer in n..radii.len() - 1 {
        let region = region_within(radii[layer + 1]);
        for axis in 0..3 {
            for j in 0..n {
                for k in 0..n {
                    cell(&|[a, b, c]| numbering.layer(layer + a, on_face(axis, n, j + b, k + c)), region);
                }
            }
        }
    }
    let points = numbering.points(&radii);
    for tet in &mut tets {
        // Half of the paths are left-handed.
        if tet4::volume(tet.map(|node| points[node.index()])) < 0.0 {
            tet.swap(1, 2);
        }
    }
    let mut names = vec!["air".to_owned(), "sphere".to_owned()];
    names.extend(parameters.inner_radius.map(|_| "cavity".to_owned()));
    let topology = with_surfaces(Topology::new(points.len(), tets, names, region_of)?, &points)?;
    Mesh::new(Arc::new(topology), points)
}

impl SphereParameters {
    /// Tetrahedra of the mesh, which is not made.
    ///
    /// # Errors
    /// As [`sphere`].
    pub fn tet_count(&self) -> Result<usize, MeshError> {
        let (n, radii) = shells(self)?;
        Ok(TETS_PER_CELL * cells(n, &radii).iter().product::<usize>())
    }
}

/// Cells along the radius of the core, and the radii of all shells [m].
fn shells(parameters: &SphereParameters) -> Result<(usize, Vec<f64>), MeshError> {
    check(parameters)?;
    let n = ((parameters.divisions as f64 * parameters.refinement).round() as usize).max(1);
    let radii = radii(parameters, n)?;
    let value = format!("{n} with {} layers", radii.len() - 1 - n);
    check_tets("sphere.divisions", cells(n, &radii), [&value, "fewer divisions"])?;
    Ok((n, radii))
}

/// The cells as those of a box: the three faces of the cube go on in layers.
fn cells(n: usize, radii: &[f64]) -> [usize; 3] {
    [n, n, (radii.len() - 1 - n).saturating_mul(3).saturating_add(n)]
}

/// The point of a face of the cube that is `n` along its axis; the other two follow in cyclic order.
fn on_face(axis: usize, n: usize, j: usize, k: usize) -> [usize; 3] {
    let mut index = [0; 3];
    (index[axis], index[(axis + 1) % 3], index[(axis + 2) % 3]) = (n, j, k);
    index
}

/// The tetrahedron of a path through the corners of a cell.
fn kuhn(path: [usize; 3], corner: &dyn Fn([usize; 3]) -> NodeId) -> [NodeId; 4] {
    let mut at = [0; 3];
    let mut tet = [corner(at); 4];
    for (step, axis) in path.into_iter().enumerate() {
        at[axis] = 1;
        tet[step + 1] = corner(at);
    }
    tet
}

/// Radii of all shells, from the centre to the outside [m]; the first `n + 1` are those of the core.
fn radii(p: &SphereParameters, n: usize) -> Result<Vec<f64>, MeshError> {
    const SKIN: &str = "sphere.skin";
    let parts = (p.refinement.round() as usize).max(1);
    let wall = match (p.inner_radius, p.skin.last()) {
        (Some(inner), Some(_)) => {
            let lines = grading::skin(SKIN, [inner, p.radius], Skin::AtBothEnds, &p.skin)?;
            grading::subdivide(&lines, parts)
        }
        (Some(inner), None) => {
            let layers = (p.wall_layers as f64 * p.refinement).round().max(1.0);
            grading::equal_parts([inner, p.radius], layers as usize)
        }
        (None, Some(_)) => {
            let lines = grading::skin(SKIN, [0.0, p.radius], Skin::AtEnd, &p.skin)?;
            grading::subdivide(&lines[1..], parts)
        }
        (None, None) => vec![p.radius],
    };
    let mut radii = grading::equal_parts([0.0, wall[0]], n);
    radii.extend(&wall[1..]);
    radii.extend(air_radii(p, n)?);
    Ok(radii)
}

/// Radii of the shells outside the sphere, without its own [m].
///
/// Layers grow by the ratio, but stay below [`THICKEST`] times the length of their cells; then all are stretched by one
/// factor to end on the outer radius.
fn air_radii(p: &SphereParameters, n: usize) -> Result<Vec<f64>, MeshError> {
    let angle = FRAC_PI_4 / n as f64;
    let growth = p.growth.powf(1.0 / p.refinement);
    let room = p.outer_radius - p.radius;
    let mut layer = p.air_layer.map_or(p.radius * angle, |layer| layer / p.refinement);
    let mut reached = Vec::new();
    let mut sum = 0.0;
    // The layer that would leave less than half of itself inside is not begun.
    while reached.is_empty() || room - sum > 0.5 * layer {
        if reached.len() == LINES_LIMIT {
            let expected = format!("at most {LINES_LIMIT} layers are made; use thicker ones");
            return Err(MeshError::parameter("sphere.air_layer", format!("{layer} m"), expected));
        }
        sum += layer;
        reached.push(sum);
        layer = (layer * growth).min(THICKEST * angle * (p.radius + sum));
    }
    reached.pop();
    let mut radii: Vec<f64> = reached.iter().map(|r| p.radius + room * (r / sum)).collect();
    radii.push(p.outer_radius);
    Ok(radii)
}

fn check(p: &SphereParameters) -> Result<(), MeshError> {
    let positive = |value: f64| value > 0.0 && value.is_finite();
    if !positive(p.radius) {
        return Err(MeshError::parameter("sphere.radius", format!("{} m", p.radius), "a positive radius"));
    }
    if let Some(inner) = p.inner_radius.filter(|&inner| !(positive(inner) && inner < p.radius)) {
        let expected = format!("a positive radius below that of the sphere, {} m", p.radius);
        return Err(MeshError::parameter("sphere.inner_radius", format!("{inner} m"), expected));
    }
    if !(p.outer_radius.is_finite() && p.outer_radius > p.radius) {
        let expected = format!("a radius beyond that of the sphere, {} m", p.radius);
        return Err(MeshError::parameter("sphere.outer_radius", format!("{} m", p.outer_radius), expected));
    }
    if p.divisions == 0 {
        return Err(MeshError::parameter("sphere.divisions", 0, "at least one cell"));
    }
    if p.wall_layers == 0 {
        return Err(MeshError::parameter("sphere.wall_layers", 0, "at least one layer"));
    }
    if let Some(layer) = p.air_layer.filter(|&layer| !positive(layer)) {
        return Err(MeshError::parameter("sphere.air_layer", format!("{layer} m"), "a positive thickness"));
    }
    if !(p.growth >= 1.0 && p.growth.is_finite()) {
        return Err(MeshError::parameter("sphere.growth", p.growth, "a finite ratio of at least 1"));
    }
    if !positive(p.refinement) {
        return Err(MeshError::parameter("sphere.refinement", p.refinement, "a positive number"));
    }
    Ok(())
}

/// Names the symmetry planes, the outside, and the faces of the region `sphere`.
fn with_surfaces(topology: Topology, points: &[Point]) -> Result<Topology, MeshError> {
    let mut named: [(&str, Vec<[NodeId; 3]>); 6] =
        ["x_min", "y_min", "z_min", "outer", "sphere", "cavity"].map(|name| (name, Vec::new()));
    let region_at = |e: crate::ids::ElementId| topology.region_of()[e.index()];
    for facet in topology.facets() {
        let [a, b, c] = facet.nodes;
        match facet.outside {
            None => {
                let plane = (0..3).find(|&d| facet.nodes.iter().all(|node| points[node.index()][d] == 0.0));
                named[plane.unwrap_or(3)].1.push([a, b, c]);
            }
            Some(outside) => {
                let (inside, outside) = (region_at(facet.inside), region_at(outside));
                let triangle = if inside == SPHERE { [a, b, c] } else { [a, c, b] };
                let surface = if inside == CAVITY || outside == CAVITY { 5 } else { 4 };
                named[surface].1.push(triangle);
            }
        }
    }
    let hollow = topology.region_names().len() > CAVITY.index();
    let mut topology = topology;
    for (name, triangles) in named {
        if name != "cavity" || hollow {
            topology = topology.with_surface(name, triangles)?;
        }
    }
    Ok(topology)
}

#[cfg(test)]
mod tests {
    use std::f64::consts::PI;

    use super::*;
    use crate::generate::measures::{area, volume};
    use crate::quality::QualityReport;

    fn thin_skinned() -> SphereParameters {
        SphereParameters {
            radius: 0.01,
            outer_radius: 0.06,
            divisions: 8,
            skin: vec![0.2e-3, 0.5e-3, 1e-3, 2e-3],
            air_layer: Some(0.4e-3),
            growth: 1.5,
            ..SphereParameters::default()
        }
    }

    fn hollow() -> SphereParameters {
        SphereParameters {
            radius: 0.055,
            inner_radius: Some(0.05),
            wall_layers: 3,
            ..SphereParameters::default()
        }
    }

    #[test]
    fn volumes_converge_with_the_second_order() {
        let errors: Vec<f64> = [4, 8, 16]
            .into_iter()
            .map(|divisions| {
                let mesh = sphere(&SphereParameters { divisions, ..hollow() }).expect("valid");
                let octant = |r: f64| PI / 6.0 * r.powi(3);
                let error = |found: f64, exact: f64| (1.0 - found / exact).abs();
                error(volume(&mesh, "cavity"), octant(0.05))
                    .max(error(volume(&mesh, "sphere"), octant(0.055) - octant(0.05)))
                    .max(error(volume(&mesh, "air"), octant(0.25) - octant(0.055)))
            })
            .collect();
        for pair in errors.windows(2) {
            let order = (pair[0] / pair[1]).log2();
            assert!((order - 2.0).abs() < 0.1, "{errors:?}");
        }
        assert!(errors[2] < 1.5e-3, "{errors:?}");
    }

    #[test]
    fn the_surfaces_close_and_lie_on_their_spheres() {
        for parameters in [SphereParameters::default(), thin_skinned(), hollow()] {
            let mesh = sphere(&parameters).expect("valid");
            let topology = mesh.topology();
            // A T-junction would leave outside faces in the interior.
            let outside = topology.outer_facets().count();
            let named: usize = ["x_min", "y_min", "z_min", "outer"]
                .into_iter()
                .map(|name| topology.surface(name).expect("it has it").len())
                .sum();
            assert_eq!(named, outside);
            let sum = ["x_min", "y_min", "z_min", "outer"].into_iter().fold([0.0; 3], |sum, name| {
                let a = area(&mesh, name);
                [0, 1, 2].map(|d| sum[d] + a[d])
            });
            let scale = parameters.outer_radius.powi(2);
            assert!(sum.iter().all(|s| s.abs() < 1e-12 * scale), "{sum:?}");
            let mut spheres = vec![("sphere", parameters.radius), ("outer", parameters.outer_radius)];
            spheres.extend(parameters.inner_radius.map(|inner| ("cavity", inner)));
            for (name, radius) in spheres {
                for node in topology.surface(name).expect("it has it").iter().flatten() {
                    let p = mesh.point(*node);
                    assert!((tet4::dot(p, p).sqrt() / radius - 1.0).abs() < 1e-14, "{name}");
                }
                // The area vector of an octant of a sphere is that of three flat quarter circles.
                let sign = if name == "cavity" { -1.0 } else { 1.0 };
                for component in area(&mesh, name) {
                    let exact = sign * PI / 4.0 * radius * radius;
                    assert!((component / exact - 1.0).abs() < 0.01, "{name}: {component} {exact}");
                }
            }
        }
    }

    #[test]
    fn no_tetrahedron_is_a_sliver() {
        for parameters in [
            SphereParameters::default(),
            // Layers of 0.2 mm on triangles of 1 mm.
            thin_skinned(),
            hollow(),
            SphereParameters { divisions: 1, growth: 2.0, ..SphereParameters::default() },
            SphereParameters { divisions: 12, growth: 3.0, ..thin_skinned() },
        ] {
            let report = QualityReport::of_mesh(&sphere(&parameters).expect("valid")).expect("not empty");
            assert!(report.worst >= 0.1, "{parameters:?}: {report:?}");
        }
    }

    #[test]
    fn refinement_divides_every_direction() {
        let coarse = sphere(&thin_skinned()).expect("valid").topology().tets().len();
        let fine = sphere(&SphereParameters { refinement: 2.0, ..thin_skinned() }).expect("valid");
        let ratio = fine.topology().tets().len() as f64 / coarse as f64;
        assert!((7.0..9.0).contains(&ratio), "{ratio}");
    }

    #[test]
    fn what_makes_no_sphere_is_refused_by_name() {
        let refused = |change: &dyn Fn(&mut SphereParameters)| {
            let mut parameters = hollow();
            change(&mut parameters);
            match sphere(&parameters) {
                Err(MeshError::Parameter { parameter, .. }) => parameter,
                other => panic!("{other:?}"),
            }
        };
        assert_eq!(refused(&|p| p.radius = f64::NAN), "sphere.radius");
        assert_eq!(refused(&|p| p.inner_radius = Some(0.06)), "sphere.inner_radius");
        assert_eq!(refused(&|p| p.outer_radius = 0.05), "sphere.outer_radius");
        assert_eq!(refused(&|p| p.divisions = 0), "sphere.divisions");
        assert_eq!(refused(&|p| p.divisions = 10_000), "sphere.divisions");
        assert_eq!(refused(&|p| p.skin = vec![0.003]), "sphere.skin");
        assert_eq!(refused(&|p| p.wall_layers = 0), "sphere.wall_layers");
        assert_eq!(refused(&|p| p.air_layer = Some(0.0)), "sphere.air_layer");
        let countless = |p: &mut SphereParameters| (p.air_layer, p.growth) = (Some(1e-12), 1.0);
        assert_eq!(refused(&countless), "sphere.air_layer");
        assert_eq!(refused(&|p| p.growth = 0.5), "sphere.growth");
        assert_eq!(refused(&|p| p.refinement = f64::NAN), "sphere.refinement");
    }
}
