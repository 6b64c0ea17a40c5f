//! Files that once were a finding, and the files that fuzzing starts from.
//!
//! `tests/regressions/*.msh` are whole files that made a reader panic, hang or take too much memory, or that it should
//! have refused; any answer in time will do. `fuzz/seeds/msh*` are sound files without their headers, as the targets of
//! `fuzz/` take them: a seed that is refused leads a fuzzer nowhere.

use std::path::{Path, PathBuf};
use std::time::Duration;

use crate::msh::CLUTTERED;
use crate::msh_support::{Device, Form, Random, Version};
use cpu_time::ThreadTime;
use fluxmorph_geometry::io::{MshEncoding, msh_bytes, read_msh};

/// Files of a folder below that of the crate, in the order of their names.
fn files(folder: &str) -> Vec<(PathBuf, Vec<u8>)> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join(folder);
    let entries = std::fs::read_dir(&folder).unwrap_or_else(|error| panic!("{}: {error}", folder.display()));
    let mut paths: Vec<PathBuf> = entries.map(|entry| entry.expect("readable").path()).collect();
    paths.sort();
    paths.into_iter().map(|path| (path.clone(), std::fs::read(path).expect("readable"))).collect()
}

#[test]
fn every_former_finding_is_answered_in_time() {
    for (path, bytes) in files("tests/regressions") {
        let start = ThreadTime::now();
        let answer = read_msh(&bytes, 1.0);
        // The limit that the fuzz targets run with.
        assert!(start.elapsed() < Duration::from_secs(2), "{}: {:?}", path.display(), start.elapsed());
        if let Err(error) = answer {
            assert!(!error.to_string().is_empty(), "{}", path.display());
        }
    }
}

#[test]
fn triangles_that_a_file_repeats_by_its_groups_are_refused() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/regressions/triangles_times_groups.msh");
    let error = read_msh(&std::fs::read(path).expect("a file"), 1.0).expect_err("17 million triangles");
    assert!(error.to_string().contains("triangles in physical surfaces"), "{error}");
}

/// A whole file of a seed of a target.
fn whole(target: &str, seed: &[u8]) -> Vec<u8> {
    let header = |version: &str, form: &str, mark: &[u8]| {
        let head = format!("$MeshFormat\n{version} {form} 8\n");
        [head.as_bytes(), mark, b"$EndMeshFormat\n"].concat()
    };
    let (little, big) = (b"\x01\0\0\0\n", b"\0\0\0\x01\n");
    match (target, seed.split_first().expect("a seed holds something")) {
        ("msh41_ascii", _) => [&header("4.1", "0", b""), seed].concat(),
        ("msh41_binary", (b'l', body)) => [&header("4.1", "1", little), body].concat(),
        ("msh41_binary", (b'b', body)) => [&header("4.1", "1", big), body].concat(),
        ("msh22", (b'a', body)) => [&header("2.2", "0", b""), body].concat(),
        ("msh22", (b'l', body)) => [&header("2.2", "1", little), body].concat(),
        ("msh22", (b'b', body)) => [&header("2.2", "1", big), body].concat(),
        (_, (_, body)) => body.to_vec(),
    }
}

const TARGETS: [&str; 3] = ["msh22", "msh41_ascii", "msh41_binary"];

#[test]
fn every_seed_of_the_fuzz_targets_is_a_mesh() {
    for target in TARGETS {
        let seeds = files(&format!("../../fuzz/seeds/{target}"));
        assert!(seeds.len() >= 3, "{target}");
        for (path, seed) in seeds {
            let read = read_msh(&whole(target, &seed), 1.0);
            assert!(read.is_ok(), "{}: {}", path.display(), read.expect_err("refused"));
        }
    }
}

/// Two tetrahedra and a point in version 2.2, the second of second order.
const QUADRATIC: &str = "$Nodes\n12\n1 0 0 0\n2 1 0 0\n3 0 1 0\n4 0 0 1\n5 1 1 1\n6 0 0 0\n7 0 0 0\n8 0 0 0\n9 0 0 0
10 0 0 0\n11 0 0 0\n12 3 3 3\n$EndNodes
$Elements\n4\n1 15 2 0 1 12\n2 2 2 1 1 2 3 4\n3 4 4 1 1 1 7 1 2 3 4\n4 11 2 2 2 5 2 4 3 6 7 8 9 10 11\n$EndElements\n";

/// Writes the seeds of meshes: `cargo test --release -p fluxmorph-geometry --test geometry -- --ignored write_the_seeds`.
#[test]
#[ignore = "writes fuzz/seeds"]
fn write_the_seeds() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../fuzz/seeds");
    let write = |target: &str, name: &str, bytes: &[u8]| {
        let folder = folder.join(target);
        std::fs::create_dir_all(&folder).expect("a folder");
        std::fs::write(folder.join(name), bytes).expect("a file");
    };
    let body = |bytes: &[u8]| {
        let mark = b"$EndMeshFormat\n";
        let at = bytes.windows(mark.len()).position(|w| w == mark).expect("a header");
        bytes[at + mark.len()..].to_vec()
    };
    let forms = [(Form::Ascii, b'a'), (Form::Little, b'l'), (Form::Big, b'b')];
    for seed in 1..=2 {
        let mut device = Device::random(&mut Random(seed), 100);
        // Names are enough once; a small mesh is changed more often in the same time.
        while device.tets.len() > 12 {
            device = Device::random(&mut Random(device.nodes[0].0 + device.tets.len() as u64), 100);
        }
        for (form, choice) in forms {
            let chosen = |bytes: &[u8]| [&[choice], &body(bytes)[..]].concat();
            write("msh22", &format!("{}{seed}", choice as char), &chosen(&device.bytes(Version::V2, form)));
            let bytes = device.bytes(Version::V4, form);
            match form {
                Form::Ascii => write("msh41_ascii", &format!("{seed}"), &body(&bytes)),
                _ => write("msh41_binary", &format!("{}{seed}", choice as char), &chosen(&bytes)),
            }
        }
        write("msh22", &format!("w{seed}"), &[b"w", &device.bytes(Version::V2, Form::Ascii)[..]].concat());
        write(
            "msh41_binary",
            &format!("w{seed}"),
            &[b"w", &device.bytes(Version::V4, Form::Big)[..]].concat(),
        );
        let mesh = device.mesh(|x| x);
        let own = msh_bytes(&mesh, 1.0, MshEncoding::Ascii).expect("finite");
        write("msh41_ascii", &format!("own{seed}"), &body(&own));
        let own = msh_bytes(&mesh, 1.0, MshEncoding::Binary).expect("finite");
        write("msh41_binary", &format!("own{seed}"), &[b"l", &body(&own)[..]].concat());
    }
    write(
        "msh41_ascii",
        "cluttered",
        CLUTTERED.split_once("$EndMeshFormat\n").expect("a header").1.as_bytes(),
    );
    write("msh22", "quadratic", &[b"a", QUADRATIC.as_bytes()].concat());
}
