//! Problems of Hock & Schittkowski with inequalities and no equalities, from number 57 on: data fits, geometric programs, designs.

use super::Suite;
use super::statement::{HOCK_SCHITTKOWSKI, POSITIVE, at, dot, problems, sq, sum};
use crate::cases::KnownSolution::Optima;
use autodiff::Scalar;

const INF: f64 = f64::INFINITY;

/// HS 57: hours and measured fractions of chlorine.
const CHLORINE: [(f64, &[f64]); 18] = [
    (8.0, &[0.49, 0.49]),
    (10.0, &[0.48, 0.47, 0.48, 0.47]),
    (12.0, &[0.46, 0.46, 0.45, 0.43]),
    (14.0, &[0.45, 0.43, 0.43]),
    (16.0, &[0.44, 0.43, 0.43]),
    (18.0, &[0.46, 0.45]),
    (20.0, &[0.42, 0.42, 0.43]),
    (22.0, &[0.41, 0.41, 0.4]),
    (24.0, &[0.42, 0.4, 0.4]),
    (26.0, &[0.41, 0.4, 0.41]),
    (28.0, &[0.41, 0.4]),
    (30.0, &[0.4, 0.4, 0.38]),
    (32.0, &[0.41, 0.4]),
    (34.0, &[0.4]),
    (36.0, &[0.41, 0.38]),
    (38.0, &[0.4, 0.4]),
    (40.0, &[0.39]),
    (42.0, &[0.39]),
];

/// HS 57: sum of squares of the fit.
fn chlorine<S: Scalar>(x1: S, x2: S) -> S {
    let model = |hour: f64| x1 + (-x1 + 0.49) * (x2 * (8.0 - hour)).exp();
    sum(CHLORINE.iter().flat_map(|&(hour, values)| values.iter().map(move |&v| sq(model(hour) - v))))
}

/// HS 93: the two products of lengths of the transformer.
fn transformer<S: Scalar>(x: &[S]) -> [S; 2] {
    [x[0] * x[3] * (x[0] + x[1] + x[2]), x[1] * x[2] * (x[0] + x[1] * 1.57 + x[3])]
}

/// HS 95 to 98: the four rows; they differ in their limits.
fn process<S: Scalar>(x: &[S], limits: [f64; 4]) -> [S; 4] {
    [
        dot(&[17.1, 38.2, 204.2, 212.3, 623.4, 1495.5], x)
            - x[0] * x[2] * 169.0
            - x[2] * x[4] * 3580.0
            - x[3] * x[4] * 3810.0
            - x[3] * x[5] * 18_500.0
            - x[4] * x[5] * 24_300.0
            - limits[0],
        dot(&[17.9, 36.8, 113.9, 169.7, 337.8, 1385.2], x)
            - x[0] * x[2] * 139.0
            - x[3] * x[4] * 2450.0
            - x[3] * x[5] * 16_600.0
            - x[4] * x[5] * 17_200.0
            - limits[1],
        dot(&[0.0, -273.0, 0.0, -70.0, -819.0], x) + x[3] * x[4] * 26_000.0 - limits[2],
        dot(&[159.9, -311.0, 0.0, 587.0, 391.0, 2198.0], x) - x[0] * x[5] * 14_000.0 - limits[3],
    ]
}

/// HS 95 to 98: objective.
const PROCESS: [f64; 6] = [4.3, 31.8, 63.3, 15.8, 68.5, 4.7];
/// HS 95 to 98: bounds.
const PROCESS_BOUNDS: [(f64, f64); 6] =
    [(0.0, 0.31), (0.0, 0.46), (0.0, 0.068), (0.0, 0.042), (0.0, 0.028), (0.0, 0.0134)];

/// c Π xⱼ^eⱼ.
fn monomial<S: Scalar>(c: f64, x: &[S], exponents: &[f64]) -> S {
    x.iter().zip(exponents).fold(S::from(c), |m, (x, &e)| if e == 0.0 { m } else { m * x.powf(e) })
}

/// HS 101 to 103: objective with exponent a of the last variable in its first term.
fn geometric<S: Scalar>(x: &[S], a: f64) -> S {
    monomial(10.0, x, &[1.0, -1.0, 0.0, 2.0, 0.0, -3.0, a])
        + monomial(15.0, x, &[-1.0, -2.0, 1.0, 1.0, -1.0, 0.0, -0.5])
        + monomial(20.0, x, &[-2.0, 1.0, 0.0, -1.0, -2.0, 1.0, 0.0])
        + monomial(25.0, x, &[2.0, 2.0, -1.0, 0.0, 0.5, -2.0, 1.0])
}

