//! Adjoint and semi-analytical derivatives through events, compared with direct ones.

use crate::models::{BARS, BOUNCING, Bouncing, DoublePendulum, PUSHED, Pushed, SLING, Sling};
use linkwright_mechanics::analyses::dynamics::simulate_recorded;
use linkwright_mechanics::derivatives::adjoint::{AdjointFunctional, differentiate_backwards_within};
use linkwright_mechanics::derivatives::forward::dynamics::{differentiate, differentiate_recorded};
use linkwright_mechanics::derivatives::semi_analytical::{STEP, differentiate_semi_analytically};
use linkwright_mechanics::integrators::generalized_alpha::{Newton, Prescribed};
use linkwright_mechanics::{Dynamics, GeneralizedAlpha, InitialAcceleration, ParametricMechanism};

/// Settings with fixed and adaptive steps, and with other values than the defaults.
pub fn all_settings() -> [Dynamics; 4] {
    let newton = Newton { tolerance: 1e-12, iterations: 30 };
    let scheme = GeneralizedAlpha::hht(0.1).unwrap();
    let (prescribed, initial_acceleration) = (Prescribed::Newmark, InitialAcceleration::Zero);
    [
        Dynamics { newton, ..Dynamics::fixed(0.005) },
        Dynamics { newton, scheme, ..Dynamics::fixed(0.0073) },
        Dynamics { newton, scheme, prescribed, initial_acceleration, ..Dynamics::fixed(0.003) },
        Dynamics { newton, ..Dynamics::adaptive(1e-5) },
    ]
}

/// Largest difference of the rows from the direct derivatives, both times the design variables, as a fraction of the largest
/// such derivative of the same output.
pub fn deviation(direct: &[Vec<Vec<f64>>], b: &[f64], row: impl Fn(usize, usize) -> Vec<f64>) -> f64 {
    let mut worst = 0.0f64;
    for (output, by_time) in direct.iter().enumerate() {
        let scaled = |row: &[f64]| row.iter().zip(b).map(|(x, b)| x * b).collect::<Vec<f64>>();
        let size = by_time.iter().flat_map(|row| scaled(row)).fold(1e-300, |size: f64, x| size.max(x.abs()));
        for (point, exact) in by_time.iter().enumerate() {
            let (exact, ours) = (scaled(exact), scaled(&row(output, point)));
            exact.iter().zip(&ours).for_each(|(a, b)| worst = worst.max((a - b).abs() / size));
        }
    }
    worst
}

pub fn check_adjoint_by<M: ParametricMechanism>(
    settings: &[Dynamics],
    (name, limit): (&str, f64),
    model: &M,
    b: &[f64],
    times: &[f64],
) {
    for &settings in settings {
        let direct = differentiate(model, b, &settings, times).unwrap();
        let outputs = direct.names.len();
        let all: Vec<AdjointFunctional> = (0..outputs)
            .flat_map(|output| (0..times.len()).map(move |point| AdjointFunctional::at(output, point)))
            .collect();
        let (history, recording) = simulate_recorded(&model.build(b).unwrap(), &settings, times, usize::MAX).unwrap();
        assert!(!history.impacts.is_empty());
        let again = differentiate_recorded(model, b, &settings, times, &recording).unwrap();
        let recorded =
            deviation(&direct.gradients, b, |output, point| (0..b.len()).map(|k| again.at(point, output, k)).collect());
        assert_eq!(recorded, 0.0, "{name}: the recorded steps are those of the motion");
        for memory in [usize::MAX, 64 * 1024] {
            let (rows, _) = differentiate_backwards_within(memory, model, b, &settings, times, &all).unwrap();
            let worst = deviation(&direct.gradients, b, |output, point| {
                rows.row(output * times.len() + point).iter().copied().collect()
            });
            println!("{name}, {:?}, adjoint within {memory}: {worst:.1e}", settings.step);
            assert!(worst < limit, "{name} {settings:?}: {worst:.1e}");
        }
    }
}

pub fn check_semi_analytical_by<M: ParametricMechanism>(
    settings: &[Dynamics],
    (name, limit): (&str, f64),
    model: &M,
    b: &[f64],
    times: &[f64],
) {
    for &settings in settings {
        let direct = differentiate(model, b, &settings, times).unwrap();
        let differences = differentiate_semi_analytically(model, b, &settings, times, STEP).unwrap();
        let worst = deviation(&direct.gradients, b, |output, point| differences.gradients[output][point].clone());
        println!("{name}, {:?}, semi-analytical: {worst:.1e}", settings.step);
        assert!(worst < limit, "{name} {settings:?}: {worst:.1e}");
    }
}

/// A comparison with the direct derivatives, for models of any type.
trait DerivativeCheck {
    /// Largest deviation of models without and with joints.
    const LIMITS: [f64; 2];

    fn check<M: ParametricMechanism>(case: (&str, f64), model: &M, b: &[f64], times: &[f64]);
}

struct SemiAnalytical;

impl DerivativeCheck for SemiAnalytical {
    const LIMITS: [f64; 2] = [1e-7, 1e-3];

    fn check<M: ParametricMechanism>(case: (&str, f64), model: &M, b: &[f64], times: &[f64]) {
        check_semi_analytical_by(&all_settings(), case, model, b, times);
    }
}

/// Reactions contain rounding errors that grow with 1/h²: the limits of mechanisms with joints are larger.
struct Adjoint;

impl DerivativeCheck for Adjoint {
    const LIMITS: [f64; 2] = [1e-12, 1e-8];

    fn check<M: ParametricMechanism>(case: (&str, f64), model: &M, b: &[f64], times: &[f64]) {
        check_adjoint_by(&all_settings(), case, model, b, times);
    }
}

fn check_models<C: DerivativeCheck>() {
    let [without_joints, with_joints] = C::LIMITS;
    C::check(("bouncing mass", without_joints), &Bouncing, &BOUNCING, &[0.2, 0.411, 0.9, 2.0]);
    C::check(("pushed mass", without_joints), &Pushed, &PUSHED, &[0.2, 0.411, 0.9, 2.0]);
    C::check(("sling", with_joints), &Sling, &SLING, &[0.1, 0.3, 0.7, 2.0, 3.0]);
    C::check(("double pendulum", with_joints), &DoublePendulum, &BARS, &[0.0, 0.4, 0.8, 1.1]);
}

#[test]
fn semi_analytical_derivatives_through_events_are_the_direct_ones() {
    check_models::<SemiAnalytical>();
}

#[test]
fn adjoint_derivatives_through_events_are_the_direct_ones() {
    check_models::<Adjoint>();
}
