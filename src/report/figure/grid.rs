//! Values of a function on a rectangular grid, for contours and fields.

use crate::{Error, Result};

/// Values on a rectangular grid: `values[j * x.len() + i]` at `(x[i], y[j])`. NaN marks a point without a value.
#[derive(Clone, Debug, PartialEq)]
pub struct Grid {
    x: Vec<f64>,
    y: Vec<f64>,
    values: Vec<f64>,
}

impl Grid {
    /// A grid with finite values.
    ///
    /// # Errors
    /// If an axis has fewer than two points or does not increase, the number of values is wrong, or a value is not finite.
    pub fn new(x: &[f64], y: &[f64], values: &[f64]) -> Result<Self> {
        super::check::finite("values of the grid", values)?;
        Self::with_holes(x, y, values)
    }

    /// A grid with NaN for points without value, such as a design that cannot be assembled.
    ///
    /// # Errors
    /// Those of [`Grid::new`], except for NaN unless all values are NaN.
    pub fn with_holes(x: &[f64], y: &[f64], values: &[f64]) -> Result<Self> {
        super::check::increasing("first axis of the grid", x)?;
        super::check::increasing("second axis of the grid", y)?;
        Error::check_length("values of the grid", x.len() * y.len(), values.len())?;
        if let Some(&value) = values.iter().find(|v| v.is_infinite()) {
            return Err(super::check::not_finite("values of the grid", value, "inside the grid".to_owned()));
        }
        if values.iter().all(|v| v.is_nan()) {
            return Err(Error::definition(
                "values of the grid",
                "all are NaN",
                "give a region where the function exists",
            ));
        }
        Ok(Self { x: x.to_vec(), y: y.to_vec(), values: values.to_vec() })
    }

    /// Samples `function` at `counts[0] × counts[1]` equally spaced points of a box.
    ///
    /// # Errors
    /// Those of [`Grid::with_holes`].
    pub fn sample(
        x: [f64; 2],
        y: [f64; 2],
        counts: [usize; 2],
        mut function: impl FnMut(f64, f64) -> f64,
    ) -> Result<Self> {
        let (x, y) = (spaced(x, counts[0]), spaced(y, counts[1]));
        let values: Vec<f64> =
            y.iter().flat_map(|&y| x.iter().map(move |&x| (x, y))).map(|(x, y)| function(x, y)).collect();
        Self::with_holes(&x, &y, &values)
    }

    /// Coordinates along the first axis.
    pub fn x(&self) -> &[f64] {
        &self.x
    }

    /// Coordinates along the second axis.
    pub fn y(&self) -> &[f64] {
        &self.y
    }

    /// The value at `(x[i], y[j])`.
    pub fn value(&self, i: usize, j: usize) -> f64 {
        self.values[j * self.x.len() + i]
    }

    /// Smallest and largest value that is not NaN.
    pub fn range(&self) -> [f64; 2] {
        range(self.values.iter().copied())
    }

    /// Lower and upper corner of the grid.
    pub(crate) fn corners(&self) -> [[f64; 2]; 2] {
        [[self.x[0], self.y[0]], [self.x[self.x.len() - 1], self.y[self.y.len() - 1]]]
    }

    /// Bilinear interpolation; NaN outside and next to points without value.
    pub fn interpolate(&self, x: f64, y: f64) -> f64 {
        let (Some((i, u)), Some((j, v))) = (locate(&self.x, x), locate(&self.y, y)) else { return f64::NAN };
        let along = |j: usize| self.value(i, j) * (1.0 - u) + self.value(i + 1, j) * u;
        along(j) * (1.0 - v) + along(j + 1) * v
    }
}

/// Smallest and largest of all values, NaN omitted.
pub(crate) fn range(values: impl Iterator<Item = f64>) -> [f64; 2] {
    values.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], v| [low.min(v), high.max(v)])
}

/// `count` equally spaced numbers from end to end.
pub(crate) fn spaced([low, high]: [f64; 2], count: usize) -> Vec<f64> {
    (0..count).map(|k| low + (high - low) * k as f64 / (count.max(2) - 1) as f64).collect()
}

/// The interval of `axis` that holds `at`, and the fraction inside it.
fn locate(axis: &[f64], at: f64) -> Option<(usize, f64)> {
    if !(axis[0]..=axis[axis.len() - 1]).contains(&at) {
        return None;
    }
    let k = axis.partition_point(|&a| a <= at).clamp(1, axis.len() - 1) - 1;
    Some((k, (at - axis[k]) / (axis[k + 1] - axis[k])))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn interpolation_is_exact_for_a_bilinear_function() {
        let plane = Grid::sample([0.0, 1.0], [0.0, 2.0], [3, 5], |x, y| 1.0 + 2.0 * x - y + 3.0 * x * y).unwrap();
        assert!((plane.interpolate(0.3, 1.7) - (1.0 + 0.6 - 1.7 + 1.53)).abs() < 1e-14);
        assert!(plane.interpolate(1.1, 1.0).is_nan());
        assert_eq!(plane.range(), [-1.0, 7.0]);
    }

    #[test]
    fn bad_grids_are_rejected() {
        assert!(Grid::new(&[], &[], &[]).is_err());
        assert!(Grid::new(&[0.0, 1.0], &[0.0, 1.0], &[1.0, 2.0, f64::NAN, 4.0]).is_err());
        assert!(Grid::with_holes(&[0.0, 1.0], &[0.0, 1.0], &[1.0, 2.0, f64::NAN, 4.0]).is_ok());
        assert!(Grid::with_holes(&[0.0, 1.0], &[0.0, 1.0], &[f64::NAN; 4]).is_err());
        assert!(Grid::new(&[1.0, 0.0], &[0.0, 1.0], &[0.0; 4]).is_err());
        assert!(Grid::new(&[0.0, 1.0], &[0.0, 1.0], &[0.0; 3]).is_err());
        assert!(Grid::sample([0.0, 1.0], [0.0, 1.0], [1, 4], |_, _| 0.0).is_err());
    }
}
