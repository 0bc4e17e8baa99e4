//! Statements of small problems, and the macro that writes a list of them.

use super::super::Optimum;
use crate::problem::{
    ClosedForm, Constraint, DesignVariable, Function, Point, Problem, ProblemBuilder, Quantity, Side, TimeGrid,
};
use autodiff::Scalar;
use error::Result;

/// Source of many problems.
pub(super) const HOCK_SCHITTKOWSKI: &str = "Hock & Schittkowski, Test Examples for Nonlinear Programming Codes (1981)";
/// Bounds of a variable without bounds.
pub(super) const FREE: (f64, f64) = (f64::NEG_INFINITY, f64::INFINITY);
/// Bounds of a variable that may not be negative.
pub(super) const POSITIVE: (f64, f64) = (0.0, f64::INFINITY);

/// Everything about a problem except its formulas.
#[derive(Clone, Copy)]
pub(super) struct Statement {
    /// Name on the command line.
    pub name: &'static str,
    /// Start design; a component outside its bounds is moved to the nearest bound.
    pub start: &'static [f64],
    /// Bounds of each variable; one pair for all, none for free variables.
    pub bounds: &'static [(f64, f64)],
    /// Kind of each row.
    pub rows: &'static [Side],
    /// First and last value of the parameter t for rows that hold for all t of an interval.
    pub interval: Option<[f64; 2]>,
}

/// Number of points of an interval.
pub(super) const POINTS: usize = 101;

impl Statement {
    /// Builds the problem, with this number of points of the interval: response 0 is the objective, response i is row i, with limit
    /// zero.
    pub fn build(&self, points: usize, formulas: impl ClosedForm + 'static) -> Result<Problem> {
        let mut parts = self.variables();
        let grid = match self.interval {
            Some([from, to]) => Some(parts.grid(TimeGrid::uniform(from, to, points)?)),
            None => None,
        };
        let objective = parts.constant("f", "");
        parts.minimize("f", "", Quantity::response(None, objective));
        for (i, side) in self.rows.iter().enumerate() {
            let name = format!("g{}", i + 1);
            let row = match grid {
                Some(grid) => parts.transient(&name, "", grid),
                None => parts.constant(&name, ""),
            };
            parts.subject_to(on(*side, name, Quantity::response(grid, row)));
        }
        parts.build_analytic(formulas)
    }

    /// Builds the problem without responses: the formulas are objective and rows.
    pub fn build_explicit(&self, formulas: impl ClosedForm + Copy + 'static) -> Result<Problem> {
        let mut parts = self.variables();
        parts.minimize("f", "", Quantity::plain(DesignFormula { formulas, h: 0 }));
        for (i, side) in self.rows.iter().enumerate() {
            parts.subject_to(on(*side, format!("g{}", i + 1), Quantity::plain(DesignFormula { formulas, h: i + 1 })));
        }
        parts.build_analytic(formulas)
    }

    fn variables(&self) -> ProblemBuilder {
        let mut parts = ProblemBuilder::new(self.name);
        for (j, &start) in self.start.iter().enumerate() {
            let (lower, upper) = match self.bounds {
                [] => FREE,
                [all] => *all,
                each => each[j],
            };
            let name = format!("x{}", j + 1);
            parts.variable(DesignVariable::new(name, "", start.max(lower).min(upper)).within(lower, upper));
        }
        parts
    }
}

/// A row with limit zero.
fn on(side: Side, name: String, quantity: Quantity) -> Constraint {
    match side {
        Side::AtMost => Constraint::at_most(name, 0.0, quantity),
        Side::AtLeast => Constraint::at_least(name, 0.0, quantity),
        Side::Equal => Constraint::equal(name, 0.0, quantity),
    }
}

/// A formula as a function of the design.
#[derive(Clone, Copy)]
struct DesignFormula<F> {
    formulas: F,
    h: usize,
}

impl<F: ClosedForm + Copy + 'static> Function for DesignFormula<F> {
    fn at<S: Scalar>(&self, point: &Point<S>) -> S {
        self.formulas.response(self.h, point.design, S::from(f64::NAN))
    }
}

