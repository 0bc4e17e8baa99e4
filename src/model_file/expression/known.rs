//! Known dimensions of names and expressions.

use crate::model_file::unit::Dimension;

/// A dimension that is known.
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
