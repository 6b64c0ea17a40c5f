//! Which components are unknown where: `A_x, A_y, A_z` everywhere, `ψ` in conductors, less what the boundaries fix.
//!
//! * *flux-parallel* plane (B·n = 0): the tangential components of `A` are zero, and `ψ = 0` where the plane cuts a
//!   conductor, since the current crosses it at right angles;
//! * *flux-normal* plane (n × H = 0): the normal component of `A` is zero, `ψ` is free;
//! * `ψ` is defined up to a constant on every connected conductor: where no plane fixes it, one node is grounded.

use fluxmorph_geometry::fem::DofMap;
use fluxmorph_geometry::tet4::{area_vector, norm};
use fluxmorph_geometry::{ElementId, Mesh, NodeId};

use crate::error::SolverError;
use crate::model::Boundary;

/// Component index of `ψ`.
pub const PSI: usize = 3;

/// How far a unit normal may be from a coordinate axis: a generator's or file's rounding, not a slope.
const AXIS_TOLERANCE: f64 = 1e-6;

/// Equation numbers of the A–ψ system.
#[derive(Clone, Debug)]
pub struct Unknowns {
    /// Components `A_x, A_y, A_z, ψ`.
    pub dofs: DofMap<4>,
    /// One node per connected conductor whose ψ no boundary fixes.
    pub grounded: Vec<NodeId>,
}

impl Unknowns {
    /// Numbers the unknowns of a mesh with conducting elements `conductor` and conditions on named surfaces.
    ///
    /// # Errors
    /// [`SolverError::Mesh`] for an unknown surface, [`SolverError::BoundaryNormal`] for one that is not a plane at
    /// right angles to a coordinate axis.
    pub fn new(
        mesh: &Mesh,
        conductor: &[ElementId],
        boundaries: &[(String, Boundary)],
    ) -> Result<Self, SolverError> {
        let topology = mesh.topology();
        let node_count = topology.node_count();
        // Bit c: component c is fixed to zero.
        let mut fixed = vec![0u8; node_count];
        let mut psi_zero = vec![false; node_count];
        for (surface, boundary) in boundaries {
            for triangle in topology.surface(surface)? {
                let axis = normal_axis(mesh, *triangle, surface)?;
                for n in triangle {
                    match boundary {
                        Boundary::FluxParallel => {
                            fixed[n.index()] |= 0b111 & !(1 << axis);
                            psi_zero[n.index()] = true;
                        }
                        Boundary::FluxNormal => fixed[n.index()] |= 1 << axis,
                    }
                }
            }
        }
        let mut has_psi = vec![false; node_count];
        for &e in conductor {
            for n in topology.tet(e) {
                has_psi[n.index()] = true;
            }
        }
        let grounded = ground(mesh, conductor, &psi_zero);
        for n in &grounded {
            psi_zero[n.index()] = true;
        }
        let dofs = DofMap::new(node_count, |node, c| {
            let i = node.index();
            if c == PSI { has_psi[i] && !psi_zero[i] } else { fixed[i] >> c & 1 == 0 }
        });
        Ok(Self { dofs, grounded })
    }
}

/// The coordinate axis that a boundary triangle is at right angles to.
fn normal_axis(mesh: &Mesh, triangle: [NodeId; 3], surface: &str) -> Result<usize, SolverError> {
    let n = area_vector(triangle.map(|v| mesh.point(v)));
    let length = norm(n);
    let unit = n.map(|c| c / length);
    (0..3).find(|&d| 1.0 - unit[d].abs() < AXIS_TOLERANCE).ok_or_else(|| SolverError::BoundaryNormal {
        surface: surface.to_owned(),
        normal: unit,
        expected: "flux-parallel and flux-normal conditions take planes at right angles to x, y or z",
    })
}

/// The first node of every connected set of conducting elements in which no node is fixed already.
fn ground(mesh: &Mesh, conductor: &[ElementId], psi_zero: &[bool]) -> Vec<NodeId> {
    let topology = mesh.topology();
    let mut root: Vec<u32> = (0..topology.node_count() as u32).collect();
    fn find(root: &mut [u32], mut i: u32) -> u32 {
        while root[i as usize] != i {
            root[i as usize] = root[root[i as usize] as usize];
            i = root[i as usize];
        }
        i
    }
    for &e in conductor {
        let [first, others @ ..] = topology.tet(e);
        for other in others {
            let (a, b) = (find(&mut root, first.0), find(&mut root, other.0));
            // The smaller node stays root: the result does not depend on the order of elements.
            root[a.max(b) as usize] = a.min(b);
        }
    }
    let mut nodes: Vec<NodeId> = conductor.iter().flat_map(|&e| topology.tet(e)).collect();
    nodes.sort_unstable();
    nodes.dedup();
    let mut is_fixed = vec![false; topology.node_count()];
    for n in &nodes {
        if psi_zero[n.index()] {
            is_fixed[find(&mut root, n.0) as usize] = true;
        }
    }
    nodes.into_iter().filter(|n| find(&mut root, n.0) == n.0 && !is_fixed[n.index()]).collect()
}
