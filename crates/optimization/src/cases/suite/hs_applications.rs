//! Problems of Hock & Schittkowski from applications: networks, trajectories, heat conduction, costs of inspections, a mixture.

use super::Suite;
use super::statement::{FREE, HOCK_SCHITTKOWSKI, POSITIVE, at, problems, sq, sum};
use crate::cases::KnownSolution::Optima;
use autodiff::Scalar;
use std::f64::consts::{FRAC_PI_2, PI, TAU};
use std::sync::LazyLock;

/// HS 54: negative exponent of the normal density in six variables.
fn exponent<S: Scalar>(x: &[S]) -> S {
    let (a, b) = ((x[0] - 1e4) / 8e3, x[1] - 1.0);
    ((sq(a) + a * b * 0.4 + sq(b)) / 0.96
        + sq(x[2] - 2e6) / 4.9e13
        + sq(x[3] - 10.0) / 2.5e3
        + sq(x[4] - 1e-3) / 2.5e-3
        + sq(x[5] - 1e8) / 2.5e17)
        * 0.5
}

/// HS 59: polynomial of fourth degree with an exponential and a reciprocal term.
fn response_surface<S: Scalar>(x: S, y: S) -> S {
    x * 3.8112 - sq(x) * 0.12694 + x.powi(3) * 0.002_056_7 - x.powi(4) * 1.0345e-5 + y * 6.8306 - x * y * 0.030_234
        + sq(x) * y * 1.281_34e-3
        - x.powi(3) * y * 3.5256e-5
        + x.powi(4) * y * 2.266e-7
        - sq(y) * 0.256_45
        + y.powi(3) * 0.003_460_4
        - y.powi(4) * 1.3514e-5
        + (y + 1.0).recip() * 28.106
        + sq(x * y) * 5.2375e-6
        + x.powi(3) * sq(y) * 6.3e-8
        - (x * y).powi(3) * 7e-10
        - x * sq(y) * 3.4054e-4
        + x * y.powi(3) * 1.6638e-6
        + (x * y * 0.0005).exp() * 2.8673
        - 75.196
}

/// HS 68 and 69: the normal distribution Φ(z) by its series ½ + φ(z) Σ z²ᵏ⁺¹/(2k+1)!!, constant beyond nine deviations.
fn normal_distribution<S: Scalar>(z: S) -> S {
    if z.re().abs() > 9.0 {
        return S::from(f64::from(u8::from(z.re() > 0.0)));
    }
    let mut term = z;
    let mut series = z;
    for k in 1..150 {
        term = term * sq(z) / f64::from(2 * k + 1);
        series += term;
    }
    (-sq(z) * 0.5).exp() / (2.0 * PI).sqrt() * series + 0.5
}

/// HS 68 and 69: cost of the inspections in each interval of time, with the constants [a, b, d, n].
fn inspection_cost<S: Scalar>(x: &[S], [a, b, _, n]: [f64; 4]) -> S {
    let growth = x[0].exp() - 1.0;
    -((growth * b - x[2]) * x[3] / (growth + x[3]) - a * n) / x[0]
}

/// HS 68 and 69: probabilities of a false and of a right alarm, minus the variables for them.
fn alarms<S: Scalar>(x: &[S], [_, _, d, n]: [f64; 4]) -> [S; 2] {
    let shift = d * n.sqrt();
    [
        x[2] - normal_distribution(-x[1]) * 2.0,
        x[3] - normal_distribution(-x[1] + shift) - normal_distribution(-x[1] - shift),
    ]
}

const RARE_INSPECTIONS: [f64; 4] = [1e-4, 1.0, 1.0, 24.0];
const COSTLY_INSPECTIONS: [f64; 4] = [0.1, 1000.0, 1.0, 4.0];

/// HS 70: measured concentrations at the times 0.1, 1, 2, …, 18.
const CONCENTRATIONS: [f64; 19] = [
    0.001_89, 0.1038, 0.268, 0.506, 0.577, 0.604, 0.725, 0.898, 0.947, 0.845, 0.702, 0.528, 0.385, 0.257, 0.159,
    0.0869, 0.0453, 0.015_09, 0.001_89,
];

