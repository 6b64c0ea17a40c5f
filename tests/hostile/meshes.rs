//! Damaged mesh files: every kind of defect in both versions, as text and in both orders of bytes.

use std::fs;
use std::path::{Path, PathBuf};

use fluxmorph_geometry::generate::{BlockParameters, block};
use fluxmorph_geometry::io::{MshEncoding, msh_bytes};

use crate::limited::{BESIDE, PER_BYTE, baseline, check, least_limit, limited, objection};
use crate::msh_support::{Device, Form, Version};
use crate::numbers::{Counted, Damaged};

const CONFIG: &str = "[mesh]\nfile = \"device.msh\"\nunit = \"m\"\n[analysis]\nfrequency = \"0 Hz\"\n\
                      [boundaries]\nflux_parallel = [\"left|outside\", \"right|outside\"]\n";

/// Two tetrahedra in two volumes with a triangle between them.
pub(crate) fn device() -> Device {
    let nodes = [[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [1.0; 3]];
    Device {
        nodes: (1..).zip(nodes).collect(),
        tets: vec![(2, [1, 2, 3, 4], 7), (3, [5, 2, 4, 3], 8)],
        triangles: vec![(1, [2, 3, 4], vec![1])],
        names: [(2, 1, "face"), (3, 7, "left"), (3, 8, "right")]
            .map(|(d, t, n)| (d, t, n.to_owned()))
            .to_vec(),
    }
}

/// Writes a configuration and its mesh.
pub(crate) fn written(folder: &Path, mesh: &[u8]) -> PathBuf {
    let config = folder.join("device.toml");
    fs::write(&config, CONFIG).expect("written");
    fs::write(folder.join("device.msh"), mesh).expect("written");
    config
}

/// A kind of damage: its name, what the message says, and the change.
struct Kind {
    name: &'static str,
    says: &'static [&'static str],
    change: Change,
}

enum Change {
    /// Of the mesh before it is written.
    Mesh(fn(&mut Device)),
    /// Of the bytes of the file.
    File(fn(&mut Damaged)),
}

use Change::{File, Mesh};

