//! VTU files read back as they were written, and what may not be written is refused.

use fluxmorph_geometry::generate::{BlockParameters, ShieldParameters, block, shield};
use fluxmorph_geometry::io::{ArrayData, Field, VtuArray, read_vtu, vtu_bytes, vtu_contents};
use fluxmorph_geometry::{Mesh, MeshError, quality};
use vtkio::model::{CellType, DataSet, Piece, Vtk};

fn scalar<'a>(name: &'a str, values: &'a [f64]) -> Field<'a> {
    Field { name, data: ArrayData::Scalar(values) }
}

/// One array of each kind over the nodes and over the elements, with values of many magnitudes.
fn round_trip(mesh: &Mesh) {
    let topology = mesh.topology();
    let sines: Vec<f64> = topology.nodes().map(|n| f64::from(n.0).sin() * 1e-200).collect();
    let shifts: Vec<[f64; 3]> = mesh.points().iter().map(|p| [p[1] / 3.0, -p[2], 1e300 * p[0]]).collect();
    let regions: Vec<i32> = topology.region_of().iter().map(|r| r.0 as i32 - 1).collect();
    let qualities = quality::qualities(mesh);
    let point_data = [scalar("sine", &sines), Field { name: "shift", data: ArrayData::Vector(&shifts) }];
    let cell_data =
        [Field { name: "region", data: ArrayData::Integer(&regions) }, scalar("quality", &qualities)];

    let folder = tempfile::tempdir().expect("a temporary folder");
    let path = folder.path().join("mesh.vtu");
    let bytes = vtu_bytes(mesh, &point_data, &cell_data).expect("all arrays are finite");
    std::fs::write(&path, bytes).expect("the folder is writable");
    let read = read_vtu(&path).expect("it was just written");

    assert_eq!(read.points, mesh.points());
    assert_eq!(read.tets, topology.tets());
    assert_eq!(read.point_data.keys().collect::<Vec<_>>(), ["shift", "sine"]);
    assert_eq!(read.cell_data.keys().collect::<Vec<_>>(), ["quality", "region"]);
    assert_eq!(read.point_data["sine"], VtuArray::Scalar(sines.clone()));
    assert_eq!(read.point_data["shift"], VtuArray::Vector(shifts.clone()));
    assert_eq!(read.cell_data["region"], VtuArray::Integer(regions.clone()));
    assert_eq!(read.cell_data["quality"], VtuArray::Scalar(qualities.clone()));

    let again = vtu_bytes(mesh, &point_data, &cell_data).expect("all arrays are finite");
    assert_eq!(std::fs::read(&path).expect("it was just written"), again, "equal input makes equal bytes");
    another_reader_finds(mesh, &again);
}

/// A reader that was not written here.
fn another_reader_finds(mesh: &Mesh, bytes: &[u8]) {
    let DataSet::UnstructuredGrid { pieces, .. } = Vtk::parse_xml(bytes).expect("well formed").data else {
        panic!("another kind of data")
    };
    let Ok([Piece::Inline(piece)]) = <[_; 1]>::try_from(pieces) else { panic!("one piece inline") };
    assert_eq!(piece.points.cast_into::<f64>().expect("numbers"), mesh.points().as_flattened());
    assert!(piece.cells.types.iter().all(|t| *t == CellType::Tetra));
    let (connectivity, offsets) = piece.cells.cell_verts.into_xml();
    let nodes = mesh.topology().tets().as_flattened();
    assert!(connectivity.iter().copied().eq(nodes.iter().map(|n| u64::from(n.0))));
    assert!(offsets.iter().copied().eq((1..=mesh.topology().tets().len() as u64).map(|e| 4 * e)));
    assert_eq!((piece.data.point.len(), piece.data.cell.len()), (2, 2));
}

#[test]
fn a_shield_reads_back_bit_for_bit() {
    round_trip(&shield(&ShieldParameters { refinement: 0.5, ..ShieldParameters::default() }).expect("valid"));
}

#[test]
fn arrays_that_would_fill_whole_blocks_read_back() {
    // Connectivity of 6 and 12 times 64 KiB; in the second, scalars of the elements of 3 times 64 KiB.
    for cells in [[8, 16, 16], [16; 3]] {
        let mesh = block(&BlockParameters { cells, ..BlockParameters::default() }).expect("valid");
        assert_eq!(32 * mesh.topology().tets().len() % 65_536, 0);
        round_trip(&mesh);
    }
}

