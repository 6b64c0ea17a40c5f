//! The current of a coil that is a region of the mesh, for one ampere-turn.
//!
//! A stranded winding carries the same current in each turn, so `|J|` is uniform where the cross-section is; its
//! direction is that of a conductor's current. Four steps, with nodal potentials on the region:
//!
//! 1. conduction: between terminals `h = −∇φ`, `∫∇φ·∇q = 0`, `φ = 1` and `0` on them; in a closed ring
//!    `h = ∇θ − ∇φ`, `∫(∇θ − ∇φ)·∇q = 0`, with the angle `θ` about a line through the hole, whose gradient is taken of
//!    its nodal values element by element, so that any line gives the same `h`;
//! 2. uniform magnitude: `J1 = h/|h|`, with `h` averaged over the elements around each node: that of one element leans to the
//!    inside of a bend;
//! 3. projection: `J = J1 − ∇χ`, `∫(J1 − ∇χ)·∇q = 0` for all nodal `q` (zero on terminals);
//! 4. scale: `∫J·∇φ = −I` between terminals, `∫J·∇θ = 2π I` in a ring. For a `J` with the property of step 3 these are
//!    exact and do not depend on where a cross-section is laid.
//!
//! What the projection cannot do on elements of constant `J` is measured in [`super::divergence`].

use std::f64::consts::{PI, TAU};

use fluxmorph_geometry::tet4::{Point, Tet4, dot, norm, sub};
use fluxmorph_geometry::topology::face_key;
use fluxmorph_geometry::{ElementId, Mesh, NodeId};

use super::divergence::{CurrentReport, Section, report};
use super::fault::RegionFault;
use super::frame::Frame;
use super::patch::{Contact, Patch, direction};
use super::potential::Potential;
use crate::error::SolverError;

/// Where current enters or leaves a region.
#[derive(Clone, Debug, PartialEq)]
pub struct Terminal {
    /// Name of the surface, for messages.
    pub name: String,
    /// Its triangles; those that are no face of the region do not count.
    pub triangles: Vec<[NodeId; 3]>,
}

/// The way of the current through a region.
#[derive(Clone, Debug, PartialEq)]
pub enum Path {
    /// Between two terminals. Several separate parts, which have no face in common, are in series: each carries the whole current.
    Terminals {
        /// Where positive current comes in.
        from: Terminal,
        /// Where it goes out.
        to: Terminal,
    },
    /// Round a hole, anticlockwise about the axis of the frame: any line through the hole.
    Closed(Frame),
}

/// A face of a terminal.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct TerminalFace {
    /// Nodes, ascending.
    pub nodes: [NodeId; 3],
    /// Whether the first or the second terminal.
    pub end: End,
}

/// One of the two terminals.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum End {
    /// Where positive current comes in.
    From,
    /// Where it goes out.
    To,
}

/// The current density of one ampere-turn in a region of the mesh.
#[derive(Clone, Debug, PartialEq)]
pub struct RegionCurrent {
    current_density: Vec<(ElementId, Point)>,
    /// `∫J·∇λ_a` [1] for the vertices of every element, which a current that is carried along with the mesh keeps.
    into_vertices: Vec<[f64; 4]>,
    terminals: Vec<TerminalFace>,
    terminal_names: Option<[String; 2]>,
    report: CurrentReport,
}

/// `|h|` over its root mean square below which an element counts as dead: no current passes it.
const DEAD: f64 = 1e-9;

/// Cosine of the angle between the direction of an element and that around it from which the latter is taken: along a bend of four
/// elements a quarter turn they differ by less than 30°.
const LEAST_COSINE: f64 = 0.5;

/// `‖h‖/‖∇θ‖` below which nothing goes round the line: rounding of the solve, far below any ring's.
pub(super) const NO_RING: f64 = 1e-6;

impl RegionCurrent {
    /// The current in the elements of a region; `coil` names it in messages.
    ///
    /// # Errors
    /// [`SolverError::CoilRegion`] says what is wrong with region or path; [`SolverError::Mesh`] if a solve fails.
    pub fn new(mesh: &Mesh, coil: &str, elements: &[ElementId], path: &Path) -> Result<Self, SolverError> {
        let refuse = |fault| SolverError::CoilRegion { coil: coil.to_owned(), fault };
        if elements.is_empty() {
            return Err(refuse(RegionFault::NoElements));
        }
        let patch = Patch::new(mesh, elements, Contact::Face);
        match path {
            Path::Terminals { from, to } => {
                let terminals = terminal_faces(&patch, from, to).map_err(refuse)?;
                let values = terminal_values(&patch, &terminals, [from, to]).map_err(refuse)?;
                let mut current = between(&patch, terminals, &values)?;
                current.terminal_names = Some([from.name.clone(), to.name.clone()]);
                Ok(current)
            }
            Path::Closed(frame) => {
                if patch.parts != 1 {
                    return Err(refuse(RegionFault::SeveralRings { parts: patch.parts }));
                }
                let turning = angle_gradient(&patch, frame).map_err(refuse)?;
                ring_current(&patch, frame, &turning)?.ok_or_else(|| refuse(RegionFault::NoRing))
            }
        }
    }

