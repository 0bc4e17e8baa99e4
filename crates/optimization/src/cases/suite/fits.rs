//! Least-squares fits of curves, whose residuals do not vanish, and other functions that SciPy solves; and saddles on spheres.

use super::Suite;
use super::statement::{problems, sq, sum};
use crate::cases::KnownSolution::Optima;
use crate::cases::Optimum;
use autodiff::Scalar;

const OURS: &str = "ours";

/// An optimum by SciPy.
const fn by_scipy(objective: f64, design: &'static [f64]) -> Optimum {
    Optimum::computed(objective, design, "SciPy 1.15, least_squares and SLSQP")
}

/// Pasture yield after time: NIST data set Rat42.
const PASTURE: [[f64; 2]; 9] = [
    [9.0, 8.93],
    [14.0, 10.8],
    [21.0, 18.59],
    [28.0, 22.33],
    [42.0, 39.35],
    [57.0, 56.11],
    [63.0, 61.73],
    [70.0, 64.62],
    [79.0, 67.08],
];

/// Data of Bard.
const BARD: [f64; 15] = [0.14, 0.18, 0.22, 0.25, 0.29, 0.32, 0.35, 0.39, 0.37, 0.58, 0.73, 0.96, 1.34, 2.1, 4.39];

/// Heights of the Gaussian of Moré, Garbow & Hillstrom, from its tail to its middle.
const BELL: [f64; 8] = [0.0009, 0.0044, 0.0175, 0.054, 0.1295, 0.242, 0.3521, 0.3989];

/// Values of a saturation at multiples of 0.3, less 1.
const SATURATION: [f64; 12] = [
    -0.387_838, 0.392_587, 0.960_288, 1.391_808, 1.730_900, 2.004_387, 2.229_630, 2.418_359, 2.578_787, 2.716_836,
    2.836_884, 2.942_236,
];

/// Σ over the fifteen points of the Gaussian.
fn bell<S: Scalar>([x1, x2, x3]: [S; 3]) -> S {
    let height = |k: usize| BELL[if k < 8 { k } else { 14 - k }];
    let error = |k: usize| x1 * (x2 * sq(-x3 + (3.5 - 0.5 * k as f64)) * -0.5).exp() - height(k);
    sum((0..15).map(|k| sq(error(k))))
}

problems! {
    OURS, Suite::Adversarial;

    pasture "Fit of a logistic curve, NIST Rat42"
        start [100.0, 1.0, 0.1];
        minimize |[x1, x2, x3]| sum(PASTURE.map(|[t, y]| sq(x1 / ((x2 - x3 * t).exp() + 1.0) - y)));
        solution Optima(&[by_scipy(8.056_522_933_811_372, &[72.462_237_977_849_72, 2.618_076_819_389_317_6, 0.067_359_199_097_413_25])]);
    bard "Fit of Bard from ten times the start"
        start [10.0, 10.0, 10.0];
        minimize |[x1, x2, x3]| sum((1..=15).map(|k| {
            let (u, w) = (k as f64, (16 - k).min(k) as f64);
            sq(x1 + (x2 * (16.0 - u) + x3 * w).recip() * u - BARD[k - 1])
        }));
        solution Optima(&[by_scipy(8.214_877_306_578_975e-3, &[0.082_410_560_915_558_04, 1.133_036_130_646_266_6, 2.343_695_141_566_443_8])]);
    bell_with_constant as "bell-with-constant" "Fit of a Gaussian, with a constant of 1e4 in the objective"
        start [0.4, 1.0, 0.0];
        minimize |[x1, x2, x3]| bell([x1, x2, x3]) + 1e4;
        solution Optima(&[by_scipy(1e4 + 1.127_932_769_618_894_2e-8, &[0.398_956_137_838_551_44, 1.000_019_084_486_038, 0.0])]);
    saturation "Fit of a saturation with small residuals"
        start [2.185_441_317, 0.900_339_460_7, 0.0];
        minimize |[x1, x2, x3]| sum((0..12).map(|k| {
            let t = 0.3 * k as f64;
            sq(x1 * t / (x2 + t) + x3 - SATURATION[k])
        }));
        solution Optima(&[by_scipy(4.624_608_375_944_37e-13, &[4.945_899_490_926_78, 1.601_233_397_486_324_9, -0.387_837_938_252_990_73])]);
    quartic_with_constant as "quartic-with-constant" "A quartic with a constant of 1e-12"
        start [1.0];
        minimize |[x1]| sq(x1 - 3.0) + 1e-12 + sq(sq(x1 - 3.0)) * 0.1;
        solution Optima(&[by_scipy(1e-12, &[3.0])]);
    quartics_on_a_sphere as "quartics-on-a-sphere" "Quartics on a sphere, from a start that leads to a saddle"
        start [2.0, 2.0, 2.0];
        minimize |[x1, x2, x3]| x1.powi(4) - sq(x1) + x2.powi(4) * 2.0 - sq(x2) + x3.powi(4) * 3.0 - sq(x3);
        subject to [equal(sq(x1) + sq(x2) + sq(x3) - 1.0)];
        solution Optima(&[by_scipy(-0.454_545_454_545_454_5, &[0.738_548_945_875_996, 0.522_232_967_867_094, 0.426_401_432_711_221])]);
    ten_on_a_sphere as "ten-on-a-sphere" "Ten quartics on a sphere, Schittkowski's problem 394 for ten variables"
        start [2.0; 10];
        minimize |ref x| sum((0..10).map(|j| (sq(x[j]) + sq(sq(x[j]))) * (j + 1) as f64));
        subject to [equal(sum((0..10).map(|j| sq(x[j]))) - 1.0)];
        solution Optima(&[by_scipy(1.916_666_666_666_667, &[0.912_870_929_175_277, 0.408_248_290_463_863, 0.0, 0.0, 0.0, 0.0, 0.0,
            0.0, 0.0, 0.0])]);
    posynomial "A geometric program of eleven factors of ten"
        start [0.529_060_351_950_401_7, 12.294_477_927_088_54, 1.388_035_158_812_650_5, 2.966_483_990_502_739_6];
        within [(1e-3, 1e3)];
        minimize |[x1, x2, x3, x4]| sq(x1) / x4.sqrt() * 0.187 + sq(x4) / x3.sqrt() * 1.89 + (x2 / x1).sqrt() / sq(x4) * 7.44;
        subject to [
            at_most((x2 / x4).sqrt() * x3 * 1.36 - 11.841),
            at_most(x1 * x2 / x3.sqrt() * 1.92 - 0.331_758),
        ];
        solution Optima(&[by_scipy(0.414_419_694_763_398_35, &[0.515_398_273_747_859_4, 0.001, 325.302_535_149_014_26, 1.395_969_565_809_563_7])]);
    small_posynomial as "small-posynomial" "A geometric program from a start outside its region"
        start [36.446_921_367_437_77, 0.375_053_340_485_974];
        within [(1e-3, 1e3)];
        minimize |[x1, x2]| x2 / x1 * 0.308 + x1 / x2.sqrt() * 0.578 + x1.sqrt() / x2 * 0.314;
        subject to [
            at_most((x2.sqrt() / sq(x1) * 4.24 + x1 / sq(x2) * 0.1 + x2.sqrt() * 0.341) - 2983.58),
            at_most(sq(x2).recip() * 0.501 - 0.093_060_3),
            at_most(sq(x1 * x2) * 0.11 + x1.sqrt() / x2 * 1.68 - 0.262_052),
        ];
        solution Optima(&[by_scipy(5.457_230_552_247_314, &[0.171_926_725_933_424_5, 2.989_858_052_320_687_2])]);
}
