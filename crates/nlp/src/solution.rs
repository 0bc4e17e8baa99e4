//! The trait of all solvers, [`SubproblemSolver`], and their result, [`Solution`].

use crate::kkt::{PrimalDual, row_units, variable_scales};
use crate::{Gradients, KktResidual, Program};
use error::Result;
use serde::{Deserialize, Serialize};
use std::fmt;

/// Conclusion of a solver about a program.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[non_exhaustive]
pub enum ProgramStatus {
    /// A point that satisfies the optimality conditions.
    Solved,
    /// No point satisfies all rows. The point has the smallest violation and, for that violation, the smallest objective.
    Relaxed,
    /// The objective decreases without limit at feasible points.
    Unbounded,
    /// The iterations ran out before the optimality conditions held.
    IterationLimit,
    /// No further progress is possible, yet the optimality conditions do not hold.
    Stalled,
}

impl ProgramStatus {
    /// True if the point solves the program itself, without relaxation.
    pub fn was_successful(self) -> bool {
        self == Self::Solved
    }

    /// True if the point solves the program or its least relaxation.
    pub fn is_usable(self) -> bool {
        matches!(self, Self::Solved | Self::Relaxed)
    }
}

impl fmt::Display for ProgramStatus {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Solved => "solved",
            Self::Relaxed => "relaxed: no feasible point, rows violated least",
            Self::Unbounded => "unbounded below",
            Self::IterationLimit => "iteration limit",
            Self::Stalled => "stalled before the optimality conditions held",
        })
    }
}

/// Number of evaluations of a program.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Evaluations {
    /// Calls of [`Program::values`](crate::Program::values), failed ones included.
    pub values: usize,
    /// Calls of [`Program::gradients`](crate::Program::gradients).
    pub gradients: usize,
    /// Calls of [`Program::lagrangian_hessian`](crate::Program::lagrangian_hessian).
    pub hessians: usize,
}

impl std::ops::Add for Evaluations {
    type Output = Self;
    fn add(self, other: Self) -> Self {
        Self {
            values: self.values + other.values,
            gradients: self.gradients + other.gradients,
            hessians: self.hessians + other.hessians,
        }
    }
}

/// A point with its multipliers, the status and the KKT residual.
///
/// The multipliers belong to L = f + Σ λᵢ gᵢ − Σ μₗ (x − l) + Σ μᵤ (x − u) (or its relaxation g ≤ t). They are
/// non-negative, except for equality rows, where either sign is possible. Their unit is that of the objective divided by
/// that of the row or variable.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Solution {
    /// The point, length n.
    pub x: Vec<f64>,
    /// Objective at the point.
    pub objective: f64,
    /// Rows at the point, length m.
    pub rows: Vec<f64>,
    /// λ, length m.
    pub multipliers: Vec<f64>,
    /// μₗ, length n.
    pub lower_multipliers: Vec<f64>,
    /// μᵤ, length n.
    pub upper_multipliers: Vec<f64>,
    /// Iterations done: of the interior point for linear and quadratic programs, of the outer loop otherwise.
    pub iterations: usize,
    /// Evaluations of the program.
    pub evaluations: Evaluations,
    /// Conclusion of the solver.
    pub status: ProgramStatus,
    /// The largest amount by which a row is relaxed; `None` unless relaxed.
    pub relaxation: Option<f64>,
    /// Amounts tᵢ ≥ 0 by which the rows are relaxed: gᵢ ≤ tᵢ, and |gᵢ| ≤ tᵢ in equality rows. Empty unless relaxed.
    ///
    /// All tᵢ are equal if the units of the rows differ by at most 1e4. Otherwise tᵢ is proportional to the unit of its
    /// row, which is the row's largest change over the scale of a variable.
    pub relaxed_rows: Vec<f64>,
    /// Residual of the optimality conditions, computed independently of the solver.
    pub kkt: KktResidual,
}

impl Solution {
    fn primal_dual(&self) -> PrimalDual<'_> {
        PrimalDual {
            x: &self.x,
            multipliers: &self.multipliers,
            lower: &self.lower_multipliers,
            upper: &self.upper_multipliers,
            relaxed: &self.relaxed_rows,
        }
    }

    /// This solution with the status `Stalled` in place of `Solved` or `Relaxed` if the KKT residual exceeds `tolerance`.
    pub(crate) fn checked(self, tolerance: f64) -> Self {
        let holds = self.kkt.largest() <= tolerance;
        let status = if self.status.is_usable() && !holds { ProgramStatus::Stalled } else { self.status };
        Self { status, ..self }
    }
}

