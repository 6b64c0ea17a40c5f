//! Equation numbers of the unknown components at their carriers: nodes, edges or faces.

use crate::ids::{CarrierId, NodeId};

/// Marks a component that is not an unknown of this system.
const NOT_AN_UNKNOWN: u32 = u32::MAX;

/// Equation numbers of `C` components per carrier; numbered carrier by carrier, so that the rows of a carrier are contiguous.
#[derive(Clone, Debug)]
pub struct DofMap<const C: usize> {
    equations: Vec<[u32; C]>,
    count: usize,
}

impl<const C: usize> DofMap<C> {
    /// Numbers the components for which `is_unknown(carrier, component)` holds.
    pub fn new(carrier_count: usize, mut is_unknown: impl FnMut(CarrierId, usize) -> bool) -> Self {
        let mut count = 0;
        let equations = (0..carrier_count)
            .map(|i| {
                std::array::from_fn(|c| {
                    if is_unknown(CarrierId::new(i), c) {
                        count += 1;
                        count - 1
                    } else {
                        NOT_AN_UNKNOWN
                    }
                })
            })
            .collect();
        Self { equations, count: count as usize }
    }

    /// As [`DofMap::new`], where the mesh's nodes are the carriers.
    pub fn of_nodes(node_count: usize, mut is_unknown: impl FnMut(NodeId, usize) -> bool) -> Self {
        Self::new(node_count, |carrier, c| is_unknown(NodeId::new(carrier.index()), c))
    }

    /// Number of equations.
    pub fn count(&self) -> usize {
        self.count
    }

    /// Number of components that are unknown at some carrier.
    pub fn component_count(&self) -> usize {
        let unknown = |c: &usize| self.equations.iter().any(|equations| equations[*c] != NOT_AN_UNKNOWN);
        (0..C).filter(unknown).count()
    }

    /// Number of carriers.
    pub fn carrier_count(&self) -> usize {
        self.equations.len()
    }

    /// Equation of a component at a carrier, if it is an unknown.
    #[inline]
    pub fn equation(&self, carrier: impl Into<CarrierId>, component: usize) -> Option<usize> {
        let equation = self.equations[carrier.into().index()][component];
        (equation != NOT_AN_UNKNOWN).then_some(equation as usize)
    }

    /// Carrier and component of every equation, in their order.
    pub fn places(&self) -> impl Iterator<Item = (CarrierId, usize)> + '_ {
        let of_carrier = |(i, equations): (usize, &[u32; C])| {
            let equations = *equations;
            (0..C).filter(move |&c| equations[c] != NOT_AN_UNKNOWN).map(move |c| (CarrierId::new(i), c))
        };
        self.equations.iter().enumerate().flat_map(of_carrier)
    }

    /// Bit `c` is set where component `c` at `carrier` is an unknown.
    #[inline]
    pub fn unknown_bits(&self, carrier: impl Into<CarrierId>) -> u16 {
        let mut bits = 0;
        for (c, &equation) in self.equations[carrier.into().index()].iter().enumerate() {
            bits |= u16::from(equation != NOT_AN_UNKNOWN) << c;
        }
        bits
    }

    /// The components at a carrier out of a vector of unknowns; zero where a component is not an unknown.
    #[inline]
    pub fn gather<T: Copy + Default>(&self, values: &[T], carrier: impl Into<CarrierId>) -> [T; C] {
        self.equations[carrier.into().index()]
            .map(|equation| if equation == NOT_AN_UNKNOWN { T::default() } else { values[equation as usize] })
    }

    /// Adds components at a carrier into a vector of unknowns; what is not an unknown is dropped.
    #[inline]
    pub fn scatter_add<T: Copy + std::ops::AddAssign>(
        &self,
        values: &mut [T],
        carrier: impl Into<CarrierId>,
        components: [T; C],
    ) {
        for (equation, component) in self.equations[carrier.into().index()].iter().zip(components) {
            if *equation != NOT_AN_UNKNOWN {
                values[*equation as usize] += component;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn equations_are_numbered_node_by_node_and_skip_what_is_known() {
        let dofs = DofMap::<2>::new(3, |carrier, c| !(carrier == CarrierId(1) && c == 0));
        assert_eq!(dofs.count(), 5);
        assert_eq!(dofs.equation(CarrierId(1), 0), None);
        assert_eq!(dofs.equation(CarrierId(1), 1), Some(2));
        assert_eq!(dofs.unknown_bits(CarrierId(1)), 0b10);
        let places: Vec<_> = dofs.places().map(|(carrier, c)| dofs.equation(carrier, c)).collect();
        assert_eq!(places, [Some(0), Some(1), Some(2), Some(3), Some(4)]);
        let values = [1.0, 2.0, 3.0, 4.0, 5.0];
        assert_eq!(dofs.gather(&values, CarrierId(1)), [0.0, 3.0]);
        let mut sum = [0.0; 5];
        dofs.scatter_add(&mut sum, CarrierId(1), [7.0, 8.0]);
        assert_eq!(sum, [0.0, 0.0, 8.0, 0.0, 0.0]);
    }
}
