//! Gmsh files whose header is right, and what must hold for a mesh that was read from one.
//!
//! The tests of the geometry include this file: it uses nothing else of this crate.

use fluxmorph_geometry::Mesh;
use fluxmorph_geometry::io::{MshEncoding, msh_bytes, read_msh};
use fluxmorph_geometry::tet4::volume;

/// How the numbers of a file are written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Form {
    /// As text.
    Ascii,
    /// As bytes, lowest first.
    Little,
    /// As bytes, highest first.
    Big,
}

/// A whole file: the header of a version and a form, and a body.
///
/// Without it a fuzzer spends its time on headers: nearly all its inputs would be refused in the second line.
pub fn with_header(version: &str, form: Form, body: &[u8]) -> Vec<u8> {
    let binary = u8::from(form != Form::Ascii);
    let mut file = format!("$MeshFormat\n{version} {binary} 8\n").into_bytes();
    match form {
        Form::Ascii => {}
        Form::Little => file.extend([1, 0, 0, 0, b'\n']),
        Form::Big => file.extend([0, 0, 0, 1, b'\n']),
    }
    file.extend(b"$EndMeshFormat\n");
    file.extend(body);
    file
}

/// Reads a file in metres and in millimetres.
///
/// # Panics
/// If what is accepted is no mesh: without elements, with a coordinate that is not finite, with an element of no volume,
/// or not the same after writing and reading it.
pub fn read(file: &[u8]) {
    match read_msh(file, 1.0) {
        Ok(read) => {
            check(&read.mesh);
            // The notices are shown to the user: their text must come.
            let _ = read.notices.messages();
            for encoding in [MshEncoding::Ascii, MshEncoding::Binary] {
                let written = msh_bytes(&read.mesh, 1.0, encoding).expect("what was read can be written");
                let again = read_msh(&written, 1.0).expect("what was written can be read");
                check_same(&again.mesh, &read.mesh);
            }
            if let Ok(read) = read_msh(file, 1e-3) {
                check(&read.mesh);
            }
        }
        Err(error) => assert!(!error.to_string().is_empty()),
    }
}

fn check(mesh: &Mesh) {
    let topology = mesh.topology();
    assert!(!topology.tets().is_empty());
    assert!(mesh.points().iter().flatten().all(|x| x.is_finite()));
    assert!(topology.elements().all(|e| volume(mesh.vertices(e)) > 0.0));
    assert_eq!(topology.region_of().len(), topology.tets().len());
    assert!(topology.region_of().iter().all(|region| region.index() < topology.region_names().len()));
}

/// Asserts that two meshes agree to the bit, up to the order in which triangles of a surface are listed.
///
/// # Panics
/// If they do not.
pub fn check_same(a: &Mesh, b: &Mesh) {
    let bits = |mesh: &Mesh| -> Vec<u64> { mesh.points().iter().flatten().map(|x| x.to_bits()).collect() };
    assert_eq!(bits(a), bits(b));
    let (a, b) = (a.topology(), b.topology());
    assert_eq!(a.tets(), b.tets());
    assert_eq!(a.region_names(), b.region_names());
    assert_eq!(a.region_of(), b.region_of());
    assert!(a.surface_names().eq(b.surface_names()));
    for name in a.surface_names() {
        let triangles = |topology: &fluxmorph_geometry::Topology| {
            let mut sides = topology.surface(name).expect("named").to_vec();
            // Which node of a triangle comes first has no meaning, and neither has the order of triangles.
            for side in &mut sides {
                let least = (0..3).min_by_key(|&k| side[k]).expect("three");
                side.rotate_left(least);
            }
            sides.sort_unstable();
            sides
        };
        assert_eq!(triangles(a), triangles(b), "{name}");
    }
}
