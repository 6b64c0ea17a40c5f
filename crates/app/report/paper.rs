//! The comparison with the paper's second example, for runs of that case alone.
//!
//! The case is known by the values of the configuration, whatever the file is called: the generator `shield` with a plate
//! 10 mm thick that may become 5 to 30 mm thick at 7 by 13 points and begins flat, of steel with μ_r = 800 and σ = 7·10⁶ S/m, a coil of 40 000 ampere-turns
//! at the frequency of a power line, and the sum of B·B* over the observation cells as the objective. What the paper does
//! not tell (the coil's and the plate's sizes, the mesh) is no part of that.

use super::data::RunData;
use super::ticks::{grouped, trimmed};
use crate::config::{Config, DesignDirection, Goal, InitialDesign, MeshConfig, ObjectiveKind, Weighting};

/// F/F₀ of the paper, after [`ITERATIONS`].
const RATIO: f64 = 0.5116;
const ITERATIONS: usize = 13;
const VARIABLES: usize = 91;

/// One row: what is compared, the paper's value, this run's, and a remark.
pub(super) type Row = [String; 4];

fn near(value: f64, expected: f64) -> bool {
    (value - expected).abs() <= 1e-9 * expected.abs()
}

/// Whether a configuration is the paper's case.
pub(super) fn is_papers_case(config: &Config) -> bool {
    let MeshConfig::Shield(mesh) = &config.mesh else { return false };
    let steel = config.regions.get("plate").and_then(|region| config.materials.get(&region.material));
    let is_steel = steel.is_some_and(|m| near(m.relative_permeability, 800.0) && near(m.conductivity, 7e6));
    let is_coil = matches!(config.coils.as_slice(), [coil] if near(coil.ampere_turns.abs(), 40e3));
    let is_powered = matches!(config.analysis.frequencies(), [f] if *f == 50.0 || *f == 60.0);
    let is_objective = config.objective.as_ref().is_some_and(|objective| {
        matches!(objective.terms(), [term] if term.functional.kind == ObjectiveKind::FluxDensitySquared
            && term.functional.weighting == Some(Weighting::Point))
            && objective.goal == Goal::Minimise
    });
    let is_design = config.design.as_ref().is_some_and(|design| {
        design.surface == ["plate_bottom"]
            && near(design.lower, -5e-3)
            && near(design.upper, 20e-3)
            && design.direction == DesignDirection::Vector([0.0, 0.0, -1.0])
            && design.grid == Some([7, 13])
            && design.initial == InitialDesign::Uniform(0.0)
    });
    near(mesh.plate[2], 0.01)
        && is_steel
        && is_coil
        && is_powered
        && is_objective
        && is_design
        && config.constraints.is_empty()
}

