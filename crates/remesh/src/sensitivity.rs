//! The transposed elastic map: derivatives at mesh nodes back to the design nodes.

use fluxmorph_geometry::NodeId;
use fluxmorph_geometry::tet4::Point;

use crate::deform::ElasticMap;
use crate::error::RemeshError;

impl ElasticMap {
    /// `dF/dΔx_b = g_b − K_bd K_dd⁻¹ g_d` at the design nodes, shape `(n_design, 3)`, from `g = ∂F/∂x` at all mesh
    /// nodes, shape `(n_nodes, 3)`.
    ///
    /// One solve, whatever the number of design nodes. It is the exact transpose of [`ElasticMap::linear`]; the constant
    /// part of the map has no say in the gradient. Values of `g` where nothing moves are not used.
    ///
    /// # Errors
    /// [`RemeshError::NotConverged`] when the iterative solver fails, [`RemeshError::NotFinite`].
    ///
    /// # Panics
    /// If `nodal` does not have one entry per mesh node.
    pub fn gradient(&self, nodal: &[Point]) -> Result<Vec<Point>, RemeshError> {
        let (unknowns, prescribed) = (self.unknowns(), self.prescribed());
        assert_eq!(nodal.len(), unknowns.dofs().carrier_count(), "one derivative per mesh node");
        let mut adjoint = vec![0.0; unknowns.dofs().count()];
        for (node, &g) in (0..).map(NodeId).zip(nodal) {
            unknowns.scatter_add(&mut adjoint, node, g);
        }
        self.solver().solve_in_place(&mut adjoint, "derivative")?;
        let mut carried = vec![0.0; prescribed.count()];
        self.coupling().mul_transposed(&adjoint, &mut carried);
        let at = |&node: &NodeId| {
            let (own, carried) = (nodal[node.index()], prescribed.gather(&carried, node));
            std::array::from_fn(|d| own[d] - carried[d])
        };
        Ok(self.design_nodes().iter().map(at).collect())
    }
}
