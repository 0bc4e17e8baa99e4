//! Second derivatives of responses, and of quantities made from them.

use super::{Problem, ResponseAt, Responses, Sensitivities, SignedQuantity};
use autodiff::{BLOCK, HyperDual};
use error::{Error, Result};
use nalgebra::{DMatrix, SMatrix, SVector};
use num_dual::Derivative;

impl Problem {
    /// ∂²r/∂b² of the wanted responses (n × n each), checked for shape and finiteness.
    ///
    /// `None` if the analysis does not compute them.
    pub fn curvatures(
        &self,
        b: &[f64],
        responses: &Responses,
        wanted: &[ResponseAt],
    ) -> Result<Option<Vec<DMatrix<f64>>>> {
        let Some(found) = self.analysis.curvatures(&self.analysis_design(b), responses, wanted)? else {
            return Ok(None);
        };
        Error::check_length("second derivatives of the analysis", wanted.len(), found.len())?;
        for (at, matrix) in wanted.iter().zip(&found) {
            Error::check_length("rows of the second derivatives", self.n(), matrix.nrows())?;
            Error::check_length("columns of the second derivatives", self.n(), matrix.ncols())?;
            if let Some(&value) = matrix.iter().find(|v| !v.is_finite()) {
                let response = &self.responses[at.response];
                let what = format!("second derivative of response `{}`", response.name);
                return Err(self.not_finite(what, value, response.grid, at.point, b));
            }
        }
        Ok(Some(found))
    }

    /// The total second derivative d²g/db² of a quantity at time point `p` by the chain rule from those of the responses.
    ///
    /// `curvatures` has one matrix for each row of `sensitivities`.
    pub fn total_curvature(
        &self,
        signed: SignedQuantity<'_>,
        p: usize,
        b: &[f64],
        responses: &Responses,
        (sensitivities, curvatures): (&Sensitivities, &[DMatrix<f64>]),
    ) -> DMatrix<f64> {
        let n = b.len();
        let mut total = DMatrix::zeros(n, n);
        let starts = || (0..n).step_by(BLOCK);
        for (i, j) in starts().flat_map(|i| starts().map(move |j| (i, j))) {
            let design: Vec<HyperDual> = (0..n).map(|k| variable(b[k], k, i, j)).collect();
            let value = signed.value(p, &self.grids, &design, |h, p| {
                let at = self.response_at(h, p);
                let row = sensitivities.row_of(at).expect("every response of a retained quantity is differentiated");
                let slope = |k: usize| if k < n { sensitivities.rows[(row, k)] } else { 0.0 };
                let second =
                    |a: usize, c: usize| if i + a < n && j + c < n { curvatures[row][(i + a, j + c)] } else { 0.0 };
                HyperDual::new(
                    responses.at(at),
                    Derivative::some(SVector::from_fn(|a, _| slope(i + a))),
                    Derivative::some(SVector::<f64, BLOCK>::from_fn(|c, _| slope(j + c)).transpose()),
                    Derivative::some(SMatrix::from_fn(second)),
                )
            });
            let block = value.eps1eps2.unwrap_generic(nalgebra::Const::<BLOCK>, nalgebra::Const::<BLOCK>);
            for a in 0..BLOCK.min(n - i) {
                for c in 0..BLOCK.min(n - j) {
                    total[(i + a, j + c)] = block[(a, c)];
                }
            }
        }
        total
    }
}

/// Design variable k as a hyper-dual number, seeded if it is in the block that begins at `i` or at `j`.
fn variable(value: f64, k: usize, i: usize, j: usize) -> HyperDual {
    let mut seeded = HyperDual::from_re(value);
    if k >= i && k < i + BLOCK {
        seeded = seeded.derivative1(k - i);
    }
    if k >= j && k < j + BLOCK {
        seeded = seeded.derivative2(k - j);
    }
    seeded
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::function;
    use crate::problem::{ClosedForm, DesignVariable, ProblemBuilder, Quantity};
    use autodiff::{DualNum as _, Scalar, hessian};

    struct ProductResponse;
    impl ClosedForm for ProductResponse {
        fn response<S: Scalar>(&self, _: usize, b: &[S], _: S) -> S {
            b[0] * b[1].powi(2) + b[5].exp() * b[0]
        }
    }

    #[test]
    fn total_curvature_equals_the_hessian_of_the_composition() {
        let mut parts = ProblemBuilder::new("product");
        for k in 0..6 {
            parts.variable(DesignVariable::new(format!("x{k}"), "", 1.0));
        }
        let r = parts.constant("r", "");
        parts.minimize("f", "", Quantity::plain(function!(|p| p.response[0].powi(2) * p.design[4])).of(&[r]));
        let problem = parts.build_analytic(ProductResponse).unwrap();
        let b = [1.0, 0.5, 2.0, 3.0, 0.7, 0.2];
        let responses = problem.analyze(&b).unwrap();
        let at = vec![ResponseAt { response: 0, point: 0 }];
        let curvatures = problem.curvatures(&b, &responses, &at).unwrap().unwrap();
        let rows = problem.sensitivities(&b, &responses, &at).unwrap();
        let known = Sensitivities { at, rows };
        let total = problem.total_curvature(problem.objective.signed(), 0, &b, &responses, (&known, &curvatures));
        let whole = hessian(|b| ProductResponse.response(0, b, 0.0.into()).powi(2) * b[4], &b).2;
        assert!((total - whole).amax() < 1e-13);
    }
}
