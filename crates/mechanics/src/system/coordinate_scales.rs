//! Units in which changes of different coordinates are compared.

use crate::mechanism::{CoordinateData, Mechanism};
use crate::system::Unknown;

/// For each coordinate, the change that counts as 1: of positions of bodies the extent of the mechanism if that is larger than 1 m, else 1 m; of
/// other coordinates 1 m or rad.
///
/// Limits and tolerances in these units hold for mechanisms of any size.
pub(crate) struct CoordinateScales {
    by_coordinate: Vec<f64>,
    length: f64,
}

impl CoordinateScales {
    /// Scales of `mechanism` at the positions `q`.
    pub fn at(mechanism: &Mechanism<f64>, q: &[f64]) -> Self {
        let length = mechanism.extent(q).max(1.0);
        let scale = |coordinate: &CoordinateData<f64>| coordinate.axis.map_or(1.0, |_| length);
        Self { by_coordinate: mechanism.coordinates.iter().map(scale).collect(), length }
    }

    /// The change of a position of a body that counts as 1, in m.
    pub fn length(&self) -> f64 {
        self.length
    }

    /// Rounding error of the positions `q`.
    pub fn rounding(&self, q: &[f64]) -> f64 {
        let largest = q.iter().zip(&self.by_coordinate).fold(0.0f64, |most, (q, scale)| most.max((q / scale).abs()));
        4.0 * f64::EPSILON * largest
    }

    /// The change of coordinate number `i` that counts as 1.
    pub fn of(&self, i: usize) -> f64 {
        self.by_coordinate[i]
    }

    /// The scale of an unknown; `None` for multipliers.
    pub fn of_unknown(&self, unknown: &Unknown) -> Option<f64> {
        match *unknown {
            Unknown::Coordinate(i) => Some(self.of(i)),
            Unknown::Multiplier(_) => None,
        }
    }

    /// Largest of the changes `rows` of the unknowns that are coordinates; NaN if one of them is NaN.
    pub fn largest(&self, unknowns: &[Unknown], rows: &[f64]) -> f64 {
        let changes = unknowns.iter().zip(rows).filter_map(|(u, row)| Some(row.abs() / self.of_unknown(u)?));
        // `f64::max` ignores NaN.
        changes.fold(0.0, |a, b| if b > a || b.is_nan() { b } else { a })
    }

    /// Largest difference of a coordinate between the positions `a` and `b`.
    pub fn distance(&self, a: &[f64], b: &[f64]) -> f64 {
        let differences = a.iter().zip(b).zip(&self.by_coordinate).map(|((a, b), scale)| (a - b).abs() / scale);
        differences.fold(0.0, f64::max)
    }
}