/// HS 101 to 103: the four posynomials that are at most one.
fn posynomials<S: Scalar>(x: &[S]) -> [S; 4] {
    const THIRD: f64 = 1.0 / 3.0;
    [
        monomial(0.5, x, &[0.5, 0.0, -1.0, 0.0, 0.0, -2.0, 1.0])
            + monomial(0.7, x, &[3.0, 1.0, -2.0, 0.0, 0.0, 1.0, 0.5])
            + monomial(0.2, x, &[0.0, -1.0, 1.0, -0.5, 0.0, 2.0 * THIRD, 0.25]),
        monomial(1.3, x, &[-0.5, 1.0, -1.0, 0.0, -1.0, 1.0, 0.0])
            + monomial(0.8, x, &[0.0, 0.0, 1.0, -1.0, -1.0, 2.0, 0.0])
            + monomial(3.1, x, &[-1.0, 0.5, 0.0, -2.0, -1.0, THIRD, 0.0]),
        monomial(2.0, x, &[1.0, 0.0, -1.5, 0.0, 1.0, -1.0, THIRD])
            + monomial(0.1, x, &[0.0, 1.0, -0.5, 0.0, 1.0, -1.0, -0.5])
            + monomial(1.0, x, &[-1.0, 1.0, 0.5, 0.0, 1.0, 0.0, 0.0])
            + monomial(0.65, x, &[0.0, -2.0, 1.0, 0.0, 1.0, -1.0, 1.0]),
        monomial(0.2, x, &[-2.0, 1.0, 0.0, -1.0, 0.5, 0.0, THIRD])
            + monomial(0.3, x, &[0.5, 2.0, 1.0, THIRD, -2.0 * THIRD, 0.0, 0.25])
            + monomial(0.4, x, &[-3.0, -2.0, 1.0, 0.0, 1.0, 0.0, 0.75])
            + monomial(0.5, x, &[0.0, 0.0, -2.0, 1.0, 0.0, 0.0, 0.5]),
    ]
}

/// HS 101 to 103: bounds.
const GEOMETRIC_BOUNDS: [(f64, f64); 7] =
    [(0.1, 10.0), (0.1, 10.0), (0.1, 10.0), (0.1, 10.0), (0.1, 10.0), (0.1, 10.0), (0.01, 10.0)];

/// HS 104: cost of the reactors.
fn reactors<S: Scalar>(x: &[S]) -> S {
    (x[0] / x[6]).powf(0.67) * 0.4 + (x[1] / x[7]).powf(0.67) * 0.4 - x[0] - x[1] + 10.0
}

/// HS 86 and 117: Colville's data, rows A x ≥ b.
const SHELL: [[f64; 5]; 10] = [
    [-16.0, 2.0, 0.0, 1.0, 0.0],
    [0.0, -2.0, 0.0, 4.0, 2.0],
    [-3.5, 0.0, 2.0, 0.0, 0.0],
    [0.0, -2.0, 0.0, -4.0, -1.0],
    [0.0, -9.0, -2.0, 1.0, -2.8],
    [2.0, 0.0, -4.0, 0.0, 0.0],
    [-1.0, -1.0, -1.0, -1.0, -1.0],
    [-1.0, -2.0, -3.0, -2.0, -1.0],
    [1.0, 2.0, 3.0, 4.0, 5.0],
    [1.0, 1.0, 1.0, 1.0, 1.0],
];
const SHELL_LIMITS: [f64; 10] = [-40.0, -2.0, -0.25, -4.0, -4.0, -1.0, -40.0, -60.0, 5.0, 1.0];
const SHELL_QUADRATIC: [[f64; 5]; 5] = [
    [30.0, -20.0, -10.0, 32.0, -10.0],
    [-20.0, 39.0, -6.0, -31.0, 32.0],
    [-10.0, -6.0, 10.0, -6.0, -10.0],
    [32.0, -31.0, -6.0, 39.0, -20.0],
    [-10.0, 32.0, -10.0, -20.0, 30.0],
];
const SHELL_CUBIC: [f64; 5] = [4.0, 8.0, 10.0, 6.0, 2.0];
const SHELL_LINEAR: [f64; 5] = [-15.0, -27.0, -36.0, -18.0, -12.0];

/// Σ cᵢⱼ xᵢ xⱼ.
fn shell_quadratic<S: Scalar>(x: &[S]) -> S {
    sum(x.iter().zip(&SHELL_QUADRATIC).map(|(&xi, row)| xi * dot(row, x)))
}

