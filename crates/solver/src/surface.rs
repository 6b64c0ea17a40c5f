//! The terms of the weak form on triangles: jumps of the reluctivity, impedance surfaces and perfect conductors.

use std::collections::HashSet;

use fluxmorph_geometry::directions::axis_of;
use fluxmorph_geometry::fem::{LocalMatrix, c64};
use fluxmorph_geometry::tet4::{Point, area_vector, norm};
use fluxmorph_geometry::topology::face_key;
use fluxmorph_geometry::{ElementId, Mesh, NodeId};

use crate::boundary::Boundary;
use crate::element::impedance::{self, ImpedanceTriangle};
use crate::element::interface::InterfaceTriangle;
use crate::element::lagrange::Lagrange;
use crate::element::volume::Coefficients;
use crate::elements::{ElementFamily, Order};
use crate::error::SolverError;
use crate::material::{Material, VACUUM_PERMEABILITY};
use crate::reentrant::beside_reentrant_edges;

/// A conductor that is not meshed but replaced by its surface.
#[derive(Clone, Debug, PartialEq)]
pub struct Conductor {
    /// Name of the region it stood for.
    pub name: String,
    /// Its surface, oriented out of the surrounding mesh.
    pub surface: Vec<[NodeId; 3]>,
    /// What the surface says of the field.
    pub law: SurfaceLaw,
}

/// What the surface of a conductor says of the field outside.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum SurfaceLaw {
    /// The surface impedance of a material, many skin depths thick.
    Impedance(Material),
    /// `E_t = 0` and `B·n = 0`: the limit of no impedance, in statics as well.
    Perfect,
}

/// Perfect conductors under nodal elements: their coefficient over `1/(μ0 h)`, `h` the size of the surface's triangles. As
/// much flux as under a depth of `h` over this number gets in. More of it keeps linear elements from following the field,
/// whose normal component cannot be zero on every triangle (far field in a prism, `h` a tenth of the block: 0.9 % at 10,
/// 2.7 % at 100), and costs quadratic ones residual (0.05 % at 100, no solution at 10 000).
fn perfection(order: Order) -> f64 {
    match order {
        Order::Linear => 10.0,
        Order::Quadratic => 100.0,
    }
}

/// A term of the weak form on one triangle.
#[derive(Clone, Copy, Debug)]
pub(crate) enum SurfaceTerm {
    /// Jump of the reluctivity `ν_inside − ν_outside` [m/H].
    Interface(f64),
    /// `jω/Zs` [1/H] of the conductor with this index.
    Impedance(c64, usize),
    /// The large coefficient [1/H] that makes `A_t + ∇_tψ` zero under nodal elements, on perfect conductors and on walls.
    Perfect(f64),
}

/// The matrix of one surface term.
pub(crate) enum SurfaceMatrix<const N: usize> {
    Interface(InterfaceTriangle<N>),
    Impedance(ImpedanceTriangle<N>),
}

impl<const N: usize> SurfaceMatrix<N> {
    /// The matrix of a nodal triangle.
    #[inline]
    pub(crate) fn new(shape: &'static Lagrange<N, 3>, vertices: [Point; 3], term: SurfaceTerm) -> Self {
        match term {
            SurfaceTerm::Interface(jump) => Self::Interface(InterfaceTriangle::new(shape, vertices, jump)),
            SurfaceTerm::Impedance(coefficient, _) => {
                Self::Impedance(ImpedanceTriangle::new(shape, vertices, coefficient))
            }
            SurfaceTerm::Perfect(coefficient) => {
                Self::Impedance(ImpedanceTriangle::new(shape, vertices, coefficient.into()))
            }
        }
    }
}

impl<const N: usize> LocalMatrix<c64, N, 4> for SurfaceMatrix<N> {
    #[inline]
    fn block(&self, a: usize, b: usize) -> [[c64; 4]; 4] {
        match self {
            Self::Interface(triangle) => triangle.block(a, b),
            Self::Impedance(triangle) => triangle.block(a, b),
        }
    }
}

/// Triangles with a term, and the term of each.
#[derive(Clone, Debug, Default)]
pub(crate) struct Surfaces {
    pub(crate) triangles: Vec<[NodeId; 3]>,
    pub(crate) terms: Vec<SurfaceTerm>,
    /// Whether ψ is unknown on it.
    pub(crate) has_psi: Vec<bool>,
    /// Perfect conductors under edge elements: no term, for all that is tangential is known there.
    pub(crate) known: Vec<[NodeId; 3]>,
}

