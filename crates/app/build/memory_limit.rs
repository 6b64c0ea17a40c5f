//! What cannot fit into memory is refused before work starts.
//!
//! Twice: the mesh before it is generated or read ([`check_mesh`]), by the number of its tetrahedra or the length of its
//! file, and the problem once its matrices are known but not yet filled ([`check_problem`]). The room is the least of what
//! the machine has left, what the control groups of the process allow, and the limits set on the process itself. Where the
//! system gives none of these nothing is refused. Swap is not counted: factors that are swapped take days.
//!
//! Does not live here: limits that hold whatever the machine (`generate::grid`, `io::msh` of `fluxmorph-geometry`).

use std::path::{Path, PathBuf};

use fluxmorph_geometry::fem::workspace;
use fluxmorph_optimizer::memory_estimate::{Sizes, needs_workspace};
use fluxmorph_optimizer::problem::Problem;

use crate::config::{Config, ConfigError, MeshConfig, SourceMap};
use crate::files::OverwritePolicy;

/// Bytes for each tetrahedron of the leanest set-up: mesh, adjacency, and pattern of a linear problem without motion.
///
/// Measured on the shield with 148 000 tetrahedra: 805 at the peak.
const SETUP_BYTES_PER_TET: u64 = 700;

/// Bytes for each byte of a mesh file while it is read: 4.1 measured for 1.5 million tetrahedra, more for smaller ones.
const READING_BYTES_PER_BYTE: u64 = 4;

/// How much this process may hold in all, and what says so.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Room {
    /// Bytes, those held already included.
    bytes: u64,
    /// What limits it.
    by: &'static str,
    /// Bytes of addresses left out of it that are taken and not used.
    addresses: u64,
}

/// Most tetrahedra of a mesh that a problem can be set up on in the memory that is left.
pub(crate) fn most_tets() -> usize {
    room(0).map_or(usize::MAX, |room| (room.bytes / SETUP_BYTES_PER_TET) as usize)
}

/// Refuses a mesh that cannot fit, before it is made; of a sweep the meshes of all cases.
pub(crate) fn check_mesh(config: &Config, source: &SourceMap) -> Result<(), ConfigError> {
    let Some(room) = room(0) else { return Ok(()) };
    let cases = config.morph.iter().flat_map(|morph| &morph.cases).enumerate();
    let cases = cases.filter_map(|(i, case)| Some((&case.config.as_ref()?.mesh, source.case(i))));
    for (mesh, source) in std::iter::once((&config.mesh, source)).chain(cases) {
        let (key, what, needed) = match mesh {
            MeshConfig::File { path, .. } => {
                // What cannot be looked at fails where it is read.
                let length = std::fs::metadata(path).map_or(0, |file| file.len());
                let what = format!("reading the mesh file of {}", mebibytes(length));
                ("mesh.file", what, length.saturating_mul(READING_BYTES_PER_BYTE))
            }
            generated => {
                // The generator reports the parameters that it refuses.
                let tets = generated.tet_count().unwrap_or(0);
                let what = format!("setting up a mesh of {tets} tetrahedra");
                ("mesh", what, tets.saturating_mul(SETUP_BYTES_PER_TET))
            }
        };
        refuse_beyond(room, source, (key, &what), needed)?;
    }
    Ok(())
}

/// Refuses a problem whose solution on the threads of this pool cannot fit, unless an earlier run is to be replaced: `--force`
/// means both.
pub(crate) fn check_problem(
    problem: &Problem,
    source: &SourceMap,
    overwrite: OverwritePolicy,
) -> Result<(), ConfigError> {
    if overwrite == OverwritePolicy::Replace {
        return Ok(());
    }
    check_estimate(Sizes::of(problem).here() as u64, threads_with_workspace(problem), source)
}

/// Threads that ask for the workspace of the dense kernels in an evaluation.
fn threads_with_workspace(problem: &Problem) -> usize {
    if needs_workspace(problem) { rayon::current_num_threads() } else { 0 }
}

/// The same for a problem of about so many bytes, with this many threads in dense kernels.
fn check_estimate(estimate: u64, threads: usize, source: &SourceMap) -> Result<(), ConfigError> {
    let Some(room) = room(workspace(threads)) else { return Ok(()) };
    refuse_beyond(room, source, ("mesh", "solving the problem"), estimate)
}

