//! Problems of Hock & Schittkowski with inequalities and no equalities, up to number 66.

use super::Suite;
use super::hs_bounds::rosenbrock;
use super::statement::{FREE, HOCK_SCHITTKOWSKI, POSITIVE, at, problems, sq};
use crate::cases::KnownSolution::Optima;
use std::f64::consts::{FRAC_1_SQRT_2, LN_10, SQRT_2};

const INF: f64 = f64::INFINITY;
const SQRT_3: f64 = 1.732_050_807_568_877_2;

problems! {
    HOCK_SCHITTKOWSKI, Suite::HockSchittkowski;

    hs10 "Linear objective in an ellipse"
        start [-10.0, 10.0];
        minimize |[x1, x2]| x1 - x2;
        subject to [at_least(-sq(x1) * 3.0 + x1 * x2 * 2.0 - sq(x2) + 1.0)];
        solution Optima(&[at(-1.0, &[0.0, 1.0])]);
    hs11 "Distance from a parabola"
        start [4.9, 0.1];
        minimize |[x1, x2]| sq(x1 - 5.0) + sq(x2) - 25.0;
        subject to [at_least(-sq(x1) + x2)];
        solution Optima(&[at(-8.498_464_223, &[1.234_774_2, 1.524_667_3])]);
    hs12 "Quadratic in an ellipse"
        start [0.0, 0.0];
        minimize |[x1, x2]| sq(x1) * 0.5 + sq(x2) - x1 * x2 - x1 * 7.0 - x2 * 7.0;
        subject to [at_least(-sq(x1) * 4.0 - sq(x2) + 25.0)];
        solution Optima(&[at(-30.0, &[2.0, 3.0])]);
    hs13 "Cusp of Kuhn & Tucker: no multipliers exist at the optimum"
        start [-2.0, -2.0];
        within [POSITIVE];
        minimize |[x1, x2]| sq(x1 - 2.0) + sq(x2);
        subject to [at_least((-x1 + 1.0).powi(3) - x2)];
        solution Optima(&[at(1.0, &[1.0, 0.0])]);
    hs15 "Rosenbrock's function with two quadratic rows"
        start [-2.0, 1.0];
        within [(f64::NEG_INFINITY, 0.5), FREE];
        minimize |[x1, x2]| rosenbrock(x1, x2);
        subject to [at_least(x1 * x2 - 1.0), at_least(x1 + sq(x2))];
        solution Optima(&[at(306.5, &[0.5, 2.0]), at(360.379_767_174, &[-0.792_123_220_5, -1.262_429_852])]);
    hs16 "Rosenbrock's function between parabolas"
        start [-2.0, 1.0];
        within [(-0.5, 0.5), (f64::NEG_INFINITY, 1.0)];
        minimize |[x1, x2]| rosenbrock(x1, x2);
        subject to [at_least(x1 + sq(x2)), at_least(sq(x1) + x2)];
        solution Optima(&[at(0.25, &[0.5, 0.25]), at(23.144_660_940_748, &[-0.5, FRAC_1_SQRT_2])]);
    hs17 "Rosenbrock's function, degenerate vertex"
        start [-2.0, 1.0];
        within [(-0.5, 0.5), (f64::NEG_INFINITY, 1.0)];
        minimize |[x1, x2]| rosenbrock(x1, x2);
        subject to [at_least(sq(x2) - x1), at_least(sq(x1) - x2)];
        solution Optima(&[at(1.0, &[0.0, 0.0])]);
    hs18 "Nearly flat in one variable"
        start [2.0, 2.0];
        within [(2.0, 50.0), (0.0, 50.0)];
        minimize |[x1, x2]| sq(x1) * 0.01 + sq(x2);
        subject to [at_least(x1 * x2 - 25.0), at_least(sq(x1) + sq(x2) - 25.0)];
        solution Optima(&[at(5.0, &[15.811_388_300_841_896, 1.581_138_830_084_189_7])]);
    hs19 "Two circles that nearly coincide"
        start [20.1, 5.84];
        within [(13.0, 100.0), (0.0, 100.0)];
        minimize |[x1, x2]| (x1 - 10.0).powi(3) + (x2 - 20.0).powi(3);
        subject to [
            at_least(sq(x1 - 5.0) + sq(x2 - 5.0) - 100.0),
            at_least(-sq(x2 - 5.0) - sq(x1 - 6.0) + 82.81),
        ];
        solution Optima(&[at(-6_961.813_875_6, &[14.095, 0.842_960_789_2])]);
    hs20 "Rosenbrock's function outside of a circle"
        start [-2.0, 1.0];
        within [(-0.5, 0.5), FREE];
        minimize |[x1, x2]| rosenbrock(x1, x2);
        subject to [at_least(x1 + sq(x2)), at_least(sq(x1) + x2), at_least(sq(x1) + sq(x2) - 1.0)];
        solution Optima(&[at(38.198_729_810_778_06, &[0.5, 0.866_025_403_784_438_6])]);
    hs21 "Quadratic with a linear row"
        start [-1.0, -1.0];
        within [(2.0, 50.0), (-50.0, 50.0)];
        minimize |[x1, x2]| sq(x1) * 0.01 + sq(x2) - 100.0;
        subject to [at_least(x1 * 10.0 - x2 - 10.0)];
        solution Optima(&[at(-99.96, &[2.0, 0.0])]);
    hs22 "Distance from a point, linear and quadratic row"
        start [2.0, 2.0];
        minimize |[x1, x2]| sq(x1 - 2.0) + sq(x2 - 1.0);
        subject to [at_least(-x1 - x2 + 2.0), at_least(-sq(x1) + x2)];
        solution Optima(&[at(1.0, &[1.0, 1.0])]);
    hs23 "Five rows, two of them active"
        start [3.0, 1.0];
        within [(-50.0, 50.0)];
        minimize |[x1, x2]| sq(x1) + sq(x2);
        subject to [
            at_least(x1 + x2 - 1.0),
            at_least(sq(x1) + sq(x2) - 1.0),
            at_least(sq(x1) * 9.0 + sq(x2) - 9.0),
            at_least(sq(x1) - x2),
            at_least(sq(x2) - x1),
        ];
        solution Optima(&[at(2.0, &[1.0, 1.0])]);
    hs24 "Cubic in a triangle"
        start [1.0, 0.5];
        within [POSITIVE];
        minimize |[x1, x2]| (sq(x1 - 3.0) - 9.0) * x2.powi(3) / (27.0 * SQRT_3);
        subject to [at_least(x1 / SQRT_3 - x2), at_least(x1 + x2 * SQRT_3), at_least(-x1 - x2 * SQRT_3 + 6.0)];
        solution Optima(&[at(-1.0, &[3.0, SQRT_3])]);
    hs29 "Largest box in an ellipsoid"
        start [1.0, 1.0, 1.0];
        minimize |[x1, x2, x3]| -x1 * x2 * x3;
        subject to [at_least(-sq(x1) - sq(x2) * 2.0 - sq(x3) * 4.0 + 48.0)];
        solution Optima(&[at(-16.0 * SQRT_2, &[4.0, 2.0 * SQRT_2, 2.0])]);
    hs30 "Distance from the axis of a cylinder"
        start [1.0, 1.0, 1.0];
        within [(1.0, 10.0), (-10.0, 10.0), (-10.0, 10.0)];
        minimize |[x1, x2, x3]| sq(x1) + sq(x2) + sq(x3);
        subject to [at_least(sq(x1) + sq(x2) - 1.0)];
        solution Optima(&[at(1.0, &[1.0, 0.0, 0.0])]);
    hs31 "Quadratic outside of a hyperbola"
        start [1.0, 1.0, 1.0];
        within [(-10.0, 10.0), (1.0, 10.0), (-10.0, 1.0)];
        minimize |[x1, x2, x3]| sq(x1) * 9.0 + sq(x2) + sq(x3) * 9.0;
        subject to [at_least(x1 * x2 - 1.0)];
        solution Optima(&[at(6.0, &[0.577_350_269_189_625_8, SQRT_3, 0.0])]);
    hs33 "Cubic between a cone and a sphere"
        start [0.0, 0.0, 3.0];
        within [POSITIVE, POSITIVE, (0.0, 5.0)];
        minimize |[x1, x2, x3]| (x1 - 1.0) * (x1 - 2.0) * (x1 - 3.0) + x3;
        subject to [at_least(sq(x3) - sq(x2) - sq(x1)), at_least(sq(x1) + sq(x2) + sq(x3) - 4.0)];
        solution Optima(&[at(SQRT_2 - 6.0, &[0.0, SQRT_2, SQRT_2])]);
    hs34 "Linear objective, nested exponentials"
        start [0.0, 1.05, 2.9];
        within [(0.0, 100.0), (0.0, 100.0), (0.0, 10.0)];
        minimize |[x1, x2, x3]| -x1;
        subject to [at_least(x2 - x1.exp()), at_least(x3 - x2.exp())];
        solution Optima(&[at(-0.834_032_445_247_956, &[0.834_032_445_247_956, LN_10, 10.0])]);
    hs35 "Beale's quadratic program"
        start [0.5, 0.5, 0.5];
        within [POSITIVE];
        minimize |[x1, x2, x3]| -x1 * 8.0 - x2 * 6.0 - x3 * 4.0 + sq(x1) * 2.0 + sq(x2) * 2.0 + sq(x3)
            + x1 * x2 * 2.0 + x1 * x3 * 2.0 + 9.0;
        subject to [at_least(-x1 - x2 - x3 * 2.0 + 3.0)];
        solution Optima(&[at(1.0 / 9.0, &[4.0 / 3.0, 7.0 / 9.0, 4.0 / 9.0])]);
    hs36 "Post office parcel with bounds"
        start [10.0, 10.0, 10.0];
        within [(0.0, 20.0), (0.0, 11.0), (0.0, 42.0)];
        minimize |[x1, x2, x3]| -x1 * x2 * x3;
        subject to [at_least(-x1 - x2 * 2.0 - x3 * 2.0 + 72.0)];
        solution Optima(&[at(-3300.0, &[20.0, 11.0, 15.0])]);
    hs37 "Post office parcel"
        start [10.0, 10.0, 10.0];
        within [(0.0, 42.0)];
        minimize |[x1, x2, x3]| -x1 * x2 * x3;
        subject to [at_least(-x1 - x2 * 2.0 - x3 * 2.0 + 72.0), at_least(x1 + x2 * 2.0 + x3 * 2.0)];
        solution Optima(&[at(-3456.0, &[24.0, 12.0, 12.0])]);
    hs43 "Rosen & Suzuki's problem"
        start [0.0, 0.0, 0.0, 0.0];
        minimize |[x1, x2, x3, x4]| sq(x1) + sq(x2) + sq(x3) * 2.0 + sq(x4) - x1 * 5.0 - x2 * 5.0 - x3 * 21.0 + x4 * 7.0;
        subject to [
            at_least(-sq(x1) - sq(x2) - sq(x3) - sq(x4) - x1 + x2 - x3 + x4 + 8.0),
            at_least(-sq(x1) - sq(x2) * 2.0 - sq(x3) - sq(x4) * 2.0 + x1 + x4 + 10.0),
            at_least(-sq(x1) * 2.0 - sq(x2) - sq(x3) - x1 * 2.0 + x2 + x4 + 5.0),
        ];
        solution Optima(&[at(-44.0, &[0.0, 1.0, 2.0, -1.0])]);
    hs44 "Konno's bilinear program with several vertices"
        start [0.0, 0.0, 0.0, 0.0];
        within [POSITIVE];
        minimize |[x1, x2, x3, x4]| x1 - x2 - x3 - x1 * x3 + x1 * x4 + x2 * x3 - x2 * x4;
        subject to [
            at_least(-x1 - x2 * 2.0 + 8.0),
            at_least(-x1 * 4.0 - x2 + 12.0),
            at_least(-x1 * 3.0 - x2 * 4.0 + 12.0),
            at_least(-x3 * 2.0 - x4 + 8.0),
            at_least(-x3 - x4 * 2.0 + 8.0),
            at_least(-x3 - x4 + 5.0),
        ];
        solution Optima(&[at(-15.0, &[0.0, 3.0, 0.0, 4.0]), at(-13.0, &[3.0, 0.0, 4.0, 0.0])]);
    hs64 "Reciprocal row"
        start [1.0, 1.0, 1.0];
        within [(1e-5, INF)];
        minimize |[x1, x2, x3]| x1 * 5.0 + x1.recip() * 5e4 + x2 * 20.0 + x2.recip() * 7.2e4 + x3 * 10.0
            + x3.recip() * 1.44e5;
        subject to [at_least(-x1.recip() * 4.0 - x2.recip() * 32.0 - x3.recip() * 120.0 + 1.0)];
        solution Optima(&[at(6_299.842_428, &[108.734_717_5, 85.126_139_42, 204.324_707_8])]);
    hs65 "Quadratic in a sphere"
        start [-5.0, 5.0, 0.0];
        within [(-4.5, 4.5), (-4.5, 4.5), (-5.0, 5.0)];
        minimize |[x1, x2, x3]| sq(x1 - x2) + sq(x1 + x2 - 10.0) / 9.0 + sq(x3 - 5.0);
        subject to [at_least(-sq(x1) - sq(x2) - sq(x3) + 48.0)];
        solution Optima(&[at(0.953_528_856_804_78, &[3.650_461_719, 3.650_461_725, 4.620_417_56])]);
    hs66 "Linear objective, nested exponentials, no bound active"
        start [0.0, 1.05, 2.9];
        within [(0.0, 100.0), (0.0, 100.0), (0.0, 10.0)];
        minimize |[x1, x2, x3]| x3 * 0.2 - x1 * 0.8;
        subject to [at_least(x2 - x1.exp()), at_least(x3 - x2.exp())];
        solution Optima(&[at(0.518_163_274_1, &[0.184_126_487_9, 1.202_167_873, 3.327_322_322])]);
}
