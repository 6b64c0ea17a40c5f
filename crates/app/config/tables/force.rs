//! `[[forces]]`: bodies on which force and torque are reported.

use crate::config::table::table;

table! {
    /// A body on which the magnetic force and torque are reported, of the meshed part; in harmonics their time average. Of a body
    /// that symmetry planes or other outer faces cut, along an axis or oblique, the component across a plane is that on its free
    /// faces, without the stress in the cut. It is taken by virtual work in the layer of elements around the body, which must be
    /// free of current, magnets, conductors and B–H curves, and lie within the mesh, not in the shell of `[open]`.
    ///
    /// ```toml
    /// [[forces]]
    /// name = "pole"
    /// regions = ["pole"]
    /// about = ["0 mm", "0 mm", "0 mm"]
    /// ```
    pub struct ForceBody {
        /// What the body is called in results; objectives and constraints of the kinds `force` and `torque` name it as their
        /// `region`. Each name once.
        name: String = TEXT, need "\"pole\"";
        /// The regions that make up the body: iron, magnets, windings that are regions, and conductors, meshed or replaced by
        /// their surfaces.
        regions: Vec<String> = not_empty(NAMES), need "[\"pole\"]";
        /// The point about which the torque is taken [m].
        about: [f64; 3] = length(FINITE) => [0.0; 3];
    }
}
