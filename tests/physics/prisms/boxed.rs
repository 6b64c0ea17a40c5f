//! Meshes of prisms by the built-in generator: every polygon with sides along the axes.

use std::sync::Arc;

use fluxmorph_geometry::Mesh;
use fluxmorph_geometry::generate::{BoxRegion, BoxesParameters, boxes};
use fluxmorph_geometry::tet4::Point;

use super::exact::{Kind, Prism};
use super::polygon::{Place, Polygon, SAME};

/// Region of the cells that are no part of the prism.
const OUTSIDE: &str = "outside";

/// Region in which the field is observed.
pub(super) const OBSERVATION: &str = "observation";

/// Sizes of the cells.
#[derive(Clone, Copy, Debug)]
pub(super) struct Cells {
    /// Across the axis [m].
    pub(super) size: f64,
    pub(super) layers: usize,
    /// First cell at the faces of all parts [m]; infinity for no limit.
    pub(super) skin: f64,
    /// Ratio of neighbouring cells beside the skin.
    pub(super) growth: f64,
}

impl Cells {
    /// 100 mm in two layers.
    pub(super) const COARSE: Self = Self { size: 0.1, layers: 2, skin: f64::INFINITY, growth: 1.8 };

    /// 50 mm in two layers.
    pub(super) const FINE: Self = Self { size: 0.05, ..Self::COARSE };
}

/// A prism in cells.
///
/// The first cell at the faces of meshed conductors is a quarter of a skin depth, where the cells say nothing.
pub(super) fn boxed(prism: &Prism, cells: Cells) -> Mesh {
    let size = cells.size;
    let region = |name: &str, shape: &Polygon, skin: f64| {
        let [lower, upper] = shape.bounds();
        assert!(shape.is_rectangle(), "`{name}` is a rectangle");
        BoxRegion {
            name: name.to_owned(),
            corners: [raised(lower, 0.0), raised(upper, prism.height)],
            size: [size, size, f64::INFINITY],
            skin: [skin, skin, f64::INFINITY],
            cells: None,
        }
    };
    let free = f64::INFINITY;
    let mut regions: Vec<BoxRegion> = voids(&prism.outline)
        .iter()
        .map(|[lower, upper]| region(OUTSIDE, &Polygon::rectangle(*lower, *upper), free))
        .collect();
    for part in &prism.parts {
        let skin = match part.kind {
            Kind::Meshed { skin_depth, .. } if cells.skin == free => 0.25 * skin_depth,
            _ => cells.skin,
        };
        regions.push(region(part.name, &part.shape, skin));
    }
    regions.push(region(OBSERVATION, &prism.observation, free));
    let [lower, upper] = prism.outline.bounds();
    let whole = BoxRegion {
        size: [size, size, prism.height / cells.layers as f64],
        ..region(super::AIR, &Polygon::rectangle(lower, upper), free)
    };
    regions.insert(0, whole);
    let parameters = BoxesParameters {
        corners: [raised(lower, 0.0), raised(upper, prism.height)],
        regions,
        sizes: Vec::new(),
        surfaces: Vec::new(),
        growth: cells.growth,
        refinement: 1.0,
        division: None,
    };
    let mesh = boxes(&parameters).expect("boxes within the prism");
    match mesh.topology().region(OUTSIDE) {
        Ok(outside) => mesh.without_region(outside).expect("something is left").0,
        Err(_) => mesh,
    }
}

fn raised([x, y]: Place, z: f64) -> Point {
    [x, y, z]
}

/// The rectangles between the lines of an outline's vertices that are not in it.
fn voids(outline: &Polygon) -> Vec<[Place; 2]> {
    let lines = [0, 1].map(|d| {
        let mut lines: Vec<f64> = outline.vertices().iter().map(|v| v[d]).collect();
        lines.sort_by(f64::total_cmp);
        lines.dedup_by(|a, b| (*a - *b).abs() < SAME);
        lines
    });
    let mut voids = Vec::new();
    for x in lines[0].windows(2) {
        for y in lines[1].windows(2) {
            if !outline.contains([0.5 * (x[0] + x[1]), 0.5 * (y[0] + y[1])]) {
                voids.push([[x[0], y[0]], [x[1], y[1]]]);
            }
        }
    }
    voids
}

/// A mesh with one more surface.
pub(super) fn with_surface(mesh: Mesh, name: &str, triangles: Vec<[fluxmorph_geometry::NodeId; 3]>) -> Mesh {
    let topology = (**mesh.topology()).clone().with_surface(name, triangles).expect("faces of the mesh");
    Mesh::new(Arc::new(topology), mesh.points().to_vec()).expect("the same elements")
}
