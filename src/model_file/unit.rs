//! Units of numbers in model files: `120 mm`, `30 deg`, `1.5 kN*m/rad`.
//!
//! A unit is a factor to the SI unit and a dimension. Angles have a dimension of their own, but formulas need not account for it: a length times
//! an angle is a length. So have cycles: 5 Hz and 5 rad/s are never converted into each other, since an angle is not a number of cycles.

use crate::Readable;
use std::fmt;
use std::ops::Range;

/// Exponents of length, mass, time, angle and cycles, in twelfths: square and cubic roots of units are exact.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Dimension {
    exponents: [i16; 5],
}

/// Parts of an exponent.
const WHOLE: i16 = 12;
/// Largest absolute exponent.
const MOST: i16 = 40 * WHOLE;
/// Units of the first exponents; cycles have none.
const BASES: [&str; 4] = ["m", "kg", "s", "rad"];

impl Dimension {
    /// That of a number.
    pub const NUMBER: Self = Self::of([0; 5]);

    /// The dimension of a time.
    pub const TIME: Self = Self::of([0, 0, 1, 0, 0]);

    const fn of([length, mass, time, angle, cycles]: [i16; 5]) -> Self {
        Self { exponents: [WHOLE * length, WHOLE * mass, WHOLE * time, WHOLE * angle, WHOLE * cycles] }
    }

    /// The dimension of a product: of `self` and the `power` of another one. `None` if an exponent is not a multiple of 1/12, or too large.
    pub fn times(self, other: Self, power: f64) -> Option<Self> {
        let mut exponents = self.exponents;
        for (own, other) in exponents.iter_mut().zip(other.exponents) {
            let exact = f64::from(*own) + f64::from(other) * power;
            if exact.fract() != 0.0 || exact.abs() > f64::from(MOST) {
                return None;
            }
            *own = exact as i16;
        }
        Some(Self { exponents })
    }

    /// The dimension without the exponents of angles and cycles.
    fn without_turns(self) -> Self {
        let [length, mass, time, ..] = self.exponents;
        Self { exponents: [length, mass, time, 0, 0] }
    }

    /// Returns `true` if both are the same up to angles and cycles.
    pub fn is_like(self, other: Self) -> bool {
        self.without_turns() == other.without_turns()
    }

    /// Returns `true` for cycles, a frequency and its rates of change: those of a rotation are 2π times as large in radians.
    pub fn counts_cycles(self) -> bool {
        let [length, mass, _, angle, cycles] = self.exponents;
        (length, mass, angle) == (0, 0, 0) && cycles != 0
    }

    /// As [`is_like`](Self::is_like), but a number of cycles is not an angle, and a frequency is not an angular velocity.
    pub fn fits(self, other: Self) -> bool {
        let is_mixed = |one: Self, other: Self| one.counts_cycles() && other.exponents[3] != 0;
        self.is_like(other) && !is_mixed(self, other) && !is_mixed(other, self)
    }

    /// Returns `true` if this is that of an angle.
    pub fn is_angle(self) -> bool {
        self == Self::of([0, 0, 0, 1, 0])
    }

    /// Returns `true` if this is that of a number or an angle.
    pub fn is_number(self) -> bool {
        self.is_like(Self::NUMBER)
    }

    /// As [`fits`](Self::fits), but 1/s is not rad/s either: what is written may be revolutions per second.
    pub fn is_written_like(self, other: Self) -> bool {
        let is_rate = self.without_turns() == Self::of([0, 0, -1, 0, 0]);
        self.fits(other) && (!is_rate || self.exponents[3] == other.exponents[3])
    }
}

/// Names of dimensions.
const NAMES: &[(&str, &str)] = &[
    ("a number", "1"),
    ("an angle", "rad"),
    ("a length", "m"),
    ("a mass", "kg"),
    ("a time", "s"),
    ("an area", "m²"),
    ("a volume", "m³"),
    ("a speed", "m/s"),
    ("an acceleration", "m/s²"),
    ("an angular velocity", "rad/s"),
    ("a frequency", "Hz"),
    ("a number of cycles", "Hz*s"),
    ("a force", "N"),
    ("a torque", "N·m"),
    ("a pressure", "Pa"),
    ("a power", "W"),
    ("a moment of inertia", "kg·m²"),
];

impl fmt::Display for Dimension {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let is_it = |unit: &str| Unit::parse(unit).is_some_and(|unit| unit.dimension == *self);
        if let Some((name, _)) = NAMES.iter().find(|(_, unit)| is_it(unit)) {
            return f.write_str(name);
        }
        write!(f, "a value in {}", self.base_units())
    }
}

