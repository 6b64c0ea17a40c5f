//! What is wrong only once the mesh is known: names, places, and what does not go together.

use crate::case::{Base, Case, case, compare};

const QUICK: Base = Base::Shipped("shield_quick.toml");
const INDUCTOR: Base = Base::Shipped("inductor.toml");
const SPHERE: Base = Base::Shipped("sphere.toml");

pub(crate) const CASES: &[Case] = &[
    case("no such region", QUICK, &[("[regions.plate]", "«[regions.plat]»")]),
    case("no such observation region", QUICK, &[("region = \"observation\"", "region = «\"observaton\"»")]),
    case("no such remesh region", QUICK, &[("region = \"remesh\"", "region = «\"remsh\"»")]),
    case("no such remesh region in a list", INDUCTOR, &[("[\"core\", \"gap\"]", "[\"core\", «\"gab\"»]")]),
    case("no such surface of a condition", QUICK, &[("\"x_min\", \"x_max\"", "\"x_min\", «\"x_mx\"»")]),
    case("no such design surface", QUICK, &[("surface = \"plate_bottom\"", "surface = «\"plate_botom\"»")]),
    case("no such sliding surface", QUICK, &[("\"plate_side\"]", "«\"plate_sides\"»]")]),
    case("no such coil region", INDUCTOR, &[("region = \"coil\"", "region = «\"coils\"»")]),
    case("no such side of an interface", INDUCTOR, &[("[\"core|gap\"]", "[«\"core|gaps\"»]")]),
    case("two regions that do not touch", INDUCTOR, &[("[\"core|gap\"]", "[«\"core|coil\"»]")]),
    case(
        "no such region of a constraint",
        INDUCTOR,
        &[("region = \"core\"\nupper_ratio", "region = «\"cores\"»\nupper_ratio")],
    ),
    case(
        "a probe outside of the mesh",
        QUICK,
        &[("[[\"0 mm\", \"0 mm\", \"-50 mm\"]", "[«[\"0 mm\", \"0 mm\", \"-50 m\"]»")],
    ),
    case(
        "a probe inside a replaced region",
        QUICK,
        &[("[[\"0 mm\", \"0 mm\", \"-50 mm\"]", "[«[\"0 mm\", \"0 mm\", \"-5 mm\"]»")],
    ),
    case(
        "a coil in the remesh region",
        QUICK,
        &[("center = [\"0 mm\", \"0 mm\", \"60 mm\"]", "center = «[\"0 mm\", \"0 mm\", \"0 mm\"]»")],
    ),
    case(
        "a coil outside of the mesh",
        QUICK,
        &[("center = [\"0 mm\", \"0 mm\", \"60 mm\"]", "center = «[\"0 mm\", \"0 mm\", \"60 m\"]»")],
    ),
    case(
        "a coil along a plane",
        QUICK,
        &[("center = [\"0 mm\", \"0 mm\", \"60 mm\"]", "center = «[\"70 mm\", \"0 mm\", \"60 mm\"]»")],
    ),
    case(
        "the axis of a coil goes through it",
        INDUCTOR,
        &[("center = [\"0 mm\", \"0 mm\", \"0 mm\"]", "center = «[\"25 mm\", \"0 mm\", \"0 mm\"]»")],
    ),
    case(
        "terminals that are elsewhere",
        INDUCTOR,
        &[(
            "center = [\"0 mm\", \"0 mm\", \"0 mm\"]                 # with the axis: a line through the hole\naxis = \"z\"",
            "terminals = [«\"outer\"», \"middle\"]",
        )],
    ),
    case("the observed region is replaced", QUICK, &[("region = \"observation\"", "region = «\"plate\"»")]),
    case(
        "the observed region moves",
        QUICK,
        &[
            ("region = \"observation\"", "region = «\"observation\"»"),
            ("region = \"remesh\"", "region = [\"remesh\", \"observation\"]"),
        ],
    ),
    case(
        "the loss of what does not conduct",
        QUICK,
        &[(
            "kind = \"flux_density_squared\"\nregion = \"observation\"\nweighting = \"point\"",
            "kind = \"loss\"\nregion = «\"observation\"»",
        )],
    ),
    case("the mass of what has no density", INDUCTOR, &[("kind = \"volume\"", "kind = «\"mass\"»")]),
    case(
        "a condition inside the mesh",
        QUICK,
        &[("[objective]", "flux_normal = [«\"air|remesh\"»]\n\n[objective]")],
    ),
    case(
        "no condition at all",
        SPHERE,
        &[
            ("[boundaries]", "«[boundaries]»"),
            ("flux_parallel = [\"x_min\", \"y_min\"]", "#"),
            ("flux_normal = [\"z_min\"]", "#"),
            ("uniform_field = ", "# "),
        ],
    ),
    case(
        "an applied field that contradicts a plane",
        SPHERE,
        &[(
            "{ surfaces = [\"outer\"], b = [0.0, 0.0, \"1 T\"] }",
            "«{ surfaces = [\"outer\"], b = [\"1 T\", 0, 0] }»",
        )],
    ),
    case(
        "a design box without elements",
        QUICK,
        &[("region = \"remesh\"", "box = «[[\"1 m\", \"1 m\", \"1 m\"], [\"2 m\", \"2 m\", \"2 m\"]]»")],
    ),
    case(
        "the remesh region does not hold the design",
        QUICK,
        &[
            (
                "region = \"remesh\"",
                "box = «[[\"0 mm\", \"0 mm\", \"-300 mm\"], [\"100 mm\", \"100 mm\", \"-100 mm\"]]»",
            ),
            (", \"plate_side\"]", "]"),
        ],
    ),
    case(
        "a sliding surface that is elsewhere",
        QUICK,
        &[("\"plate_side\"]", "\"plate_side\", «\"x_max\"»]")],
    ),
    case("a curved surface cannot slide", INDUCTOR, &[("free = [\"core|gap\"]", "slide = [«\"core|gap\"»]")]),
    case(
        "a subregion that is no part",
        QUICK,
        &[("[optimizer]", "[[remesh.subregions]]\nname = «\"observation\"»\nyoung = 2\n\n[optimizer]")],
    ),
    case(
        "a grid that cannot be laid",
        QUICK,
        &[("direction = [0.0, 0.0, -1.0]", "direction = «[1.0, 0.0, 0.0]»")],
    ),
    case(
        "initial values that are too few",
        QUICK,
        &[("upper = \"20 mm\"", "upper = \"20 mm\"\ninitial = «[\"1 mm\", \"2 mm\"]»")],
    ),
    case(
        "a minimum quality that the mesh lacks",
        QUICK,
        &[("max_evaluations = 5", "minimum_quality = «0.9»")],
    ),
    case(
        "a bound that breaks the mesh",
        QUICK,
        &[
            ("region = \"remesh\"", "region = \"remesh\"\nrounds = 0"),
            ("upper = \"20 mm\"", "upper = «\"40 mm\"»"),
        ],
    ),
    case(
        "a design surface that only the outside has",
        QUICK,
        &[("surface = \"plate_bottom\"", "surface = «\"plate_botom|air\"»")],
    ),
    case(
        "a parameter that the generator refuses",
        QUICK,
        &[("\"240 mm\", \"10 mm\"]", "\"240 mm\", \"1 m\"]"), ("[mesh.shield] ", "«[mesh.shield]»")],
    ),
    case(
        "a motion along no axis",
        INDUCTOR,
        &[
            ("[0.0, 0.0, 1.0]", "[0.0, 1.0, 1.0]"),
            ("grid = [3, 3]", "# "),
            ("motion = \"along_design\"", "motion = «\"along_design\"»"),
        ],
    ),
    case(
        "two names of the mesh beside a value",
        QUICK,
        &[
            ("\"60 Hz\"", "«\"60 mm\"»"),
            ("region = \"observation\"", "region = \"observaton\""),
            ("\"plate_side\"]", "\"plate_sides\"]"),
        ],
    )
    .with(3),
];

#[test]
fn names_places_and_what_does_not_go_together() {
    compare("setups", CASES);
}
