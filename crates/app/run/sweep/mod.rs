//! Many runs of one configuration: every combination of some values of its keys, each in a run directory of its own.
//!
//! `setting` takes a `--set key=v1,v2` apart, `combinations` makes their product and `names` the names of the directories;
//! `plan` reads the configuration of every combination before anything runs. `layout` owns the directory of the sweep and
//! `sweep.json`, `state` says what a run directory still needs, `work` lets child processes do that, `script` writes it
//! down for a scheduler. `comparison` gathers the results into `sweep.csv`, `page` into `sweep.html`; `front` says what is traded
//! between them.
//!
//! Does not live here: anything that solves or optimises. A combination is a `fluxmorph run` or `resume` like any other, in
//! a process of its own: one that runs out of memory takes no other with it.

mod combinations;
mod comparison;
mod error;
mod front;
mod layout;
mod names;
mod page;
mod plan;
mod plots;
mod script;
mod setting;
mod state;
mod work;

pub use combinations::{Combination, MOST_COMBINATIONS, combinations};
pub use comparison::{Comparison, Row};
pub use error::SweepError;
pub use front::Criterion;
pub use layout::{Layout, Task};
pub use plan::{Outside, Planned, Request, Sweep};
pub use script::{ScriptFile, script};
pub use setting::Setting;
pub use state::{State, States};
pub(crate) use work::ENDS_WITH_STDIN;
pub use work::{Ending, Event, Workers};
