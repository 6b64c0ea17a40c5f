//! Bisection of marked elements, and of others until the mesh conforms again.

use std::collections::HashMap;
use std::sync::Arc;

use super::marked::MarkedTet;
use super::{RefineLimits, Refinement, inherit, middle};
use crate::error::MeshError;
use crate::ids::{ElementId, NodeId};
use crate::mesh::Mesh;
use crate::tet4::{EDGES, Point, dot, sub};
use crate::topology::{Topology, edge_key};

/// A mesh that is refined again and again; what is bisected next follows from all that was.
#[derive(Clone, Debug)]
pub struct Bisection {
    coarse: Arc<Topology>,
    points: Vec<Point>,
    tets: Vec<MarkedTet>,
    parents: Vec<[NodeId; 2]>,
    middle_of: HashMap<[NodeId; 2], NodeId>,
    limits: RefineLimits,
}

impl Bisection {
    /// Any mesh.
    pub fn new(mesh: &Mesh, limits: RefineLimits) -> Self {
        let topology = Arc::clone(mesh.topology());
        let of = |e: ElementId| {
            let tet = topology.tet(e);
            MarkedTet::new(tet, e, |a, b| {
                let [a, b] = [a, b].map(|edge| edge_key(edge.map(|v| tet[v])));
                is_longer(mesh.points(), a, b)
            })
        };
        let tets = topology.elements().map(of).collect();
        Self {
            tets,
            points: mesh.points().to_vec(),
            parents: Vec::new(),
            middle_of: HashMap::new(),
            coarse: topology,
            limits,
        }
    }

    /// Number of elements as the mesh is now.
    pub fn element_count(&self) -> usize {
        self.tets.len()
    }

    /// Bisects the elements that are `marked`, by their numbers in the mesh of [`Bisection::refinement`], and all others whose
    /// edges that cuts.
    ///
    /// # Errors
    /// [`MeshError::RefinementLimit`]; nothing is refined then.
    pub fn refine(&mut self, marked: &[ElementId]) -> Result<(), MeshError> {
        self.refine_so_often(marked, 1)
    }

    /// Bisects the elements that are `marked` three times, which halves most of their edges, and others as in
    /// [`Bisection::refine`].
    ///
    /// # Errors
    /// As [`Bisection::refine`].
    pub fn halve(&mut self, marked: &[ElementId]) -> Result<(), MeshError> {
        self.refine_so_often(marked, 3)
    }

    fn refine_so_often(&mut self, marked: &[ElementId], times: u16) -> Result<(), MeshError> {
        let before = (self.tets.clone(), self.points.len());
        for e in marked {
            let tet = &mut self.tets[e.index()];
            tet.goal = tet.level.saturating_add(times);
        }
        let outcome = self.refine_to_goals();
        if outcome.is_err() {
            let (tets, node_count) = before;
            self.tets = tets;
            self.points.truncate(node_count);
            self.parents.truncate(node_count - self.coarse.node_count());
            self.middle_of.retain(|_, node| node.index() < node_count);
        }
        outcome
    }

    /// Bisects what is below its goal, each time until the mesh conforms again.
    fn refine_to_goals(&mut self) -> Result<(), MeshError> {
        let mut at_new_edge = vec![false; self.points.len()];
        loop {
            let mut chosen: Vec<bool> =
                self.tets.iter().map(|tet| self.has_cut_edge(tet, &at_new_edge)).collect();
            if !chosen.contains(&true) {
                chosen = self.tets.iter().map(|tet| tet.level < tet.goal).collect();
            }
            if !chosen.contains(&true) {
                return Ok(());
            }
            self.bisect(&chosen, &mut at_new_edge)?;
        }
    }

    /// Whether an edge of the element has a node in its middle; only edges between ends of those cut last are looked up.
    fn has_cut_edge(&self, tet: &MarkedTet, at_new_edge: &[bool]) -> bool {
        let at_end = tet.nodes.map(|n| at_new_edge.get(n.index()) == Some(&true));
        EDGES.iter().any(|&[a, b]| {
            at_end[a] && at_end[b] && self.middle_of.contains_key(&edge_key([tet.nodes[a], tet.nodes[b]]))
        })
    }

