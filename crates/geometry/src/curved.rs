//! Curved surfaces that a mesh has as facets: how far these are off them, and where they would lie on them in the mean.
//!
//! A surface is taken from its facets alone: with the mean normals `n` of the smooth surface at the ends of an edge `e`, its
//! middle lies `s = (n_b − n_a)·e/8` over the edge, exactly so of a circle (`L²/(8R)`). Over a triangle with its nodes on the
//! surface this is a quadratic function, whose mean is a third of the sum over its edges. Facets between the same regions are one
//! smooth surface where they meet at less than [`SMOOTH`]; edges flatter than [`FLAT`] lie in a plane.
//!
//! Does not live here: which surfaces matter, and what their facets do to a field.

use std::collections::BTreeMap;

use crate::ids::{NodeId, RegionId};
use crate::tet4::{Point, area_vector, cross, dot, norm, sub};
use crate::topology::{Facet, Topology};

/// Cosine of the largest angle, 35°, at which two facets are taken for one curved surface: a ball with eight of them along a half
/// circle, and no chamfer of 45°.
const SMOOTH: f64 = 0.82;

/// Share of an edge's length below which its middle is taken to lie on the surface: planes of a mesh file with few digits.
const FLAT: f64 = 1e-5;

/// What a condition on the motion of a node counts at least, of a condition whose normal no other one shares. Normals of one surface
/// that differ by the rounding of a file are one condition, and edges of 35° and more are kept to a few hundredths of the motion.
const SHARED: f64 = 0.01;

/// Surfaces of a mesh, curved and flat ones.
#[derive(Debug)]
pub struct CurvedSurfaces<'a> {
    points: &'a [Point],
    faces: Vec<Face>,
    /// The faces at a node.
    around: BTreeMap<NodeId, Vec<usize>>,
}

/// A face between two regions, or at the outside of one.
#[derive(Debug)]
struct Face {
    nodes: [NodeId; 3],
    between: (RegionId, Option<RegionId>),
    /// Out of the region with the lower number.
    area: Point,
}

/// The edge of a surface that is farthest off it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Farthest {
    /// The regions on both sides; the second is missing at the outside.
    pub between: (RegionId, Option<RegionId>),
    /// Ends of the edge.
    pub ends: [NodeId; 2],
    /// Distance of its middle from the surface [m].
    pub off: f64,
}

impl<'a> CurvedSurfaces<'a> {
    /// The surfaces that count, by the regions on both sides, of a mesh with these nodes [m], which may be too moved for its elements.
    pub fn new(
        topology: &Topology,
        points: &'a [Point],
        counts: impl Fn(RegionId, Option<RegionId>) -> bool,
    ) -> Self {
        let region = |e: crate::ElementId| topology.region_of()[e.index()];
        let of = |facet: &Facet| {
            let nodes = facet.nodes;
            let area = area_vector(nodes.map(|n| points[n.index()]));
            let (between, area) = match (region(facet.inside), facet.outside.map(region)) {
                // One direction for both orders of the regions.
                (own, Some(other)) if own > other => ((other, Some(own)), area.map(|c| -c)),
                between => (between, area),
            };
            (Some(between.0) != between.1 && counts(between.0, between.1)).then_some(Face {
                nodes,
                between,
                area,
            })
        };
        let faces: Vec<Face> = topology.facets().iter().filter_map(of).collect();
        let mut around: BTreeMap<NodeId, Vec<usize>> = BTreeMap::new();
        for (i, face) in faces.iter().enumerate() {
            face.nodes.iter().for_each(|&n| around.entry(n).or_default().push(i));
        }
        Self { points, faces, around }
    }

    /// The edge that is farthest off the surface that its facets stand for, at the outside only where nothing inside is curved;
    /// `None` where nothing is.
    pub fn farthest(&self) -> Option<Farthest> {
        let mut worst: Option<((bool, f64), Farthest)> = None;
        for face in &self.faces {
            for (ends, height) in self.heights(face) {
                let (off, between) = (height.abs(), face.between);
                let rank = (between.1.is_some(), off);
                if off > 0.0 && worst.is_none_or(|(most, _)| rank > most) {
                    worst = Some((rank, Farthest { between, ends, off }));
                }
            }
        }
        worst.map(|(_, farthest)| farthest)
    }

