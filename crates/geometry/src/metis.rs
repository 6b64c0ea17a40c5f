//! The calls into METIS, which are the only ones: nested dissection of a graph, and its partition into equal parts.
//!
//! Lives here: the arrays that METIS wants, the lock and the seed that make its answers repeatable, the calls. Does not
//! live here: which graph is meant ([`crate::fem::ordering`] orders matrices, [`crate::partition`] shares out meshes).
//! Without the feature `metis` every answer is `None`, and the callers have something else.

use crate::fem::csr::CsrStructure;

/// METIS's nested dissection, vertices counting by their weights or all the same; a permutation, `forward[new] = old`.
///
/// `None` where METIS refuses (empty graph, too large for its indices).
pub(crate) fn dissected(structure: &CsrStructure, weights: Option<Vec<i32>>) -> Option<Vec<u32>> {
    foreign::dissected(structure, weights)
}

/// The part of every vertex, of `parts` parts of about the same weight (at most 2 % above the mean, where the weights
/// allow it) between which the cut edges weigh little.
///
/// One weight a vertex, and one a stored entry of `structure`, which has no diagonal and is symmetric with its weights.
/// `None` where METIS refuses.
pub(crate) fn partitioned(
    structure: &CsrStructure,
    parts: usize,
    weights: Vec<i32>,
    edge_weights: Vec<i32>,
) -> Option<Vec<u32>> {
    foreign::partitioned(structure, parts, weights, edge_weights)
}

#[cfg(not(feature = "metis"))]
mod foreign {
    use crate::fem::csr::CsrStructure;

    pub(super) fn dissected(_: &CsrStructure, _: Option<Vec<i32>>) -> Option<Vec<u32>> {
        None
    }

    pub(super) fn partitioned(_: &CsrStructure, _: usize, _: Vec<i32>, _: Vec<i32>) -> Option<Vec<u32>> {
        None
    }
}

#[cfg(feature = "metis")]
mod foreign {
    use std::ptr::null_mut;
    use std::sync::{Mutex, MutexGuard, PoisonError};

    use metis_sys as metis;

    use crate::fem::csr::CsrStructure;

    /// METIS draws from a random generator of the process: one caller at a time gets the same numbers every time.
    static METIS: Mutex<()> = Mutex::new(());

    /// How much a part may weigh more than the mean, in thousandths.
    const EXCESS: i32 = 20;

    fn alone() -> MutexGuard<'static, ()> {
        METIS.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// A graph as METIS wants it: no vertex is its own neighbour.
    struct Graph {
        count: i32,
        starts: Vec<i32>,
        neighbours: Vec<i32>,
    }

    impl Graph {
        /// `None` for a graph without edges, or one too large for 32-bit indices.
        fn new(structure: &CsrStructure) -> Option<Self> {
            let n = structure.row_count();
            let mut starts = vec![0i32];
            let mut neighbours = Vec::with_capacity(structure.columns.len());
            for row in 0..n {
                let others = structure.columns[structure.row(row)].iter().filter(|&&c| c as usize != row);
                for &c in others {
                    neighbours.push(i32::try_from(c).ok()?);
                }
                starts.push(i32::try_from(neighbours.len()).ok()?);
            }
            let count = i32::try_from(n).ok()?;
            (!neighbours.is_empty()).then_some(Self { count, starts, neighbours })
        }
    }

    /// Defaults, but for the seed.
    fn options() -> [i32; metis::METIS_NOPTIONS as usize] {
        let mut options = [-1i32; metis::METIS_NOPTIONS as usize];
        options[metis::moptions_et_METIS_OPTION_SEED as usize] = 1;
        options
    }

    pub(super) fn dissected(structure: &CsrStructure, weights: Option<Vec<i32>>) -> Option<Vec<u32>> {
        let n = structure.row_count();
        let Graph { mut count, mut starts, mut neighbours } = Graph::new(structure)?;
        let mut forward = vec![0i32; n];
        let mut inverse = vec![0i32; n];
        let mut options = options();
        let mut weights = weights;
        assert!(weights.as_ref().is_none_or(|weights| weights.len() == n), "one weight a vertex");
        let guard = alone();
        // SAFETY: all arrays outlive the call and have the lengths METIS_NodeND documents: n + 1 row starts, as many
        // neighbours as the last of them says, n entries in each permutation, METIS_NOPTIONS options; a null pointer or
        // n vertex weights, as asserted above.
        #[allow(unsafe_code)]
        let status = unsafe {
            metis::METIS_NodeND(
                &mut count,
                starts.as_mut_ptr(),
                neighbours.as_mut_ptr(),
                weights.as_mut().map_or(null_mut(), |weights| weights.as_mut_ptr()),
                options.as_mut_ptr(),
                forward.as_mut_ptr(),
                inverse.as_mut_ptr(),
            )
        };
        drop(guard);
        (status == metis::rstatus_et_METIS_OK).then(|| forward.into_iter().map(|i| i as u32).collect())
    }

    pub(super) fn partitioned(
        structure: &CsrStructure,
        parts: usize,
        mut weights: Vec<i32>,
        mut edge_weights: Vec<i32>,
    ) -> Option<Vec<u32>> {
        let n = structure.row_count();
        let Graph { mut count, mut starts, mut neighbours } = Graph::new(structure)?;
        assert!(parts > 0, "at least one part");
        assert_eq!(weights.len(), n, "one weight a vertex");
        assert_eq!(edge_weights.len(), neighbours.len(), "one weight an edge, and no diagonal");
        let mut parts = i32::try_from(parts).ok()?;
        let (mut constraints, mut cut) = (1i32, 0i32);
        let mut part = vec![0i32; n];
        let mut options = options();
        options[metis::moptions_et_METIS_OPTION_UFACTOR as usize] = EXCESS;
        let guard = alone();
        // SAFETY: all arrays outlive the call and have the lengths METIS_PartGraphKway documents: n + 1 row starts, as many
        // neighbours and edge weights as the last of them says, n vertex weights for the one constraint, n entries in the
        // answer, METIS_NOPTIONS options; where null pointers stand it takes its defaults.
        #[allow(unsafe_code)]
        let status = unsafe {
            metis::METIS_PartGraphKway(
                &mut count,
                &mut constraints,
                starts.as_mut_ptr(),
                neighbours.as_mut_ptr(),
                weights.as_mut_ptr(),
                null_mut(),
                edge_weights.as_mut_ptr(),
                &mut parts,
                null_mut(),
                null_mut(),
                options.as_mut_ptr(),
                &mut cut,
                part.as_mut_ptr(),
            )
        };
        drop(guard);
        (status == metis::rstatus_et_METIS_OK).then(|| part.into_iter().map(|p| p as u32).collect())
    }
}
