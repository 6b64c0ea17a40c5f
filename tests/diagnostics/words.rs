//! Tables that the shield does not have: prescribed motions, meshes of boxes and spheres.

use crate::case::{Base, Case, case, compare};

const MORPH: Base = Base::Own(
    r#"[mesh]
generator = "block"

[remesh]
region = "block"
free = ["z_max"]

[morph]
increments = 2

[[morph.motion]]
surface = "z_max"
displacement = ["0 mm", "0 mm", "5 mm"]

[morph.tune]
evaluations = 9
poisson = [0.1, 0.3]

[[morph.case]]
name = "soft"
remesh.poisson = 0.1

[[morph.case]]
name = "stiff"
remesh.poisson = 0.4
"#,
);

const BOXES: Base = Base::Own(
    r#"[mesh]
generator = "boxes"

[mesh.boxes]
box = [["-1 m", "-1 m", "-1 m"], ["1 m", "1 m", "1 m"]]

[[mesh.boxes.regions]]
name = "plate"
box = [["-10 cm", "-10 cm", "0 m"], ["10 cm", "10 cm", "2 cm"]]
size = "5 cm"

[[mesh.boxes.sizes]]
axis = "z"
from = "0 m"
to = "2 cm"
size = "1 cm"

[[mesh.boxes.surfaces]]
name = "top"
box = [["-10 cm", "-10 cm", "2 cm"], ["10 cm", "10 cm", "2 cm"]]

[analysis]
frequency = 0

[boundaries]
flux_parallel = ["z_min"]
"#,
);

const SPHERE: Base = Base::Shipped("sphere.toml");

pub(crate) const CASES: &[Case] = &[
    case("morph.increments is a wrong word", MORPH, &[("increments = 2", "increments = «\"many\"»")]),
    case("morph.increments is zero", MORPH, &[("increments = 2", "increments = «0»")]),
    case("morph key in plural", MORPH, &[("[[morph.motion]]", "[[morph.«motions»]]")]),
    case("morph.motion with single brackets", MORPH, &[("[[morph.motion]]", "«[morph.motion]»")]),
    case(
        "morph.motion without displacement",
        MORPH,
        &[
            ("displacement = [\"0 mm\", \"0 mm\", \"5 mm\"]\n", ""),
            ("[[morph.motion]]", "«[[morph.motion]]»"),
        ],
    ),
    case(
        "morph.motion with two targets",
        MORPH,
        &[("surface = \"z_max\"", "surface = \"z_max\"\nbox = «[[0, 0, 0], [1, 1, 1]]»")],
    ),
    case(
        "morph.motion.displacement has two lengths",
        MORPH,
        &[("[\"0 mm\", \"0 mm\", \"5 mm\"]", "«[\"0 mm\", \"5 mm\"]»")],
    ),
    case(
        "morph.motion.rotation without angle",
        MORPH,
        &[("displacement = [\"0 mm\", \"0 mm\", \"5 mm\"]", "rotation = «{ axis = \"z\" }»")],
    ),
    case(
        "morph.motion.scale.factor is negative",
        MORPH,
        &[("displacement = [\"0 mm\", \"0 mm\", \"5 mm\"]", "scale = { factor = «-2» }")],
    ),
    case(
        "morph.motion.design is a wrong word",
        MORPH,
        &[("surface = \"z_max\"\ndisplacement = [\"0 mm\", \"0 mm\", \"5 mm\"]", "design = «\"uper\"»")],
    ),
    case(
        "morph.tune.parameters misspelt",
        MORPH,
        &[("evaluations = 9", "parameters = [\"young\", «\"poison\"»]")],
    ),
    case("morph.tune bounds upside down", MORPH, &[("[0.1, 0.3]", "«[0.3, 0.1]»")]),
    case("two cases of one name", MORPH, &[("\"stiff\"", "«\"soft\"»")]),
    case("a case lays a wrong value over", MORPH, &[("remesh.poisson = 0.4", "remesh.poisson = «0.7»")]),
    case("a case with a key of no table", MORPH, &[("remesh.poisson = 0.4", "«poisson» = 0.4")]),
    case(
        "mesh.boxes without its table",
        BOXES,
        &[
            ("box = [[\"-1 m\", \"-1 m\", \"-1 m\"], [\"1 m\", \"1 m\", \"1 m\"]]\n", ""),
            ("[mesh.boxes]", "«[mesh.boxes]»"),
        ],
    ),
    case(
        "mesh.boxes.regions leaves the whole",
        BOXES,
        &[(
            "[[\"-10 cm\", \"-10 cm\", \"0 m\"], [\"10 cm\", \"10 cm\", \"2 cm\"]]",
            "«[[\"-10 cm\", \"-10 cm\", \"0 m\"], [\"10 cm\", \"10 cm\", \"2 m\"]]»",
        )],
    ),
    case("mesh.boxes.sizes.axis is a number", BOXES, &[("axis = \"z\"", "axis = «3»")]),
    case(
        "mesh.boxes.sizes upside down",
        BOXES,
        &[("from = \"0 m\"\nto = \"2 cm\"", "from = \"2 cm\"\nto = «\"0 m\"»")],
    ),
    case(
        "mesh.boxes.surfaces turned over",
        BOXES,
        &[(
            "[[\"-10 cm\", \"-10 cm\", \"2 cm\"], [\"10 cm\", \"10 cm\", \"2 cm\"]]",
            "«[[\"10 cm\", \"-10 cm\", \"2 cm\"], [\"-10 cm\", \"10 cm\", \"2 cm\"]]»",
        )],
    ),
    case("mesh.boxes.size in no unit known", BOXES, &[("size = \"5 cm\"", "size = «\"5 feet\"»")]),
    case("mesh.sphere.divisions is zero", SPHERE, &[("divisions = 6", "divisions = «0»")]),
    case("mesh.sphere.radius is a list", SPHERE, &[("radius = \"50 mm\"", "radius = «[\"50 mm\"]»")]),
    case("mesh.sphere.growth below one", SPHERE, &[("growth = 1.35", "growth = «0.35»")]),
    case("mesh.sphere.wall_layers of a full sphere", SPHERE, &[("growth = 1.35", "wall_layers = «3»")]),
];

#[test]
fn motions_boxes_and_spheres() {
    compare("words", CASES);
}
