//! Texts that are no TOML.

use crate::case::{Base, Case, case, compare};

const QUICK: Base = Base::Shipped("shield_quick.toml");

pub(crate) const CASES: &[Case] = &[
    case("quote not closed", QUICK, &[("\"60 Hz\"", "\"60 Hz«»")]),
    case("quote not opened", QUICK, &[("\"60 Hz\"", "«6»0 Hz\"")]),
    case("quote not closed in a list", QUICK, &[("\"60 mm\", \"160 mm\"]", "\"60 mm\", \"160 mm]«»")]),
    case("value with a unit and no quotes", QUICK, &[("width = \"20 mm\"", "width = «20 mm»")]),
    case("value with a unit and no blank", QUICK, &[("width = \"20 mm\"", "width = «20mm»")]),
    case("word without quotes", QUICK, &[("\"racetrack\"", "«racetrack»")]),
    case("item without quotes", QUICK, &[("[\"60 mm\", \"160 mm\"]", "[\"60 mm\", «160 mm»]")]),
    case("colon for equals sign", QUICK, &[("algorithm = \"mma\"", "algorithm«:» \"mma\"")]),
    case("key alone", QUICK, &[("poisson = 0.3", "poisson«»")]),
    case("key of two words", QUICK, &[("max_evaluations = 5", "max «e»valuations = 5")]),
    case("key twice", QUICK, &[("lower = \"-5 mm\"", "lower = \"-5 mm\"\n«lower» = \"-4 mm\"")]),
    case("table twice", QUICK, &[("[output]", "[«design»]\ngrid = [2, 2]\n\n[output]")]),
    case("header not closed", QUICK, &[("[design]", "[design«»")]),
    case("list not closed", QUICK, &[("grid = [7, 13]", "grid = [7, 13"), ("lower = ", "«l»ower = ")]),
    case("no comma between texts", QUICK, &[("[\"60 mm\", \"160 mm\"]", "[\"60 mm\" «\"»160 mm\"]")]),
    case("decimal comma", QUICK, &[("poisson = 0.3", "poisson = 0«,»3")]),
    case("path of another system", QUICK, &[("\"runs/shield_quick\"", "\"runs\\«s»hield\"")]),
    case("braces not closed", QUICK, &[("weighting = \"point\"", "x = { a = 1"), ("[design]", "«[»design]")]),
];

#[test]
fn texts_that_are_no_toml() {
    compare("syntax", CASES);
}