impl Dimension {
    /// The SI unit: that with a name, or the product of base units.
    pub fn si_unit(self) -> String {
        let is_it = |unit: &&str| Unit::parse(unit).is_some_and(|unit| unit.dimension == self);
        if self.exponents[..BASES.len()] == Self::NUMBER.exponents[..BASES.len()] {
            return String::new();
        }
        let named = NAMES.iter().map(|(_, unit)| *unit).find(is_it);
        named.map_or_else(|| self.base_units(), str::to_owned)
    }

    /// The SI unit, as a product of base units.
    pub fn base_units(self) -> String {
        let power = |exponent: i16| match (exponent / WHOLE, exponent % WHOLE) {
            (1, 0) => String::new(),
            (n @ 2..=9, 0) => superscript(n as u8).to_string(),
            _ => format!("^{}", f64::from(exponent) / f64::from(WHOLE)),
        };
        let product = |sign: i16| {
            let factors = BASES.iter().zip(self.exponents).filter(|(_, exponent)| exponent.signum() == sign);
            factors.map(|(base, exponent)| format!("{base}{}", power(exponent.abs()))).collect::<Vec<_>>()
        };
        let (above, below) = (product(1), product(-1));
        let above = if above.is_empty() { "1".to_owned() } else { above.join("·") };
        below.into_iter().fold(above, |all, factor| format!("{all}/{factor}"))
    }
}

/// A dimension that is known: firm if it comes from a unit in the file, and loose if it comes from a measure or the time. Two loose
/// dimensions never contradict each other.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct KnownDimension {
    /// Exponents of the base units.
    pub dimension: Dimension,
    /// `true` if a unit in the file says so.
    pub is_firm: bool,
}

impl KnownDimension {
    /// The dimension of a unit in the file.
    pub fn firm(dimension: Dimension) -> Option<Self> {
        Some(Self { dimension, is_firm: true })
    }

    /// The dimension of a measure or of the time.
    pub fn loose(dimension: Dimension) -> Option<Self> {
        Some(Self { dimension, is_firm: false })
    }

    /// Returns `true` for a loose dimension of a number: no unit in the file says that it is a number.
    pub fn is_plain_number(self) -> bool {
        !self.is_firm && self.dimension == Dimension::NUMBER
    }

    /// Returns `true` if two quantities can be neither added nor compared.
    pub fn contradicts(self, other: Self) -> bool {
        let is_plain = |known: Self| !known.is_firm && known.dimension.is_number();
        (self.is_firm || other.is_firm) && !(is_plain(self) || is_plain(other) || self.dimension.fits(other.dimension))
    }
}

fn superscript(digit: u8) -> char {
    SUPERSCRIPTS.chars().nth(usize::from(digit)).unwrap_or('⁰')
}

const SUPERSCRIPTS: &str = "⁰¹²³⁴⁵⁶⁷⁸⁹";

/// A unit as the user wrote it.
#[derive(Clone, Debug, PartialEq)]
pub struct Unit {
    /// The unit in the form of reports: `kN·m/rad`, `m/s²`.
    pub text: String,
    /// The value in SI units is the number times the first of these, divided by the second: both are exact where they can be.
    factor: [f64; 2],
    /// Exponents of the base units.
    pub dimension: Dimension,
}