/// Σ dⱼ xⱼ³.
fn shell_cubic<S: Scalar>(x: &[S]) -> S {
    sum(x.iter().zip(SHELL_CUBIC).map(|(x, d)| x.powi(3) * d))
}

/// HS 117: row j of the dual problem.
fn shell_dual<S: Scalar>(x: &[S], j: usize) -> S {
    let y = &x[10..];
    let column: Vec<f64> = SHELL.iter().map(|row| row[j]).collect();
    dot(&SHELL_QUADRATIC[j], y) * 2.0 + sq(y[j]) * (3.0 * SHELL_CUBIC[j]) - dot(&column, x) + SHELL_LINEAR[j]
}

/// HS 118: weights of the linear and the quadratic terms.
const PERIOD: [(f64, f64); 3] = [(2.3, 1e-4), (1.7, 1e-4), (2.2, 1.5e-4)];

/// HS 118: x₍ᵢ₊₃₎ − xᵢ + 7, counted from zero.
fn change<S: Scalar>(x: &[S], i: usize) -> S {
    x[i + 3] - x[i] + 7.0
}

/// HS 118: sum of the k-th three variables, counted from zero.
fn period<S: Scalar>(x: &[S], k: usize) -> S {
    x[3 * k] + x[3 * k + 1] + x[3 * k + 2]
}

