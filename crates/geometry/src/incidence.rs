//! Which elements touch each node, in compressed rows.

use crate::ids::{ElementId, NodeId};

/// Elements around each node, ascending.
#[derive(Clone, Debug)]
pub struct Incidence {
    offsets: Vec<u32>,
    elements: Vec<ElementId>,
}

impl Incidence {
    /// The incidence of elements given by their nodes.
    ///
    /// # Panics
    /// If a node is not below `node_count`.
    pub fn new<const N: usize>(node_count: usize, elements: &[[NodeId; N]]) -> Self {
        let mut offsets = vec![0u32; node_count + 1];
        for n in elements.iter().flatten() {
            offsets[n.index() + 1] += 1;
        }
        for i in 0..node_count {
            offsets[i + 1] += offsets[i];
        }
        let mut cursor = offsets.clone();
        let mut around = vec![ElementId(0); elements.len() * N];
        for (e, nodes) in elements.iter().enumerate() {
            for n in nodes {
                let slot = &mut cursor[n.index()];
                around[*slot as usize] = ElementId::new(e);
                *slot += 1;
            }
        }
        Self { offsets, elements: around }
    }

    /// Elements that touch `node`, ascending.
    #[inline]
    pub fn around(&self, node: NodeId) -> &[ElementId] {
        let i = node.index();
        &self.elements[self.offsets[i] as usize..self.offsets[i + 1] as usize]
    }
}
