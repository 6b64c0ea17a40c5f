//! The linear tetrahedron: signed volume, gradients of the shape functions, and how both change with the nodes.
//!
//! With vertices `x_0 … x_3`, `V = (x_1 − x_0) · (x_2 − x_0) × (x_3 − x_0) / 6` is positive for right-handed node
//! order, and the shape function `N_a` has the constant gradient `∇N_a = −n_a / (3 V)`, `n_a` the outward area vector
//! of the face opposite node `a`. When node `k` moves along direction `d` (Zienkiewicz, The Finite Element Method,
//! ch. 9, differentiated once more):
//!
//! `δ(∂_i N_a) = −∂_i N_k ∂_d N_a`,  `δV = V ∂_d N_k`.

/// A point or vector in space [m].
pub type Point = [f64; 3];

/// `a + b`.
#[inline]
pub fn add(a: Point, b: Point) -> Point {
    [a[0] + b[0], a[1] + b[1], a[2] + b[2]]
}

/// `a − b`.
#[inline]
pub fn sub(a: Point, b: Point) -> Point {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

/// `a · b`.
#[inline]
pub fn dot(a: Point, b: Point) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// `a × b`.
#[inline]
pub fn cross(a: Point, b: Point) -> Point {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

/// `|a|`.
#[inline]
pub fn norm(a: Point) -> f64 {
    dot(a, a).sqrt()
}

/// Local node numbers of the face opposite each node, ordered so that the area vector points out of the tet.
pub const FACES: [[usize; 3]; 4] = [[1, 2, 3], [0, 3, 2], [0, 1, 3], [0, 2, 1]];

/// Local node numbers of the six edges.
pub const EDGES: [[usize; 2]; 6] = [[0, 1], [0, 2], [0, 3], [1, 2], [1, 3], [2, 3]];

/// Volume and shape-function gradients of one linear tetrahedron.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Tet4 {
    /// Signed volume `V` [m³].
    pub volume: f64,
    /// `∇N_a` [1/m], row = node, column = direction; constant on the element.
    pub gradients: [Point; 4],
}

impl Tet4 {
    /// Gradients and volume from the four vertices [m].
    ///
    /// A flat tetrahedron yields infinite or undefined gradients: meshes are checked before they get here.
    #[inline]
    pub fn new(vertices: [Point; 4]) -> Self {
        let [x0, x1, x2, x3] = vertices;
        let (e1, e2, e3) = (sub(x1, x0), sub(x2, x0), sub(x3, x0));
        let n1 = cross(e2, e3);
        let n2 = cross(e3, e1);
        let n3 = cross(e1, e2);
        let determinant = dot(e1, n1);
        let inverse = 1.0 / determinant;
        let g = |n: Point| [n[0] * inverse, n[1] * inverse, n[2] * inverse];
        let (g1, g2, g3) = (g(n1), g(n2), g(n3));
        let g0 = [-(g1[0] + g2[0] + g3[0]), -(g1[1] + g2[1] + g3[1]), -(g1[2] + g2[2] + g3[2])];
        Self { volume: determinant / 6.0, gradients: [g0, g1, g2, g3] }
    }
}

/// Signed volume [m³]: positive for right-handed node order.
#[inline]
pub fn volume(vertices: [Point; 4]) -> f64 {
    let [x0, x1, x2, x3] = vertices;
    dot(sub(x1, x0), cross(sub(x2, x0), sub(x3, x0))) / 6.0
}

/// Area vector of a triangle [m²]: normal by the right-hand rule, length = area.
#[inline]
pub fn area_vector(vertices: [Point; 3]) -> Point {
    let n = cross(sub(vertices[1], vertices[0]), sub(vertices[2], vertices[0]));
    [0.5 * n[0], 0.5 * n[1], 0.5 * n[2]]
}

/// The point of a tetrahedron with these barycentric coordinates [m].
#[inline]
pub fn point_at(vertices: &[Point; 4], lambda: &[f64; 4]) -> Point {
    std::array::from_fn(|d| (0..4).map(|a| lambda[a] * vertices[a][d]).sum())
}

/// Barycentric coordinates of a point in the plane of a triangle, by sub-areas.
pub fn barycentric(triangle: &[Point; 3], point: Point) -> Point {
    let normal = area_vector(*triangle);
    std::array::from_fn(|k| {
        let edge = sub(triangle[(k + 2) % 3], triangle[(k + 1) % 3]);
        0.5 * dot(cross(edge, sub(point, triangle[(k + 1) % 3])), normal) / dot(normal, normal)
    })
}

/// Centroid of a set of vertices [m].
#[inline]
pub fn centroid<const N: usize>(vertices: [Point; N]) -> Point {
    let mut c = [0.0; 3];
    for v in vertices {
        for d in 0..3 {
            c[d] += v[d] / N as f64;
        }
    }
    c
}

#[cfg(test)]
mod tests {
    use super::*;

    const SKEW: [Point; 4] = [[0.1, 0.2, -0.1], [1.3, 0.1, 0.2], [0.3, 0.9, 0.1], [0.2, 0.3, 1.4]];

    #[test]
    fn unit_tetrahedron_has_volume_one_sixth_and_unit_gradients() {
        let tet = Tet4::new([[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]);
        assert_eq!(tet.volume, 1.0 / 6.0);
        assert_eq!(tet.gradients, [[-1.0, -1.0, -1.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]);
    }

    #[test]
    fn gradients_are_dual_to_the_edges() {
        let tet = Tet4::new(SKEW);
        for a in 0..4 {
            for [b, c] in EDGES {
                let difference = dot(tet.gradients[a], sub(SKEW[c], SKEW[b]));
                let expected = f64::from(u8::from(a == c)) - f64::from(u8::from(a == b));
                assert!((difference - expected).abs() < 1e-14);
            }
        }
    }

    #[test]
    fn faces_point_outwards() {
        for (opposite, face) in FACES.iter().enumerate() {
            let normal = area_vector(face.map(|v| SKEW[v]));
            assert!(dot(normal, sub(SKEW[opposite], SKEW[face[0]])) < 0.0);
        }
    }

    #[test]
    fn derivatives_with_respect_to_nodes_match_central_differences() {
        let tet = Tet4::new(SKEW);
        let h = 1e-6;
        for k in 0..4 {
            for d in 0..3 {
                let moved = |s: f64| {
                    let mut vertices = SKEW;
                    vertices[k][d] += s;
                    Tet4::new(vertices)
                };
                let (plus, minus) = (moved(h), moved(-h));
                let dv = (plus.volume - minus.volume) / (2.0 * h);
                assert!((dv - tet.volume * tet.gradients[k][d]).abs() < 1e-9);
                for a in 0..4 {
                    for i in 0..3 {
                        let dg = (plus.gradients[a][i] - minus.gradients[a][i]) / (2.0 * h);
                        let exact = -tet.gradients[k][i] * tet.gradients[a][d];
                        assert!((dg - exact).abs() < 1e-8, "{dg} against {exact}");
                    }
                }
            }
        }
    }
}
