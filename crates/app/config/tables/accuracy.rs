//! `[accuracy]`: what is done to know how exact the objective is.

use serde_json::json;

use crate::config::section::Section;
use crate::config::table::table;

/// With more, the first element would be beyond the number of bisections that a mesh may have.
const MOST_REFINEMENTS: usize = 19;

table! {
    /// What is done to know how exact the objective is. `docs/theory.md` tells how the error is estimated.
    ///
    /// With `tolerance` the mesh of a run is refined where its objective needs it: at the initial design until the error bar
    /// there, twice the estimate, is within the tolerance; then comes the search; and where the error bar at the best design is
    /// not, the mesh is refined for that design, and the search goes on from it. That is estimated where a search ends, and on the
    /// way after 10, 20, 40 … evaluations on a mesh, since a search would not give back by itself what it gains from the errors of a
    /// mesh; where that is fine enough, the search is the same as without. Nodes are put in the middle of edges: bodies,
    /// facets and design variables stay what they are, `design.filter_radius` and `design.grid` too. All evaluations have one
    /// history, in which `level` counts the refinements, and `optimizer.max_evaluations` limits them together, as `max_time` does,
    /// in which the refinements count. Of the initial design every mesh has its own value, to which the ratios belong. Where the
    /// memory or `max_refinements` do not suffice, the run goes on with the mesh that it has, and says so.
    ///
    /// Facets of curved surfaces are no error of the field, and refinements keep them. What they change is computed once more a design,
    /// at the end of a run or an analysis with an objective, for elements of both orders unless `estimate` is `false`; it counts for
    /// `tolerance`.
    ///
    /// ```toml
    /// [accuracy]
    /// tolerance = "2 %"
    /// max_refinements = 6
    /// ```
    pub struct Accuracy: Default {
        /// Whether the errors that come from the mesh are estimated, of the objective and of losses, forces, flux linkages,
        /// expansions and probes: by `solve`, and by `run` at the first and the best design, unless `output.verify_refinement` is 0. In
        /// one process. Default: an estimate is made for elements of first order, and given up where its iterations would cost more
        /// than six evaluations and more than ten seconds for each state (along a B–H curve: than each step of Newton's method
        /// may); to set up its system of second order takes its time beside that. `true`: it is made whatever it costs, with up to
        /// 3000 iterations for each solution, and for elements of second order too, on eight times as many.
        estimate: Option<bool> = FLAG;
        /// `run`: largest error bar of the objective that the mesh may make: at the initial design relative to the objective there,
        /// at the best one relative to the larger of both. With first order, in one process. Default: the mesh stays what it is,
        /// and its error is reported.
        tolerance: Option<f64> = quantity(Ratio, POSITIVE);
        /// Most refinements of the mesh for `tolerance`, before and after the search. Default 8, which are enough from a mesh that
        /// shows little more than the bodies to 1 %.
        max_refinements: usize = integer(1, MOST_REFINEMENTS) => 8;
    }
    check = Accuracy::check;
    rules = |rules| rules.add(json!({
        "if": { "required": ["tolerance"] },
        "then": { "properties": { "estimate": { "const": true }, "tolerance": { "exclusiveMaximum": 1 } } },
    }));
}

impl Accuracy {
    fn check(&mut self, section: &Section<'_>) {
        if let Some(tolerance) = self.tolerance.filter(|tolerance| *tolerance >= 1.0) {
            let message =
                format!("`accuracy.tolerance` is {tolerance}, as much as the objective itself or more");
            section.wrong("tolerance", message, "less than 1; with its unit it is a share, like \"2 %\"");
        }
        if self.tolerance.is_some() && self.estimate == Some(false) {
            section.clash(
                ["estimate", "tolerance"],
                "whether the tolerance is kept is what the estimate says".to_owned(),
                "estimate = true, or no tolerance",
            );
        }
    }
}
