//! The gradient certificate over the library: Taylor remainders and central differences in random directions.
//!
//! `cargo run --release --example gradient_check`

use fluxmorph::Error;
use fluxmorph::build::{Mode, set_up};
use fluxmorph::config::Config;
use fluxmorph_optimizer::verify::{Settings, certify};

pub(crate) fn main() -> Result<(), Error> {
    let (config, source) =
        Config::from_str(include_str!("../configs/shield_quick.toml"), "shield_quick.toml")?;
    let problem = set_up(&config, &source, Mode::Optimisation)?.problem;
    let variables = problem.shape().expect("the configuration has a design").surface().variable_count();

    // At a design that is not flat, in two directions.
    let design: Vec<f64> = (0..variables).map(|k| 5e-3 + 3e-3 * (0.9 * k as f64).cos()).collect();
    let settings = Settings { directions: 2, ..Settings::default() };
    let certificates = certify(&problem, &design, &settings, &|| false, |_, index, direction| {
        println!(
            "direction {index}: slope {:.4}, central difference {:.1e}",
            direction.slope, direction.error
        );
    })?;
    assert!(certificates.hold());
    Ok(())
}