const fn kind(name: &'static str, says: &'static [&'static str], change: Change) -> Kind {
    Kind { name, says, change }
}

/// The binary encodings cannot say what a text can; a damage that leaves the file as it was stands for "not in this form".
const KINDS: &[Kind] = &[
    kind("dangling node", &["element 3", "uses node 99"], Mesh(|d| d.tets[1].1[0] = 99)),
    kind("dangling node of a triangle", &["element 1", "uses node 99"], Mesh(|d| d.triangles[0].1[0] = 99)),
    kind("node tag twice", &["node 4", "the tag was given at"], Mesh(|d| d.nodes[4].0 = 4)),
    kind("NaN", &["node 5", "a coordinate is NaN"], Mesh(|d| d.nodes[4].1[1] = f64::NAN)),
    kind("infinity", &["node 2", "a coordinate is -inf"], Mesh(|d| d.nodes[1].1[0] = f64::NEG_INFINITY)),
    kind("flat tetrahedron", &["element 2", "flat"], Mesh(|d| d.nodes[3].1 = [0.5, 0.5, 0.0])),
    kind("nearly flat tetrahedron", &["element 2", "flat"], Mesh(|d| d.nodes[3].1 = [0.5, 0.5, 1e-18])),
    kind(
        "all nodes at one place",
        &["element 2", "flat"],
        Mesh(|d| d.nodes.iter_mut().for_each(|n| n.1 = [1.0; 3])),
    ),
    kind("overflow of a volume", &["element 2"], Mesh(|d| d.nodes[3].1[2] = 1e300)),
    kind("node twice in a tetrahedron", &["element 2", "flat"], Mesh(|d| d.tets[0].1 = [1, 2, 3, 3])),
    kind(
        "tetrahedron of no volume",
        &["element 2", "belongs to no physical volume"],
        Mesh(|d| d.tets[0].2 = 0),
    ),
    kind(
        "tetrahedron twice",
        &["element 9", "has the nodes of element 2"],
        Mesh(|d| d.tets.push((9, [1, 2, 3, 4], 7))),
    ),
    kind(
        "tetrahedron in two volumes",
        &["element 9", "`left` and `right`"],
        Mesh(|d| d.tets.push((9, [1, 2, 3, 4], 8))),
    ),
    kind(
        "three tetrahedra at a face",
        &["element 9", "overlaps itself"],
        Mesh(|d| {
            d.nodes.push((6, [2.0, 2.0, 3.0]));
            d.tets.push((9, [6, 2, 4, 3], 8));
        }),
    ),
    kind("no tetrahedron", &["no tetrahedron"], Mesh(|d| d.tets.clear())),
    kind("nothing", &["no tetrahedron"], Mesh(|d| *d = Device::default())),
    kind(
        "name with a control character",
        &["control character"],
        Mesh(|d| d.names[1].2 = "le\u{1b}[31mft".into()),
    ),
    kind("empty name", &["is empty"], Mesh(|d| d.names[1].2 = String::new())),
    kind("endless name", &["longer than 255 bytes"], Mesh(|d| d.names[1].2 = "x".repeat(1 << 20))),
    kind("name twice", &["`left` belongs to group 7"], Mesh(|d| d.names[2].2 = "left".into())),
    kind("group named twice", &["declared a second time"], Mesh(|d| d.names.push((3, 7, "again".into())))),
    kind(
        "name that is no text",
        &["is not UTF-8"],
        File(|f| {
            let at = f.behind("\"left");
            f.bytes[at - 1] = 0xff;
        }),
    ),
    kind("name without quotes", &["double quotes"], File(|f| f.replace("\"left\"", "left"))),
    kind("name of dimension 4", &["(0 to 3)", "`4`"], File(|f| f.replace("\n3 7 ", "\n4 7 "))),
    kind("group 0", &["from 1"], File(|f| f.replace("\n3 7 ", "\n3 0 "))),
    kind("group beyond 31 bits", &["found `4294967303`"], File(|f| f.replace("\n3 7 ", "\n3 4294967303 "))),
    kind("empty file", &["$MeshFormat"], File(|f| f.bytes.clear())),
    kind("a file of zeros", &["$MeshFormat"], File(|f| f.bytes.fill(0))),
    kind("a file of blanks", &["$MeshFormat"], File(|f| f.bytes.fill(b' '))),
    kind("another format", &["$MeshFormat", "solid"], File(|f| f.replace("$MeshFormat", "solid"))),
    kind("version 1", &["version 1"], File(|f| f.replace("$MeshFormat\n", "$NOD\n"))),
    kind(
        "version 3",
        &["version 3.0"],
        File(|f| {
            let at = f.behind("$MeshFormat\n");
            f.bytes.splice(at..at + 3, *b"3.0");
        }),
    ),
    kind(
        "endless version",
        &["the version 444"],
        File(|f| {
            let at = f.behind("$MeshFormat\n");
            f.bytes.splice(at..at, [b'4'; 1 << 20]);
        }),
    ),
    kind(
        "file type 7",
        &["0 for ASCII or 1 for binary"],
        File(|f| {
            let at = f.behind("$MeshFormat\n");
            f.bytes[at + 4] = b'7';
        }),
    ),
    kind(
        "data size 4",
        &["only 8 is read"],
        File(|f| {
            let at = f.behind("$MeshFormat\n");
            f.bytes[at + 6] = b'4';
        }),
    ),
    kind(
        "text said to be binary, or binary said to be text",
        &["section $MeshFormat"],
        File(|f| {
            let at = f.behind("$MeshFormat\n");
            f.bytes[at + 4] = if f.form == Form::Ascii { b'1' } else { b'0' };
        }),
    ),
    kind(
        "no mark of the order of bytes",
        &["section $"],
        File(|f| {
            let at = f.behind("$MeshFormat\n") + "2.2 1 8\n".len();
            if f.form == Form::Ascii {
                f.bytes.splice(at..at, *b"1\n");
            } else {
                f.bytes.drain(at..at + 4);
            }
        }),
    ),
    kind(
        "wrong mark of the order of bytes",
        &["section $MeshFormat"],
        File(|f| {
            let at = f.behind("$MeshFormat\n") + "2.2 1 8\n".len();
            f.bytes[at..at + 2].fill(7);
        }),
    ),
    kind("cut in the header", &["the file ends"], File(|f| f.bytes.truncate(f.behind("$MeshFormat\n")))),
    kind("cut behind the header", &["$Nodes"], File(|f| f.bytes.truncate(f.behind("$EndMeshFormat\n")))),
    kind(
        "cut in the nodes",
        &[],
        File(|f| {
            let (start, end) = (f.behind("$Nodes\n"), f.behind("$EndNodes"));
            f.bytes.truncate(start + 3 * (end - start) / 4);
            // Counts that the rest could hold.
            f.bytes.extend(if f.form == Form::Ascii { &b"\n1\n"[..] } else { b"" });
        }),
    ),
    kind(
        "cut in the elements",
        &[],
        File(|f| {
            let end = f.behind("$EndElements") - "$EndElements".len();
            f.bytes.truncate(end - 6);
        }),
    ),
    kind(
        "cut before the last mark",
        &["the file ends"],
        File(|f| {
            let end = f.behind("$EndElements") - "$EndElements".len();
            f.bytes.truncate(end);
        }),
    ),
    kind("rest behind the end", &["the head of a section"], File(|f| f.bytes.extend(b"and so on\n"))),
    kind("zeros behind the end", &["the head of a section"], File(|f| f.bytes.extend([0; 4096]))),
    kind("escapes behind the end", &["the head of a section"], File(|f| f.bytes.extend(b"\x1b[31mred\n"))),
    kind("no nodes", &["after $Nodes"], File(|f| drop(f.take("Nodes")))),
    kind("no elements", &["no section $Elements"], File(|f| drop(f.take("Elements")))),
    kind(
        "elements first",
        &["after $Nodes"],
        File(|f| {
            let nodes = f.take("Nodes");
            f.bytes.extend(nodes);
        }),
    ),
    kind(
        "nodes twice",
        &["section $Nodes", "a second time"],
        File(|f| {
            let nodes = f.take("Nodes");
            let at = f.behind("$EndPhysicalNames\n");
            let at = if f.version == Version::V4 { f.behind("$EndEntities\n") } else { at };
            f.bytes.splice(at..at, [nodes.clone(), nodes].concat());
        }),
    ),
    kind(
        "wrong end",
        &["the end of the section", "$EndElements"],
        File(|f| f.replace("$EndNodes", "$EndElements")),
    ),
    kind(
        "end of another case",
        &["the end of the section", "$ENDNodes"],
        File(|f| f.replace("$EndNodes", "$ENDNodes")),
    ),
    kind(
        "section without end",
        &["section $Comments", "the end of the section"],
        File(|f| {
            f.bytes.extend(b"$Comments\nand so on\n");
        }),
    ),
    kind("section with escapes", &["section $\\u{1b}[31m"], File(|f| f.bytes.extend(b"$\x1b[31m\nred\n"))),
    kind(
        "endless name of a section",
        &["section $xxx"],
        File(|f| {
            f.bytes.push(b'$');
            f.bytes.extend([b'x'; 1 << 20]);
        }),
    ),
    kind("endless line", &["the head of a section"], File(|f| f.bytes.extend([b'x'; 1 << 20]))),
    kind("partitions", &["partitioned"], File(|f| f.bytes.extend(b"$GhostElements\n0\n$EndGhostElements\n"))),
    kind("too many names", &["section $PhysicalNames"], File(|f| f.put_count(Counted::Names, i64::MAX))),
    kind(
        "negative names",
        &["section $PhysicalNames", "found `-3`"],
        File(|f| f.put_count(Counted::Names, -3)),
    ),
    kind(
        "too many nodes",
        &["section $Nodes", "1073741824 nodes are announced"],
        File(|f| {
            f.put_count(Counted::Nodes, 1 << 30);
        }),
    ),
    kind("far too many nodes", &["section $Nodes"], File(|f| f.put_count(Counted::Nodes, i64::MAX))),
    kind("negative nodes", &["section $Nodes"], File(|f| f.put_count(Counted::Nodes, -5))),
    kind("no nodes announced", &["section $Nodes"], File(|f| f.put_count(Counted::Nodes, 0))),
    kind("one node too few", &["section $Nodes"], File(|f| f.put_count(Counted::Nodes, 4))),
    kind(
        "too many elements",
        &["section $Elements", "1073741824 elements are announced"],
        File(|f| {
            f.put_count(Counted::Elements, 1 << 30);
        }),
    ),
    kind("far too many elements", &["section $Elements"], File(|f| f.put_count(Counted::Elements, i64::MAX))),
    kind("negative elements", &["section $Elements"], File(|f| f.put_count(Counted::Elements, -2))),
    kind("one element too few", &["section $Elements"], File(|f| f.put_count(Counted::Elements, 2))),
    kind(
        "block of too many nodes",
        &["section $Nodes"],
        File(|f| f.put_block_count(Counted::Nodes, 1 << 40)),
    ),
    kind("block of negative nodes", &["section $Nodes"], File(|f| f.put_block_count(Counted::Nodes, -1))),
    kind(
        "block of too many elements",
        &["section $Elements"],
        File(|f| {
            f.put_block_count(Counted::Elements, 1 << 30);
        }),
    ),
    kind(
        "block of negative elements",
        &["section $Elements"],
        File(|f| f.put_block_count(Counted::Elements, -1)),
    ),
    kind("block of no elements", &[], File(|f| f.put_block_count(Counted::Elements, 0))),
    kind("unknown element type", &["element type 99"], File(|f| f.put_type(99))),
    kind("element type of no nodes", &["element type 0"], File(|f| f.put_type(0))),
    kind("negative element type", &["element type -4"], File(|f| f.put_type(-4))),
    kind("overflow of a node's tag", &[], File(|f| f.put_node_tag("18446744073709551616"))),
    kind("overflow of all numbers", &[], File(|f| f.put_node_tag(&"9".repeat(1 << 16)))),
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

fn forms() -> impl Iterator<Item = (Version, Form)> {
    let forms = [Form::Ascii, Form::Little, Form::Big];
    [Version::V2, Version::V4].into_iter().flat_map(move |version| forms.map(|form| (version, form)))
}

/// The limit of the promise for a file of so many bytes.
fn promised(length: usize) -> u64 {
    baseline() + PER_BYTE * length as u64 + BESIDE
}

#[test]
fn every_damaged_mesh_is_refused_with_its_place() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let (mut wrong, mut files) = (Vec::new(), 0);
    for (version, form) in forms() {
        let config = written(folder.path(), &device().bytes(version, form));
        assert_eq!(limited(None, &check(&config)).code, Some(0), "{version:?} {form:?}");
        for kind in KINDS {
            let mut device = device();
            if let Mesh(change) = kind.change {
                change(&mut device);
            }
            let mut file = Damaged { bytes: device.bytes(version, form), version, form };
            if let File(change) = kind.change {
                change(&mut file);
            }
            let config = written(folder.path(), &file.bytes);
            let ended = limited(Some(promised(file.bytes.len())), &check(&config));
            files += 1;
            let place =
                (!place_is_given(&ended.stderr, &file)).then(|| format!("no place in:\n{}", ended.stderr));
            let says: Vec<&str> = [&["device.msh", "device.toml:2:8"], kind.says].concat();
            if let Some(objection) = objection(&ended, &[3], &says).or(place) {
                wrong.push(format!("{version:?} {form:?}, {}: {objection}", kind.name));
            }
        }
    }
    println!(
        "{} kinds of damage, {files} files; the program itself takes {} MiB",
        KINDS.len(),
        baseline() >> 20
    );
    assert!(KINDS.len() >= 12 && files >= 80, "{} kinds, {files} files", KINDS.len());
    assert!(wrong.is_empty(), "{} of {files}:\n{}", wrong.len(), wrong.join("\n\n"));
}

/// Checks a mesh that is read to its end, and then refused for a region that it does not have.
fn read_and_refused(folder: &Path, bytes: &[u8], limit: Option<u64>) -> crate::limited::Ended {
    let config = written(folder, bytes);
    let set = ["--set".as_ref(), "objective={kind=\"flux_density_squared\", region=\"nowhere\"}".as_ref()];
    limited(limit, &[&check(&config)[..], &set].concat())
}

#[test]
fn large_healthy_meshes_are_read_within_the_promise() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let mesh = block(&BlockParameters { size: [0.1, 0.11, 0.13], cells: [25; 3] }).expect("valid");
    for encoding in [MshEncoding::Ascii, MshEncoding::Binary] {
        let bytes = msh_bytes(&mesh, 1.0, encoding).expect("finite");
        assert!(bytes.len() > 3 << 20, "{}", bytes.len());
        let ended = read_and_refused(folder.path(), &bytes, Some(promised(bytes.len())));
        if let Some(objection) = objection(&ended, &[3], &["there is no region `nowhere`"]) {
            panic!("{encoding:?}: {objection}");
        }
        let least = least_limit(promised(bytes.len()), |limit| {
            read_and_refused(folder.path(), &bytes, Some(limit)).stderr.contains("`nowhere`")
        });
        let ratio = (least - baseline()) as f64 / bytes.len() as f64;
        println!("{encoding:?}: {} bytes, {ratio:.1} times the file beside the program's own", bytes.len());
    }
}

