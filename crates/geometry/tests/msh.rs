//! Gmsh files that are sound: read exactly, in every form; written so that they are read back exactly.

use crate::msh_support::fuzzed::check_same;
use crate::msh_support::{Device, Form, Random, Version, Writer, assert_same};
use fluxmorph_geometry::generate::{ShieldParameters, shield};
use fluxmorph_geometry::io::{MshEncoding, msh_bytes, read_msh};

const FORMS: [Form; 3] = [Form::Ascii, Form::Little, Form::Big];

#[test]
fn two_hundred_generated_files_are_read_exactly() {
    let mut random = Random(1);
    for case in 0..200 {
        let version = [Version::V2, Version::V4][case % 2];
        let form = FORMS[case / 2 % 3];
        // Dense, sparse, and (version 4 has 64 bits) huge tags.
        let limit = match (case / 6 % 3, version) {
            (0, _) => 100,
            (1, _) | (_, Version::V2) => 1 << 30,
            _ => u64::MAX - 1,
        };
        let device = Device::random(&mut random, limit);
        let bytes = device.bytes(version, form);
        let (unit, scale): (f64, fn(f64) -> f64) =
            if case % 5 == 0 { (1e-3, |x| x / 1e3) } else { (1.0, |x| x) };
        let read = read_msh(&bytes, unit).unwrap_or_else(|error| panic!("{case}: {error}"));
        assert_same(&read.mesh, &device.mesh(scale));
        // Some groups of the device have no name; nothing else is to be told.
        let unnamed = usize::from(!read.notices.unnamed_groups.is_empty());
        assert_eq!(read.notices.messages().len(), unnamed, "{case}: {:?}", read.notices);
        assert!(read.notices.unnamed_groups.iter().all(|name| name.starts_with(['v', 's'])), "{case}");
        for encoding in [MshEncoding::Ascii, MshEncoding::Binary] {
            let written = msh_bytes(&read.mesh, unit, encoding).expect("finite");
            let again = read_msh(&written, unit).unwrap_or_else(|error| panic!("{case}: {error}"));
            assert_same(&again.mesh, &device.mesh(scale));
        }
    }
}

#[test]
fn a_generated_shield_goes_through_a_file_in_metres() {
    let mesh = shield(&ShieldParameters { refinement: 0.5, ..ShieldParameters::default() }).expect("valid");
    for encoding in [MshEncoding::Ascii, MshEncoding::Binary] {
        let bytes = msh_bytes(&mesh, 1.0, encoding).expect("finite");
        assert_eq!(bytes, msh_bytes(&mesh, 1.0, encoding).expect("finite"));
        assert_same(&read_msh(&bytes, 1.0).expect("sound").mesh, &mesh);
    }
}

#[test]
fn surfaces_that_see_one_face_from_both_sides_keep_their_sides() {
    let mesh = shield(&ShieldParameters { refinement: 0.5, ..ShieldParameters::default() }).expect("valid");
    let mut topology = mesh.topology().as_ref().clone();
    for name in ["plate|remesh", "remesh|plate"] {
        let faces = topology.faces_between(name).expect("they touch");
        topology = topology.with_surface(name, faces).expect("its own nodes");
    }
    let mesh = fluxmorph_geometry::Mesh::new(topology.into(), mesh.points().to_vec()).expect("as before");
    let bytes = msh_bytes(&mesh, 1.0, MshEncoding::Binary).expect("finite");
    check_same(&read_msh(&bytes, 1.0).expect("sound").mesh, &mesh);
}

/// Two tets, one of them left-handed, with nodes and elements that are of no use, and every kind of extra section.
pub(crate) const CLUTTERED: &str = "$MeshFormat\n4.1 0 8\n$EndMeshFormat
$Comments\nanything at all, $EndNodes too\n$EndComments
$PhysicalNames\n3\n1 9 \"edge\"\n2 4 \"top | side\"\n3 2 \"iron\"\n$EndPhysicalNames
$Entities\n1 1 2 2\n1 0 0 0 0\n1 0 0 0 1 0 0 1 9 2 1 -1\n1 0 0 0 1 1 1 1 -4 1 1\n2 0 0 0 1 1 1 0 0
1 0 0 0 1 1 1 1 -2 1 1\n2 0 0 0 1 1 1 1 5 0\n$EndEntities
$Nodes\n2 7 1 20\n2 1 1 3\n1\n2\n3\n0 0 0 0.5 0.5\n1 0 0 0.5 0.5\n0 1 0 0.5 0.5\n3 1 0 4\n4\n5\n19\n20\n0 0 1
0 0 -1\n7 7 7\n8 8 8\n$EndNodes
$Elements\n6 8 1 8\n0 1 15 1\n1 1\n1 1 1 2\n2 1 2\n3 2 3\n2 1 2 2\n4 1 3 2\n5 1 3 19\n2 2 2 1\n6 1 2 4
3 1 4 1\n7 1 2 3 4\n3 2 4 1\n8 1 2 3 5\n$EndElements
$Periodic\n1\n0 1 1\n0\n1\n1 1\n$EndPeriodic
$NodeData\n1\n\"a view\"\n1\n0\n3\n0\n1\n1\n1 2.5\n$EndNodeData\n";

