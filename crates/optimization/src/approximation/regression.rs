//! Regression over several designs: the mid-range multipoint approximation.

use super::{AnyModel, Approximation, Expansion, FittedModel, Sample};
use crate::problem::{Problem, ProblemScalar};
use error::{Error, Result};
use nalgebra::{DMatrix, DVector};
use nlp::separable::Term;
use std::sync::Arc;

/// The weighted least-squares fit to values and gradients at the last designs inside a part of the design space, by a linear or a
/// multiplicative function, whichever fits better:
///
/// $$ \tilde r(b) = a_0 + \sum_k a_k (b_k - b_{0,k}) \qquad\text{or}\qquad \tilde r(b) = a_0 \prod_k (b_k / b_{0,k})^{a_k} . $$
///
/// With the scaled gradient $s_k(b) = h_k \partial_k r(b)$ and the half widths h of the search subregion, the parameters minimize
///
/// $$ \sum_p w_p \Bigl[ \bigl(\tilde r(b_p) - r(b_p)\bigr)^2 + \sum_k \bigl(h_k \partial_k \tilde r(b_p) - s_k(b_p)\bigr)^2 \Bigr] ,
///    \qquad w_p = \bigl(1 - d_p / \rho\bigr)^2 , $$
///
/// with the distance $d_p = \max_k |b_{p,k} - b_{0,k}| / h_k$ of design p; designs farther than ρ are ignored. The
/// multiplicative function is fitted to the logarithms, and only if all values have one sign and the variables stay positive.
///
/// # When to use it
///
/// For analyses with noise: P designs reduce the error of the derivatives by about √P. Value and gradient at b₀ are not those of
/// the analysis, so that convergence on exact analyses is slower than with interpolating approximations.
///
/// # Sources
///
/// Toropov, Filatov & Polynkin, *Struct. Optim.* 6 (1993) 7–14; Etman, Adriaens, van Slagmaat & Schoofs, *Struct. Optim.* 12 (1996)
/// 171–175. We differ: the designs are those of earlier cycles, none is analysed for the fit alone, and the weights are our own.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Regression {
    /// Number of earlier designs, at least 1.
    pub designs: usize,
    /// ρ, in half widths of the search subregion.
    pub reach: f64,
}

impl Default for Regression {
    fn default() -> Self {
        Self { designs: 8, reach: 2.0 }
    }
}

impl Approximation for Regression {
    fn check(&self, _: &Problem) -> Result<()> {
        Error::check_option("number of designs", "at least 1", self.designs as f64, self.designs > 0)?;
        let is_positive = self.reach > 0.0 && self.reach.is_finite();
        Error::check_option("reach of the regression", "positive and finite", self.reach, is_positive)
    }

    fn memory(&self) -> usize {
        self.designs
    }

    fn is_odd(&self) -> bool {
        true
    }

    fn fit(&self, expansion: &Expansion) -> Result<Arc<dyn AnyModel>> {
        let (here, around) = (expansion.here, expansion.subproblem_box);
        let widths: Vec<f64> = (0..here.design.len())
            .map(|k| {
                let width = 0.5 * (around.upper[k] - around.lower[k]);
                if width > 0.0 && width.is_finite() { width } else { around.scale[k] }
            })
            .collect();
        let weighted = |sample: &Sample| {
            let apart = |k: usize| (sample.design[k] - here.design[k]).abs() / widths[k];
            let distance = (0..widths.len()).map(apart).fold(0.0, f64::max);
            (distance < self.reach).then(|| (1.0 - distance / self.reach).powi(2))
        };
        let samples: Vec<(Sample, f64)> =
            std::iter::once(&here).chain(expansion.before).filter_map(|s| Some((*s, weighted(s)?))).collect();
        let linear = Fitted::linear(&samples, &widths);
        let is_positive = |k: usize| around.lower[k] > 0.0 && samples.iter().all(|(s, _)| s.design[k] > 0.0);
        let has_one_sign = samples.iter().all(|(s, _)| s.value * here.value > 0.0);
        if has_one_sign && (0..widths.len()).all(is_positive) {
            let multiplicative = Fitted::multiplicative(&samples, &widths);
            if multiplicative.misfit(&samples, &widths) < linear.misfit(&samples, &widths) {
                return Ok(Arc::new(multiplicative));
            }
        }
        Ok(Arc::new(linear))
    }
}

/// A fitted function.
#[derive(Clone, Debug)]
struct Fitted {
    /// b₀.
    origin: Vec<f64>,
    /// a₀.
    value: f64,
    /// aₖ.
    slopes: Vec<f64>,
    is_multiplicative: bool,
}

