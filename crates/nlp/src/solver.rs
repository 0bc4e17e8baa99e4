//! What every subproblem solver can do.

use super::{Evaluations, KktResidual, Solution, Status};
use crate::{Gradients, Program, Separable};
use error::{Error, Result};

/// A solver of mathematical programs: a value that holds settings only.
///
/// Bounds are never violated, whatever the status. Two calls with the same program and start give the same bits.
pub trait SubproblemSolver: Send + Sync {
    /// Name for tables and messages.
    fn name(&self) -> &'static str;

    /// A solution of `program`, searched from `start` (length n; moved into the bounds first).
    ///
    /// **Errors.** [`Error::Length`] and [`Error::Definition`] if program and start do not fit together or bounds
    /// cross, [`Error::NotFinite`] if the program is not finite at the start, the program's own error if it cannot be
    /// evaluated there. That a program has no solution is a [`Status`], not an error.
    fn solve(&self, program: &dyn Program, start: &[f64]) -> Result<Solution>;
}

/// A point with multipliers, before it is judged.
#[derive(Clone, Debug)]
pub(crate) struct Candidate {
    pub x: Vec<f64>,
    pub multipliers: Vec<f64>,
    pub lower: Vec<f64>,
    pub upper: Vec<f64>,
    pub iterations: usize,
    pub status: Status,
    /// Amounts by which the rows are relaxed.
    pub relaxation: Option<Vec<f64>>,
}

impl Candidate {
    /// The solution with values and KKT residual, from `gradients` at the point and the objective's slope at the start.
    pub fn certified(
        self,
        program: &dyn Program,
        start: &[f64],
        evaluations: Evaluations,
        gradients: &Gradients,
        first: Option<&[f64]>,
    ) -> Solution {
        let mut solution = Solution {
            objective: gradients.values.objective,
            rows: gradients.values.rows.clone(),
            x: self.x,
            multipliers: self.multipliers,
            lower_multipliers: self.lower,
            upper_multipliers: self.upper,
            iterations: self.iterations,
            evaluations,
            status: self.status,
            relaxation: self.relaxation.as_ref().map(|t| t.iter().copied().fold(0.0, f64::max)),
            relaxed_rows: self.relaxation.unwrap_or_default(),
            kkt: KktResidual::default(),
        };
        solution.kkt = KktResidual::from_gradients(program, start, gradients, first, &solution);
        solution
    }
}

impl From<Solution> for Candidate {
    fn from(s: Solution) -> Self {
        Self {
            x: s.x,
            multipliers: s.multipliers,
            lower: s.lower_multipliers,
            upper: s.upper_multipliers,
            iterations: s.iterations,
            status: s.status,
            relaxation: s.relaxation.map(|_| s.relaxed_rows),
        }
    }
}

/// The sum over the variables that a program is, but perhaps for a coupling.
pub(crate) fn separable_part(program: &dyn Program) -> Option<&dyn Separable> {
    program.separable().or_else(|| program.coupled().map(|(part, _)| part))
}

/// `start` moved into the bounds, after the shapes have been checked.
pub(crate) fn feasible_start(program: &dyn Program, start: &[f64]) -> Result<Vec<f64>> {
    let n = program.variables();
    Error::check_length("start of the subproblem", n, start.len())?;
    Error::check_length("lower bounds of the subproblem", n, program.lower().len())?;
    Error::check_length("upper bounds of the subproblem", n, program.upper().len())?;
    let mut x = start.to_vec();
    for (j, v) in x.iter_mut().enumerate() {
        let (l, u) = (program.lower()[j], program.upper()[j]);
        if l > u || l.is_nan() || u.is_nan() || l == f64::INFINITY || u == f64::NEG_INFINITY {
            let why = format!("bounds of variable {j} are {l} and {u}");
            return Err(Error::definition("subproblem", why, "make the lower bound the smaller one"));
        }
        if !v.is_finite() {
            return Err(not_finite(format!("start of variable {j}"), *v, start));
        }
        *v = v.clamp(l, u);
    }
    Ok(x)
}

/// An error unless objective, rows and their gradients at `x` are finite and of the right length.
pub(crate) fn check_finite(program: &dyn Program, x: &[f64], g: &Gradients) -> Result<()> {
    let (n, m) = (program.variables(), program.rows());
    Error::check_length("gradient of the objective", n, g.objective.len())?;
    Error::check_length("rows of the subproblem", m, g.values.rows.len())?;
    Error::check_length("columns of the row gradients", n, g.rows.ncols())?;
    Error::check_length("rows of the row gradients", m, g.rows.nrows())?;
    let named = |what: &str, v: &[f64]| match v.iter().position(|v| !v.is_finite()) {
        Some(i) => Err(not_finite(format!("{what} {i}"), v[i], x)),
        None => Ok(()),
    };
    named("objective", &[g.values.objective])?;
    named("row", &g.values.rows)?;
    named("objective slope", &g.objective)?;
    named("row slope", g.rows.as_slice())
}

fn not_finite(what: String, value: f64, x: &[f64]) -> Error {
    let shown: Vec<f64> = x.iter().copied().take(8).collect();
    let place = format!("x = {shown:?}{}", if x.len() > 8 { " …" } else { "" });
    Error::NotFinite { what, value, place, remedy: "start where the program is defined" }
}
