//! Gmsh files that are damaged: refused at the right line or byte, with the node or element named, and never with a panic.
//!
//! More kinds of damage stand in the tables of `tests/config`: `wrong/mesh_files.txt`, word by word, and `meshes.rs`, in every
//! version and form.

use crate::msh_support::{Device, Form, Random, SOUND_V2, SOUND_V4, Version};
use fluxmorph_geometry::io::msh::{MshError, Place, Subject};
use fluxmorph_geometry::io::read_msh;

/// What is changed, where that is found, which subject is named, and a part of the message.
type Damage = (&'static str, &'static str, usize, &'static str, &'static str);

const V4_DAMAGE: &[Damage] = &[
    ("4.1 0 8", "5 0 8", 2, "section $MeshFormat", "version 5"),
    ("4.1 0 8", "nan 0 8", 2, "section $MeshFormat", "version nan"),
    ("4.1 0 8", "4.1 0", 2, "section $MeshFormat", "expected the data size"),
    ("$MeshFormat\n", "$NOD\n", 1, "file", "version 1"),
    ("$EndMeshFormat", "$EndMeshForma", 3, "section $MeshFormat", "found `$EndMeshForma`"),
    ("$PhysicalNames\n3", "$PhysicalNames\n99999999999", 6 + 3, "section $PhysicalNames", "dimension"),
    ("$PhysicalNames\n3", "$PhysicalNames\n-3", 5, "section $PhysicalNames", "found `-3`"),
    (
        "$PhysicalNames\n3",
        "$PhysicalNames\n2",
        8,
        "section $PhysicalNames",
        "expected the end of the section",
    ),
    ("2 1 \"face\"", "2 -1 \"face\"", 6, "section $PhysicalNames", "found `-1`"),
    ("2 1 \"face\"", "2 1 \"fa\"ce\"", 6, "physical group 1 of dimension 2", "holds a double quote"),
    ("2 1 \"face\"", "2 1 \"fa\u{7}ce\"", 6, "physical group 1 of dimension 2", "control character"),
    ("2 1 \"face\"", "2 1 \"\"", 6, "physical group 1 of dimension 2", "is empty"),
    ("3 2 \"right\"", "3 1 \"right\"", 8, "physical group 1 of dimension 3", "declared a second time"),
    (
        "3 2 \"right\"",
        "3 5 \"volume_2\"",
        1,
        "physical group 5 of dimension 3",
        "`volume_2` belongs to group 2",
    ),
    ("$PhysicalNames\n3", "$Nodes\n3", 5, "section $Nodes", "expected"),
    ("0 0 1 2\n", "0 0 1 -2\n", 11, "section $Entities", "found `-2`"),
    ("0 0 1 2\n", "0 0 1\n", 11, "section $Entities", "the end of the line"),
    ("0 0 1 2\n", "0 0 1 1\n", 14, "section $Entities", "expected the end of the section"),
    ("0 0 1 2\n", "0 0 1 3\n", 15, "section $Entities", "the tag of an entity"),
    ("0 0 1 2\n", "0 0 1 18446744073709551615\n", 15, "section $Entities", "the tag of an entity"),
    ("2 0 0 0 1 1 1 1 2 0", "1 0 0 0 1 1 1 1 2 0", 14, "entity 1 of dimension 3", "declared a second time"),
    ("2 0 0 0 1 1 1 1 2 0", "2 0 0 x 1 1 1 1 2 0", 14, "entity 2 of dimension 3", "found `x`"),
    ("2 0 0 0 1 1 1 1 2 0", "2 0 0 0 1 1 1 999999999 2 0", 14, "entity 2 of dimension 3", "at most"),
    ("2 0 0 0 1 1 1 1 2 0", "3000000000 0 0 0 1 1 1 1 2 0", 14, "section $Entities", "found `3000000000`"),
    ("$Entities", "$PartitionedEntities", 10, "section $PartitionedEntities", "partitioned"),
    (
        "$EndEntities\n",
        "$EndEntities\n$GhostElements\n0\n$EndGhostElements\n",
        16,
        "section $GhostElements",
        "partitioned",
    ),
    (
        "$EndEntities\n",
        "$EndEntities\n$Entities\n0 0 0 0\n$EndEntities\n",
        16,
        "section $Entities",
        "a second time",
    ),
    ("$EndEntities\n", "$EndEntities\n$Unfinished\n1 2 3\n", 17, "section $Unfinished", "file ends"),
    ("2 5 1 5", "2 4 1 5", 27, "section $Nodes", "blocks announce 5"),
    ("2 5 1 5", "2 18446744073709551616 1 5", 17, "section $Nodes", "expected the number"),
    ("2 5 1 5", "3 5 1 5", 30, "section $Nodes", "the dimension of an entity"),
    ("3 1 0 4", "7 1 0 4", 18, "section $Nodes", "found `7`"),
    ("3 1 0 4", "3 1 2 4", 18, "section $Nodes", "found `2`"),
    ("3 1 0 4", "3 1 0 99999", 18, "section $Nodes", "99999 nodes"),
    ("3 1 0 4", "3 1 1 4", 23, "node 1", "parametric"),
    ("\n4\n0 0 0", "\n-4\n0 0 0", 22, "section $Nodes", "found `-4`"),
    ("\n4\n0 0 0", "\n4.5\n0 0 0", 22, "section $Nodes", "found `4.5`"),
    ("\n4\n0 0 0", "\n4 4\n0 0 0", 22, "node 4", "the end of the line"),
    ("\n0 0 1\n", "\n0 0 1e999\n", 26, "node 4", "inf"),
    ("3 3 1 3", "3 4 1 3", 32, "section $Elements", "4 elements are announced"),
    ("3 3 1 3", "3 2 1 3", 37, "section $Elements", "blocks announce 3"),
    ("3 1 4 1", "3 1 2 1", 35, "entity 1 of dimension 3", "a triangle cannot lie"),
    ("3 1 4 1", "3 1 5 1", 36, "element 2", "hexahedron"),
    (
        "3 1 4 1\n2 1 2 3 4",
        "3 1 7 1\n2 1 2 3 4 5",
        36,
        "element 2",
        "pyramid stands in the physical volume `left`",
    ),
    ("3 1 4 1", "3 1 4 8888", 35, "section $Elements", "8888 elements"),
    ("2 1 2 3 4\n", "2 1 2 3\n", 36, "element 2", "the tag of a node"),
    ("2 1 2 3 4\n", "2 1 2 3 -4\n", 36, "element 2", "found `-4`"),
    ("2 1 2 3 4\n", "x 1 2 3 4\n", 36, "section $Elements", "found `x`"),
    ("3 5 2 4 3\n", "3 1 2 4 3\n", 38, "element 3", "`left` and `right`"),
    ("3 5 2 4 3\n$EndElements", "3 5 2 4 3\n$EndNodes", 39, "section $Elements", "found `$EndNodes`"),
];

