//! Physical quantities as people write them: a number in SI units, or a string with a unit.
//!
//! A unit may carry one SI prefix (`p n u m k M G`, and `µ` for `u`); `·`, `*` and `.` multiply alike, `²`, `^2` and
//! `2` square alike, and a dot may be left out as data sheets do (`mNm/A`, `gcm²`). Decimal prefixes are applied to the
//! text, so `"25.175 MHz"` is exactly 25 175 000.

use std::f64::consts::PI;

use crate::text::message::number;

/// Standard acceleration by gravity, by the General Conference on Weights and Measures of 1901: the default of scenes.
pub(crate) const STANDARD_GRAVITY_M_PER_S2: f64 = 9.80665;

/// A physical dimension, the sizes it may have, and the units it may be written in.
pub(crate) struct Dimension {
    /// The quantity's name in messages, with its article.
    pub name: &'static str,
    /// Its SI unit, the unit of a plain number.
    pub si: &'static str,
    /// The least size above 0 of a quantity that has no sign.
    pub least: f64,
    /// The greatest size.
    pub most: f64,
    units: &'static [Unit],
}

/// A unit: `symbol` stands for `factor` * 10^`exponent` SI units, and takes prefixes if `prefixed` is set.
struct Unit {
    symbol: &'static str,
    factor: f64,
    exponent: i32,
    prefixed: bool,
}

/// Returns an SI unit that takes prefixes.
const fn si(symbol: &'static str) -> Unit {
    Unit { symbol, factor: 1.0, exponent: 0, prefixed: true }
}

/// Returns a unit without prefixes.
const fn unit(symbol: &'static str, factor: f64, exponent: i32) -> Unit {
    Unit { symbol, factor, exponent, prefixed: false }
}

macro_rules! dimensions {
    ($($dimension:ident = $name:literal, $si:literal, $least:literal to $most:literal, [$($unit:expr),*];)*) => {
        $(pub(crate) static $dimension: Dimension =
            Dimension { name: $name, si: $si, least: $least, most: $most, units: &[$($unit),*] };)*
        #[cfg(test)]
        pub(crate) static ALL: &[&Dimension] = &[$(&$dimension),*];
    };
}

// The bounds of a scene's quantities. Published devices are orders of magnitude away from either end. Between the ends
// everything computed from them stays finite and is resolved: a count of the finest encoder at the farthest place
// (`Scene::counts`), a time constant within a clock edge, a speed after the longest run.
dimensions! {
    TIME = "a time", "s", 1e-12 to 1e9, [si("s"), unit("min", 60.0, 0)];
    FREQUENCY = "a frequency", "Hz", 1e-6 to 1e10, [si("Hz")];
    ANGLE = "an angle", "rad", 1e-12 to 1e6, [si("rad"), unit("deg", PI / 180.0, 0), unit("rev", 2.0 * PI, 0)];
    ANGULAR_SPEED = "an angular speed", "rad/s", 1e-9 to 1e5,
        [si("rad/s"), unit("deg/s", PI / 180.0, 0), unit("rpm", PI / 30.0, 0), unit("rev/s", 2.0 * PI, 0)];
    ANGULAR_ACCELERATION = "an angular acceleration", "rad/s2", 1e-6 to 1e9,
        [si("rad/s2"), unit("deg/s2", PI / 180.0, 0)];
    TORQUE = "a torque", "N.m", 1e-12 to 1e4, [si("N.m")];
    TORSIONAL_STIFFNESS = "a torsional stiffness", "N.m/rad", 1e-12 to 1e6,
        [si("N.m/rad"), unit("N.m/deg", 180.0 / PI, 0)];
    TORSIONAL_DAMPING = "a torsional damping", "N.m.s/rad", 1e-15 to 1e3,
        [si("N.m.s/rad"), unit("N.m.s/deg", 180.0 / PI, 0)];
    TORSIONAL_INTEGRAL = "a torsional stiffness per time", "N.m/rad/s", 1e-12 to 1e9, [si("N.m/rad/s")];
    INERTIA = "a moment of inertia", "kg.m2", 1e-12 to 1e3,
        [unit("kg.m2", 1.0, 0), unit("g.m2", 1.0, -3), unit("g.cm2", 1.0, -7)];
    VOLTAGE = "a voltage", "V", 1e-6 to 1e5, [si("V")];
    CURRENT = "a current", "A", 1e-9 to 1e5, [si("A")];
    RESISTANCE = "a resistance", "Ohm", 1e-6 to 1e6, [si("Ohm"), si("ohm")];
    FLUX = "a flux linkage", "Wb", 1e-9 to 1e3, [si("Wb"), si("V.s")];
    CURRENT_GAIN = "a gain of a current", "V/A", 1e-6 to 1e6, [si("V/A"), si("Ohm")];
    INDUCTANCE = "an inductance", "H", 1e-9 to 1e3, [si("H")];
    TORQUE_CONSTANT = "a torque constant", "N.m/A", 1e-6 to 1e3, [si("N.m/A"), si("V.s/rad"), si("V.s")];
    FORCE_CONSTANT = "a force constant", "N/A", 1e-6 to 1e6, [si("N/A"), si("V.s/m")];
    LENGTH = "a length", "m", 1e-12 to 1e4, [si("m"), unit("cm", 1.0, -2)];
    AREA = "an area", "m2", 1e-12 to 1e6,
        [unit("m2", 1.0, 0), unit("cm2", 1.0, -4), unit("mm2", 1.0, -6)];
    SPEED = "a speed", "m/s", 1e-9 to 1e4, [si("m/s")];
    ACCELERATION = "an acceleration", "m/s2", 1e-6 to 1e9, [si("m/s2")];
    FORCE = "a force", "N", 1e-9 to 1e6, [si("N")];
    STIFFNESS = "a stiffness", "N/m", 1e-6 to 1e9, [si("N/m"), unit("N/mm", 1.0, 3)];
    DAMPING = "a damping", "N.s/m", 1e-9 to 1e6, [si("N.s/m")];
    INTEGRAL = "a stiffness per time", "N/m/s", 1e-6 to 1e12, [si("N/m/s")];
    MASS = "a mass", "kg", 1e-6 to 1e6, [unit("kg", 1.0, 0), si("g").thousandth()];
    VISCOSITY = "a viscosity", "Pa.s", 1e-9 to 1e12, [si("Pa.s")];
    ENERGY = "an energy", "J", 1e-15 to 1e9, [si("J"), si("N.m")];
    RATIO = "a plain number", "1", 1e-9 to 1e12, [unit("%", 1.0, -2)];
}

