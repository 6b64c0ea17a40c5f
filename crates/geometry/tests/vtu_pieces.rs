//! A mesh in pieces is the whole again, and pieces that do not make a whole are refused.

use fluxmorph_geometry::generate::{BlockParameters, block};
use fluxmorph_geometry::io::{
    ArrayData, Field, VtuArray, VtuContents, VtuPiece, join_pieces, pvtu_pieces, pvtu_text, vtu_bytes,
    vtu_contents,
};
use fluxmorph_geometry::{ElementId, Mesh, NodeId, Partition};

fn mesh() -> Mesh {
    block(&BlockParameters { cells: [5, 4, 6], ..BlockParameters::default() }).expect("valid")
}

fn wave(number: u32) -> f64 {
    (f64::from(number) / 3.0).sin()
}

/// An array of every kind over some nodes and elements.
struct Arrays {
    shift: Vec<[f64; 3]>,
    loss: Vec<f64>,
    region: Vec<i32>,
}

impl Arrays {
    fn new(nodes: &[NodeId], elements: &[ElementId]) -> Self {
        Self {
            shift: nodes.iter().map(|n| [wave(n.0), -wave(n.0), 1e-300 * f64::from(n.0)]).collect(),
            loss: elements.iter().map(|e| wave(e.0)).collect(),
            region: elements.iter().map(|e| e.0 as i32 % 5 - 2).collect(),
        }
    }

    fn at_nodes(&self) -> [Field<'_>; 1] {
        [Field { name: "shift", data: ArrayData::Vector(&self.shift) }]
    }

    fn in_cells(&self) -> [Field<'_>; 2] {
        [
            Field { name: "loss", data: ArrayData::Scalar(&self.loss) },
            Field { name: "region", data: ArrayData::Integer(&self.region) },
        ]
    }
}

fn read(mesh: &Mesh, elements: &[ElementId]) -> VtuContents {
    let piece = VtuPiece::new(mesh.topology(), elements);
    let arrays = Arrays::new(piece.nodes(), piece.elements());
    let bytes = piece.bytes(mesh.points(), &arrays.at_nodes(), &arrays.in_cells()).expect("finite");
    vtu_contents(&bytes).expect("just made")
}

/// Pieces with their names.
type Pieces = Vec<(String, VtuContents)>;

