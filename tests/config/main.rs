//! Wrong inputs: what the program says of a configuration, an override or a mesh file that it cannot use, and that no such
//! file takes more memory, time or room than it may.
//!
//! `wrong/*.txt` is the table of wrong inputs, `warned/*.txt` that of what `check` warns of, `sound.txt` that of the values of
//! sound inputs; the form of all is in [`case`].
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
#[path = "../../fuzz/src/quantity.rs"]
#[allow(unreachable_pub, reason = "the fuzz target shares it")]
mod quantity;
mod samples;
mod sound;
#[path = "../support/mod.rs"]
mod support;
mod typos;
mod verdict;
mod warned;
mod wrong;
