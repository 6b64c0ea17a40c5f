//! Wall thickness of the designed bodies, measured along the direction of motion behind every design node (at an edge of designed faces
//! along their normals), and before every node of the faces opposite where these are no planes.
//!
//! From each node `x` of the design surface a ray runs against its direction `d` to where it leaves the body. On the
//! undeformed mesh it meets a triangle there with corners `y_k`, at the weights `b_k`, and with the normal `n`. On a moved mesh the
//! thickness is the distance along `d` to the plane through that point of the body's surface, wherever it has moved, with the normal
//! that it had,
//!
//! `t = n·(x − Σ b_k y_k) / (n·d)`, `∂t/∂x = n / (n·d)`, `∂t/∂y_k = −b_k n / (n·d)`:
//!
//! the initial one plus the node's height where that face is held. The normal on the moved mesh, which at a re-entrant edge may turn
//! by a right angle, has no say in it. A node without direction has no thickness.
//!
//! At an edge where designed faces meet the direction leans to all of them, and a ray against it says nothing of the lip that they make
//! with the faces opposite: there one ray runs behind each of these faces, against its own normal, from a place in it a thousandth of
//! the way from the node to its middle; `d` is the normal. The ray against the direction counts where it says less, as at the bottom of
//! a groove. Where the faces meet at an acute angle they are each other's opposite, of no thickness at the edge: then it is the ray
//! against the direction again.
//!
//! Between two design nodes the body may be thinner than behind both: before a step, a rib or a kink of the face opposite. So a ray runs
//! from every node of that face as well, along `d`, to the triangle of the design surface that it leaves the body through; the roles of
//! node and triangle are exchanged, and the formulas are the same with `d` turned around. What the thicknesses behind the corners of that
//! triangle say already is not written down again. Where two edges cross nothing is measured.

use std::collections::{BTreeMap, BTreeSet, HashMap, HashSet};

use fluxmorph_geometry::box_tree::BoxTree;
use fluxmorph_geometry::directions::unit;
use fluxmorph_geometry::ray::{Hit, hit, reach};
use fluxmorph_geometry::tet4::{Point, add, area_vector, centroid, dot, norm, sub};
use fluxmorph_geometry::topology::Facet;
use fluxmorph_geometry::{ElementId, Mesh, NodeId, RegionId};

use super::NoThickness;
use crate::design::{DesignSurface, faces_around};

/// Sine of the angle (six degrees) between ray and triangle below which the triangle belongs to the body's side: facets of a
/// round side lean by less, and an opposite face as steep as that makes no body whose thickness means anything.
const GRAZING: f64 = 0.1;

/// Share of a distance by which it may differ from what those around it say by rounding.
const ROUNDING: f64 = 1e-6;

/// Share of the way from a node at an edge to the middle of a face beside it at which the ray behind that face begins.
const INSET: f64 = 1e-3;

/// Most steps from the direction at one design node to that where a ray from opposite leaves the body.
const MOST_TURNS: usize = 5;

/// A corner of a wall.
#[derive(Clone, Copy, Debug)]
enum Corner {
    /// A node of the mesh.
    Node(NodeId),
    /// A fixed place [m]: of a node of the full mesh that the solved one lacks. Such nodes lie inside the cut that a plane of symmetry
    /// makes through a region which its surface replaces, and no distance to that plane changes with their motion in it.
    Fixed(Point),
}

impl Corner {
    fn node(self) -> Option<NodeId> {
        match self {
            Self::Node(node) => Some(node),
            Self::Fixed(_) => None,
        }
    }
}

/// What lies opposite of a node on the undeformed mesh.
#[derive(Clone, Copy, Debug)]
struct Opposite {
    /// Distance [m].
    distance: f64,
    /// The node, and the corners of the triangle there.
    corners: [Corner; 4],
    /// The triangle, of the mesh that was measured.
    face: [NodeId; 3],
    /// The weights of its corners.
    weights: Point,
    /// `n / (n·d)`: what the thickness grows by with the place of the node.
    growth: Point,
    /// The region between, of the mesh that was measured.
    body: RegionId,
    /// By how much the body is thinner here than the design nodes around say [m]; `None` of these nodes themselves.
    bulge: Option<f64>,
}

