//! What a report draws: the mesh of a configuration with its design surface and its audits, without a field problem.
//!
//! No matrix is made and no elastic body factored, so that a large mesh costs no more than being read or generated.

use std::collections::BTreeSet;

use fluxmorph_geometry::topology::Facet;
use fluxmorph_geometry::{ElementId, Mesh, NodeId, RegionId};
use fluxmorph_optimizer::design::DesignSurface;
use fluxmorph_optimizer::geometric::WallThickness;
use fluxmorph_remesh::{KinematicConstraint, MotionLaw};

use super::RefinedMesh;
use super::curves::Curves;
use super::elastic_body::{regions_at, remesh_setup};
use super::entries::is_air;
use super::names::name_faults;
use super::shape::thickened_regions;
use super::skin::{Audited, audits};
use super::{design, field};
use crate::config::{Config, SourceMap};
use crate::error::Error;

/// Mesh, design surface and audits of a configuration.
#[derive(Debug)]
pub struct Outline {
    /// The undeformed mesh with all its regions.
    pub full_mesh: Mesh,
    /// The undeformed mesh that is solved on: without the regions that impedance surfaces replace.
    pub mesh: Mesh,
    /// For every node of `full_mesh` the same node of `mesh`; `None` inside a region that is replaced.
    pub node_of: Vec<Option<NodeId>>,
    /// Skin-depth audit of every conductor at every frequency.
    pub audits: Vec<Audited>,
    /// What moves; `None` without a design.
    pub design: Option<OutlinedDesign>,
}

/// The design surface and what it belongs to.
#[derive(Debug)]
pub struct OutlinedDesign {
    /// The surface, on nodes of `full_mesh`.
    pub surface: DesignSurface,
    /// Its triangles, each once, on nodes of `full_mesh`.
    pub triangles: Vec<[NodeId; 3]>,
    /// The regions that a positive design thickens; else those with an entry of their own at the surface; else none.
    pub bodies: Vec<RegionId>,
    /// These, and the regions of matter ahead of the surface: whose boundaries are the shape.
    pub shown: Vec<RegionId>,
    /// Thickness of the designed bodies, where they have one.
    pub thickness: Option<WallThickness>,
    /// Elements of `mesh` that may move, ascending.
    pub moving: Vec<ElementId>,
}

/// Refines the mesh of a configuration as a run has done, and finds its design surface.
///
/// # Errors
/// Faults of names and of the mesh, as [`super::set_up`]; [`MeshError::RefinementLimit`] where the memory does not suffice, and
/// for marks that are none of the mesh's elements.
pub fn outline(
    (config, source): (&Config, &SourceMap),
    mut full_mesh: Mesh,
    marks: &[Vec<ElementId>],
) -> Result<Outline, Error> {
    source.check(name_faults(config, source, full_mesh.topology()))?;
    let mut carried = None;
    if !marks.is_empty() {
        let mut refined = RefinedMesh::new(config, source, &full_mesh)?;
        for marked in marks {
            refined.halve(marked)?;
        }
        carried = refined.surface(config)?;
        full_mesh = refined.mesh().clone();
    }
    let (mesh, _) = field::without_replaced_regions(config, &full_mesh)?;
    let node_of = full_mesh.nodes_in(&mesh);
    let design = match &config.design {
        Some(_) => Some(outline_design((config, source), carried, &full_mesh, &mesh, &node_of)?),
        None => None,
    };
    // Iron of which the table is gone has no audit.
    let audits = audits(config, &full_mesh, &Curves::read(config, source).unwrap_or_default());
    Ok(Outline { full_mesh, mesh, node_of, audits, design })
}

fn outline_design(
    (config, source): (&Config, &SourceMap),
    carried: Option<DesignSurface>,
    full_mesh: &Mesh,
    mesh: &Mesh,
    node_of: &[Option<NodeId>],
) -> Result<OutlinedDesign, Error> {
    let design = config.design.as_ref().expect("asked for with a design");
    let surface = match carried {
        Some(surface) => surface,
        None => design::surface(config, source, design, full_mesh)?,
    };
    let triangles = design::triangles(design, full_mesh)?;
    let topology = full_mesh.topology();
    let mut bodies = thickened_regions(full_mesh, &surface, config);
    let thickness = WallThickness::measure(full_mesh, &bodies, &surface).ok();
    let has_entry = |region: &RegionId| config.regions.contains_key(&topology.region_names()[region.index()]);
    if bodies.is_empty() {
        bodies = regions_at(full_mesh, surface.nodes()).into_iter().filter(has_entry).collect();
    }
    let is_designed = |facet: &&Facet| surface.has_all(&facet.nodes);
    let beside = topology.facets().iter().filter(is_designed);
    let beside = beside.flat_map(|facet| [Some(facet.inside), facet.outside]).flatten();
    let beside: BTreeSet<RegionId> = beside.map(|e| topology.region_of()[e.index()]).collect();
    let is_matter = |r: &RegionId| has_entry(r) && !is_air(config, &topology.region_names()[r.index()]);
    let shown = beside.into_iter().filter(is_matter).chain(bodies.iter().copied());
    let shown = shown.collect::<BTreeSet<_>>().into_iter().collect();
    let moving = match &config.remesh {
        Some(remesh) => {
            let nodes: Vec<NodeId> =
                surface.nodes().iter().filter_map(|node| node_of[node.index()]).collect();
            let body = remesh_setup(
                source,
                remesh,
                mesh,
                &nodes,
                (MotionLaw::Linear, KinematicConstraint::Free),
                &mut Vec::new(),
            )?;
            let elements = body.subregions.iter().flat_map(|part| part.elements.iter().copied());
            elements.collect::<BTreeSet<_>>().into_iter().collect()
        }
        None => Vec::new(),
    };
    Ok(OutlinedDesign { surface, triangles, bodies, shown, thickness, moving })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::build::{Mode, build_mesh, set_up};

    fn shield(name: &str) -> (Config, SourceMap) {
        let path = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("configs").join(name);
        Config::from_file(&path, &["mesh.shield.refinement=0.5".to_owned()]).expect("a shipped configuration")
    }

    #[test]
    fn the_outline_is_that_of_the_problem() {
        for name in ["shield.toml", "shield_impedance.toml"] {
            let (config, source) = shield(name);
            let mesh = build_mesh(&config, &source).expect("a mesh");
            let outline = outline((&config, &source), mesh, &[]).expect("an outline");
            let setup = set_up(&config, &source, Mode::Optimisation).expect("a problem");
            assert_eq!(outline.mesh.points(), setup.problem.original().points());
            let shape = setup.problem.shape().expect("a shape");
            let design = outline.design.as_ref().expect("a design");
            let kept: Vec<NodeId> =
                design.surface.nodes().iter().filter_map(|n| outline.node_of[n.index()]).collect();
            assert_eq!(kept, shape.surface().nodes());
            assert_eq!(design.moving, setup.problem.moving_elements());
            let plate = outline.full_mesh.topology().region("plate").expect("a plate");
            assert_eq!(design.bodies, [plate]);
            let thickness = design.thickness.as_ref().expect("a plate has one");
            let (low, high) = thickness.range(&outline.full_mesh);
            assert!((low - 0.01).abs() < 1e-12 && (high - 0.01).abs() < 1e-12, "{low} {high}");
        }
    }
}
