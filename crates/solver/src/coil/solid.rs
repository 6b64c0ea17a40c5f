//! A solid conductor of the mesh that is driven by its terminals: a busbar, or a turn of an inductor or of an induction coil.
//!
//! Its field is `E = −jω(A + ∇ψ) − V∇χ` with the voltage `V` and any fixed `χ` that is 1 on the terminal where current comes in
//! and 0 on the other; round a ring `χ` falls by 1 a turn. Here it is that of conduction at 0 Hz on the reference mesh,
//! `∫∇χ·∇q = 0`, so that what `ψ` is left with is small. On the mesh that moves it keeps its values at the nodes. Current at
//! 0 Hz: `J = −∇χ/g` for 1 A, with the resistance `1/(σg)`, `g = ∫|∇χ|²` [m]. Where the field is of second order, the resistance is so too.
//!
//! Separate parts between the same terminals are in series, each with its own `V`, or in parallel with one. What the circuit makes of
//! `V` is in [`crate::circuit`].

use std::f64::consts::TAU;
use std::sync::{Arc, OnceLock};

use fluxmorph_geometry::tet4::{Point, Tet4, dot};
use fluxmorph_geometry::{ElementId, Mesh, NodeId};

use super::conduction;
use super::divergence::Section;
use super::fault::RegionFault;
use super::patch::{Contact, Patch};
use super::potential::Potential;
use super::region::{self, NO_RING, Path, RegionCurrent};
use crate::elements::Order;
use crate::error::SolverError;

/// How separate parts between the same terminals are connected.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Connection {
    /// Each carries the whole current: the turns of a winding that a plane cuts.
    #[default]
    Series,
    /// They share it: the sheets of a busbar.
    Parallel,
}

/// What is found once and shared by clones; no part of what a conductor is.
#[derive(Clone, Debug, Default)]
struct Known(Arc<OnceLock<Vec<f64>>>);

impl PartialEq for Known {
    fn eq(&self, _: &Self) -> bool {
        true
    }
}

/// The way of the current through a conductor.
#[derive(Clone, Debug, PartialEq)]
pub struct SolidConductor {
    potential: Vec<(ElementId, [f64; 4])>,
    /// The segment of every element in the same order.
    segments: Vec<usize>,
    direct: RegionCurrent,
    /// `g` of every segment.
    conductances: Vec<f64>,
    /// The same to second order, once it was asked for.
    of_second_order: Known,
}

impl SolidConductor {
    /// The elements of a region as a conductor; `coil` names it in messages.
    ///
    /// # Errors
    /// As [`RegionCurrent::new`].
    pub fn new(
        mesh: &Mesh,
        coil: &str,
        elements: &[ElementId],
        (path, connection): (&Path, Connection),
    ) -> Result<Self, SolverError> {
        let refuse = |fault| SolverError::CoilRegion { coil: coil.to_owned(), fault };
        if elements.is_empty() {
            return Err(refuse(RegionFault::NoElements));
        }
        let patch = Patch::new(mesh, elements, Contact::Node);
        match path {
            Path::Terminals { from, to } => {
                let terminals = region::terminal_faces(&patch, from, to).map_err(refuse)?;
                let values = region::terminal_values(&patch, &terminals, [from, to]).map_err(refuse)?;
                let given: Vec<bool> = values.iter().map(Option::is_some).collect();
                let lift: Vec<f64> = values.iter().map(|v| v.unwrap_or(0.0)).collect();
                let problem = Potential::new(&patch, &given)?;
                let chi = problem.solve(&vec![[0.0; 3]; patch.elements.len()], &lift);
                let vertices = patch.connectivity.iter().map(|nodes| nodes.map(|n| chi[n.index()]));
                let names = Some([from.name.clone(), to.name.clone()]);
                let sections = Section::LevelsOf(&chi);
                let chi = vertices.collect();
                Ok(Self::of((&patch, &problem), (chi, connection), (terminals, names), sections))
            }
            Path::Closed(frame) => {
                if patch.parts != 1 {
                    return Err(refuse(RegionFault::SeveralRings { parts: patch.parts }));
                }
                let turns: Vec<[f64; 4]> = region::angles(&patch, frame)
                    .map_err(refuse)?
                    .iter()
                    .map(|a| a.map(|t| t / TAU))
                    .collect();
                let turning = gradients(&patch, &turns);
                let mut given = vec![false; patch.points.len()];
                given[0] = true;
                let problem = Potential::new(&patch, &given)?;
                let rest = problem.solve(&turning, &vec![0.0; given.len()]);
                let of = |(nodes, turns): (&[NodeId; 4], &[f64; 4])| {
                    std::array::from_fn(|a| rest[nodes[a].index()] - turns[a])
                };
                let chi: Vec<[f64; 4]> = patch.connectivity.iter().zip(&turns).map(of).collect();
                if patch.norm(&gradients(&patch, &chi)) < NO_RING * patch.norm(&turning) {
                    return Err(refuse(RegionFault::NoRing));
                }
                let ends = (Vec::new(), None);
                Ok(Self::of((&patch, &problem), (chi, connection), ends, Section::HalfPlanesOf(frame)))
            }
        }
    }

