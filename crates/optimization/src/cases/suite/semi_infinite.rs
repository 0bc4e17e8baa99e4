//! Semi-infinite problems and Chebyshev fits, with their constraints on a grid of 101 points.
//!
//! The optima are those of the grid; the published ones, of all t, differ in the fourth digit.
//!
//! # Sources
//!
//! * Coope & Watson, *Math. Program.* 32 (1985) 337–356; Watson, *Numerical experiments with globally convergent methods for
//!   semi-infinite programming problems* (1983).
//! * Chebyshev fits: Powell, *Approximation Theory and Methods* (1981).

use super::Suite;
use super::statement::{FREE, problems, sq, sum};
use crate::cases::KnownSolution::Optima;
use crate::cases::Optimum;
use autodiff::Scalar;
use std::f64::consts::{FRAC_PI_2, TAU};

const COOPE_WATSON: &str = "Coope & Watson, Math. Program. 32 (1985) 337-356";

const INF: f64 = f64::INFINITY;

/// The optimum on the grid.
const fn grid(objective: f64, design: &'static [f64]) -> Optimum {
    Optimum::computed(objective, design, "SciPy's SLSQP on the same points")
}

/// Σ xₖ tᵏ.
fn polynomial<S: Scalar>(x: &[S], t: S) -> S {
    x.iter().rev().fold(S::from(0.0), |value, &x| value * t + x)
}

/// Σ xᵢ/i.
fn harmonic<S: Scalar>(x: &[S]) -> S {
    sum(x.iter().enumerate().map(|(i, &x)| x / (i + 1) as f64))
}

