//! The JSON schema of the configuration says what the program says.

mod agreement;
mod bases;
mod changes;
mod files;
mod keys;
mod places;
mod samples;
#[path = "../support/mod.rs"]
mod support;
mod verdict;
