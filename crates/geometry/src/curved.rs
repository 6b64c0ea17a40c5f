//! Curved surfaces that a mesh has as facets: how far these are off them, and where they would lie on them in the mean.
//!
//! A surface is taken from its facets alone: with its normals `n` at the ends of an edge `e`, its middle lies `s = (n_b − n_a)·e/8`
//! over the edge, exactly so of a circle (`L²/(8R)`). Over a triangle with its nodes on the surface this is a quadratic function,
//! whose mean is a third of the sum over its edges. The normal at a node is that of the faces around by their angles there, and of
//! their images in the outer planes of the mesh that end them, so that a part of a device has the surfaces of the whole; where there
//! are faces on one side only, it goes on as from the faces behind to them.
//!
//! Facets go on in each other where they meet at less than 42°, whatever the regions behind them, and where one of them has
//! turns at all of its nodes: an edge between two planes with nodes of their own is an edge.
//!
//! Does not live here: which surfaces matter, and what their facets do to a field.

use std::collections::{BTreeMap, BTreeSet};

use crate::ids::{NodeId, RegionId};
use crate::tet4::{Point, add, area_vector, centroid, cross, dot, norm, sub};
use crate::topology::{Facet, Topology, edge_key, triangle_edges};

/// Cosine of the largest angle, 42°, at which two facets are taken for one curved surface: a ball with nine of them along a circle,
/// and no chamfer of 45°.
pub const SMOOTH: f64 = 0.743;

/// Sine of the angle below which two faces are one plane, and share of an edge's length below which its middle is taken to lie on the
/// surface: mesh files with few digits.
const FLAT: f64 = 1e-5;

/// What a condition on the motion of a node counts at least, of a condition whose normal no other one shares. Normals of one surface
/// that differ by the rounding of a file are one condition, and edges of 42° and more are kept to a few hundredths of the motion.
const SHARED: f64 = 0.01;

/// The same of the directions in which normals at a rim change, relative to the area of the facets: rounding is no slope.
const EXTENT: f64 = 1e-4;

/// Share of the spread of normals in one direction above which they turn one way.
const ONE_WAY: f64 = 0.95;

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
    area: Point,
    /// The face that it goes on in, behind the edge from each node to the next one.
    next: [Option<usize>; 3],
    /// The normal of the outer face behind that edge where it goes on in its image there.
    mirror: [Option<Point>; 3],
}

/// A face of a surface, with the direction of another face of it: 1, or −1 where it is the other one.
type Directed = (usize, f64);

