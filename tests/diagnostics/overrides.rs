//! Overrides of the command line.

use crate::case::{Base, Case, case, compare};

const QUICK: Base = Base::Shipped("shield_quick.toml");

const fn set(name: &'static str, set: &'static [&'static str]) -> Case {
    Case { set, ..case(name, QUICK, &[]) }
}

pub(crate) const CASES: &[Case] = &[
    set("--set with a misspelt key", &["analysis.«freqency»=\"50 Hz\""]),
    set("--set with a misspelt table", &["«analisys».frequency=\"50 Hz\""]),
    set("--set out of range", &["optimizer.max_evaluations=«0»"]),
    set("--set in a wrong dimension", &["analysis.frequency=«\"50 mm\"»"]),
    set("--set of a word that is none", &["remesh.stiffness=«\"soft\"»"]),
    set("--set behind the end of a list", &["coils.«3».width=\"1 mm\""]),
    set("--set through a value", &["optimizer.algorithm.«name»=\"mma\""]),
    set("--set of a region that is not there", &["objective.region=«\"observatory\"»"]),
    set("--set of a bound that breaks the mesh", &["remesh.rounds=0", "design.upper=«\"40 mm\"»"]),
];

#[test]
fn overrides_of_the_command_line() {
    compare("overrides", CASES);
}