#[test]
fn files_that_multiply_are_refused_or_read_within_the_promise() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    // As many nodes as bytes allow, in the wrong order, which is sorted.
    let count = 200_000;
    let nodes: String =
        (0..count).map(|i| format!("{} {} {} {}\n", count - i, i % 10, i / 10 % 10, i % 7)).collect();
    let many_nodes = format!(
        "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$Nodes\n{count}\n{nodes}$EndNodes\n$Elements\n1\n1 4 2 1 1 1 2 3 9\n$EndElements\n"
    );
    // One surface in very many physical groups, and many triangles on it.
    let tags: String = (1..100_000).map(|tag| format!(" {tag}")).collect();
    let triangles: String = (10..30_000).map(|tag| format!("{tag} 1 2 3\n")).collect();
    let many_pairs = format!(
        "$MeshFormat\n4.1 0 8\n$EndMeshFormat\n$Entities\n0 0 1 1\n1 0 0 0 1 1 1 99999{tags} 0\n1 0 0 0 1 1 1 1 1 0\n\
         $EndEntities\n$Nodes\n1 4 1 4\n3 1 0 4\n1\n2\n3\n4\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n$EndNodes\n\
         $Elements\n2 29991 1 30000\n3 1 4 1\n1 1 2 3 4\n2 1 2 29990\n{triangles}$EndElements\n"
    );
    // As many names as bytes allow.
    let names: String = (1..60_000).map(|tag| format!("2 {tag} \"s{tag}\"\n3 {tag} \"v{tag}\"\n")).collect();
    let many_names = String::from_utf8(device().bytes(Version::V2, Form::Ascii)).expect("text");
    let (head, rest) = many_names.split_once("$PhysicalNames").expect("names");
    let (_, rest) = rest.split_once("$EndPhysicalNames").expect("names");
    let many_names = format!("{head}$PhysicalNames\n119998\n{names}$EndPhysicalNames{rest}");
    let cases = [
        ("nodes", many_nodes, "flat"),
        ("surfaces of a triangle", many_pairs, "triangles in physical surfaces"),
        ("names", many_names, "there is no region `nowhere`"),
    ];
    for (name, text, says) in cases {
        let ended = read_and_refused(folder.path(), text.as_bytes(), Some(promised(text.len())));
        if let Some(objection) = objection(&ended, &[3], &[says]) {
            panic!("{name}: {objection}");
        }
    }
}

#[test]
fn a_file_that_claims_to_be_huge_is_not_read() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let config = written(folder.path(), &device().bytes(Version::V4, Form::Ascii));
    // A hole in a file takes no room on the disk.
    let file = fs::OpenOptions::new().write(true).open(folder.path().join("device.msh")).expect("opened");
    if file.set_len(1 << 42).is_err() {
        file.set_len(1 << 34).expect("a file of 16 GiB");
    }
    let ended = limited(Some(baseline() + BESIDE), &check(&config));
    let says = ["reading the mesh file of", "of memory, and there are", "--force", "device.toml:2:8"];
    assert_eq!(objection(&ended, &[3], &says), None);
    // With --force it is tried, and the system refuses.
    let ended = limited(Some(baseline() + BESIDE), &[&check(&config)[..], &["--force".as_ref()]].concat());
    assert_eq!(objection(&ended, &[5], &["cannot read", "device.msh"]), None);
}
