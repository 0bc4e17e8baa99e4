//! Linear and quadratic programs, given by their matrices.

use crate::kkt::variable_scale;
use crate::program::{Gradients, Program, Structure, Values, check_finite, feasible_start};
use error::{Error, Result};
use nalgebra::{DMatrix, DVector};

/// A linear or quadratic program as a Taylor expansion about a centre c:
///
/// $$ \min_x f_0 + q^T d + \tfrac12 d^T H d \quad\text{subject to}\quad g_0 + A d \le 0,\quad l \le x \le u, \qquad d = x - c. $$
///
/// Rows marked as equalities read g₀ + A d = 0. The expansion about a centre avoids cancellation where the steps d are
/// small compared with x.
#[derive(Clone, Debug, PartialEq)]
pub struct QuadraticProgram {
    /// c, length n.
    pub center: Vec<f64>,
    /// f₀.
    pub constant: f64,
    /// q, length n.
    pub gradient: Vec<f64>,
    /// H, n × n and symmetric; `None` for a linear objective.
    pub hessian: Option<DMatrix<f64>>,
    /// g₀, length m.
    pub offset: Vec<f64>,
    /// A, m × n.
    pub rows: DMatrix<f64>,
    /// True for equality rows, length m.
    pub equality: Vec<bool>,
    /// l, length n; may be −∞.
    pub lower: Vec<f64>,
    /// u, length n; may be ∞.
    pub upper: Vec<f64>,
}

impl QuadraticProgram {
    /// A program with n = `gradient.len()` free variables about the origin and no rows.
    pub fn new(gradient: Vec<f64>) -> Self {
        let n = gradient.len();
        Self {
            center: vec![0.0; n],
            constant: 0.0,
            gradient,
            hessian: None,
            offset: vec![],
            rows: DMatrix::zeros(0, n),
            equality: vec![],
            lower: vec![f64::NEG_INFINITY; n],
            upper: vec![f64::INFINITY; n],
        }
    }

    /// Sets the Hessian H of the objective, n × n.
    #[must_use]
    pub fn hessian(self, hessian: DMatrix<f64>) -> Self {
        Self { hessian: Some(hessian), ..self }
    }

    /// Adds a row a·(x − c) ≤ b.
    #[must_use]
    pub fn at_most(mut self, a: &[f64], b: f64) -> Self {
        self.push(a, b, false);
        self
    }

    /// Adds a row a·(x − c) = b.
    #[must_use]
    pub fn equal(mut self, a: &[f64], b: f64) -> Self {
        self.push(a, b, true);
        self
    }

    /// Sets the bounds l and u, length n each.
    #[must_use]
    pub fn bounds(self, lower: Vec<f64>, upper: Vec<f64>) -> Self {
        Self { lower, upper, ..self }
    }

    fn push(&mut self, a: &[f64], b: f64, equality: bool) {
        let m = self.offset.len();
        self.rows = std::mem::replace(&mut self.rows, DMatrix::zeros(0, 0)).insert_row(m, 0.0);
        for (j, &v) in a.iter().enumerate().take(self.gradient.len()) {
            self.rows[(m, j)] = v;
        }
        self.offset.push(-b);
        self.equality.push(equality);
    }

    /// The matrices of a linear or quadratic `program`, expanded about `start`.
    ///
    /// The Hessian is the program's own. A program without one is differenced: n gradients give the Hessian of a
    /// quadratic up to rounding.
    ///
    /// # Errors
    /// [`Error::Unsupported`] for a nonlinear program, and the program's own errors.
    pub fn of(program: &dyn Program, start: &[f64]) -> Result<Self> {
        if program.structure() == Structure::Nonlinear {
            let why = "the program is neither linear nor quadratic";
            return Err(Error::unsupported("matrices of a program", why, "use the SQP solver"));
        }
        let center = feasible_start(program, start)?;
        let here = program.gradients(&center)?;
        check_finite(program, &center, &here)?;
        let hessian = match program.structure() {
            Structure::Quadratic => Some(objective_hessian(program, &center, &here.objective)?),
            _ => None,
        };
        Ok(Self {
            constant: here.values.objective,
            gradient: here.objective,
            hessian,
            offset: here.values.rows,
            rows: here.rows,
            equality: (0..program.rows()).map(|i| program.is_equality(i)).collect(),
            lower: program.lower().to_vec(),
            upper: program.upper().to_vec(),
            center,
        })
    }