problems! {
    COOPE_WATSON, Suite::Time;

    quartic_in_t as "watson-1" "Two variables, rows quartic in t"
        start [-1.0, -1.0];
        for all t in [0.0, 1.0];
        minimize |[x1, x2], t| sq(x1) / 3.0 + sq(x2) + x1 * 0.5;
        subject to [at_most(sq(-sq(x1) * sq(t) + 1.0) - x1 * sq(t) - sq(x2) + x2)];
        solution Optima(&[grid(0.194_466_011_250_105_5, &[-0.75, -0.618_033_988_75])]);
    exponential_rows as "watson-3" "Exponentials and a sine, three variables"
        start [1.0, 1.0, 1.0];
        for all t in [0.0, 1.0];
        minimize |[x1, x2, x3], t| sq(x1) + sq(x2) + sq(x3);
        subject to [at_most(x1 + x2 * (x3 * t).exp() + (t * 2.0).exp() - (t * 4.0).sin() * 2.0)];
        solution Optima(&[grid(5.334_687_280_051, &[-0.213_312_549_46, -1.361_450_468_6, 1.853_547_317_4])]);
    tangent_3 as "tangent-3" "Quadratic above the tangent"
        start [0.0; 3];
        for all t in [0.0, 1.0];
        minimize |ref x, t| harmonic(x);
        subject to [at_most(t.tan() - polynomial(x, t))];
        solution Optima(&[grid(0.649_031_108_253_05, &[0.090_178_201_346, 0.418_658_394_82, 1.048_571_128_5])]);
    tangent_6 as "tangent-6" "Polynomial of degree five above the tangent"
        start [0.0; 6];
        for all t in [0.0, 1.0];
        minimize |ref x, t| harmonic(x);
        subject to [at_most(t.tan() - polynomial(x, t))];
        solution Optima(&[grid(0.616_084_455_424_676, &[0.0, 1.023_141_727_7, -0.240_166_787_39, 1.222_056_919_3, -1.390_230_598_9, 0.942_606_463_97])]);
    sum_of_exponentials as "watson-5" "Exponential objective, parabola above a bell curve"
        start [1.0, 0.5, 0.0];
        for all t in [0.0, 1.0];
        minimize |[x1, x2, x3], t| x1.exp() + x2.exp() + x3.exp();
        subject to [at_most((sq(t) + 1.0).recip() - x1 - x2 * t - x3 * sq(t))];
        solution Optima(&[grid(4.301_157_877_667_886, &[1.006_451_149, -0.125_418_084_74, -0.381_033_064_28])]);
    freudenstein_roth as "watson-6" "Freudenstein & Roth's function"
        start [1.0, -1.0];
        for all t in [0.0, 1.0];
        minimize |[x1, x2], t| sq(x1 - x2 * 2.0 + sq(x2) * 5.0 - x2.powi(3) - 13.0)
            + sq(x1 - x2 * 14.0 + sq(x2) + x2.powi(3) - 29.0);
        subject to [at_most(sq(x1) + x2 * sq(t) * 2.0 + (x1 + x2).exp() - t.exp())];
        solution Optima(&[grid(97.158_852_437_685_5, &[0.719_961_387_76, -1.450_487_330_6])]);
    circle_of_tangents as "tangents-of-a-circle" "Linear program: 101 tangents of a circle"
        start [0.0, 0.0];
        for all t in [0.0, FRAC_PI_2];
        minimize |[x1, x2], t| -x1 - x2 * 2.0;
        subject to [at_most(x1 * t.cos() + x2 * t.sin() - 1.0)];
        solution Optima(&[grid(-2.236_136_868_074_761_5, &[0.446_992_406_97, 0.894_572_230_55])]);
    enclosing_ellipse as "enclosing-ellipse" "Least ellipse around a closed curve"
        start [3.0, 3.0];
        within [(0.1, INF)];
        for all t in [0.0, TAU];
        minimize |[x1, x2], t| x1 * x2;
        subject to [at_most({
            let radius = (t * 3.0).cos() * 0.3 + 1.0;
            sq(radius * t.cos() / x1) + sq(radius * t.sin() / x2) - 1.0
        })];
        solution Optima(&[grid(1.688_998_041_830_271, &[1.3, 1.299_229_262_9])]);
    chebyshev_cubic as "chebyshev-cubic" "Quadratic nearest to t³ on [-1, 1]"
        start [1.0, 1.0, 1.0, 2.0];
        within [FREE, FREE, FREE, (0.0, INF)];
        for all t in [-1.0, 1.0];
        minimize |[x1, x2, x3, z], t| z;
        subject to [
            at_most(polynomial(&[x1, x2, x3], t) - t.powi(3) - z),
            at_most(t.powi(3) - polynomial(&[x1, x2, x3], t) - z),
        ];
        solution Optima(&[Optimum::computed(0.25, &[0.0, 0.75, 0.0, 0.25], "Chebyshev's polynomial of degree three")]);
    chebyshev_exponential as "chebyshev-exponential" "Cubic nearest to exp t on [0, 1]"
        start [1.0, 1.0, 0.0, 0.0, 1.0];
        for all t in [0.0, 1.0];
        minimize |[x1, x2, x3, x4, z], t| z;
        subject to [
            at_most(polynomial(&[x1, x2, x3, x4], t) - t.exp() - z),
            at_most(t.exp() - polynomial(&[x1, x2, x3, x4], t) - z),
        ];
        solution Optima(&[grid(5.447_076_107_666_4e-4, &[0.999_455_292_39, 1.016_603_287_7, 0.421_699_331_45, 0.279_979_209_27, 5.447_076_107_7e-4])]);
    chebyshev_rational as "chebyshev-rational" "Rational function nearest to exp(-t) on [0, 2]"
        start [1.0, 0.0, 0.5, 0.5];
        for all t in [0.0, 2.0];
        minimize |[x1, x2, x3, z], t| z;
        subject to [
            at_most((x1 + x2 * t) / (x3 * t + 1.0) - (-t).exp() - z),
            at_most((-t).exp() - (x1 + x2 * t) / (x3 * t + 1.0) - z),
        ];
        solution Optima(&[grid(0.007_714_211_458_169, &[1.007_714_211_5, -0.339_860_515_91, 0.785_027_523_56, 0.007_714_211_458_2])]);
    chebyshev_oscillation as "chebyshev-oscillation" "Damped oscillation nearest to cos(2t)/(1 + t) on [0, 4]"
        start [0.5, 2.0, 1.0, 1.0];
        within [FREE, FREE, FREE, (0.0, INF)];
        for all t in [0.0, 4.0];
        minimize |[x1, x2, x3, z], t| z;
        subject to [
            at_most(x3 * (-x1 * t).exp() * (x2 * t).cos() - (t * 2.0).cos() / (t + 1.0) - z),
            at_most((t * 2.0).cos() / (t + 1.0) - x3 * (-x1 * t).exp() * (x2 * t).cos() - z),
        ];
        solution Optima(&[grid(
            0.047_592_393_785_766,
            &[0.504_207_657_791, 1.987_047_872_7, 0.952_407_606_214, 0.047_592_393_785_8],
        )]);
}
