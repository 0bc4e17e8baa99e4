//! Motions that start in static equilibrium.

use crate::zoo::{Arm, fixed};
use linkwright::Result;
use linkwright::autodiff::Scalar;
use linkwright::mechanics::analyses::dynamics::{Dynamics, InitialConfiguration, simulate};
use linkwright::mechanics::analyses::statics::Statics;
use linkwright::mechanics::derivatives::adjoint::{AdjointFunctional, differentiate_backwards};
use linkwright::mechanics::derivatives::forward::dynamics::differentiate;
use linkwright::mechanics::derivatives::second_order::{HessianPart, differentiate_twice};
use linkwright::mechanics::mechanism::{Mechanism, ParametricMechanism, Pose};
use linkwright::mechanics::motion::Harmonic;

fn from_rest(h: f64) -> Dynamics {
    let statics = Statics { tolerance: 1e-13, ..Statics::default() };
    Dynamics { initial_configuration: InitialConfiguration::Equilibrium(statics), ..fixed(h) }
}

/// A bar on a shaken pivot, supported by a spring: mass, inertia, half length, gravity, stiffness, damping, unloaded
/// length, amplitude and frequency, initial velocity.
struct HeldBar;

const BAR: [f64; 10] = [1.4, 0.06, 0.4, 9.81, 90.0, 0.8, 0.5, 0.02, 7.0, 0.3];

impl ParametricMechanism for HeldBar {
    fn build<S: Scalar>(&self, b: &[S]) -> Result<Mechanism<S>> {
        let zero = S::from(0.0);
        let mut m = Mechanism::with_gravity(zero, -b[3]);
        let pivot = m.massless_node("pivot", Pose { x: zero, y: zero, theta: zero });
        m.drive(pivot.y, Harmonic, &[zero, b[7], b[8], zero]);
        m.fix(pivot.x);
        m.fix(pivot.theta);
        let bar = m.body("bar", b[0], b[1], Pose { x: b[2], y: zero, theta: zero });
        m.set_velocity(bar.theta, b[9]);
        m.set_velocity(bar.y, b[9] * b[2]);
        m.revolute("pin", pivot.origin(), bar.at(-b[2], zero));
        let hook = m.ground().at(S::from(0.9), S::from(0.6));
        m.spring_damper("spring", hook, bar.at(b[2], zero), [b[4], b[5], b[6]]);
        let ground = m.ground().theta;
        let sensor = m.coordinate_sensor("angle", ground, bar.theta);
        for what in ["position", "acceleration"] {
            let term = m.measure(sensor, what)?;
            m.output(what, &[term]);
        }
        Ok(m)
    }
}

#[test]
fn without_disturbance_nothing_moves() {
    let mut b = BAR;
    (b[7], b[9]) = (0.0, 0.0);
    let history = simulate(&HeldBar.build(&b).unwrap(), &from_rest(0.01), &[0.0, 0.5, 1.0]).unwrap();
    let angles = history.series("position").unwrap();
    assert!(angles.iter().all(|angle| (angle - angles[0]).abs() < 1e-12) && angles[0].abs() > 0.01, "{angles:?}");
}

#[test]
fn derivatives_of_the_motion_from_an_equilibrium() {
    let (times, settings) = ([0.0, 0.15, 0.4], from_rest(0.01));
    let of = |b: &[f64]| differentiate(&HeldBar, b, &settings, &times).unwrap();
    let exact = of(&BAR);
    let second = differentiate_twice(&HeldBar, &BAR, &settings, &times, HessianPart::Full).unwrap();
    let mut worst = [0.0f64; 2];
    for k in 0..BAR.len() {
        let step = 1e-3 * BAR[k];
        let around = [step, -step, 0.5 * step, -0.5 * step].map(|by| {
            let mut moved = BAR;
            moved[k] += by;
            of(&moved)
        });
        let difference = |x: [f64; 4]| (4.0 * (x[2] - x[3]) / step - (x[0] - x[1]) / (2.0 * step)) / 3.0;
        for output in 0..2 {
            for p in 0..times.len() {
                let size: f64 = exact.gradients[output][p].iter().zip(&BAR).map(|(s, b)| (s * b).abs()).sum();
                let values = difference(around.each_ref().map(|h| h.values[output][p]));
                worst[0] = worst[0].max((values - exact.gradients[output][p][k]).abs() * BAR[k] / size);
                // Differences of accelerations have rounding errors proportional to 1/h².
                let hessian = second.hessian(output, p).unwrap();
                let size = hessian.row(k).iter().zip(&BAR).map(|(h, b)| (h * b * BAR[k]).abs()).sum::<f64>();
                for i in 0..BAR.len() {
                    let derivative = difference(around.each_ref().map(|h| h.gradients[output][p][i]));
                    worst[1] = worst[1].max((derivative - hessian[(i, k)]).abs() * BAR[i] * BAR[k] / size.max(1e-3));
                }
            }
        }
    }
    println!("from an equilibrium: first {:.1e}, second {:.1e}", worst[0], worst[1]);
    assert!(worst[0] < 1e-7 && worst[1] < 1e-6, "{worst:?}");
}

#[test]
fn backward_and_forward_agree() {
    fn check<M: ParametricMechanism>(model: &M, b: &[f64], outputs: usize, settings: Dynamics) {
        let times = [0.0, 0.1, 0.3];
        let forward = differentiate(model, b, &settings, &times).unwrap();
        let all: Vec<_> =
            (0..outputs).flat_map(|o| (0..times.len()).map(move |p| AdjointFunctional::at(o, p))).collect();
        let backward = differentiate_backwards(model, b, &settings, &times, &all).unwrap();
        for output in 0..outputs {
            for p in 0..times.len() {
                let gradient = &forward.gradients[output][p];
                let size: f64 = gradient.iter().zip(b).map(|(s, b)| (s * b).abs()).sum();
                for k in 0..b.len() {
                    let difference = (gradient[k] - backward[(output * times.len() + p, k)]) * b[k];
                    assert!(difference.abs() <= 1e-9 * size, "{output} {p} {k}: {difference:e} of {size:e}");
                }
            }
        }
    }
    check(&HeldBar, &BAR, 2, from_rest(0.01));
    check(&Arm { elements: 2 }, &Arm::DESIGN, 1, from_rest(0.02));
}
