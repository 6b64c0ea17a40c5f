//! The field problems of a configuration: its load cases, or its frequencies.

use std::collections::HashSet;

use super::coil::IN_SERIES;
use super::config::Config;
use super::load::LoadCase;
use crate::config::section::Section;

/// Every number once, in the order in which they come first; zero has no sign.
pub(crate) fn each_once(numbers: impl IntoIterator<Item = f64>) -> Vec<f64> {
    let mut seen = HashSet::new();
    numbers.into_iter().filter(|number| seen.insert((number + 0.0).to_bits())).collect()
}

impl Config {
    /// The field problems in their order, at least one.
    pub fn load_cases(&self) -> Vec<LoadCase<'_>> {
        if self.loads.is_empty() {
            let of = |&frequency: &f64| LoadCase { load: None, frequency };
            return self.analysis.frequencies().iter().map(of).collect();
        }
        let usual = self.analysis.frequency();
        let of = |entry| LoadCase { load: Some(entry), frequency: entry.1.frequency.unwrap_or(usual) };
        self.loads.iter().enumerate().map(of).collect()
    }

    /// The frequencies of the field problems [Hz], each once, in their order.
    pub fn frequencies(&self) -> Vec<f64> {
        each_once(self.load_cases().iter().map(|case| case.frequency))
    }

    /// Whether a field alternates: one of the frequencies is above zero.
    pub fn alternates(&self) -> bool {
        self.load_cases().iter().any(|case| case.frequency > 0.0)
    }

    /// What is in series with a coil counts where a voltage drives it.
    pub(super) fn check_series(&self, root: &Section<'_>) {
        for (k, coil) in self.coils.iter().enumerate().filter(|(_, coil)| coil.voltage.is_none()) {
            let is_driven = self.loads.iter().any(|load| load.voltage.contains_key(&coil.name));
            let Some(section) = root.inner(&format!("coils[{k}]")).filter(|_| !is_driven) else { continue };
            for key in IN_SERIES.into_iter().filter(|key| section.has(key) && !section.has("voltage")) {
                let message = format!("`{}.{key}` has no use without `voltage`", section.path());
                section.wrong(key, message, "voltage beside it or under a load, or no such key");
            }
        }
    }

    /// What the loads ask of each other and of the analysis.
    pub(super) fn check_loads(&self, root: &Section<'_>) {
        // Of `a-b` and `a_b` the arrays of fields have one name.
        let names: Vec<String> = self.loads.iter().map(|load| load.name.replace('-', "_")).collect();
        root.named_twice("loads", &names, "loads", "a different name for each load");
        if !self.loads.is_empty() && root.has("analysis.frequencies") {
            root.clash(
                ["analysis.frequencies", "loads"],
                "there are both `analysis.frequencies` and [[loads]], which have frequencies of their own",
                "one `frequency` in [analysis], and `frequency` in the loads that have another one",
            );
        }
    }
}
