//! Constraints on quantities, at the time points of a grid or at all times.

use super::quantity::SignedQuantity;
use super::{ProblemScalar, Quantity, TimeGrid};
use std::ops::Range;

/// Kind of a limit: upper, lower, or equality.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Side {
    /// g ≤ c.
    AtMost,
    /// g ≥ c.
    AtLeast,
    /// g = c.
    Equal,
}

/// The time points of a constraint history that enter the approximate problem.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Selection {
    /// All time points above the cut-off of the [screening](crate::sao::Screening) (equation 5).
    All,
    /// Local maxima above the cut-off, and up to this many neighbours on both sides that are also above it.
    ///
    /// The first and the last time point are retained whenever they are above the cut-off. `NearMaxima(0)` retains
    /// critical time points alone (equation 8); the paper uses two neighbours (Section 4).
    NearMaxima(usize),
}

/// A constraint g ≤ c, g ≥ c or g = c.
///
/// Normalized it reads
///
/// $$ \hat g = 1 + \frac{s\,g - β - s\,c}{σ} \le 1 , $$
///
/// with s = −1 for [`Side::AtLeast`] and 1 otherwise, the [bound variable](Self::bound) β if there is one, and the scale
/// σ. The scale is |c| unless given, so that ĝ = g/c for a positive upper limit and the violation (18) is (g − c)/c. With
/// c = 0 it is 1 in the unit of g.
///
/// # Examples
///
/// ```
/// use linkwright_optimization::problem::{Constraint, Quantity, Side};
/// let [upper, lower] = Constraint::between("travel", [-0.5, 1.0], Quantity::response(0, 0));
/// assert_eq!((upper.side, upper.limit), (Side::AtMost, 1.0));
/// assert_eq!((lower.side, lower.limit, lower.pair.as_deref()), (Side::AtLeast, -0.5, Some("travel")));
/// ```
#[derive(Clone)]
#[non_exhaustive]
pub struct Constraint {
    /// Name, unique in the problem.
    pub name: String,
    /// Constrained quantity g.
    pub quantity: Quantity,
    /// Upper limit, lower limit or equality.
    pub side: Side,
    /// Limit c, in the unit of g.
    pub limit: f64,
    /// Unit of g for tables, if g is not a response; may be empty.
    pub unit: String,
    /// Index of a design variable β that widens the limit: g ≤ c + β, or g ≥ c − β.
    pub bound: Option<usize>,
    /// Scale σ > 0 of the normalization, in the unit of g.
    pub scale: f64,
    /// First and last time at which the constraint holds, in the unit of the grid; the whole grid by default.
    pub window: Option<[f64; 2]>,
    /// Name of the two-sided constraint of which this is one side.
    pub pair: Option<String>,
    /// Selection of time points; `None` for that of the method.
    pub selection: Option<Selection>,
    /// True if the constraint also applies at all times between the time points.
    pub is_continuous: bool,
}

impl Constraint {
    /// g ≤ `limit`, normalized by |limit|, or by 1 if the limit is zero.
    pub fn at_most(name: impl Into<String>, limit: f64, quantity: Quantity) -> Self {
        Self::new(name.into(), Side::AtMost, limit, quantity)
    }

    /// g ≥ `limit`, normalized by |limit|, or by 1 if the limit is zero.
    pub fn at_least(name: impl Into<String>, limit: f64, quantity: Quantity) -> Self {
        Self::new(name.into(), Side::AtLeast, limit, quantity)
    }

    /// g = `value`, normalized like an inequality: ĝ = 1 if it is satisfied, and |ĝ − 1| is its violation.
    ///
    /// Equalities are always retained; a time-dependent one applies at every time point.
    pub fn equal(name: impl Into<String>, value: f64, quantity: Quantity) -> Self {
        Self::new(name.into(), Side::Equal, value, quantity)
    }

    /// `lower` ≤ g ≤ `upper` as a pair of constraints, `{name} upper` and `{name} lower`.
    pub fn between(name: &str, [lower, upper]: [f64; 2], quantity: Quantity) -> [Self; 2] {
        [
            Self::at_most(format!("{name} upper"), upper, quantity.clone()).side_of(name),
            Self::at_least(format!("{name} lower"), lower, quantity).side_of(name),
        ]
    }

    fn new(name: String, side: Side, limit: f64, quantity: Quantity) -> Self {
        let scale = if limit == 0.0 { 1.0 } else { limit.abs() };
        Self {
            name,
            quantity,
            side,
            limit,
            unit: String::new(),
            bound: None,
            scale,
            window: None,
            pair: None,
            selection: None,
            is_continuous: false,
        }
    }

    fn side_of(self, pair: &str) -> Self {
        Self { pair: Some(pair.to_owned()), ..self }
    }

    /// Applies the constraint at all times of the grid's interval, not only at the time points.
    ///
    /// Local maxima between the time points are computed by the analysis if it offers responses in
    /// [continuous time](super::ContinuousTime), and otherwise from polynomials through the time points. A peak that begins
    /// and ends between two time points is missed. The approximate problem has one row for each peak.
    #[must_use]
    pub fn in_continuous_time(self) -> Self {
        Self { is_continuous: true, ..self }
    }

    /// Restricts the constraint to time points from `from` to `to`, both included, in the unit of the grid.
    ///
    /// At the other time points [`Evaluation`](super::Evaluation) stores ĝ = 0, and the approximate problem has no row.
    #[must_use]
    pub fn during(self, from: f64, to: f64) -> Self {
        Self { window: Some([from, to]), ..self }
    }

    /// Widens the limit by design variable number `variable`, β: g ≤ c + β, or g ≥ c − β.
    #[must_use]
    pub fn bounded_by(self, variable: usize) -> Self {
        Self { bound: Some(variable), ..self }
    }

    /// Replaces the scale of normalization, in the unit of g.
    #[must_use]
    pub fn scaled_by(self, scale: f64) -> Self {
        Self { scale, ..self }
    }

    /// Replaces the method's selection of time points.
    #[must_use]
    pub fn selecting(self, selection: Selection) -> Self {
        Self { selection: Some(selection), ..self }
    }

    /// True for g = c.
    pub fn is_equality(&self) -> bool {
        self.side == Side::Equal
    }

    /// s: −1 for a lower limit, 1 otherwise.
    pub fn sign(&self) -> f64 {
        if self.side == Side::AtLeast { -1.0 } else { 1.0 }
    }

    /// s g − β, the part of the inequality that depends on the design.
    pub fn signed(&self) -> SignedQuantity<'_> {
        SignedQuantity { quantity: &self.quantity, sign: self.sign(), bound: self.bound }
    }

    /// s c, the constant part of the inequality.
    pub fn signed_limit(&self) -> f64 {
        self.sign() * self.limit
    }

    /// c = ĝ − 1 from the [signed quantity](Self::signed).
    pub fn residual<S: ProblemScalar>(&self, signed: S) -> S {
        (signed - self.signed_limit()) / self.scale
    }

    /// ĝ from the [signed quantity](Self::signed).
    pub fn normalized<S: ProblemScalar>(&self, signed: S) -> S {
        self.residual(signed) + 1.0
    }

    /// Numbers of the points of `grid` inside the [window](Self::window).
    pub fn points_in(&self, grid: &TimeGrid) -> Range<usize> {
        self.window.map_or(0..grid.len(), |[from, to]| grid.points_between(from, to))
    }
}
