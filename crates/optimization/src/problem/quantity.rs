//! Quantities: explicit functions of responses, design variables and time.

use super::function::Point;
use super::problem_scalar::{AnyFunction, AnyFunctional, ProblemScalar};
use super::{Function, Functional, Intermediates, TimeGrid, WeightedSum};
use autodiff::{Dual, HyperDual, PolynomialDegree, Scalar};
use std::sync::Arc;

/// Relative rounding below which a quantity counts as a response minus a function of time.
const SHIFTED: f64 = 1e-9;

/// The function of a quantity, and its arguments.
#[derive(Clone)]
pub(crate) enum QuantityForm {
    /// g(r, b): of time-independent responses and design.
    Plain(Arc<dyn AnyFunction>),
    /// g(r(t), b, t) at every point of a grid.
    EachPoint(usize, Arc<dyn AnyFunction>),
    /// g(r, b, t) at the time t, which is the last response: of responses that are numbers, such as values at an event.
    AtTime(Arc<dyn AnyFunction>),
    /// One number from a whole history.
    Whole(usize, Arc<dyn AnyFunctional>),
}

/// An explicit function of responses, design and time, for objective and constraints.
#[derive(Clone)]
pub struct Quantity {
    pub(crate) form: QuantityForm,
    pub(crate) uses: Vec<usize>,
    pub(crate) direct: Option<Intermediates>,
    is_response: bool,
}

/// s g − β: a quantity with the sign and the bound variable of its constraint or objective.
#[derive(Clone, Copy)]
pub struct SignedQuantity<'a> {
    /// Quantity g.
    pub quantity: &'a Quantity,
    /// Sign s, 1 or −1.
    pub sign: f64,
    /// Index of the design variable β; none for β = 0.
    pub bound: Option<usize>,
}

impl Quantity {
    /// g(r, b): a function of time-independent responses and design variables.
    pub fn plain(function: impl Function) -> Self {
        Self::new(QuantityForm::Plain(Arc::new(function)))
    }

    /// Design variable number `variable` itself.
    pub fn variable(variable: usize) -> Self {
        Self::plain(DesignComponent(variable))
    }

    /// Response number `response` itself: at every time point of grid number `grid`, or time-independent for `None`.
    pub fn response(grid: impl Into<Option<usize>>, response: usize) -> Self {
        let quantity =
            grid.into().map_or_else(|| Self::plain(OnlyResponse), |grid| Self::each_point(grid, OnlyResponse));
        Self { is_response: true, ..quantity.of(&[response]) }
    }

    /// g(r(t), b, t) at every time point of grid number `grid`.
    pub fn each_point(grid: usize, function: impl Function) -> Self {
        Self::new(QuantityForm::EachPoint(grid, Arc::new(function)))
    }

    /// One number from the whole history over grid number `grid`.
    pub fn whole(grid: usize, functional: impl Functional) -> Self {
        Self::new(QuantityForm::Whole(grid, Arc::new(functional)))
    }

    /// The value of a quantity that changes with time at one instant: of the `responses`, numbers that stand for the histories in their
    /// order, at the time that is the response `time`. `None` for a quantity that is a number, or that is approximated
    /// [directly](Self::directly).
    ///
    /// With the values of histories just before and just after an event it is a value of the history that no time point has.
    #[must_use]
    pub fn at_instant(&self, responses: &[usize], time: usize) -> Option<Self> {
        let QuantityForm::EachPoint(_, function) = &self.form else { return None };
        if self.direct.is_some() {
            return None;
        }
        if self.is_response {
            return Some(Self::response(None, responses[0]));
        }
        let uses = [responses, &[time]].concat();
        Some(Self { uses, ..Self::new(QuantityForm::AtTime(function.clone())) })
    }

    /// As [`at_instant`](Self::at_instant), if the instant is between the times of `window`; else the value at time point number `point` of the
    /// grid, which is one inside the window.
    #[must_use]
    pub fn at_instant_within(&self, responses: &[usize], time: usize, window: [f64; 2], point: usize) -> Option<Self> {
        let QuantityForm::EachPoint(grid, function) = &self.form else { return None };
        if self.direct.is_some() {
            return None;
        }
        let functional = WithinWindow { function: function.clone(), count: responses.len(), window, point };
        let uses = [responses, &[time], &self.uses].concat();
        Some(Self { uses, ..Self::new(QuantityForm::Whole(*grid, Arc::new(functional))) })
    }

    fn new(form: QuantityForm) -> Self {
        Self { form, uses: vec![], direct: None, is_response: false }
    }

    /// Σₚ wₚ g(r(tₚ), b, tₚ) over grid number `grid`: an integral with quadrature weights, or a sum.
    pub fn sum(grid: usize, weights: Vec<f64>, function: impl Function) -> Self {
        Self::whole(grid, WeightedSum { weights, function })
    }

