//! Number types of this crate compared with those of num-dual, in the residuals of a spring-damper and of a revolute joint.
//!
//! Prints the CPU time of one residual, and the ratio of num-dual's time to ours for the same derivatives.
//!
//! `cargo bench -p linkwright-autodiff --bench numbers`

#[path = "../../../benches/cpu/mod.rs"]
mod cpu;

use linkwright_autodiff::{DualVec, HyperDualVec, Jet2, Scalar};
use num_dual::{Dual2, DualSVec64, HyperDualSVec64};
use std::hint::black_box;

/// Residuals per timed run.
const REPETITIONS: usize = 1000;

/// Values of the 18 variables of an element: x, y, θ of two bodies, their rates, two points, two parameters or multipliers.
const VALUES: [f64; 18] =
    [0.1, 0.2, 0.3, 1.4, 0.7, -0.2, 1.0, -0.5, 2.0, 0.3, 0.8, -1.5, 0.5, 0.1, -0.5, 0.2, 30.0, 4.0];

/// An element whose residual is generic over the number type.
trait Residual: Copy {
    const NAME: &'static str;

    /// Writes the eight rows of the residual.
    fn rows<T: Scalar>(self, x: &[T; 18], rows: &mut [T; 8]);
}

/// Position and velocity of a point of a body, and its lever arm from the centre of mass.
fn point<T: Scalar>([x, y, theta]: [T; 3], [vx, vy, spin]: [T; 3], [px, py]: [T; 2]) -> [[T; 2]; 3] {
    let (sin, cos) = theta.sin_cos();
    let lever = [cos * px - sin * py, sin * px + cos * py];
    [[x + lever[0], y + lever[1]], [vx - spin * lever[1], vy + spin * lever[0]], lever]
}

/// The two points of an element, with positions, velocities and lever arms.
fn points<T: Scalar>(x: &[T; 18]) -> [[[T; 2]; 3]; 2] {
    let [a, b] = [0, 3].map(|k| [x[k], x[k + 1], x[k + 2]]);
    let [u, v] = [6, 9].map(|k| [x[k], x[k + 1], x[k + 2]]);
    [point(a, u, [x[12], x[13]]), point(b, v, [x[14], x[15]])]
}

/// Adds the force (fx, fy) on the first point and its reaction on the second.
fn apply<T: Scalar>([fx, fy]: [T; 2], levers: [[T; 2]; 2], rows: &mut [T; 8]) {
    (rows[0], rows[1], rows[2]) = (fx, fy, levers[0][0] * fy - levers[0][1] * fx);
    (rows[3], rows[4], rows[5]) = (-fx, -fy, levers[1][1] * fx - levers[1][0] * fy);
}

#[derive(Clone, Copy)]
struct SpringDamper;

impl Residual for SpringDamper {
    const NAME: &'static str = "spring-damper between two bodies";

    fn rows<T: Scalar>(self, x: &[T; 18], rows: &mut [T; 8]) {
        let [[a, u, first], [b, v, second]] = points(x);
        let (gap, parting) = ([b[0] - a[0], b[1] - a[1]], [v[0] - u[0], v[1] - u[1]]);
        let length = (gap[0] * gap[0] + gap[1] * gap[1]).sqrt();
        let direction = gap.map(|x| x / length);
        let rate = direction[0] * parting[0] + direction[1] * parting[1];
        let tension = x[16] * (length - 0.5) + x[17] * rate;
        apply(direction.map(|x| tension * x), [first, second], rows);
    }
}

#[derive(Clone, Copy)]
struct Revolute;

impl Residual for Revolute {
    const NAME: &'static str = "revolute joint";

    fn rows<T: Scalar>(self, x: &[T; 18], rows: &mut [T; 8]) {
        let [[a, _, first], [b, _, second]] = points(x);
        apply([x[16], x[17]], [first, second], rows);
        (rows[6], rows[7]) = (a[0] - b[0], a[1] - b[1]);
    }
}

/// A job that evaluates a residual [`REPETITIONS`] times; `variable(k, value)` makes and seeds variable k.
fn job<T: Scalar>(residual: impl Residual, variable: impl Fn(usize, f64) -> T) -> impl FnMut() {
    let x: [T; 18] = std::array::from_fn(|k| variable(k, VALUES[k]));
    let mut rows = [T::from(0.0); 8];
    move || {
        for _ in 0..REPETITIONS {
            residual.rows(black_box(&x), &mut rows);
            black_box(&rows);
        }
    }
}

/// Prints the time of the first job, and for every other job its time and the ratio to the first.
fn compare<const N: usize>(what: &str, jobs: [&mut dyn FnMut(); N]) {
    let times = cpu::in_turns(5, jobs).map(|seconds| seconds / REPETITIONS as f64 * 1e9);
    print!("  {what:<50} {:8.1} ns", times[0]);
    times[1..].iter().for_each(|time| print!("  {time:8.1} ns  {:5.2}", time / times[0]));
    println!();
}

fn measure<R: Residual>(r: R) {
    println!("{}", R::NAME);
    compare("value: f64", [&mut job(r, |_, x| x)]);
    let eight = |k: usize, x: f64| DualVec::<8>::variable(x, k % 8);
    let theirs = |k: usize, x: f64| DualSVec64::<8>::from_re(x).derivative(k % 8);
    compare("8 first derivatives: DualVec, DualSVec64", [&mut job(r, eight), &mut job(r, theirs)]);
    let unit = |k: usize| std::array::from_fn(|i| f64::from(u8::from(i == k % 4)));
    let ours = |k: usize, x: f64| HyperDualVec::<4>::variable(x, unit(k), [1.0; 4]);
    let theirs = |k: usize, x: f64| HyperDualSVec64::<4, 1>::from_re(x).derivative1(k % 4).derivative2(0);
    compare("4 entries of H v: HyperDualVec, HyperDualSVec64", [&mut job(r, ours), &mut job(r, theirs)]);
    let (ours, theirs) = (|_: usize, x: f64| Jet2::new(x, 0.3, 0.1), |_: usize, x: f64| Dual2::new(x, 0.3, 0.1));
    compare("first and second rate: Jet2, Dual2", [&mut job(r, ours), &mut job(r, theirs)]);
    let parts = |k: usize, x: f64| [x, 0.3, 0.1].map(|x| DualVec::<4>::variable(x, k % 4));
    let ours = |k: usize, x: f64| {
        let [x, v, a] = parts(k, x);
        Jet2::new(x, v, a)
    };
    let theirs = |k: usize, x: f64| {
        let [x, v, a] = parts(k, x);
        Dual2::new(x, v, a)
    };
    compare("rates and 4 derivatives of each: Jet2, Dual2", [&mut job(r, ours), &mut job(r, theirs)]);
}

fn main() {
    println!("CPU time of one residual: ours, num-dual's, and the ratio of num-dual's to ours");
    measure(SpringDamper);
    measure(Revolute);
}
