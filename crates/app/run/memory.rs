//! How much memory a run or an analysis will hold at its peak: that of an evaluation, of the estimated error of the mesh, or of one
//! of the checks at the end, whichever is most. They come one after the other, and each is left out where it does not fit.
//!
//! Whether a finer mesh gets a factor or two levels is known when it is set up, and looked at then; here a factor is counted.
//! Meshes that `accuracy.tolerance` would make are not foreseen: each is looked at before it is set up (`levels`).

use fluxmorph_optimizer::memory_estimate::Sizes;

use super::estimate;
use super::finer::{Cut, FinerMesh};
use super::mesh_independence::FreshMesh;
use crate::build::Setup;
use crate::config::{Config, ElementOrder, Elements};
use crate::error::Error;

/// What first-order edge elements hold over nodal ones on the same mesh: 1.1 to 2.0 on the shields.
const EDGE_OVER_NODAL: usize = 2;

/// Bytes, about.
pub(crate) fn peak(config: &Config, setup: &Setup) -> Result<usize, Error> {
    let (problem, sizes) = (&setup.problem, Sizes::of(&setup.problem));
    let is_run = problem.shape().is_some() && problem.objective().is_some();
    if is_run && config.output.verify_refinement == 0.0 && config.accuracy.tolerance.is_none() {
        return Ok(sizes.here());
    }
    let mut peak = sizes.here().max(estimate::memory(config, problem).unwrap_or(0));
    if !is_run || config.output.verify_refinement == 0.0 {
        return Ok(peak);
    }
    if (config.analysis.elements, config.analysis.order) == (Elements::Nodal, ElementOrder::Linear) {
        peak = peak.max((EDGE_OVER_NODAL - 1) * sizes.of_one_state() + sizes.here());
    }
    if !config.output.is_verified_on_finer_cells() {
        return Ok(peak);
    }
    let check = match FreshMesh::of(config, problem) {
        Some(fresh) => fresh.memory()[1],
        None => {
            let cut = Cut::Growth(config.output.verify_refinement);
            sizes.on_other_mesh(FinerMesh::new(config, &setup.full_mesh, cut)?.growth())[1]
        }
    };
    Ok(peak.max(check))
}