/// Symbols, factors to the SI unit, and exponents of length, mass, time, angle and cycles.
const UNITS: &[(&str, [f64; 2], [i16; 5])] = &[
    ("m", [1.0, 1.0], [1, 0, 0, 0, 0]),
    ("g", [1.0, 1e3], [0, 1, 0, 0, 0]),
    ("s", [1.0, 1.0], [0, 0, 1, 0, 0]),
    ("rad", [1.0, 1.0], [0, 0, 0, 1, 0]),
    ("N", [1.0, 1.0], [1, 1, -2, 0, 0]),
    ("Pa", [1.0, 1.0], [-1, 1, -2, 0, 0]),
    ("J", [1.0, 1.0], [2, 1, -2, 0, 0]),
    ("W", [1.0, 1.0], [2, 1, -3, 0, 0]),
    ("Hz", [1.0, 1.0], [0, 0, -1, 0, 1]),
    ("bar", [1e5, 1.0], [-1, 1, -2, 0, 0]),
    ("1", [1.0, 1.0], [0, 0, 0, 0, 0]),
    ("%", [1.0, 100.0], [0, 0, 0, 0, 0]),
    ("deg", [std::f64::consts::PI, 180.0], [0, 0, 0, 1, 0]),
    ("°", [std::f64::consts::PI, 180.0], [0, 0, 0, 1, 0]),
    ("rev", [2.0 * std::f64::consts::PI, 1.0], [0, 0, 0, 1, 0]),
    ("rpm", [std::f64::consts::PI, 30.0], [0, 0, -1, 1, 0]),
    ("min", [60.0, 1.0], [0, 0, 1, 0, 0]),
    ("h", [3600.0, 1.0], [0, 0, 1, 0, 0]),
    ("t", [1e3, 1.0], [0, 1, 0, 0, 0]),
    ("in", [254.0, 1e4], [1, 0, 0, 0, 0]),
    ("ft", [3048.0, 1e4], [1, 0, 0, 0, 0]),
    ("lb", [0.453_592_37, 1.0], [0, 1, 0, 0, 0]),
    ("lbf", [4.448_221_615_260_5, 1.0], [1, 1, -2, 0, 0]),
    ("psi", [6_894.757_293_168_361, 1.0], [-1, 1, -2, 0, 0]),
];

/// Number of units at the start of [`UNITS`] that take prefixes.
const WITH_PREFIX: usize = 10;
const PREFIXES: &[(&str, [f64; 2])] = &[
    ("", [1.0, 1.0]),
    ("n", [1.0, 1e9]),
    ("µ", [1.0, 1e6]),
    ("μ", [1.0, 1e6]),
    ("u", [1.0, 1e6]),
    ("m", [1.0, 1e3]),
    ("c", [1.0, 1e2]),
    ("d", [1.0, 1e1]),
    ("k", [1e3, 1.0]),
    ("M", [1e6, 1.0]),
    ("G", [1e9, 1.0]),
];

/// The unit of a symbol, with a prefix or without.
fn symbol(text: &str) -> Option<([f64; 2], Dimension)> {
    let whole = UNITS.iter().find(|(known, ..)| *known == text);
    let prefixed = || {
        let of = |(prefix, factor): &(&str, [f64; 2])| {
            let rest = text.strip_prefix(prefix)?;
            let (_, own, exponents) = UNITS[..WITH_PREFIX].iter().find(|(known, ..)| *known == rest)?;
            Some(([own[0] * factor[0], own[1] * factor[1]], *exponents))
        };
        PREFIXES.iter().find_map(of)
    };
    let (factor, exponents) = whole.map(|(_, factor, exponents)| (*factor, *exponents)).or_else(prefixed)?;
    // kg is 10³ of 1/10³.
    let common = factor[0].min(factor[1]);
    let factor = if common > 1.0 { factor.map(|f| f / common) } else { factor };
    Some((factor, Dimension::of(exponents)))
}

/// A symbol with an exponent at the start of a text, and its length.
struct UnitFactor {
    symbol: Range<usize>,
    factor: [f64; 2],
    dimension: Dimension,
    power: f64,
    length: usize,
}

fn factor(text: &str) -> Option<UnitFactor> {
    let is_letter = |c: char| c.is_alphabetic() || matches!(c, '°' | '%' | '_');
    let end = match text.starts_with('1') {
        true => 1,
        false => text.find(|c: char| !is_letter(c)).unwrap_or(text.len()),
    };
    let (own, dimension) = symbol(&text[..end])?;
    let rest = &text[end..];
    let raised = rest.chars().next().and_then(|c| SUPERSCRIPTS.chars().position(|known| known == c));
    let (power, length) = if let Some(power) = raised {
        (power as f64, end + rest.chars().next().map_or(0, char::len_utf8))
    } else if let Some(number) = rest.strip_prefix('^') {
        let digits = number.strip_prefix('-').unwrap_or(number);
        let count = digits.find(|c: char| !(c.is_ascii_digit() || c == '.')).unwrap_or(digits.len());
        let count = count + (number.len() - digits.len());
        (number[..count].parse().ok()?, end + 1 + count)
    } else {
        (1.0, end)
    };
    let follows = text[length..].chars().next();
    let is_longer = follows.is_some_and(|c| c.is_alphanumeric() || c == '_' || c == '.');
    let is_call = text[length..].trim_start().starts_with('(');
    (!is_longer && !is_call).then_some(UnitFactor { symbol: 0..end, factor: own, dimension, power, length })
}

