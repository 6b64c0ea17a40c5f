//! The right side of the system: coils, currents in regions of the mesh, magnets.
//!
//! Sources given by `T` with `J = curl T` enter as `∫T·curl w`, currents of mesh regions as `∫J·w`, magnets as `∫ν B_r·curl w`.
//! Coils are fixed in space, so elements that windings meet must not move; those in their windows may, and as a whole have the same
//! load then ([`crate::coil`]). A magnet moves with its elements, and its load has a derivative with respect to the node positions.

use fluxmorph_geometry::fem::c64;
use fluxmorph_geometry::tet4::Point;
use fluxmorph_geometry::{ElementId, Mesh, NodeId, Topology};
use rayon::prelude::*;

use crate::coil::{Coil, SourceTerms};
use crate::element::Complex3;
use crate::error::SolverError;
use crate::family::Local;
use crate::space::Space;
use crate::unknowns::Unknowns;

/// All sources of a model, per element.
#[derive(Clone, Debug)]
pub(crate) struct Sources {
    coils: SourceTerms,
    /// `ν B_r` [A/m] of every magnet's elements, ascending.
    magnets: Vec<(ElementId, Point)>,
}

impl Sources {
    /// Integrates the coils over the mesh; `magnetisation` is `ν B_r` [A/m] by region.
    ///
    /// # Errors
    /// As [`SourceTerms::new`].
    pub(crate) fn new(mesh: &Mesh, coils: &[Coil], magnetisation: &[Point]) -> Result<Self, SolverError> {
        let topology = mesh.topology();
        let magnets = topology
            .elements()
            .filter_map(|e| Some((e, *magnetisation.get(topology.region_of()[e.index()].index())?)))
            .filter(|(_, source)| *source != [0.0; 3])
            .collect();
        Ok(Self { coils: SourceTerms::new(mesh, coils)?, magnets })
    }

    /// Elements that a coil meets, with its window.
    pub(crate) fn coil_elements(&self) -> impl Iterator<Item = ElementId> + '_ {
        self.coils.elements().into_iter()
    }

    /// An element with a coil's source that must not move, and has a node that `moves`: one that a winding meets, or one in a
    /// window where not all elements around that node have the same `T`.
    pub(crate) fn torn_element(
        &self,
        topology: &Topology,
        moves: &dyn Fn(NodeId) -> bool,
    ) -> Option<ElementId> {
        let moved = |e: ElementId| topology.tet(e).into_iter().filter(|n| moves(*n));
        let tears = |e: ElementId, t: Complex3| {
            moved(e)
                .any(|n| topology.elements_around(n).iter().any(|&other| self.coils.window(other) != Some(t)))
        };
        let window = || self.coils.windows.iter().find(|(e, t)| tears(*e, *t)).map(|(e, _)| *e);
        self.coils.fixed_elements().find(|&e| moved(e).next().is_some()).or_else(window)
    }

    /// `fᵀu` of the load and the coefficients of a solution: of the load of 1 A, its flux linkage [Wb].
    pub(crate) fn linkage(&self, space: &Space, mesh: &Mesh, field: impl Fn(ElementId) -> Local) -> c64 {
        let mut sum = c64::default();
        self.each_load(space, mesh, |e, local| {
            let field = field(e);
            let terms = local.values().iter().flatten().zip(field.values().iter().flatten());
            sum += terms.map(|(f, u)| f * u).sum::<c64>();
        });
        sum
    }

    /// Whether nothing is excited.
    pub(crate) fn is_empty(&self) -> bool {
        self.coils == SourceTerms::default() && self.magnets.is_empty()
    }

    /// The load [A m; of edge elements A m²], added to `load`: element loads in parallel, then added in their order.
    pub(crate) fn add_load(&self, space: &Space, unknowns: &Unknowns, mesh: &Mesh, load: &mut [c64]) {
        self.each_load(space, mesh, |e, local| {
            for (&carrier, values) in space.carriers_of(e).iter().zip(local.values()) {
                unknowns.scatter_add(load, carrier, *values);
            }
        });
    }

    /// The load of every element with a source: computed in parallel, passed on in order.
    fn each_load(&self, space: &Space, mesh: &Mesh, mut pass: impl FnMut(ElementId, &Local)) {
        let elements = space.elements();
        let mut add = |(e, local): (ElementId, Local)| pass(e, &local);
        let of_coil = |(e, moments): &(ElementId, [Complex3; 4])| {
            (*e, elements.curl_load(&space.cell(mesh, *e), moments))
        };
        let of_constant = |e: ElementId, source: Complex3| {
            let cell = space.cell(mesh, e);
            let share = 0.25 * cell.tet.volume;
            (e, elements.curl_load(&cell, &[source.map(|t| share * t); 4]))
        };
        let of_window = |(e, potential): &(ElementId, Complex3)| of_constant(*e, *potential);
        let of_magnet = |(e, source): &(ElementId, Point)| of_constant(*e, source.map(c64::from));
        let of_region = |(e, current): &(ElementId, Complex3)| {
            (*e, elements.current_load(&space.cell(mesh, *e), current))
        };
        self.coils.moments.par_iter().map(of_coil).collect::<Vec<_>>().into_iter().for_each(&mut add);
        self.coils.windows.par_iter().map(of_window).collect::<Vec<_>>().into_iter().for_each(&mut add);
        self.magnets.par_iter().map(of_magnet).collect::<Vec<_>>().into_iter().for_each(&mut add);
        self.coils.currents.par_iter().map(of_region).collect::<Vec<_>>().into_iter().for_each(add);
    }

    /// `∂/∂x_k (λᵀ f)` of the magnets among `moving` (ascending), per element.
    pub(crate) fn shape_derivatives<'a>(
        &'a self,
        space: &'a Space,
        mesh: &'a Mesh,
        moving: &'a [ElementId],
        adjoint: impl Fn(ElementId) -> Local + 'a,
    ) -> impl Iterator<Item = (ElementId, [Complex3; 4])> + 'a {
        self.magnets.iter().filter(|(e, _)| moving.binary_search(e).is_ok()).map(move |&(e, source)| {
            let adjoint = adjoint(e);
            let cell = space.cell(mesh, e);
            (e, space.elements().magnet_shape_derivative(&cell, source, adjoint.values()))
        })
    }
}
