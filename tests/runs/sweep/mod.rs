//! `fluxmorph sweep`: one run for every combination, whatever breaks in between, and an honest comparison of them.
//!
//! `order` has what is run under which names, and what is refused before; `going_on` what a second sweep skips, resumes and
//! begins, after kills and signals; `array` the script for a scheduler; `outcome` the table, the page and the exit codes;
//! `front` what is traded between the runs.

mod array;
mod front;
mod home;
mod order;
mod outcome;
mod resuming;
