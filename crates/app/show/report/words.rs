//! The configuration in plain words.

use super::ticks::{decimals_of, given, number, trim_zeros};
use crate::config::{
    Algorithm, Compared, Config, Constraint, DesignDirection, DirectionWord, Follow, Functional, Goal, Limit,
    ObjectiveKind, ValueBound, Weighting,
};

/// What is made small or large.
pub(super) fn objective(config: &Config) -> Option<String> {
    let objective = config.objective.as_ref()?;
    let goal = match objective.goal {
        Goal::Minimise => "Minimise",
        Goal::Maximise => "Maximise",
    };
    let terms: Vec<String> = objective
        .terms()
        .iter()
        .map(|term| {
            let what = functional(&term.functional);
            if term.weight == 1.0 { what } else { format!("{} times {what}", number(term.weight, 3)) }
        })
        .collect();
    Some(match objective.worst() {
        None => format!("{goal} {}", terms.join(", plus ")),
        Some(worst) => {
            let where_from = match config.load_cases().len() {
                1 => "",
                _ if config.loads.is_empty() => " and frequency",
                _ => " and load",
            };
            format!("{goal} {worst}, by term{where_from}, of {}", terms.join(", and "))
        }
    })
}

/// A functional.
pub(super) fn functional(functional: &Functional) -> String {
    let region = functional.region.as_deref().unwrap_or("the whole mesh");
    let sum = |integrand: &str| match functional.weighting {
        Some(Weighting::Volume) => format!("the integral of {integrand} over {region}"),
        _ => format!("the sum of {integrand} over the cells of {region}"),
    };
    let what = match functional.kind {
        ObjectiveKind::FluxDensitySquared => sum("|B|²"),
        ObjectiveKind::TargetField => {
            let target = functional.target.unwrap_or_default().map(given).join(", ");
            sum(&format!("|B − ({target}) T|²"))
        }
        ObjectiveKind::Homogeneity => {
            let of = match functional.compare {
                Some(Compared::Component) => format!("B along ({})", along(functional)),
                Some(Compared::Modulus) => "|B|".to_owned(),
                _ => "B".to_owned(),
            };
            format!("the relative variance of {of} over {region} (its deviation from its own mean)")
        }
        ObjectiveKind::FieldComponent => format!("the mean of B along ({}) in {region}", along(functional)),
        ObjectiveKind::Loss => format!("the eddy-current loss in {region}"),
        ObjectiveKind::Energy => format!("the magnetic energy in {region}"),
        ObjectiveKind::Force => format!("the force on {region} along ({})", along(functional)),
        ObjectiveKind::Torque => format!("the torque on {region} about ({})", along(functional)),
        ObjectiveKind::Multipole => format!("the term {} of {region}", harmonics(functional)),
        ObjectiveKind::MultipoleContent => {
            format!("the relative content of {} in {region}", harmonics(functional))
        }
        kind => {
            let of = functional.region.clone().unwrap_or_else(|| coils(functional));
            format!("the {} of {of}", kind.name().replace('_', " "))
        }
    };
    let what = match functional.follow {
        None => what,
        Some(Follow::Space) => format!("{what}, at places that stay"),
        Some(Follow::Mesh) => format!("{what}, which moves with the mesh"),
    };
    match (functional.frequency, &functional.load) {
        (_, Some(load)) => format!("{what} under the load {load}"),
        (Some(frequency), None) => format!("{what} at {} Hz", trim_zeros(frequency, 6)),
        (None, None) => what,
    }
}

/// The terms of an expansion.
fn harmonics(functional: &Functional) -> String {
    functional.harmonics.as_deref().unwrap_or_default().join(", ")
}

/// The coils of a quantity.
fn coils(functional: &Functional) -> String {
    functional.coils.as_deref().unwrap_or_default().join(" and ")
}

/// The direction of a component.
fn along(functional: &Functional) -> String {
    functional.direction.unwrap_or_default().map(|c| trim_zeros(c, 3)).join(", ")
}

/// The frequencies and loads.
pub(super) fn frequencies(config: &Config) -> String {
    let text = match config.frequencies().as_slice() {
        [0.0] => "in a static field".to_owned(),
        all => format!("at {} Hz", all.iter().map(|f| trim_zeros(*f, 6)).collect::<Vec<_>>().join(", ")),
    };
    if config.loads.is_empty() {
        return text;
    }
    let loads: Vec<&str> = config.loads.iter().map(|load| load.name.as_str()).collect();
    format!("{text} under the loads {}", loads.join(", "))
}

