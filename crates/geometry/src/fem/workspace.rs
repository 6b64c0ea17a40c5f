//! What the dense kernels take beside a large factor, and whether there is room for both.
//!
//! faer packs both operands of a large product, each into as much as the cache that the threads share, in every thread, and
//! ends the process where it is refused that. So it is asked for before a factor is begun, and given back. Only addresses
//! are taken: what is asked for is not touched.

use std::sync::OnceLock;

/// Least bytes of a factor in which products are so large that the kernels pack their operands.
pub const LARGE_FACTOR: usize = 4 << 20;

/// The shared cache, where the system does not say [bytes].
const SHARED_CACHE: usize = 32 << 20;

/// Bytes of addresses that the dense kernels of a large factor take in each thread.
pub fn bytes_per_thread() -> usize {
    static BYTES: OnceLock<usize> = OnceLock::new();
    *BYTES.get_or_init(|| {
        let size = std::fs::read_to_string("/sys/devices/system/cpu/cpu0/cache/index3/size");
        2 * cache_bytes(&size.unwrap_or_default()).unwrap_or(SHARED_CACHE)
    })
}

/// A size as the kernel writes it: `32768K`.
fn cache_bytes(text: &str) -> Option<usize> {
    text.trim().strip_suffix('K')?.parse::<usize>().ok()?.checked_mul(1024)
}

/// Whether a factor of so many bytes and the workspace of all threads can be had at the moment.
///
/// # Errors
/// The cause, with both numbers.
pub(super) fn check(factor_bytes: usize) -> Result<(), String> {
    let threads = if factor_bytes < LARGE_FACTOR { 0 } else { rayon::current_num_threads() };
    let mut held: Vec<Vec<u8>> = Vec::with_capacity(threads + 1);
    // One by one, as the threads will: a system may refuse at once what it gives in parts.
    for bytes in std::iter::once(factor_bytes).chain(std::iter::repeat_n(bytes_per_thread(), threads)) {
        let mut room = Vec::new();
        room.try_reserve_exact(bytes).map_err(|_| {
            let mebibytes = |bytes: usize| bytes.div_ceil(1 << 20);
            let kernels = mebibytes(threads * bytes_per_thread());
            format!(
                "out of memory: the factor takes {} MiB, and the dense kernels of {threads} threads {kernels} MiB of \
                 addresses; raise the limit on memory, or take fewer threads or a coarser mesh",
                mebibytes(factor_bytes)
            )
        })?;
        held.push(room);
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sizes_of_caches_are_read_as_the_kernel_writes_them() {
        assert_eq!(cache_bytes("32768K\n"), Some(32 << 20));
        assert_eq!(cache_bytes(""), None);
        assert!(bytes_per_thread() >= 2 << 20);
    }

    #[test]
    fn a_factor_without_room_is_refused_with_its_numbers() {
        assert_eq!(check(1000), Ok(()));
        let refused = check(isize::MAX as usize).expect_err("no system has so many addresses");
        assert!(refused.contains("the factor takes 8796093022208 MiB"), "{refused}");
    }
}
