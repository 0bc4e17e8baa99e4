//! Axes: quantity, scale and limits.

use super::grid::range;
use super::markup::literal;
use super::ticks::Ticks;

/// Scale of an axis.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Scale {
    /// Equal differences have equal lengths.
    Linear,
    /// Equal ratios have equal lengths; only positive numbers are shown.
    Logarithmic,
}

impl Scale {
    pub(crate) fn position(self, value: f64) -> f64 {
        match self {
            Self::Linear => value,
            Self::Logarithmic => value.log10(),
        }
    }

    /// The value at a `part` of the length from one value to another, both of which are shown.
    pub(crate) fn between(self, [from, to]: [f64; 2], part: f64) -> f64 {
        match self {
            Self::Linear => from + (to - from) * part,
            Self::Logarithmic => from * (to / from).powf(part),
        }
    }

    pub(crate) fn shows(self, value: f64) -> bool {
        value.is_finite() && (self == Self::Linear || value > 0.0)
    }
}

/// Name and unit of a quantity, both in the markup of labels (`*b*_1`, `N/m^2`).
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct QuantityLabel {
    /// Its name.
    pub name: String,
    /// Its unit; may be empty.
    pub unit: String,
}

impl QuantityLabel {
    /// A quantity with a unit; the unit may be empty.
    pub fn new(name: impl Into<String>, unit: impl Into<String>) -> Self {
        Self { name: name.into(), unit: unit.into() }
    }

    /// A quantity whose name and unit are shown literally, without markup.
    pub fn literal(name: &str, unit: &str) -> Self {
        Self::new(literal(name), literal(unit))
    }

    /// `name [10^n unit]`.
    pub(crate) fn label(&self, exponent: i32) -> String {
        let factor = if exponent == 0 { String::new() } else { format!("10^{{{exponent}}}") };
        match (factor.as_str(), self.unit.as_str()) {
            ("", "") => self.name.clone(),
            (factor, "") => format!("{} [{factor}]", self.name),
            ("", unit) => format!("{} [{unit}]", self.name),
            (factor, unit) => format!("{} [{factor} {unit}]", self.name),
        }
    }
}

/// One axis of a panel.
#[derive(Clone, Debug)]
pub struct PlotAxis {
    /// The quantity along the axis.
    pub quantity: QuantityLabel,
    /// Its scale.
    pub scale: Scale,
    /// First and last value; `None` for those of the data with a margin.
    pub limits: Option<[f64; 2]>,
    /// `true` if it has numbers and a label.
    pub labelled: bool,
    /// `true` if ticks are at whole numbers only, as for cycles.
    pub whole: bool,
}

impl PlotAxis {
    /// A linear axis with limits from the data.
    pub fn new(name: impl Into<String>, unit: impl Into<String>) -> Self {
        Self::of(&QuantityLabel::new(name, unit))
    }

    /// A linear axis with limits from the data.
    pub fn of(quantity: &QuantityLabel) -> Self {
        Self { quantity: quantity.clone(), scale: Scale::Linear, limits: None, labelled: true, whole: false }
    }

    /// Sets a logarithmic scale.
    pub fn logarithmic(self) -> Self {
        Self { scale: Scale::Logarithmic, ..self }
    }

    /// Sets the limits.
    pub fn limits(self, low: f64, high: f64) -> Self {
        Self { limits: Some([low, high]), ..self }
    }

    /// Restricts ticks to whole numbers.
    pub fn whole(self) -> Self {
        Self { whole: true, ..self }
    }

    /// Removes numbers and label, for a panel that shares the axis of the panel below.
    pub fn unlabelled(self) -> Self {
        Self { labelled: false, ..self }
    }

    /// The given limits, or those of the data with a margin relative to their range.
    pub(crate) fn span(&self, values: impl Iterator<Item = f64>, margin: f64) -> [f64; 2] {
        if let Some(limits) = self.limits {
            return limits;
        }
        let shown = values.filter(|&v| self.scale.shows(v)).map(|v| self.scale.position(v));
        let [low, high] = range(shown);
        let (low, high) = if low > high { (0.0, 1.0) } else { (low, high) };
        let margin = match high - low {
            width if width > 1e-12 * low.abs().max(high.abs()) => margin * width,
            _ if low == 0.0 || self.scale == Scale::Logarithmic => 1.0,
            _ => 0.1 * low.abs(),
        };
        match self.scale {
            // The differences of limits must stay finite, and so must the powers.
            Scale::Linear => [(low - margin).max(-1e307), (high + margin).min(1e307)],
            Scale::Logarithmic => [low - margin, high + margin].map(|v| 10f64.powf(v.clamp(-307.0, 307.0))),
        }
    }

    pub(crate) fn ticks(&self, [low, high]: [f64; 2], count: usize) -> Ticks {
        match self.scale {
            Scale::Linear if self.whole => {
                let ticks = Ticks::linear(low, high, count.min((high - low).floor().max(1.0) as usize));
                let minor = ticks.minor.into_iter().filter(|v| (v - v.round()).abs() < 1e-6).collect();
                Ticks { minor, ..ticks }
            }
            Scale::Linear => Ticks::linear(low, high, count),
            Scale::Logarithmic => Ticks::logarithmic(low, high, count),
        }
    }

    pub(crate) fn label(&self, ticks: &Ticks) -> String {
        self.quantity.label(ticks.exponent)
    }
}
