//! What the tests of this crate ask of every parallel algorithm.

/// Runs on one, two and four threads, and asserts that all results are the same; the result.
#[track_caller]
pub(crate) fn same_on_any_threads<R: PartialEq + Send>(run: impl Fn() -> R + Sync) -> R {
    let on = |threads: usize| {
        rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("a pool").install(&run)
    };
    let one = on(1);
    assert!(one == on(2) && one == on(4), "the result depends on the number of threads");
    one
}