/// What moves, which way and how far, with so many variables.
pub(super) fn design(config: &Config, variables: Option<usize>) -> Option<String> {
    let design = config.design.as_ref()?;
    let along = match design.direction {
        DesignDirection::Word(DirectionWord::Normal) => "along its normal".to_owned(),
        DesignDirection::Vector(vector) => match (0..3).find(|&d| vector[d].abs() == 1.0) {
            Some(axis) => {
                format!("along {}{}", if vector[axis] < 0.0 { "−" } else { "+" }, ["x", "y", "z"][axis])
            }
            None => format!("along ({})", vector.map(|c| trim_zeros(c, 3)).join(", ")),
        },
    };
    let decimals = decimals_of(&[1e3 * design.lower, 1e3 * design.upper], 3);
    let [lower, upper] = [design.lower, design.upper].map(|bound| trim_zeros(1e3 * bound, decimals));
    let mut text = format!("by moving {} {along} between {lower} and {upper} mm", design.surface.join(", "));
    if let Some(variables) = variables {
        text += &format!(" with {variables} variables");
    }
    match (design.grid, design.filter_radius) {
        (Some([n, m]), _) => text += &format!(" (control grid {n} × {m})"),
        (None, Some(0.0)) => text += " (one a node)",
        (None, Some(radius)) => {
            text += &format!(
                " (nodes, filtered over {} mm)",
                trim_zeros(1e3 * radius, decimals_of(&[1e3 * radius], 3))
            )
        }
        (None, None) => text += " (nodes, filtered over 1.5 cells)",
    }
    Some(text)
}

/// A constraint.
pub(super) fn constraint(constraint: &Constraint) -> String {
    let within = |bound: &ValueBound, unit: &str| match bound {
        ValueBound::AtMost(value) => format!("at most {}{unit}", number(*value, 4)),
        ValueBound::AtMostRatio(ratio) => {
            format!("at most {} times its initial value", given(*ratio))
        }
        ValueBound::AtLeast(value) => format!("at least {}{unit}", number(*value, 4)),
        ValueBound::AtLeastRatio(ratio) => {
            format!("at least {} times its initial value", given(*ratio))
        }
    };
    match &constraint.limit {
        Limit::Functional { functional: measured, bound } => {
            format!("{} {}", functional(measured), within(bound, &measured.dimension().behind_value()))
        }
        Limit::Thickness { minimum, maximum, .. } => {
            let bounds = [("at least", minimum), ("at most", maximum)];
            let words = bounds.iter().filter_map(|(word, bound)| {
                bound.map(|bound| {
                    format!("{word} {} mm", trim_zeros(1e3 * bound, decimals_of(&[1e3 * bound], 3)))
                })
            });
            format!("a thickness of {}", words.collect::<Vec<_>>().join(" and "))
        }
    }
}

/// The method.
pub(super) fn algorithm(algorithm: Algorithm) -> &'static str {
    match algorithm {
        Algorithm::Mma => "the method of moving asymptotes (MMA)",
        Algorithm::Ccsaq => "conservative convex separable approximation (CCSAQ)",
        Algorithm::Slsqp => "sequential quadratic programming (SLSQP)",
        Algorithm::Lbfgs => "limited-memory BFGS",
        Algorithm::Tnewton => "truncated Newton",
        Algorithm::Var2 => "a limited-memory variable metric (VAR2)",
    }
}

/// Everything in one paragraph.
pub(super) fn summary(config: &Config, variables: Option<usize>, is_run: bool) -> String {
    let frequencies = frequencies(config);
    if !is_run {
        return format!("One field analysis {frequencies}.");
    }
    let mut text = objective(config).unwrap_or_else(|| "Optimise".to_owned());
    text += &format!(" {frequencies}");
    if let Some(design) = design(config, variables) {
        text += &format!(", {design}");
    }
    if !config.constraints.is_empty() {
        let all: Vec<String> = config.constraints.iter().map(constraint).collect();
        text += &format!(", subject to {}", all.join("; "));
    }
    text + &format!(", with {}.", algorithm(config.optimizer.algorithm))
}

/// A text as a sentence begins.
pub(super) fn capital(text: &str) -> String {
    let mut letters = text.chars();
    letters.next().map_or(String::new(), |first| first.to_uppercase().chain(letters).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_shield_is_described_in_a_sentence() {
        let path = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("configs");
        let (config, _) = Config::from_file(&path.join("shield.toml"), &[]).expect("shipped");
        assert_eq!(
            summary(&config, Some(91), true),
            "Minimise the sum of |B|² over the cells of observation at 60 Hz, by moving plate_bottom along −z between −5 \
             and 20 mm with 91 variables (control grid 7 × 13), with the method of moving asymptotes (MMA)."
        );
        let (config, _) = Config::from_file(&path.join("shield_mass_limit.toml"), &[]).expect("shipped");
        assert!(summary(&config, None, true).contains("subject to the mass of plate at most"));
    }
}
