//! Problems of Hock & Schittkowski with bounds only.

use super::Suite;
use super::statement::{FREE, HOCK_SCHITTKOWSKI, at, problems, sq, sum};
use crate::cases::KnownSolution::Optima;
use autodiff::Scalar;
use std::f64::consts::PI;

const INF: f64 = f64::INFINITY;

/// 100 (b − a²)² + (1 − a)².
pub(super) fn rosenbrock<S: Scalar>(a: S, b: S) -> S {
    sq(b - a * a) * 100.0 + sq(-a + 1.0)
}

/// HS 25: 99 residuals of exp(−(uᵢ − x₂)^x₃ / x₁) at i/100.
fn weibull<S: Scalar>(x: &[S]) -> S {
    let residual = |i: usize| {
        let level = 0.01 * i as f64;
        let u = 25.0 + (-50.0 * level.ln()).powf(2.0 / 3.0);
        // (u − x₂)^x₃
        let power = ((-x[1] + u).ln() * x[2]).exp();
        sq((-power / x[0]).exp() - level)
    };
    sum((1..100).map(residual))
}

problems! {
    HOCK_SCHITTKOWSKI, Suite::HockSchittkowski;

    hs1 "Rosenbrock's function, bound not active"
        start [-2.0, 1.0];
        within [FREE, (-1.5, INF)];
        minimize |[x1, x2]| rosenbrock(x1, x2);
        solution Optima(&[at(0.0, &[1.0, 1.0])]);
    hs2 "Rosenbrock's function, bound active"
        start [-2.0, 1.0];
        within [FREE, (1.5, INF)];
        minimize |[x1, x2]| rosenbrock(x1, x2);
        solution Optima(&[at(0.050_426_188_0, &[1.224_370_749, 1.5]), at(4.941_229_318, &[-1.221_026_5, 1.5])]);
    hs3 "Nearly linear function, flat in one direction"
        start [10.0, 1.0];
        within [FREE, (0.0, INF)];
        minimize |[x1, x2]| x2 + sq(x2 - x1) * 1e-5;
        solution Optima(&[at(0.0, &[0.0, 0.0])]);
    hs4 "Cubic with both bounds active"
        start [1.125, 0.125];
        within [(1.0, INF), (0.0, INF)];
        minimize |[x1, x2]| (x1 + 1.0).powi(3) / 3.0 + x2;
        solution Optima(&[at(8.0 / 3.0, &[1.0, 0.0])]);
    hs5 "McCormick's function"
        start [0.0, 0.0];
        within [(-1.5, 4.0), (-3.0, 3.0)];
        minimize |[x1, x2]| (x1 + x2).sin() + sq(x1 - x2) - x1 * 1.5 + x2 * 2.5 + 1.0;
        solution Optima(&[
            at(-1.913_222_954_981_037, &[0.5 - PI / 3.0, -0.5 - PI / 3.0]),
            at(1.228_369_698_608_757, &[0.5 + 2.0 * PI / 3.0, -0.5 + 2.0 * PI / 3.0]),
        ]);
    hs25 "Weibull distribution, vanishing gradient at the start"
        start [100.0, 12.5, 3.0];
        within [(0.1, 100.0), (0.0, 25.6), (0.0, 5.0)];
        minimize |ref x| weibull(x);
        solution Optima(&[at(0.0, &[50.0, 25.0, 1.5])]);
    hs38 "Colville's fourth problem (Wood's function)"
        start [-3.0, -1.0, -3.0, -1.0];
        within [(-10.0, 10.0)];
        minimize |[x1, x2, x3, x4]| rosenbrock(x1, x2) + sq(x4 - x3 * x3) * 90.0 + sq(-x3 + 1.0)
            + (sq(x2 - 1.0) + sq(x4 - 1.0)) * 10.1 + (x2 - 1.0) * (x4 - 1.0) * 19.8;
        solution Optima(&[at(0.0, &[1.0, 1.0, 1.0, 1.0])]);
    hs45 "Product of five variables"
        start [2.0, 2.0, 2.0, 2.0, 2.0];
        within [(0.0, 1.0), (0.0, 2.0), (0.0, 3.0), (0.0, 4.0), (0.0, 5.0)];
        minimize |[x1, x2, x3, x4, x5]| -x1 * x2 * x3 * x4 * x5 / 120.0 + 2.0;
        solution Optima(&[at(1.0, &[1.0, 2.0, 3.0, 4.0, 5.0])]);
    hs110 "Logarithms and a product of powers"
        start [9.0; 10];
        within [(2.001, 9.999)];
        minimize |ref x| sum(x.iter().map(|&x| sq((x - 2.0).ln()) + sq((-x + 10.0).ln())))
            - x.iter().fold(S::from(1.0), |product, &x| product * x).powf(0.2);
        solution Optima(&[at(-45.778_469_707_4, &[9.350_265_8; 10])]);
}