/// HS 70: sum of squares of the fit by two gamma densities.
fn gamma_densities<S: Scalar>(x: &[S]) -> S {
    let mean = x[2] + (-x[2] + 1.0) * x[3];
    let density = |shape: S, scale: S, c: f64| {
        let gamma = (shape / TAU).sqrt() / ((shape * 12.0).recip() + 1.0);
        gamma * scale.ln().mul_add(shape, (shape - 1.0) * (c / 7.658).ln() + shape - shape * scale * (c / 7.658)).exp()
    };
    sum(CONCENTRATIONS.iter().enumerate().map(|(i, &measured)| {
        let c = if i == 0 { 0.1 } else { i as f64 };
        sq(x[2] * density(x[1], mean, c) + (-x[2] + 1.0) * density(x[0], mean / x[3], c) - measured)
    }))
}

/// HS 84: x₁ (c₁ + c₂ x₂ + … + c₅ x₅).
fn colville_second<S: Scalar>(x: &[S], c: [f64; 5]) -> S {
    x[0] * (x[1] * c[1] + x[2] * c[2] + x[3] * c[3] + x[4] * c[4] + c[0])
}

const COLVILLE_ROWS: [[f64; 5]; 3] = [
    [-145_421.402, 2931.1506, -40.427_932, 5106.192, 15_711.36],
    [-155_011.108_4, 4_360.533_52, 12.949_234_4, 10_236.884, 13_176.786],
    [-326_669.510_4, 7_390.684_12, -27.898_697_6, 16_643.076, 30_988.146],
];

/// HS 88 to 92: the roots of μ tan μ = 1.
static ROOTS: LazyLock<[f64; 30]> = LazyLock::new(|| {
    std::array::from_fn(|k| {
        let mut root = PI * k as f64 + 0.5;
        for _ in 0..100 {
            root = PI * k as f64 + FRAC_PI_2 - root.atan();
        }
        root
    })
});

/// HS 88 to 92: mean square of the deviation from the wanted temperature, by 30 eigenfunctions of heat conduction, for heating
/// and cooling over the times xᵢ².
fn temperature_error<S: Scalar>(x: &[S]) -> S {
    let times: Vec<S> = (0..x.len()).map(|i| sum(x[i..].iter().map(|&x| sq(x)))).collect();
    let last = if x.len().is_multiple_of(2) { 1.0 } else { -1.0 };
    let of_root = |&m: &f64| {
        let (sine, cosine) = m.sin_cos();
        let switched = sum(times.iter().enumerate().map(|(i, &time)| {
            let weight = if i == 0 { 1.0 } else { 2.0 } * if i % 2 == 0 { -1.0 } else { 1.0 };
            (-time * (m * m)).exp() * weight
        }));
        let amplitude = (switched - last) * (2.0 * sine / (m + sine * cosine));
        sq(amplitude) * ((m + sine * cosine) / (2.0 * m)) - amplitude * (2.0 * (sine - m * cosine) / m.powi(3))
    };
    sum(ROOTS.iter().map(of_root)) + 2.0 / 15.0
}

/// HS 88 to 92: optimum of any number of variables; further times may be zero.
const HEATING: [f64; 6] = [1.074_318_733_1, -0.456_613_703_93, 0.0, 0.0, 0.0, 0.0];
const HEATING_OPTIMUM: f64 = 1.362_656_814_889;

/// HS 99: range, height and climb rate of a rocket after seven arcs with the given angles.
fn trajectory<S: Scalar>(angles: &[S]) -> [S; 3] {
    const THRUST: [f64; 7] = [50.0, 50.0, 75.0, 75.0, 75.0, 100.0, 100.0];
    const DURATIONS: [f64; 7] = [25.0, 25.0, 50.0, 50.0, 50.0, 90.0, 90.0];
    let [mut range, mut height, mut climb] = [S::from(0.0); 3];
    for ((&angle, thrust), duration) in angles.iter().zip(THRUST).zip(DURATIONS) {
        let acceleration = angle.sin() * thrust - 32.0;
        range += angle.cos() * (thrust * duration);
        height += acceleration * (0.5 * duration * duration) + climb * duration;
        climb += acceleration * duration;
    }
    [range, height, climb]
}