impl Fitted {
    fn linear(samples: &[(Sample, f64)], widths: &[f64]) -> Self {
        let origin = samples[0].0.design;
        let point = |(s, weight): &(Sample, f64)| FittedPoint {
            weight: *weight,
            step: (0..widths.len()).map(|k| (s.design[k] - origin[k]) / widths[k]).collect(),
            value: s.value,
            slope: (0..widths.len()).map(|k| s.gradient[k] * widths[k]).collect(),
        };
        let (value, slopes) = least_squares(&samples.iter().map(point).collect::<Vec<_>>());
        let slopes = slopes.iter().zip(widths).map(|(a, h)| a / h).collect();
        Self { origin: origin.to_vec(), value, slopes, is_multiplicative: false }
    }

    /// The fit in the logarithms of values and variables.
    fn multiplicative(samples: &[(Sample, f64)], widths: &[f64]) -> Self {
        let origin = samples[0].0.design;
        // A step of h changes the logarithm by h / b₀.
        let scale: Vec<f64> = widths.iter().zip(origin).map(|(h, b)| h / b).collect();
        let point = |(s, weight): &(Sample, f64)| FittedPoint {
            weight: *weight,
            step: (0..widths.len()).map(|k| (s.design[k] / origin[k]).ln() / scale[k]).collect(),
            value: s.value.abs().ln(),
            slope: (0..widths.len()).map(|k| s.gradient[k] * s.design[k] / s.value * scale[k]).collect(),
        };
        let (logarithm, slopes) = least_squares(&samples.iter().map(point).collect::<Vec<_>>());
        Self {
            origin: origin.to_vec(),
            value: logarithm.exp().copysign(samples[0].0.value),
            slopes: slopes.iter().zip(&scale).map(|(a, s)| a / s).collect(),
            is_multiplicative: true,
        }
    }

    /// The weighted sum of squares.
    fn misfit(&self, samples: &[(Sample, f64)], widths: &[f64]) -> f64 {
        let of = |(s, weight): &(Sample, f64)| {
            let value = self.at(s.design);
            let slope = |k: usize| match self.is_multiplicative {
                true => value * self.slopes[k] / s.design[k],
                false => self.slopes[k],
            };
            let slopes: f64 = (0..widths.len()).map(|k| ((slope(k) - s.gradient[k]) * widths[k]).powi(2)).sum();
            weight * ((value - s.value).powi(2) + slopes)
        };
        let sum: f64 = samples.iter().map(of).sum();
        if sum.is_nan() { f64::INFINITY } else { sum }
    }
}

impl FittedModel for Fitted {
    fn at<S: ProblemScalar>(&self, b: &[S]) -> S {
        let used = (0..b.len()).filter(|&k| self.slopes[k] != 0.0);
        if self.is_multiplicative {
            let sum = used.map(|k| (b[k] / self.origin[k]).ln() * self.slopes[k]).fold(S::from(0.0), |a, t| a + t);
            sum.exp() * self.value
        } else {
            used.map(|k| (b[k] - self.origin[k]) * self.slopes[k]).fold(S::from(self.value), |a, t| a + t)
        }
    }

    fn constant(&self) -> Option<f64> {
        (!self.is_multiplicative).then_some(self.value)
    }

    fn term(&self, k: usize, x: f64) -> Term {
        let slope = self.slopes[k];
        Term { value: (x - self.origin[k]) * slope, slope, curvature: 0.0 }
    }
}

/// A design with value and gradient, in units of the fit.
struct FittedPoint {
    weight: f64,
    step: Vec<f64>,
    value: f64,
    slope: Vec<f64>,
}