/// What the error says, and what is done to the pieces.
type Fault = (&'static str, fn(&mut Pieces));

fn pieces(mesh: &Mesh) -> Pieces {
    let weights = vec![1; mesh.topology().node_count()];
    let partition = Partition::new(mesh.topology(), 3, &weights, &[]).expect("three ranks");
    let read = |rank| (format!("rank_{rank}"), read(mesh, partition.elements_of(rank)));
    (0..3).map(read).collect()
}

#[test]
fn a_piece_holds_its_elements_the_nodes_they_touch_and_their_numbers() {
    let mesh = mesh();
    let elements = [7, 300, 41, 300].map(ElementId);
    let piece = read(&mesh, &elements);
    assert_eq!(piece.cell_data["GlobalCellIds"], VtuArray::Integer(vec![7, 41, 300]));
    let VtuArray::Integer(nodes) = &piece.point_data["GlobalPointIds"] else { panic!("whole numbers") };
    assert!(nodes.is_sorted_by(|a, b| a < b));
    let mut touched: Vec<i32> =
        elements.iter().flat_map(|&e| mesh.topology().tet(e)).map(|n| n.0 as i32).collect();
    touched.sort_unstable();
    touched.dedup();
    assert_eq!(*nodes, touched);
    for (tet, e) in piece.tets.iter().zip([7, 41, 300]) {
        let global = tet.map(|n| NodeId(nodes[n.index()] as u32));
        assert_eq!(global, mesh.topology().tet(ElementId(e)));
        assert_eq!(tet.map(|n| piece.points[n.index()]), mesh.vertices(ElementId(e)));
    }
}

#[test]
fn pieces_say_which_array_holds_their_numbers() {
    let mesh = mesh();
    let piece = VtuPiece::new(mesh.topology(), &[ElementId(0)]);
    let text =
        String::from_utf8(piece.bytes(mesh.points(), &[], &[]).expect("no arrays")).expect("XML in UTF-8");
    assert!(text.contains("<PointData GlobalIds=\"GlobalPointIds\">"), "{text}");
    assert!(text.contains("<CellData GlobalIds=\"GlobalCellIds\">"), "{text}");
    let whole = String::from_utf8(vtu_bytes(&mesh, &[], &[]).expect("no arrays")).expect("XML in UTF-8");
    assert!(!whole.contains("Global"));
}

#[test]
fn joined_pieces_are_the_whole_bit_for_bit() {
    let mesh = mesh();
    let topology = mesh.topology();
    let (nodes, elements): (Vec<_>, Vec<_>) = (topology.nodes().collect(), topology.elements().collect());
    let arrays = Arrays::new(&nodes, &elements);
    let whole = vtu_bytes(&mesh, &arrays.at_nodes(), &arrays.in_cells()).expect("finite");
    let whole = vtu_contents(&whole).expect("just made");
    let mut pieces = pieces(&mesh);
    // A rank of a small mesh may own no element.
    pieces.insert(1, ("empty".into(), read(&mesh, &[])));
    assert!(
        pieces.iter().map(|(_, piece)| piece.points.len()).sum::<usize>() > nodes.len(),
        "borders are shared"
    );
    // The numbers compare as numbers: none of them is NaN, and zeros have one sign here.
    assert_eq!(join_pieces(pieces.clone()).expect("a whole"), whole);
    pieces.reverse();
    assert_eq!(join_pieces(pieces).expect("a whole"), whole);
}

#[test]
fn the_header_names_arrays_and_pieces() {
    let arrays = Arrays::new(&[], &[]);
    let names = ["eval_0000/rank_000.vtu", "a<b>&\"c\"/rank_001.vtu"].map(str::to_owned);
    let text = pvtu_text(&arrays.at_nodes(), &arrays.in_cells(), &names);
    let expected = r#"<?xml version="1.0"?>
<VTKFile type="PUnstructuredGrid" version="1.0" byte_order="LittleEndian" header_type="UInt64" compressor="vtkZLibDataCompressor">
<PUnstructuredGrid GhostLevel="0">
<PPointData GlobalIds="GlobalPointIds">
<PDataArray type="Float64" Name="shift" NumberOfComponents="3"/>
<PDataArray type="Int64" Name="GlobalPointIds" NumberOfComponents="1"/>
</PPointData>
<PCellData GlobalIds="GlobalCellIds">
<PDataArray type="Float64" Name="loss" NumberOfComponents="1"/>
<PDataArray type="Int32" Name="region" NumberOfComponents="1"/>
<PDataArray type="Int64" Name="GlobalCellIds" NumberOfComponents="1"/>
</PCellData>
<PPoints>
<PDataArray type="Float64" Name="Points" NumberOfComponents="3"/>
</PPoints>
<Piece Source="eval_0000/rank_000.vtu"/>
<Piece Source="a&lt;b&gt;&amp;&quot;c&quot;/rank_001.vtu"/>
</PUnstructuredGrid>
</VTKFile>
"#;
    assert_eq!(text, expected);
    assert_eq!(pvtu_pieces(text.as_bytes()).expect("just made"), names);
    let mesh = mesh();
    assert!(pvtu_pieces(&vtu_bytes(&mesh, &[], &[]).expect("no arrays")).is_err(), "no header");
    assert!(vtu_contents(text.as_bytes()).is_err(), "no mesh");
    assert!(pvtu_pieces(&text.as_bytes()[..text.len() / 2]).is_err(), "cut");
}

#[test]
fn what_makes_no_whole_is_refused_and_the_piece_is_named() {
    let mesh = mesh();
    let sound = pieces(&mesh);
    let faults: [Fault; 7] = [
        ("is missing", |pieces| drop(pieces.remove(1))),
        ("is missing", |pieces| drop(pieces.pop())),
        ("of the piece `rank_2` is in another one", |pieces| {
            let count = pieces[2].1.tets.len() as i32;
            pieces[2].1.cell_data.insert("GlobalCellIds".into(), VtuArray::Integer((0..count).collect()));
        }),
        ("the piece `rank_1` has no array `GlobalCellIds`", |pieces| {
            pieces[1].1.cell_data.remove("GlobalCellIds");
        }),
        ("`GlobalPointIds` of the piece `rank_0` does not ascend", |pieces| {
            if let Some(VtuArray::Integer(ids)) = pieces[0].1.point_data.get_mut("GlobalPointIds") {
                ids[1] = -1;
            }
        }),
        ("node 2147483647 is named", |pieces| {
            if let Some(VtuArray::Integer(ids)) = pieces[0].1.point_data.get_mut("GlobalPointIds")
                && let Some(last) = ids.last_mut()
            {
                *last = i32::MAX;
            }
        }),
        ("the piece `rank_2` has other arrays", |pieces| {
            pieces[2].1.cell_data.remove("loss");
        }),
    ];
    for (expected, fault) in faults {
        let mut pieces = sound.clone();
        fault(&mut pieces);
        let error = join_pieces(pieces).expect_err(expected).to_string();
        assert!(error.contains(expected), "{error}, expected: {expected}");
    }
    assert!(join_pieces(Vec::new()).is_err());
}