problems! {
    HOCK_SCHITTKOWSKI, Suite::HockSchittkowski;

    hs57 "Fit of chlorine measurements"
        start [0.42, 5.0];
        within [(0.4, INF), (-4.0, INF)];
        minimize |[x1, x2]| chlorine(x1, x2);
        subject to [at_least(x2 * 0.49 - x1 * x2 - 0.09)];
        solution Optima(&[at(0.028_459_669_722_987, &[0.419_952_646_9, 1.284_845_124])]);
    hs72 "Sample sizes, reciprocal rows of small values"
        start [1.0; 4];
        within [(0.001, 4e5), (0.001, 3e5), (0.001, 2e5), (0.001, 1e5)];
        minimize |[x1, x2, x3, x4]| x1 + x2 + x3 + x4 + 1.0;
        subject to [
            at_least(-x1.recip() * 4.0 - x2.recip() * 2.25 - x3.recip() - x4.recip() * 0.25 + 0.0401),
            at_least(-x1.recip() * 0.16 - x2.recip() * 0.36 - x3.recip() * 0.64 - x4.recip() * 0.64 + 0.010_085),
        ];
        solution Optima(&[at(727.679_37, &[193.407_1, 179.547_5, 185.018_6, 168.706_2])]);
    hs76 "Convex quadratic program"
        start [0.5; 4];
        within [POSITIVE];
        minimize |[x1, x2, x3, x4]| sq(x1) + sq(x2) * 0.5 + sq(x3) + sq(x4) * 0.5 - x1 * x3 + x3 * x4 - x1 - x2 * 3.0
            + x3 - x4;
        subject to [
            at_least(-x1 - x2 * 2.0 - x3 - x4 + 5.0),
            at_least(-x1 * 3.0 - x2 - x3 * 2.0 + x4 + 4.0),
            at_least(x2 + x3 * 4.0 - 1.5),
        ];
        solution Optima(&[at(-103.0 / 22.0, &[3.0 / 11.0, 23.0 / 11.0, 0.0, 6.0 / 11.0])]);
    hs83 "Colville's third problem"
        start [78.0, 33.0, 27.0, 27.0, 27.0];
        within [(78.0, 102.0), (33.0, 45.0), (27.0, 45.0), (27.0, 45.0), (27.0, 45.0)];
        minimize |[x1, x2, x3, x4, x5]| sq(x3) * 5.357_854_7 + x1 * x5 * 0.835_689_1 + x1 * 37.293_239 - 40_792.141;
        subject to [
            at_least(x2 * x5 * 0.005_685_8 + x1 * x4 * 0.000_626_2 - x3 * x5 * 0.002_205_3 + 85.334_407),
            at_most(x2 * x5 * 0.005_685_8 + x1 * x4 * 0.000_626_2 - x3 * x5 * 0.002_205_3 + 85.334_407 - 92.0),
            at_least(x2 * x5 * 0.007_131_7 + x1 * x2 * 0.002_995_5 + sq(x3) * 0.002_181_3 + 80.512_49 - 90.0),
            at_most(x2 * x5 * 0.007_131_7 + x1 * x2 * 0.002_995_5 + sq(x3) * 0.002_181_3 + 80.512_49 - 110.0),
            at_least(x3 * x5 * 0.004_702_6 + x1 * x3 * 0.001_254_7 + x3 * x4 * 0.001_908_5 + 9.300_961 - 20.0),
            at_most(x3 * x5 * 0.004_702_6 + x1 * x3 * 0.001_254_7 + x3 * x4 * 0.001_908_5 + 9.300_961 - 25.0),
        ];
        solution Optima(&[at(-30_665.538_67, &[78.0, 33.0, 29.995_26, 45.0, 36.775_81])]);
    hs86 "Colville's first problem: cubic, ten linear rows"
        start [0.0, 0.0, 0.0, 0.0, 1.0];
        within [POSITIVE];
        minimize |ref x| dot(&SHELL_LINEAR, x) + shell_quadratic(x) + shell_cubic(x);
        subject to [
            at_least(dot(&SHELL[0], x) - SHELL_LIMITS[0]),
            at_least(dot(&SHELL[1], x) - SHELL_LIMITS[1]),
            at_least(dot(&SHELL[2], x) - SHELL_LIMITS[2]),
            at_least(dot(&SHELL[3], x) - SHELL_LIMITS[3]),
            at_least(dot(&SHELL[4], x) - SHELL_LIMITS[4]),
            at_least(dot(&SHELL[5], x) - SHELL_LIMITS[5]),
            at_least(dot(&SHELL[6], x) - SHELL_LIMITS[6]),
            at_least(dot(&SHELL[7], x) - SHELL_LIMITS[7]),
            at_least(dot(&SHELL[8], x) - SHELL_LIMITS[8]),
            at_least(dot(&SHELL[9], x) - SHELL_LIMITS[9]),
        ];
        solution Optima(&[at(-32.348_678_97, &[0.3, 0.333_467_61, 0.4, 0.428_310_1, 0.223_964_87])]);
    hs93 "Transformer"
        start [5.54, 4.4, 12.02, 11.82, 0.702, 0.852];
        within [POSITIVE];
        minimize |ref x| {
            let [a, b] = transformer(x);
            a * 0.0204 + b * 0.0187 + a * sq(x[4]) * 0.0607 + b * sq(x[5]) * 0.0437
        };
        subject to [
            at_least(x[0] * x[1] * x[2] * x[3] * x[4] * x[5] * 0.001 - 2.07),
            at_least({
                let [a, b] = transformer(x);
                -a * sq(x[4]) * 0.000_62 - b * sq(x[5]) * 0.000_58 + 1.0
            }),
        ];
        solution Optima(&[
            at(
                135.075_962_86,
                &[
                    5.332_668_098, 4.656_744_344, 10.432_991_41, 12.082_302_07, 0.752_607_426_3, 0.878_650_898_1,
                ],
            ),
        ]);
    hs95 "Process with bilinear rows, first limits"
        start [0.0; 6];
        within PROCESS_BOUNDS;
        minimize |ref x| dot(&PROCESS, x);
        subject to [
            at_least(process(x, [4.97, -1.88, -29.08, -78.02])[0]),
            at_least(process(x, [4.97, -1.88, -29.08, -78.02])[1]),
            at_least(process(x, [4.97, -1.88, -29.08, -78.02])[2]),
            at_least(process(x, [4.97, -1.88, -29.08, -78.02])[3]),
        ];
        solution Optima(&[at(0.015_619_525_2, &[0.0, 0.0, 0.0, 0.0, 0.0, 0.003_323_303_3])]);
    hs96 "Process with bilinear rows, second limits"
        start [0.0; 6];
        within PROCESS_BOUNDS;
        minimize |ref x| dot(&PROCESS, x);
        subject to [
            at_least(process(x, [4.97, -1.88, -69.08, -118.02])[0]),
            at_least(process(x, [4.97, -1.88, -69.08, -118.02])[1]),
            at_least(process(x, [4.97, -1.88, -69.08, -118.02])[2]),
            at_least(process(x, [4.97, -1.88, -69.08, -118.02])[3]),
        ];
        solution Optima(&[at(0.015_619_525_2, &[0.0, 0.0, 0.0, 0.0, 0.0, 0.003_323_303_3])]);
    hs97 "Process with bilinear rows, third limits"
        start [0.0; 6];
        within PROCESS_BOUNDS;
        minimize |ref x| dot(&PROCESS, x);
        subject to [
            at_least(process(x, [32.97, 25.12, -29.08, -78.02])[0]),
            at_least(process(x, [32.97, 25.12, -29.08, -78.02])[1]),
            at_least(process(x, [32.97, 25.12, -29.08, -78.02])[2]),
            at_least(process(x, [32.97, 25.12, -29.08, -78.02])[3]),
        ];
        solution Optima(&[
            at(3.135_809_122_8, &[0.268_564_912_3, 0.0, 0.0, 0.0, 0.028, 0.0134]),
            at(4.071_246_357_33, &[0.0, 0.0, 0.063_321_743_39, 0.0, 0.0, 0.0134]),
        ]);
    hs98 "Process with bilinear rows, fourth limits"
        start [0.0; 6];
        within PROCESS_BOUNDS;
        minimize |ref x| dot(&PROCESS, x);
        subject to [
            at_least(process(x, [32.97, 25.12, -124.08, -173.02])[0]),
            at_least(process(x, [32.97, 25.12, -124.08, -173.02])[1]),
            at_least(process(x, [32.97, 25.12, -124.08, -173.02])[2]),
            at_least(process(x, [32.97, 25.12, -124.08, -173.02])[3]),
        ];
        solution Optima(&[
            at(3.135_809_122_8, &[0.268_564_912_3, 0.0, 0.0, 0.0, 0.028, 0.0134]),
            at(4.071_246_357_33, &[0.0, 0.0, 0.063_321_743_39, 0.0, 0.0, 0.0134]),
        ]);
    hs100 "Polynomials in seven variables, two of which start at zero"
        start [1.0, 2.0, 0.0, 4.0, 0.0, 1.0, 1.0];
        minimize |[x1, x2, x3, x4, x5, x6, x7]| sq(x1 - 10.0) + sq(x2 - 12.0) * 5.0 + x3.powi(4) + sq(x4 - 11.0) * 3.0
            + x5.powi(6) * 10.0 + sq(x6) * 7.0 + x7.powi(4) - x6 * x7 * 4.0 - x6 * 10.0 - x7 * 8.0;
        subject to [
            at_least(-sq(x1) * 2.0 - x2.powi(4) * 3.0 - x3 - sq(x4) * 4.0 - x5 * 5.0 + 127.0),
            at_least(-x1 * 7.0 - x2 * 3.0 - sq(x3) * 10.0 - x4 + x5 + 282.0),
            at_least(-x1 * 23.0 - sq(x2) - sq(x6) * 6.0 + x7 * 8.0 + 196.0),
            at_least(-sq(x1) * 4.0 - sq(x2) + x1 * x2 * 3.0 - sq(x3) * 2.0 - x6 * 5.0 + x7 * 11.0),
        ];
        solution Optima(&[at(
            680.630_057_3,
            &[2.330_499, 1.951_372, -0.477_541_4, 4.365_726, -0.624_487_0, 1.038_131, 1.594_227],
        )]);
    hs101 "Geometric program, exponent -1/4"
        start [6.0; 7];
        within GEOMETRIC_BOUNDS;
        minimize |ref x| geometric(x, -0.25);
        subject to [
            at_least(-posynomials(x)[0] + 1.0),
            at_least(-posynomials(x)[1] + 1.0),
            at_least(-posynomials(x)[2] + 1.0),
            at_least(-posynomials(x)[3] + 1.0),
            at_least(geometric(x, -0.25) - 100.0),
            at_most(geometric(x, -0.25) - 3000.0),
        ];
        solution Optima(&[
            at(
                1_809.764_765_570_905,
                &[
                    2.856_158_548, 0.610_823_024_5, 2.150_812_565, 4.712_873_466, 0.999_487_537_2, 1.347_507_472,
                    0.031_652_764_52,
                ],
            ),
        ]);
    hs102 "Geometric program, exponent 1/8"
        start [6.0; 7];
        within GEOMETRIC_BOUNDS;
        minimize |ref x| geometric(x, 0.125);
        subject to [
            at_least(-posynomials(x)[0] + 1.0),
            at_least(-posynomials(x)[1] + 1.0),
            at_least(-posynomials(x)[2] + 1.0),
            at_least(-posynomials(x)[3] + 1.0),
            at_least(geometric(x, 0.125) - 100.0),
            at_most(geometric(x, 0.125) - 3000.0),
        ];
        solution Optima(&[
            at(
                911.880_571_430_083,
                &[
                    3.896_253_175, 0.809_358_762_6, 2.664_385_993, 4.300_912_894, 0.853_554_933_1, 1.095_287_444,
                    0.027_310_460_15,
                ],
            ),
        ]);
    hs103 "Geometric program, exponent 1/2"
        start [6.0; 7];
        within GEOMETRIC_BOUNDS;
        minimize |ref x| geometric(x, 0.5);
        subject to [
            at_least(-posynomials(x)[0] + 1.0),
            at_least(-posynomials(x)[1] + 1.0),
            at_least(-posynomials(x)[2] + 1.0),
            at_least(-posynomials(x)[3] + 1.0),
            at_least(geometric(x, 0.5) - 100.0),
            at_most(geometric(x, 0.5) - 3000.0),
        ];
        solution Optima(&[
            at(
                543.667_958_465_356,
                &[
                    4.394_104_483, 0.854_468_737_3, 2.843_230_313, 3.399_978_688, 0.722_926_136, 0.870_406_386_4,
                    0.024_638_826_99,
                ],
            ),
        ]);
    hs104 "Two reactors"
        start [6.0, 3.0, 0.4, 0.2, 6.0, 6.0, 1.0, 0.5];
        within [(0.1, 10.0)];
        minimize |ref x| reactors(x);
        subject to [
            at_least(-x[4] * x[6] * 0.0588 - x[0] * 0.1 + 1.0),
            at_least(-x[5] * x[7] * 0.0588 - x[0] * 0.1 - x[1] * 0.1 + 1.0),
            at_least(-x[2] / x[4] * 4.0 - x[2].powf(-0.71) / x[4] * 2.0 - x[2].powf(-1.3) * x[6] * 0.0588 + 1.0),
            at_least(-x[3] / x[5] * 4.0 - x[3].powf(-0.71) / x[5] * 2.0 - x[3].powf(-1.3) * x[7] * 0.0588 + 1.0),
            at_least(reactors(x) - 1.0),
            at_most(reactors(x) - 4.2),
        ];
        solution Optima(&[at(
            3.951_163_439_6,
            &[6.465_114, 2.232_709, 0.667_397_5, 0.595_756_4, 5.932_676, 5.527_235, 1.013_322, 0.400_668_2],
        )]);
    hs106 "Heat exchangers, badly scaled"
        start [5000.0, 5000.0, 5000.0, 200.0, 350.0, 150.0, 225.0, 425.0];
        within [
            (100.0, 1e4), (1000.0, 1e4), (1000.0, 1e4), (10.0, 1000.0), (10.0, 1000.0), (10.0, 1000.0), (10.0, 1000.0),
            (10.0, 1000.0),
        ];
        minimize |ref x| x[0] + x[1] + x[2];
        subject to [
            at_least(-(x[3] + x[5]) * 0.0025 + 1.0),
            at_least(-(x[4] + x[6] - x[3]) * 0.0025 + 1.0),
            at_least(-(x[7] - x[4]) * 0.01 + 1.0),
            at_least(x[0] * x[5] - x[3] * 833.332_52 - x[0] * 100.0 + 83_333.333),
            at_least(x[1] * x[6] - x[4] * 1250.0 - x[1] * x[3] + x[3] * 1250.0),
            at_least(x[2] * x[7] - x[2] * x[4] + x[4] * 2500.0 - 1.25e6),
        ];
        solution Optima(&[
            at(
                7_049.248_020_528_657,
                &[
                    579.306_673_4, 1_359.970_675, 5_109.970_672, 182.017_698_7, 295.601_173_1, 217.982_301_3,
                    286.416_525_5, 395.601_173_1,
                ],
            ),
        ]);
    hs108 "Largest area of a hexagon of diameter one"
        start [1.0; 9];
        within [
            (-INF, INF), (-INF, INF), (-INF, INF), (-INF, INF), (-INF, INF), (-INF, INF), (-INF, INF), (-INF, INF),
            POSITIVE,
        ];
        minimize |[x1, x2, x3, x4, x5, x6, x7, x8, x9]|
            (x1 * x4 - x2 * x3 + x3 * x9 - x5 * x9 + x5 * x8 - x6 * x7) * -0.5;
        subject to [
            at_least(-sq(x3) - sq(x4) + 1.0),
            at_least(-sq(x9) + 1.0),
            at_least(-sq(x5) - sq(x6) + 1.0),
            at_least(-sq(x1) - sq(x2 - x9) + 1.0),
            at_least(-sq(x1 - x5) - sq(x2 - x6) + 1.0),
            at_least(-sq(x1 - x7) - sq(x2 - x8) + 1.0),
            at_least(-sq(x3 - x5) - sq(x4 - x6) + 1.0),
            at_least(-sq(x3 - x7) - sq(x4 - x8) + 1.0),
            at_least(-sq(x7) - sq(x8 - x9) + 1.0),
            at_least(x1 * x4 - x2 * x3),
            at_least(x3 * x9),
            at_least(-x5 * x9),
            at_least(x5 * x8 - x6 * x7),
        ];
        solution Optima(&[at(
            -0.866_025_403_8,
            &[
                0.884_129_2, 0.467_242_5, 0.037_420_76, 0.999_299_6, 0.884_129_2, 0.467_242_5, 0.037_420_76, 0.999_299_6,
                0.0,
            ],
        )]);
    hs113 "Wong's second problem"
        start [2.0, 3.0, 5.0, 5.0, 1.0, 2.0, 7.0, 3.0, 6.0, 10.0];
        minimize |[x1, x2, x3, x4, x5, x6, x7, x8, x9, x10]| sq(x1) + sq(x2) + x1 * x2 - x1 * 14.0 - x2 * 16.0
            + sq(x3 - 10.0) + sq(x4 - 5.0) * 4.0 + sq(x5 - 3.0) + sq(x6 - 1.0) * 2.0 + sq(x7) * 5.0
            + sq(x8 - 11.0) * 7.0 + sq(x9 - 10.0) * 2.0 + sq(x10 - 7.0) + 45.0;
        subject to [
            at_least(-x1 * 4.0 - x2 * 5.0 + x7 * 3.0 - x8 * 9.0 + 105.0),
            at_least(-x1 * 10.0 + x2 * 8.0 + x7 * 17.0 - x8 * 2.0),
            at_least(x1 * 8.0 - x2 * 2.0 - x9 * 5.0 + x10 * 2.0 + 12.0),
            at_least(-sq(x1 - 2.0) * 3.0 - sq(x2 - 3.0) * 4.0 - sq(x3) * 2.0 + x4 * 7.0 + 120.0),
            at_least(-sq(x1) * 5.0 - x2 * 8.0 - sq(x3 - 6.0) + x4 * 2.0 + 40.0),
            at_least(-sq(x1 - 8.0) * 0.5 - sq(x2 - 4.0) * 2.0 - sq(x5) * 3.0 + x6 + 30.0),
            at_least(-sq(x1) - sq(x2 - 2.0) * 2.0 + x1 * x2 * 2.0 - x5 * 14.0 + x6 * 6.0),
            at_least(x1 * 3.0 - x2 * 6.0 - sq(x9 - 8.0) * 12.0 + x10 * 7.0),
        ];
        solution Optima(&[
            at(
                24.306_209_068_099,
                &[
                    2.171_996_39, 2.363_682_955, 8.773_925_79, 5.095_984_763, 0.990_654_773_9, 1.430_574_008,
                    1.321_644_229, 9.828_725_817, 8.280_091_73, 8.375_926_718,
                ],
            ),
        ]);
    hs116 "Membrane separation in three stages"
        start [0.5, 0.8, 0.9, 0.1, 0.14, 0.5, 489.0, 80.0, 650.0, 450.0, 150.0, 150.0, 150.0];
        within [
            (0.1, 1.0), (0.1, 1.0), (0.1, 1.0), (1e-4, 0.1), (0.1, 0.9), (0.1, 0.9), (0.1, 1000.0), (0.1, 1000.0),
            (500.0, 1000.0), (0.1, 500.0), (1.0, 150.0), (1e-4, 150.0), (1e-4, 150.0),
        ];
        minimize |[x1, x2, x3, x4, x5, x6, x7, x8, x9, x10, x11, x12, x13]| x11 + x12 + x13;
        subject to [
            at_least(x3 - x2),
            at_least(x2 - x1),
            at_least(-x7 * 0.002 + x8 * 0.002 + 1.0),
            at_least(x11 + x12 + x13 - 50.0),
            at_most(x11 + x12 + x13 - 250.0),
            at_least(x13 - x10 * 1.262_626 + x3 * x10 * 1.231_059),
            at_least(x5 - x2 * 0.034_75 - x2 * x5 * 0.975 + sq(x2) * 0.009_75),
            at_least(x6 - x3 * 0.034_75 - x3 * x6 * 0.975 + sq(x3) * 0.009_75),
            at_least(x5 * x7 - x1 * x8 - x4 * x7 + x4 * x8),
            at_least(-(x2 * x9 + x5 * x8 - x1 * x8 - x6 * x9) * 0.002 - x5 - x6 + 1.0),
            at_least(x2 * x9 - x3 * x10 - x6 * x9 - x2 * 500.0 + x6 * 500.0 + x2 * x10),
            at_least(x2 - (x2 * x10 - x3 * x10) * 0.002 - 0.9),
            at_least(x4 - x1 * 0.034_75 - x1 * x4 * 0.975 + sq(x1) * 0.009_75),
            at_least(x11 - x8 * 1.262_626 + x1 * x8 * 1.231_059),
            at_least(x12 - x9 * 1.262_626 + x2 * x9 * 1.231_059),
        ];
        solution Optima(&[
            at(
                97.587_509_558_07,
                &[
                    0.803_773_157_4, 0.899_985_800_6, 0.970_982_650_4, 0.1, 0.190_813_176_1, 0.460_656_658_3,
                    574.077_573_5, 74.077_573_52, 500.016_160_3, 0.1, 20.233_090_68, 77.347_689_97, 0.006_728_906_933,
                ],
            ),
            // The optimum that most programs end at; x₆ is free within bounds.
            at(
                97.591_034_663_7,
                &[
                    0.803_773_157_4, 0.9, 0.9, 0.1, 0.190_836_734_7, 0.874_190_132_3, 574.099_638_5, 74.099_638_5, 500.0,
                    0.1, 20.239_117_37, 77.336_45, 0.015_467_29,
                ],
            ),
        ]);
    hs117 "Colville's second problem: dual of the first"
        start [0.001, 0.001, 0.001, 0.001, 0.001, 0.001, 60.0, 0.001, 0.001, 0.001, 0.001, 0.001, 0.001, 0.001, 0.001];
        within [POSITIVE];
        minimize |ref x| -dot(&SHELL_LIMITS, x) + shell_quadratic(&x[10..]) + shell_cubic(&x[10..]) * 2.0;
        subject to [
            at_least(shell_dual(x, 0)),
            at_least(shell_dual(x, 1)),
            at_least(shell_dual(x, 2)),
            at_least(shell_dual(x, 3)),
            at_least(shell_dual(x, 4)),
        ];
        solution Optima(&[
            at(
                32.348_678_96,
                &[
                    0.0, 0.0, 5.174_040_727, 0.0, 3.061_108_672, 11.839_545_76, 0.0, 0.0, 0.103_896_251_4, 0.0,
                    0.300_000_003_1, 0.333_467_609_1, 0.400_000_004_7, 0.428_310_111_5, 0.223_964_883_2,
                ],
            ),
        ]);
    hs118 "Quadratic program of five periods"
        start [20.0, 55.0, 15.0, 20.0, 60.0, 20.0, 20.0, 60.0, 20.0, 20.0, 60.0, 20.0, 20.0, 60.0, 20.0];
        within [
            (8.0, 21.0), (43.0, 57.0), (3.0, 16.0), (0.0, 90.0), (0.0, 120.0), (0.0, 60.0), (0.0, 90.0), (0.0, 120.0),
            (0.0, 60.0), (0.0, 90.0), (0.0, 120.0), (0.0, 60.0), (0.0, 90.0), (0.0, 120.0), (0.0, 60.0),
        ];
        minimize |ref x| sum(x.iter().zip(PERIOD.iter().cycle()).map(|(&x, &(a, b))| x * a + sq(x) * b));
        subject to [
            at_least(change(x, 0)), at_most(change(x, 0) - 13.0),
            at_least(change(x, 3)), at_most(change(x, 3) - 13.0),
            at_least(change(x, 6)), at_most(change(x, 6) - 13.0),
            at_least(change(x, 9)), at_most(change(x, 9) - 13.0),
            at_least(change(x, 1)), at_most(change(x, 1) - 14.0),
            at_least(change(x, 4)), at_most(change(x, 4) - 14.0),
            at_least(change(x, 7)), at_most(change(x, 7) - 14.0),
            at_least(change(x, 10)), at_most(change(x, 10) - 14.0),
            at_least(change(x, 2)), at_most(change(x, 2) - 13.0),
            at_least(change(x, 5)), at_most(change(x, 5) - 13.0),
            at_least(change(x, 8)), at_most(change(x, 8) - 13.0),
            at_least(change(x, 11)), at_most(change(x, 11) - 13.0),
            at_least(period(x, 0) - 60.0),
            at_least(period(x, 1) - 50.0),
            at_least(period(x, 2) - 70.0),
            at_least(period(x, 3) - 85.0),
            at_least(period(x, 4) - 100.0),
        ];
        solution Optima(&[at(
            664.820_45,
            &[8.0, 49.0, 3.0, 1.0, 56.0, 0.0, 1.0, 63.0, 6.0, 3.0, 70.0, 12.0, 5.0, 77.0, 18.0],
        )]);
}
