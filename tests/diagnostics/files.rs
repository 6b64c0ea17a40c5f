//! The key that names a mesh file, and its unit.

use crate::case::{Base, Case, case, compare};

const INDUCTOR: Base = Base::Shipped("inductor.toml");

pub(crate) const CASES: &[Case] = &[
    case("mesh.unit is missing", INDUCTOR, &[("unit = \"mm\"\n", ""), ("[mesh]", "«[mesh]»")]),
    case("mesh.unit is a length", INDUCTOR, &[("unit = \"mm\"", "unit = «\"1 mm\"»")]),
    case("mesh.unit is unknown", INDUCTOR, &[("unit = \"mm\"", "unit = «\"ft\"»")]),
    case("mesh.file is absolute", INDUCTOR, &[("\"meshes/inductor.msh\"", "«\"/meshes/inductor.msh\"»")]),
    case("mesh.file leads upwards", INDUCTOR, &[("\"meshes/inductor.msh\"", "«\"../inductor.msh\"»")]),
    case("mesh.file is no text", INDUCTOR, &[("\"meshes/inductor.msh\"", "«5»")]),
    case(
        "mesh.file is no mesh",
        INDUCTOR,
        &[("\"meshes/inductor.msh\"", "\"device.toml\""), ("#:schema ./", "«#:schema» ./")],
    ),
    case(
        "a probe in metres in a mesh in millimetres",
        INDUCTOR,
        &[("[[\"0 mm\", \"0 mm\", \"15 mm\"]", "[«[\"0 mm\", \"0 mm\", \"15 m\"]»")],
    ),
];

#[test]
fn the_key_of_a_mesh_file() {
    compare("files", CASES);
}
