//! The first steps of every method on shipped devices: neither lost below the mesh's error nor thrown beyond use.

use fluxmorph::build::{Mode, set_up};
use fluxmorph::config::{Algorithm, Optimizer};
use fluxmorph::show::Silent;

use crate::problems::optimised;
use crate::support::config;

/// No more steel than the flat plate has, and no more ferrite than the flat core.
const NO_ROOM: [&str; 2] = [
    "constraints=[{kind='mass', region='plate', upper_ratio=1.0}]",
    "constraints=[{kind='volume', region='core', upper_ratio=1.0}]",
];

/// Configuration and overrides; with a filter every node is a variable instead of a control grid.
const DEVICES: [(&str, &[&str], Option<f64>); 9] = [
    ("shield_quick.toml", &[], None),
    ("shield_quick.toml", &[], Some(0.03)),
    ("pole.toml", &["mesh.boxes.refinement=0.7"], None),
    ("inductor.toml", &["analysis.order=1"], None),
    ("inductor.toml", &["analysis.order=1", NO_ROOM[1]], None),
    ("shield_mass_limit.toml", &[], None),
    ("shield_mass_limit.toml", &[NO_ROOM[0]], None),
    ("shield_two_loads.toml", &[], None),
    ("busbar.toml", &[], None),
];

#[test]
fn first_steps_are_between_one_and_thirty_per_cent_of_the_range() {
    for (file, overrides, filter) in DEVICES {
        let (mut config, source) = config(file, overrides);
        if let (Some(_), Some(design)) = (filter, &mut config.design) {
            (design.grid, design.filter_radius) = (None, filter);
        }
        for algorithm in [Algorithm::Mma, Algorithm::Ccsaq, Algorithm::Slsqp] {
            let mut problem = set_up(&config, &source, Mode::Optimisation).expect("a sound problem").problem;
            let shape = problem.shape().expect("a shape");
            let ranges = shape.lower().iter().zip(shape.upper()).map(|(low, high)| (high - low).powi(2));
            let range = ranges.sum::<f64>().sqrt();
            // The last evaluation may be for a step back within the bounds.
            let settings = Optimizer { algorithm, max_evaluations: 4, ..config.optimizer.clone() };
            let (_, rows) = optimised(&mut problem, &settings, &mut Silent);
            let shares: Vec<f64> = rows.iter().skip(1).take(2).map(|row| row.step_norm / range).collect();
            println!("{file} {algorithm:?}: {shares:.3?}, F/F0 {:.3}", rows[1].ratio);
            assert!(shares.len() == 2 && shares.iter().all(|s| (0.01..=0.3).contains(s)), "{shares:?}");
            // The inductor's energy is made large.
            assert!(rows[1].ratio <= 1.5, "{file} {algorithm:?}: {}", rows[1].ratio);
        }
    }
}
