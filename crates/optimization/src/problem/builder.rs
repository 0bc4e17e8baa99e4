//! A builder that collects the parts of a problem.

use super::{
    Analysis, Analytic, ClosedForm, Constraint, DesignVariable, Goal, Intermediates, Objective, PeakBound, Problem,
    Quantity, Response, TimeGrid,
};
use error::{Error, Result};

/// A builder of a [`Problem`]. Each method returns the index of the part that it adds.
///
/// # Examples
///
/// ```
/// use linkwright_optimization::{autodiff::Scalar, function, problem::*};
/// struct Decay;
/// impl ClosedForm for Decay {
///     fn response<S: Scalar>(&self, _: usize, b: &[S], t: S) -> S {
///         (-b[0] * t).exp()
///     }
/// }
/// let mut parts = ProblemBuilder::new("decay");
/// parts.variable(DesignVariable::new("rate", "1/s", 2.0).within(0.1, 10.0));
/// let time = parts.grid(TimeGrid::uniform(1.0, 2.0, 11)?);
/// let level = parts.transient("level", "-", time);
/// parts.minimize("rate", "1/s", Quantity::plain(function!(|p| p.design[0])));
/// parts.subject_to(Constraint::at_most("low", 0.1, Quantity::response(time, level)));
/// let problem = parts.build_analytic(Decay)?;
/// let here = problem.evaluate(&[2.0], &problem.analysis.analyze(&[2.0])?)?;
/// assert!((here.max_violation_pct() - 35.335).abs() < 1e-3);
/// # Ok::<(), linkwright_optimization::Error>(())
/// ```
pub struct ProblemBuilder {
    name: String,
    variables: Vec<DesignVariable>,
    grids: Vec<TimeGrid>,
    responses: Vec<Response>,
    objective: Option<Objective>,
    constraints: Vec<Constraint>,
}

impl ProblemBuilder {
    /// The design variables so far.
    pub fn variables(&self) -> &[DesignVariable] {
        &self.variables
    }

    /// An empty problem.
    pub fn new(name: impl Into<String>) -> Self {
        Self {
            name: name.into(),
            variables: vec![],
            grids: vec![],
            responses: vec![],
            objective: None,
            constraints: vec![],
        }
    }

    /// Adds a design variable.
    pub fn variable(&mut self, variable: DesignVariable) -> usize {
        self.variables.push(variable);
        self.variables.len() - 1
    }

    /// Adds a time grid.
    pub fn grid(&mut self, grid: TimeGrid) -> usize {
        self.grids.push(grid);
        self.grids.len() - 1
    }

    /// Adds a response over grid number `grid`.
    pub fn transient(&mut self, name: &str, unit: &str, grid: usize) -> usize {
        self.response(name, unit, Some(grid))
    }

    /// Adds a time-independent response.
    pub fn constant(&mut self, name: &str, unit: &str) -> usize {
        self.response(name, unit, None)
    }

    fn response(&mut self, name: &str, unit: &str, grid: Option<usize>) -> usize {
        let (name, unit) = (name.to_owned(), unit.to_owned());
        self.responses.push(Response { name, unit, grid, intermediates: Intermediates::Identity });
        self.responses.len() - 1
    }

    /// Linearizes response number `response` in these intermediate design variables (equation 13).
    pub fn linearize_in(&mut self, response: usize, intermediates: Intermediates) {
        self.responses[response].intermediates = intermediates;
    }

    /// Sets the objective to be minimized.
    pub fn minimize(&mut self, name: &str, unit: &str, quantity: Quantity) {
        self.objective = Some(Objective::new(name, unit, quantity, Goal::Minimize));
    }

    /// Sets the objective to be maximized.
    pub fn maximize(&mut self, name: &str, unit: &str, quantity: Quantity) {
        self.objective = Some(Objective::new(name, unit, quantity, Goal::Maximize));
    }

    /// Adds a constraint.
    pub fn subject_to(&mut self, constraint: Constraint) -> usize {
        self.constraints.push(constraint);
        self.constraints.len() - 1
    }

    /// Adds both sides of a two-sided constraint, such as those of [`Constraint::between`].
    pub fn subject_to_both(&mut self, pair: [Constraint; 2]) -> [usize; 2] {
        pair.map(|constraint| self.subject_to(constraint))
    }

    /// Minimizes max |f(r(t), b, t)| over a grid by a bound variable β (equations 37–39).
    ///
    /// `quantity` is f at each time point. β is added to the design variables and becomes the objective, subject to f ≤ β
    /// and f ≥ −β at every time point. Both constraints are normalized by `scale`, in the unit of f:
    /// ĝ = 1 + (±f − β)/scale. The paper's is 1. Returns the index of β. The analysis must not depend on β: the automatic method changes it
    /// after an analysis, to the peak.
    pub fn minimize_peak(&mut self, bound: DesignVariable, quantity: Quantity, scale: f64) -> usize {
        // The fingerprint contains minus the lower limit: −0 gives the 0 of an upper limit of −f.
        let pair = Constraint::between(&bound.name, [-0.0, 0.0], quantity);
        self.minimize_bound(bound, pair.map(|side| side.scaled_by(scale)).into())
    }

    /// Minimizes a new variable β that bounds one quantity: from both sides, as in [`minimize_peak`](Self::minimize_peak), or by f ≤ β alone,
    /// for the maximum of f. The `sides` have the limit zero. Returns the index of β.
    pub fn minimize_bound(&mut self, bound: DesignVariable, sides: Vec<Constraint>) -> usize {
        let (name, unit) = (bound.name.clone(), bound.unit.clone());
        let variable = self.variable(bound);
        let first = self.constraints.len();
        self.constraints.extend(sides.into_iter().map(|side| side.bounded_by(variable)));
        let constraints = [first, self.constraints.len() - 1];
        let goal = Goal::MinimizePeak(PeakBound { variable, constraints });
        self.objective = Some(Objective::new(&name, &unit, Quantity::variable(variable), goal));
        variable
    }

    /// Builds the problem with responses in closed form.
    ///
    /// # Errors
    ///
    /// As [`build`](Self::build).
    pub fn build_analytic(self, model: impl ClosedForm + 'static) -> Result<Problem> {
        self.check_grids()?;
        let grids: Vec<_> = self.responses.iter().map(|r| r.grid.map(|g| &self.grids[g])).collect();
        let analysis = Analytic::new(model, &grids);
        self.build(analysis)
    }

    /// Builds the problem with this analysis.
    ///
    /// # Errors
    ///
    /// As [`Problem::check`], and [`Error::Definition`] without an objective.
    pub fn build(self, analysis: impl Analysis + 'static) -> Result<Problem> {
        self.check_grids()?;
        let missing = || Error::definition(&self.name, "there is no objective", "call `minimize`");
        let objective = self.objective.ok_or_else(missing)?;
        let problem = Problem {
            name: self.name,
            variables: self.variables,
            grids: self.grids,
            responses: self.responses,
            objective,
            constraints: self.constraints,
            analysis: Box::new(analysis),
        };
        problem.check()?;
        Ok(problem)
    }

    fn check_grids(&self) -> Result<()> {
        match self.responses.iter().find(|r| r.grid.is_some_and(|g| g >= self.grids.len())) {
            None => Ok(()),
            Some(r) => {
                let why = "its time grid does not exist";
                Err(Error::definition(format!("response `{}`", r.name), why, "add the grid first and use its index"))
            }
        }
    }
}
