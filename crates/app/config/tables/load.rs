//! `[[loads]]`: several load cases of one device.

use std::collections::BTreeMap;

use super::coil::Coil;
use crate::config::section::Section;
use crate::config::table::table;

table! {
    /// A load case: a field problem of its own, at one frequency and with its own currents or voltages of the coils. All load
    /// cases share mesh and design. Without `[[loads]]` there is one for each frequency of `[analysis]`, with the coils as
    /// `[[coils]]` has them.
    ///
    /// What a load does not say of a coil is as in `[[coils]]`; permanent magnets and an applied field are the same in all.
    /// Between loads of one frequency only the right side differs, so that a further one costs one solution, unless a material
    /// has a B–H curve. Terms of the objective and constraints name their load by `load`; without it they are summed over all, or
    /// in a worst case taken on each.
    ///
    /// ```toml
    /// [[loads]]
    /// name = "no_load"
    /// ampere_turns = { secondary = "0 A" }
    ///
    /// [[loads]]
    /// name = "short_circuit"
    /// voltage = { secondary = "0 V" }
    /// amplitude = 0.1
    /// ```
    pub struct Load {
        /// What the load is called in results and by `load`: letters, digits, `_` and `-`; each name once. Arrays of fields have it as
        /// suffix, but for those of the first load.
        name: String = COLUMN, need "\"nominal\"";
        /// Its frequency [Hz]. Default: that of `[analysis]`, which then has one only. `[analysis]` has to have one where all loads
        /// have their own, too.
        frequency: Option<f64> = quantity(Frequency, NOT_NEGATIVE);
        /// Factor on the currents and voltages of all coils under this load, not 0.
        #[also(not_zero)]
        amplitude: f64 = number(FINITE) => 1.0;
        /// Current times turns [A] of coils by their names; of a coil that a voltage drives in `[[coils]]` too. 0: it is open.
        ampere_turns: BTreeMap<String, f64> = by_name(quantity(Current, FINITE)) => BTreeMap::new();
        /// Voltages [V] of coils with `turns` by their names; of a coil whose current `[[coils]]` gives too. 0: it is
        /// short-circuited.
        voltage: BTreeMap<String, f64> = by_name(quantity(Voltage, FINITE)) => BTreeMap::new();
        /// Phases of the currents or voltages of coils by their names [rad].
        phase: BTreeMap<String, f64> = by_name(quantity(Angle, FINITE)) => BTreeMap::new();
    }
    check = Load::check;
}

/// One field problem of a configuration: an entry of `[[loads]]`, or a frequency of `[analysis]`.
#[derive(Debug, Clone, Copy)]
pub struct LoadCase<'a> {
    /// Its place among `[[loads]]` and the entry there; `None` where there are no loads.
    pub load: Option<(usize, &'a Load)>,
    /// Frequency [Hz].
    pub frequency: f64,
}

/// How a coil is fed: amplitude times the phase is a peak phasor.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Feed {
    /// Whether by a voltage.
    pub by_voltage: bool,
    /// Ampere-turns [A] or voltage [V].
    pub amplitude: f64,
    /// Phase [rad].
    pub phase: f64,
}

impl Load {
    fn check(&mut self, section: &Section<'_>) {
        if self.amplitude == 0.0 {
            let message = format!("`{}.amplitude` is 0: nothing is excited", section.path());
            section.wrong("amplitude", message, "any number but 0");
        }
        for name in self.ampere_turns.keys().filter(|name| self.voltage.contains_key(*name)) {
            let message =
                format!("`{}` has both ampere-turns and a voltage of the coil `{name}`", section.path());
            section.clash(
                [&format!("ampere_turns.{name}"), &format!("voltage.{name}")],
                message,
                "one of them",
            );
        }
    }
}

impl LoadCase<'_> {
    /// Its name; `None` where there are no loads.
    pub fn name(&self) -> Option<&str> {
        self.load.map(|(_, load)| load.name.as_str())
    }

    /// The words behind what is of it: ` under the load `NAME``; nothing where there are no loads.
    pub fn words(&self) -> String {
        self.name().map_or_else(String::new, |load| format!(" under the load `{load}`"))
    }

    /// How a coil is fed.
    pub fn feed(&self, coil: &Coil) -> Feed {
        let own = |values: fn(&Load) -> &BTreeMap<String, f64>| {
            self.load.and_then(|(_, load)| values(load).get(&coil.name)).copied()
        };
        let (by_voltage, amplitude) = match (own(|load| &load.ampere_turns), own(|load| &load.voltage)) {
            (Some(ampere_turns), _) => (false, ampere_turns),
            (None, Some(voltage)) => (true, voltage),
            (None, None) => match coil.voltage {
                Some(voltage) => (true, voltage),
                None => (false, coil.ampere_turns.unwrap_or_default()),
            },
        };
        let factor = self.load.map_or(1.0, |(_, load)| load.amplitude);
        Feed {
            by_voltage,
            amplitude: factor * amplitude,
            phase: own(|load| &load.phase).unwrap_or(coil.phase),
        }
    }

    /// The key path of what a load says of a coil, or of what `[[coils]]` says of it with the number `index`.
    pub fn path(&self, coil: &Coil, index: usize, key: &str) -> String {
        let of = |load: &Load| match key {
            "phase" => load.phase.contains_key(&coil.name),
            "voltage" => load.voltage.contains_key(&coil.name),
            _ => load.ampere_turns.contains_key(&coil.name),
        };
        match self.load.filter(|(_, load)| of(load)) {
            Some((k, _)) => format!("loads[{k}].{key}.{}", coil.name),
            None => format!("coils[{index}].{key}"),
        }
    }
}
