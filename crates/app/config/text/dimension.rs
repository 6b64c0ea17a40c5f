//! What quantities measure, and the units that each may carry.

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

/// Declares the dimensions: name with its article, SI unit, a text that would be accepted, and every unit that is understood.
macro_rules! dimensions {
    ($(
        #[doc = $meaning:literal]
        $dimension:ident = $name:literal, in $si_unit:literal, such as $example:literal:
        $($kind:ident($unit:literal, $size:expr)),+;
    )+) => {
        /// What a quantity measures, and so which units it may carry.
        #[derive(Debug, Clone, Copy, PartialEq, Eq)]
        pub enum Dimension {
            $(#[doc = $meaning] $dimension,)+
        }

        /// Every unit that is understood. A unit that may be written in two ways stands twice.
        pub(super) const UNITS: &[Unit] = &[$($($kind($unit, Dimension::$dimension, $size)),+),+];

        impl Dimension {
            /// All of them.
            pub const ALL: [Self; [$($name),+].len()] = [$(Self::$dimension),+];

            /// The name of the dimension with its article, for messages.
            pub fn name(self) -> &'static str {
                match self { $(Self::$dimension => $name),+ }
            }

            /// The SI unit in which the value is held.
            pub fn si_unit(self) -> &'static str {
                match self { $(Self::$dimension => $si_unit),+ }
            }

            /// The SI unit as it is shown: empty of a ratio.
            pub fn shown_unit(self) -> &'static str {
                if self == Self::Ratio { "" } else { self.si_unit() }
            }

            /// What stands behind a value: a blank and the SI unit, nothing of a ratio.
            pub fn behind_value(self) -> String {
                if self == Self::Ratio { String::new() } else { format!(" {}", self.si_unit()) }
            }

            /// A text that would be accepted, for messages.
            pub fn example(self) -> &'static str {
                match self { $(Self::$dimension => $example),+ }
            }
        }
    };
}

