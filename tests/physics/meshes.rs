//! Boxes of Kuhn tetrahedra with distorted nodes.

use fluxmorph_geometry::generate::Grid;
use fluxmorph_geometry::tet4::Point;
use fluxmorph_geometry::{Mesh, RegionId};

/// The six outer faces of a grid.
pub(crate) const FACES: [&str; 6] = ["x_min", "x_max", "y_min", "y_max", "z_min", "z_max"];

/// A mesh of three sets of lines [m] and its regions.
pub(crate) fn boxed(lines: [Vec<f64>; 3], regions: &[&str], paint: impl Fn(Point) -> u32) -> (Grid, Mesh) {
    let grid = Grid::new("mesh", lines).expect("ascending lines");
    let mesh = grid.mesh(regions, |centre| RegionId(paint(centre))).expect("a grid conforms");
    (grid, mesh)
}

/// The unit cube in `n` cells a side.
pub(crate) fn unit_cube(n: usize, regions: &[&str], paint: impl Fn(Point) -> u32) -> Mesh {
    let line: Vec<f64> = (0..=n).map(|i| i as f64 / n as f64).collect();
    boxed([line.clone(), line.clone(), line], regions, paint).1
}

/// The mesh with every node displaced by pseudo-random amounts up to `amplitude(point)` [m] in each direction.
pub(crate) fn shaken(mesh: &Mesh, amplitude: impl Fn(Point) -> Point) -> Mesh {
    let mut state = 7u64;
    let mut noise = move || {
        // splitmix64
        state = state.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = state;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        (z ^ (z >> 31)) as f64 / u64::MAX as f64 * 2.0 - 1.0
    };
    let displacement: Vec<Point> = mesh.points().iter().map(|&p| amplitude(p).map(|a| a * noise())).collect();
    mesh.moved(&displacement).expect("a small shake inverts nothing")
}

/// How the nodes of the unit cube leave their grid; all faces, and the plane z = 1/2, stay flat.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Distortion {
    /// By up to an eighth of a cell in each direction, at random.
    Random,
    /// By a smooth map.
    Smooth,
}

impl Distortion {
    /// A distorted copy of the unit cube in `n` cells a side.
    pub(crate) fn apply(self, mesh: &Mesh, n: usize) -> Mesh {
        let held = |p: Point, d: usize| {
            let near = |c: f64| (p[d] - c).abs() < 1e-9;
            near(0.0) || near(1.0) || (d == 2 && near(0.5))
        };
        match self {
            Self::Random => {
                shaken(mesh, |p| [0, 1, 2].map(|d| if held(p, d) { 0.0 } else { 0.125 / n as f64 }))
            }
            Self::Smooth => {
                let wave = |t: f64| (2.0 * std::f64::consts::PI * t).sin();
                let displacement: Vec<Point> = mesh
                    .points()
                    .iter()
                    .map(|&[x, y, z]| {
                        [
                            0.05 * wave(x) * (1.0 + y - z),
                            0.05 * wave(y) * (1.0 - x + z),
                            0.04 * wave(z) * (1.0 + x - y),
                        ]
                    })
                    .collect();
                mesh.moved(&displacement).expect("the map is one to one")
            }
        }
    }
}