impl Opposite {
    /// Where a ray from a node leaves a body through a triangle, `outwards` being against the ray.
    fn new(node: NodeId, hit: &Hit, outwards: Point, (nodes, body): ([NodeId; 3], RegionId)) -> Self {
        let &Hit { distance, weights, normal } = hit;
        let growth = normal.map(|c| c / dot(normal, outwards));
        let [a, b, c] = nodes;
        let corners = [node, a, b, c].map(Corner::Node);
        Self { distance, corners, face: nodes, weights, growth, body, bulge: None }
    }
}

/// One wall between a node and the triangle opposite.
#[derive(Clone, Copy, Debug)]
pub struct Wall {
    /// Its thickness [m].
    pub thickness: f64,
    /// Derivatives with respect to the positions of the node and of the three nodes opposite; none for what stays.
    pub derivatives: [Option<(NodeId, Point)>; 4],
    /// By how much the body was thinner here than the design nodes around say, on the undeformed mesh [m]; `None` behind a design node.
    pub bulge: Option<f64>,
}

/// What lies opposite of every design node, in each body that the node is a part of, and of nodes opposite where that says more.
#[derive(Clone, Debug)]
pub struct WallThickness {
    /// With the place in the design surface of the node, or of the nearest one, ascending; none where the node has no direction, or its
    /// ray leads past the body or through its side at a rim.
    opposite: Vec<(usize, Opposite)>,
}

impl WallThickness {
    /// Measures the bodies of the undeformed mesh, each behind its own part of the design surface.
    ///
    /// # Errors
    /// [`NoThickness`] without a body, and where some ray does not meet an opposite face of its body. Only at the rim of the design
    /// surface it may: where the body ends beside it, a direction that leans outwards by as little as facets of a round face do leads
    /// past the body or out through its side, and the node has no thickness.
    pub fn measure(mesh: &Mesh, bodies: &[RegionId], surface: &DesignSurface) -> Result<Self, NoThickness> {
        let of: BTreeMap<RegionId, BodyFaces> =
            bodies.iter().map(|&region| (region, BodyFaces::new(mesh, region, surface))).collect();
        let mut behind: HashMap<NodeId, BTreeSet<RegionId>> = HashMap::new();
        for (face, element) in faces_with_bodies(mesh, surface) {
            let region = mesh.topology().region_of()[element.index()];
            if of.contains_key(&region) {
                face.iter().for_each(|&node| {
                    behind.entry(node).or_default().insert(region);
                });
            }
        }
        let opposite_of = |((&node, direction), &mitre): ((&NodeId, &Point), &f64)| {
            if *direction == [0.0; 3] {
                return Ok(Vec::new());
            }
            let (origin, back) = (mesh.point(node), direction.map(|d| -d));
            let in_body = |body: RegionId| {
                let faces = &of[&body];
                let is_edge = mitre != 1.0;
                let mut found =
                    if is_edge { faces.behind_edge(node, (origin, *direction)) } else { Vec::new() };
                let least = found.iter().map(|(_, own)| own.distance).fold(f64::INFINITY, f64::min);
                // Along the facets of a side that is round a ray from the rim meets one of them anywhere.
                let grazing = || faces.grazed(origin, back).filter(|_| !faces.are_at_rim(node));
                let along = faces.opposite(origin, back).or_else(grazing);
                let along = along.map(|(hit, nodes)| Opposite::new(node, &hit, *direction, (nodes, body)));
                found.extend(along.filter(|own| own.distance < least).map(|own| (*direction, own)));
                found
            };
            // A node with no body behind it moves along a side of one, or of the only one there is.
            let beside = of.iter().filter(|(_, faces)| bodies.len() == 1 || faces.are_designed_at(node));
            let own = behind.get(&node).into_iter().flatten();
            let mut found: Vec<_> = own.copied().flat_map(in_body).collect();
            if found.is_empty() {
                found = beside
                    .map(|(region, _)| in_body(*region))
                    .find(|found| !found.is_empty())
                    .unwrap_or_default();
            }
            let may_have_none = || of.values().any(|faces| faces.are_at_rim(node));
            let is_whole = !found.is_empty() || may_have_none();
            let at = (!of.is_empty()).then_some(origin);
            if is_whole { Ok(found) } else { Err(NoThickness { at }) }
        };
        let nodes = surface.nodes().iter().zip(surface.directions()).zip(surface.mitres());
        let by_node = nodes.map(opposite_of).collect::<Result<Vec<_>, _>>()?;
        let facing: Vec<_> = of.values().flat_map(|own| own.facing(mesh, surface, &by_node)).collect();
        let with_place =
            |(i, found): (usize, Vec<(Point, Opposite)>)| found.into_iter().map(move |(_, own)| (i, own));
        let mut opposite: Vec<_> = by_node.into_iter().enumerate().flat_map(with_place).collect();
        opposite.extend(facing);
        opposite.sort_by_key(|&(place, _)| place);
        if opposite.is_empty() { Err(NoThickness::default()) } else { Ok(Self { opposite }) }
    }

