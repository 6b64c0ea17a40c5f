//! What quantities measure, and the units that each may carry.

use Dimension::{
    Angle, Conductivity, Current, Duration, Energy, FluxDensity, FluxDensityIntegral, FluxDensitySquared,
    Frequency, Length, Mass, MassDensity, Power, Volume,
};

/// What a quantity measures, and so which units it may carry.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Dimension {
    /// A length [m].
    Length,
    /// A frequency [Hz].
    Frequency,
    /// An electric conductivity [S/m].
    Conductivity,
    /// A mass density [kg/m³].
    MassDensity,
    /// A current, or ampere-turns [A].
    Current,
    /// A magnetic flux density [T].
    FluxDensity,
    /// An angle [rad].
    Angle,
    /// A duration [s].
    Duration,
    /// A squared magnetic flux density [T²].
    FluxDensitySquared,
    /// A squared magnetic flux density, integrated over a volume [T² m³].
    FluxDensityIntegral,
    /// A power [W].
    Power,
    /// An energy [J].
    Energy,
    /// A volume [m³].
    Volume,
    /// A mass [kg].
    Mass,
}

/// A unit: `value [SI] = number · factor · 10^exponent`.
pub(super) struct Unit {
    pub(super) name: &'static str,
    pub(super) dimension: Dimension,
    pub(super) factor: f64,
    pub(super) exponent: i32,
}

const fn decimal(name: &'static str, dimension: Dimension, exponent: i32) -> Unit {
    Unit { name, dimension, factor: 1.0, exponent }
}

const fn scaled(name: &'static str, dimension: Dimension, factor: f64) -> Unit {
    Unit { name, dimension, factor, exponent: 0 }
}

/// Every unit that is understood. A unit that may be written in two ways stands twice.
pub(super) const UNITS: &[Unit] = &[
    decimal("m", Length, 0),
    decimal("cm", Length, -2),
    decimal("mm", Length, -3),
    decimal("um", Length, -6),
    decimal("\u{b5}m", Length, -6),
    decimal("\u{3bc}m", Length, -6),
    scaled("in", Length, 0.0254),
    decimal("Hz", Frequency, 0),
    decimal("kHz", Frequency, 3),
    decimal("MHz", Frequency, 6),
    decimal("S/m", Conductivity, 0),
    decimal("MS/m", Conductivity, 6),
    decimal("kg/m3", MassDensity, 0),
    decimal("kg/m\u{b3}", MassDensity, 0),
    decimal("g/cm3", MassDensity, 3),
    decimal("g/cm\u{b3}", MassDensity, 3),
    decimal("A", Current, 0),
    decimal("kA", Current, 3),
    decimal("AT", Current, 0),
    decimal("kAT", Current, 3),
    decimal("T", FluxDensity, 0),
    decimal("mT", FluxDensity, -3),
    decimal("G", FluxDensity, -4),
    scaled("deg", Angle, std::f64::consts::PI / 180.0),
    decimal("rad", Angle, 0),
    decimal("s", Duration, 0),
    decimal("ms", Duration, -3),
    scaled("min", Duration, 60.0),
    scaled("h", Duration, 3600.0),
    decimal("T2", FluxDensitySquared, 0),
    decimal("T\u{b2}", FluxDensitySquared, 0),
    decimal("mT2", FluxDensitySquared, -6),
    decimal("mT\u{b2}", FluxDensitySquared, -6),
    decimal("T2 m3", FluxDensityIntegral, 0),
    decimal("T\u{b2} m\u{b3}", FluxDensityIntegral, 0),
    decimal("W", Power, 0),
    decimal("mW", Power, -3),
    decimal("kW", Power, 3),
    decimal("J", Energy, 0),
    decimal("mJ", Energy, -3),
    decimal("kJ", Energy, 3),
    decimal("m3", Volume, 0),
    decimal("m\u{b3}", Volume, 0),
    decimal("l", Volume, -3),
    decimal("cm3", Volume, -6),
    decimal("cm\u{b3}", Volume, -6),
    decimal("mm3", Volume, -9),
    decimal("mm\u{b3}", Volume, -9),
    decimal("kg", Mass, 0),
    decimal("g", Mass, -3),
    decimal("t", Mass, 3),
];

impl Dimension {
    /// The name of the dimension with its article, for messages.
    pub fn name(self) -> &'static str {
        match self {
            Length => "a length",
            Frequency => "a frequency",
            Conductivity => "a conductivity",
            MassDensity => "a mass density",
            Current => "a current",
            FluxDensity => "a flux density",
            Angle => "an angle",
            Duration => "a duration",
            FluxDensitySquared => "a squared flux density",
            FluxDensityIntegral => "an integral of a squared flux density",
            Power => "a power",
            Energy => "an energy",
            Volume => "a volume",
            Mass => "a mass",
        }
    }

    /// The name of the dimension without its article.
    pub(crate) fn noun(self) -> &'static str {
        self.name().split_once(' ').map_or(self.name(), |(_, noun)| noun)
    }

    /// The SI unit in which the value is held.
    pub fn si_unit(self) -> &'static str {
        match self {
            Length => "m",
            Frequency => "Hz",
            Conductivity => "S/m",
            MassDensity => "kg/m\u{b3}",
            Current => "A",
            FluxDensity => "T",
            Angle => "rad",
            Duration => "s",
            FluxDensitySquared => "T\u{b2}",
            FluxDensityIntegral => "T\u{b2} m\u{b3}",
            Power => "W",
            Energy => "J",
            Volume => "m\u{b3}",
            Mass => "kg",
        }
    }

    /// A text that would be accepted, for messages.
    pub fn example(self) -> &'static str {
        match self {
            Length => "10 mm",
            Frequency => "60 Hz",
            Conductivity => "7e6 S/m",
            MassDensity => "7850 kg/m3",
            Current => "40 kA",
            FluxDensity => "5 mT",
            Angle => "30 deg",
            Duration => "10 min",
            FluxDensitySquared => "4 mT2",
            FluxDensityIntegral => "1e-9 T2 m3",
            Power => "20 W",
            Energy => "1.5 J",
            Volume => "400 cm3",
            Mass => "2.5 kg",
        }
    }

    /// All of them.
    pub const ALL: [Self; 14] = [
        Length,
        Frequency,
        Conductivity,
        MassDensity,
        Current,
        FluxDensity,
        Angle,
        Duration,
        FluxDensitySquared,
        FluxDensityIntegral,
        Power,
        Energy,
        Volume,
        Mass,
    ];

    /// The accepted units.
    pub(crate) fn units(self) -> impl Iterator<Item = &'static str> {
        UNITS.iter().filter(move |unit| unit.dimension == self).map(|unit| unit.name)
    }

    /// The accepted units in one line, for messages.
    pub fn accepted_units(self) -> String {
        self.units().collect::<Vec<_>>().join(", ")
    }
}
