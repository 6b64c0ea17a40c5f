//! Keys and values that stand in the wrong table.

use crate::case::{Base, Case, case, compare};

const QUICK: Base = Base::Shipped("shield_quick.toml");

pub(crate) const CASES: &[Case] = &[
    case(
        "frequency under mesh",
        QUICK,
        &[("generator = \"shield\"", "generator = \"shield\"\n«frequency» = \"60 Hz\"")],
    ),
    case("algorithm under design", QUICK, &[("grid = [7, 13]", "grid = [7, 13]\n«algorithm» = \"mma\"")]),
    case("slide under boundaries", QUICK, &[("[objective]", "«slide» = [\"x_min\"]\n\n[objective]")]),
    case(
        "plate under mesh",
        QUICK,
        &[("generator = \"shield\"", "generator = \"shield\"\n«plate» = [1, 1, 1]")],
    ),
    case("width under mesh.shield", QUICK, &[("skin = []", "skin = []\n«width» = \"20 mm\"")]),
    case(
        "conductivity under regions",
        QUICK,
        &[("material = \"steel\"", "material = \"steel\"\n«conductivity» = \"7e6 S/m\"")],
    ),
    case("directory at the top", QUICK, &[("title = ", "«directory» = \"runs/a\"\ntitle = ")]),
    case("misspelt key of another table", QUICK, &[("title = ", "«max_evaluatons» = 5\ntitle = ")]),
    case("singular for a list of tables", QUICK, &[("[[probes]]", "[[«probe»]]")]),
    case("singular with single brackets", QUICK, &[("[[probes]]", "[«probe»]")]),
    case("table twice in brackets", QUICK, &[("[objective]", "«[[objective]]»")]),
    case("key with a hyphen", QUICK, &[("max_evaluations = 5", "«max-evaluations» = 5")]),
    case("key in camel case", QUICK, &[("max_evaluations = 5", "«maxEvaluations» = 5")]),
    case("key in capitals", QUICK, &[("title = ", "«TITLE» = ")]),
];

#[test]
fn keys_in_the_wrong_table() {
    compare("elsewhere", CASES);
}
