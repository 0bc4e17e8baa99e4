//! The independent variable of histories: the time, or the quantity of a sweep.

use crate::model_file::unit::{KnownDimension, Unit};

/// The time under the name `time`, or another quantity, such as a travel, with a name of the file.
#[derive(Clone, Debug, Default)]
pub struct Axis {
    sweep: Option<(String, Option<KnownDimension>)>,
}

impl Axis {
    /// The quantity of a sweep, with its dimension if that is known.
    pub fn of_sweep(name: String, known: Option<KnownDimension>) -> Self {
        Self { sweep: Some((name, known)) }
    }

    /// Its name in expressions.
    pub fn name(&self) -> &str {
        self.sweep().unwrap_or("time")
    }

    /// The name of the quantity of a sweep; `None` for the time.
    pub fn sweep(&self) -> Option<&str> {
        self.sweep.as_ref().map(|(name, _)| name.as_str())
    }

    /// Its dimension, if it is known.
    pub fn known(&self) -> Option<KnownDimension> {
        match &self.sweep {
            Some((_, known)) => *known,
            None => Unit::parse("s").and_then(|unit| KnownDimension::loose(unit.dimension)),
        }
    }

    /// The units of its values, as for a key; empty for any unit.
    pub fn units(&self) -> String {
        self.known().map_or_else(String::new, |known| known.dimension.base_units())
    }
}