    /// The same on another mesh, in which the nodes of the one that was measured have these numbers; those that it lacks stay.
    pub fn renumbered(&self, measured: &Mesh, new_of: &[Option<NodeId>]) -> Self {
        let renumber = |corner: Corner| match corner {
            Corner::Node(n) => {
                new_of[n.index()].map_or_else(|| Corner::Fixed(measured.point(n)), Corner::Node)
            }
            fixed @ Corner::Fixed(_) => fixed,
        };
        let of = |(place, own): &(usize, Opposite)| {
            (*place, Opposite { corners: own.corners.map(renumber), ..*own })
        };
        Self { opposite: self.opposite.iter().map(of).collect() }
    }

    /// Initial thickness [m] of every wall, with the place in the design surface of its node or of the nearest one.
    pub fn initial(&self) -> impl Iterator<Item = (usize, f64)> + '_ {
        self.opposite.iter().map(|(i, opposite)| (*i, opposite.distance))
    }

    /// The triangles opposite of all design nodes, of the mesh that was measured, with the places of these in the design surface,
    /// ascending.
    pub fn opposite_faces(&self) -> impl Iterator<Item = (usize, [NodeId; 3])> + '_ {
        self.opposite.iter().filter(|(_, own)| own.bulge.is_none()).map(|(place, own)| (*place, own.face))
    }

    /// The nodes opposite of the design surface, some of them several times.
    pub fn opposite_nodes(&self) -> impl Iterator<Item = NodeId> + '_ {
        let of = |(_, own): &(usize, Opposite)| {
            let [node, a, b, c] = own.corners;
            // Before a node opposite the triangle is that of the design.
            if own.bulge.is_some() { vec![node] } else { vec![a, b, c] }
        };
        self.opposite.iter().flat_map(of).filter_map(Corner::node)
    }

    /// All walls, with the place in the design surface of their node or of the nearest one, where every node of the mesh is at `place`
    /// [m].
    pub fn walls<'a>(
        &'a self,
        place: impl Fn(NodeId) -> Point + 'a,
    ) -> impl Iterator<Item = (usize, Wall)> + 'a {
        self.opposite.iter().map(move |(i, opposite)| (*i, wall(opposite, &place)))
    }

    /// The least thickness [m] at every design node by its place in the surface, where every node of the mesh is at `place` [m].
    pub fn least_at_nodes(&self, place: impl Fn(NodeId) -> Point) -> BTreeMap<usize, f64> {
        least_of(self.walls(place))
    }

    /// The same at every node of a moved mesh, shape `(n_nodes,)`; zero where none is measured.
    pub fn over_nodes(&self, surface: &DesignSurface, mesh: &Mesh) -> Vec<f64> {
        let mut thickness = vec![0.0; mesh.points().len()];
        for (i, least) in self.least_at_nodes(|n| mesh.point(n)) {
            thickness[surface.nodes()[i].index()] = least;
        }
        thickness
    }

    /// The least thickness [m] of every body where every node of the mesh is at `place` [m], by the regions of the mesh that was
    /// measured.
    pub fn least_of_bodies(&self, place: impl Fn(NodeId) -> Point) -> BTreeMap<RegionId, f64> {
        let bodies = self.opposite.iter().map(|(_, opposite)| opposite.body);
        least_of(bodies.zip(self.walls(place).map(|(_, wall)| wall)))
    }

    /// Least and greatest thickness [m] on a moved mesh.
    pub fn range(&self, mesh: &Mesh) -> (f64, f64) {
        self.walls(|n| mesh.point(n))
            .map(|(_, wall)| wall.thickness)
            .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), t| (low.min(t), high.max(t)))
    }
}

