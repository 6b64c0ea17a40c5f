//! What can be wrong with a coil's path or with where it meets the outside of the mesh.
//!
//! These say why and what to do; which coil and which surface is said by the variant of
//! [`SolverError`](crate::SolverError) that holds them.

use fluxmorph_geometry::millimetres;
use fluxmorph_geometry::tet4::Point;

/// Why a coil may not meet a surface as it does.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum PlaneFault {
    /// Current crosses a flux-parallel surface at a slant.
    #[error(
        "the current runs there at {angle:.2}° to the surface's normal, but it must cross a flux-parallel surface at \
         right angles, for the mirrored coil to carry it on; let the surface cut straight sides squarely, or move the \
         coil away"
    )]
    Slanting {
        /// Between current and normal, 0 to 90 [degrees].
        angle: f64,
    },
    /// Current crosses a surface with H × n = 0.
    #[error(
        "the current crosses it at {angle:.2}° to its normal, but no current may cross a surface at which H is normal: \
         the mirrored coil would carry it back; make the surface flux-parallel, or move the coil away"
    )]
    Crossing {
        /// Between current and normal, 0 to 90 [degrees].
        angle: f64,
    },
    /// `T` has a tangential part on a surface on which H is prescribed.
    #[error(
        "H is prescribed there and not B, and the source T of the coil or of its window has a tangential part, which \
         would act as a surface current; make the face flux-parallel, or move the coil away"
    )]
    TangentialSource,
    /// Current on a surface on which A is prescribed.
    #[error(
        "the field on a surface with an applied field is given and holds no coil's current; move the coil inside, away from the \
         surface"
    )]
    OnPrescribedField,
    /// A terminal that no mirrored coil goes on from.
    #[error(
        "this terminal does not lie on a flux-parallel outer surface, so the current would end there; make that surface \
         flux-parallel, or let the coil close on itself around an axis"
    )]
    EndsAtTerminal,
}

/// Why no current can be made in a region of the mesh.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
#[allow(missing_docs, reason = "the message of a variant says what its fields are")]
pub enum RegionFault {
    /// There is nothing to flow in.
    #[error("it has no elements; check the name of the region")]
    NoElements,
    /// A terminal that is somewhere else.
    #[error(
        "no triangle of the terminal `{terminal}` is a face of it; name a surface on which the winding is cut"
    )]
    TerminalElsewhere { terminal: String },
    /// Both terminals in one place.
    #[error(
        "its terminals `{from}` and `{to}` touch at {}: the current would have no way to go; \
         name two surfaces that are apart",
        millimetres(*place)
    )]
    TerminalsTouch {
        from: String,
        to: String,
        /// The node they share [m].
        place: Point,
    },
    /// Terminals that the current has no way between, outside the region.
    #[error(
        "its terminals lie on walls that nothing connects: the current would gather at {}. Cut the \
         winding at flux-parallel surfaces that touch each other, directly or along other flux-parallel surfaces or conductors, \
         or let the coil close on itself around an axis",
        millimetres(*place)
    )]
    Unconnected {
        /// A node of one of the walls [m].
        place: Point,
    },
    /// A solid conductor that another conductor touches.
    #[error(
        "another conductor touches it at {}, and current would pass between them there; leave a gap, or make both one \
         region",
        millimetres(*place)
    )]
    Touched {
        /// A node of both [m].
        place: Point,
    },
    /// A solid conductor of which another coil is, too.
    #[error(
        "the coil `{other}` is of the same elements, and its current would not be seen; make both one coil, or two regions"
    )]
    Shared { other: String },
    /// A ring round a tunnel of the mesh.
    #[error(
        "its current flows round a tunnel of the mesh whose walls have no condition, and H would have to turn round it \
         where it is zero. Mesh the tunnel too, or give the mesh's outer surfaces or the tunnel's walls the condition \
         flux_parallel"
    )]
    RoundTunnel,
    /// A part of the region that carries nothing.
    #[error(
        "it has {parts} separate parts, and the terminal `{terminal}` does not touch the one at \
         {}; both terminals must touch every part, or make that part a coil of its own",
        millimetres(*place)
    )]
    PartWithoutTerminal {
        parts: usize,
        terminal: String,
        /// A node of the part [m].
        place: Point,
    },
    /// More than one ring.
    #[error(
        "it has {parts} separate parts, but a closed coil is one ring; give each part its own region and coil"
    )]
    SeveralRings { parts: usize },
    /// The line lies in the conductor.
    #[error(
        "the line given by center and axis passes through it at {}; give any line through the \
         hole of the ring",
        millimetres(*place)
    )]
    AxisInside {
        /// A place of the conductor next to the line [m].
        place: Point,
    },
    /// Nothing goes round.
    #[error(
        "no closed way in it goes round the line given by center and axis; give a line through the hole of the ring, \
         or two terminals where the ring is cut by symmetry planes"
    )]
    NoRing,
}
