//! Post-optimality analysis: multipliers at the optimum, and derivatives of the optimum with respect to parameters.

use super::{ActiveRow, RunState};
use crate::approximation::CycleData;
use crate::problem::{AnalyzedDesign, Goal, Problem, RowId, Sensitivities};
use error::{Error, Result};
use nalgebra::{DMatrix, DVector};

/// Step of the central differences of the Lagrangian's gradient, in scales of the variables.
const STEP: f64 = 1e-5;
/// Largest distance to a bound, in scales of the variable, of a variable that counts as at the bound.
const AT_BOUND: f64 = 1e-7;

/// A parameter with respect to which the optimum is differentiated.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Parameter {
    /// A design variable that is at a bound, or is fixed by equal bounds: its value.
    Variable(usize),
    /// The limit c of a constraint, in its unit.
    Limit(usize),
}

/// Multipliers at the final design of a run, from gradients there, and the first-order change of the optimum.
///
/// With the Lagrangian L = F + Σ λᵢ (ĝᵢ − 1) over the active rows, dF*/dp = ∂L/∂p, and the optimum moves by the solution of
///
/// $$ \begin{pmatrix} L_{bb} & A^T \\ A & 0 \end{pmatrix} \begin{pmatrix} db/dp \\ dλ/dp \end{pmatrix}
///    = - \begin{pmatrix} L_{bp} \\ \hat g_p \end{pmatrix} $$
///
/// over the free variables, as long as the active rows and bounds stay the same.
///
/// # Sources
///
/// Fiacco, *Introduction to Sensitivity and Stability Analysis in Nonlinear Programming* (1983), section 3.2.
#[derive(Clone, Debug, PartialEq)]
pub struct PostOptimal {
    /// Active rows and their multipliers λ in the Lagrangian F + Σ λ (ĝ − 1), in the unit of the objective.
    pub rows: Vec<ActiveRow>,
    /// ∂L/∂b of all variables, length n: zero for free ones, dF*/db of those at a bound.
    pub slopes: Vec<f64>,
    /// True for variables off their bounds.
    pub is_free: Vec<bool>,
    /// Largest |∂L/∂b| of a free variable, divided by the largest |∂F/∂b| (in scaled variables).
    pub residual: f64,
    /// Largest |∂F/∂b| (in scaled variables).
    steepest: f64,
    design: Vec<f64>,
    /// Gradients of the active rows.
    gradients: DMatrix<f64>,
}

/// Gradients of objective and rows at a design.
fn gradients(problem: &Problem, b: &[f64], rows: &[RowId]) -> Result<(Vec<f64>, DMatrix<f64>)> {
    let analyzed = problem.analyze_design(b)?;
    let AnalyzedDesign { responses, evaluation, .. } = &analyzed;
    let at = CycleData::needed(problem, rows);
    let sensitivities = Sensitivities { rows: problem.sensitivities(b, responses, &at)?, at };
    let objective = problem.total_derivative(problem.objective.signed(), 0, b, responses, &sensitivities);
    let mut all = DMatrix::zeros(rows.len(), b.len());
    for (i, row) in rows.iter().enumerate() {
        let slope = problem.residual_gradient(*row, evaluation.nearest_peak(*row), &analyzed, &sensitivities)?;
        slope.iter().enumerate().for_each(|(k, v)| all[(i, k)] = *v);
    }
    Ok((objective, all))
}

impl PostOptimal {
    /// The multipliers at the last design of a run, for the rows that are active there; one analysis and one
    /// sensitivity analysis.
    pub fn new(problem: &Problem, state: &RunState) -> Result<Self> {
        let rows: Vec<RowId> = state.active_rows().iter().map(|active| active.row).collect();
        let b = &state.design;
        let (objective, gradients) = gradients(problem, b, &rows)?;
        let scale = problem.scales();
        let inside = |k: usize| {
            let v = &problem.variables[k];
            b[k] - v.lower > AT_BOUND * scale[k] && v.upper - b[k] > AT_BOUND * scale[k]
        };
        let is_free: Vec<bool> = (0..b.len()).map(inside).collect();
        let free: Vec<usize> = (0..b.len()).filter(|&k| is_free[k]).collect();
        let a = DMatrix::from_fn(free.len(), rows.len(), |i, j| gradients[(j, free[i])] * scale[free[i]]);
        let f = DVector::from_fn(free.len(), |i, _| -objective[free[i]] * scale[free[i]]);
        // If all variables are at bounds, the multipliers are not determined.
        let multipliers = match rows.len().min(free.len()) {
            0 => DVector::zeros(rows.len()),
            _ => a.svd(true, true).solve(&f, 1e-12).map_err(|why| singular(problem, why))?,
        };
        let slope = |k: usize| objective[k] + (0..rows.len()).map(|i| multipliers[i] * gradients[(i, k)]).sum::<f64>();
        let slopes: Vec<f64> = (0..b.len()).map(slope).collect();
        let most = (0..b.len()).fold(f64::MIN_POSITIVE, |m, k| (objective[k] * scale[k]).abs().max(m));
        let residual = free.iter().fold(0.0, |m: f64, &k| m.max((slopes[k] * scale[k]).abs())) / most;
        let rows = rows.into_iter().zip(multipliers.iter()).map(|(row, &multiplier)| ActiveRow { row, multiplier });
        Ok(Self { rows: rows.collect(), slopes, is_free, residual, steepest: most, design: b.clone(), gradients })
    }

