//! Damaged Gmsh files: the line and the word in the file.

use crate::case::{Base, Case, case, compare};

const CONFIG: Base = Base::Own(
    r#"[mesh]
file = "device.msh"
unit = "mm"

[analysis]
frequency = 0

[materials.iron]
relative_permeability = 1000

[regions.left]
material = "iron"

[boundaries]
flux_parallel = ["face"]
"#,
);

/// Two tetrahedra in two volumes, with a triangle between them.
const V4: &str = "$MeshFormat
4.1 0 8
$EndMeshFormat
$PhysicalNames
3
2 1 \"face\"
3 1 \"left\"
3 2 \"right\"
$EndPhysicalNames
$Entities
0 0 1 2
1 0 0 0 1 1 1 1 1 0
1 0 0 0 1 1 1 1 1 0
2 0 0 0 1 1 1 1 2 0
$EndEntities
$Nodes
2 5 1 5
3 1 0 4
1
2
3
4
0 0 0
1 0 0
0 1 0
0 0 1
3 2 0 1
5
1 1 1
$EndNodes
$Elements
3 3 1 3
2 1 2 1
1 2 3 4
3 1 4 1
2 1 2 3 4
3 2 4 1
3 5 2 4 3
$EndElements
";

/// The same in version 2.2.
const V2: &str = "$MeshFormat
2.2 0 8
$EndMeshFormat
$PhysicalNames
3
2 1 \"face\"
3 1 \"left\"
3 2 \"right\"
$EndPhysicalNames
$Nodes
5
1 0 0 0
2 1 0 0
3 0 1 0
4 0 0 1
5 1 1 1
$EndNodes
$Elements
3
1 2 2 1 1 2 3 4
2 4 2 1 1 1 2 3 4
3 4 2 2 2 5 2 4 3
$EndElements
";

const fn v4(name: &'static str, edits: &'static [(&'static str, &'static str)]) -> Case {
    Case { mesh: Some((V4, edits)), ..case(name, CONFIG, &[]) }
}

const fn v2(name: &'static str, edits: &'static [(&'static str, &'static str)]) -> Case {
    Case { mesh: Some((V2, edits)), ..case(name, CONFIG, &[]) }
}

pub(crate) const CASES: &[Case] = &[
    v4("msh: another version", &[("4.1 0 8", "«4.0» 0 8")]),
    v4("msh: another data size", &[("4.1 0 8", "4.1 0 «4»")]),
    v4("msh: neither text nor binary", &[("4.1 0 8", "4.1 «2» 8")]),
    v4("msh: no format", &[("$MeshFormat", "«$MeshForm»")]),
    v4("msh: a name without quotes", &[("\"left\"", "«left»")]),
    v4("msh: a name twice", &[("\"right\"", "«\"left\"»")]),
    v4("msh: a group of dimension four", &[("3 2 \"right\"", "«4» 2 \"right\"")]),
    v4("msh: a group of tag zero", &[("3 2 \"right\"", "3 «0» \"right\"")]),
    v4("msh: too many nodes announced", &[("2 5 1 5", "2 «5000» 1 5")]),
    v4("msh: nodes that do not add up", &[("2 5 1 5", "2 «6» 1 6")]),
    v4("msh: a coordinate is a word", &[("0 1 0\n0 0 1", "0 «x» 0\n0 0 1")]),
    v4("msh: a coordinate is not finite", &[("0 1 0\n0 0 1", "0 1 «nan»\n0 0 1")]),
    v4("msh: a coordinate is missing", &[("1 1 1\n$EndNodes", "1 1«»\n$EndNodes")]),
    v4("msh: a tag twice", &[("3 2 0 1\n5", "3 2 0 1\n«4»")]),
    v4("msh: a node that is not there", &[("3 5 2 4 3", "3 «9» 2 4 3")]),
    v4("msh: an entity that is not there", &[("3 2 4 1\n3", "3 «7» 4 1\n3")]),
    v4("msh: an element type that is unknown", &[("3 2 4 1\n3", "3 2 «999» 1\n3")]),
    v4(
        "msh: a flat tetrahedron",
        &[("1 1 1\n$EndNodes", "0.2 0.2 0.6\n$EndNodes"), ("3 5 2 4 3", "«3» 5 2 4 3")],
    ),
    v4(
        "msh: a volume in no group",
        &[("2 0 0 0 1 1 1 1 2 0", "2 0 0 0 1 1 1 0 0"), ("3 5 2 4 3", "«3» 5 2 4 3")],
    ),
    v4("msh: a volume in two groups", &[("2 0 0 0 1 1 1 1 2 0", "«2» 0 0 0 1 1 1 2 1 2 0")]),
    v4("msh: cut off", &[("3 2 4 1\n3 5 2 4 3\n$EndElements\n", "3 2 4 «1»\n3 5 2")]),
    v4("msh: cut off behind the elements", &[("3 5 2 4 3\n$EndElements\n", "3 5 2 4 3\n«»")]),
    v4("msh: something behind the sections", &[("$EndElements\n", "$EndElements\n«hello»\n")]),
    v4("msh: nodes twice", &[("$Elements\n", "«$Nodes»\n")]),
    v2("msh 2.2: an element type that is unknown", &[("3 4 2 2 2 5", "3 «99» 2 2 2 5")]),
    v2("msh 2.2: a tetrahedron in no group", &[("3 4 2 2 2 5", "«3» 4 2 0 2 5")]),
    v2("msh 2.2: a tetrahedron twice", &[("3 4 2 2 2 5 2 4 3", "«3» 4 2 1 1 1 2 3 4")]),
    v2("msh 2.2: a node that is not there", &[("5 2 4 3", "5 2 4 «8»")]),
    v2("msh 2.2: a number too many", &[("5 1 1 1", "5 1 1 1 «1»")]),
    v2("msh 2.2: an end that is another's", &[("$EndNodes", "«$EndElements»")]),
    v2("msh: a condition on a surface inside", &[]).in_config(&[("[\"face\"]", "[«\"face\"»]")]),
    v2("msh: a name that is not in the file", &[])
        .in_config(&[("[regions.left]", "«[regions.lift]»"), ("[\"face\"]", "[\"left|outside\"]")]),
    v2("msh: a surface that is not in the file", &[]).in_config(&[("[\"face\"]", "[«\"faces\"»]")]),
];

#[test]
fn damaged_mesh_files() {
    compare("mesh_files", CASES);
}
