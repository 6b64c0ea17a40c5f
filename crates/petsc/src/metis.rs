//! METIS: nested dissection of a graph, and its partition into parts of equal weight.
//!
//! A graph is given as the rows of a symmetric pattern: `starts`, shape `(n + 1,)`, and `columns`, the neighbours of every
//! vertex, ascending. Lives here: the arrays that METIS wants, the lock and the seed that make its answers repeatable, the
//! calls. Without the feature `metis` every answer is `None`, and the callers have something else.

/// Nested dissection, vertices counting by their weights or all the same; a permutation, `forward[new] = old`. A vertex
/// may be listed among its own neighbours.
///
/// `None` where METIS refuses (no edge, too large for its indices).
///
/// # Panics
/// Unless there is one weight a vertex, and one column for each entry that `starts` announces.
pub fn nested_dissection(starts: &[u32], columns: &[u32], weights: Option<Vec<i32>>) -> Option<Vec<u32>> {
    foreign::nested_dissection(starts, columns, weights)
}

/// The part of every vertex, of `parts` parts of about the same weight (at most 2 % above the mean, where the weights
/// allow it) between which the cut edges weigh little.
///
/// One weight a vertex, and one an entry of `columns`, in which no vertex is its own neighbour; the weights are symmetric.
/// `None` where METIS refuses.
///
/// # Panics
/// For no part, and where there is another number of weights.
pub fn partition(
    (starts, columns): (&[u32], &[u32]),
    parts: usize,
    weights: Vec<i32>,
    edge_weights: Vec<i32>,
) -> Option<Vec<u32>> {
    foreign::partition((starts, columns), parts, weights, edge_weights)
}

#[cfg(not(feature = "metis"))]
mod foreign {
    pub(super) fn nested_dissection(_: &[u32], _: &[u32], _: Option<Vec<i32>>) -> Option<Vec<u32>> {
        None
    }

    pub(super) fn partition(_: (&[u32], &[u32]), _: usize, _: Vec<i32>, _: Vec<i32>) -> Option<Vec<u32>> {
        None
    }
}

#[cfg(feature = "metis")]
mod foreign {
    use std::ptr::null_mut;
    use std::sync::{Mutex, MutexGuard, PoisonError};

    use metis_sys as metis;

    /// METIS draws from a random generator of the process: one caller at a time gets the same numbers every time.
    static METIS: Mutex<()> = Mutex::new(());

    /// How much a part may weigh more than the mean, in thousandths.
    const EXCESS: i32 = 20;

    fn lock() -> MutexGuard<'static, ()> {
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
        fn new(row_starts: &[u32], columns: &[u32]) -> Option<Self> {
            let n = row_starts.len().checked_sub(1)?;
            let mut starts = vec![0i32];
            let mut neighbours = Vec::with_capacity(columns.len());
            for row in 0..n {
                let range = row_starts[row] as usize..row_starts[row + 1] as usize;
                for &c in columns[range].iter().filter(|&&c| c as usize != row) {
                    assert!((c as usize) < n, "a neighbour is a vertex");
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

    pub(super) fn nested_dissection(
        starts: &[u32],
        columns: &[u32],
        mut weights: Option<Vec<i32>>,
    ) -> Option<Vec<u32>> {
        let Graph { mut count, mut starts, mut neighbours } = Graph::new(starts, columns)?;
        let n = starts.len() - 1;
        let mut forward = vec![0i32; n];
        let mut inverse = vec![0i32; n];
        let mut options = options();
        assert!(weights.as_ref().is_none_or(|weights| weights.len() == n), "one weight a vertex");
        let guard = lock();
        // SAFETY: all arrays outlive the call and have the lengths METIS_NodeND documents: n + 1 row starts, as many
        // neighbours as the last of them says, each one of n vertices, n entries in each permutation, METIS_NOPTIONS options; a
        // null pointer or n vertex weights, as asserted above.
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

    pub(super) fn partition(
        (starts, columns): (&[u32], &[u32]),
        parts: usize,
        mut weights: Vec<i32>,
        mut edge_weights: Vec<i32>,
    ) -> Option<Vec<u32>> {
        let Graph { mut count, mut starts, mut neighbours } = Graph::new(starts, columns)?;
        let n = starts.len() - 1;
        assert!(parts > 0, "at least one part");
        assert_eq!(weights.len(), n, "one weight a vertex");
        assert_eq!(edge_weights.len(), neighbours.len(), "one weight an edge, and no diagonal");
        let mut parts = i32::try_from(parts).ok()?;
        let (mut constraints, mut cut) = (1i32, 0i32);
        let mut part = vec![0i32; n];
        let mut options = options();
        options[metis::moptions_et_METIS_OPTION_UFACTOR as usize] = EXCESS;
        let guard = lock();
        // SAFETY: all arrays outlive the call and have the lengths METIS_PartGraphKway documents: n + 1 row starts, as many
        // neighbours (each one of n vertices) and edge weights as the last of them says, n vertex weights for the one
        // constraint, n entries in the answer, METIS_NOPTIONS options; where null pointers stand it takes its defaults.
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