/// The dimensions of a device's motion.
pub(crate) struct Axis {
    pub position: &'static Dimension,
    pub speed: &'static Dimension,
    pub acceleration: &'static Dimension,
    pub effort: &'static Dimension,
    pub stiffness: &'static Dimension,
    pub damping: &'static Dimension,
    pub integral: &'static Dimension,
    pub effort_per_a: &'static Dimension,
}

/// Those of a motor's shaft.
pub(crate) static SHAFT: Axis = Axis {
    position: &ANGLE,
    speed: &ANGULAR_SPEED,
    acceleration: &ANGULAR_ACCELERATION,
    effort: &TORQUE,
    stiffness: &TORSIONAL_STIFFNESS,
    damping: &TORSIONAL_DAMPING,
    integral: &TORSIONAL_INTEGRAL,
    effort_per_a: &TORQUE_CONSTANT,
};

/// Those of a mass on a rail.
pub(crate) static RAIL: Axis = Axis {
    position: &LENGTH,
    speed: &SPEED,
    acceleration: &ACCELERATION,
    effort: &FORCE,
    stiffness: &STIFFNESS,
    damping: &DAMPING,
    integral: &INTEGRAL,
    effort_per_a: &FORCE_CONSTANT,
};

/// The sizes of a quantity.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Sizes {
    /// The quantity's name in messages, with its article.
    pub name: &'static str,
    /// Its SI unit; empty for a plain number.
    pub unit: &'static str,
    /// Whether 0 is accepted.
    pub zero: bool,
    /// The least value other than 0; negative where either sign is accepted.
    pub least: f64,
    /// The greatest value.
    pub most: f64,
}

/// The accepted values of a quantity. Sizes are those of the [`Dimension`], or the key's own.
#[derive(Clone, Copy)]
pub(crate) enum Sense {
    /// Either sign, and 0.
    Any,
    /// 0 and above.
    NotNegative,
    /// 0 and above, up to the key's own greatest size.
    UpTo(f64),
    /// Above 0.
    Positive,
    /// Above 0, between the key's own sizes.
    Within(f64, f64),
}

impl Sense {
    /// Returns the least size above 0, if there is one, and the greatest size.
    fn sizes(self, dimension: &Dimension) -> (Option<f64>, f64) {
        match self {
            Self::Any => (None, dimension.most),
            Self::NotNegative | Self::Positive => (Some(dimension.least), dimension.most),
            Self::UpTo(most) => (Some(dimension.least), most),
            Self::Within(least, most) => (Some(least), most),
        }
    }