    /// Declares the responses, by index, that the function receives as `response[0]`, `response[1]`, …
    #[must_use]
    pub fn of(self, responses: &[usize]) -> Self {
        Self { uses: responses.to_vec(), is_response: false, ..self }
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

    /// Index of the response if the quantity is a response itself; `None` for a function of responses.
    pub fn as_response(&self) -> Option<usize> {
        self.uses.first().copied().filter(|_| self.is_response)
    }

    /// Index of the response r if the quantity is r(t) − f(b, t): its limit can then be drawn as a curve with the history of r. The
    /// form is recognized by values of the quantity at this design, at some times of its grid.
    pub fn as_shifted_response(&self, grids: &[TimeGrid], design: &[f64]) -> Option<usize> {
        let (QuantityForm::EachPoint(grid, _), [response]) = (&self.form, &self.uses[..]) else { return None };
        let signed = SignedQuantity { quantity: self, sign: 1.0, bound: None };
        let points = &grids.get(*grid)?.points;
        let is_shifted = |&time: &f64| {
            let [at_zero, others @ ..] = [0.0, 1.0, -0.7, 2.9].map(|r| (r, signed.value_at(&[r], design, time)));
            let off = |(r, value): &(f64, f64)| value - at_zero.1 - r;
            others.iter().all(|other| off(other).abs() <= SHIFTED * (1.0 + at_zero.1.abs()))
        };
        let some = points.iter().step_by((points.len() / 4).max(1));
        (!points.is_empty() && some.into_iter().all(is_shifted)).then_some(*response)
    }

    /// The grid over which the quantity is evaluated, if any.
    pub fn grid(&self) -> Option<usize> {
        match self.form {
            QuantityForm::Plain(_) | QuantityForm::AtTime(_) => None,
            QuantityForm::EachPoint(grid, _) | QuantityForm::Whole(grid, _) => Some(grid),
        }
    }

    /// True if the quantity depends on the design variables alone, so that its approximation is exact.
    pub fn is_explicit(&self) -> bool {
        self.uses.is_empty() && self.direct.is_none()
    }

    /// True for a time-dependent quantity: one value at each time point.
    pub fn is_transient(&self) -> bool {
        matches!(self.form, QuantityForm::EachPoint(..))
    }
}

impl SignedQuantity<'_> {
    /// The value at time point `p` (ignored unless transient), from `response(h, p)`.
    pub(crate) fn value<S: ProblemScalar>(
        &self,
        p: usize,
        grids: &[TimeGrid],
        design: &[S],
        response: impl Fn(usize, usize) -> S,
    ) -> S {
        let gather = |p: usize| -> Vec<S> { self.quantity.uses.iter().map(|&h| response(h, p)).collect() };
        match &self.quantity.form {
            QuantityForm::Plain(_) | QuantityForm::AtTime(_) => self.value_at(&gather(0), design, S::from(f64::NAN)),
            QuantityForm::EachPoint(g, _) => self.value_at(&gather(p), design, S::from(grids[*g].points[p])),
            QuantityForm::Whole(g, f) => {
                let times = &grids[*g].points;
                let responses: Vec<Vec<S>> = (0..times.len()).map(gather).collect();
                let history: Vec<Point<S>> = responses
                    .iter()
                    .zip(times)
                    .map(|(response, &t)| Point { response, design, time: S::from(t) })
                    .collect();
                self.signed(S::call_over(&**f, &history), design)
            }
        }
    }

    fn signed<S: ProblemScalar>(&self, g: S, design: &[S]) -> S {
        let g = if self.sign < 0.0 { g * self.sign } else { g };
        self.bound.map_or(g, |variable| g - design[variable])
    }

    /// The value from responses at one time; not for quantities of a whole history.
    pub(crate) fn value_at<S: ProblemScalar>(&self, response: &[S], design: &[S], time: S) -> S {
        match &self.quantity.form {
            QuantityForm::Plain(f) | QuantityForm::EachPoint(_, f) => {
                self.signed(S::call(&**f, &Point { response, design, time }), design)
            }
            QuantityForm::AtTime(f) => {
                let (&time, response) = response.split_last().expect("its last response is the time");
                self.signed(S::call(&**f, &Point { response, design, time }), design)
            }
            QuantityForm::Whole(..) => unreachable!("a functional has no value at one time"),
        }
    }
}

/// A function at an instant inside a window, or else at a time point.
///
/// Its responses are numbers that stand for the histories, the time of the instant, and the histories.
struct WithinWindow {
    function: Arc<dyn AnyFunction>,
    /// Number of the histories.
    count: usize,
    window: [f64; 2],
    point: usize,
}

impl WithinWindow {
    fn value<S: ProblemScalar>(&self, history: &[Point<S>]) -> S {
        let at_point = &history[self.point];
        let (numbers, others) = at_point.response.split_at(self.count);
        let (time, histories) = others.split_first().expect("the time of the instant is among them");
        let [from, to] = self.window;
        let is_inside = from <= time.re() && time.re() <= to;
        let (response, time) = if is_inside { (numbers, *time) } else { (histories, at_point.time) };
        S::call(&*self.function, &Point { response, time, ..*at_point })
    }
}

macro_rules! within_window {
    ($($number:ty => $name:ident),*) => {
        impl AnyFunctional for WithinWindow {
            $(fn $name(&self, history: &[Point<$number>]) -> $number { self.value(history) })*
            fn made_for(&self) -> Option<usize> { None }
        }
    };
}
within_window!(f64 => real, Dual => dual, HyperDual => hyper_dual, PolynomialDegree => degree);

/// The only response of a quantity.
struct OnlyResponse;

impl Function for OnlyResponse {
    fn at<S: Scalar>(&self, point: &Point<S>) -> S {
        point.response[0]
    }
}

/// A component of the design.
struct DesignComponent(usize);

impl Function for DesignComponent {
    fn at<S: Scalar>(&self, point: &Point<S>) -> S {
        point.design[self.0]
    }
}
