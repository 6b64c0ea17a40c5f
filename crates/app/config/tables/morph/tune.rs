//! `[morph.tune]`: what `fluxmorph morph --tune` may change, and how far.

use crate::config::table::table;
use crate::config::tables::remesh::POISSON;
use crate::config::value::choice::choice;
use crate::config::value::range::Range;

/// Exponents of a ratio of moduli.
const DECADES: Range = Range::closed(-9.0, 9.0);
/// Multiples of the force that counts.
const FORCES: Range = Range::closed(-1e6, 1e6);

table! {
    /// What `fluxmorph morph --tune` may change. The search is for the motion outside of the cases.
    ///
    /// ```toml
    /// [morph.tune]
    /// parameters = ["young", "poisson", "force"]
    /// evaluations = 200
    /// ```
    pub struct Tune: Default {
        /// Which parameters of every region of the body are searched; each once. The modulus of the first region is kept.
        parameters: Vec<TunedParameter> = not_empty(WORD) => vec![TunedParameter::Young, TunedParameter::Poisson];
        /// Evaluations of the worst quality, for each stiffness. Three regions have five parameters, and the quadratic model of
        /// the search needs about twice that to begin.
        evaluations: usize = integer(1, 100_000) => 60;
        /// Bounds of log10 of a region's Young's modulus over that of the first, the lower one first.
        log10_young: [f64; 2] = number(DECADES) => [-3.0, 3.0];
        /// Bounds of Poisson's ratio, the lower one first. Beyond the default the body nearly loses a stiffness.
        poisson: [f64; 2] = number(POISSON) => [-0.2, 0.45];
        /// Bounds of the force along the mean motion, the lower one first, in units of E₁ u V / (N L²): modulus of the first
        /// region, longest displacement, volume per node and largest extent of the body. A force of 1 makes the body yield about
        /// as far as it is moved.
        force: [f64; 2] = number(FORCES) => [-3.0, 3.0];
    }
    check = |tune, section| {
        for (key, [lower, upper]) in
            [("log10_young", tune.log10_young), ("poisson", tune.poisson), ("force", tune.force)]
        {
            if lower >= upper {
                let message = format!("`{}.{key}` runs from {lower} to {upper}", section.path());
                section.wrong(key, message, "the lower bound first, below the upper bound");
            }
        }
    };
}

choice! {
    /// A parameter of a subregion.
    pub enum TunedParameter {
        /// Young's modulus; that of the first subregion is kept.
        Young = "young",
        /// Poisson's ratio.
        Poisson = "poisson",
        /// The fictitious force along the mean motion.
        Force = "force",
    }
}