    fn of(
        (patch, problem): (&Patch, &Potential<'_>),
        (chi, connection): (Vec<[f64; 4]>, Connection),
        terminals: (Vec<region::TerminalFace>, Option<[String; 2]>),
        sections: Section<'_>,
    ) -> Self {
        let gradient = gradients(patch, &chi);
        let segment = |e: usize| if connection == Connection::Series { patch.part_of_element(e) } else { 0 };
        let segments: Vec<usize> = (0..patch.elements.len()).map(segment).collect();
        let mut conductances = vec![0.0; segments.iter().max().map_or(0, |last| last + 1)];
        for ((tet, g), segment) in patch.tets.iter().zip(&gradient).zip(&segments) {
            conductances[*segment] += tet.volume * dot(*g, *g);
        }
        let scaled = |(g, segment): (Point, &usize)| g.map(|c| -c / conductances[*segment]);
        let current = gradient.into_iter().zip(&segments).map(scaled).collect();
        let direct = RegionCurrent::of_conduction((patch, problem), current, terminals, sections);
        let potential = patch.elements.iter().copied().zip(chi).collect();
        Self { potential, segments, direct, conductances, of_second_order: Known::default() }
    }

    /// The number of every element's segment, in the order of [`SolidConductor::potential`]: segments are in series, each with a
    /// voltage of its own.
    pub fn segments(&self) -> &[usize] {
        &self.segments
    }

    /// How many segments there are.
    pub fn segment_count(&self) -> usize {
        self.conductances.len()
    }

    /// `χ` [1] at the vertices of every element, in the mesh's order, ascending by element; round a ring up to a constant of each
    /// element's own.
    pub fn potential(&self) -> &[(ElementId, [f64; 4])] {
        &self.potential
    }

    /// The current at 0 Hz, for 1 A.
    pub fn direct_current(&self) -> &RegionCurrent {
        &self.direct
    }

    /// Resistance at 0 Hz [Ω] on the reference mesh, for a conductivity [S/m] and a potential of this order.
    ///
    /// # Errors
    /// [`SolverError::Mesh`] where the solve of second order fails.
    pub fn direct_resistance(
        &self,
        mesh: &Mesh,
        order: Order,
        conductivity: f64,
    ) -> Result<f64, SolverError> {
        let conductances = match order {
            Order::Linear => &self.conductances,
            Order::Quadratic => self.second_order(mesh)?,
        };
        Ok(conductances.iter().map(|g| 1.0 / (conductivity * g)).sum())
    }

    /// `g` of every segment to second order.
    fn second_order(&self, mesh: &Mesh) -> Result<&Vec<f64>, SolverError> {
        if let Some(known) = self.of_second_order.0.get() {
            return Ok(known);
        }
        let taken = conduction::decrease(mesh, &self.potential, &self.segments, self.direct.terminals())?;
        let of = |(g, taken): (&f64, f64)| g - taken;
        let conductances = self.conductances.iter().zip(taken).map(of).collect();
        Ok(self.of_second_order.0.get_or_init(|| conductances))
    }
}

/// The gradients of linear functions by their values at the vertices of every element.
fn gradients(patch: &Patch, values: &[[f64; 4]]) -> Vec<Point> {
    let of = |(tet, values): (&Tet4, &[f64; 4])| {
        std::array::from_fn(|d| (0..4).map(|a| values[a] * tet.gradients[a][d]).sum())
    };
    patch.tets.iter().zip(values).map(of).collect()
}
