//! The right side of the system: coils, currents in regions of the mesh, magnets.
//!
//! Sources given by `T` with `J = curl T` enter as `∫T·curl w`, currents of mesh regions as `∫J·w`, magnets as `∫ν B_r·curl w`.
//! Coils are fixed in space, so elements that meet them must not move; a magnet moves with its elements, and its load
//! has a derivative with respect to the node positions.

use fluxmorph_geometry::fem::c64;
use fluxmorph_geometry::tet4::{Point, Tet4};
use fluxmorph_geometry::{ElementId, Mesh};
use rayon::prelude::*;

use crate::coil::{Coil, SourceTerms};
use crate::element::lagrange::Lagrange;
use crate::element::volume::NodalField;
use crate::element::{Complex3, point};
use crate::error::SolverError;
use crate::space::{Order, Space};
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

    /// Elements that a coil meets: these must not move.
    pub(crate) fn fixed_elements(&self) -> impl Iterator<Item = ElementId> + '_ {
        self.coils.elements().into_iter()
    }

    /// Whether nothing is excited.
    pub(crate) fn is_empty(&self) -> bool {
        self.coils.moments.is_empty() && self.coils.currents.is_empty() && self.magnets.is_empty()
    }

    /// The load [A m], added to `load`.
    pub(crate) fn add_load(&self, space: &Space, unknowns: &Unknowns, mesh: &Mesh, load: &mut [c64]) {
        match space.order() {
            Order::Linear => self.add_load_of_order(Lagrange::<4, 4>::tet(), space, unknowns, mesh, load),
            Order::Quadratic => self.add_load_of_order(Lagrange::<10, 4>::tet(), space, unknowns, mesh, load),
        }
    }

    /// [`Self::add_load`] on elements with `N` nodes: element loads in parallel, then added in their order.
    fn add_load_of_order<const N: usize>(
        &self,
        shape: &'static Lagrange<N, 4>,
        space: &Space,
        unknowns: &Unknowns,
        mesh: &Mesh,
        load: &mut [c64],
    ) {
        let mut add = |(e, values): (ElementId, [Complex3; N])| {
            for (&node, f) in space.nodes_of(e).iter().zip(values) {
                unknowns.scatter_add(load, node, [f[0], f[1], f[2], c64::default()]);
            }
        };
        let tet = |e: ElementId| Tet4::new(mesh.vertices(e));
        let of_coil =
            |(e, moments): &(ElementId, [Complex3; 4])| (*e, point::curl_load(shape, &tet(*e), moments));
        let of_magnet = |(e, source): &(ElementId, Point)| {
            let tet = tet(*e);
            let share = 0.25 * tet.volume;
            (*e, point::curl_load(shape, &tet, &[source.map(|t| c64::from(share * t)); 4]))
        };
        let of_region =
            |(e, current): &(ElementId, Complex3)| (*e, point::current_load(shape, &tet(*e), current));
        self.coils.moments.par_iter().map(of_coil).collect::<Vec<_>>().into_iter().for_each(&mut add);
        self.magnets.par_iter().map(of_magnet).collect::<Vec<_>>().into_iter().for_each(&mut add);
        self.coils.currents.par_iter().map(of_region).collect::<Vec<_>>().into_iter().for_each(add);
    }

    /// `∂/∂x_k (λᵀ f)` of the magnets among `moving` (ascending), per element.
    pub(crate) fn shape_derivatives<'a, const N: usize>(
        &'a self,
        shape: &'static Lagrange<N, 4>,
        mesh: &'a Mesh,
        moving: &'a [ElementId],
        adjoint: impl Fn(ElementId) -> NodalField<N> + 'a,
    ) -> impl Iterator<Item = (ElementId, [Complex3; 4])> + 'a {
        self.magnets.iter().filter(|(e, _)| moving.binary_search(e).is_ok()).map(move |&(e, source)| {
            let tet = Tet4::new(mesh.vertices(e));
            (e, point::magnet_shape_derivative(shape, &tet, source, &adjoint(e)))
        })
    }
}
