//! Numbers and places of the nodes of a ball's octant: a cube of `n³` cells mapped to spheres, and layers around it.
//!
//! Directions are equal angles on each face of the cube: the point `(n, j, k)` looks along
//! `(1, tan(π j/4n), tan(π k/4n))`. So nodes on the symmetry planes have the coordinate zero exactly.

use std::f64::consts::FRAC_PI_4;

use crate::ids::NodeId;
use crate::tet4::{self, Point};

/// Numbers of the nodes: first the core, then layer by layer the surface of the cube.
pub(super) struct Numbering {
    /// Cells along the radius of the core.
    pub(super) n: usize,
}

impl Numbering {
    /// Node of the core.
    pub(super) fn core(&self, [i, j, k]: [usize; 3]) -> NodeId {
        let m = self.n + 1;
        NodeId::new((i * m + j) * m + k)
    }

    /// Nodes of a shell: `(n + 1)³ − n³`.
    fn shell_size(&self) -> usize {
        (self.n + 1).pow(3) - self.n.pow(3)
    }

    /// Node of a shell at or beyond the core, at a point of the surface of the cube.
    pub(super) fn layer(&self, shell: usize, index: [usize; 3]) -> NodeId {
        if shell == self.n {
            return self.core(index);
        }
        NodeId::new((self.n + 1).pow(3) + (shell - self.n - 1) * self.shell_size() + self.place(index))
    }

    /// Number of a point among those of the cube's surface: the face x = n, then what is left of y = n, then of z = n.
    fn place(&self, [i, j, k]: [usize; 3]) -> usize {
        let (n, m) = (self.n, self.n + 1);
        if i == n {
            j * m + k
        } else if j == n {
            m * m + i * m + k
        } else {
            m * m + n * m + i * n + j
        }
    }

    /// Points of the cube's surface, by [`Numbering::place`].
    fn surface(&self) -> Vec<[usize; 3]> {
        let n = self.n;
        let mut points = Vec::with_capacity(self.shell_size());
        points.extend((0..=n).flat_map(|j| (0..=n).map(move |k| [n, j, k])));
        points.extend((0..n).flat_map(|i| (0..=n).map(move |k| [i, n, k])));
        points.extend((0..n).flat_map(|i| (0..n).map(move |j| [i, j, n])));
        points
    }

    /// Coordinates of all nodes [m].
    pub(super) fn points(&self, radii: &[f64]) -> Vec<Point> {
        let n = self.n;
        let mut points = Vec::new();
        for i in 0..=n {
            for j in 0..=n {
                points.extend((0..=n).map(|k| {
                    let shell = i.max(j).max(k);
                    direction([i, j, k], shell).map(|c| radii[shell] * c)
                }));
            }
        }
        let directions: Vec<Point> = self.surface().iter().map(|&index| direction(index, n)).collect();
        for radius in &radii[n + 1..] {
            points.extend(directions.iter().map(|direction| direction.map(|c| radius * c)));
        }
        points
    }
}

/// Unit vector of a point on the shell `max(i, j, k) = m` of the cube; zero of the centre.
fn direction(index: [usize; 3], m: usize) -> Point {
    if m == 0 {
        return [0.0; 3];
    }
    // The tangent of 45° is one: without the case it is one less than a bit below.
    let raw = index.map(|i| if i == m { 1.0 } else { (FRAC_PI_4 * i as f64 / m as f64).tan() });
    let length = tet4::dot(raw, raw).sqrt();
    raw.map(|c| c / length)
}
