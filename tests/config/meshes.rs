//! Damaged mesh files: every kind of defect in both versions, as text and in both orders of bytes, each refused with line or
//! byte within a memory that is promised.
//!
//! What is said of a damaged text, word by word, stands in `wrong/mesh_files.txt`.

use std::fs;
use std::path::Path;

use fluxmorph_geometry::generate::{BlockParameters, block};
use fluxmorph_geometry::io::{MshEncoding, msh_bytes};

use crate::damage::{
    Counted::{Elements, Names, Nodes},
    Damaged,
};
use crate::msh_support::{Device, Form, Version};
use crate::program::{BESIDE, baseline, least_limit, limited, write};
use crate::support::program::{Finished, folder};
use crate::support::repository_text;

/// Memory of the promise for each byte of a mesh file [bytes].
const PER_BYTE: u64 = 12;

/// Length of a name or line that does not end [bytes].
const ENDLESS: usize = 1 << 20;

/// Writes a configuration and its mesh.
fn write_mesh(home: &Path, mesh: &[u8]) {
    let config = repository_text("tests/config/bases/of_file.toml")
        .replace("\"face\"", "\"left|outside\", \"right|outside\"");
    write(home, "device.toml", config);
    write(home, "device.msh", mesh);
}

fn check(home: &Path, limit: Option<u64>, further: &[&str]) -> Finished {
    limited(home, limit, &[&["check", "device.toml"], further].concat())
}

/// The limit of the promise for a file of so many bytes.
fn promised(length: usize) -> u64 {
    baseline() + PER_BYTE * length as u64 + BESIDE
}

