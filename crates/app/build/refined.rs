//! The mesh of a configuration after some refinements, with the design surface that goes with it.
//!
//! Marks are numbers of elements of the mesh with all regions, as it was when they were made. The same marks in the same order
//! make the same mesh to the last bit.

use fluxmorph_geometry::refine::{Bisection, RefineLimits};
use fluxmorph_geometry::{ElementId, Mesh, MeshError, NodeId};
use fluxmorph_optimizer::design::DesignSurface;

use super::{design, functional, memory_limit};
use crate::config::{Config, SourceMap};
use crate::error::Error;

/// A mesh that is refined step by step.
#[derive(Clone, Debug)]
pub(crate) struct RefinedMesh {
    /// On the mesh that the first step began with.
    surface: Option<DesignSurface>,
    coarse_nodes: usize,
    bisection: Bisection,
    mesh: Mesh,
    parents: Vec<[NodeId; 2]>,
}

impl RefinedMesh {
    /// The mesh of a configuration with all its regions, before any refinement.
    pub(crate) fn new(config: &Config, source: &SourceMap, full_mesh: &Mesh) -> Result<Self, Error> {
        // Cells of what is observed are those of the first mesh: their means stay what they are.
        let mesh = functional::with_cells_written_down(config, full_mesh)?;
        let surface = match &config.design {
            Some(own) => Some(design::surface(config, source, own, &mesh)?),
            None => None,
        };
        let limits = RefineLimits { most_tets: memory_limit::most_tets(), ..RefineLimits::default() };
        let bisection = Bisection::new(&mesh, limits);
        Ok(Self { surface, coarse_nodes: mesh.points().len(), bisection, mesh, parents: Vec::new() })
    }

    /// The mesh as it is now, with all its regions.
    pub(crate) fn mesh(&self) -> &Mesh {
        &self.mesh
    }

    /// Of every node that the first mesh does not have, the two in whose middle it lies; both have lower numbers.
    pub(crate) fn parents(&self) -> &[[NodeId; 2]] {
        &self.parents
    }

    /// Halves the edges of marked elements.
    ///
    /// # Errors
    /// [`MeshError::RefinementLimit`], and [`MeshError::Inverted`] where parts vanish in rounding; nothing changes then.
    pub(crate) fn halve(&mut self, marked: &[ElementId]) -> Result<(), MeshError> {
        let count = self.bisection.element_count();
        if marked.iter().any(|e| e.index() >= count) {
            return Err(MeshError::RefinementLimit { what: "elements to be marked", most: count });
        }
        let mut bisection = self.bisection.clone();
        bisection.halve(marked)?;
        let refinement = bisection.refinement()?;
        (self.mesh, self.parents) = (refinement.mesh().clone(), refinement.parents().to_vec());
        self.bisection = bisection;
        Ok(())
    }

    /// The design surface on the present mesh: that of the first mesh, with new nodes in the middle of its edges.
    pub(crate) fn surface(&self, config: &Config) -> Result<Option<DesignSurface>, MeshError> {
        let (Some(surface), Some(own)) = (&self.surface, &config.design) else { return Ok(None) };
        let triangles = design::triangles(own, &self.mesh)?;
        Ok(Some(surface.refined(&triangles, self.coarse_nodes, &self.parents)))
    }
}