    /// Returns the sizes as lists of keys show them.
    pub fn told(self, dimension: &Dimension) -> Sizes {
        let (least, most) = self.sizes(dimension);
        let zero = matches!(self, Self::Any | Self::NotNegative | Self::UpTo(_));
        Sizes { name: dimension.name, unit: dimension.si_unit(), zero, least: least.unwrap_or(-most), most }
    }

    /// Returns the reason for refusing a value, which was written as `shown`; `None` if it is accepted.
    pub fn refuses(self, dimension: &Dimension, value: f64, shown: &str) -> Option<String> {
        let rule = match self {
            Self::NotNegative | Self::UpTo(_) if value < 0.0 => "must not be negative",
            Self::Positive | Self::Within(..) if value <= 0.0 => "must be above zero",
            _ => "",
        };
        if !rule.is_empty() {
            return Some(format!("{shown} {rule}"));
        }
        let (least, most) = self.sizes(dimension);
        if value.abs() <= most && least.is_none_or(|least| value == 0.0 || value >= least) {
            return None;
        }
        let unit = dimension.si_unit();
        let [low, high] = [least.unwrap_or(-most), most].map(number);
        let zero = if matches!(self, Self::NotNegative | Self::UpTo(_)) { "0, or " } else { "" };
        let accepted = format!("{zero}{low} to {high} {unit}");
        Some(format!("{} {unit}; accepted: {}", number(value), accepted.trim_end()).replace(" ;", ";"))
    }
}

impl Unit {
    const fn thousandth(self) -> Self {
        Self { exponent: self.exponent - 3, ..self }
    }
}

const PREFIXES: [(&str, i32); 8] = [("", 0), ("p", -12), ("n", -9), ("u", -6), ("m", -3), ("k", 3), ("M", 6), ("G", 9)];

impl Dimension {
    /// Returns the value of `text` in SI units; `None` when it is not a number with one of the units, or exceeds a
    /// float's range.
    pub fn parse(&self, text: &str) -> Option<f64> {
        let text = text.trim();
        let digits = number_length(text);
        let (number, symbol) = text.split_at(digits);
        let symbol = plain(symbol.trim());
        let (mantissa, exponent) = match number.split_once(['e', 'E']) {
            Some((mantissa, exponent)) => (mantissa, exponent.parse::<i32>().ok()?),
            None => (number, 0),
        };
        let (factor, scale) = if symbol.is_empty() { (1.0, 0) } else { self.unit(&symbol)? };
        let value = format!("{mantissa}e{}", exponent.checked_add(scale)?).parse::<f64>().ok()? * factor;
        value.is_finite().then_some(value)
    }

    fn unit(&self, symbol: &str) -> Option<(f64, i32)> {
        self.units.iter().find_map(|unit| {
            let prefix = before(symbol, unit.symbol)?;
            let (_, scale) = PREFIXES.iter().find(|(p, _)| *p == prefix)?;
            (prefix.is_empty() || unit.prefixed).then_some((unit.factor, unit.exponent + scale))
        })
    }

    /// Returns the SI unit; empty for a plain number.
    pub fn si_unit(&self) -> &'static str {
        if self.si == "1" { "" } else { self.si }
    }

    /// Returns the accepted notations: "N.m/rad, mN.m/rad or a number in N.m/rad".
    pub fn accepted(&self) -> String {
        let mut symbols = Vec::new();
        for unit in self.units {
            symbols.push(unit.symbol.to_string());
            if unit.prefixed {
                let common = if unit.symbol == "Hz" { "M" } else { "m" };
                symbols.push(format!("{common}{}", unit.symbol));
            }
        }
        let number = if self.si == "1" { "a number".to_string() } else { format!("a number in {}", self.si) };
        format!("{} or {number}", symbols.join(", "))
    }
}

/// Returns the part of a symbol before a unit at its end; the symbol may leave out the unit's dots.
fn before<'s>(symbol: &'s str, unit: &str) -> Option<&'s str> {
    unit.chars().rev().try_fold(symbol, |rest, letter| match (rest.strip_suffix(letter), letter) {
        (None, '.') => Some(rest),
        (rest, _) => rest,
    })
}

