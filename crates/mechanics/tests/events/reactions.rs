//! Events on reactions and accelerations by implicit steps: times, derivatives and outputs are those of the equations of motion.

use crate::derivative_methods::{check_adjoint_by, check_semi_analytical_by};
use crate::models::{Above, Linear};
use autodiff::Scalar;
use linkwright_mechanics::analyses::dynamics::{simulate, simulate_explicitly};
use linkwright_mechanics::derivatives::forward::dynamics::differentiate;
use linkwright_mechanics::derivatives::forward::explicit::differentiate_explicitly;
use linkwright_mechanics::events::Action;
use linkwright_mechanics::integrators::explicit::Explicit;
use linkwright_mechanics::mechanism::Formula;
use linkwright_mechanics::{Dynamics, GeneralizedAlpha, Mechanism, ParametricMechanism, Pose, Result};

/// The time less a given one.
struct After(f64);

impl Formula for After {
    fn value<T: Scalar>(&self, t: T, _x: &[T]) -> T {
        t - self.0
    }
}

/// Event of a pendulum.
#[derive(Clone, Copy, Debug)]
enum PendulumEvent {
    /// Its pin breaks where the measure of this name exceeds the limit.
    Breaks(&'static str, f64),
    /// The motion ends at a time.
    Ends(f64),
}

/// A body of 1 kg and 0.1 kg m² at the distance b₀ from a pin, released in the horizontal position.
struct Pendulum(PendulumEvent);

impl ParametricMechanism for Pendulum {
    fn build<S: Scalar>(&self, b: &[S]) -> Result<Mechanism<S>> {
        let zero = S::from(0.0);
        let mut m = Mechanism::with_gravity(zero, S::from(-9.81));
        let body = m.body("body", S::from(1.0), S::from(0.1), Pose { x: b[0], y: zero, theta: zero });
        let pin = m.revolute("pin", m.ground().origin(), body.at(-b[0], zero));
        let sensor = m.sensor("motion", body.origin());
        let measures = [m.measure(pin, "force")?, m.measure(sensor, "ay")?, m.measure(sensor, "y")?];
        let event = match self.0 {
            PendulumEvent::Breaks(name, limit) => {
                let measure = if name == "force" { measures[0] } else { measures[1] };
                m.when("event", Above(limit), &[measure], &[Action::Deactivate(pin)])?
            }
            PendulumEvent::Ends(time) => m.when("event", After(time), &[], &[Action::Terminate])?,
        };
        m.output_formula("time", Linear(vec![], 1.0), &[]);
        m.hold_output(event);
        m.output("force at the event", &[measures[0]]);
        m.hold_output(event);
        for (name, measure) in ["force", "ay", "y"].iter().zip(measures) {
            m.output(*name, &[measure]);
        }
        Ok(m)
    }
}

const LENGTH: [f64; 1] = [1.0];

fn times() -> Vec<f64> {
    (0..=50).map(|k| 0.02 * f64::from(k)).collect()
}

fn all_settings() -> [Dynamics; 3] {
    let scheme = GeneralizedAlpha::hht(0.05).unwrap();
    [Dynamics::fixed(2e-3), Dynamics { scheme, ..Dynamics::fixed(2e-3) }, Dynamics::adaptive(1e-7)]
}

#[test]
fn events_on_reactions_and_accelerations_are_located_and_differentiated() {
    let events =
        [PendulumEvent::Breaks("force", 27.0), PendulumEvent::Breaks("force", 20.0), PendulumEvent::Breaks("ay", 5.0)];
    for happens in events {
        let model = Pendulum(happens);
        let exact = differentiate_explicitly(&model, &LENGTH, &Explicit::eighth_order(1e-11), &times()).unwrap();
        for settings in all_settings() {
            let found = differentiate(&model, &LENGTH, &settings, &times()).unwrap();
            // Times are those of positions and velocities, whose errors are of the order h².
            for (output, name, tolerated) in [(0, "time", 1e-4), (1, "force at the event", 3e-3)] {
                let [value, expected] = [&found.values, &exact.values].map(|v| *v[output].last().unwrap());
                let error = (value - expected).abs();
                assert!(error < tolerated, "{happens:?} {:?} {name}: {value} {expected}", settings.step);
                let [slope, expected] = [&found.gradients, &exact.gradients].map(|v| v[output].last().unwrap()[0]);
                let error = (slope - expected).abs();
                assert!(error < 20.0 * tolerated, "{happens:?} {:?} d {name}: {slope} {expected}", settings.step);
            }
        }
        check_adjoint_by(&all_settings(), ("pendulum", 1e-6), &model, &LENGTH, &[0.1, 0.6, 0.7]);
        check_semi_analytical_by(&all_settings()[..1], ("pendulum", 1e-3), &model, &LENGTH, &[0.1, 0.6, 0.7]);
    }
}

#[test]
fn a_reaction_below_its_limit_breaks_nothing() {
    // The largest force is that in the lowest position: m g (1 + 2 m L² / (m L² + I)).
    let largest = 9.81 * (1.0 + 2.0 / 1.1);
    for (limit, breaks) in [(largest + 0.02, false), (largest - 0.02, true)] {
        let m = Pendulum(PendulumEvent::Breaks("force", limit)).build(&LENGTH).unwrap();
        for settings in all_settings() {
            for tolerance in [1e-5, 1e-6] {
                let settings = match settings.step {
                    linkwright_mechanics::StepSize::Adaptive { .. } => Dynamics::adaptive(tolerance),
                    _ => settings,
                };
                let outcome = simulate(&m, &settings, &[0.0, 1.0]);
                // The output that is held from the event on does not exist without the event.
                assert_eq!(outcome.is_ok(), breaks, "{limit} {:?}: {:?}", settings.step, outcome.map(|h| h.impacts));
            }
        }
    }
}

#[test]
fn outputs_at_an_event_shortly_after_a_step_are_those_of_the_equations_of_motion() {
    for time in [0.5000001, 0.500000003, 0.5009] {
        let model = Pendulum(PendulumEvent::Ends(time));
        let exact =
            simulate_explicitly(&model.build(&LENGTH).unwrap(), &Explicit::eighth_order(1e-11), &times()).unwrap();
        let slopes = differentiate_explicitly(&model, &LENGTH, &Explicit::eighth_order(1e-11), &times()).unwrap();
        for settings in all_settings() {
            let found = differentiate(&model, &LENGTH, &settings, &times()).unwrap();
            for (output, name) in ["time", "force at the event", "force", "ay"].iter().enumerate() {
                let [value, expected] = [&found.values, &exact.values].map(|v| *v[output].last().unwrap());
                assert!((value - expected).abs() < 1e-3, "{time} {:?} {name}: {value} {expected}", settings.step);
                let [slope, expected] = [&found.gradients, &slopes.gradients].map(|v| v[output].last().unwrap()[0]);
                assert!((slope - expected).abs() < 1e-2, "{time} {:?} d {name}: {slope} {expected}", settings.step);
            }
        }
        check_adjoint_by(&all_settings(), ("end", 1e-6), &model, &LENGTH, &[0.1, 0.4, 0.7]);
        check_semi_analytical_by(&all_settings()[..1], ("end", 2e-2), &model, &LENGTH, &[0.1, 0.4, 0.7]);
    }
}

/// A change of the length of a step causes no oscillation of accelerations and reactions.
#[test]
fn reactions_of_adaptive_steps_have_no_spikes() {
    let schemes = [GeneralizedAlpha::chung_hulbert(0.9), GeneralizedAlpha::hht(0.05), GeneralizedAlpha::hht(0.3)];
    let model = Pendulum(PendulumEvent::Ends(1.1));
    let times: Vec<f64> = (0..=105).map(|k| 0.01 * f64::from(k)).collect();
    let exact =
        differentiate_explicitly(&model, &LENGTH, &Explicit::eighth_order(1e-11), &[&times[..], &[1.2]].concat())
            .unwrap();
    for scheme in schemes {
        for (tolerance, tolerated) in [(1e-4, 1.0), (1e-6, 0.05)] {
            let settings = Dynamics { scheme: scheme.clone().unwrap(), ..Dynamics::adaptive(tolerance) };
            let found = differentiate(&model, &LENGTH, &settings, &[&times[..], &[1.2]].concat()).unwrap();
            for output in [2, 3] {
                let largest = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
                let error = largest(&found.values[output], &exact.values[output]);
                let slopes =
                    [&found, &exact].map(|v| v.gradients[output].iter().map(|row| row[0]).collect::<Vec<f64>>());
                let slope_error = largest(&slopes[0], &slopes[1]);
                println!("{scheme:?} {tolerance:e}: {error:.1e} {slope_error:.1e}");
                assert!(
                    error < tolerated && slope_error < 3.0 * tolerated,
                    "{scheme:?} {tolerance:e}: {error} {slope_error}"
                );
            }
            check_adjoint_by(&[settings], ("adaptive", 1e-6), &model, &LENGTH, &[0.1, 0.44, 1.05, 1.2]);
            check_semi_analytical_by(&[settings], ("adaptive", 1e-3), &model, &LENGTH, &[0.1, 0.44, 1.05, 1.2]);
        }
    }
}

#[test]
fn an_event_that_a_terminal_one_precedes_names_it() {
    let mut m = Mechanism::<f64>::new();
    let mass = m.point_mass("mass", 1.0, 0.0, 0.0);
    let sensor = m.sensor("motion", mass.origin());
    m.when("end", After(0.5), &[], &[Action::Terminate]).unwrap();
    let later = m.when("later", After(0.7), &[], &[]).unwrap();
    let x = m.measure(sensor, "x").unwrap();
    m.output("x", &[x]);
    m.hold_output(later);
    let words = ["later", "`end` ends the motion at t = 0.5 s"];
    let explicit = simulate_explicitly(&m, &Explicit::eighth_order(1e-9), &[0.0, 2.0]).unwrap_err().to_string();
    let implicit = simulate(&m, &Dynamics::fixed(1e-2), &[0.0, 2.0]).unwrap_err().to_string();
    for error in [explicit, implicit] {
        assert!(words.iter().all(|word| error.contains(word)), "{error}");
    }
}
