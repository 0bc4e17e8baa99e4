//! The settings of a method.

use super::{Automatic, ErrorBased, Globalization, MoveLimits, RelativeLimits, RunState, Screening, Stop};
use crate::approximation::{Approximation, CycleData, LagrangianCurvature, Linear};
use crate::problem::{AnalyzedDesign, Evaluation, Problem, RowId, Selection};
use error::Result;
use nlp::SubproblemSolver;

/// A method: a choice of interchangeable parts. It contains settings only; data that change are in the [`RunState`].
///
/// # Examples
///
/// ```
/// use linkwright_optimization::{cases::impact_absorber, prelude::*};
/// let method = Method::slp().with_screening(Screening::above(0.5)).with_stop(Stop { max_cycles: 50, ..Stop::default() });
/// let end = method.solve(&impact_absorber::comfort()?, |_| ())?;
/// assert!(end.status.is_success());
/// # Ok::<(), linkwright_optimization::Error>(())
/// ```
pub struct Method {
    /// Approximation of the responses.
    pub approximation: Box<dyn Approximation>,
    /// Curvature of the Lagrangian that is added to the approximate objective, for linear approximations; `None` by default.
    pub curvature: Option<LagrangianCurvature>,
    /// Selection of the constraints that are retained.
    pub screening: Screening,
    /// The search subregion.
    pub move_limits: Box<dyn MoveLimits>,
    /// Solver of the approximate problem.
    pub solver: Box<dyn SubproblemSolver>,
    /// Acceptance of proposed designs.
    pub globalization: Box<dyn Globalization>,
    /// True if the peaks of constraints in continuous time move in the approximate problem as the design changes.
    pub moving_peaks: bool,
    /// The stop test.
    pub stop: Stop,
    /// Selection of approximations by their prediction errors, with its own globalization and stop test. `Some` replaces
    /// approximation, curvature, move limits, solver, globalization, and the tolerances of the stop test.
    pub automatic: Option<Automatic>,
}

impl Default for Method {
    /// [`Method::automatic`].
    fn default() -> Self {
        Self::automatic()
    }
}

impl Method {
    /// The paper's method: linear approximations, errors of the approximation, relative move limits.
    ///
    /// The parts of other methods replace those of this one.
    pub fn slp() -> Self {
        Self {
            approximation: Box::new(Linear),
            curvature: None,
            screening: Screening::default(),
            move_limits: Box::new(RelativeLimits::default()),
            solver: Box::new(nlp::AutoSolver::default()),
            globalization: Box::new(ErrorBased::default()),
            moving_peaks: true,
            stop: Stop::default(),
            automatic: None,
        }
    }

    /// [`Method::slp`] as published: the end is not confirmed, and no cycle is repeated with rows that screening removed.
    pub fn as_published() -> Self {
        Self { screening: Screening::as_published(), stop: Stop::as_published(), ..Self::slp() }
    }

    /// The automatic method, which needs no choice of approximation. Its runs may take 500 cycles: along narrow curved valleys it
    /// makes steady progress, and it ends by itself where it makes none.
    pub fn automatic() -> Self {
        let (screening, stop) = (Screening::all(), Stop { max_cycles: 500, ..Stop::default() });
        Self { automatic: Some(Automatic::default()), screening, stop, ..Self::slp() }
    }

    /// Replaces the approximation.
    #[must_use]
    pub fn with_approximation(self, approximation: impl Approximation + 'static) -> Self {
        Self { approximation: Box::new(approximation), ..self }
    }

    /// Replaces the screening.
    #[must_use]
    pub fn with_screening(self, screening: Screening) -> Self {
        Self { screening, ..self }
    }

    /// Replaces the move limits.
    #[must_use]
    pub fn with_move_limits(self, move_limits: impl MoveLimits + 'static) -> Self {
        Self { move_limits: Box::new(move_limits), ..self }
    }

    /// Replaces the solver of the approximate problem.
    #[must_use]
    pub fn with_solver(self, solver: impl SubproblemSolver + 'static) -> Self {
        Self { solver: Box::new(solver), ..self }
    }

