//! Loads and drives that jump at the time of an event: each step has the functions of its own side of it.

use crate::derivative_methods::{check_adjoint_by, check_semi_analytical_by};
use crate::models::{Linear, outputs};
use autodiff::{Scalar, gradient, hessian};
use linkwright_mechanics::derivatives::adjoint::{AdjointFunctional, differentiate_explicitly_backwards};
use linkwright_mechanics::derivatives::forward::dynamics::differentiate;
use linkwright_mechanics::derivatives::forward::explicit::differentiate_explicitly;
use linkwright_mechanics::derivatives::history::SensitiveHistory;
use linkwright_mechanics::derivatives::second_order::{
    HessianPart, differentiate_explicitly_twice, differentiate_twice,
};
use linkwright_mechanics::integrators::explicit::{Explicit, StepControl};
use linkwright_mechanics::integrators::generalized_alpha::Newton;
use linkwright_mechanics::motion::Motion;
use linkwright_mechanics::{Dynamics, GeneralizedAlpha, Mechanism, ParametricMechanism, Result};

/// The force p₀ from the time p₁ on.
struct Step;

impl Motion for Step {
    fn position<T: Scalar>(&self, p: &[T], t: T) -> T {
        if t.re() < p[1].re() { T::from(0.0) } else { p[0] }
    }
}

/// The motion ½ p₀ (t − p₁)² from the time p₁ on.
struct Departure;

impl Motion for Departure {
    fn position<T: Scalar>(&self, p: &[T], t: T) -> T {
        if t.re() < p[1].re() { T::from(0.0) } else { p[0] * (t - p[1]).powi(2) * 0.5 }
    }
}

/// The quantity that jumps at the event.
#[derive(Clone, Copy, Debug)]
enum Jump {
    /// A force on the mass, by b₂.
    Load,
    /// The acceleration of the support of the spring, by b₂.
    Drive,
}

/// A mass of 1 kg on a spring of the stiffness b₁, let go at 1. A load or a drive jumps at b₀, as does an event without an effect.
struct Jumping(Jump);

impl ParametricMechanism for Jumping {
    fn build<S: Scalar>(&self, b: &[S]) -> Result<Mechanism<S>> {
        let zero = S::from(0.0);
        let mut m = Mechanism::new();
        let mass = m.point_mass("mass", S::from(1.0), S::from(1.0), zero);
        m.fix(mass.y);
        let ground = m.ground();
        let mut support = ground.x;
        match self.0 {
            Jump::Load => {
                m.load("load", ground.x, mass.x, Step, &[b[2], b[0]]);
            }
            Jump::Drive => {
                support = m.coordinate("support", zero, zero);
                m.drive(support, Departure, &[b[2], b[0]]);
            }
        }
        m.coordinate_spring("spring", support, mass.x, [b[1], zero, zero, zero]);
        let place = m.sensor("place", ground.at(b[0], zero));
        let until = m.measure(place, "x")?;
        m.when("jump", Linear(vec![-1.0], 1.0), &[until], &[])?;
        outputs(&mut m, mass.x)?;
        Ok(m)
    }
}

/// Position and velocity of the mass at the time `t`, after the jump.
fn exact<S: Scalar>(jump: Jump, b: &[S], t: f64) -> [S; 2] {
    let rate = b[1].sqrt();
    let [x, v] = [(rate * b[0]).cos(), -rate * (rate * b[0]).sin()];
    let since = -b[0] + t;
    let (sin, cos) = (rate * since).sin_cos();
    let [shift, place, speed] = match jump {
        Jump::Load => [b[2] / b[1], S::from(0.0), S::from(0.0)],
        Jump::Drive => [-b[2] / b[1], b[2] * since * since * 0.5, b[2] * since],
    };
    let y = x - shift;
    [place + shift + y * cos + v / rate * sin, speed - y * rate * sin + v * cos]
}

const END: f64 = 0.9;
const NEWTON: Newton = Newton { tolerance: 1e-13, iterations: 30 };

/// Times between two of the grid, at one, and within rounding errors of one.
const PLACES: [f64; 6] = [0.503, 0.4987, 0.5, 0.5 + 1e-15, 0.5 - 1e-15, 0.5 + 1e-9];

/// Largest errors of values and first derivatives.
fn errors(jump: Jump, b: &[f64], found: &SensitiveHistory) -> [f64; 2] {
    let mut errors = [0.0f64; 2];
    for output in 0..2 {
        let (value, slopes) = gradient(|b| exact(jump, b, END)[output], b);
        errors[0] = errors[0].max((found.values[output][0] - value).abs());
        let pairs = found.gradients[output][0].iter().zip(&slopes);
        errors[1] = pairs.fold(errors[1], |worst, (a, b)| worst.max((a - b).abs()));
    }
    errors
}