/// Addresses of the dense kernels on so many threads [bytes].
fn workspace(threads: usize) -> u64 {
    threads as u64 * workspace::bytes_per_thread() as u64
}

/// Why a problem that is set up cannot be solved; `None` where it can, or nothing is known.
pub(crate) fn shortage_of(problem: &Problem) -> Option<String> {
    let needed = Sizes::of(problem).here() as u64;
    let room = room(workspace(threads_with_workspace(problem)))?;
    (needed > room.bytes).then(|| beyond(room, needed))
}

/// Why so many bytes cannot be held; `None` where they can, or nothing is known.
pub(crate) fn shortage(needed: usize) -> Option<String> {
    room(0).filter(|room| needed as u64 > room.bytes).map(|room| beyond(room, needed as u64))
}

fn beyond(room: Room, needed: u64) -> String {
    let beside = match room.addresses {
        0 => String::new(),
        bytes => format!(", beside {} for the dense kernels of all threads", mebibytes(bytes)),
    };
    let (needed, bytes) = (mebibytes(needed), mebibytes(room.bytes));
    format!("about {needed} of memory, and there are {bytes} ({}{beside})", room.by)
}

fn refuse_beyond(
    room: Room,
    source: &SourceMap,
    (key, what): (&str, &str),
    needed: u64,
) -> Result<(), ConfigError> {
    if needed <= room.bytes {
        return Ok(());
    }
    let message = format!("{what} needs {}", beyond(room, needed));
    let fault = source
        .diagnostic(key, message)
        .expected("a mesh that fits into memory")
        .help("take a coarser mesh or a larger machine, or override the check with --force");
    Err(source.error(vec![fault]))
}

fn mebibytes(bytes: u64) -> String {
    format!("{} MiB", bytes.div_ceil(1 << 20))
}

/// The memory that this process may have beside so many bytes of addresses that it takes and does not use; `None` where the
/// system does not say.
fn room(addresses: u64) -> Option<Room> {
    let read = |path: &str| std::fs::read_to_string(path).unwrap_or_default();
    let [status, limits] = ["/proc/self/status", "/proc/self/limits"].map(read);
    let held = kibibytes(&status, "VmRSS:").unwrap_or(0);
    let own = |size: &str, row: &str| {
        let beyond_held = kibibytes(&status, size).unwrap_or(0).saturating_sub(held);
        soft_limit(&limits, row).map(|limit| limit.saturating_sub(beyond_held).saturating_sub(addresses))
    };
    let machine = kibibytes(&read("/proc/meminfo"), "MemAvailable:").map(|free| free.saturating_add(held));
    let candidates = [
        (machine, "available on this machine", 0),
        (group_room(&read("/proc/self/cgroup"), held), "allowed by the control group", 0),
        (own("VmSize:", "Max address space"), "allowed by the limit on the address space", addresses),
        (own("VmData:", "Max data size"), "allowed by the limit on data", addresses),
    ];
    let known = candidates
        .into_iter()
        .filter_map(|(bytes, by, addresses)| Some(Room { bytes: bytes?, by, addresses }));
    known.min_by_key(|room| room.bytes)
}

/// The number after a label of a file of `/proc`, given there in kB [bytes].
fn kibibytes(text: &str, label: &str) -> Option<u64> {
    let rest = text.lines().find_map(|line| line.strip_prefix(label))?;
    rest.trim().strip_suffix("kB")?.trim().parse::<u64>().ok()?.checked_mul(1024)
}

/// The soft limit in a row of `/proc/self/limits` [bytes]; `None` for an unlimited one.
fn soft_limit(limits: &str, row: &str) -> Option<u64> {
    limits.lines().find_map(|line| line.strip_prefix(row))?.split_whitespace().next()?.parse().ok()
}