    /// The motion of every node [m] after which facets lie on their surfaces in the mean, so that bodies have the volume that these
    /// enclose: along the normals of curved surfaces, along flat ones, and within planes at the outside.
    pub fn onto_surfaces(&self) -> Vec<Point> {
        let mean = |face: &Face| self.heights(face).iter().map(|(_, height)| height / 3.0).sum::<f64>();
        let means: Vec<f64> = self.faces.iter().map(mean).collect();
        let mut motion = vec![[0.0; 3]; self.points.len()];
        for (node, own) in &self.around {
            motion[node.index()] = self.motion_of_node(own, &means);
        }
        motion
    }

    /// The shortest motion [m] of a node with these faces that has the mean height of each of its smooth surfaces along its normal.
    fn motion_of_node(&self, own: &[usize], means: &[f64]) -> Point {
        if own.iter().all(|&i| means[i] == 0.0) {
            return [0.0; 3];
        }
        let mut left: Vec<usize> = own.to_vec();
        let mut conditions: Vec<(Point, f64)> = Vec::new();
        let mut planes: Vec<Point> = Vec::new();
        while let Some(&first) = left.first() {
            let (surface, others) = left.iter().partition(|&&i| self.faces[first].continues(&self.faces[i]));
            left = others;
            let surface: Vec<usize> = surface;
            let weighted = surface.iter().map(|&i| (norm(self.faces[i].area), means[i]));
            let (area, volume) = weighted.fold((0.0, 0.0), |(a, v), (own, mean)| (a + own, v + own * mean));
            let sum = sum(surface.iter().map(|&i| self.faces[i].area));
            let normal = sum.map(|c| c / norm(sum));
            let is_plane = surface.iter().all(|&i| means[i] == 0.0) && self.faces[first].between.1.is_none();
            if is_plane {
                let rest = within(&planes, normal);
                if norm(rest) > SHARED {
                    planes.push(rest.map(|c| c / norm(rest)));
                }
            }
            conditions.push((normal, volume / area));
        }
        let (mut matrix, mut right) = ([[0.0; 3]; 3], [0.0; 3]);
        for (normal, height) in conditions {
            let normal = within(&planes, normal);
            for d in 0..3 {
                right[d] += height * normal[d];
                (0..3).for_each(|k| matrix[d][k] += normal[d] * normal[k]);
            }
        }
        (0..3).for_each(|d| matrix[d][d] += SHARED);
        within(&planes, solved(matrix, right))
    }

    /// The edges of a face with the heights [m] of the surface over their middles, in the direction of its area.
    fn heights(&self, face: &Face) -> [([NodeId; 2], f64); 3] {
        let [a, b, c] = face.nodes;
        [[a, b], [b, c], [c, a]].map(|ends| {
            let [from, to] = ends.map(|n| self.points[n.index()]);
            let along = sub(to, from);
            let turn = match ends.map(|n| self.is_inner(n, face)) {
                // At a rim there are faces on one side only, such as at a plane of symmetry.
                [false, true] => sub(self.normal(ends[1], face), self.normal_of_edge(ends, face)),
                [true, false] => sub(self.normal_of_edge(ends, face), self.normal(ends[0], face)),
                _ => sub(self.normal(ends[1], face), self.normal(ends[0], face)).map(|c| 0.5 * c),
            };
            let height = dot(turn, along) / 4.0;
            (ends, if height.abs() > FLAT * norm(along) { height } else { 0.0 })
        })
    }

    /// The faces at a node that continue a face.
    fn surface_at(&self, node: NodeId, face: &Face) -> impl Iterator<Item = &Face> {
        self.around[&node].iter().map(|&i| &self.faces[i]).filter(|other| face.continues(other))
    }

    /// Whether the faces that continue a face surround its node.
    fn is_inner(&self, node: NodeId, face: &Face) -> bool {
        let mut ends: Vec<NodeId> = self
            .surface_at(node, face)
            .flat_map(|other| other.nodes)
            .filter(|&other| other != node)
            .collect();
        ends.sort_unstable();
        ends.chunks(2).all(|pair| matches!(pair, [a, b] if a == b))
    }

    /// Normal of the surface at a node.
    fn normal(&self, node: NodeId, face: &Face) -> Point {
        let sum = sum(self.surface_at(node, face).map(|other| other.area));
        sum.map(|c| c / norm(sum))
    }

    /// Mean normal of the surface at both sides of an edge.
    fn normal_of_edge(&self, [a, b]: [NodeId; 2], face: &Face) -> Point {
        let sum =
            sum(self.surface_at(a, face).filter(|other| other.nodes.contains(&b)).map(|other| other.area));
        sum.map(|c| c / norm(sum))
    }
}

