//! Whole configurations, as `fluxmorph check` reads them before it turns to the mesh. What stands behind a zero is an
//! override, `key=value`.

#![no_main]

use std::path::PathBuf;

use fluxmorph::config::{Config, resolved_toml};
use fluxmorph_fuzz::{in_time, mutation};
use libfuzzer_sys::{fuzz_mutator, fuzz_target};

fuzz_target!(|data: &[u8]| in_time(|| check(data)));

fn check(data: &[u8]) {
    let Ok(text) = std::str::from_utf8(data) else { return };
    let mut parts = text.split('\0').map(str::to_owned);
    let text = parts.next().unwrap_or_default();
    let overrides: Vec<String> = parts.collect();
    match Config::again("fuzz.toml".to_owned(), text, PathBuf::new(), "fuzz", &overrides) {
        Ok((config, source)) => {
            for missing in [config.optimisation(&source).err(), config.morphing(&source).err()] {
                assert!(missing.is_none_or(|error| !error.to_string().is_empty()));
            }
            let resolved = resolved_toml(&config);
            match Config::from_str(&resolved, "fuzz.toml") {
                Ok((again, _)) => assert_eq!(again, config, "{resolved}"),
                Err(error) => panic!("the resolved configuration is refused: {error}"),
            }
        }
        // The report shows the text around every fault.
        Err(error) => assert!(!error.to_string().is_empty()),
    }
}

fuzz_mutator!(|data: &mut [u8], size: usize, max_size: usize, seed: u32| {
    mutation::text(data, size, max_size, seed)
});