/// The square of a number.
pub(super) fn sq<S: Scalar>(x: S) -> S {
    x * x
}

/// The sum of the terms.
pub(super) fn sum<S: Scalar>(terms: impl IntoIterator<Item = S>) -> S {
    terms.into_iter().fold(S::from(0.0), |sum, term| sum + term)
}

/// Σ cⱼ xⱼ.
pub(super) fn dot<S: Scalar>(c: &[f64], x: &[S]) -> S {
    sum(c.iter().zip(x).map(|(&c, &x)| x * c))
}

/// A published optimum of an entry of the list.
pub(super) const fn at(objective: f64, design: &'static [f64]) -> Optimum {
    Optimum::published(objective, design, "as published, here to more digits")
}

/// Writes a list of problems as catalogue entries.
///
/// A problem has a name, a title, its start, optionally bounds and an interval of t, the objective, optionally rows
/// `at_least(g)` (g ≥ 0), `at_most(g)` (g ≤ 0) and `equal(h)` (h = 0), and its solution. Formulas are written once over the scalar;
/// they are compiled once for each scalar, and the analysis once for the list.
macro_rules! problems {
    ($source:expr, $suite:expr;
     $($name:ident $(as $shown:literal)? $title:literal
        start $start:expr;
        $(within $bounds:expr;)?
        $(for all t in $interval:expr;)?
        minimize |$x:pat_param $(, $t:ident)?| $objective:expr;
        $(subject to [$($side:ident($row:expr)),* $(,)?];)?
        solution $solution:expr;)*) => {
        /// The formulas of this list.
        #[allow(non_camel_case_types)]
        #[derive(Clone, Copy)]
        enum FormulaList { $($name),* }

        impl $crate::problem::ClosedForm for FormulaList {
            fn response<S: autodiff::Scalar>(&self, h: usize, x: &[S], t: S) -> S {
                match self { $(Self::$name => $name(h, x, t)),* }
            }
        }

        $(#[allow(unreachable_patterns, unused_variables, clippy::ptr_arg)]
        fn $name<S: autodiff::Scalar>(h: usize, x: &[S], t: S) -> S {
            match *x {
                $x => {
                    $(let $t = t;)?
                    if h == 0 { return S::from(0.0) + $objective; }
                    $(let rows: &[S] = &[$($row),*]; return rows[h - 1];)?
                    #[allow(unreachable_code)]
                    S::from(f64::NAN)
                }
                _ => S::from(f64::NAN),
            }
        })*

        /// The problems of this list.
        pub(in crate::cases) static PROBLEMS: &[$crate::cases::CatalogueEntry] = &[$({
            const STATEMENT: $crate::cases::suite::statement::Statement = {
                #[allow(unused_mut)]
                let mut statement = $crate::cases::suite::statement::Statement {
                    name: stringify!($name),
                    start: &$start,
                    bounds: &[],
                    rows: &[],
                    interval: None,
                };
                $(statement.name = $shown;)?
                $(statement.bounds = &$bounds;)?
                $(statement.interval = Some($interval);)?
                $(statement.rows = &[$($crate::cases::suite::statement::side!($side)),*];)?
                statement
            };
            let entry = $crate::cases::CatalogueEntry::new(
                STATEMENT.name,
                $title,
                $source,
                || STATEMENT.build($crate::cases::suite::statement::POINTS, FormulaList::$name),
            );
            const SOLUTION: $crate::cases::KnownSolution = $solution;
            let entry = entry.of($suite).solved_by(SOLUTION);
            if STATEMENT.interval.is_some() {
                entry.over_time().on_points(|points| STATEMENT.build(points, FormulaList::$name))
            } else {
                entry.explicitly(|| STATEMENT.build_explicit(FormulaList::$name))
            }
        }),*];
    };
}

/// The kind of a row.
macro_rules! side {
    (at_least) => {
        $crate::problem::Side::AtLeast
    };
    (at_most) => {
        $crate::problem::Side::AtMost
    };
    (equal) => {
        $crate::problem::Side::Equal
    };
}

pub(super) use {problems, side};