/// The least room that the control groups of this process leave it, by version 2 or 1 [bytes].
fn group_room(groups: &str, held: u64) -> Option<u64> {
    const ROOT: &str = "/sys/fs/cgroup";
    let of = |line: &str| {
        let mut parts = line.splitn(3, ':');
        let (_, controllers, path) = (parts.next()?, parts.next()?, parts.next()?);
        let relative = path.trim_start_matches('/');
        if controllers.is_empty() {
            Some((PathBuf::from(ROOT), relative.to_owned(), Names::V2))
        } else if controllers.split(',').any(|name| name == "memory") {
            Some((Path::new(ROOT).join("memory"), relative.to_owned(), Names::V1))
        } else {
            None
        }
    };
    let mut least: Option<u64> = None;
    for (root, relative, names) in groups.lines().filter_map(of) {
        // A limit of any group above holds as well; inside a container the path may be the host's.
        let folder = root.join(relative);
        for folder in folder.ancestors().take_while(|folder| folder.starts_with(&root)) {
            if let Some(room) = names.room(folder, held) {
                least = Some(least.map_or(room, |other| other.min(room)));
            }
        }
    }
    least
}

/// Names of the files of a control group.
#[derive(Clone, Copy)]
enum Names {
    V1,
    V2,
}

impl Names {
    /// The room that one group leaves [bytes].
    fn room(self, folder: &Path, held: u64) -> Option<u64> {
        // What the kernel drops at need: pages of files, and tables of its own.
        let (limit, usage, spare): (_, _, &[&str]) = match self {
            Self::V1 => (
                "memory.limit_in_bytes",
                "memory.usage_in_bytes",
                &["total_inactive_file ", "total_active_file "],
            ),
            Self::V2 => {
                ("memory.max", "memory.current", &["inactive_file ", "active_file ", "slab_reclaimable "])
            }
        };
        let read = |name: &str| std::fs::read_to_string(folder.join(name)).ok();
        let number = |name: &str| read(name)?.trim().parse::<u64>().ok();
        // `max` of version 2 is no number; no limit of version 1 is a huge one.
        let limit = number(limit)?;
        let statistics = read("memory.stat").unwrap_or_default();
        let count =
            |line: &str| spare.iter().find_map(|name| line.strip_prefix(name)?.trim().parse::<u64>().ok());
        let spare = statistics.lines().filter_map(count).fold(0, u64::saturating_add);
        let used = number(usage).unwrap_or(0).saturating_sub(spare);
        Some(limit.saturating_sub(used).saturating_add(held).min(limit))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_tables_of_the_system_are_understood() {
        let status = "Name:\tfluxmorph\nVmSize:\t  123 kB\nVmRSS:\t   45 kB\n";
        assert_eq!(kibibytes(status, "VmRSS:"), Some(45 * 1024));
        assert_eq!(kibibytes(status, "VmData:"), None);
        let limits = "Limit                     Soft Limit           Hard Limit           Units\n\
                      Max data size             unlimited            unlimited            bytes\n\
                      Max address space         1048576              unlimited            bytes\n";
        assert_eq!(soft_limit(limits, "Max address space"), Some(1 << 20));
        assert_eq!(soft_limit(limits, "Max data size"), None);
    }

    #[test]
    fn a_group_leaves_what_its_limit_and_its_cache_say() {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let write = |name: &str, text: &str| std::fs::write(folder.path().join(name), text).expect("written");
        write("memory.max", "1000\n");
        write("memory.current", "900\n");
        write("memory.stat", "anon 1\ninactive_file 200\nactive_file 60\nslab_reclaimable 40\n");
        // 600 are in use, 50 of them by this process.
        assert_eq!(Names::V2.room(folder.path(), 50), Some(450));
        write("memory.max", "max\n");
        assert_eq!(Names::V2.room(folder.path(), 50), None);
        assert_eq!(Names::V1.room(folder.path(), 50), None);
    }

    #[test]
    fn what_does_not_fit_is_refused_unless_forced() {
        let text = "[mesh]\ngenerator = \"block\"\n[analysis]\nfrequency = 0\n";
        let (_, source) = Config::from_str(text, "block.toml").expect("complete");
        let small = Room { bytes: 1 << 20, by: "by the test", addresses: 0 };
        assert!(refuse_beyond(small, &source, ("mesh", "it"), 1 << 20).is_ok());
        let error = refuse_beyond(small, &source, ("mesh", "it"), (1 << 20) + 1).expect_err("too much");
        assert!(
            error.to_string().contains("about 2 MiB of memory, and there are 1 MiB (by the test)"),
            "{error}"
        );
        if room(0).is_some() {
            assert!(check_estimate(u64::MAX, 2, &source).is_err());
        }
    }
}