/// The least thickness [m] of walls with the same key.
fn least_of<K: Ord>(walls: impl Iterator<Item = (K, Wall)>) -> BTreeMap<K, f64> {
    let mut least = BTreeMap::new();
    for (key, wall) in walls {
        let own = least.entry(key).or_insert(f64::INFINITY);
        *own = wall.thickness.min(*own);
    }
    least
}

/// The wall between a node and what lies opposite.
fn wall(opposite: &Opposite, place: &impl Fn(NodeId) -> Point) -> Wall {
    let Opposite { corners: [node, a, b, c], weights, growth, bulge, .. } = *opposite;
    let terms = [(node, 1.0), (a, -weights[0]), (b, -weights[1]), (c, -weights[2])];
    let at = |corner: Corner| match corner {
        Corner::Node(n) => place(n),
        Corner::Fixed(point) => point,
    };
    Wall {
        thickness: terms.iter().map(|&(corner, weight)| weight * dot(growth, at(corner))).sum(),
        derivatives: terms.map(|(corner, weight)| corner.node().map(|n| (n, growth.map(|c| weight * c)))),
        bulge,
    }
}

/// The faces between two regions that are part of the design surface, each with the element behind it, against the direction of
/// motion; without those that run along it.
pub fn faces_with_bodies(mesh: &Mesh, surface: &DesignSurface) -> Vec<([NodeId; 3], ElementId)> {
    let direction_at = |node: &NodeId| {
        let row = surface.nodes().binary_search(node).ok()?;
        Some(surface.directions()[row]).filter(|direction| *direction != [0.0; 3])
    };
    let with_body = |facet: &Facet| {
        let outside = facet.outside?;
        surface.has_all(&facet.nodes).then_some(())?;
        let direction = facet.nodes.iter().find_map(direction_at)?;
        let corners = facet.nodes.map(|n| mesh.point(n));
        let is_ahead = dot(area_vector(corners), direction) > 0.0;
        (!runs_along(direction, &corners))
            .then_some((facet.nodes, if is_ahead { facet.inside } else { outside }))
    };
    mesh.topology().facets().iter().filter_map(with_body).collect()
}

/// The faces of a body, found by rays.
struct BodyFaces {
    body: RegionId,
    /// Seen from outside.
    nodes: Vec<[NodeId; 3]>,
    corners: Vec<[Point; 3]>,
    tree: BoxTree,
    /// The faces of every node.
    at_node: HashMap<NodeId, Vec<usize>>,
    /// The nodes of those that are part of the design surface, and of the others.
    designed_nodes: HashSet<NodeId>,
    other_nodes: HashSet<NodeId>,
    /// By face: whether all of its nodes are of the design surface.
    is_designed: Vec<bool>,
}

