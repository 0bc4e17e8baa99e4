//! Problems of Hock & Schittkowski with equalities, and with inequalities or bounds.

use super::Suite;
use super::statement::{HOCK_SCHITTKOWSKI, POSITIVE, at, dot, problems, sq, sum};
use crate::cases::KnownSolution::Optima;
use autodiff::Scalar;
use std::f64::consts::SQRT_2;

const INF: f64 = f64::INFINITY;
const SQRT_7: f64 = 2.645_751_311_064_590_7;

/// HS 73: protein that is reached with probability 95 %.
fn protein<S: Scalar>(x: &[S]) -> S {
    let variance = sq(x[0]) * 0.28 + sq(x[1]) * 0.19 + sq(x[2]) * 20.5 + sq(x[3]) * 0.62;
    dot(&[12.0, 11.9, 41.8, 52.1], x) - variance.sqrt() * 1.645
}

/// HS 74 and 75: cost of two generators.
fn generation<S: Scalar>(x1: S, x2: S) -> S {
    x1 * 3.0 + x1.powi(3) * 1e-6 + x2 * 2.0 + x2.powi(3) * (2e-6 / 3.0)
}

/// HS 74 and 75: a branch of the network.
fn branch<S: Scalar>(angle: S) -> S {
    (angle - 0.25).sin() * 1000.0
}

/// HS 111 and 112: free energies of ten compounds.
const ENERGIES: [f64; 10] = [-6.089, -17.164, -34.054, -5.914, -24.721, -14.986, -24.1, -10.708, -26.662, -22.179];

/// HS 112: free energy of a mixture with these amounts.
fn free_energy<S: Scalar>(x: &[S]) -> S {
    let total = sum(x.iter().copied());
    sum(x.iter().zip(ENERGIES).map(|(&x, c)| x * ((x / total).ln() + c)))
}

/// HS 119: index pairs of the objective, numbered from 1.
const PAIRS: [(usize, &[usize]); 16] = [
    (1, &[1, 4, 7, 8, 16]),
    (2, &[2, 3, 7, 10]),
    (3, &[3, 7, 9, 10, 14]),
    (4, &[4, 7, 11, 15]),
    (5, &[5, 6, 10, 12, 16]),
    (6, &[6, 8, 15]),
    (7, &[7, 11, 13]),
    (8, &[8, 10, 15]),
    (9, &[9, 12, 16]),
    (10, &[10, 14]),
    (11, &[11, 13]),
    (12, &[12, 14]),
    (13, &[13, 14]),
    (14, &[14]),
    (15, &[15]),
    (16, &[16]),
];

/// HS 119: Σ aᵢⱼ (xᵢ² + xᵢ + 1)(xⱼ² + xⱼ + 1).
fn pairs<S: Scalar>(x: &[S]) -> S {
    let term = |i: usize| sq(x[i - 1]) + x[i - 1] + 1.0;
    sum(PAIRS.iter().flat_map(|&(i, js)| js.iter().map(move |&j| term(i) * term(j))))
}