/// HS 107: the power balances of a network with three nodes.
fn network<S: Scalar>(x: &[S]) -> [S; 6] {
    let (c, d) = (48.4 / 50.176 * 0.25_f64.sin(), 48.4 / 50.176 * 0.25_f64.cos());
    // Flows from a node to another one, over a line with losses.
    let flow = |a: usize, b: usize, angle: S| x[a] * x[b] * (angle.sin() * d + angle.cos() * c);
    let reactive = |a: usize, b: usize, angle: S| x[a] * x[b] * (angle.sin() * c - angle.cos() * d);
    let between = x[7] - x[8];
    [
        sq(x[4]) * (2.0 * c) - flow(4, 5, x[7]) - flow(4, 6, x[8]) - x[0] + 0.4,
        sq(x[5]) * (2.0 * c) - flow(4, 5, -x[7]) - flow(5, 6, -between) - x[1] + 0.4,
        sq(x[6]) * (2.0 * c) - flow(4, 6, -x[8]) - flow(5, 6, between) + 0.8,
        sq(x[4]) * (2.0 * d) + reactive(4, 5, x[7]) + reactive(4, 6, x[8]) - x[2] + 0.2,
        sq(x[5]) * (2.0 * d) + reactive(4, 5, -x[7]) + reactive(5, 6, -between) - x[3] + 0.2,
        sq(x[6]) * (2.0 * d) + reactive(4, 6, -x[8]) + reactive(5, 6, between) - 0.337,
    ]
}

/// HS 109: the power balances of a network with three nodes, in volts and megawatts.
fn large_network<S: Scalar>(x: &[S]) -> [S; 6] {
    const A: f64 = 50.176;
    let (b, c) = (0.25_f64.sin(), 0.25_f64.cos());
    let between = x[2] - x[3];
    let active = |i: usize, j: usize, angle: S| x[i] * x[j] * (angle - 0.25).sin();
    let reactive = |i: usize, j: usize, angle: S| x[i] * x[j] * (angle - 0.25).cos();
    let own = 0.7533e-3 * A - 2.0 * c;
    [
        active(4, 5, -x[2]) + active(4, 6, -x[3]) + sq(x[4]) * (2.0 * b) - x[0] * A + 400.0 * A,
        active(4, 5, x[2]) + active(5, 6, between) + sq(x[5]) * (2.0 * b) - x[1] * A + 400.0 * A,
        active(4, 6, x[3]) + active(5, 6, -between) + sq(x[6]) * (2.0 * b) + 881.779 * A,
        reactive(4, 5, -x[2]) + reactive(4, 6, -x[3]) + sq(x[4]) * own + x[7] * A - 200.0 * A,
        reactive(4, 5, x[2]) + reactive(5, 6, between) + sq(x[5]) * own + x[8] * A - 200.0 * A,
        reactive(4, 6, x[3]) + reactive(5, 6, -between) + sq(x[6]) * own - 22.938 * A,
    ]
}

