//! One tetrahedron with marked edges, and its bisection: Arnold, Mukherjee and Pouly, *Locally adapted tetrahedral meshes
//! using bisection*, SIAM J. Sci. Comput. 22 (2000) 431.
//!
//! Every face has a marked edge, the same in both elements that share it; one edge is marked in two faces, and is bisected
//! next. At first the longest edge of each face is marked, in an order that tells equal lengths apart. What is cut
//! follows the rules of `BisectTet` there: conforming closures end, and the descendants of an element have a bounded number
//! of shapes (theorems 3.1 and 4.2).

use crate::ids::{ElementId, NodeId};

/// A tetrahedron whose next bisection is decided.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct MarkedTet {
    /// Right-handed; the edge between the first two is bisected next, and is the marked edge of the two faces that have it.
    pub(super) nodes: [NodeId; 4],
    /// Of the faces without the first and without the second node, the place of the vertex off the marked edge.
    spare: [u8; 2],
    stage: Stage,
    /// The element of the coarse mesh.
    pub(super) ancestor: ElementId,
    /// Bisections since then.
    pub(super) level: u16,
    /// Bisections that it is to have at least.
    pub(super) goal: u16,
}

/// The flag of the paper: it matters where the three marked edges lie in one plane.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Stage {
    Unflagged,
    Flagged,
}

impl MarkedTet {
    /// An element of the coarse mesh; `longer` orders its edges, by places, and is the same order in all elements.
    pub(super) fn new(
        tet: [NodeId; 4],
        ancestor: ElementId,
        longer: impl Fn([usize; 2], [usize; 2]) -> bool,
    ) -> Self {
        let longest = |edges: &[[usize; 2]]| {
            edges.iter().copied().reduce(|best, edge| if longer(edge, best) { edge } else { best })
        };
        let [p, q] = longest(&crate::tet4::EDGES).expect("a tetrahedron has edges");
        let places = right_handed([p, q], [0, 1, 2, 3].into_iter().filter(|v| *v != p && *v != q));
        let spare = [[1, 2, 3], [0, 2, 3]].map(|face: [usize; 3]| {
            let [a, b, c] = face.map(|v| places[v]);
            let mark = longest(&[[a, b], [a, c], [b, c]]).expect("a face has edges");
            face.into_iter().find(|&v| !mark.contains(&places[v])).expect("one vertex is left") as u8
        });
        Self { nodes: places.map(|v| tet[v]), spare, stage: Stage::Unflagged, ancestor, level: 0, goal: 0 }
    }

    /// The edge that is bisected next.
    pub(super) fn edge(&self) -> [NodeId; 2] {
        [self.nodes[0], self.nodes[1]]
    }

    /// Both halves, with the node in the middle of [`MarkedTet::edge`].
    pub(super) fn halves(&self, middle: NodeId) -> [Self; 2] {
        [self.half(0, middle), self.half(1, middle)]
    }

    /// The half that keeps the end `end` of the bisected edge.
    fn half(&self, end: usize, middle: NodeId) -> Self {
        let is_planar = self.spare[0] == self.spare[1];
        // The face without the other end is inherited, and its marked edge is the next one.
        let spare = usize::from(self.spare[1 - end]);
        let mut mark = [end, 2, 3].into_iter().filter(|&v| v != spare);
        let mark = [mark.next(), mark.next()].map(|v| v.expect("two of three are left"));
        // Places as of the parent, with the middle in the place of the other end.
        let places = right_handed(mark, [spare, 1 - end].into_iter());
        let new_face_spare = match self.stage {
            Stage::Flagged if is_planar => 2,
            _ => 3,
        };
        // The new face lies opposite the kept end.
        let spare = [0, 1].map(|k| if places[k] == end { new_face_spare } else { 3 });
        // In `places` the third is off the mark and the fourth the middle.
        let nodes = places.map(|v| if v == 1 - end { middle } else { self.nodes[v] });
        let stage = match self.stage {
            Stage::Unflagged if is_planar => Stage::Flagged,
            _ => Stage::Unflagged,
        };
        Self { nodes, spare, stage, level: self.level + 1, ..*self }
    }
}

/// The four places, two of them first, in an order of positive sign: the first two are swapped where it needs that.
fn right_handed([p, q]: [usize; 2], mut rest: impl Iterator<Item = usize>) -> [usize; 4] {
    let [r, s] = [rest.next(), rest.next()].map(|v| v.expect("two of four are left"));
    let order = [p, q, r, s];
    let inversions =
        (0..4).flat_map(|i| (i + 1..4).map(move |j| (i, j))).filter(|&(i, j)| order[i] > order[j]);
    if inversions.count() % 2 == 0 { order } else { [q, p, r, s] }
}