const V2_DAMAGE: &[Damage] = &[
    ("2.2 0 8", "2.3 0 8", 2, "section $MeshFormat", "version 2.3"),
    ("$Nodes\n", "$ParametricNodes\n", 10, "section $ParametricNodes", "Mesh.SaveParametric = 0"),
    ("$Nodes\n5", "$Nodes\n6", 17, "section $Nodes", "found `$EndNodes`"),
    ("$Nodes\n5", "$Nodes\n4", 16, "section $Nodes", "expected the end of the section"),
    ("$Nodes\n5", "$Nodes\n5000", 11, "section $Nodes", "5000 nodes"),
    ("$Nodes\n5", "$Nodes\n-5", 11, "section $Nodes", "found `-5`"),
    ("$Nodes\n", "$Elements\n", 10, "section $Elements", "after $Nodes"),
    ("5 1 1 1", "4 1 1 1", 16, "node 4", "given at line 15"),
    ("5 1 1 1", "5 1 1", 16, "node 5", "the z coordinate"),
    ("5 1 1 1", "-5 1 1 1", 16, "section $Nodes", "found `-5`"),
    ("$EndNodes\n", "$EndNodes\n$Nodes\n0\n$EndNodes\n", 18, "section $Nodes", "a second time"),
    (
        "$EndNodes\n",
        "$EndNodes\n$PhysicalNames\n0\n$EndPhysicalNames\n",
        18,
        "section $PhysicalNames",
        "a second time",
    ),
    ("2 4 2 1 1 1 2 3 4", "2 4 5 1 1 2 3 -4 1 2 3 4", 21, "element 2", "partitioned"),
    (
        "2 4 2 1 1 1 2 3 4",
        "2 7 2 1 1 1 2 3 4 5",
        21,
        "element 2",
        "pyramid stands in the physical volume `left`",
    ),
    ("2 4 2 1 1 1 2 3 4", "2 4 -2 1 1 1 2 3 4", 21, "element 2", "found `-2`"),
    ("2 4 2 1 1 1 2 3 4", "2 4 200 1 1 1 2 3 4", 21, "element 2", "200 tags"),
    ("3 4 2 2 2 5 2 4 3", "3 4 2 2 2 2 1 4 3", 22, "element 3", "`left` and `right`"),
    ("$Elements\n3", "$Elements\n4", 23, "section $Elements", "found `$EndElements`"),
    (
        "$Elements\n3\n1 2 2 1 1 2 3 4\n2 4 2 1 1 1 2 3 4\n3 4 2 2 2 5 2 4 3\n",
        "$Elements\n0\n",
        21,
        "file",
        "no tetrahedron",
    ),
    ("3 4 2 2 2 5 2 4 3\n$EndElements\n", "3 4 2 2 2 5 2 4 3\n", 23, "section $Elements", "file ends"),
];