    /// The largest residual of the Karush–Kuhn–Tucker conditions: [`residual`](Self::residual), and multipliers of inequalities
    /// and derivatives at bounds that have the wrong sign, in the same units.
    ///
    /// `problem` is the problem of the run. Violation and slack of rows are not included: see the violation of the run.
    pub fn kkt(&self, problem: &Problem) -> f64 {
        let scale = problem.scales();
        let row = |(i, r): (usize, &ActiveRow)| {
            let inequality = !problem.constraints[r.row.constraint].is_equality();
            let size = (0..scale.len()).fold(0.0, |m: f64, k| m.max((self.gradients[(i, k)] * scale[k]).abs()));
            if inequality { -r.multiplier * size } else { 0.0 }
        };
        let bound = |k: usize| {
            let v = &problem.variables[k];
            let at_lower = self.design[k] - v.lower <= AT_BOUND * scale[k];
            let at_upper = v.upper - self.design[k] <= AT_BOUND * scale[k];
            match [at_lower, at_upper] {
                [true, false] => -self.slopes[k] * scale[k],
                [false, true] => self.slopes[k] * scale[k],
                _ => 0.0,
            }
        };
        let wrong = self.rows.iter().enumerate().map(row).chain((0..scale.len()).map(bound)).fold(0.0, f64::max);
        self.residual.max(wrong / self.steepest)
    }

    /// dF*/dp, in the unit of the objective per unit of the parameter.
    ///
    /// # Errors
    ///
    /// [`Error::Definition`] if the parameter is a free variable.
    pub fn objective(&self, problem: &Problem, parameter: Parameter) -> Result<f64> {
        match parameter {
            Parameter::Variable(k) => self.fixed(problem, k).map(|()| self.slopes[k]),
            Parameter::Limit(j) => {
                let of = self.rows.iter().filter(|r| r.row.constraint == j);
                let constraint = &problem.constraints[j];
                Ok(-constraint.sign() * of.map(|r| r.multiplier).sum::<f64>() / constraint.scale)
            }
        }
    }

    fn fixed(&self, problem: &Problem, k: usize) -> Result<()> {
        if self.is_free.get(k) == Some(&false) {
            return Ok(());
        }
        let what =
            problem.variables.get(k).map_or_else(|| format!("variable {k}"), |v| format!("variable `{}`", v.name));
        Err(Error::definition(what, "it is free and therefore not a parameter", "fix it by equal bounds"))
    }

    /// Gradient of the Lagrangian at another design, with the multipliers of this one.
    fn lagrangian(&self, problem: &Problem, b: &[f64]) -> Result<Vec<f64>> {
        let rows: Vec<RowId> = self.rows.iter().map(|r| r.row).collect();
        let (objective, gradients) = gradients(problem, b, &rows)?;
        let sum = |k: usize| self.rows.iter().enumerate().map(|(i, r)| r.multiplier * gradients[(i, k)]).sum::<f64>();
        Ok((0..b.len()).map(|k| objective[k] + sum(k)).collect())
    }

    /// ∂(∂L/∂b)/∂bₖ by central differences.
    fn second_derivatives(&self, problem: &Problem, k: usize) -> Result<Vec<f64>> {
        let step = STEP * problem.scales()[k];
        let moved = |sign: f64| {
            let mut b = self.design.clone();
            b[k] += sign * step;
            self.lagrangian(problem, &b)
        };
        let (up, down) = (moved(1.0)?, moved(-1.0)?);
        Ok(up.iter().zip(&down).map(|(u, d)| (u - d) / (2.0 * step)).collect())
    }

