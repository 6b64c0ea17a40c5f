//! The topology of a finer mesh from that of the coarse one: regions, named surfaces and given cells.

use crate::error::MeshError;
use crate::ids::{ElementId, NodeId};
use crate::topology::Topology;

/// The topology of the finer elements `tets`, of which each lies in an ancestor; `split` appends the parts of a triangle.
///
/// # Errors
/// As [`Topology::new`].
pub(super) fn inherit(
    coarse: &Topology,
    node_count: usize,
    tets: Vec<[NodeId; 4]>,
    ancestors: &[ElementId],
    split: impl Fn([NodeId; 3], &mut Vec<[NodeId; 3]>),
) -> Result<Topology, MeshError> {
    let regions = ancestors.iter().map(|e| coarse.region_of()[e.index()]).collect();
    let mut fine = Topology::new(node_count, tets, coarse.region_names().to_vec(), regions)?;
    for name in coarse.surface_names() {
        let mut parts = Vec::new();
        for &triangle in coarse.surface(name)? {
            split(triangle, &mut parts);
        }
        fine = fine.with_surface(name, parts)?;
    }
    let given = |name: &String| Some((name.clone(), coarse.given_cells(name)?));
    let given: Vec<_> = coarse.region_names().iter().filter_map(given).collect();
    if given.is_empty() {
        return Ok(fine);
    }
    let children = children(coarse.tets().len(), ancestors);
    for (name, cells) in given {
        let of = |cell: &Vec<ElementId>| cell.iter().flat_map(|e| children[e.index()].clone()).collect();
        fine = fine.with_cells(&name, cells.iter().map(of).collect());
    }
    Ok(fine)
}

/// The elements within every ancestor, ascending.
fn children(count: usize, ancestors: &[ElementId]) -> Vec<Vec<ElementId>> {
    let mut children = vec![Vec::new(); count];
    for (e, ancestor) in ancestors.iter().enumerate() {
        children[ancestor.index()].push(ElementId::new(e));
    }
    children
}