    /// Replaces the globalization.
    #[must_use]
    pub fn with_globalization(self, globalization: impl Globalization + 'static) -> Self {
        Self { globalization: Box::new(globalization), ..self }
    }

    /// Replaces the stop test.
    #[must_use]
    pub fn with_stop(self, stop: Stop) -> Self {
        Self { stop, ..self }
    }

    /// Checks all settings, and that they fit the problem.
    ///
    /// # Errors
    ///
    /// [`Error::Option`](crate::Error::Option) or [`Error::Definition`](crate::Error::Definition) with the name of the setting.
    pub fn check(&self, problem: &Problem) -> Result<()> {
        self.approximation.check(problem)?;
        self.automatic.map_or(Ok(()), |a| a.check())?;
        self.curvature.map_or(Ok(()), |c| c.check())?;
        self.screening.check()?;
        self.move_limits.check()?;
        self.globalization.check()?;
        self.stop.check()
    }

    /// Screens and differentiates an analysed design.
    pub(super) fn differentiate(&self, problem: &Problem, at: &AnalyzedDesign) -> Result<CycleData> {
        let retained = self.screening.retain(problem, &at.evaluation);
        CycleData::first_order(problem, at, thinned(problem, &at.evaluation, retained))
    }

    /// Number of earlier accepted designs that are stored.
    pub(super) fn memory(&self) -> usize {
        self.approximation.memory().max(self.curvature.map_or(0, |c| c.steps))
    }

    /// Number of rows of a constraint that a cycle retains, at most; more than 100 maxima of a history are unusual.
    pub fn most_rows(&self, problem: &Problem, constraint: usize) -> usize {
        let declared = &problem.constraints[constraint];
        let all = problem.points_of(&declared.quantity);
        let selects = declared.selection.unwrap_or(self.screening.selection) != Selection::All;
        match () {
            () if declared.is_equality() => all,
            () if selects || declared.is_continuous => all.min(MANY_MAXIMA),
            () if self.automatic.is_some() => all.min(FEW_POINTS),
            () => all,
        }
    }

    /// Name of the method by which the analysis differentiates the retained responses at this design; `None` if it has one
    /// method only.
    pub fn differentiation(&self, problem: &Problem, state: &RunState) -> Option<&'static str> {
        let retained = self.screening.retain(problem, &state.evaluation);
        problem.analysis.differentiation(problem.n(), &CycleData::needed(problem, &retained))
    }
}

/// Number of time points up to which all of them are retained by the automatic method.
const FEW_POINTS: usize = 250;
/// Number of maxima of a history beyond which it is unusual.
const MANY_MAXIMA: usize = 100;
/// Time points on both sides of a local maximum that are also retained.
const NEIGHBOURS: usize = 2;

/// At most about [`FEW_POINTS`] of the retained time points of each constraint: a fixed coarse grid, whose points are also retained in other cycles, and
/// the neighbourhoods of all local maxima. The cost of a cycle therefore does not grow with the number of time points.
fn thinned(problem: &Problem, evaluation: &Evaluation, retained: Vec<RowId>) -> Vec<RowId> {
    let is_kept = |row: &RowId| {
        let constraint = &problem.constraints[row.constraint];
        let history = &evaluation.residuals[row.constraint];
        if history.len() <= FEW_POINTS || constraint.is_continuous || constraint.is_equality() {
            return true;
        }
        let (p, c) = (row.point, history);
        let every = (2 * history.len()).div_ceil(FEW_POINTS);
        let is_maximum = |q: usize| (q == 0 || c[q] > c[q - 1]) && (q + 1 == c.len() || c[q] >= c[q + 1]);
        let mut near = p.saturating_sub(NEIGHBOURS)..=(p + NEIGHBOURS).min(c.len() - 1);
        p % every == 0 || p + 1 == c.len() || near.any(is_maximum)
    };
    retained.into_iter().filter(is_kept).collect()
}