    /// Bisects the chosen elements once, each in its place, and notes the ends of the edges.
    fn bisect(&mut self, chosen: &[bool], at_new_edge: &mut Vec<bool>) -> Result<(), MeshError> {
        let RefineLimits { most_tets, most_levels } = self.limits;
        let count = self.tets.len() + chosen.iter().filter(|chosen| **chosen).count();
        if count > most_tets {
            return Err(MeshError::RefinementLimit { what: "elements", most: most_tets });
        }
        let mut tets = Vec::with_capacity(count);
        for (e, &chosen) in chosen.iter().enumerate() {
            let tet = self.tets[e];
            if !chosen {
                tets.push(tet);
                continue;
            }
            if tet.level >= most_levels {
                return Err(MeshError::RefinementLimit {
                    what: "bisections of one element",
                    most: usize::from(most_levels),
                });
            }
            let middle = self.middle_of(tet.edge());
            at_new_edge.resize(self.points.len(), false);
            tet.edge().into_iter().for_each(|n| at_new_edge[n.index()] = true);
            tets.extend(tet.halves(middle));
        }
        self.tets = tets;
        Ok(())
    }

    /// The node in the middle of an edge.
    fn middle_of(&mut self, edge: [NodeId; 2]) -> NodeId {
        let key = edge_key(edge);
        *self.middle_of.entry(key).or_insert_with(|| {
            let [a, b] = key;
            let node = NodeId::new(self.points.len());
            self.points.push(middle(self.points[a.index()], self.points[b.index()]));
            self.parents.push(key);
            node
        })
    }

    /// The mesh as it is now, against the one that all began with.
    ///
    /// # Errors
    /// [`MeshError::Inverted`] where elements are so flat that the parts vanish in rounding.
    pub fn refinement(&self) -> Result<Refinement, MeshError> {
        let ancestors: Vec<ElementId> = self.tets.iter().map(|tet| tet.ancestor).collect();
        // What was never cut keeps the order of its nodes.
        let nodes = |tet: &MarkedTet| if tet.level == 0 { self.coarse.tet(tet.ancestor) } else { tet.nodes };
        let tets = self.tets.iter().map(nodes).collect();
        let split = |[a, b, c]: [NodeId; 3], parts: &mut Vec<[NodeId; 3]>| {
            let turns = [[a, b, c], [b, c, a], [c, a, b]];
            let edge = |turn: [NodeId; 3]| edge_key([turn[0], turn[1]]);
            let longer = |one, other| is_longer(&self.points, edge(one), edge(other));
            let first = turns.into_iter().reduce(|best, turn| if longer(turn, best) { turn } else { best });
            self.split(first.expect("a triangle has edges"), parts);
        };
        let fine = inherit::inherit(&self.coarse, self.points.len(), tets, &ancestors, split)?;
        let mesh = Mesh::new(Arc::new(fine), self.points.clone())?;
        Ok(Refinement { mesh, parents: self.parents.clone(), ancestors })
    }

    /// The parts of a face of the coarse mesh or of one of its parts, whose marked edge is between the first two nodes. Parts
    /// are marked opposite the new node, as everywhere where a face is cut.
    fn split(&self, [a, b, c]: [NodeId; 3], parts: &mut Vec<[NodeId; 3]>) {
        match self.middle_of.get(&edge_key([a, b])) {
            None => parts.push([a, b, c]),
            Some(&middle) => {
                self.split([c, a, middle], parts);
                self.split([b, c, middle], parts);
            }
        }
    }
}

/// Whether an edge is longer than another; of equal ones that with the greater numbers is. Nodes are ascending.
fn is_longer(points: &[Point], edge: [NodeId; 2], other: [NodeId; 2]) -> bool {
    let length = |[a, b]: [NodeId; 2]| {
        let along = sub(points[b.index()], points[a.index()]);
        dot(along, along)
    };
    length(edge).total_cmp(&length(other)).then(edge.cmp(&other)).is_gt()
}