/// Returns the number of bytes of the longest prefix that is a decimal number (an `e` counts when digits follow it).
fn number_length(text: &str) -> usize {
    let bytes = text.as_bytes();
    let digits = |from: usize| from + bytes[from..].iter().take_while(|b| b.is_ascii_digit()).count();
    let sign = |at: usize| at + usize::from(matches!(bytes.get(at), Some(b'+' | b'-')));
    let mut end = digits(sign(0));
    if bytes.get(end) == Some(&b'.') {
        end = digits(end + 1);
    }
    if matches!(bytes.get(end), Some(b'e' | b'E')) {
        let exponent = sign(end + 1);
        if digits(exponent) > exponent {
            end = digits(exponent);
        }
    }
    end
}

/// Returns the symbol in the spelling of the tables.
fn plain(symbol: &str) -> String {
    symbol.replace(['·', '⋅', '*'], ".").replace(['µ', 'μ'], "u").replace('²', "2").replace('^', "").replace('Ω', "Ohm")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_bounds_are_those_that_the_documentation_lists() {
        let documentation = include_str!("../lib.rs");
        for Dimension { name, si, least, most, .. } in ALL {
            let row = format!("//! | {name} | {least:e} | {most:e} | {si} |\n");
            assert!(documentation.contains(&row), "{row}");
        }
    }

    #[test]
    fn every_unit_that_a_message_offers_is_accepted() {
        for dimension in ALL {
            let accepted = dimension.accepted();
            let (symbols, _) = accepted.rsplit_once(" or ").unwrap();
            for symbol in symbols.split(", ") {
                assert!(dimension.parse(&format!("2 {symbol}")).is_some(), "{} in {symbol}", dimension.name);
            }
        }
    }

    #[test]
    fn decimal_units_are_scaled_without_rounding() {
        assert_eq!(FREQUENCY.parse("25.175 MHz"), Some(25_175_000.0));
        assert_eq!(TIME.parse("5us"), Some(5e-6));
        assert_eq!(TIME.parse("5 µs"), Some(5e-6));
        assert_eq!(INERTIA.parse("10.3 g.cm2"), Some(10.3e-7));
        assert_eq!(INERTIA.parse("10.3 g·cm²"), Some(10.3e-7));
        assert_eq!(TORQUE.parse("1.2e1 mN.m"), Some(0.012));
        assert_eq!(RESISTANCE.parse("330 mΩ"), Some(0.33));
        assert_eq!(MASS.parse("75 g"), Some(0.075));
        assert_eq!(RATIO.parse("12 %"), Some(0.12));
        assert_eq!(ANGLE.parse("-180 deg"), Some(-PI));
    }

    #[test]
    fn the_dots_of_a_product_may_be_left_out() {
        assert_eq!(TORQUE.parse("1.2 mNm"), Some(0.0012));
        assert_eq!(TORSIONAL_STIFFNESS.parse("2 Nm/rad"), Some(2.0));
        assert_eq!(TORSIONAL_DAMPING.parse("0.1 mNms/rad"), Some(1e-4));
        assert_eq!(TORSIONAL_DAMPING.parse("0.1 mNm.s/rad"), Some(1e-4));
        assert_eq!(TORQUE_CONSTANT.parse("25 mNm/A"), Some(0.025));
        assert_eq!(INERTIA.parse("10.3 gcm²"), Some(10.3e-7));
        assert_eq!(DAMPING.parse("3 Ns/m"), Some(3.0));
        // A dot is accepted only at its own place, and no unit of another dimension is accepted.
        for (dimension, text) in [(&TORQUE, "1 N..m"), (&TORQUE, "1 .Nm"), (&FORCE, "1 Nm"), (&FREQUENCY, "1 H.z")] {
            assert_eq!(dimension.parse(text), None, "{text}");
        }
        // Without its dot, no unit reads as another unit of its dimension, whatever the prefix.
        for dimension in ALL {
            for (index, unit) in dimension.units.iter().enumerate() {
                let bare = unit.symbol.replace('.', "");
                let found = dimension.unit(&bare).expect("the unit");
                assert_eq!(found, (unit.factor, unit.exponent), "{} of unit {index}", unit.symbol);
            }
        }
    }

    #[test]
    fn a_unit_of_another_dimension_a_second_prefix_and_no_number_are_refused() {
        for text in ["25 mm", "2 N.m", "2 kmN.m/rad", "N.m/rad", "", "2 2 N.m/rad", "nan", "1e999 N.m/rad", "--2", "."]
        {
            assert_eq!(TORSIONAL_STIFFNESS.parse(text), None, "{text}");
        }
        assert_eq!(INERTIA.parse("1 mkg.m2"), None);
    }
}
