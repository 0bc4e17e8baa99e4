//! Putting a problem together, part by part.

use super::{
    Analysis, Analytic, ClosedForm, Constraint, DesignVariable, Function, Intermediates, Point, Problem, Quantity,
    Response, TimeGrid,
};
use autodiff::Scalar;
use error::{Error, Result};

/// Collects the parts of a [`Problem`]; each part is referred to by the index that its method returns.
///
/// ```
/// use linkwright::{function, problem::*, autodiff::Scalar};
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
/// parts.subject_to(Constraint::at_most("low", 0.1, Quantity::each_point(time, function!(|p| p.response[0])).of(&[level])));
/// let problem = parts.build_analytic(Decay)?;
/// let here = problem.evaluate(&[2.0], &problem.analysis.analyze(&[2.0])?)?;
/// assert!((here.max_violation_pct() - 35.335).abs() < 1e-3);
/// # Ok::<(), linkwright::Error>(())
/// ```
pub struct ProblemBuilder {
    name: String,
    variables: Vec<DesignVariable>,
    grids: Vec<TimeGrid>,
    responses: Vec<Response>,
    objective: Option<(String, String, Quantity)>,
    constraints: Vec<Constraint>,
}

impl ProblemBuilder {
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
        self.objective = Some((name.to_owned(), unit.to_owned(), quantity));
    }

    /// Adds a constraint.
    pub fn subject_to(&mut self, constraint: Constraint) -> usize {
        self.constraints.push(constraint);
        self.constraints.len() - 1
    }

    /// Minimizes max |f(r(t), b, t)| over a grid by a bound variable β (equations 37–39): β is added to the design
    /// variables and becomes the objective, subject to f − β ≤ 0 and −f − β ≤ 0 at every time point.
    ///
    /// Both constraints are normalised by `scale`, in the unit of f: ĝ = 1 + (±f − β)/scale. The paper's is 1.
    /// Returns the index of β.
    pub fn minimize_peak<F>(&mut self, bound: DesignVariable, grid: usize, f: F, of: &[usize], scale: f64) -> usize
    where
        F: Function + Clone,
    {
        let (name, unit) = (bound.name.clone(), bound.unit.clone());
        let index = self.variable(bound);
        for (sign, word) in [(1.0, "upper"), (-1.0, "lower")] {
            let excess = Quantity::each_point(grid, BelowBound { function: f.clone(), sign, index }).of(of);
            self.subject_to(Constraint::at_most(format!("{name} {word}"), 0.0, excess).scaled_by(scale));
        }
        self.minimize(&name, &unit, Quantity::plain(BoundVariable { index }));
        index
    }

    /// The problem with responses in closed form.
    pub fn build_analytic(self, model: impl ClosedForm + 'static) -> Result<Problem> {
        self.check_grids()?;
        let grids: Vec<_> = self.responses.iter().map(|r| r.grid.map(|g| &self.grids[g])).collect();
        let analysis = Analytic::new(model, &grids);
        self.build(analysis)
    }

    /// The problem with this analysis. Refuses parts that do not fit together, naming the part.
    pub fn build(self, analysis: impl Analysis + 'static) -> Result<Problem> {
        self.check_grids()?;
        let missing = || Error::definition(&self.name, "there is no objective", "call `minimize`");
        let (objective_name, objective_unit, objective) = self.objective.ok_or_else(missing)?;
        let problem = Problem {
            name: self.name,
            variables: self.variables,
            grids: self.grids,
            responses: self.responses,
            objective_name,
            objective_unit,
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

/// ±f − β: the excess over a bound variable.
#[derive(Clone)]
struct BelowBound<F> {
    function: F,
    sign: f64,
    index: usize,
}

impl<F: Function> Function for BelowBound<F> {
    fn at<S: Scalar>(&self, point: &Point<S>) -> S {
        self.function.at(point) * self.sign - point.design[self.index]
    }
}

/// β itself.
struct BoundVariable {
    index: usize,
}

impl Function for BoundVariable {
    fn at<S: Scalar>(&self, point: &Point<S>) -> S {
        point.design[self.index]
    }
}
