//! The mesh of a configuration with its cells divided where the device is.

use fluxmorph_geometry::Mesh;
use fluxmorph_geometry::generate::{
    BoxesParameters, Division, ShieldParameters, SphereParameters, boxes, shield, sphere,
};
use fluxmorph_geometry::tet4::Point;
use fluxmorph_optimizer::problem::Problem;

use super::mesh::named_interfaces;
use super::open;
use super::references::functionals;
use crate::config::{Config, MeshConfig, SourceMap};
use crate::error::Error;

/// Parameters of a generated mesh whose cells are divided.
#[derive(Clone, Debug)]
pub(crate) enum DividedMesh {
    Shield(ShieldParameters),
    Boxes(BoxesParameters),
    /// Refined as a whole, with the growth of its far cells kept.
    Sphere(SphereParameters),
}

impl DividedMesh {
    /// With every cell that moves or is observed in so many parts along each axis; `None` for a mesh from a file, for one
    /// of the generator `block`, and where nothing moves.
    pub(crate) fn of(config: &Config, problem: &Problem, parts: usize) -> Option<Self> {
        let division = Some(Division { inside: device(config, problem)?, parts });
        match &config.mesh {
            MeshConfig::Shield(mesh) => {
                Some(Self::Shield(ShieldParameters { division, ..mesh.parameters() }))
            }
            MeshConfig::Boxes(mesh) => Some(Self::Boxes(BoxesParameters { division, ..mesh.parameters() })),
            MeshConfig::Sphere(mesh) => {
                let own = mesh.parameters();
                let refinement = own.refinement * parts as f64;
                Some(Self::Sphere(SphereParameters {
                    refinement,
                    growth: own.growth.powf(parts as f64),
                    ..own
                }))
            }
            MeshConfig::Block(_) | MeshConfig::File { .. } => None,
        }
    }

    /// Its tetrahedra; `None` where the generator refuses the parameters.
    pub(crate) fn tet_count(&self) -> Option<usize> {
        match self {
            Self::Shield(parameters) => parameters.tet_count(),
            Self::Boxes(parameters) => parameters.tet_count(),
            Self::Sphere(parameters) => parameters.tet_count(),
        }
        .ok()
    }

    /// The mesh, with the interfaces that the configuration names and its shell of open space.
    pub(crate) fn build(&self, config: &Config, source: &SourceMap) -> Result<Mesh, Error> {
        let mesh = match self {
            Self::Shield(parameters) => shield(parameters),
            Self::Boxes(parameters) => boxes(parameters),
            Self::Sphere(parameters) => sphere(parameters),
        }?;
        open::with_shell(named_interfaces(mesh, config)?, config, source)
    }
}

/// The box around everything that moves and everything that objective and constraints take of the field.
fn device(config: &Config, problem: &Problem) -> Option<[Point; 2]> {
    let topology = problem.original().topology();
    let mut elements = problem.moving_elements().to_vec();
    let measured = functionals(config).into_iter().filter(|(_, own)| own.kind.is_of_field());
    for region in measured.filter_map(|(_, own)| own.region.as_deref()) {
        elements.extend(topology.region(region).map(|id| topology.elements_of(id)).unwrap_or_default());
    }
    let corners = elements.iter().flat_map(|&e| problem.original().vertices(e));
    corners.fold(None, |around, x| {
        let [low, high] = around.unwrap_or([x, x]);
        Some([[0, 1, 2].map(|d| low[d].min(x[d])), [0, 1, 2].map(|d| high[d].max(x[d]))])
    })
}