#[test]
fn implicit_steps_end_on_one_side_of_a_jump_and_begin_on_the_other() {
    for jump in [Jump::Load, Jump::Drive] {
        for (place, scheme) in PLACES.iter().flat_map(|place| {
            [GeneralizedAlpha::chung_hulbert(0.8), GeneralizedAlpha::hht(0.1)].map(|scheme| (*place, scheme.unwrap()))
        }) {
            let b = [place, 9.0, 7.0];
            let fixed = |h| Dynamics { scheme, newton: NEWTON, ..Dynamics::fixed(h) };
            let at = |h| errors(jump, &b, &differentiate(&Jumping(jump), &b, &fixed(h), &[END]).unwrap());
            let (coarse, fine) = (at(0.01), at(0.000_625));
            let orders = [0, 1].map(|k| (coarse[k] / fine[k]).log2() / 4.0);
            println!("{jump:?} at {place}: {coarse:?} {fine:?} {orders:.2?}");
            // At a time of the grid, the discretization error has a kink in the time of the event: slopes of the order 1.
            let is_between = place == 0.503 || place == 0.4987;
            let least = [1.95, if is_between { 1.3 } else { 0.9 }];
            assert!(orders.iter().zip(least).all(|(order, least)| *order > least), "{jump:?} at {place}: {orders:?}");
            assert!(fine[0] < 1e-5 && fine[1] < 5e-4, "{jump:?} at {place}: {fine:?}");
            check_adjoint_by(&[fixed(0.01)], ("jump", 1e-10), &Jumping(jump), &b, &[0.3, END]);
            // Differences across the kink have the mean of its slopes.
            let limit = if is_between { 1e-8 } else { 3e-3 };
            check_semi_analytical_by(&[fixed(0.01)], ("jump", limit), &Jumping(jump), &b, &[0.3, END]);
        }
        let b = [0.503, 9.0, 7.0];
        let adaptive = Dynamics { newton: NEWTON, ..Dynamics::adaptive(1e-8) };
        let error = errors(jump, &b, &differentiate(&Jumping(jump), &b, &adaptive, &[END]).unwrap());
        assert!(error[0] < 1e-4 && error[1] < 1e-3, "{jump:?}: {error:?}");
    }
}

#[test]
fn stages_of_explicit_steps_are_on_one_side_of_a_jump() {
    for jump in [Jump::Load, Jump::Drive] {
        for place in PLACES {
            let b = [place, 9.0, 7.0];
            for (settings, limit) in [
                (Explicit::eighth_order(1.0).with_step_control(StepControl::Fixed(0.01)), 1e-12),
                (Explicit::eighth_order(1e-10), 1e-9),
                (Explicit::adaptive(1e-10), 1e-9),
            ] {
                let found = differentiate_explicitly(&Jumping(jump), &b, &settings, &[END]).unwrap();
                let error = errors(jump, &b, &found);
                println!("{jump:?} at {place}, {}: {error:?}", settings.method.name);
                assert!(error[0] < limit && error[1] < limit, "{jump:?} at {place}: {error:?}");
                let all = [0, 1].map(|output| AdjointFunctional::at(output, 0));
                let adjoint = differentiate_explicitly_backwards(&Jumping(jump), &b, &settings, &[END], &all).unwrap();
                for (output, row) in adjoint.row_iter().enumerate() {
                    let pairs = row.iter().zip(&found.gradients[output][0]);
                    let worst = pairs.fold(0.0f64, |worst, (a, b)| worst.max((a - b).abs()));
                    assert!(worst < 1e-12, "{jump:?} at {place}, adjoint of output {output}: {worst:.1e}");
                }
            }
        }
    }
}

#[test]
fn second_derivatives_through_a_jump_at_an_event_are_exact() {
    for jump in [Jump::Load, Jump::Drive] {
        for place in PLACES {
            let b = [place, 9.0, 7.0];
            let settings = Explicit::eighth_order(1.0).with_step_control(StepControl::Fixed(0.01));
            let explicit =
                differentiate_explicitly_twice(&Jumping(jump), &b, &settings, &[END], HessianPart::Full).unwrap();
            let fixed = Dynamics { newton: NEWTON, ..Dynamics::fixed(0.000_625) };
            let implicit = differentiate_twice(&Jumping(jump), &b, &fixed, &[END], HessianPart::Full).unwrap();
            for output in 0..2 {
                let expected: Vec<f64> = hessian(|b| exact(jump, b, END)[output], &b).2.iter().copied().collect();
                // Second derivatives of up to 20 along implicit steps have the order 1.
                for (found, tolerance) in [(&explicit, 1e-11), (&implicit, 0.1)] {
                    let found = found.hessian(output, 0).unwrap();
                    let pairs = found.as_slice().iter().zip(&expected);
                    let worst = pairs.fold(0.0f64, |worst, (a, b)| worst.max((a - b).abs()));
                    println!("{jump:?} at {place}, output {output}: {worst:.1e} of {expected:.1?}");
                    assert!(worst < tolerance, "{jump:?} at {place}, output {output}: {found} {expected:?}");
                }
            }
        }
    }
}
