//! Nothing is lost: runs that are cut, and disks that fail, end up where a run without a break does, to the last bit.
#![allow(missing_docs)]

mod algorithms;
mod device;
mod disk;
mod essence;
mod faults;
mod resume;
mod whole;
