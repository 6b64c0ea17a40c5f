//! Disjoint sets of whole numbers: which nodes hang together.

/// Numbers in sets that are joined (union–find). The least number of a set is its root, whatever the order of the joins.
#[derive(Clone, Debug)]
pub struct DisjointSets {
    parent: Vec<u32>,
}

impl DisjointSets {
    /// Every number below `count` by itself.
    pub fn new(count: usize) -> Self {
        Self { parent: (0..count as u32).collect() }
    }

    /// The least number of the set that a number belongs to, with path halving.
    pub fn root(&mut self, number: usize) -> usize {
        let mut at = number;
        while self.parent[at] as usize != at {
            self.parent[at] = self.parent[self.parent[at] as usize];
            at = self.parent[at] as usize;
        }
        at
    }

    /// Joins the sets of some numbers.
    pub fn join(&mut self, numbers: impl IntoIterator<Item = usize>) {
        let mut numbers = numbers.into_iter();
        let Some(first) = numbers.next() else { return };
        for other in numbers {
            let (a, b) = (self.root(first), self.root(other));
            self.parent[a.max(b)] = a.min(b) as u32;
        }
    }
}