/// a₀ and aₖ with the least Σ w [(a₀ + aᵀd − r)² + |a − s|²].
///
/// With weighted means the constant is a₀ = r̄ − aᵀd̄, and (W I + D Dᵀ) a = Σ w s + D y with the columns √w (d − d̄) of D and
/// y = √w (r − r̄); by the formula of Woodbury the matrix to be factorized has the size of the number of designs.
fn least_squares(points: &[FittedPoint]) -> (f64, DVector<f64>) {
    let n = points[0].step.len();
    let total: f64 = points.iter().map(|p| p.weight).sum();
    let mut mean = DVector::zeros(n);
    let mut sum = DVector::zeros(n);
    for p in points {
        mean.axpy(p.weight / total, &DVector::from_column_slice(&p.step), 1.0);
        sum.axpy(p.weight, &DVector::from_column_slice(&p.slope), 1.0);
    }
    let mean_value = points.iter().map(|p| p.weight * p.value).sum::<f64>() / total;
    let root = |p: &FittedPoint| p.weight.sqrt();
    let columns = DMatrix::from_fn(n, points.len(), |k, i| root(&points[i]) * (points[i].step[k] - mean[k]));
    let values = DVector::from_iterator(points.len(), points.iter().map(|p| root(p) * (p.value - mean_value)));
    let right = &sum + &columns * values;
    let small = DMatrix::identity(points.len(), points.len()) * total + columns.transpose() * &columns;
    // The matrix is positive definite: the weight of the design itself is 1.
    let inner =
        small.cholesky().map_or_else(|| DVector::zeros(points.len()), |c| c.solve(&(columns.transpose() * &right)));
    let slopes = (right - columns * inner) / total;
    (mean_value - slopes.dot(&mean), slopes)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::approximation::checks::Case;
    use autodiff::{DualNum as _, HyperDual, gradient};

    #[test]
    fn functions_of_the_fitted_form_are_exact() {
        let linear = |b: &[HyperDual]| b[0] * 3.0 - b[1] * 2.0 + 1.0;
        let monomial = |b: &[HyperDual]| b[0].powf(1.5) * b[1].powf(-0.7) * -2.0;
        let designs = [[1.2, 1.5], [0.9, 2.3]];
        let near = |f: fn(&[HyperDual]) -> HyperDual| {
            let case = Case::of(f, &[1.0, 2.0], &[0.4, 0.8], &[1.6, 3.2]);
            designs.iter().fold(case, |case, b| case.after(b)).fit(&Regression::default()).unwrap()
        };
        assert!((near(linear).real(&[1.5, 0.9]) - (4.5 - 1.8 + 1.0)).abs() < 1e-13);
        let expected = -2.0 * 1.5f64.powf(1.5) * 0.9f64.powf(-0.7);
        assert!((near(monomial).real(&[1.5, 0.9]) - expected).abs() < 1e-13);
    }

    #[test]
    fn one_design_gives_its_value_and_gradient() {
        let f = |b: &[HyperDual]| (b[0] * b[1]).sin() + b[0];
        let model = Case::of(f, &[1.0, 0.5], &[0.5, 0.1], &[1.5, 0.9]).fit(&Regression::default()).unwrap();
        let (value, slope) = gradient(|b| model.dual(b), &[1.0, 0.5]);
        let (sine, cosine) = 0.5f64.sin_cos();
        assert!((value - sine - 1.0).abs() < 1e-14);
        assert!((slope[0] - 0.5 * cosine - 1.0).abs() < 1e-14 && (slope[1] - cosine).abs() < 1e-14);
    }

    #[test]
    fn designs_average_errors_of_the_derivatives() {
        // A quadratic whose slope differs by ±0.4 at designs on both sides: the mean is that of the middle.
        let f = |b: &[HyperDual]| (b[0] - 0.5) * (b[0] - 0.5) * 2.0 - b[0];
        let case = Case::of(f, &[0.5], &[-0.5], &[1.5]).after(&[0.4]).after(&[0.6]);
        let model = case.fit(&Regression::default()).unwrap();
        let slope = gradient(|b| model.dual(b), &[0.5]).1[0];
        assert!((slope + 1.0).abs() < 1e-12, "{slope}");
    }

    #[test]
    fn the_solution_is_that_of_the_normal_equations() {
        let point = |i: usize| {
            let of = |k: usize| ((3 * i + 5 * k) as f64).sin();
            FittedPoint {
                weight: 1.0 / (1 + i) as f64,
                step: vec![of(0), of(1)],
                value: of(2),
                slope: vec![of(3), of(4)],
            }
        };
        let points: Vec<FittedPoint> = (0..4).map(point).collect();
        let (constant, slopes) = least_squares(&points);
        // The gradient of the sum of squares vanishes.
        let error = |p: &FittedPoint| constant + slopes[0] * p.step[0] + slopes[1] * p.step[1] - p.value;
        let by_constant: f64 = points.iter().map(|p| p.weight * error(p)).sum();
        assert!(by_constant.abs() < 1e-14);
        for k in 0..2 {
            let by_slope: f64 = points.iter().map(|p| p.weight * (error(p) * p.step[k] + slopes[k] - p.slope[k])).sum();
            assert!(by_slope.abs() < 1e-14, "{by_slope}");
        }
    }

    #[test]
    fn settings_out_of_range_are_rejected() {
        let problem = (crate::cases::find("two-bar-truss").unwrap().build)().unwrap();
        assert!(Regression { designs: 0, ..Default::default() }.check(&problem).is_err());
        assert!(Regression { reach: f64::NAN, ..Default::default() }.check(&problem).is_err());
    }
}