dimensions! {
    /// A length [m].
    Length = "a length", in "m", such as "10 mm":
        decimal("m", 0), decimal("cm", -2), decimal("mm", -3), decimal("um", -6), decimal("\u{b5}m", -6),
        scaled("in", 0.0254);
    /// A frequency [Hz].
    Frequency = "a frequency", in "Hz", such as "60 Hz":
        decimal("Hz", 0), decimal("mHz", -3), decimal("kHz", 3), decimal("MHz", 6);
    /// An electric conductivity [S/m].
    Conductivity = "a conductivity", in "S/m", such as "7e6 S/m":
        decimal("S/m", 0), decimal("kS/m", 3), decimal("MS/m", 6);
    /// A mass density [kg/m³].
    MassDensity = "a mass density", in "kg/m\u{b3}", such as "7850 kg/m3":
        decimal("kg/m3", 0), decimal("kg/m\u{b3}", 0), decimal("g/cm3", 3), decimal("g/cm\u{b3}", 3),
        decimal("kg/dm3", 3), decimal("kg/l", 3), decimal("t/m3", 3);
    /// A current, or ampere-turns [A].
    Current = "a current", in "A", such as "40 kA":
        decimal("A", 0), decimal("mA", -3), decimal("kA", 3), decimal("MA", 6), decimal("AT", 0), decimal("kAT", 3);
    /// A magnetic flux density [T].
    FluxDensity = "a flux density", in "T", such as "5 mT":
        decimal("T", 0), decimal("mT", -3), decimal("uT", -6), decimal("\u{b5}T", -6),
        decimal("nT", -9), decimal("G", -4);
    /// An angle [rad].
    Angle = "an angle", in "rad", such as "30 deg":
        scaled("deg", std::f64::consts::PI / 180.0), decimal("rad", 0);
    /// A duration [s].
    Duration = "a duration", in "s", such as "10 min":
        decimal("s", 0), decimal("ms", -3), scaled("min", 60.0), scaled("h", 3600.0);
    /// A squared magnetic flux density [T²].
    FluxDensitySquared = "a squared flux density", in "T\u{b2}", such as "4 mT2":
        decimal("T2", 0), decimal("T\u{b2}", 0), decimal("mT2", -6), decimal("mT\u{b2}", -6);
    /// A squared magnetic flux density, integrated over a volume [T² m³].
    FluxDensityIntegral = "an integral of a squared flux density", in "T\u{b2} m\u{b3}", such as "1e-9 T2 m3":
        decimal("T2 m3", 0), decimal("T\u{b2} m\u{b3}", 0);
    /// A power [W].
    Power = "a power", in "W", such as "20 W":
        decimal("W", 0), decimal("uW", -6), decimal("mW", -3), decimal("kW", 3), decimal("MW", 6);
    /// An energy [J].
    Energy = "an energy", in "J", such as "1.5 J":
        decimal("J", 0), decimal("uJ", -6), decimal("mJ", -3), decimal("kJ", 3);
    /// A force [N].
    Force = "a force", in "N", such as "20 N":
        decimal("N", 0), decimal("mN", -3), decimal("kN", 3);
    /// A torque [N m].
    Torque = "a torque", in "N m", such as "1.5 N m":
        decimal("N m", 0), decimal("Nm", 0), decimal("mN m", -3), decimal("mNm", -3), decimal("kN m", 3), decimal("kNm", 3);
    /// A voltage [V].
    Voltage = "a voltage", in "V", such as "230 V":
        decimal("V", 0), decimal("mV", -3), decimal("kV", 3);
    /// A resistance [Ω].
    Resistance = "a resistance", in "\u{3a9}", such as "0.2 ohm":
        decimal("\u{3a9}", 0), decimal("ohm", 0), decimal("uohm", -6), decimal("mohm", -3), decimal("kohm", 3),
        decimal("\u{b5}\u{3a9}", -6), decimal("m\u{3a9}", -3), decimal("k\u{3a9}", 3);
    /// An inductance [H].
    Inductance = "an inductance", in "H", such as "10 uH":
        decimal("H", 0), decimal("mH", -3), decimal("uH", -6), decimal("\u{b5}H", -6), decimal("nH", -9);
    /// A capacitance [F].
    Capacitance = "a capacitance", in "F", such as "100 nF":
        decimal("F", 0), decimal("mF", -3), decimal("uF", -6), decimal("\u{b5}F", -6), decimal("nF", -9), decimal("pF", -12);
    /// A ratio of like quantities [1].
    Ratio = "a ratio", in "1", such as "5 %":
        decimal("1", 0), decimal("%", -2);
    /// A flux linkage [Wb].
    FluxLinkage = "a flux linkage", in "Wb", such as "5 mWb":
        decimal("Wb", 0), decimal("mWb", -3), decimal("uWb", -6), decimal("\u{b5}Wb", -6);
    /// A volume [m³].
    Volume = "a volume", in "m\u{b3}", such as "400 cm3":
        decimal("m3", 0), decimal("m\u{b3}", 0), decimal("l", -3), decimal("ml", -6), decimal("cm3", -6),
        decimal("cm\u{b3}", -6), decimal("mm3", -9), decimal("mm\u{b3}", -9);
    /// A mass [kg].
    Mass = "a mass", in "kg", such as "2.5 kg":
        decimal("kg", 0), decimal("g", -3), decimal("t", 3);
}

impl Dimension {
    /// The name of the dimension without its article.
    pub(crate) fn noun(self) -> &'static str {
        self.name().split_once(' ').map_or(self.name(), |(_, noun)| noun)
    }

    /// The accepted units.
    pub(crate) fn units(self) -> impl Iterator<Item = &'static str> {
        UNITS.iter().filter(move |unit| unit.dimension == self).map(|unit| unit.name)
    }

    /// The accepted units in one line, for messages.
    pub fn accepted_units(self) -> String {
        self.units().collect::<Vec<_>>().join(", ")
    }
}