impl Unit {
    /// The unit with which a text begins, and its length.
    pub fn at_start(text: &str) -> Option<(Self, usize)> {
        let mut all = Self { text: String::new(), factor: [1.0, 1.0], dimension: Dimension::NUMBER };
        let (mut at, mut sign) = (0, 1.0);
        loop {
            let next = factor(&text[at..]).and_then(|next| {
                let dimension = all.dimension.times(next.dimension, sign * next.power)?;
                Some((next, dimension))
            });
            // A name that is not a unit begins the next operand.
            let Some((next, dimension)) = next else { break };
            let powers = next.factor.map(|f| f.powf(next.power));
            let [above, below] = if sign > 0.0 { powers } else { [powers[1], powers[0]] };
            if !all.text.is_empty() {
                all.text.push(if sign > 0.0 { '·' } else { '/' });
            }
            all.text += &text[at..][next.symbol.clone()];
            match next.power {
                1.0 => {}
                n if n.fract() == 0.0 && (2.0..=9.0).contains(&n) => all.text.push(superscript(n as u8)),
                n => all.text += &format!("^{n}"),
            }
            all.factor = [all.factor[0] * above, all.factor[1] * below];
            all.dimension = dimension;
            let end = at + next.length;
            let rest = text[end..].trim_start();
            let follows = rest.chars().next().filter(|c| matches!(c, '*' | '·' | '/'));
            let Some(operator) = follows else { return Some((all, end)) };
            let behind = rest[operator.len_utf8()..].trim_start();
            if factor(behind).is_none() || behind.starts_with('1') {
                return Some((all, end));
            }
            sign = if operator == '/' { -1.0 } else { 1.0 };
            at = text.len() - behind.len();
        }
        None
    }

    /// The unit of a whole text.
    pub fn parse(text: &str) -> Option<Self> {
        Self::at_start(text.trim()).filter(|(_, length)| *length == text.trim().len()).map(|(unit, _)| unit)
    }

    /// Converts a number of this unit to SI.
    pub fn to_si(&self, number: f64) -> f64 {
        number * self.factor[0] / self.factor[1]
    }

    /// Converts a value in SI to a number of this unit.
    pub fn of_si(&self, value: f64) -> f64 {
        value * self.factor[1] / self.factor[0]
    }

    /// A number of a unit as TOML that reads back with the same bits: a text with the unit, or without one the plain number.
    pub fn written(unit: Option<&Self>, number: f64) -> String {
        let number = Readable(number);
        unit.map_or_else(|| number.to_string(), |unit| format!("\"{number} {}\"", unit.text))
    }

    /// The factors by which a number of this unit is multiplied and divided for its value in SI.
    pub fn factors(&self) -> [f64; 2] {
        self.factor
    }

    /// Symbols after the first one, such as `m` in `N·m/s²`.
    pub fn later_symbols(&self) -> impl Iterator<Item = &str> {
        let is_end = |c: char| SUPERSCRIPTS.contains(c) || c == '^';
        self.text.split(['·', '/']).skip(1).map(move |factor| factor.split(is_end).next().unwrap_or(""))
    }

    /// The unit without its text, whose symbols cannot be taken for names of a file.
    #[must_use]
    pub fn unnamed(&self) -> Self {
        Self { text: String::new(), ..self.clone() }
    }

    /// Symbols of units of a dimension, for suggestions.
    pub fn symbols(dimension: Dimension) -> Vec<&'static str> {
        let usual = [
            "mm", "cm", "m", "in", "ft", "g", "kg", "t", "lb", "ms", "s", "min", "rad", "deg", "rpm", "Hz", "N", "kN",
            "MPa", "W", "kW",
        ];
        usual.into_iter().filter(|text| symbol(text).is_some_and(|(_, own)| own == dimension)).collect()
    }

    /// All symbols without prefixes, and the most common ones with prefixes, for suggestions.
    pub fn known() -> impl Iterator<Item = &'static str> {
        let usual = ["mm", "cm", "km", "kg", "ms", "kN", "MN", "kPa", "MPa", "GPa", "kJ", "mJ", "kW", "kHz", "mrad"];
        UNITS.iter().map(|(known, ..)| *known).filter(|known| *known != "1").chain(usual)
    }
}

/// The units that a key or an operand takes, from a text such as "N/m or N·m/rad".
pub fn alternatives(units: &str) -> Vec<Unit> {
    units.split(" or ").filter_map(Unit::parse).collect()
}
