//! A group of threads, and a leader that does something with its problem.

use std::sync::Arc;

use fluxmorph::build::{Mode, Setup, set_up_watched};
use fluxmorph::{Error, run};
use fluxmorph_geometry::parallel::{RankGroup, Role, threads};

use crate::support;

/// Has so many ranks set a shipped configuration up that can be; what the first one makes of it.
pub(crate) fn led<T: Send>(
    size: usize,
    name: &str,
    overrides: &[&str],
    lead: impl Fn(Setup) -> T + Sync,
) -> T {
    attempted(size, name, overrides, |setup| lead(setup.unwrap_or_else(|error| panic!("{error}"))))
}

/// Has so many ranks try to set a shipped configuration up; what the first one makes of that.
pub(crate) fn attempted<T: Send>(
    size: usize,
    name: &str,
    overrides: &[&str],
    lead: impl Fn(Result<Setup, Error>) -> T + Sync,
) -> T {
    let led = threads::run(size, |ranks| {
        let group = RankGroup::new(ranks, Arc::default());
        let (config, source) = support::config(name, overrides);
        if group.role() == Role::Worker {
            run::serve(&group, &config, &source, Mode::Optimisation);
            return None;
        }
        let setup = set_up_watched(&config, &source, Mode::Optimisation, Some(&group), &mut |_| ());
        let result = lead(setup);
        group.shut_down();
        Some(result)
    });
    led.into_iter().flatten().next().expect("the first rank leads")
}