/// The rows of the table; none for other cases.
pub(super) fn rows(data: &RunData) -> Vec<Row> {
    if !data.is_run() || !is_papers_case(&data.config) {
        return Vec::new();
    }
    let row = |what: &str, paper: &str, own: String, remark: &str| {
        [what.to_owned(), paper.to_owned(), own, remark.to_owned()]
    };
    let percent = |ratio: f64| format!("{} %", trimmed(100.0 * ratio, 2));
    let mut rows = Vec::new();
    if let Some(ratio) = data.ratio() {
        let remark = if ratio <= RATIO { "reached" } else { "not reached" };
        rows.push(row("objective at the end, of the initial one", &percent(RATIO), percent(ratio), remark));
    }
    let within = data.history.iter().take(ITERATIONS).map(|row| row.ratio).fold(f64::INFINITY, f64::min);
    if within.is_finite() {
        rows.push(row(
            "best within 13",
            &format!("{} in {ITERATIONS} iterations", percent(RATIO)),
            format!("{} in {} evaluations", percent(within), data.history.len().min(ITERATIONS)),
            "an evaluation is one value with its gradient; the paper does not say what it counts",
        ));
    }
    let reached = data.history.iter().find(|row| row.ratio <= RATIO);
    rows.push(row(
        "51.16 % reached",
        &format!("iteration {ITERATIONS}"),
        reached.map_or("not yet".to_owned(), |row| {
            format!("evaluation {}, iteration {}", row.evaluation, row.iteration)
        }),
        "an iteration improves on all before; counted from 0",
    ));
    if let Some(verified) = data.result.as_ref().and_then(|r| r.objective.as_ref()?.verified_ratio) {
        rows.push(row(
            "the same on a mesh not optimised on",
            "not given",
            percent(verified),
            "shows that the gain is the shape's, and not the mesh's",
        ));
    }
    if let Some(values) = &data.designs[1] {
        let remark = "points of the face away from the coil";
        rows.push(row("design variables", &VARIABLES.to_string(), values.len().to_string(), remark));
    }
    let best = data.best.and_then(|best| data.row(best));
    if let Some((least, most)) = best.and_then(|row| Some((row.min_thickness_m?, row.max_thickness_m?))) {
        rows.push(row(
            "thickness, initially 10 mm",
            "5 to 30 mm allowed",
            format!("{} to {} mm", trimmed(1e3 * least, 2), trimmed(1e3 * most, 2)),
            if near(least, 5e-3) && near(most, 30e-3) { "both bounds are used" } else { "" },
        ));
    }
    if let Some([rim, middle]) = rim_and_middle(data) {
        rows.push(row(
            "shape",
            "in a figure only",
            format!("rim {} mm, middle {} mm", trimmed(rim, 1), trimmed(middle, 1)),
            "means over the outermost and over the innermost sixth of the plate's half lengths",
        ));
    }
    let frequency = format!("{} Hz", trimmed(data.config.analysis.frequency(), 3));
    rows.push(row("frequency", "power frequency", frequency, "not given as a number"));
    let ampere_turns = data.config.coils.iter().map(|coil| coil.ampere_turns.abs()).sum::<f64>();
    let source = format!("{} A, μ_r 800, 7 × 10⁶ S/m", grouped(ampere_turns.round() as usize));
    rows.push(row("source and steel", "40\u{202f}000 A, μ_r 800, 7 × 10⁶ S/m", source, "as given"));
    rows.push(row(
        "plate, coil, observation cells",
        "no sizes given",
        plate(&data.config),
        "a reconstruction: ratios can be compared, fields cannot",
    ));
    rows
}

fn plate(config: &Config) -> String {
    let MeshConfig::Shield(mesh) = &config.mesh else { return String::new() };
    let [a, b, t] = mesh.plate.map(|length| 1e3 * length);
    format!(
        "{} × {} × {} mm plate, a quarter computed",
        trimmed(2.0 * a, 1),
        trimmed(2.0 * b, 1),
        trimmed(t, 1)
    )
}

/// Mean thickness of the best design at the rim and in the middle [mm].
fn rim_and_middle(data: &RunData) -> Option<[f64; 2]> {
    let MeshConfig::Shield(mesh) = &data.config.mesh else { return None };
    let design = data.outline.as_ref().ok()?.design.as_ref()?;
    let values = data.designs[1].as_ref()?;
    let [a, b, thickness] = mesh.plate;
    let of = |wanted: &dyn Fn(f64, f64) -> bool| {
        let points = design.surface.points().iter().zip(values);
        let own: Vec<f64> =
            points.filter(|(p, _)| wanted(p[0] / a, p[1] / b)).map(|(_, v)| 1e3 * (thickness + v)).collect();
        (!own.is_empty()).then(|| own.iter().sum::<f64>() / own.len() as f64)
    };
    let rim = of(&|x, y| x > 5.0 / 6.0 - 1e-9 || y > 5.0 / 6.0 - 1e-9)?;
    let middle = of(&|x, y| x < 1.0 / 6.0 + 1e-9 && y < 1.0 / 6.0 + 1e-9)?;
    Some([rim, middle])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_case_is_known_by_its_values() {
        let path = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("configs");
        let is = |name: &str, overrides: &[&str]| {
            let overrides: Vec<String> = overrides.iter().map(|o| (*o).to_owned()).collect();
            let (config, _) = Config::from_file(&path.join(name), &overrides).expect("shipped");
            is_papers_case(&config)
        };
        assert!(is("shield.toml", &[]) && is("shield_impedance.toml", &[]) && is("shield_quick.toml", &[]));
        assert!(is("shield.toml", &["title=\"mine\"", "analysis.frequency=\"50 Hz\""]));
        for other in [
            "analysis.frequency=\"400 Hz\"",
            "materials.steel.relative_permeability=900",
            "design.upper=\"10 mm\"",
        ] {
            assert!(!is("shield.toml", &[other]), "{other}");
        }
        assert!(!is("shield_mass_limit.toml", &[]) && !is("pole.toml", &[]) && !is("inductor.toml", &[]));
    }
}
