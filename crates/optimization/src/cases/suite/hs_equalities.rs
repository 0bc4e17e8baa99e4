//! Problems of Hock & Schittkowski with equalities only, and no bounds.

use super::Suite;
use super::statement::{HOCK_SCHITTKOWSKI, at, problems, sq, sum};
use crate::cases::KnownSolution::Optima;
use std::f64::consts::{FRAC_1_SQRT_2, FRAC_PI_2, PI, SQRT_2};

const SQRT_3: f64 = 1.732_050_807_568_877_2;

problems! {
    HOCK_SCHITTKOWSKI, Suite::HockSchittkowski;

    hs6 "Rosenbrock's valley as an equality"
        start [-1.2, 1.0];
        minimize |[x1, x2]| sq(-x1 + 1.0);
        subject to [equal((x2 - sq(x1)) * 10.0)];
        solution Optima(&[at(0.0, &[1.0, 1.0])]);
    hs7 "Logarithm and a closed curve"
        start [2.0, 2.0];
        minimize |[x1, x2]| (sq(x1) + 1.0).ln() - x2;
        subject to [equal(sq(sq(x1) + 1.0) + sq(x2) - 4.0)];
        solution Optima(&[at(-SQRT_3, &[0.0, SQRT_3])]);
    hs8 "Constant objective, two equations"
        start [2.0, 1.0];
        minimize |[x1, x2]| -1.0;
        subject to [equal(sq(x1) + sq(x2) - 25.0), equal(x1 * x2 - 9.0)];
        solution Optima(&[at(-1.0, &[4.601_594_918, 1.955_843_607])]);
    hs9 "Periodic objective along a line"
        start [0.0, 0.0];
        minimize |[x1, x2]| (x1 * (PI / 12.0)).sin() * (x2 * (PI / 16.0)).cos();
        subject to [equal(x1 * 4.0 - x2 * 3.0)];
        solution Optima(&[at(-0.5, &[-3.0, -4.0])]);
    hs26 "Quartic objective, singular Hessian at the optimum"
        start [-2.6, 2.0, 2.0];
        minimize |[x1, x2, x3]| sq(x1 - x2) + (x2 - x3).powi(4);
        subject to [equal((sq(x2) + 1.0) * x1 + x3.powi(4) - 3.0)];
        solution Optima(&[at(0.0, &[1.0, 1.0, 1.0])]);
    hs27 "Rosenbrock's function, small weight of the second term"
        start [2.0, 2.0, 2.0];
        minimize |[x1, x2, x3]| sq(x1 - 1.0) * 0.01 + sq(x2 - sq(x1));
        subject to [equal(x1 + sq(x3) + 1.0)];
        solution Optima(&[at(0.04, &[-1.0, 1.0, 0.0])]);
    hs28 "Quadratic on a plane"
        start [-4.0, 1.0, 1.0];
        minimize |[x1, x2, x3]| sq(x1 + x2) + sq(x2 + x3);
        subject to [equal(x1 + x2 * 2.0 + x3 * 3.0 - 1.0)];
        solution Optima(&[at(0.0, &[0.5, -0.5, 0.5])]);
    hs39 "Cusp with slack variables"
        start [2.0, 2.0, 2.0, 2.0];
        minimize |[x1, x2, x3, x4]| -x1;
        subject to [equal(x2 - x1.powi(3) - sq(x3)), equal(sq(x1) - x2 - sq(x4))];
        solution Optima(&[at(-1.0, &[1.0, 1.0, 0.0, 0.0])]);
    hs40 "Product of four variables"
        start [0.8, 0.8, 0.8, 0.8];
        minimize |[x1, x2, x3, x4]| -x1 * x2 * x3 * x4;
        subject to [equal(x1.powi(3) + sq(x2) - 1.0), equal(sq(x1) * x4 - x3), equal(sq(x4) - x2)];
        solution Optima(&[at(-0.25, &[0.793_700_526, FRAC_1_SQRT_2, 0.529_731_547_2, 0.840_896_415_3])]);
    hs42 "Distance from a point to a circle"
        start [1.0, 1.0, 1.0, 1.0];
        minimize |[x1, x2, x3, x4]| sq(x1 - 1.0) + sq(x2 - 2.0) + sq(x3 - 3.0) + sq(x4 - 4.0);
        subject to [equal(x1 - 2.0), equal(sq(x3) + sq(x4) - 2.0)];
        solution Optima(&[at(28.0 - 10.0 * SQRT_2, &[2.0, 2.0, 0.6 * SQRT_2, 0.8 * SQRT_2])]);
    hs46 "Powers four and six, singular Hessian at the optimum"
        start [0.5 * SQRT_2, 1.75, 0.5, 2.0, 2.0];
        minimize |[x1, x2, x3, x4, x5]| sq(x1 - x2) + sq(x3 - 1.0) + (x4 - 1.0).powi(4) + (x5 - 1.0).powi(6);
        subject to [equal(sq(x1) * x4 + (x4 - x5).sin() - 1.0), equal(x2 + x3.powi(4) * sq(x4) - 2.0)];
        solution Optima(&[at(0.0, &[1.0; 5])]);
    hs47 "Cubic term; a better local optimum exists than the published one"
        start [2.0, SQRT_2, -1.0, 2.0 - SQRT_2, 0.5];
        minimize |[x1, x2, x3, x4, x5]| sq(x1 - x2) + (x2 - x3).powi(3) + (x3 - x4).powi(4) + (x4 - x5).powi(4);
        subject to [equal(x1 + sq(x2) + x3.powi(3) - 3.0), equal(x2 - sq(x3) + x4 - 1.0), equal(x1 * x5 - 1.0)];
        solution Optima(&[
            at(0.0, &[1.0; 5]),
            at(-0.026_714_182_7, &[0.677_004_4, 0.726_089_5, 1.215_491_2, 1.751_329_4, 1.477_095_3]),
        ]);
    hs48 "Convex quadratic, two planes"
        start [3.0, 5.0, -3.0, 2.0, -2.0];
        minimize |[x1, x2, x3, x4, x5]| sq(x1 - 1.0) + sq(x2 - x3) + sq(x4 - x5);
        subject to [equal(x1 + x2 + x3 + x4 + x5 - 5.0), equal(x3 - (x4 + x5) * 2.0 + 3.0)];
        solution Optima(&[at(0.0, &[1.0; 5])]);
    hs49 "Powers four and six on two planes"
        start [10.0, 7.0, 2.0, -3.0, 0.8];
        minimize |[x1, x2, x3, x4, x5]| sq(x1 - x2) + sq(x3 - 1.0) + (x4 - 1.0).powi(4) + (x5 - 1.0).powi(6);
        subject to [equal(x1 + x2 + x3 + x4 * 4.0 - 7.0), equal(x3 + x5 * 5.0 - 6.0)];
        solution Optima(&[at(0.0, &[1.0; 5])]);
    hs50 "Quartic on three planes"
        start [35.0, -31.0, 11.0, 5.0, -5.0];
        minimize |[x1, x2, x3, x4, x5]| sq(x1 - x2) + sq(x2 - x3) + (x3 - x4).powi(4) + sq(x4 - x5);
        subject to [
            equal(x1 + x2 * 2.0 + x3 * 3.0 - 6.0),
            equal(x2 + x3 * 2.0 + x4 * 3.0 - 6.0),
            equal(x3 + x4 * 2.0 + x5 * 3.0 - 6.0),
        ];
        solution Optima(&[at(0.0, &[1.0; 5])]);
    hs51 "Convex quadratic, three planes"
        start [2.5, 0.5, 2.0, -1.0, 0.5];
        minimize |[x1, x2, x3, x4, x5]| sq(x1 - x2) + sq(x2 + x3 - 2.0) + sq(x4 - 1.0) + sq(x5 - 1.0);
        subject to [equal(x1 + x2 * 3.0 - 4.0), equal(x3 + x4 - x5 * 2.0), equal(x2 - x5)];
        solution Optima(&[at(0.0, &[1.0; 5])]);
    hs52 "Convex quadratic, three planes, not zero at the optimum"
        start [2.0; 5];
        minimize |[x1, x2, x3, x4, x5]| sq(x1 * 4.0 - x2) + sq(x2 + x3 - 2.0) + sq(x4 - 1.0) + sq(x5 - 1.0);
        subject to [equal(x1 + x2 * 3.0), equal(x3 + x4 - x5 * 2.0), equal(x2 - x5)];
        solution Optima(&[at(
            1859.0 / 349.0,
            &[-33.0 / 349.0, 11.0 / 349.0, 180.0 / 349.0, -158.0 / 349.0, 11.0 / 349.0],
        )]);
    hs56 "Post office parcel, bounds as sines"
        start [1.0, 1.0, 1.0, 0.509_737_985_2, 0.509_737_985_2, 0.509_737_985_2, 0.985_110_783_3];
        minimize |[x1, x2, x3, x4, x5, x6, x7]| -x1 * x2 * x3;
        subject to [
            equal(x1 - sq(x4.sin()) * 4.2),
            equal(x2 - sq(x5.sin()) * 4.2),
            equal(x3 - sq(x6.sin()) * 4.2),
            equal(x1 + x2 * 2.0 + x3 * 2.0 - sq(x7.sin()) * 7.2),
        ];
        solution Optima(&[at(
            -3.456,
            &[2.4, 1.2, 1.2, 0.857_071_947_9, 0.563_942_641_4, 0.563_942_641_4, FRAC_PI_2],
        )]);
    hs61 "Quadratic, parabolas"
        start [0.0, 0.0, 0.0];
        minimize |[x1, x2, x3]| sq(x1) * 4.0 + sq(x2) * 2.0 + sq(x3) * 2.0 - x1 * 33.0 + x2 * 16.0 - x3 * 24.0;
        subject to [equal(x1 * 3.0 - sq(x2) * 2.0 - 7.0), equal(x1 * 4.0 - sq(x3) - 11.0)];
        solution Optima(&[at(-143.646_142_2, &[5.326_770_157, -2.118_998_639, 3.210_464_239])]);
    hs77 "Powers four and six, sine"
        start [2.0; 5];
        minimize |[x1, x2, x3, x4, x5]| sq(x1 - 1.0) + sq(x1 - x2) + sq(x3 - 1.0) + (x4 - 1.0).powi(4)
            + (x5 - 1.0).powi(6);
        subject to [
            equal(sq(x1) * x4 + (x4 - x5).sin() - 2.0 * SQRT_2),
            equal(x2 + x3.powi(4) * sq(x4) - 8.0 - SQRT_2),
        ];
        solution Optima(&[
            at(0.241_505_128_790_18, &[1.166_172_19, 1.182_111_389, 1.380_257_043, 1.506_036_274, 0.610_920_196]),
        ]);
    hs78 "Product of five variables on three surfaces"
        start [-2.0, 1.5, 2.0, -1.0, -1.0];
        minimize |[x1, x2, x3, x4, x5]| x1 * x2 * x3 * x4 * x5;
        subject to [
            equal(sum([x1, x2, x3, x4, x5].map(sq)) - 10.0),
            equal(x2 * x3 - x4 * x5 * 5.0),
            equal(x1.powi(3) + x2.powi(3) + 1.0),
        ];
        solution Optima(&[
            at(
                -2.919_700_408_963_68,
                &[
                    -1.717_143_57, 1.595_709_69, 1.827_245_753, -0.763_643_078_2, -0.763_643_078_1,
                ],
            ),
        ]);
    hs79 "Quartic on three surfaces"
        start [2.0; 5];
        minimize |[x1, x2, x3, x4, x5]| sq(x1 - 1.0) + sq(x1 - x2) + sq(x2 - x3) + (x3 - x4).powi(4)
            + (x4 - x5).powi(4);
        subject to [
            equal(x1 + sq(x2) + x3.powi(3) - 2.0 - 3.0 * SQRT_2),
            equal(x2 - sq(x3) + x4 + 2.0 - 2.0 * SQRT_2),
            equal(x1 * x5 - 2.0),
        ];
        solution Optima(&[
            at(0.078_776_820_871_06, &[1.191_127_456, 1.362_603_165, 1.472_817_931, 1.635_016_618, 1.679_081_436]),
        ]);
}
