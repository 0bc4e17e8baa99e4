//! Objective and constraints: explicit functions of responses, design variables and time.

use super::function::Point;
use super::number::{AnyFunction, AnyFunctional, ProblemScalar};
use super::{Function, Functional, Intermediates, Selection, WeightedSum};
use std::sync::Arc;

/// How a quantity is made from responses and design.
#[derive(Clone)]
pub(crate) enum Form {
    /// g(r, b): of time-independent responses and design.
    Plain(Arc<dyn AnyFunction>),
    /// g(r(t), b, t) at every point of a grid.
    EachPoint(usize, Arc<dyn AnyFunction>),
    /// One number from a whole history.
    Whole(usize, Arc<dyn AnyFunctional>),
}

/// An explicit function of responses and design: what objective and constraints are made of.
#[derive(Clone)]
pub struct Quantity {
    pub(crate) form: Form,
    pub(crate) uses: Vec<usize>,
    pub(crate) direct: Option<Intermediates>,
}

impl Quantity {
    /// g(r, b): a function of time-independent responses and design variables.
    pub fn plain(function: impl Function) -> Self {
        Self { form: Form::Plain(Arc::new(function)), uses: vec![], direct: None }
    }

    /// g(r(t), b, t) at every time point of grid number `grid`.
    pub fn each_point(grid: usize, function: impl Function) -> Self {
        Self { form: Form::EachPoint(grid, Arc::new(function)), uses: vec![], direct: None }
    }

    /// One number from the whole history over grid number `grid`.
    pub fn whole(grid: usize, functional: impl Functional) -> Self {
        Self { form: Form::Whole(grid, Arc::new(functional)), uses: vec![], direct: None }
    }

    /// Σₚ wₚ g(r(tₚ), b, tₚ) over grid number `grid`: an integral with quadrature weights, or a sum.
    pub fn sum(grid: usize, weights: Vec<f64>, function: impl Function) -> Self {
        Self::whole(grid, WeightedSum { weights, function })
    }

    /// Declares the responses, by index, that the function sees as `response[0]`, `response[1]`, …
    #[must_use]
    pub fn of(self, responses: &[usize]) -> Self {
        Self { uses: responses.to_vec(), ..self }
    }

    /// Approximates the quantity itself, linearized in these intermediate variables, instead of keeping its explicit
    /// dependence on intermediate responses and design.
    #[must_use]
    pub fn directly(self, intermediates: Intermediates) -> Self {
        Self { direct: Some(intermediates), ..self }
    }

    /// The responses that the quantity uses, by index.
    pub fn responses(&self) -> &[usize] {
        &self.uses
    }

    /// The grid over which the quantity is evaluated, if any.
    pub fn grid(&self) -> Option<usize> {
        match self.form {
            Form::Plain(_) => None,
            Form::EachPoint(grid, _) | Form::Whole(grid, _) => Some(grid),
        }
    }

    /// True if the quantity depends on the design variables alone, so that its approximation is exact.
    pub fn is_explicit(&self) -> bool {
        self.uses.is_empty() && self.direct.is_none()
    }

    /// True for a time-dependent quantity: one value at each time point.
    pub fn is_transient(&self) -> bool {
        matches!(self.form, Form::EachPoint(..))
    }

    /// The value at time point `p` (ignored unless transient), from `response(h, p)`.
    pub(crate) fn value<S: ProblemScalar>(
        &self,
        p: usize,
        grids: &[super::TimeGrid],
        design: &[S],
        response: impl Fn(usize, usize) -> S,
    ) -> S {
        let gather = |p: usize| -> Vec<S> { self.uses.iter().map(|&h| response(h, p)).collect() };
        match &self.form {
            Form::Plain(_) => self.value_at(&gather(0), design, S::from(f64::NAN)),
            Form::EachPoint(g, _) => self.value_at(&gather(p), design, S::from(grids[*g].points[p])),
            Form::Whole(g, f) => {
                let times = &grids[*g].points;
                let responses: Vec<Vec<S>> = (0..times.len()).map(gather).collect();
                let history: Vec<Point<S>> = responses
                    .iter()
                    .zip(times)
                    .map(|(response, &t)| Point { response, design, time: S::from(t) })
                    .collect();
                S::call_over(&**f, &history)
            }
        }
    }

    /// The value where it is made of responses at one time, from these and that time.
    pub(crate) fn value_at<S: ProblemScalar>(&self, response: &[S], design: &[S], time: S) -> S {
        match &self.form {
            Form::Plain(f) | Form::EachPoint(_, f) => S::call(&**f, &Point { response, design, time }),
            Form::Whole(..) => unreachable!("a functional has no value at one time"),
        }
    }
}

/// A constraint g ≤ c or g = c, normalised as ĝ = 1 + (g − c)/s ≤ 1.
///
/// The scale s is |c| unless given, so that ĝ = g/c for a positive limit and the violation (18) is (g − c)/c. With
/// c = 0 the scale is 1 in the unit of g; with a limit that moves with the design write g − b + c ≤ c and give the
/// scale in the unit of g (the paper's Table I uses an absolute distance, s = 1).
#[derive(Clone)]
pub struct Constraint {
    /// Name, unique in the problem.
    pub name: String,
    /// What is constrained.
    pub quantity: Quantity,
    /// The limit c, in the unit of g.
    pub limit: f64,
    /// The scale s > 0 of the normalisation, in the unit of g.
    pub scale: f64,
    /// Which time points near local maxima are kept, where it differs from the method's.
    pub selection: Option<Selection>,
    /// True for g = c instead of g ≤ c.
    pub is_equality: bool,
    /// True where the constraint holds at all times between the time points, too.
    pub is_continuous: bool,
}

impl Constraint {
    /// g ≤ `limit`, normalised by |limit|, or by 1 where the limit is zero.
    pub fn at_most(name: impl Into<String>, limit: f64, quantity: Quantity) -> Self {
        let scale = if limit == 0.0 { 1.0 } else { limit.abs() };
        Self { name: name.into(), quantity, limit, scale, selection: None, is_equality: false, is_continuous: false }
    }

    /// g = `value`, normalised like an inequality: ĝ = 1 where it holds, and |ĝ − 1| is its violation.
    ///
    /// Equalities are never screened out; a time-dependent one holds at every time point.
    pub fn equal(name: impl Into<String>, value: f64, quantity: Quantity) -> Self {
        Self { is_equality: true, ..Self::at_most(name, value, quantity) }
    }

    /// The same constraint at all times of the interval from the first to the last time point, and not only at these.
    ///
    /// Its local maxima are found between the time points, where the analysis offers responses in
    /// [continuous time](super::ContinuousTime), else on polynomials through the time points; peaks that rise and fall
    /// between two time points are not seen. One row for each peak enters the approximate problem.
    #[must_use]
    pub fn in_continuous_time(self) -> Self {
        Self { is_continuous: true, ..self }
    }

    /// The same constraint with another scale of normalisation, in the unit of g.
    #[must_use]
    pub fn scaled_by(self, scale: f64) -> Self {
        Self { scale, ..self }
    }

    /// The same constraint with its own selection of time points.
    #[must_use]
    pub fn selecting(self, selection: Selection) -> Self {
        Self { selection: Some(selection), ..self }
    }

    /// ĝ from g.
    pub fn normalised<S: ProblemScalar>(&self, g: S) -> S {
        (g - self.limit) / self.scale + 1.0
    }
}