impl Surfaces {
    /// Of nodal elements the triangles at which ν jumps, natural and curved outer faces, and flux-parallel walls beside
    /// re-entrant edges; of all, the conductors' surfaces.
    ///
    /// `coefficients` by region. Nodes are in ascending order for edge elements.
    ///
    /// # Errors
    /// [`SolverError::Mesh`] for an unknown surface, [`SolverError::Parameter`] for an impedance surface without skin
    /// depth.
    pub(crate) fn new(
        mesh: &Mesh,
        (family, order): (ElementFamily, Order),
        coefficients: &[Coefficients],
        boundaries: &[(String, Boundary)],
        conductors: &[Conductor],
        angular_frequency: f64,
    ) -> Result<Self, SolverError> {
        let mut surfaces = Self::default();
        let mut beside = HashSet::new();
        if family == ElementFamily::Nodal {
            let parallel = faces_with(mesh, boundaries, |b| *b == Boundary::FluxParallel)?;
            let replaced = conductors.iter().flat_map(|conductor| &conductor.surface);
            let replaced: HashSet<_> = replaced.map(|&triangle| face_key(triangle)).collect();
            let applied = faces_with(mesh, boundaries, |b| matches!(b, Boundary::UniformField(_)))?;
            let listed = parallel.union(&replaced).copied().collect();
            let found = beside_reentrant_edges(mesh, &listed, &applied);
            beside.extend(found.iter().map(|&triangle| face_key(triangle)));
            let walls: Vec<_> = found.into_iter().filter(|&t| !replaced.contains(&face_key(t))).collect();
            surfaces = Self::interfaces(mesh, coefficients, boundaries, &walls)?;
            let term = SurfaceTerm::Perfect(perfect(mesh, order, &walls));
            walls.into_iter().for_each(|wall| surfaces.push(wall, term, true));
        }
        for (index, conductor) in conductors.iter().enumerate() {
            let term = match conductor.law {
                SurfaceLaw::Impedance(material) => {
                    SurfaceTerm::Impedance(coefficient(conductor, &material, angular_frequency)?, index)
                }
                SurfaceLaw::Perfect => SurfaceTerm::Perfect(perfect(mesh, order, &conductor.surface)),
            };
            for &triangle in &conductor.surface {
                let key = face_key(triangle);
                match (family, conductor.law) {
                    (ElementFamily::Nodal, _) => surfaces.push(triangle, term, beside.contains(&key)),
                    (ElementFamily::Edge, SurfaceLaw::Impedance(_)) => surfaces.push(key, term, true),
                    (ElementFamily::Edge, SurfaceLaw::Perfect) => surfaces.known.push(key),
                }
            }
        }
        Ok(surfaces)
    }

    /// Triangles at which ν jumps, natural and curved outer faces.
    fn interfaces(
        mesh: &Mesh,
        coefficients: &[Coefficients],
        boundaries: &[(String, Boundary)],
        walls: &[[NodeId; 3]],
    ) -> Result<Self, SolverError> {
        let topology = mesh.topology();
        let mut needless = faces_without_term(mesh, boundaries)?;
        for triangle in walls {
            needless.remove(&face_key(*triangle));
        }
        let reluctivity = |e: ElementId| coefficients[topology.region_of()[e.index()].index()].reluctivity;
        let mut surfaces = Self::default();
        for facet in topology.facets() {
            let outside = facet.outside.map_or(0.0, reluctivity);
            let jump = reluctivity(facet.inside) - outside;
            if jump != 0.0 && !(facet.outside.is_none() && needless.contains(&face_key(facet.nodes))) {
                surfaces.push(facet.nodes, SurfaceTerm::Interface(jump), false);
            }
        }
        Ok(surfaces)
    }

    fn push(&mut self, triangle: [NodeId; 3], term: SurfaceTerm, has_psi: bool) {
        self.triangles.push(triangle);
        self.terms.push(term);
        self.has_psi.push(has_psi);
    }

    /// Every triangle with its term.
    pub(crate) fn iter(&self) -> impl Iterator<Item = ([NodeId; 3], SurfaceTerm)> + '_ {
        self.triangles.iter().copied().zip(self.terms.iter().copied())
    }
}

/// Triangles of the surfaces with some condition, by their ascending nodes.
fn faces_with(
    mesh: &Mesh,
    boundaries: &[(String, Boundary)],
    is_meant: impl Fn(&Boundary) -> bool,
) -> Result<HashSet<[NodeId; 3]>, SolverError> {
    let mut faces = HashSet::new();
    for (name, _) in boundaries.iter().filter(|(_, boundary)| is_meant(boundary)) {
        faces.extend(mesh.topology().surface(name)?.iter().map(|&triangle| face_key(triangle)));
    }
    Ok(faces)
}

/// `jω/Zs` [1/H] of a conductor.
fn coefficient(
    conductor: &Conductor,
    material: &Material,
    angular_frequency: f64,
) -> Result<c64, SolverError> {
    let skin_depth = material.skin_depth(angular_frequency).ok_or_else(|| {
        let expected =
            "an impedance surface needs a conductivity and a frequency above zero; use model = \"volume\"";
        SolverError::parameter(format!("model of `{}`", conductor.name), "impedance", expected)
    })?;
    Ok(impedance::surface_coefficient(angular_frequency, material.conductivity, skin_depth))
}

/// The coefficient [1/H] of a perfect conductor's surface, from its triangles on the reference mesh.
fn perfect(mesh: &Mesh, order: Order, surface: &[[NodeId; 3]]) -> f64 {
    let area: f64 = surface.iter().map(|triangle| norm(area_vector(triangle.map(|n| mesh.point(n))))).sum();
    let size = (2.0 * area / surface.len().max(1) as f64).sqrt();
    perfection(order) / (VACUUM_PERMEABILITY * size)
}

/// Faces of planes along the axes whose condition is zero: the term couples components there that the condition fixes to
/// zero, and need not be stored. On a curved surface the components in the nodes' frames are not those of one face.
fn faces_without_term(
    mesh: &Mesh,
    boundaries: &[(String, Boundary)],
) -> Result<HashSet<[NodeId; 3]>, SolverError> {
    let mut faces = HashSet::new();
    let mut needed = HashSet::new();
    for (name, boundary) in boundaries {
        for triangle in mesh.topology().surface(name)? {
            let area = area_vector(triangle.map(|n| mesh.point(n)));
            let plane = axis_of(area.map(|c| c / norm(area))).is_some();
            let applied = matches!(boundary, Boundary::UniformField(_));
            (if plane && !applied { &mut faces } else { &mut needed }).insert(face_key(*triangle));
        }
    }
    // A face that two surfaces name keeps its term where one of them needs it.
    faces.retain(|face| !needed.contains(face));
    Ok(faces)
}