/// A face, and the place of one of its edges.
type Side = (usize, usize);

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
            let between = match (region(facet.inside), facet.outside.map(region)) {
                (own, Some(other)) if own > other => (other, Some(own)),
                between => between,
            };
            let is_face = Some(between.0) != between.1 && counts(between.0, between.1) && norm(area) > 0.0;
            is_face.then_some(Face { nodes, between, area, next: [None; 3], mirror: [None; 3] })
        };
        let faces: Vec<Face> = topology.facets().iter().filter_map(of).collect();
        let mut around: BTreeMap<NodeId, Vec<usize>> = BTreeMap::new();
        for (i, face) in faces.iter().enumerate() {
            face.nodes.iter().for_each(|&n| around.entry(n).or_default().push(i));
        }
        let mut surfaces = Self { points, faces, around };
        surfaces.join(topology);
        surfaces
    }

    /// Joins faces that go on in each other, and in their images in outer planes.
    fn join(&mut self, topology: &Topology) {
        let mut at_edge: BTreeMap<[NodeId; 2], Vec<Side>> = BTreeMap::new();
        for (i, face) in self.faces.iter().enumerate() {
            (0..3).for_each(|k| at_edge.entry(edge_key(face.edge(k))).or_default().push((i, k)));
        }
        let mut joints = Vec::new();
        for (ends, sides) in &at_edge {
            let pairs =
                sides.iter().enumerate().flat_map(|(n, a)| sides[n + 1..].iter().map(move |b| (*a, *b)));
            let straightness =
                |&(a, b): &(Side, Side)| -dot(self.across_edge(a.0, *ends), self.across_edge(b.0, *ends));
            let best = pairs.max_by(|a, b| straightness(a).total_cmp(&straightness(b)));
            joints.extend(best.filter(|pair| straightness(pair) > SMOOTH));
        }
        let joined: BTreeSet<Side> = joints.iter().flat_map(|(a, b)| [*a, *b]).collect();
        let mut images = self.images(topology, &joined);
        let turns = |(a, b): &(Side, Side)| self.turns(a.0, b.0);
        let leans = |((i, _), plane): &(Side, Point)| dot(unit(self.faces[*i].area), *plane).abs() > FLAT;
        let at_joints = joints.iter().filter(|pair| turns(pair)).map(|(a, _)| *a);
        let at_images = images.iter().filter(|image| leans(image)).map(|(side, _)| *side);
        let turning: BTreeSet<NodeId> =
            at_joints.chain(at_images).flat_map(|(i, k)| self.faces[i].edge(k)).collect();
        let is_curved = |i: usize| self.faces[i].nodes.iter().all(|n| turning.contains(n));
        joints.retain(|pair| !turns(pair) || is_curved(pair.0.0) || is_curved(pair.1.0));
        images.retain(|image| !leans(image) || is_curved(image.0.0));
        for ((i, k), (j, l)) in joints {
            (self.faces[i].next[k], self.faces[j].next[l]) = (Some(j), Some(i));
        }
        for ((i, k), plane) in images {
            self.faces[i].mirror[k] = Some(plane);
        }
    }

    /// The sides of faces that end at an outer plane of the mesh, at no sharper an edge with their images there than faces have that
    /// go on in each other; with the plane's normal.
    fn images(&self, topology: &Topology, joined: &BTreeSet<Side>) -> Vec<(Side, Point)> {
        let mut outer: BTreeMap<[NodeId; 2], Vec<([NodeId; 3], Point)>> = BTreeMap::new();
        let is_on_surface = |edge: &[NodeId; 2]| edge.iter().all(|n| self.around.contains_key(n));
        for facet in topology.outer_facets() {
            let area = area_vector(facet.nodes.map(|n| self.points[n.index()]));
            for edge in
                triangle_edges(facet.nodes).into_iter().filter(|edge| norm(area) > 0.0 && is_on_surface(edge))
            {
                outer.entry(edge).or_default().push((facet.nodes, unit(area)));
            }
        }
        let image = |(i, k): Side| {
            let face = &self.faces[i];
            let behind = outer.get(&edge_key(face.edge(k)))?.iter().filter(|(nodes, _)| *nodes != face.nodes);
            let mut planes = behind.map(|(_, plane)| *plane);
            let plane = planes.next()?;
            // A side that is curved mirrors nothing.
            let is_plane = planes.all(|other| norm(cross(plane, other)) <= FLAT);
            let lean = dot(unit(face.area), plane);
            // The image leans as much the other way.
            (is_plane && 1.0 - 2.0 * lean * lean > SMOOTH).then_some(((i, k), plane))
        };
        let sides = (0..self.faces.len()).flat_map(|i| (0..3).map(move |k| (i, k)));
        sides.filter(|side| !joined.contains(side)).filter_map(image).collect()
    }

    /// The direction from an edge into a face, at right angles to the edge.
    fn across_edge(&self, face: usize, [a, b]: [NodeId; 2]) -> Point {
        let other = self.faces[face].nodes.into_iter().find(|n| *n != a && *n != b).unwrap_or(a);
        let [a, b, other] = [a, b, other].map(|n| self.points[n.index()]);
        let along = unit(sub(b, a));
        unit(project_out(&[along], sub(other, a)))
    }

    /// The edge that is farthest off the surface that its facets stand for, at the outside only where nothing inside is curved;
    /// `None` where nothing is.
    pub fn farthest(&self) -> Option<Farthest> {
        let mut worst: Option<((bool, f64), Farthest)> = None;
        for (i, face) in self.faces.iter().enumerate() {
            for (k, height) in self.heights(i).into_iter().enumerate() {
                let (off, between) = (height.abs(), face.between);
                let rank = (between.1.is_some(), off);
                if off > 0.0 && worst.is_none_or(|(most, _)| rank > most) {
                    worst = Some((rank, Farthest { between, ends: face.edge(k), off }));
                }
            }
        }
        worst.map(|(_, farthest)| farthest)
    }

    /// The motion of every node [m] after which facets lie on their surfaces in the mean, so that bodies have the volume that these
    /// enclose: along the normals of curved surfaces, along flat ones, and within planes at the outside.
    pub fn onto_surfaces(&self) -> Vec<Point> {
        let mean = |face: usize| self.heights(face).iter().map(|height| height / 3.0).sum::<f64>();
        let means: Vec<f64> = (0..self.faces.len()).map(mean).collect();
        let mut motion = vec![[0.0; 3]; self.points.len()];
        for (&node, own) in &self.around {
            if own.iter().any(|&i| means[i] != 0.0) {
                motion[node.index()] = self.motion_of(node, own, &means);
            }
        }
        motion
    }

    /// The shortest motion [m] of a node with these faces that has the mean height of each of its smooth surfaces along its normal.
    fn motion_of(&self, node: NodeId, own: &[usize], means: &[f64]) -> Point {
        let mut left: Vec<usize> = own.to_vec();
        let mut conditions: Vec<(Point, f64)> = Vec::new();
        let mut planes: Vec<Point> = Vec::new();
        while let Some(&first) = left.first() {
            let surface = self.surface_at(node, first);
            left.retain(|i| surface.iter().all(|(other, _)| other != i));
            let area = sum(surface.iter().map(|own| self.area_of(*own)));
            let (mut volume, mut total) = (0.0, 0.0);
            for &(i, direction) in &surface {
                let size = norm(self.faces[i].area);
                volume += direction * size * means[i];
                total += size;
            }
            let is_at_the_outside = surface.iter().all(|(i, _)| self.faces[*i].between.1.is_none());
            if is_at_the_outside && surface.iter().all(|(i, _)| means[*i] == 0.0) {
                let rest = project_out(&planes, unit(area));
                if norm(rest) > SHARED {
                    planes.push(unit(rest));
                }
            }
            let normal = self.closed_normal(node, &surface).unwrap_or_else(|| unit(area));
            conditions.push((normal, volume / total));
        }
        let (mut matrix, mut right) = ([[0.0; 3]; 3], [0.0; 3]);
        for (normal, height) in conditions {
            let normal = project_out(&planes, normal);
            right = add(right, normal.map(|c| height * c));
            add_product(&mut matrix, 1.0, [normal, normal]);
        }
        (0..3).for_each(|d| matrix[d][d] += SHARED);
        project_out(&planes, solve_symmetric(matrix, right))
    }

    /// Heights [m] of the surface over the middles of a face's edges, in the direction of its area.
    fn heights(&self, face: usize) -> [f64; 3] {
        let nodes = self.faces[face].nodes;
        if self.faces[face].next == [None; 3] {
            return [0.0; 3];
        }
        let normals = nodes.map(|node| self.normal(node, face));
        std::array::from_fn(|k| {
            let l = (k + 1) % 3;
            let along = sub(self.points[nodes[l].index()], self.points[nodes[k].index()]);
            let height = dot(sub(normals[l], normals[k]), along) / 8.0;
            if height.abs() > FLAT * norm(along) { height } else { 0.0 }
        })
    }

    /// The faces at a node that a face goes on in around it, itself the first.
    fn surface_at(&self, node: NodeId, face: usize) -> Vec<Directed> {
        let mut found = vec![(face, 1.0)];
        let mut done = 0;
        while let Some(&(i, direction)) = found.get(done) {
            for k in (0..3).filter(|&k| self.faces[i].edge(k).contains(&node)) {
                self.go_on((i, direction), k, &mut found);
            }
            done += 1;
        }
        found
    }

    /// Adds the face behind an edge, if there is one that is not there yet.
    fn go_on(&self, (from, direction): Directed, k: usize, found: &mut Vec<Directed>) {
        if let Some(next) = self.faces[from].next[k].filter(|next| found.iter().all(|(own, _)| own != next)) {
            let is_same = dot(self.faces[from].area, self.faces[next].area) > 0.0;
            found.push((next, if is_same { direction } else { -direction }));
        }
    }

    /// Normal at a node of a surface that goes around it, with its images; `None` at a rim and at a point.
    fn closed_normal(&self, node: NodeId, surface: &[Directed]) -> Option<Point> {
        let ends = surface.iter().flat_map(|&(i, _)| {
            let face = &self.faces[i];
            let is_end = move |k: &usize| face.next[*k].is_none() && face.edge(*k).contains(&node);
            (0..3).filter(is_end).map(move |k| face.mirror[k])
        });
        let mut planes: Vec<Point> = Vec::new();
        for plane in ends {
            let rest = project_out(&planes, plane?);
            if norm(rest) > SHARED {
                planes.push(unit(rest));
            }
        }
        let normal = sum(surface.iter().map(|own| self.normal_in_corner(node, *own)));
        let within = project_out(&planes, normal);
        (norm(within) > SMOOTH * norm(normal)).then(|| unit(within))
    }

    /// The normal of a face by its angle [rad] at a node, which is that of a facet however it is divided into triangles.
    fn normal_in_corner(&self, node: NodeId, own: Directed) -> Point {
        let nodes = self.faces[own.0].nodes;
        let at = nodes.iter().position(|n| *n == node).unwrap_or(0);
        let [along, other] = [1, 2].map(|k| self.points[nodes[(at + k) % 3].index()]);
        let [along, other] = [along, other].map(|end| sub(end, self.points[nodes[at].index()]));
        let angle = norm(cross(along, other)).atan2(dot(along, other));
        unit(self.area_of(own)).map(|c| angle * c)
    }

    /// Normal of a face's surface at a node.
    fn normal(&self, node: NodeId, face: usize) -> Point {
        let mut surface = self.surface_at(node, face);
        if let Some(normal) = self.closed_normal(node, &surface) {
            return normal;
        }
        for own in surface.clone() {
            (0..3).for_each(|k| self.go_on(own, k, &mut surface));
        }
        Self::at_rim(self.points[node.index()], &self.facets_of(surface))
    }

    /// The normal of a surface at a rim of it [m], from facets behind, as a linear function of the place.
    fn at_rim(rim: Point, facets: &[RimFacet]) -> Point {
        let total: f64 = facets.iter().map(|own| own.area).sum();
        let mean = |part: fn(&RimFacet) -> Point| -> Point {
            std::array::from_fn(|d| facets.iter().map(|own| own.area * part(own)[d]).sum::<f64>() / total)
        };
        let (place, normal) = (mean(|own| own.middle), mean(|own| own.normal));
        let mut spread = [[0.0; 3]; 3];
        for own in facets {
            let turn = sub(own.normal, normal);
            add_product(&mut spread, own.area, [turn, turn]);
        }
        // Normals that turn one way, as of a cylinder, do so by the place in that direction: middles beside each other are no slope.
        let way = one_way(spread);
        let seen = |v: Point| way.map_or(v, |way| way.map(|c| dot(v, way) * c));
        let (mut moments, mut slopes) = ([[0.0; 3]; 3], [[0.0; 3]; 3]);
        for own in facets {
            let (x, turn) = (seen(sub(own.middle, place)), seen(sub(own.normal, normal)));
            add_product(&mut moments, own.area, [x, x]);
            add_product(&mut slopes, own.area, [turn, x]);
        }
        (0..3).for_each(|d| moments[d][d] += EXTENT * total * total);
        let away = sub(rim, place);
        unit(std::array::from_fn(|k| normal[k] + dot(solve_symmetric(moments, slopes[k]), away)))
    }

    /// The facets of which some faces are parts: faces in one plane, with what goes on in that plane beside them, are one, whose
    /// normal is that of the surface over its middle.
    fn facets_of(&self, mut faces: Vec<Directed>) -> Vec<RimFacet> {
        for _ in 0..2 {
            for own in faces.clone() {
                for k in 0..3 {
                    let next = self.faces[own.0].next[k];
                    if next.is_some_and(|next| !self.turns(own.0, next)) {
                        self.go_on(own, k, &mut faces);
                    }
                }
            }
        }
        let mut facets: Vec<(usize, RimFacet)> = Vec::new();
        for own in faces {
            let (i, vector) = (own.0, self.area_of(own));
            let area = norm(vector);
            let middle = centroid(self.faces[i].nodes.map(|n| self.points[n.index()]));
            match facets.iter_mut().find(|(first, _)| !self.turns(*first, i)) {
                Some((_, facet)) => {
                    let share = area / (facet.area + area);
                    facet.area += area;
                    facet.middle =
                        std::array::from_fn(|d| facet.middle[d] + share * (middle[d] - facet.middle[d]));
                }
                None => facets.push((i, RimFacet { area, middle, normal: unit(vector) })),
            }
        }
        facets.into_iter().map(|(_, facet)| facet).collect()
    }

    /// Whether two faces are not in one plane.
    fn turns(&self, i: usize, j: usize) -> bool {
        let [a, b] = [i, j].map(|face| self.faces[face].area);
        norm(cross(a, b)) > FLAT * norm(a) * norm(b)
    }

    /// Area vector of a face.
    fn area_of(&self, (face, direction): Directed) -> Point {
        self.faces[face].area.map(|c| direction * c)
    }
}

