//! The same design variables on a finer mesh: the shape stays what it is.
//!
//! The variables live on the surface of the mesh that was refined. A new node lies in the middle of an edge, and moves by the
//! mean of what the ends of that edge move: the facets of a design are the same on any of its meshes, and a symmetric shape stays
//! one. Between ends that move along `a` and `b`, mitred steps behind a sharp edge, the direction that walls are measured along is
//! that of `a + b`, and the normal displacement about the mean of theirs: a node between unlike directions moves along neither.

use std::collections::BTreeSet;

use fluxmorph_geometry::NodeId;
use fluxmorph_geometry::tet4::{Point, norm};

use super::{DesignSurface, Row};

impl DesignSurface {
    /// The surface on a finer mesh, whose triangles are `triangles` and whose nodes from number `coarse_nodes` on have
    /// `parents`, with lower numbers.
    ///
    /// # Panics
    /// If a new node on an edge of the surface has parents that are none of its nodes.
    #[must_use]
    pub fn refined(&self, triangles: &[[NodeId; 3]], coarse_nodes: usize, parents: &[[NodeId; 2]]) -> Self {
        let nodes: BTreeSet<NodeId> = triangles.iter().flatten().copied().collect();
        let mut fine = Self {
            nodes: Vec::new(),
            directions: Vec::new(),
            mitres: Vec::new(),
            rows: Vec::new(),
            // Nodes that are there keep their places: new ones have higher numbers.
            ..self.clone()
        };
        for node in nodes {
            let own = match node.index().checked_sub(coarse_nodes) {
                None => self.at(self.place(node)),
                Some(new) => {
                    let ends = parents[new].map(|parent| fine.place(parent));
                    let own = mean(ends.map(|end| fine.at(end)));
                    fine.ends.push(ends);
                    own
                }
            };
            fine.nodes.push(node);
            fine.directions.push(own.direction);
            fine.mitres.push(own.mitre);
            fine.rows.push(own.row);
        }
        fine
    }

    fn place(&self, node: NodeId) -> usize {
        self.nodes.binary_search(&node).expect("a node of the surface")
    }

    /// How one of its nodes moves.
    fn at(&self, place: usize) -> NodeStep {
        NodeStep {
            direction: self.directions[place],
            mitre: self.mitres[place],
            row: self.rows[place].clone(),
        }
    }
}

/// How a node moves: by the mitre times the variables with these weights, along the direction.
struct NodeStep {
    direction: Point,
    mitre: f64,
    row: Row,
}

/// How a node between two others moves.
fn mean([a, b]: [NodeStep; 2]) -> NodeStep {
    let between: Point = std::array::from_fn(|d| 0.5 * (a.mitre * a.direction[d] + b.mitre * b.direction[d]));
    let length = norm(between);
    let (direction, mitre, share) = match [&a, &b].map(|end| end.direction == [0.0; 3]) {
        [true, _] => (b.direction, b.mitre, 1.0),
        [_, true] => (a.direction, a.mitre, 1.0),
        _ if (a.direction, a.mitre) == (b.direction, b.mitre) => (a.direction, a.mitre, 1.0),
        // Of a surface that folds back nothing is left to move along.
        _ if length < f64::EPSILON => ([0.0; 3], 1.0, 0.0),
        _ if (a.mitre, b.mitre) == (1.0, 1.0) => (between.map(|c| c / length), 1.0, length),
        _ => (between.map(|c| c / length), length, 1.0),
    };
    let mut row: Row = Vec::with_capacity(a.row.len() + b.row.len());
    for (variable, weight) in a.row.into_iter().chain(b.row) {
        row.push((variable, 0.5 * share * weight));
    }
    row.sort_by_key(|(variable, _)| *variable);
    row.dedup_by(|next, kept| {
        let is_same = next.0 == kept.0;
        if is_same {
            kept.1 += next.1;
        }
        is_same
    });
    if direction == [0.0; 3] {
        row.clear();
    }
    NodeStep { direction, mitre, row }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use fluxmorph_geometry::Mesh;
    use fluxmorph_geometry::generate::{SphereParameters, sphere};
    use fluxmorph_geometry::refine::{RefineLimits, uniform};

    use super::super::{DesignSetup, Direction};
    use super::*;

    /// The surface of a ball and of its finer mesh.
    fn surfaces(
        direction: Direction,
    ) -> (DesignSurface, DesignSurface, fluxmorph_geometry::refine::Refinement) {
        let name = "sphere|air";
        let mesh = sphere(&SphereParameters { divisions: 4, ..SphereParameters::default() }).expect("a ball");
        let faces = mesh.topology().faces_between(name).expect("they touch");
        let topology = mesh.topology().as_ref().clone().with_surface(name, faces).expect("faces of the mesh");
        let mesh = Mesh::new(Arc::new(topology), mesh.points().to_vec()).expect("as it was");
        let refinement = uniform(&mesh, RefineLimits::default()).expect("eight for each");
        let triangles = mesh.topology().surface(name).expect("it is there");
        let coarse = DesignSurface::new(&mesh, &DesignSetup::new(triangles, direction)).expect("a surface");
        let fine = refinement.mesh().topology().surface(name).expect("inherited");
        let fine = coarse.refined(fine, mesh.points().len(), refinement.parents());
        (coarse, fine, refinement)
    }

    /// The largest difference of what a finer surface does to what its facets do.
    fn difference(direction: Direction) -> f64 {
        let (coarse, fine, refinement) = surfaces(direction);
        assert_eq!(fine.variable_count(), coarse.variable_count());
        let p: Vec<f64> = coarse.points().iter().map(|x| 1e-3 * (x[0] - 2.0 * x[1]) / norm(*x)).collect();
        let count = refinement.mesh().points().len() - refinement.parents().len();
        let mut all = vec![[0.0; 3]; count];
        for (node, displacement) in coarse.nodes().iter().zip(coarse.displacement(&p)) {
            all[node.index()] = displacement;
        }
        let facets = refinement.prolong(&all);
        let found = fine.displacement(&p);
        fine.nodes().iter().zip(found).fold(0.0, |largest: f64, (node, found)| {
            let of_facets = facets[node.index()];
            largest.max(norm(std::array::from_fn(|d| found[d] - of_facets[d])))
        })
    }

    #[test]
    fn a_shape_is_the_same_on_a_finer_mesh() {
        for direction in [Direction::Along([0.6, 0.0, 0.8]), Direction::Normal] {
            // Displacements of a millimetre, rounded a few times.
            assert!(difference(direction) < 1e-17, "{direction:?}");
        }
    }

    #[test]
    fn what_a_variable_does_to_new_nodes_is_in_the_gradient() {
        let (_, fine, _) = surfaces(Direction::Normal);
        let nodal: Vec<Point> = (0..fine.nodes().len()).map(|i| [1.0, 0.1 * i as f64, -2.0]).collect();
        let gradient = fine.gradient(&nodal);
        for k in [0, 3] {
            let mut unit = vec![0.0; fine.variable_count()];
            unit[k] = 1.0;
            let along: f64 = fine
                .displacement(&unit)
                .iter()
                .zip(&nodal)
                .map(|(x, g)| (0..3).map(|d| x[d] * g[d]).sum::<f64>())
                .sum();
            // Sums of some dozen terms.
            assert!((gradient[k] - along).abs() < 1e-12 * along.abs(), "{k}");
        }
    }
}
