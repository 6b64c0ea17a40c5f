//! What the fuzz targets share: files with a header that is right, mutations that keep a file's structure, and what must
//! hold for whatever a reader accepts. The targets themselves are in `fuzz_targets`, one a file.

pub mod journal;
pub mod mesh;
pub mod mutation;
#[cfg(feature = "optimizer")]
pub mod quantity;

use std::time::Duration;

use cpu_time::ProcessTime;

/// Longest computing time of one input.
const HANG: Duration = Duration::from_secs(2);

/// Runs what an input asks for.
///
/// # Panics
/// If it computes for longer than two seconds. libFuzzer's own limit is by the clock, and on a machine with other work an
/// input of a millisecond may wait that long: it is set higher, for what waits for ever.
pub fn in_time(run: impl FnOnce()) {
    let start = ProcessTime::now();
    run();
    assert!(start.elapsed() < HANG, "{:?} of computing time", start.elapsed());
}
