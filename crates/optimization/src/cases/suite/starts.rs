//! Starts that give little information about the sizes of the variables: components near zero next to larger ones, and flat directions.

use super::Suite;
use super::statement::{POSITIVE, at, problems, sq};
use crate::cases::KnownSolution::Optima;
use crate::cases::Optimum;

const OURS: &str = "ours";

/// An optimum by Newton's method.
const fn computed(objective: f64, design: &'static [f64]) -> Optimum {
    Optimum::computed(objective, design, "Newton's method")
}

problems! {
    OURS, Suite::Adversarial;

    small_start_convex as "small-start-convex" "A convex function from a start with one component of 1e-10"
        start [1.0, 1e-10];
        minimize |[x1, x2]| sq(x1 - 3.0) + sq(x2 - 2.0) * 100.0 + (x1 - x2).exp();
        solution Optima(&[computed(1.834_809_985_267_262, &[2.317_693_676_503_47, 2.006_823_063_234_97])]);
    tiny_start_convex as "tiny-start-convex" "A convex function from a start of 1e-20"
        start [1e-20, 1e-20];
        minimize |[x1, x2]| sq(x1 - 3.0) + sq(x2 - 2.0) * 100.0 + (x1 - x2).exp();
        solution Optima(&[computed(1.834_809_985_267_262, &[2.317_693_676_503_47, 2.006_823_063_234_97])]);
    tiny_start_bounded as "tiny-start-bounded" "A component of 1e-18 at its bound, and a reciprocal of it"
        start [1e-18, 1.0];
        within [POSITIVE];
        minimize |[x1, x2]| (x1 + 0.1).recip() + sq(x2) + x1;
        solution Optima(&[at(1.9, &[0.9, 0.0])]);
    small_start_wells as "small-start-wells" "Two double wells from beside the saddle of one"
        start [2.0, 1e-8];
        minimize |[x1, x2]| sq(sq(x1) - 1.0) + sq(sq(x2) - 2.0);
        solution Optima(&[at(0.0, &[1.0, std::f64::consts::SQRT_2])]);
    three_wells as "three-wells" "Three double wells from the saddle of one"
        start [2.0, 0.0, 2.0];
        minimize |[x1, x2, x3]| sq(sq(x1) - 1.0) + sq(sq(x2) - 2.0) + sq(sq(x3) - 3.0);
        solution Optima(&[at(0.0, &[1.0, std::f64::consts::SQRT_2, 1.732_050_807_568_877])]);
    eight_wells as "eight-wells" "Eight double wells from the saddles of four"
        start [2.0, 0.0, 2.0, 0.0, 2.0, 0.0, 2.0, 0.0];
        minimize |[x1, x2, x3, x4, x5, x6, x7, x8]| sq(sq(x1) - 1.0) + sq(sq(x2) - 2.0) + sq(sq(x3) - 3.0) + sq(sq(x4) - 4.0)
            + sq(sq(x5) - 5.0) + sq(sq(x6) - 6.0) + sq(sq(x7) - 7.0) + sq(sq(x8) - 8.0);
        solution Optima(&[at(0.0, &[1.0, std::f64::consts::SQRT_2, 1.732_050_807_568_877, 2.0, 2.236_067_977_499_79,
            2.449_489_742_783_178, 2.645_751_311_064_591, 2.828_427_124_746_19])]);
    small_start_line as "small-start-line" "A quadratic above a line, from 1000 and 1e-6"
        start [1000.0, 1e-6];
        minimize |[x1, x2]| sq(x1 - 3.0) + sq(x2 - 2.0);
        subject to [at_most(x1 + x2 - 4.0)];
        solution Optima(&[at(0.5, &[2.5, 1.5])]);
    small_start_ellipsoid as "small-start-ellipsoid" "A linear function on an ellipse in space, from 1e-9"
        start [1e-9, 1e-9, 1e-9];
        minimize |[x1, x2, x3]| x1 * 7.0 - x2 * 6.0 + x3 * 4.0;
        subject to [equal(sq(x1) + sq(x2) * 2.0 + sq(x3) * 3.0 - 1.0), equal(x1 * 5.0 + x2 * 5.0 - x3 * 3.0 - 6.0)];
        solution Optima(&[computed(-0.337_895_694_004_738_5, &[0.534_594_436_622_430_7, 0.533_970_508_233_062_6, -0.219_058_425_240_844_37])]);
    box_from_afar as "box-from-afar" "A box of least cost and given volume from a corner of its bounds"
        start [1e-3, 140.0, 650.0];
        within [(1e-3, 1e3)];
        minimize |[x1, x2, x3]| x1 * x2 * 40.0 + x2 * x3 * 40.0 + x1 * x3 * 20.0;
        subject to [at_most((x1 * x2 * x3).recip() * 4.0 - 1.0)];
        solution Optima(&[at(240.0, &[2.0, 1.0, 2.0])]);
    ellipsoid "An ellipsoid with curvatures of 1 to 1e7"
        start [3.5, 5.0, -2400.0, 29.0];
        minimize |[x1, x2, x3, x4]| sq(x1 - 0.3) + sq(x2 - 0.3) * 1e3 + sq(x3 - 0.3) * 1e5 + sq(x4 - 0.3) * 1e7;
        solution Optima(&[at(0.0, &[0.3, 0.3, 0.3, 0.3])]);
}