#[test]
fn what_is_of_no_use_is_skipped_with_a_count() {
    let read = read_msh(CLUTTERED.as_bytes(), 1.0).unwrap_or_else(|error| panic!("{error}"));
    let topology = read.mesh.topology();
    assert_eq!(topology.region_names(), ["iron", "volume_5"]);
    assert_eq!((topology.node_count(), topology.tets().len()), (5, 2));
    // The negative physical tag turns the triangle around.
    let top = topology.surface("top | side").expect("named");
    assert_eq!(top.iter().map(|t| t.map(|n| n.0)).collect::<Vec<_>>(), [[0, 1, 2]]);
    let notices = &read.notices;
    assert_eq!(notices.skipped.iter().collect::<Vec<_>>(), [(&"line", &2), (&"point", &1)]);
    assert_eq!((notices.reoriented, notices.unused_nodes, notices.ungrouped_triangles), (1, 2, 1));
    assert_eq!(notices.loose_triangles.get("top | side"), Some(&1));
    assert_eq!(notices.unnamed_groups, ["volume_5"]);
    assert_eq!(notices.messages().len(), 6);
}

#[test]
fn line_ends_of_other_systems_and_blank_lines_make_no_difference() {
    let expected = read_msh(CLUTTERED.as_bytes(), 1.0).expect("sound");
    for text in
        [CLUTTERED.replace('\n', "\r\n"), CLUTTERED.replace('\n', " \n\n"), CLUTTERED.replace(' ', "\t ")]
    {
        let text = text.replace("top\t |\t side", "top | side");
        let read = read_msh(text.as_bytes(), 1.0).unwrap_or_else(|error| panic!("{error}"));
        assert_same(&read.mesh, &expected.mesh);
        assert_eq!(read.notices, expected.notices);
    }
}

#[test]
fn second_order_elements_are_read_with_straight_edges() {
    for (version, form) in
        [(Version::V2, Form::Ascii), (Version::V4, Form::Little), (Version::V4, Form::Ascii)]
    {
        let mut out = Writer { bytes: Vec::new(), form };
        out.header(version);
        let corners = [[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
        if version == Version::V4 {
            out.line("$Entities");
            out.sizes(&[0, 0, 0, 1]).end();
            out.ints(&[1]).reals(&[0.0; 6]).sizes(&[1]).ints(&[3]).sizes(&[0]).end();
            out.end_section("Entities");
            out.line("$Nodes");
            out.sizes(&[1, 10, 1, 10]).end();
            out.ints(&[3, 1, 0]).sizes(&[10]).end();
            (1..=10).for_each(|tag| out.sizes(&[tag]).end());
        } else {
            out.line("$Nodes\n10");
        }
        for i in 0..10 {
            if version == Version::V2 {
                out.ints(&[i + 1]);
            }
            out.reals(corners.get(i as usize).unwrap_or(&[0.4; 3])).end();
        }
        out.end_section("Nodes");
        if version == Version::V4 {
            out.line("$Elements");
            out.sizes(&[1, 1, 1, 1]).end();
            out.ints(&[3, 1, 11]).sizes(&[1]).end();
            out.sizes(&[1, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10]);
        } else {
            out.line("$Elements\n1");
            out.ints(&[1, 11, 2, 3, 1, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10]);
        }
        out.end();
        out.end_section("Elements");
        let read = read_msh(&out.bytes, 1.0).unwrap_or_else(|error| panic!("{version:?} {form:?}: {error}"));
        assert_eq!(read.mesh.points(), corners);
        assert_eq!((read.notices.second_order, read.notices.unused_nodes), (1, 6));
    }
}

#[test]
fn binary_files_skip_unknown_sections_and_useless_elements() {
    let device = Device::random(&mut Random(5), 1 << 20);
    for (version, form) in [(Version::V2, Form::Big), (Version::V4, Form::Little)] {
        let mut bytes = device.bytes(version, form);
        // Binary data with a mark in it that is no line of its own.
        bytes.extend(b"$NodeData\n1\n\"T\"\n0\n0\n\0\x01 $EndNodeData\0\n\n$EndNodeData\n");
        assert_same(&read_msh(&bytes, 1.0).expect("sound").mesh, &device.mesh(|x| x));
    }
}

#[test]
fn elements_of_one_partition_are_read() {
    let text =
        String::from_utf8(Device::random(&mut Random(3), 100).bytes(Version::V2, Form::Ascii)).expect("text");
    let (head, elements) = text.split_once("$Elements").expect("elements");
    let partition = |id: usize| elements.replacen(" 4 2 ", &format!(" 4 4 {id} {id} 1 {id} x"), usize::MAX);
    // The two tags that stood there go behind the partition, so the count becomes 4 with groups of the element.
    let one = partition(7);
    let mut lines = Vec::new();
    for line in one.lines() {
        let words: Vec<&str> = line.split_whitespace().collect();
        match words.iter().position(|w| w.starts_with('x')) {
            Some(x) => lines.push([&words[..x], &words[x + 2..]].concat().join(" ")),
            None => lines.push(line.to_owned()),
        }
    }
    let text = format!("{head}$Elements{}\n", lines.join("\n"));
    let read = read_msh(text.as_bytes(), 1.0).unwrap_or_else(|error| panic!("{error}\n{text}"));
    assert!(read.mesh.topology().tets().len() >= 6);
}