    /// A current that is given in the elements of a patch [A/m²], for one ampere.
    pub(super) fn of_conduction(
        (patch, problem): (&Patch, &Potential<'_>),
        current: Vec<Point>,
        (terminals, names): (Vec<TerminalFace>, Option<[String; 2]>),
        sections: Section<'_>,
    ) -> Self {
        let report = report(patch, problem, [&current, &current], &terminals, sections);
        let into_vertices = into_vertices(patch, &current);
        let current_density = patch.elements.iter().copied().zip(current).collect();
        Self { current_density, into_vertices, terminals, terminal_names: names, report }
    }

    /// `J` of every element of the region for one ampere-turn [A/m²], ascending by element.
    pub fn current_density(&self) -> &[(ElementId, Point)] {
        &self.current_density
    }

    /// What it brings to the vertices of every element in the same order, for one ampere-turn; of a current that is carried along with the
    /// mesh the same on all meshes.
    pub(super) fn brought_to_vertices(&self) -> &[[f64; 4]] {
        &self.into_vertices
    }

    /// The faces of the terminals; none in a closed ring.
    pub fn terminals(&self) -> &[TerminalFace] {
        &self.terminals
    }

    /// Name of the surface of a terminal; `None` in a closed ring.
    pub fn terminal_name(&self, end: End) -> Option<&str> {
        self.terminal_names.as_ref().map(|names| names[end as usize].as_str())
    }

    /// How far the current is from one without divergence.
    pub fn report(&self) -> &CurrentReport {
        &self.report
    }
}

/// The current between terminals; `values` is φ on their nodes and `None` elsewhere.
fn between(
    patch: &Patch,
    terminals: Vec<TerminalFace>,
    values: &[Option<f64>],
) -> Result<RegionCurrent, SolverError> {
    let given: Vec<bool> = values.iter().map(Option::is_some).collect();
    let lift: Vec<f64> = values.iter().map(|v| v.unwrap_or(0.0)).collect();
    let problem = Potential::new(patch, &given)?;
    let phi = problem.solve(&vec![[0.0; 3]; patch.elements.len()], &lift);
    let conduction: Vec<Point> = patch.gradient(&phi).into_iter().map(|g| g.map(|c| -c)).collect();
    let sections = Section::LevelsOf(&phi);
    Ok(stranded_current(patch, &problem, &conduction, &conduction, terminals, sections))
}

/// The current of a ring, `turning` = ∇θ; `None` if nothing goes round.
fn ring_current(
    patch: &Patch,
    frame: &Frame,
    turning: &[Point],
) -> Result<Option<RegionCurrent>, SolverError> {
    let mut given = vec![false; patch.points.len()];
    given[0] = true;
    let problem = Potential::new(patch, &given)?;
    let phi = problem.solve(turning, &vec![0.0; given.len()]);
    let conduction: Vec<Point> = turning.iter().zip(patch.gradient(&phi)).map(|(t, g)| sub(*t, g)).collect();
    if patch.norm(&conduction) < NO_RING * patch.norm(turning) {
        return Ok(None);
    }
    let guide: Vec<Point> = turning.iter().map(|t| t.map(|c| c / TAU)).collect();
    let sections = Section::HalfPlanesOf(frame);
    Ok(Some(stranded_current(patch, &problem, &conduction, &guide, Vec::new(), sections)))
}

/// Steps 2 to 4: `∫J·guide = 1` on every part.
fn stranded_current(
    patch: &Patch,
    problem: &Potential<'_>,
    conduction: &[Point],
    guide: &[Point],
    terminals: Vec<TerminalFace>,
    sections: Section<'_>,
) -> RegionCurrent {
    let least = DEAD * patch.rms(conduction);
    let smoothed = patch.smoothed(conduction);
    let uniform = |(h, smoothed): (&Point, &Point)| {
        let (own, around) = (direction(*h, least), direction(*smoothed, least));
        // Where a winding touches itself, the mean is neither leg's.
        if dot(own, around) > LEAST_COSINE { around } else { own }
    };
    let uniform: Vec<Point> = conduction.iter().zip(&smoothed).map(uniform).collect();
    let chi = problem.solve(&uniform, &vec![0.0; patch.points.len()]);
    let correction = patch.gradient(&chi);
    let projected: Vec<Point> = uniform.iter().zip(&correction).map(|(j, c)| sub(*j, *c)).collect();
    let mut through = vec![0.0; patch.parts];
    for (e, (j, g)) in projected.iter().zip(guide).enumerate() {
        through[patch.part_of_element(e)] += patch.tets[e].volume * dot(*j, *g);
    }
    let scaled = |field: &[Point]| -> Vec<Point> {
        field.iter().enumerate().map(|(e, j)| j.map(|c| c / through[patch.part_of_element(e)])).collect()
    };
    let current = scaled(&projected);
    let report = report(patch, problem, [&scaled(&uniform), &current], &terminals, sections);
    RegionCurrent {
        into_vertices: into_vertices(patch, &current),
        current_density: patch.elements.iter().copied().zip(current).collect(),
        terminals,
        terminal_names: None,
        report,
    }
}

/// `∫J·∇λ_a` for the vertices of every element.
fn into_vertices(patch: &Patch, current: &[Point]) -> Vec<[f64; 4]> {
    let of = |(tet, j): (&Tet4, &Point)| tet.gradients.map(|g| tet.volume * dot(*j, g));
    patch.tets.iter().zip(current).map(of).collect()
}

/// The triangles of the terminals that are faces of the region.
pub(super) fn terminal_faces(
    patch: &Patch,
    from: &Terminal,
    to: &Terminal,
) -> Result<Vec<TerminalFace>, RegionFault> {
    let mut faces = Vec::new();
    for (terminal, end) in [(from, End::From), (to, End::To)] {
        let mut nodes: Vec<[NodeId; 3]> = terminal
            .triangles
            .iter()
            .copied()
            .map(face_key)
            .filter(|key| patch.face(key).is_some_and(|face| face.outside.is_none()))
            .collect();
        nodes.sort_unstable();
        nodes.dedup();
        if nodes.is_empty() {
            return Err(RegionFault::TerminalElsewhere { terminal: terminal.name.clone() });
        }
        faces.extend(nodes.into_iter().map(|nodes| TerminalFace { nodes, end }));
    }
    Ok(faces)
}

/// φ on the terminals' nodes: 1 where current comes in, 0 where it goes out.
pub(super) fn terminal_values(
    patch: &Patch,
    faces: &[TerminalFace],
    [from, to]: [&Terminal; 2],
) -> Result<Vec<Option<f64>>, RegionFault> {
    let mut values: Vec<Option<f64>> = vec![None; patch.points.len()];
    let mut reached = vec![[false; 2]; patch.parts];
    for face in faces {
        for node in patch.face(&face.nodes).into_iter().flat_map(|face| patch.nodes_of(face)) {
            let value = match face.end {
                End::From => 1.0,
                End::To => 0.0,
            };
            if values[node.index()].replace(value).is_some_and(|before| before != value) {
                return Err(RegionFault::TerminalsTouch {
                    from: from.name.clone(),
                    to: to.name.clone(),
                    place: patch.points[node.index()],
                });
            }
            reached[patch.part_of[node.index()]][face.end as usize] = true;
        }
    }
    for (part, ends) in reached.iter().enumerate() {
        for (terminal, reached) in [from, to].into_iter().zip(ends) {
            if !reached {
                let node = patch.part_of.iter().position(|p| *p == part).unwrap_or(0);
                return Err(RegionFault::PartWithoutTerminal {
                    parts: patch.parts,
                    terminal: terminal.name.clone(),
                    place: patch.points[node],
                });
            }
        }
    }
    Ok(values)
}

/// `∇θ` of the nodal angles about the frame's axis, on every element [1/m].
fn angle_gradient(patch: &Patch, frame: &Frame) -> Result<Vec<Point>, RegionFault> {
    let gradient = |(angles, tet): ([f64; 4], &Tet4)| {
        std::array::from_fn(|d| (0..4).map(|a| angles[a] * tet.gradients[a][d]).sum())
    };
    Ok(angles(patch, frame)?.into_iter().zip(&patch.tets).map(gradient).collect())
}

/// The angles [rad] about the frame's axis of every element's vertices, from that of its first one.
pub(super) fn angles(patch: &Patch, frame: &Frame) -> Result<Vec<[f64; 4]>, RegionFault> {
    let extent = patch.points.iter().map(|x| norm(sub(*x, frame.centre()))).fold(0.0, f64::max);
    let local: Vec<Point> = patch.points.iter().map(|x| frame.local(*x)).collect();
    // A node on the axis has no angle.
    if let Some(i) = local.iter().position(|x| x[0].hypot(x[1]) <= 1e-12 * extent) {
        return Err(RegionFault::AxisInside { place: patch.points[i] });
    }
    let angles: Vec<f64> = local.iter().map(|x| x[1].atan2(x[0])).collect();
    // The difference of two angles that is less than half a turn.
    let turn = |from: f64, to: f64| {
        let d = to - from;
        if d > PI {
            d - TAU
        } else if d <= -PI {
            d + TAU
        } else {
            d
        }
    };
    patch
        .connectivity
        .iter()
        .map(|nodes| {
            let theta = nodes.map(|n| angles[n.index()]);
            let from_first = theta.map(|t| turn(theta[0], t));
            // Round a face that the axis pierces the differences add up to a whole turn.
            let consistent = (1..4).all(|a| {
                (1..a).all(|b| (turn(theta[b], theta[a]) - (from_first[a] - from_first[b])).abs() < 1.0)
            });
            if !consistent {
                return Err(RegionFault::AxisInside { place: patch.points[nodes[0].index()] });
            }
            Ok(from_first)
        })
        .collect()
}
