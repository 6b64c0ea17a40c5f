//! The right side of the system: coils, currents in regions of the mesh, magnets.
//!
//! Sources given by `T` with `J = curl T` enter as `∫T·curl w`, currents of mesh regions as `∫J·w`, magnets as `∫ν B_r·curl w`.
//! Coils are fixed in space, so elements that meet them must not move; a magnet moves with its elements, and its load
//! has a derivative with respect to the node positions.

use fluxmorph_geometry::fem::c64;
use fluxmorph_geometry::tet4::{Point, Tet4};
use fluxmorph_geometry::{ElementId, Mesh, RegionId};

use crate::coil::{self, Coil};
use crate::element::lagrange::Lagrange;
use crate::element::volume::NodalField;
use crate::element::{Complex3, point};
use crate::error::SolverError;
use crate::space::Space;
use crate::unknowns::Unknowns;

/// All sources of a model, per element.
#[derive(Clone, Debug, Default)]
pub(crate) struct Sources {
    /// `∫_e T λ_b dV` of all coils with their currents [A m²], ascending by element.
    moments: Vec<(ElementId, [Complex3; 4])>,
    /// `J` of coils that are regions of the mesh [A/m²], ascending by element.
    currents: Vec<(ElementId, Complex3)>,
    /// `ν B_r` [A/m] of every magnet's elements, ascending.
    magnets: Vec<(ElementId, Point)>,
}

impl Sources {
    /// Integrates the coils over the mesh; `magnetisation` is `ν B_r` [A/m] by region.
    ///
    /// # Errors
    /// [`SolverError::NoSource`] for a coil outside the mesh.
    pub(crate) fn new(mesh: &Mesh, coils: &[Coil], magnetisation: &[Point]) -> Result<Self, SolverError> {
        let mut moments = Vec::new();
        for coil in coils {
            let of_coil = coil::moments(&coil.shape, mesh);
            if of_coil.is_empty() {
                return Err(SolverError::NoSource {
                    cause: format!(
                        "the coil `{}` lies outside the mesh; check its centre and the mesh unit",
                        coil.name
                    ),
                });
            }
            moments
                .extend(of_coil.into_iter().map(|(e, m)| (e, m.map(|m| m.map(|m| coil.ampere_turns * m)))));
        }
        let topology = mesh.topology();
        let magnets = topology
            .elements()
            .map(|e| (e, topology.region_of()[e.index()]))
            .filter_map(|(e, RegionId(r))| Some((e, *magnetisation.get(r as usize)?)))
            .filter(|(_, source)| *source != [0.0; 3])
            .collect();
        let moments = merged(moments, |sum, more| {
            for (sum, more) in sum.iter_mut().flatten().zip(more.iter().flatten()) {
                *sum += more;
            }
        });
        Ok(Self { moments, currents: Vec::new(), magnets })
    }

    /// Elements that a coil meets, ascending in each list: these must not move.
    pub(crate) fn fixed_elements(&self) -> impl Iterator<Item = ElementId> + '_ {
        self.moments.iter().map(|m| m.0).chain(self.currents.iter().map(|c| c.0))
    }

    /// Whether nothing is excited.
    pub(crate) fn is_empty(&self) -> bool {
        self.moments.is_empty() && self.currents.is_empty() && self.magnets.is_empty()
    }

    /// The load [A m], added to `load`.
    pub(crate) fn add_load(&self, space: &Space, unknowns: &Unknowns, mesh: &Mesh, load: &mut [c64]) {
        let mut add = |e: ElementId, values: &[Complex3]| {
            for (&node, f) in space.nodes_of(e).iter().zip(values) {
                unknowns.scatter_add(load, node, [f[0], f[1], f[2], c64::default()]);
            }
        };
        let tet = |e: ElementId| Tet4::new(mesh.vertices(e));
        let linear = space.linear_tets().is_some();
        let mut add_curl = |e: ElementId, moments: &[Complex3; 4]| {
            if linear {
                add(e, &point::curl_load(Lagrange::<4, 4>::tet(), &tet(e), moments));
            } else {
                add(e, &point::curl_load(Lagrange::<10, 4>::tet(), &tet(e), moments));
            }
        };
        for (e, moments) in &self.moments {
            add_curl(*e, moments);
        }
        for (e, source) in &self.magnets {
            let share = 0.25 * tet(*e).volume;
            add_curl(*e, &[source.map(|t| c64::from(share * t)); 4]);
        }
        for (e, current) in &self.currents {
            if linear {
                add(*e, &point::current_load(Lagrange::<4, 4>::tet(), &tet(*e), current));
            } else {
                add(*e, &point::current_load(Lagrange::<10, 4>::tet(), &tet(*e), current));
            }
        }
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

/// Sorted by element, with the values of each element joined by `add`.
fn merged<T>(mut all: Vec<(ElementId, T)>, add: impl Fn(&mut T, T)) -> Vec<(ElementId, T)> {
    all.sort_by_key(|entry| entry.0);
    let mut merged: Vec<(ElementId, T)> = Vec::with_capacity(all.len());
    for (e, value) in all {
        match merged.last_mut() {
            Some((last, sum)) if *last == e => add(sum, value),
            _ => merged.push((e, value)),
        }
    }
    merged
}