impl BodyFaces {
    fn new(mesh: &Mesh, region: RegionId, surface: &DesignSurface) -> Self {
        let nodes = mesh.topology().boundary(region);
        let is_designed: Vec<bool> = nodes.iter().map(|face| surface.has_all(face)).collect();
        let [designed_nodes, other_nodes] = [true, false].map(|designed| {
            let own = nodes.iter().zip(&is_designed).filter(|(_, is_designed)| **is_designed == designed);
            own.flat_map(|(face, _)| *face).collect()
        });
        let corners: Vec<[Point; 3]> = nodes.iter().map(|f| f.map(|n| mesh.point(n))).collect();
        let tree = BoxTree::new(corners.iter().map(reach).collect());
        let mut at_node: HashMap<NodeId, Vec<usize>> = HashMap::new();
        for (i, face) in nodes.iter().enumerate() {
            face.iter().for_each(|&n| at_node.entry(n).or_default().push(i));
        }
        Self { body: region, nodes, corners, at_node, tree, designed_nodes, other_nodes, is_designed }
    }

    /// What lies opposite of a node at an edge behind each of the designed faces that meet there, by the normal of that face; none of
    /// those that run along the node's direction.
    fn behind_edge(&self, node: NodeId, (origin, direction): (Point, Point)) -> Vec<(Point, Opposite)> {
        let at_node = self.at_node.get(&node).into_iter().flatten().copied();
        let faces: Vec<usize> = at_node.filter(|&face| self.is_designed[face]).collect();
        let around: Vec<_> =
            faces.iter().map(|&face| (self.nodes[face], area_vector(self.corners[face]))).collect();
        let behind = |part: Vec<usize>| {
            let normal = unit(part.iter().map(|&i| around[i].1).fold([0.0; 3], add));
            let centres = part.iter().map(|&i| centroid(self.corners[faces[i]]));
            let middle = centres.fold([0.0; 3], add).map(|x| x / part.len() as f64);
            let beside = add(origin, sub(middle, origin).map(|x| INSET * x));
            (dot(normal, direction) >= GRAZING).then_some(())?;
            let (hit, nodes) = self.opposite(beside, normal.map(|c| -c))?;
            let found = Opposite::new(node, &hit, normal, (nodes, self.body));
            let distance = found.distance + dot(found.growth, sub(origin, beside));
            (!nodes.contains(&node)).then_some((normal, Opposite { distance, ..found }))
        };
        faces_around(&around).into_iter().filter_map(behind).collect()
    }

    /// The body before every node of the faces that the design surface does not have, where that says more than what lies behind the
    /// design nodes around, which is given.
    fn facing(
        &self,
        mesh: &Mesh,
        surface: &DesignSurface,
        behind: &[Vec<(Point, Opposite)>],
    ) -> Vec<(usize, Opposite)> {
        // By the direction that they are along.
        let mut distances: HashMap<NodeId, Vec<(Point, f64)>> = HashMap::new();
        for (&node, found) in surface.nodes().iter().zip(behind) {
            let own = found.iter().filter(|(_, own)| own.body == self.body);
            let own: Vec<_> = own.map(|(along, own)| (*along, own.distance)).collect();
            if !own.is_empty() {
                distances.insert(node, own);
            }
        }
        let said_at = |node: &NodeId, along: Point| {
            let nearest = distances[node].iter().max_by(|a, b| dot(a.0, along).total_cmp(&dot(b.0, along)));
            nearest.map_or(0.0, |own| own.1)
        };
        let place_of = |node: NodeId| surface.nodes().binary_search(&node).expect("it was measured from");
        let mut measured: Vec<NodeId> = distances.keys().copied().collect();
        measured.sort_unstable();
        let tree = BoxTree::of_points(&measured.iter().map(|&n| mesh.point(n)).collect::<Vec<_>>());
        let facing_one = |&node: &NodeId| {
            let (first, _) = tree.nearest(mesh.point(node))?;
            let mut along = surface.directions()[place_of(measured[first])];
            let mut steps = 0;
            let (met, nodes) = loop {
                let (met, nodes) = self.through(node, mesh.point(node), along)?;
                nodes.iter().all(|n| distances.contains_key(n)).then_some(())?;
                let there = mean(&nodes.map(|n| surface.directions()[place_of(n)]), met.weights);
                steps += 1;
                if there == along || steps == MOST_TURNS {
                    break (met, nodes);
                }
                along = there;
            };
            let said: f64 = nodes.iter().zip(met.weights).map(|(n, weight)| weight * said_at(n, along)).sum();
            let bulge = said - met.distance;
            let heaviest = (0..3).max_by(|&a, &b| met.weights[a].total_cmp(&met.weights[b]))?;
            let found = Opposite::new(node, &met, along.map(|c| -c), (nodes, self.body));
            (bulge.abs() > ROUNDING * met.distance)
                .then_some((place_of(nodes[heaviest]), Opposite { bulge: Some(bulge), ..found }))
        };
        let others: BTreeSet<NodeId> = self.other_nodes.difference(&self.designed_nodes).copied().collect();
        others.iter().filter_map(facing_one).collect()
    }