#[test]
fn the_header_says_how_arrays_are_stored() {
    let mesh = block(&BlockParameters { cells: [1; 3], ..BlockParameters::default() }).expect("valid");
    let text = String::from_utf8(vtu_bytes(&mesh, &[], &[]).expect("no arrays")).expect("XML in UTF-8");
    assert!(text.contains("compressor=\"vtkZLibDataCompressor\"") && text.contains("header_type=\"UInt64\""));
    assert!(!text.contains("appended"));
}

#[test]
fn regions_are_named_by_their_numbers() {
    let mesh = shield(&ShieldParameters { refinement: 0.5, ..ShieldParameters::default() }).expect("valid");
    let text = String::from_utf8(vtu_bytes(&mesh, &[], &[]).expect("no arrays")).expect("XML in UTF-8");
    let (_, rest) = text.split_once("Name=\"region_names\"").expect("an array of texts");
    let (attributes, rest) = rest.split_once('>').expect("the end of a tag");
    let (bytes, _) = rest.split_once('<').expect("the end of an element");
    let bytes: Vec<u8> = bytes.split_whitespace().map(|byte| byte.parse().expect("a byte")).collect();
    let names: Vec<&[u8]> =
        bytes.strip_suffix(&[0]).expect("each name ends with a zero").split(|&b| b == 0).collect();
    let expected: Vec<&[u8]> = mesh.topology().region_names().iter().map(|name| name.as_bytes()).collect();
    assert_eq!(names, expected);
    assert!(attributes.contains(&format!("NumberOfTuples=\"{}\"", expected.len())), "{attributes}");
}

#[test]
fn the_bytes_do_not_depend_on_the_number_of_threads() {
    let mesh = shield(&ShieldParameters { refinement: 0.5, ..ShieldParameters::default() }).expect("valid");
    let qualities = quality::qualities(&mesh);
    let with = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("a pool");
        pool.install(|| vtu_bytes(&mesh, &[], &[scalar("quality", &qualities)])).expect("finite")
    };
    let one = with(1);
    assert!(one == with(2) && one == with(4));
}

#[test]
fn what_is_not_finite_or_of_wrong_length_is_refused() {
    let mesh = block(&BlockParameters { cells: [1; 3], ..BlockParameters::default() }).expect("valid");
    let mut vectors = [[0.0; 3]; 8];
    vectors[5][2] = f64::INFINITY;
    let field = Field { name: "displacement", data: ArrayData::Vector(&vectors) };
    let text = vtu_bytes(&mesh, &[field], &[]).expect_err("it is infinite").to_string();
    assert!(text.contains("`displacement` holds inf at position 5"), "{text}");
    let result = vtu_bytes(&mesh, &[], &[scalar("quality", &[0.0, f64::NAN, 0.0, 0.0, 0.0, 0.0])]);
    assert!(matches!(result, Err(MeshError::NotFiniteArray { position: 1, .. })), "{result:?}");
    let result = vtu_bytes(&mesh, &[], &[scalar("quality", &[0.5; 8])]);
    assert!(matches!(result, Err(MeshError::ArrayLength { length: 8, expected: 6, .. })), "{result:?}");
}

#[test]
fn names_are_escaped() {
    let mesh = block(&BlockParameters { cells: [1; 3], ..BlockParameters::default() }).expect("valid");
    let name = "<B> & \"H\"";
    let bytes = vtu_bytes(&mesh, &[], &[scalar(name, &[0.5; 6])]).expect("finite");
    assert!(vtu_contents(&bytes).expect("well formed").cell_data.contains_key(name));
}

#[test]
fn damaged_files_are_errors() {
    let mesh = block(&BlockParameters { cells: [2, 2, 3], ..BlockParameters::default() }).expect("valid");
    let bytes = vtu_bytes(&mesh, &[], &[scalar("quality", &[0.5; 72])]).expect("finite");
    let text = String::from_utf8(bytes.clone()).expect("XML in UTF-8");
    let mut results = vec![vtu_contents(b""), vtu_contents(b"<VTKFile/>")];
    results.extend((0..bytes.len() - 20).step_by(97).map(|n| vtu_contents(&bytes[..n])));
    results.push(vtu_contents(text.replacen("AAAA", "////", 3).as_bytes()));
    results.push(vtu_contents(text.replacen("NumberOfPoints=\"36\"", "NumberOfPoints=\"35\"", 1).as_bytes()));
    results.push(vtu_contents(text.replacen("NumberOfCells=\"72\"", "NumberOfCells=\"71\"", 1).as_bytes()));
    for (n, result) in results.iter().enumerate() {
        assert!(matches!(result, Err(MeshError::Vtu { .. })), "case {n}");
    }
    let missing = read_vtu(std::path::Path::new("no/such/file.vtu"));
    assert!(matches!(missing, Err(MeshError::File { .. })));
}
