//! Index newtypes: a node is never an element, and neither is a plain number.

/// Declares a transparent index newtype over `u32`.
macro_rules! index_type {
    ($(#[$doc:meta])* $name:ident) => {
        $(#[$doc])*
        #[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
        #[repr(transparent)]
        pub struct $name(pub u32);

        impl $name {
            /// The index of position `index` in an array.
            ///
            /// # Panics
            /// If `index` does not fit in 32 bits.
            #[inline]
            pub fn new(index: usize) -> Self {
                Self(u32::try_from(index).expect("an index fits in 32 bits"))
            }

            /// The position in an array.
            #[inline]
            pub fn index(self) -> usize {
                self.0 as usize
            }
        }

        impl std::fmt::Display for $name {
            fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
                self.0.fmt(f)
            }
        }
    };
}

index_type! {
    /// A mesh node.
    NodeId
}
index_type! {
    /// What carries unknowns of a discretisation: a node, an edge or a face, in the numbering of its space.
    CarrierId
}

impl From<NodeId> for CarrierId {
    /// Where the nodes are the carriers, in their own order.
    #[inline]
    fn from(node: NodeId) -> Self {
        Self(node.0)
    }
}

index_type! {
    /// A tetrahedron.
    ElementId
}
index_type! {
    /// A named region (a set of elements); every element belongs to exactly one.
    RegionId
}
