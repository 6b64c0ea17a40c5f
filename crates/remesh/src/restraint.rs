//! Whether every connected part of the remesh region is held: otherwise `K_dd` of Eq. 3 is singular.
//!
//! A part is held when no rigid motion `t + r × x` vanishes at all its known components. With `R` the rows of the six
//! rigid motions at those components, that is: `Rᵀ R`, shape `(6, 6)`, is regular.

use fluxmorph_geometry::box_tree::AxisBox;
use fluxmorph_geometry::disjoint_sets::DisjointSets;
use fluxmorph_geometry::tet4::cross;
use fluxmorph_geometry::{ElementId, Mesh, NodeId};

use crate::error::RemeshError;
use crate::freedom::Freedom;

/// Pivots below this share of the largest are zero; lengths are scaled to the part, so that true pivots are moderate.
const SINGULAR: f64 = 1e-10;

/// Refuses a region of which a part can move as a rigid body.
pub(crate) fn check(mesh: &Mesh, elements: &[ElementId], unknowns: &Freedom) -> Result<(), RemeshError> {
    let topology = mesh.topology();
    let mut sets = DisjointSets::new(topology.node_count());
    for &e in elements {
        sets.join(topology.tet(e).map(NodeId::index));
    }
    let mut nodes: Vec<(usize, NodeId)> =
        elements.iter().flat_map(|&e| topology.tet(e)).map(|n| (sets.root(n.index()), n)).collect();
    nodes.sort_unstable();
    nodes.dedup();
    for part in nodes.chunk_by(|a, b| a.0 == b.0) {
        if part.iter().any(|&(_, n)| unknowns.dofs().unknown_bits(n) != 0) && !is_held(mesh, part, unknowns) {
            return Err(RemeshError::Unrestrained { point: mesh.point(part[0].1) });
        }
    }
    Ok(())
}

fn is_held(mesh: &Mesh, part: &[(usize, NodeId)], unknowns: &Freedom) -> bool {
    let around = AxisBox::around(part.iter().map(|&(_, n)| mesh.point(n)));
    let size = around.extent();
    let mut gram = [[0.0; 6]; 6];
    for &(_, n) in part {
        let p = mesh.point(n);
        let x: [f64; 3] = std::array::from_fn(|d| (2.0 * p[d] - around.lower[d] - around.upper[d]) / size);
        let axes = unknowns.axes(n);
        for c in (0..3).filter(|&c| unknowns.dofs().equation(n, c).is_none()) {
            // The component of t + r × x along the axis e: e · t + r · (x × e).
            let (axis, turning) = (axes[c], cross(x, axes[c]));
            let row: [f64; 6] = std::array::from_fn(|i| if i < 3 { axis[i] } else { turning[i - 3] });
            for (i, j) in (0..6).flat_map(|i| (0..6).map(move |j| (i, j))) {
                gram[i][j] += row[i] * row[j];
            }
        }
    }
    is_regular(gram)
}

/// Elimination with diagonal pivoting on a positive semidefinite matrix.
fn is_regular(mut gram: [[f64; 6]; 6]) -> bool {
    let largest = (0..6).map(|i| gram[i][i]).fold(0.0, f64::max);
    let mut left = [true; 6];
    for _ in 0..6 {
        let candidates = (0..6).filter(|&i| left[i]);
        let Some(pivot) = candidates.max_by(|&i, &j| gram[i][i].total_cmp(&gram[j][j])) else { return true };
        if gram[pivot][pivot] <= SINGULAR * largest {
            return false;
        }
        left[pivot] = false;
        for i in (0..6).filter(|&i| left[i]) {
            let factor = gram[i][pivot] / gram[pivot][pivot];
            for j in 0..6 {
                gram[i][j] -= factor * gram[pivot][j];
            }
        }
    }
    true
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_gram_matrix_that_misses_one_direction_is_singular() {
        let mut identity = [[0.0; 6]; 6];
        (0..6).for_each(|i| identity[i][i] = 1.0);
        assert!(is_regular(identity));
        let direction = [1.0, -2.0, 0.5, 0.0, 1.0, 3.0];
        let square: f64 = direction.iter().map(|d| d * d).sum();
        let projected: [[f64; 6]; 6] = std::array::from_fn(|i| {
            std::array::from_fn(|j| identity[i][j] - direction[i] * direction[j] / square)
        });
        assert!(!is_regular(projected));
        assert!(!is_regular([[0.0; 6]; 6]));
    }
}