/// A facet near a rim.
struct RimFacet {
    /// [m²]
    area: f64,
    /// [m]
    middle: Point,
    normal: Point,
}

impl Face {
    /// The edge from a node to the next one.
    fn edge(&self, k: usize) -> [NodeId; 2] {
        [self.nodes[k], self.nodes[(k + 1) % 3]]
    }
}

/// The sum of vectors.
fn sum(vectors: impl Iterator<Item = Point>) -> Point {
    vectors.fold([0.0; 3], add)
}

/// A vector of length 1 in this direction.
fn unit(vector: Point) -> Point {
    vector.map(|c| c / norm(vector))
}

/// What of a vector is perpendicular to all of some normals, which are so to each other.
fn project_out(normals: &[Point], vector: Point) -> Point {
    normals.iter().fold(vector, |v, n| {
        let along = dot(v, *n);
        std::array::from_fn(|d| v[d] - along * n[d])
    })
}

/// Adds the product `a bᵀ` of two vectors.
fn add_product(matrix: &mut [Point; 3], weight: f64, [a, b]: [Point; 2]) {
    for d in 0..3 {
        (0..3).for_each(|k| matrix[d][k] += weight * a[d] * b[k]);
    }
}

/// The direction that nearly all of a sum of products `a aᵀ` is in; `None` where there are several.
fn one_way(products: [Point; 3]) -> Option<Point> {
    let largest = (0..3).max_by(|&a, &b| products[a][a].total_cmp(&products[b][b]))?;
    let way = unit(products[largest]);
    let along = dot(way, products.map(|row| dot(row, way)));
    (along > ONE_WAY * (products[0][0] + products[1][1] + products[2][2])).then_some(way)
}

/// The solution of a symmetric, positive definite system.
fn solve_symmetric([a, b, c]: [Point; 3], right: Point) -> Point {
    let determinant = dot(a, cross(b, c));
    [cross(b, c), cross(c, a), cross(a, b)].map(|row| dot(row, right) / determinant)
}

#[cfg(test)]
mod tests;