problems! {
    HOCK_SCHITTKOWSKI, Suite::HockSchittkowski;

    hs14 "Distance from a point, line and ellipse"
        start [2.0, 2.0];
        minimize |[x1, x2]| sq(x1 - 2.0) + sq(x2 - 1.0);
        subject to [at_least(-sq(x1) * 0.25 - sq(x2) + 1.0), equal(x1 - x2 * 2.0 + 1.0)];
        solution Optima(&[at(9.0 - 2.875 * SQRT_7, &[0.5 * (SQRT_7 - 1.0), 0.25 * (SQRT_7 + 1.0)])]);
    hs32 "Evtushenko's problem"
        start [0.1, 0.7, 0.2];
        within [POSITIVE];
        minimize |[x1, x2, x3]| sq(x1 + x2 * 3.0 + x3) + sq(x1 - x2) * 4.0;
        subject to [at_least(x2 * 6.0 + x3 * 4.0 - x1.powi(3) - 3.0), equal(-x1 - x2 - x3 + 1.0)];
        solution Optima(&[at(1.0, &[0.0, 0.0, 1.0])]);
    hs41 "Product of three variables on a plane"
        start [2.0; 4];
        within [(0.0, 1.0), (0.0, 1.0), (0.0, 1.0), (0.0, 2.0)];
        minimize |[x1, x2, x3, x4]| -x1 * x2 * x3 + 2.0;
        subject to [equal(x1 + x2 * 2.0 + x3 * 2.0 - x4)];
        solution Optima(&[at(52.0 / 27.0, &[2.0 / 3.0, 1.0 / 3.0, 1.0 / 3.0, 2.0])]);
    hs53 "Convex quadratic, three planes and bounds"
        start [2.0; 5];
        within [(-10.0, 10.0)];
        minimize |[x1, x2, x3, x4, x5]| sq(x1 - x2) + sq(x2 + x3 - 2.0) + sq(x4 - 1.0) + sq(x5 - 1.0);
        subject to [equal(x1 + x2 * 3.0), equal(x3 + x4 - x5 * 2.0), equal(x2 - x5)];
        solution Optima(&[at(176.0 / 43.0, &[-33.0 / 43.0, 11.0 / 43.0, 27.0 / 43.0, -5.0 / 43.0, 11.0 / 43.0])]);
    hs55 "Six linear equalities of rank five"
        start [1.0, 2.0, 0.0, 0.0, 0.0, 2.0];
        within [(0.0, 1.0), POSITIVE, POSITIVE, (0.0, 1.0), POSITIVE, POSITIVE];
        minimize |[x1, x2, x3, x4, x5, x6]| x1 + x2 * 2.0 + x5 * 4.0 + (x1 * x4).exp();
        subject to [
            equal(x1 + x2 * 2.0 + x5 * 5.0 - 6.0),
            equal(x1 + x2 + x3 - 3.0),
            equal(x4 + x5 + x6 - 2.0),
            equal(x1 + x4 - 1.0),
            equal(x2 + x5 - 2.0),
            equal(x3 + x6 - 2.0),
        ];
        solution Optima(&[at(19.0 / 3.0, &[0.0, 4.0 / 3.0, 5.0 / 3.0, 1.0, 2.0 / 3.0, 1.0 / 3.0])]);
    hs60 "Quartic on a surface"
        start [2.0; 3];
        within [(-10.0, 10.0)];
        minimize |[x1, x2, x3]| sq(x1 - 1.0) + sq(x1 - x2) + (x2 - x3).powi(4);
        subject to [equal(x1 * (sq(x2) + 1.0) + x3.powi(4) - 4.0 - 3.0 * SQRT_2)];
        solution Optima(&[at(0.032_568_200_25, &[1.104_859_024, 1.196_674_194, 1.535_262_257])]);
    hs62 "Logarithms of ratios on a plane"
        start [0.7, 0.2, 0.1];
        within [(0.0, 1.0)];
        minimize |[x1, x2, x3]| (((x1 + x2 + x3 + 0.03) / (x1 * 0.09 + x2 + x3 + 0.03)).ln() * 255.0
            + ((x2 + x3 + 0.03) / (x2 * 0.07 + x3 + 0.03)).ln() * 280.0
            + ((x3 + 0.03) / (x3 * 0.13 + 0.03)).ln() * 290.0) * -32.174;
        subject to [equal(x1 + x2 + x3 - 1.0)];
        solution Optima(&[at(-26_272.514_48, &[0.617_812_690_8, 0.328_202_223, 0.053_985_086_06])]);
    hs63 "Concave quadratic on a plane and a sphere"
        start [2.0; 3];
        within [POSITIVE];
        minimize |[x1, x2, x3]| -sq(x1) - sq(x2) * 2.0 - sq(x3) - x1 * x2 - x1 * x3 + 1000.0;
        subject to [
            equal(x1 * 8.0 + x2 * 14.0 + x3 * 7.0 - 56.0),
            equal(sq(x1) + sq(x2) + sq(x3) - 25.0),
        ];
        solution Optima(&[at(961.715_172_1, &[3.512_118_414, 0.216_988_174_1, 3.552_174_034])]);
    hs71 "Product at least 25 on a sphere"
        start [1.0, 5.0, 5.0, 1.0];
        within [(1.0, 5.0)];
        minimize |[x1, x2, x3, x4]| x1 * x4 * (x1 + x2 + x3) + x3;
        subject to [at_least(x1 * x2 * x3 * x4 - 25.0), equal(sq(x1) + sq(x2) + sq(x3) + sq(x4) - 40.0)];
        solution Optima(&[at(17.014_017_289_156, &[1.0, 4.742_999_638, 3.821_149_984, 1.379_408_293])]);
    hs73 "Cattle feed"
        start [1.0; 4];
        within [POSITIVE];
        minimize |ref x| dot(&[24.55, 26.75, 39.0, 40.5], x);
        subject to [
            at_least(dot(&[2.3, 5.6, 11.1, 1.3], x) - 5.0),
            at_least(protein(x) - 21.0),
            equal(sum(x.iter().copied()) - 1.0),
        ];
        solution Optima(&[at(29.894_378, &[0.635_521_6, 0.0, 0.312_701_9, 0.051_776_55])]);
    hs74 "Electric network, angles within 0.55"
        start [0.0; 4];
        within [(0.0, 1200.0), (0.0, 1200.0), (-0.55, 0.55), (-0.55, 0.55)];
        minimize |[x1, x2, x3, x4]| generation(x1, x2);
        subject to [
            at_least(x4 - x3 + 0.55),
            at_least(x3 - x4 + 0.55),
            equal(branch(-x3) + branch(-x4) + 894.8 - x1),
            equal(branch(x3) + branch(x3 - x4) + 894.8 - x2),
            equal(branch(x4) + branch(x4 - x3) + 1294.8),
        ];
        solution Optima(&[at(5_126.498_109_595_271, &[679.945_320_2, 1_026.067_132, 0.118_876_364_3, -0.396_233_553_3])]);
    hs75 "Electric network, angles within 0.48"
        start [0.0; 4];
        within [(0.0, 1200.0), (0.0, 1200.0), (-0.48, 0.48), (-0.48, 0.48)];
        minimize |[x1, x2, x3, x4]| generation(x1, x2);
        subject to [
            at_least(x4 - x3 + 0.48),
            at_least(x3 - x4 + 0.48),
            equal(branch(-x3) + branch(-x4) + 894.8 - x1),
            equal(branch(x3) + branch(x3 - x4) + 894.8 - x2),
            equal(branch(x4) + branch(x4 - x3) + 1294.8),
        ];
        solution Optima(&[
            at(5_174.412_695_377_74, &[776.159_026_6, 925.195_138_5, 0.051_108_928_54, -0.428_891_071_5]),
        ]);
    hs80 "Exponential of a product"
        start [-2.0, 2.0, 2.0, -1.0, -1.0];
        within [(-2.3, 2.3), (-2.3, 2.3), (-3.2, 3.2), (-3.2, 3.2), (-3.2, 3.2)];
        minimize |[x1, x2, x3, x4, x5]| (x1 * x2 * x3 * x4 * x5).exp();
        subject to [
            equal(sum([x1, x2, x3, x4, x5].map(sq)) - 10.0),
            equal(x2 * x3 - x4 * x5 * 5.0),
            equal(x1.powi(3) + x2.powi(3) + 1.0),
        ];
        solution Optima(&[
            at(0.053_949_847_770_27, &[-1.717_143_57, 1.595_709_69, 1.827_245_753, -0.763_643_078_1, -0.763_643_078_3]),
        ]);
    hs81 "Exponential of a product, with a term that vanishes in the feasible set"
        start [-2.0, 2.0, 2.0, -1.0, -1.0];
        within [(-2.3, 2.3), (-2.3, 2.3), (-3.2, 3.2), (-3.2, 3.2), (-3.2, 3.2)];
        minimize |[x1, x2, x3, x4, x5]| (x1 * x2 * x3 * x4 * x5).exp() - sq(x1.powi(3) + x2.powi(3) + 1.0) * 0.5;
        subject to [
            equal(sum([x1, x2, x3, x4, x5].map(sq)) - 10.0),
            equal(x2 * x3 - x4 * x5 * 5.0),
            equal(x1.powi(3) + x2.powi(3) + 1.0),
        ];
        solution Optima(&[
            at(0.053_949_847_770_27, &[-1.717_143_57, 1.595_709_69, 1.827_245_753, -0.763_643_078_1, -0.763_643_078_3]),
        ]);
    hs111 "Chemical equilibrium in logarithms"
        start [-2.3; 10];
        within [(-100.0, 100.0)];
        minimize |ref x| free_energy(&x.iter().map(|x| x.exp()).collect::<Vec<S>>());
        subject to [
            equal(x[0].exp() + x[1].exp() * 2.0 + x[2].exp() * 2.0 + x[5].exp() + x[9].exp() - 2.0),
            equal(x[3].exp() + x[4].exp() * 2.0 + x[5].exp() + x[6].exp() - 1.0),
            equal(x[2].exp() + x[6].exp() + x[7].exp() + x[8].exp() * 2.0 + x[9].exp() - 1.0),
        ];
        solution Optima(&[
            at(
                -47.761_090_859_366,
                &[
                    -3.202_311_587, -1.912_366_597, -0.244_426_747_8, -6.561_177_268, -0.723_097_963_2,
                    -7.274_232_278, -3.597_237_425, -4.020_316_732, -3.288_376_88, -2.334_371_739,
                ],
            ),
        ]);
    hs112 "Chemical equilibrium"
        start [0.1; 10];
        within [(1e-6, INF)];
        minimize |ref x| free_energy(x);
        subject to [
            equal(x[0] + x[1] * 2.0 + x[2] * 2.0 + x[5] + x[9] - 2.0),
            equal(x[3] + x[4] * 2.0 + x[5] + x[6] - 1.0),
            equal(x[2] + x[6] + x[7] + x[8] * 2.0 + x[9] - 1.0),
        ];
        solution Optima(&[
            at(
                -47.761_090_859_366,
                &[
                    0.040_668_087_18, 0.147_730_354_4, 0.783_153_354_1, 0.001_414_219_911, 0.485_246_648_7,
                    0.000_693_172_054, 0.027_399_310_62, 0.017_947_279_73, 0.037_314_365_86, 0.096_871_323_8,
                ],
            ),
        ]);
    hs114 "Alkylation process"
        start [1745.0, 12000.0, 110.0, 3048.0, 1974.0, 89.2, 92.8, 8.0, 3.6, 145.0];
        within [
            (1e-5, 2000.0), (1e-5, 16000.0), (1e-5, 120.0), (1e-5, 5000.0), (1e-5, 2000.0), (85.0, 93.0), (90.0, 95.0),
            (3.0, 12.0), (1.2, 4.0), (145.0, 162.0),
        ];
        minimize |ref x| x[0] * 5.04 + x[1] * 0.035 + x[2] * 10.0 + x[4] * 3.36 - x[3] * x[6] * 0.063;
        subject to [
            at_least(-x[9] * 0.222 - x[8] * 0.9 + 35.82),
            at_least(x[6] * 3.0 - x[9] * 0.99 - 133.0),
            at_least(x[9] * 0.222 + x[8] / 0.9 - 35.82),
            at_least(-x[6] * 3.0 + x[9] / 0.99 + 133.0),
            at_least(x[0] * 1.12 + x[0] * x[7] * 0.13167 - x[0] * sq(x[7]) * 0.00667 - x[3] * 0.99),
            at_least(x[7] * 1.098 - sq(x[7]) * 0.038 + x[5] * 0.325 - x[6] * 0.99 + 57.425),
            at_least(-x[0] * 1.12 - x[0] * x[7] * 0.13167 + x[0] * sq(x[7]) * 0.00667 + x[3] / 0.99),
            at_least(-x[7] * 1.098 + sq(x[7]) * 0.038 - x[5] * 0.325 + x[6] / 0.99 - 57.425),
            equal(x[3] * 1.22 - x[0] - x[4]),
            equal(x[2] * 98_000.0 / (x[3] * x[8] + x[2] * 1000.0) - x[5]),
            equal((x[1] + x[4]) / x[0] - x[7]),
        ];
        solution Optima(&[at(
            -1_768.806_963_8,
            &[
                1_698.094_731_1, 15_818.610_652_3, 54.102_697_73, 3_031.225_189_4, 2000.0, 90.115_424_33, 95.0,
                10.493_296, 1.561_636_363_64, 153.535_353_535,
            ],
        )]);
    hs119 "Colville's seventh problem: 16 variables, eight planes"
        start [10.0; 16];
        within [(0.0, 5.0)];
        minimize |ref x| pairs(x);
        subject to [
            equal(dot(&[0.22, 0.2, 0.19, 0.25, 0.15, 0.11, 0.12, 0.13], x) + x[8] - 2.5),
            equal(dot(&[-1.46, 0.0, -1.3, 1.82, -1.15, 0.0, 0.8], x) + x[9] - 1.1),
            equal(dot(&[1.29, -0.89, 0.0, 0.0, -1.16, -0.96, 0.0, -0.49], x) + x[10] + 3.1),
            equal(dot(&[-1.1, -1.06, 0.95, -0.54, 0.0, -1.78, -0.41], x) + x[11] + 3.5),
            equal(dot(&[0.0, 0.0, 0.0, -1.43, 1.51, 0.59, -0.33, -0.43], x) + x[12] - 1.3),
            equal(dot(&[0.0, -1.72, -0.33, 0.0, 1.62, 1.24, 0.21, -0.26], x) + x[13] - 2.1),
            equal(dot(&[1.12, 0.0, 0.0, 0.31, 0.0, 0.0, 1.12, 0.0, -0.36], x) + x[14] - 2.3),
            equal(dot(&[0.0, 0.45, 0.26, -1.1, 0.58, 0.0, -1.03, 0.1], x) + x[15] + 1.5),
        ];
        solution Optima(&[at(
            244.899_697_5,
            &[
                0.039_848_887_5, 0.791_984_373_3, 0.202_868_317_1, 0.844_360_022_2, 1.269_909_934_7, 0.934_735_378_6,
                1.681_961_715_7, 0.155_300_989_6, 1.567_869_467_9, 0.0, 0.0, 0.0, 0.660_203_748_6, 0.0, 0.674_253_526, 0.0,
            ],
        )]);
}
