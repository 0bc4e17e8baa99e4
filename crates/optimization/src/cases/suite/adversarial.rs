//! Small problems that mislead optimizers: starts far away or near zero, unusual scales, no solution, no multipliers, functions that
//! are undefined at some designs, narrow and flat valleys. The optima are exact.

use super::Suite;
use super::hs_bounds::rosenbrock;
use super::statement::{POSITIVE, problems, sq, sum};
use crate::cases::KnownSolution::{Infeasible, Optima, Unbounded};
use crate::cases::{CatalogueEntry, Optimum};
use crate::function;
use crate::problem::{DesignVariable, Problem, ProblemBuilder, Quantity};
use std::f64::consts::{FRAC_1_SQRT_2, LN_10};

const OURS: &str = "ours";
/// ln 20.
const LN_20: f64 = 2.995_732_273_553_991;

/// An exact optimum.
const fn exact(objective: f64, design: &'static [f64]) -> Optimum {
    Optimum::computed(objective, design, "exact")
}

problems! {
    OURS, Suite::Adversarial;

    far_minimum as "far-minimum" "(x - 1000)² from 0.001: the start says nothing about lengths"
        start [1e-3];
        minimize |[x]| sq(x - 1000.0);
        solution Optima(&[exact(0.0, &[1000.0])]);
    small_objective as "small-objective" "HS 43 with its objective times 1e-6"
        start [0.0; 4];
        minimize |[x1, x2, x3, x4]| (sq(x1) + sq(x2) + sq(x3) * 2.0 + sq(x4) - x1 * 5.0 - x2 * 5.0 - x3 * 21.0
            + x4 * 7.0) * 1e-6;
        subject to [
            at_least(-sq(x1) - sq(x2) - sq(x3) - sq(x4) - x1 + x2 - x3 + x4 + 8.0),
            at_least(-sq(x1) - sq(x2) * 2.0 - sq(x3) - sq(x4) * 2.0 + x1 + x4 + 10.0),
            at_least(-sq(x1) * 2.0 - sq(x2) - sq(x3) - x1 * 2.0 + x2 + x4 + 5.0),
        ];
        solution Optima(&[exact(-44e-6, &[0.0, 1.0, 2.0, -1.0])]);
    unbounded "Linear objective in a parabola, without lower limit"
        start [2.0, 1.0];
        minimize |[x1, x2]| -x1 - x2;
        subject to [at_least(x1 - sq(x2))];
        solution Unbounded;
    infeasible "A disc and a half plane without common point"
        start [0.5, 0.0];
        minimize |[x1, x2]| x1;
        subject to [at_most(sq(x1) + sq(x2) - 1.0), at_least(x1 + x2 - 3.0)];
        solution Infeasible;
    infeasible_equality as "infeasible-equality" "An equation without real solution"
        start [3.0, 1.0];
        minimize |[x1, x2]| sq(x1 - 2.0) + sq(x2);
        subject to [equal(sq(x1) + 1.0 + x2 * 0.1), at_most(sq(x2) - 4.0)];
        solution Infeasible;
    waechter_biegler as "waechter-biegler" "Line searches end at an infeasible point"
        start [-2.0, 3.0, 1.0];
        within [(f64::NEG_INFINITY, f64::INFINITY), POSITIVE, POSITIVE];
        minimize |[x1, x2, x3]| x1;
        subject to [equal(sq(x1) - x2 - 1.0), equal(x1 - x3 - 0.5)];
        solution Optima(&[exact(1.0, &[1.0, 0.0, 0.5])]);
    narrow_valley as "narrow-valley" "Rosenbrock's function with factor 10 000 in the valley's walls"
        start [-1.2, 1.0];
        minimize |[x1, x2]| sq(x2 - sq(x1)) * 1e4 + sq(x1 - 1.0);
        solution Optima(&[exact(0.0, &[1.0, 1.0])]);
    long_valley as "long-valley" "Chained Rosenbrock function in six variables"
        start [-1.2, 1.0, -1.2, 1.0, -1.2, 1.0];
        minimize |ref x| sum((0..5).map(|j| rosenbrock(x[j], x[j + 1])));
        solution Optima(&[
            exact(0.0, &[1.0; 6]),
            Optimum::computed(
                3.973_940_500_976,
                &[-0.986_574_56, 0.983_397_38, 0.972_105_02, 0.947_434_25, 0.898_645_17, 0.807_563_13],
                "Newton's method",
            ),
        ]);
    logarithm "x - 10 ln x from 0.1, undefined for negative x, which no bound forbids"
        start [0.1];
        minimize |[x]| x - x.ln() * 10.0;
        solution Optima(&[exact(10.0 - 10.0 * LN_10, &[10.0])]);
    oblique_saddle as "oblique-saddle" "Valley with two minima, from a point of its plane of symmetry"
        start [1.0, 1.0];
        minimize |[x1, x2]| sq(x1 + x2) * 0.5 - sq(x1 - x2) * 0.25 + (x1 - x2).powi(4) * 0.0625;
        solution Optima(&[
            exact(-0.25, &[FRAC_1_SQRT_2, -FRAC_1_SQRT_2]),
            exact(-0.25, &[-FRAC_1_SQRT_2, FRAC_1_SQRT_2]),
        ]);
    saddle_in_a_plane as "saddle-in-a-plane" "A steep valley across the start's line, and along it two minima"
        start [0.0, 0.0, 0.0];
        minimize |[x1, x2, x3]| {
            let (steep, along) = (x1 - x2, x1 + x2 - x3 * 2.0);
            sq(x1 + x2 + x3 - 3.0) + sq(steep) * 10.0 - sq(along) + along.powi(4)
        };
        solution Optima(&[
            exact(-0.25, &[1.117_851_130_197_757_9, 1.117_851_130_197_757_9, 0.764_297_739_604_484]),
            exact(-0.25, &[0.882_148_869_802_242, 0.882_148_869_802_242, 1.235_702_260_395_516]),
        ]);
    maximum_on_a_line as "maximum-on-a-line" "Product of two lengths of given sum, from the largest product"
        start [1.0, 1.0];
        within [(0.0, 2.0)];
        minimize |[x1, x2]| x1 * x2;
        subject to [equal(x1 + x2 - 2.0)];
        solution Optima(&[exact(0.0, &[2.0, 0.0]), exact(0.0, &[0.0, 2.0])]);
    small_and_large_variables as "small-and-large-variables" "Variables of 1e-6 and 1e6"
        start [1e-7, 1e5];
        minimize |[x1, x2]| sq(x1 * 1e6 - 2.0) + sq(x2 * 1e-6 - 3.0);
        subject to [at_most(x1 * 1e6 + x2 * 1e-6 - 4.0)];
        solution Optima(&[exact(0.5, &[1.5e-6, 2.5e6])]);
    small_and_large_rows as "small-and-large-rows" "HS 22 with rows times 1e8 and 1e-8"
        start [2.0, 2.0];
        minimize |[x1, x2]| sq(x1 - 2.0) + sq(x2 - 1.0);
        subject to [at_least((-x1 - x2 + 2.0) * 1e8), at_least((-sq(x1) + x2) * 1e-8)];
        solution Optima(&[exact(1.0, &[1.0, 1.0])]);
    redundant_equalities as "redundant-equalities" "Three equations of rank two"
        start [10.0, -5.0, 0.0];
        minimize |[x1, x2, x3]| sq(x1 - 2.0) + sq(x2) + sq(x3);
        subject to [equal(x1 + x2 + x3 - 3.0), equal(x1 - x2), equal(x1 * 2.0 + x3 - 3.0)];
        solution Optima(&[exact(7.0 / 3.0, &[4.0 / 3.0, 4.0 / 3.0, 1.0 / 3.0])]);
    tangent_circles as "tangent-circles" "Two discs with one common point, where no multipliers exist"
        start [1.0, 2.0];
        minimize |[x1, x2]| x2;
        subject to [at_most(sq(x1 - 1.0) + sq(x2) - 1.0), at_most(sq(x1 + 1.0) + sq(x2) - 1.0)];
        solution Optima(&[exact(0.0, &[0.0, 0.0])]);
    quartic "Fourth powers: the Hessian vanishes at the optimum"
        start [0.0; 4];
        minimize |[x1, x2, x3, x4]| (x1 - 1.0).powi(4) + (x2 - 2.0).powi(4) + (x3 - 3.0).powi(4) + (x4 - 4.0).powi(4);
        solution Optima(&[exact(0.0, &[1.0, 2.0, 3.0, 4.0])]);
    maratos "Maratos's example: a full step increases objective and violation"
        start [0.696_706_709_347_165_4, 0.717_356_090_899_522_8];
        minimize |[x1, x2]| (sq(x1) + sq(x2) - 1.0) * 2.0 - x1;
        subject to [equal(sq(x1) + sq(x2) - 1.0)];
        solution Optima(&[exact(-1.0, &[1.0, 0.0])]);
    saddle "Double well from beside its saddle"
        start [1e-3, 1.0];
        minimize |[x1, x2]| x1.powi(4) * 0.25 - sq(x1) * 0.5 + sq(x2);
        solution Optima(&[exact(-0.25, &[1.0, 0.0])]);
    nearly_linear as "nearly-linear" "Square roots, nearly linear at the start"
        start [1e4, -1e4];
        minimize |[x1, x2]| (sq(x1 - 1.0) + 1.0).sqrt() + (sq(x2 - 2.0) + 1.0).sqrt();
        solution Optima(&[exact(2.0, &[1.0, 2.0])]);
    exponential_growth as "exponential-growth" "exp x - 20 x from 15, where the exponential is 3e6"
        start [15.0];
        minimize |[x]| x.exp() - x * 20.0;
        solution Optima(&[exact(20.0 - 20.0 * LN_20, &[LN_20])]);
    sine_equality as "sine-equality" "Equality with many solutions from a start with nearly no slope"
        start [1.6, 3.0];
        minimize |[x1, x2]| sq(x1) + sq(x2 - 1.0);
        subject to [equal(x1.sin() - x2 * 0.5)];
        solution Optima(&[Optimum::computed(0.208_901_180_821_619, &[0.401_624_069_804, 0.781_827_390_867], "Newton's method")]);
}

/// An explicit objective that is undefined at some designs: asin(2 (k − 1)) + 4/k, defined for k in [0.5, 1.5].
fn arcsine_problem() -> error::Result<Problem> {
    let mut parts = ProblemBuilder::new("arcsine");
    parts.variable(DesignVariable::new("k", "", 0.6).within(0.1, 5.0));
    let objective = function!(|p| ((p.design[0] - 1.0) * 2.0).asin() + p.design[0].recip() * 4.0);
    parts.minimize("f", "", Quantity::plain(objective));
    parts.build_analytic(FormulaList::far_minimum)
}

/// Problems that need more than formulas of responses.
pub(in crate::cases) static EXPLICIT: &[CatalogueEntry] = &[CatalogueEntry::new(
    "arcsine",
    "asin(2 (k - 1)) + 4/k, explicit and undefined at most trial designs",
    OURS,
    arcsine_problem,
)
.of(Suite::Adversarial)
.solved_by(Optima(const { &[exact(3.719_337_625_264_788, &[1.283_511_903_646_034])] }))];
