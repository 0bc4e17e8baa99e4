//! Tables: functions of one number through given points.

use autodiff::Scalar;
use mechanics::motion::{Motion, TabulatedMotion};

/// A function through points: piecewise linear, or a natural cubic spline. It is extrapolated linearly beyond both ends.
#[derive(Clone, Debug)]
pub struct TableFunction {
    x: Vec<f64>,
    y: Vec<f64>,
    /// `None` for straight lines.
    spline: Option<TabulatedMotion>,
}

impl PartialEq for TableFunction {
    fn eq(&self, other: &Self) -> bool {
        self.x == other.x && self.y == other.y && self.spline.is_some() == other.spline.is_some()
    }
}

impl TableFunction {
    /// A function through the points (x, y).
    ///
    /// # Errors
    /// If there are fewer than two points, or `x` does not increase.
    pub fn new(x: Vec<f64>, y: Vec<f64>, is_cubic: bool) -> crate::Result<Self> {
        let spline = TabulatedMotion::new(&x, &y)?;
        Ok(Self { x, y, spline: is_cubic.then_some(spline) })
    }

    /// The arguments of its points, increasing.
    pub fn points(&self) -> &[f64] {
        &self.x
    }

    /// The value at `x`.
    pub fn at<S: Scalar>(&self, x: S) -> S {
        // Marked as not polynomial for scalars that track the degree: the pieces differ.
        let kink = (x - self.x[0]).abs() * 0.0;
        if let Some(spline) = &self.spline {
            return spline.position(&[S::from(1.0)], x) + kink;
        }
        let i = self.x.partition_point(|&knot| knot <= x.re()).clamp(1, self.x.len() - 1) - 1;
        let slope = (self.y[i + 1] - self.y[i]) / (self.x[i + 1] - self.x[i]);
        (x - self.x[i]) * slope + self.y[i] + kink
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use autodiff::PolynomialDegree;

    /// A table is not treated as a polynomial, although each of its pieces is one, even beyond the ends, where it is straight.
    #[test]
    fn tables_are_no_polynomials() {
        for is_cubic in [false, true] {
            let table = TableFunction::new(vec![0.0, 1.0, 2.0], vec![1.0, 0.0, 1.0], is_cubic).unwrap();
            for x in [-3.0, 0.4, 1.0, 5.0] {
                let found = table.at(PolynomialDegree::variable(x));
                assert_eq!(found.degree, PolynomialDegree::NONLINEAR, "{is_cubic} at {x}");
            }
        }
    }
}