impl Face {
    /// Whether two faces belong to one smooth surface.
    fn continues(&self, other: &Self) -> bool {
        self.between == other.between
            && dot(self.area, other.area) > SMOOTH * norm(self.area) * norm(other.area)
    }
}

/// The sum of vectors.
fn sum(vectors: impl Iterator<Item = Point>) -> Point {
    vectors.fold([0.0; 3], |sum, v| std::array::from_fn(|d| sum[d] + v[d]))
}

/// What of a vector is perpendicular to all of some normals, which are so to each other.
fn within(normals: &[Point], vector: Point) -> Point {
    normals.iter().fold(vector, |v, n| {
        let along = dot(v, *n);
        std::array::from_fn(|d| v[d] - along * n[d])
    })
}

/// The solution of a symmetric, positive definite system.
fn solved([a, b, c]: [Point; 3], right: Point) -> Point {
    let determinant = dot(a, cross(b, c));
    [cross(b, c), cross(c, a), cross(a, b)].map(|row| dot(row, right) / determinant)
}

#[cfg(test)]
mod tests {
    use std::f64::consts::PI;

    use super::*;
    use crate::Mesh;
    use crate::generate::{BlockParameters, SphereParameters, block, sphere};
    use crate::tet4::{centroid, volume};

    /// An eighth of a ball of 50 mm in air, with the region of the ball.
    fn ball(divisions: usize) -> (Mesh, RegionId) {
        let parameters = SphereParameters { radius: 0.05, divisions, ..SphereParameters::default() };
        let mesh = sphere(&parameters).expect("a ball");
        let ball = mesh.topology().region("sphere").expect("it has one");
        (mesh, ball)
    }

    /// The surfaces of the ball alone, and the outer planes.
    fn surfaces(mesh: &Mesh) -> CurvedSurfaces<'_> {
        CurvedSurfaces::new(mesh.topology(), mesh.points(), |_, _| true)
    }

    #[test]
    fn the_facets_of_a_ball_are_off_it_by_the_height_of_their_arcs() {
        let (mesh, ball) = ball(6);
        let found = surfaces(&mesh).farthest().expect("it is curved");
        // The outer sphere is the larger one, and only the outside.
        let air = mesh.topology().region("air").expect("it has it");
        let surface = mesh.topology().interface(ball, air);
        assert!([ball, air].contains(&found.between.0) && found.between.1.is_some());
        let edges = surface.iter().flat_map(|&[a, b, c]| [(a, b), (b, c), (c, a)]);
        let middle = |(a, b)| 0.05 - norm(centroid([mesh.point(a), mesh.point(b)]));
        let height = edges.map(middle).fold(0.0, f64::max);
        assert!((found.off / height - 1.0).abs() < 0.1, "{} {height}", found.off);
        let place = centroid(found.ends.map(|n| mesh.point(n)));
        assert!((0.05 - norm(place) - height).abs() < 0.2 * height);
        let flat = block(&BlockParameters { size: [0.1; 3], cells: [3; 3] }).expect("a block");
        assert_eq!(surfaces(&flat).farthest(), None);
        assert!(surfaces(&flat).onto_surfaces().iter().all(|motion| *motion == [0.0; 3]));
    }

    /// Its volume is then that of the ball but for what the next order leaves, a share that falls with the size of the facets; its
    /// planes stay planes.
    #[test]
    fn a_ball_whose_facets_lie_on_it_in_the_mean_has_its_volume() {
        for divisions in [4, 6, 10] {
            let (mesh, ball) = ball(divisions);
            let motion = surfaces(&mesh).onto_surfaces();
            let moved = mesh.moved(&motion).expect("no element turns over");
            let of = |mesh: &Mesh| -> f64 {
                let topology = mesh.topology();
                topology.elements_of(ball).into_iter().map(|e| volume(mesh.vertices(e))).sum()
            };
            let exact = PI / 6.0 * 0.05f64.powi(3);
            let [before, after] = [&mesh, &moved].map(|mesh| of(mesh) / exact - 1.0);
            println!("{divisions}: {before:.5} {after:.5}");
            let share = after.abs() / before.abs();
            assert!(before < 0.0 && share < 0.2 / divisions as f64, "{before} {after}");
            for (point, motion) in mesh.points().iter().zip(&motion) {
                assert!((0..3).all(|d| point[d] > 1e-9 || motion[d].abs() < 1e-15), "{point:?} {motion:?}");
            }
        }
    }
}