    /// db*/dp, length n; two analyses and sensitivity analyses for each free variable and for the parameter.
    ///
    /// # Errors
    ///
    /// [`Error::Definition`] if the parameter is a free variable, or if the optimum is not determined by its active rows and its
    /// curvature.
    pub fn design(&self, problem: &Problem, parameter: Parameter) -> Result<Vec<f64>> {
        let free: Vec<usize> = (0..self.design.len()).filter(|&k| self.is_free[k]).collect();
        let (n, m, scale) = (free.len(), self.rows.len(), problem.scales());
        let mut matrix = DMatrix::zeros(n + m, n + m);
        for (j, &k) in free.iter().enumerate() {
            let column = self.second_derivatives(problem, k)?;
            (0..n).for_each(|i| matrix[(i, j)] = column[free[i]] * scale[free[i]] * scale[k]);
            for i in 0..m {
                let slope = self.gradients[(i, k)] * scale[k];
                (matrix[(n + i, j)], matrix[(j, n + i)]) = (slope, slope);
            }
        }
        let mut right = DVector::zeros(n + m);
        match parameter {
            Parameter::Variable(k) => {
                self.fixed(problem, k)?;
                let column = self.second_derivatives(problem, k)?;
                (0..n).for_each(|i| right[i] = -column[free[i]] * scale[free[i]]);
                (0..m).for_each(|i| right[n + i] = -self.gradients[(i, k)]);
            }
            Parameter::Limit(j) => {
                let of = (0..m).filter(|&i| self.rows[i].row.constraint == j);
                let constraint = &problem.constraints[j];
                of.for_each(|i| right[n + i] = constraint.sign() / constraint.scale);
            }
        }
        let moved = matrix.lu().solve(&right).filter(|x| x.iter().all(|v| v.is_finite()));
        let moved = moved.ok_or_else(|| singular(problem, "the optimality conditions are singular"))?;
        let mut change = vec![0.0; self.design.len()];
        free.iter().enumerate().for_each(|(i, &k)| change[k] = moved[i] * scale[k]);
        if let Parameter::Variable(k) = parameter {
            change[k] = 1.0;
        }
        Ok(change)
    }

    /// Active constraints and bounds with their effect on the objective, in words, the largest multiplier first:
    /// `displacement upper at time 2.28 s: relaxing it by 1 % changes peak acceleration by -0.0028 m/s²`.
    pub fn in_words(&self, problem: &Problem, state: &RunState) -> Vec<String> {
        let percent = |row: &ActiveRow| {
            let sign = if problem.objective.goal == Goal::Maximize { -1.0 } else { 1.0 };
            let change = -0.01 * sign * row.multiplier;
            let what = state.row_in_words(problem, row.row);
            let (name, unit) = (&problem.objective.name, &problem.objective.unit);
            (change.abs(), format!("{what}: relaxing it by 1 % of its scale changes {name} by {change:.3e} {unit}"))
        };
        let bound = |k: usize| {
            let (v, slope) = (&problem.variables[k], self.slopes[k]);
            let per =
                format!("{} changes by {slope:.3e} {} per {}", problem.objective.name, problem.objective.unit, v.unit);
            ((slope * 0.01 * problem.scales()[k]).abs(), format!("bound of {} at {}: {per}", v.name, self.design[k]))
        };
        let mut all: Vec<(f64, String)> = self.rows.iter().map(percent).collect();
        all.extend((0..self.design.len()).filter(|&k| !self.is_free[k]).map(bound));
        all.sort_by(|a, b| b.0.total_cmp(&a.0));
        all.into_iter().map(|(_, words)| words.trim_end().to_owned()).collect()
    }
}

fn singular(problem: &Problem, why: &str) -> Error {
    Error::definition(
        format!("optimum of `{}`", problem.name),
        why,
        "remove active rows with linearly dependent gradients",
    )
}

impl RunState {
    /// A constraint and its time in words; a peak in continuous time with its own time.
    pub fn row_in_words(&self, problem: &Problem, row: RowId) -> String {
        let constraint = &problem.constraints[row.constraint];
        match self.evaluation.nearest_peak(row).zip(constraint.quantity.grid()) {
            Some((peak, grid)) => {
                let grid = &problem.grids[grid];
                format!("{} at {} {:.6} {}", constraint.name, grid.name, grid.shown(peak.time), grid.unit)
            }
            None => problem.row_in_words(row),
        }
    }
}
