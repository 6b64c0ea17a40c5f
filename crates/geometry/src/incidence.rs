//! Which elements touch each node, or other carrier of unknowns, in compressed rows. Whatever has several carriers may stand for an
//! element: an edge with two ends, a triangle with three edges.

use crate::ids::{CarrierId, ElementId};

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
    pub fn new<const N: usize, I>(node_count: usize, elements: &[[I; N]]) -> Self
    where
        I: Copy + Into<CarrierId>,
    {
        let place = |&id: &I| -> usize { id.into().index() };
        let mut offsets = vec![0u32; node_count + 1];
        for n in elements.iter().flatten() {
            offsets[place(n) + 1] += 1;
        }
        for i in 0..node_count {
            offsets[i + 1] += offsets[i];
        }
        let mut cursor = offsets.clone();
        let mut around = vec![ElementId(0); elements.len() * N];
        for (e, nodes) in elements.iter().enumerate() {
            for n in nodes {
                let slot = &mut cursor[place(n)];
                around[*slot as usize] = ElementId::new(e);
                *slot += 1;
            }
        }
        Self { offsets, elements: around }
    }

    /// Elements that touch `node`, ascending.
    #[inline]
    pub fn around(&self, node: impl Into<CarrierId>) -> &[ElementId] {
        let i = node.into().index();
        &self.elements[self.offsets[i] as usize..self.offsets[i + 1] as usize]
    }
}