    /// Where the ray from a node of the body's surface into the body leaves it, if it does not begin outside.
    fn through(&self, node: NodeId, origin: Point, along: Point) -> Option<(Hit, [NodeId; 3])> {
        let leans = |corners: &[Point; 3]| {
            let normal = area_vector(*corners);
            dot(normal, along) / norm(normal)
        };
        let at_node = self.at_node.get(&node)?.iter();
        at_node.map(|&face| leans(&self.corners[face])).any(|lean| lean <= -GRAZING).then_some(())?;
        let (met, nodes) = self.nearest(origin, along, |corners| leans(corners).abs() >= GRAZING)?;
        (dot(met.normal, along) > 0.0).then_some((met, nodes))
    }

    fn are_designed_at(&self, node: NodeId) -> bool {
        self.designed_nodes.contains(&node)
    }

    /// Whether the body goes on with another face behind the node of a designed one.
    fn are_at_rim(&self, node: NodeId) -> bool {
        self.designed_nodes.contains(&node) && self.other_nodes.contains(&node)
    }

    /// The nearest face that a ray goes out through.
    fn opposite(&self, origin: Point, direction: Point) -> Option<(Hit, [NodeId; 3])> {
        // From a rim the ray runs along the facets of the body's side, and a round side is no plane; at the foot of a step it meets
        // the rim of a face that it does not go through.
        self.nearest(origin, direction, |corners| {
            let normal = area_vector(*corners);
            dot(normal, direction) >= GRAZING * norm(normal)
        })
    }

    /// The nearest face that a ray meets, which may run along it: with the distance to its point.
    fn grazed(&self, origin: Point, direction: Point) -> Option<(Hit, [NodeId; 3])> {
        let (hit, nodes) = self.nearest(origin, direction, |_| true)?;
        Some((Hit { normal: direction, ..hit }, nodes))
    }

    /// The nearest of the faces that count by their corners.
    fn nearest(
        &self,
        origin: Point,
        direction: Point,
        counts: impl Fn(&[Point; 3]) -> bool,
    ) -> Option<(Hit, [NodeId; 3])> {
        let hits = self.tree.hits(origin, direction).into_iter().filter(|&i| counts(&self.corners[i]));
        let met = hits.filter_map(|i| Some((hit(origin, direction, &self.corners[i])?, self.nodes[i])));
        met.min_by(|a, b| a.0.distance.total_cmp(&b.0.distance))
    }
}

/// The unit vector along the mean of three directions.
fn mean(directions: &[Point; 3], weights: Point) -> Point {
    unit(std::array::from_fn(|d| (0..3).map(|k| weights[k] * directions[k][d]).sum()))
}

/// Whether a ray runs along a triangle rather than through it.
fn runs_along(direction: Point, triangle: &[Point; 3]) -> bool {
    let normal = area_vector(*triangle);
    dot(normal, direction).abs() < GRAZING * norm(normal)
}

#[cfg(test)]
mod tests;