    /// The program with the rows `kept` only.
    pub(crate) fn with_rows(&self, kept: &[usize]) -> Self {
        Self {
            offset: kept.iter().map(|&i| self.offset[i]).collect(),
            rows: self.rows.select_rows(kept),
            equality: kept.iter().map(|&i| self.equality[i]).collect(),
            center: self.center.clone(),
            gradient: self.gradient.clone(),
            hessian: self.hessian.clone(),
            lower: self.lower.clone(),
            upper: self.upper.clone(),
            ..*self
        }
    }

    /// d = x − c.
    pub(crate) fn step(&self, x: &[f64]) -> DVector<f64> {
        DVector::from_iterator(x.len(), x.iter().zip(&self.center).map(|(x, c)| x - c))
    }

    /// Gradient of the objective after the step d.
    pub(crate) fn objective_gradient(&self, d: &DVector<f64>) -> DVector<f64> {
        let q = DVector::from_column_slice(&self.gradient);
        match &self.hessian {
            Some(h) => h * d + q,
            None => q,
        }
    }

    /// Values of the rows after the step d.
    pub(crate) fn values_of_rows(&self, d: &DVector<f64>) -> DVector<f64> {
        &self.rows * d + DVector::from_column_slice(&self.offset)
    }
}

/// Hessian of a quadratic objective.
fn objective_hessian(program: &dyn Program, x: &[f64], gradient: &[f64]) -> Result<DMatrix<f64>> {
    if let Some(h) = program.lagrangian_hessian(x, &vec![0.0; program.rows()])? {
        return Ok(h);
    }
    let n = x.len();
    let mut h = DMatrix::zeros(n, n);
    for j in 0..n {
        let mut y = x.to_vec();
        let scale = variable_scale(program.lower()[j], program.upper()[j], x[j], x[j]);
        // Towards the more distant bound, by a power of two.
        let inward = if program.upper()[j] - x[j] >= x[j] - program.lower()[j] { 1.0 } else { -1.0 };
        y[j] += inward * scale.log2().floor().exp2();
        let moved = program.gradients(&y)?.objective;
        for i in 0..n {
            h[(i, j)] = (moved[i] - gradient[i]) / (y[j] - x[j]);
        }
    }
    Ok((&h + h.transpose()) * 0.5)
}

impl Program for QuadraticProgram {
    fn variables(&self) -> usize {
        self.gradient.len()
    }
    fn rows(&self) -> usize {
        self.offset.len()
    }
    fn lower(&self) -> &[f64] {
        &self.lower
    }
    fn upper(&self) -> &[f64] {
        &self.upper
    }
    fn is_equality(&self, i: usize) -> bool {
        self.equality[i]
    }
    fn structure(&self) -> Structure {
        if self.hessian.is_some() { Structure::Quadratic } else { Structure::Linear }
    }
    fn values(&self, x: &[f64]) -> Result<Values> {
        let d = self.step(x);
        let quadratic = self.hessian.as_ref().map_or(0.0, |h| 0.5 * d.dot(&(h * &d)));
        let linear: f64 = d.iter().zip(&self.gradient).map(|(d, q)| d * q).sum();
        Ok(Values { objective: self.constant + linear + quadratic, rows: self.values_of_rows(&d).as_slice().to_vec() })
    }
    fn gradients(&self, x: &[f64]) -> Result<Gradients> {
        let objective = self.objective_gradient(&self.step(x)).as_slice().to_vec();
        Ok(Gradients { values: self.values(x)?, objective, rows: self.rows.clone() })
    }
    fn lagrangian_hessian(&self, x: &[f64], _: &[f64]) -> Result<Option<DMatrix<f64>>> {
        Ok(Some(self.hessian.clone().unwrap_or_else(|| DMatrix::zeros(x.len(), x.len()))))
    }
}
