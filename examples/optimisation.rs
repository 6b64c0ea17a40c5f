//! One optimisation over the library: a configuration, its problem, the driver, an observer.
//!
//! `cargo run --release --example optimisation`

use fluxmorph::Error;
use fluxmorph::build::{Mode, set_up};
use fluxmorph::config::{Config, Optimizer};
use fluxmorph::show::Console;
use fluxmorph_optimizer::driver::{Unrecorded, optimise};

pub(crate) fn main() -> Result<(), Error> {
    let (config, source) =
        Config::from_str(include_str!("../configs/shield_quick.toml"), "shield_quick.toml")?;
    let mut problem = set_up(&config, &source, Mode::Optimisation)?.problem;

    // Seven evaluations are enough to see the frame; `run::run` would also write a run directory.
    let settings = Optimizer { max_evaluations: 7, ..config.optimizer };
    let mut console = Console::new(std::io::stdout());
    let optimised = optimise(&mut problem, &settings.settings(), &mut console, &mut Unrecorded, &|| false)?;

    let ratio = optimised.best.objective / optimised.initial;
    println!("F/F0 = {ratio:.4} at evaluation {}", optimised.best.evaluation);
    println!("heights [mm], y to the right, x downwards:");
    for row in optimised.best.values.chunks(13) {
        println!("{}", row.iter().map(|p| format!("{:6.1}", p * 1e3)).collect::<String>());
    }
    assert!(ratio < 0.6);
    Ok(())
}