problems! {
    HOCK_SCHITTKOWSKI, Suite::HockSchittkowski;

    hs54 "Normal density in six variables of sizes from 1e-3 to 1e8"
        start [6e3, 1.5, 4e6, 2.0, 3e-3, 5e7];
        within [(0.0, 2e4), (-10.0, 10.0), (0.0, 1e7), (0.0, 20.0), (-1.0, 1.0), (0.0, 2e8)];
        minimize |ref x| -(-exponent(x)).exp();
        subject to [equal(x[0] + x[1] * 4e3 - 1.76e4)];
        solution Optima(&[at(-0.908_074_757_765_98, &[91_600.0 / 7.0, 79.0 / 70.0, 2e6, 10.0, 1e-3, 1e8])]);
    hs59 "Response surface with several minima"
        start [90.0, 10.0];
        within [(0.0, 75.0), (0.0, 65.0)];
        minimize |[x1, x2]| response_surface(x1, x2);
        subject to [
            at_least(x1 * x2 - 700.0),
            at_least(x2 - sq(x1) / 125.0),
            at_least(sq(x2 - 50.0) - (x1 - 55.0) * 5.0),
        ];
        solution Optima(&[at(-7.804_235_953_663_6, &[13.550_089_96, 51.660_173_62])]);
    hs68 "Inspections of a process, rare failures"
        start [1.0; 4];
        within [(1e-4, 100.0), (0.0, 100.0), (0.0, 2.0), (0.0, 2.0)];
        minimize |ref x| inspection_cost(x, RARE_INSPECTIONS);
        subject to [equal(alarms(x, RARE_INSPECTIONS)[0]), equal(alarms(x, RARE_INSPECTIONS)[1])];
        solution Optima(&[at(
            -0.920_425_003_64,
            &[0.067_858_570_571, 3.646_210_859_2, 0.000_266_135_621_59, 0.894_855_038_74],
        )]);
    hs69 "Inspections of a process, costly failures"
        start [1.0; 4];
        within [(1e-4, 100.0), (0.0, 100.0), (0.0, 2.0), (0.0, 2.0)];
        minimize |ref x| inspection_cost(x, COSTLY_INSPECTIONS);
        subject to [equal(alarms(x, COSTLY_INSPECTIONS)[0]), equal(alarms(x, COSTLY_INSPECTIONS)[1])];
        solution Optima(&[at(
            -956.712_886_65,
            &[0.029_371_407_928, 1.190_253_627_6, 0.233_946_721_04, 0.791_667_759_87],
        )]);
    hs70 "Fit of two gamma densities"
        start [2.0, 4.0, 0.04, 2.0];
        within [(1e-5, 100.0), (1e-5, 100.0), (1e-5, 1.0), (1e-5, 100.0)];
        minimize |ref x| gamma_densities(x);
        subject to [at_least(x[2] + (-x[2] + 1.0) * x[3])];
        solution Optima(&[at(
            0.007_498_504_347_838,
            &[12.276_972_499, 4.631_730_937_5, 0.312_865_374_18, 2.029_281_054_8],
        )]);
    hs84 "Colville's second problem"
        start [2.52, 2.0, 37.5, 9.25, 6.8];
        within [(0.0, 1000.0), (1.2, 2.4), (20.0, 60.0), (9.0, 9.3), (6.5, 7.0)];
        minimize |ref x| {
            -colville_second(x, [-8_720_288.849, 150_512.525_3, -156.695_032_5, 476_470.322_2, 729_482.827_1]) + 24_345.0
        };
        subject to [
            at_least(colville_second(x, COLVILLE_ROWS[0])),
            at_least(colville_second(x, COLVILLE_ROWS[1])),
            at_least(colville_second(x, COLVILLE_ROWS[2])),
            at_most(colville_second(x, COLVILLE_ROWS[0]) - 294_000.0),
            at_most(colville_second(x, COLVILLE_ROWS[1]) - 294_000.0),
            at_most(colville_second(x, COLVILLE_ROWS[2]) - 277_200.0),
        ];
        solution Optima(&[at(-5_280_335.133_214_8, &[4.537_430_974_7, 2.4, 60.0, 9.3, 7.0])]);
    hs88 "Heat conduction, two switching times"
        start [0.5, -0.5];
        minimize |ref x| sum(x.iter().map(|&x| sq(x)));
        subject to [at_most(temperature_error(x) - 1e-4)];
        solution Optima(&[at(HEATING_OPTIMUM, HEATING.first_chunk::<2>().unwrap())]);
    hs89 "Heat conduction, three switching times"
        start [0.5, -0.5, 0.5];
        minimize |ref x| sum(x.iter().map(|&x| sq(x)));
        subject to [at_most(temperature_error(x) - 1e-4)];
        solution Optima(&[at(HEATING_OPTIMUM, HEATING.first_chunk::<3>().unwrap())]);
    hs90 "Heat conduction, four switching times"
        start [0.5, -0.5, 0.5, -0.5];
        minimize |ref x| sum(x.iter().map(|&x| sq(x)));
        subject to [at_most(temperature_error(x) - 1e-4)];
        solution Optima(&[at(HEATING_OPTIMUM, HEATING.first_chunk::<4>().unwrap())]);
    hs91 "Heat conduction, five switching times"
        start [0.5, -0.5, 0.5, -0.5, 0.5];
        minimize |ref x| sum(x.iter().map(|&x| sq(x)));
        subject to [at_most(temperature_error(x) - 1e-4)];
        solution Optima(&[at(HEATING_OPTIMUM, HEATING.first_chunk::<5>().unwrap())]);
    hs92 "Heat conduction, six switching times"
        start [0.5, -0.5, 0.5, -0.5, 0.5, -0.5];
        minimize |ref x| sum(x.iter().map(|&x| sq(x)));
        subject to [at_most(temperature_error(x) - 1e-4)];
        solution Optima(&[at(HEATING_OPTIMUM, HEATING.first_chunk::<6>().unwrap())]);
    hs99 "Range of a rocket with given final height and climb rate"
        start [0.5; 7];
        within [(0.0, 1.58)];
        minimize |ref x| -sq(trajectory(x)[0]);
        subject to [equal(trajectory(x)[1] - 1e5), equal(trajectory(x)[2] - 1e3)];
        solution Optima(&[at(
            -831_079_891.510_107,
            &[
                0.542_467_773_48, 0.529_021_520_7, 0.508_449_138_17, 0.480_268_854_22, 0.451_236_335_92, 0.409_183_087_25,
                0.352_787_891_06,
            ],
        )]);
    hs107 "Power flow in a network, per unit"
        start [0.8, 0.8, 0.2, 0.2, 1.0454, 1.0454, 1.0454, 0.0, 0.0];
        within [
            POSITIVE, POSITIVE, FREE, FREE, (0.909_09, 1.0909), (0.909_09, 1.0909), (0.909_09, 1.0909), FREE, FREE,
        ];
        minimize |ref x| x[0] * 3000.0 + x[0].powi(3) * 1000.0 + x[1] * 2000.0 + x[1].powi(3) * 666.667;
        subject to [
            equal(network(x)[0]),
            equal(network(x)[1]),
            equal(network(x)[2]),
            equal(network(x)[3]),
            equal(network(x)[4]),
            equal(network(x)[5]),
        ];
        solution Optima(&[at(
            5_055.011_803_543_9,
            &[
                0.667_012_614_37, 1.022_384_873_8, 0.228_287_180_47, 0.184_821_754_91, 1.0909, 1.0909, 1.069_035_999_9,
                0.106_610_714_2, -0.338_787_575_43,
            ],
        )]);
    hs109 "Power flow in a network, in volts and megawatts, from zero"
        start [0.0; 9];
        within [
            POSITIVE, POSITIVE, (-0.55, 0.55), (-0.55, 0.55), (196.0, 252.0), (196.0, 252.0), (196.0, 252.0),
            (-400.0, 800.0), (-400.0, 800.0),
        ];
        minimize |ref x| x[0] * 3.0 + x[0].powi(3) * 1e-6 + x[1] * 2.0 + x[1].powi(3) * 0.522_074e-6;
        subject to [
            at_least(x[3] - x[2] + 0.55),
            at_least(x[2] - x[3] + 0.55),
            at_least(-sq(x[0]) - sq(x[7]) + 2.25e6),
            at_least(-sq(x[1]) - sq(x[8]) + 2.25e6),
            equal(large_network(x)[0]),
            equal(large_network(x)[1]),
            equal(large_network(x)[2]),
            equal(large_network(x)[3]),
            equal(large_network(x)[4]),
            equal(large_network(x)[5]),
        ];
        solution Optima(&[at(
            5_362.069_181_109,
            &[
                675.025_370_35, 1_134.021_055_9, 0.133_485_031_89, -0.371_190_271_18, 252.0, 252.0, 201.465_858_03,
                426.618_996_2, 368.488_197_76,
            ],
        )]);
}