/// A kind of damage: its name, the parts of the message, and the change.
type Kind = (&'static str, &'static [&'static str], Change);

enum Change {
    /// Of the mesh before it is written.
    Mesh(fn(&mut Device)),
    /// Of the bytes of the file.
    File(fn(&mut Damaged)),
}

use Change::{File, Mesh};

/// Defects of the mesh.
const OF_MESHES: &[Kind] = &[
    ("dangling node", &["element 3", "uses node 99"], Mesh(|d| d.tets[1].1[0] = 99)),
    ("dangling triangle", &["element 1", "uses node 99"], Mesh(|d| d.triangles[0].1[0] = 99)),
    ("node tag twice", &["node 4", "the tag was given at"], Mesh(|d| d.nodes[4].0 = 4)),
    ("NaN", &["node 5", "a coordinate is NaN"], Mesh(|d| d.nodes[4].1[1] = f64::NAN)),
    ("infinity", &["node 2", "a coordinate is -inf"], Mesh(|d| d.nodes[1].1[0] = f64::NEG_INFINITY)),
    ("flat", &["element 2", "flat"], Mesh(|d| d.nodes[3].1 = [0.5, 0.5, 0.0])),
    ("nearly flat", &["element 2", "flat"], Mesh(|d| d.nodes[3].1 = [0.5, 0.5, 1e-18])),
    ("all at one place", &["element 2", "flat"], Mesh(|d| d.nodes.iter_mut().for_each(|n| n.1 = [1.0; 3]))),
    ("overflow of a volume", &["element 2"], Mesh(|d| d.nodes[3].1[2] = 1e300)),
    ("node twice", &["element 2", "flat"], Mesh(|d| d.tets[0].1 = [1, 2, 3, 3])),
    ("no volume", &["element 2", "belongs to no physical volume"], Mesh(|d| d.tets[0].2 = 0)),
    ("twice", &["element 9", "has the nodes of element 2"], Mesh(|d| d.tets.push((9, [1, 2, 3, 4], 7)))),
    ("two volumes", &["element 9", "`left` and `right`"], Mesh(|d| d.tets.push((9, [1, 2, 3, 4], 8)))),
    (
        "three tetrahedra at a face",
        &["element 9", "overlaps itself"],
        Mesh(|d| {
            d.nodes.push((6, [2.0, 2.0, 3.0]));
            d.tets.push((9, [6, 2, 4, 3], 8));
        }),
    ),
    ("no tetrahedron", &["no tetrahedron"], Mesh(|d| d.tets.clear())),
    ("nothing", &["no tetrahedron"], Mesh(|d| *d = Device::default())),
    ("control character", &["control character"], Mesh(|d| d.names[1].2 = "le\u{1b}[31mft".into())),
    ("empty name", &["is empty"], Mesh(|d| d.names[1].2 = String::new())),
    ("endless name", &["longer than 255 bytes"], Mesh(|d| d.names[1].2 = "x".repeat(ENDLESS))),
    ("name twice", &["`left` belongs to group 7"], Mesh(|d| d.names[2].2 = "left".into())),
    ("group named twice", &["declared a second time"], Mesh(|d| d.names.push((3, 7, "again".into())))),
];

/// Defects of names, of the format, and of files that are cut off.
const OF_HEADS: &[Kind] = &[
    ("name that is no text", &["is not UTF-8"], File(|f| f.put(f.behind("\"left") - 1, 1, &[0xff]))),
    ("name without quotes", &["double quotes"], File(|f| f.replace("\"left\"", "left"))),
    ("name of dimension 4", &["(0 to 3)", "`4`"], File(|f| f.replace("\n3 7 ", "\n4 7 "))),
    ("group 0", &["from 1"], File(|f| f.replace("\n3 7 ", "\n3 0 "))),
    ("group of 33 bits", &["found `4294967303`"], File(|f| f.replace("\n3 7 ", "\n3 4294967303 "))),
    ("empty file", &["$MeshFormat"], File(|f| f.bytes.clear())),
    ("a file of zeros", &["$MeshFormat"], File(|f| f.bytes.fill(0))),
    ("a file of blanks", &["$MeshFormat"], File(|f| f.bytes.fill(b' '))),
    ("another format", &["$MeshFormat", "solid"], File(|f| f.replace("$MeshFormat", "solid"))),
    ("version 1", &["version 1"], File(|f| f.replace("$MeshFormat\n", "$NOD\n"))),
    ("version 3", &["version 3.0"], File(|f| f.put(f.format(), 3, b"3.0"))),
    ("endless version", &["the version 444"], File(|f| f.put(f.format(), 0, &vec![b'4'; ENDLESS]))),
    ("file type 7", &["0 for ASCII or 1 for binary"], File(|f| f.put(f.format() + 4, 1, b"7"))),
    ("data size 4", &["only 8 is read"], File(|f| f.put(f.format() + 6, 1, b"4"))),
    (
        "text said to be binary, or binary said to be text",
        &["section $MeshFormat"],
        File(|f| f.put(f.format() + 4, 1, if f.form == Form::Ascii { b"1" } else { b"0" })),
    ),
    (
        "no mark of the order of bytes, or one in a text",
        &["section $"],
        File(|f| {
            if f.form == Form::Ascii {
                f.put(f.format() + 8, 0, b"1\n")
            } else {
                f.put(f.format() + 8, 4, b"")
            }
        }),
    ),
    ("wrong order of bytes", &["section $MeshFormat"], File(|f| f.put(f.format() + 8, 2, &[7, 7]))),
    ("cut in the header", &["the file ends"], File(|f| f.bytes.truncate(f.format()))),
    ("cut behind it", &["$Nodes"], File(|f| f.bytes.truncate(f.behind("$EndMeshFormat\n")))),
    (
        "cut in the nodes",
        &[],
        File(|f| {
            let (start, end) = (f.behind("$Nodes\n"), f.behind("$EndNodes"));
            f.bytes.truncate(start + 3 * (end - start) / 4);
            // Counts that the rest could hold.
            f.add(if f.form == Form::Ascii { b"\n1\n" } else { b"" });
        }),
    ),
    ("cut in the elements", &[], File(|f| f.bytes.truncate(f.last_mark() - 6))),
    ("cut before the last mark", &["the file ends"], File(|f| f.bytes.truncate(f.last_mark()))),
];

/// Sections that are missing, doubled or none.
const OF_SECTIONS: &[Kind] = &[
    ("rest behind the end", &["the head of a section"], File(|f| f.add(b"and so on\n"))),
    ("zeros behind the end", &["the head of a section"], File(|f| f.add(&[0; 4096]))),
    ("escapes behind the end", &["the head of a section"], File(|f| f.add(b"\x1b[31mred\n"))),
    ("no nodes", &["after $Nodes"], File(|f| drop(f.take("Nodes")))),
    ("no elements", &["no section $Elements"], File(|f| drop(f.take("Elements")))),
    (
        "elements first",
        &["after $Nodes"],
        File(|f| {
            let nodes = f.take("Nodes");
            f.add(&nodes);
        }),
    ),
    (
        "nodes twice",
        &["section $Nodes", "a second time"],
        File(|f| {
            let nodes = f.take("Nodes");
            let before = if f.version == Version::V4 { "$EndEntities\n" } else { "$EndPhysicalNames\n" };
            f.put(f.behind(before), 0, &nodes.repeat(2));
        }),
    ),
    ("wrong end", &["end of the section", "$EndElements"], File(|f| f.replace("$EndNodes", "$EndElements"))),
    ("end in capitals", &["end of the section", "$ENDNodes"], File(|f| f.replace("$EndNodes", "$ENDNodes"))),
    ("no end", &["section $Comments", "end of the section"], File(|f| f.add(b"$Comments\nand so on\n"))),
    ("escapes", &["section $\\u{1b}[31m"], File(|f| f.add(b"$\x1b[31m\nred\n"))),
    ("endless section", &["section $xxx"], File(|f| f.add(&[vec![b'$'], vec![b'x'; ENDLESS]].concat()))),
    ("endless line", &["the head of a section"], File(|f| f.add(&vec![b'x'; ENDLESS]))),
    ("partitions", &["partitioned"], File(|f| f.add(b"$GhostElements\n0\n$EndGhostElements\n"))),
];

/// Counts and tags that no file of this size can have.
const OF_NUMBERS: &[Kind] = &[
    ("too many names", &["section $PhysicalNames"], File(|f| f.put_count(Names, i64::MAX))),
    ("negative names", &["section $PhysicalNames", "found `-3`"], File(|f| f.put_count(Names, -3))),
    ("too many nodes", &["$Nodes", "1073741824 nodes are announced"], File(|f| f.put_count(Nodes, 1 << 30))),
    ("far too many nodes", &["section $Nodes"], File(|f| f.put_count(Nodes, i64::MAX))),
    ("negative nodes", &["section $Nodes"], File(|f| f.put_count(Nodes, -5))),
    ("no nodes announced", &["section $Nodes"], File(|f| f.put_count(Nodes, 0))),
    ("one node too few", &["section $Nodes"], File(|f| f.put_count(Nodes, 4))),
    ("too many elements", &["1073741824 elements are announced"], File(|f| f.put_count(Elements, 1 << 30))),
    ("far too many elements", &["section $Elements"], File(|f| f.put_count(Elements, i64::MAX))),
    ("negative elements", &["section $Elements"], File(|f| f.put_count(Elements, -2))),
    ("one element too few", &["section $Elements"], File(|f| f.put_count(Elements, 2))),
    ("block of many nodes", &["section $Nodes"], File(|f| f.put_block_count(Nodes, 1 << 40))),
    ("block of negative nodes", &["section $Nodes"], File(|f| f.put_block_count(Nodes, -1))),
    ("block of many elements", &["section $Elements"], File(|f| f.put_block_count(Elements, 1 << 30))),
    ("block of negative elements", &["section $Elements"], File(|f| f.put_block_count(Elements, -1))),
    ("block of no elements", &[], File(|f| f.put_block_count(Elements, 0))),
    ("unknown element type", &["element type 99"], File(|f| f.put_type(99))),
    ("element type of no nodes", &["element type 0"], File(|f| f.put_type(0))),
    ("negative element type", &["element type -4"], File(|f| f.put_type(-4))),
    ("overflow of a node's tag", &[], File(|f| f.put_node_tag("18446744073709551616"))),
    ("overflow of all numbers", &[], File(|f| f.put_node_tag(&"9".repeat(1 << 16)))),
];

/// Where a message says that the damage is: `line 12,` or `byte 345,`, within the file.
fn place_is_given(stderr: &str, file: &Damaged) -> bool {
    let lines = 1 + file.bytes.iter().filter(|&&b| b == b'\n').count();
    let number = |word: &str| -> Option<usize> {
        let rest = stderr.split_once(&format!("device.msh`, {word} "))?.1;
        rest.split_once(',')?.0.parse().ok()
    };
    number("line").is_some_and(|line| (1..=lines).contains(&line))
        || number("byte").is_some_and(|byte| byte <= file.bytes.len())
}

/// Asserts that a kind of damage is refused in every version and form.
fn are_refused(kinds: &[Kind]) {
    let home = folder();
    let mut wrong = Vec::new();
    let forms = [Form::Ascii, Form::Little, Form::Big];
    for (version, form) in [Version::V2, Version::V4].into_iter().flat_map(|v| forms.map(|form| (v, form))) {
        write_mesh(home.path(), &Device::two_tets().bytes(version, form));
        check(home.path(), None, &[]).succeeds();
        for (name, says, change) in kinds {
            let mut device = Device::two_tets();
            if let Mesh(change) = change {
                change(&mut device);
            }
            let mut file = Damaged { bytes: device.bytes(version, form), version, form };
            if let File(change) = change {
                change(&mut file);
            }
            write_mesh(home.path(), &file.bytes);
            let ended = check(home.path(), Some(promised(file.bytes.len())), &[]);
            let place =
                (!place_is_given(&ended.stderr, &file)).then(|| format!("no place in:\n{}", ended.stderr));
            let says: Vec<&str> = [&["device.msh", "device.toml:2:8"], *says].concat();
            let objection = ended.objection(3, &says).or(place);
            wrong.extend(objection.map(|objection| format!("{version:?} {form:?}, {name}: {objection}")));
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n\n"));
}

#[test]
fn damaged_meshes_are_refused() {
    are_refused(OF_MESHES);
}

#[test]
fn damaged_heads_are_refused() {
    are_refused(OF_HEADS);
}

#[test]
fn damaged_sections_are_refused() {
    are_refused(OF_SECTIONS);
}

#[test]
fn damaged_numbers_are_refused() {
    are_refused(OF_NUMBERS);
}

/// Checks a mesh that is read to its end, and then refused for a region that it does not have.
fn read_and_refused(home: &Path, bytes: &[u8], limit: u64) -> Finished {
    write_mesh(home, bytes);
    check(home, Some(limit), &["--set", "objective={kind=\"flux_density_squared\", region=\"nowhere\"}"])
}

#[test]
fn large_sound_meshes_are_read_within_the_promise() {
    let home = folder();
    let mesh = block(&BlockParameters { size: [0.1, 0.11, 0.13], cells: [25; 3] }).expect("valid");
    for encoding in [MshEncoding::Ascii, MshEncoding::Binary] {
        let bytes = msh_bytes(&mesh, 1.0, encoding).expect("finite");
        assert!(bytes.len() > 3 << 20, "{}", bytes.len());
        let ended = read_and_refused(home.path(), &bytes, promised(bytes.len()));
        ended.refuses(3, &["there is no region `nowhere`"]);
        let least = least_limit(promised(bytes.len()), |limit| {
            read_and_refused(home.path(), &bytes, limit).stderr.contains("`nowhere`")
        });
        let ratio = (least - baseline()) as f64 / bytes.len() as f64;
        println!("{encoding:?}: {} bytes, {ratio:.1} times the file beside the program's own", bytes.len());
    }
}

#[test]
fn files_that_multiply_are_refused_or_read_within_the_promise() {
    let home = folder();
    let refused = |file: &str, says: &str| {
        read_and_refused(home.path(), file.as_bytes(), promised(file.len())).refuses(3, &[says]);
    };
    // As many nodes as bytes allow, in the wrong order, which is sorted.
    let count = 200_000;
    let nodes: String =
        (0..count).map(|i| format!("{} {} {} {}\n", count - i, i % 10, i / 10 % 10, i % 7)).collect();
    let elements = "$Elements\n1\n1 4 2 1 1 1 2 3 9\n$EndElements\n";
    let head = "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n";
    refused(&format!("{head}$Nodes\n{count}\n{nodes}$EndNodes\n{elements}"), "flat");
    // One surface in very many physical groups, and many triangles on it.
    let tags: String = (1..100_000).map(|tag| format!(" {tag}")).collect();
    let triangles: String = (10..30_000).map(|tag| format!("{tag} 1 2 3\n")).collect();
    let many_pairs = format!(
        "$MeshFormat\n4.1 0 8\n$EndMeshFormat\n$Entities\n0 0 1 1\n1 0 0 0 1 1 1 99999{tags} 0\n1 0 0 0 1 1 1 1 1 0\n\
         $EndEntities\n$Nodes\n1 4 1 4\n3 1 0 4\n1\n2\n3\n4\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n$EndNodes\n\
         $Elements\n2 29991 1 30000\n3 1 4 1\n1 1 2 3 4\n2 1 2 29990\n{triangles}$EndElements\n"
    );
    refused(&many_pairs, "triangles in physical surfaces");
    // As many names as bytes allow.
    let names: String = (1..60_000).map(|tag| format!("2 {tag} \"s{tag}\"\n3 {tag} \"v{tag}\"\n")).collect();
    let sound = repository_text("crates/geometry/tests/msh_support/sound_v2.msh");
    let (_, rest) = sound.split_once("$EndPhysicalNames").expect("names");
    let many_names = format!("{head}$PhysicalNames\n119998\n{names}$EndPhysicalNames{rest}");
    refused(&many_names, "there is no region `nowhere`");
}

#[test]
fn a_file_that_claims_to_be_huge_is_not_read() {
    let home = folder();
    write_mesh(home.path(), &Device::two_tets().bytes(Version::V4, Form::Ascii));
    // A hole in a file takes no room on the disk.
    let file = fs::OpenOptions::new().write(true).open(home.path().join("device.msh")).expect("opened");
    if file.set_len(1 << 42).is_err() {
        file.set_len(1 << 34).expect("a file of 16 GiB");
    }
    let limit = Some(baseline() + BESIDE);
    let says = ["reading the mesh file of", "of memory, and there are", "--force", "device.toml:2:8"];
    check(home.path(), limit, &[]).refuses(3, &says);
    // With --force it is tried, and the system refuses.
    check(home.path(), limit, &["--force"]).refuses(5, &["cannot read", "device.msh"]);
}
