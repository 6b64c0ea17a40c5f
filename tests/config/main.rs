//! Wrong inputs: what the program says of a configuration, an override or a mesh file that it cannot use, and that no such
//! file takes more memory, time or room than it may.
//!
//! `wrong/*.txt` is the table of wrong inputs, `sound/*.txt` that of sound ones; the form of both is in [`case`].
//! `SNAPSHOTS=overwrite cargo test --release --test config` writes what is expected anew.

mod agreement;
mod broken_meshes;
mod case;
mod chance;
mod changes;
mod damage;
mod folders;
mod generated;
mod hidden;
mod limits;
mod looks;
mod meshes;
#[path = "../../crates/geometry/tests/msh_support/mod.rs"]
mod msh_support;
mod places;
mod program;
mod samples;
mod sound;
#[path = "../support/mod.rs"]
mod support;
mod typos;
mod verdict;
mod wrong;