impl KktResidual {
    /// The residual of `solution`, from new evaluations of `program` at the point and at `start`.
    ///
    /// # Errors
    /// The program's own error if it cannot be evaluated at the point.
    pub fn of(program: &dyn Program, start: &[f64], solution: &Solution) -> Result<Self> {
        let here = program.gradients(&solution.x)?;
        let at_start = program.gradients(start).ok();
        let start_gradient = at_start.as_ref().map(|g| g.objective.as_slice());
        Ok(Self::from_gradients(program, start, &here, start_gradient, &solution.primal_dual()))
    }
}

/// Rows and bounds that are active at a solution.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct ActiveSet {
    /// Rows without slack, and all equality rows.
    pub rows: Vec<usize>,
    /// Variables at their lower bound.
    pub lower: Vec<usize>,
    /// Variables at their upper bound.
    pub upper: Vec<usize>,
}

impl ActiveSet {
    /// The active set of `solution`: a row or bound whose slack is at most `tolerance` of its scale (see
    /// [`KktResidual`]), and every equality row.
    ///
    /// # Errors
    /// The program's own error if it cannot be evaluated at the point.
    pub fn of(program: &dyn Program, start: &[f64], solution: &Solution, tolerance: f64) -> Result<Self> {
        let here = program.gradients(&solution.x)?;
        let (lower, upper, x) = (program.lower(), program.upper(), &solution.x);
        let scale = variable_scales(program, start, x);
        let unit = row_units(&scale, &here.rows);
        let active = |&i: &usize| {
            let relaxed = solution.relaxed_rows.get(i).copied().unwrap_or(0.0);
            program.is_equality(i) || here.values.rows[i] - relaxed >= -tolerance * unit[i]
        };
        Ok(Self {
            rows: (0..program.rows()).filter(active).collect(),
            lower: (0..x.len()).filter(|&j| x[j] - lower[j] <= tolerance * scale[j]).collect(),
            upper: (0..x.len()).filter(|&j| upper[j] - x[j] <= tolerance * scale[j]).collect(),
        })
    }
}

/// A solver of mathematical programs. The value holds settings only.
///
/// The returned point satisfies the bounds, whatever the status. Two calls with the same program and start return the
/// same bits.
pub trait SubproblemSolver: Send + Sync {
    /// Name for tables and messages.
    fn name(&self) -> &'static str;

    /// Solves `program`, starting from `start` (length n; moved into the bounds first).
    ///
    /// # Errors
    /// * [`Error::Unsupported`](crate::Error::Unsupported) if this solver does not accept programs of this structure.
    /// * [`Error::Length`](crate::Error::Length), [`Error::Definition`](crate::Error::Definition) if program and start have
    ///   different lengths, or a lower bound exceeds the upper one.
    /// * [`Error::NotFinite`](crate::Error::NotFinite) if the program is not finite at the start.
    /// * The program's own error if it cannot be evaluated at the start.
    ///
    /// A program without a solution is reported by [`ProgramStatus`], not by an error.
    fn solve(&self, program: &dyn Program, start: &[f64]) -> Result<Solution>;
}

/// A point with multipliers, before its KKT residual is computed.
#[derive(Clone, Debug)]
pub(crate) struct Candidate {
    pub x: Vec<f64>,
    pub multipliers: Vec<f64>,
    pub lower: Vec<f64>,
    pub upper: Vec<f64>,
    pub iterations: usize,
    pub status: ProgramStatus,
    /// Amounts by which the rows are relaxed.
    pub relaxation: Option<Vec<f64>>,
}

impl Candidate {
    /// The solution with values and KKT residual, from `gradients` at the point and the objective's gradient at the start.
    pub fn certified(
        self,
        program: &dyn Program,
        start: &[f64],
        evaluations: Evaluations,
        gradients: &Gradients,
        start_gradient: Option<&[f64]>,
    ) -> Solution {
        let relaxation = self.relaxation.as_ref().map(|t| t.iter().copied().fold(0.0, f64::max));
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
            relaxation,
            relaxed_rows: self.relaxation.unwrap_or_default(),
            kkt: KktResidual::default(),
        };
        solution.kkt = KktResidual::from_gradients(program, start, gradients, start_gradient, &solution.primal_dual());
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