#[track_caller]
fn refused(bytes: &[u8], what: &str) -> MshError {
    match read_msh(bytes, 1.0) {
        Err(error) => error,
        Ok(_) => panic!("{what}: was read"),
    }
}

#[test]
fn every_damage_is_refused_at_its_line_with_its_subject() {
    let mut wrong = Vec::new();
    let mut cases = 0;
    for (text, damages) in [(SOUND_V4, V4_DAMAGE), (SOUND_V2, V2_DAMAGE)] {
        assert!(read_msh(text.as_bytes(), 1.0).is_ok());
        for &(from, to, line, subject, says) in damages {
            assert!(text.contains(from), "{from}");
            let error = refused(text.replacen(from, to, 1).as_bytes(), to);
            let message = error.to_string();
            cases += 1;
            if error.place != Place::Line(line)
                || error.subject.to_string() != subject
                || !message.contains(says)
            {
                wrong.push(format!("{to:?}: line {line}, {subject}: {says}\n    but {message}"));
            }
        }
    }
    assert!(cases >= 60, "{cases}");
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

#[test]
fn a_file_cut_off_anywhere_is_refused() {
    for text in [SOUND_V4, SOUND_V2] {
        // Behind the last mark only the line end is missing.
        for end in 0..text.len() - 1 {
            refused(&text.as_bytes()[..end], &text[..end]);
        }
    }
    let device = Device::random(&mut Random(2), 1 << 20);
    for (version, form) in [(Version::V2, Form::Little), (Version::V4, Form::Big)] {
        let bytes = device.bytes(version, form);
        for end in 0..bytes.len() - 1 {
            let error = refused(&bytes[..end], "binary");
            // Once the header is complete, places are bytes of the file.
            if end > 60 {
                assert!(matches!(error.place, Place::Byte(at) if at <= end), "{end}: {error}");
            }
        }
    }
}

/// The bytes with others from `at` on.
fn replaced(bytes: &[u8], at: usize, new: &[u8]) -> Vec<u8> {
    [&bytes[..at], new, &bytes[at + new.len()..]].concat()
}

#[test]
fn damage_in_binary_files_is_found_at_its_byte() {
    let device = Device::random(&mut Random(4), 1000);
    let find = |bytes: &[u8], mark: &[u8]| bytes.windows(mark.len()).position(|w| w == mark).expect("there");
    for form in [Form::Little, Form::Big] {
        let order = |mut bytes: [u8; 8]| {
            if form == Form::Big {
                bytes.reverse();
            }
            bytes
        };
        let bytes = device.bytes(Version::V4, form);
        let at = find(&bytes, &order(device.nodes[3].1[0].to_le_bytes()));
        // The y coordinate of the fourth node.
        let error = refused(&replaced(&bytes, at + 8, &order(f64::NAN.to_le_bytes())), "NaN");
        assert_eq!((error.place, error.subject), (Place::Byte(at + 8), Subject::Node(device.nodes[3].0)));

        // The last node of the first tet of the last block.
        let group = device.tets.iter().map(|t| t.2).max().expect("tets");
        let (tag, nodes, _) = device.tets.iter().find(|t| t.2 == group).expect("a tet");
        let record: Vec<u8> =
            std::iter::once(tag).chain(nodes).flat_map(|n| order(n.to_le_bytes())).collect();
        let at = find(&bytes, &record);
        let error = refused(&replaced(&bytes, at + 32, &order(123_456u64.to_le_bytes())), "dangling");
        assert_eq!((error.place, &error.subject), (Place::Byte(at + 32), &Subject::Element(*tag)));
        assert!(error.to_string().contains("node 123456"), "{error}");

        // A count that no memory could hold.
        let at = find(&bytes, b"$Nodes\n") + 7;
        let error = refused(&replaced(&bytes, at + 8, &[0x7f; 8]), "count");
        assert_eq!(error.place, Place::Byte(at + 8));
        let at = find(&bytes, b"4.1 1 8\n") + 8;
        assert_eq!(refused(&replaced(&bytes, at, &[3]), "byte order").place, Place::Byte(at));
    }
    let bytes = device.bytes(Version::V2, Form::Little);
    let at = find(&bytes, b"$Elements\n") + b"$Elements\n".len();
    let at = at + bytes[at..].iter().position(|&b| b == b'\n').expect("a line") + 1;
    for (field, value) in [(0, 99), (1, 1_000_000), (1, -1), (2, -1), (2, 1_000_000)] {
        let error = refused(&replaced(&bytes, at + 4 * field, &i32::to_le_bytes(value)), "head");
        assert!(
            matches!(error.place, Place::Byte(place) if place >= at && place <= at + 16),
            "{field} {value}: {error}"
        );
    }
}
