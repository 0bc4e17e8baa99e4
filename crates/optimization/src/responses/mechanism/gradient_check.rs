//! Gradient check of a mechanism, for instance of a new element.

use super::quasi_static::{KinematicResponses, StaticResponses};
use super::transient::{Integration, Transient};
use crate::Result;
use crate::gradient_check::{GradientCheck, check, methods};
use crate::problem::{Analysis, ResponseAt};
use mechanics::analyses::dynamics::Dynamics;
use mechanics::analyses::statics::Statics;
use mechanics::initial_conditions::Assembly;
use mechanics::integrators::explicit::Explicit;
use mechanics::mechanism::ParametricMechanism;

/// The analysis of a mechanism, with its settings.
#[derive(Clone, Debug, PartialEq)]
pub enum AnalysisSettings {
    /// Its motion over time.
    Motion(Integration),
    /// Kinematics and inverse dynamics, every degree of freedom driven.
    Kinematics(Assembly),
    /// Static equilibria.
    Statics(Statics),
}

impl From<Dynamics> for AnalysisSettings {
    fn from(settings: Dynamics) -> Self {
        Self::Motion(settings.into())
    }
}

impl From<Explicit> for AnalysisSettings {
    fn from(settings: Explicit) -> Self {
        Self::Motion(settings.into())
    }
}

impl From<Assembly> for AnalysisSettings {
    fn from(settings: Assembly) -> Self {
        Self::Kinematics(settings)
    }
}

impl From<Statics> for AnalysisSettings {
    fn from(settings: Statics) -> Self {
        Self::Statics(settings)
    }
}

/// Checks the derivatives of all outputs of `model` at `times` with respect to the design `b`, by every method of the analysis
/// (direct, adjoint, semi-analytical), against finite differences.
///
/// `settings` are those of the analysis: [`Dynamics`], [`Explicit`], [`Assembly`] for kinematics or [`Statics`]. The test of a
/// new element is one line: `check_model(model, &b, settings, &times)?.expect_right()`.
///
/// # Errors
///
/// As [`check`].
pub fn check_model<M: ParametricMechanism>(
    model: M,
    b: &[f64],
    settings: impl Into<AnalysisSettings>,
    times: &[f64],
) -> Result<GradientCheck> {
    let outputs = model.build(b)?.output_names().len();
    let analysis: Box<dyn Analysis> = match settings.into() {
        AnalysisSettings::Motion(settings) => Box::new(Transient::new(model, settings, times)?),
        AnalysisSettings::Kinematics(assembly) => Box::new(KinematicResponses::new(model, assembly, times)?),
        AnalysisSettings::Statics(settings) => Box::new(StaticResponses::new(model, settings, times)?),
    };
    let points = |response| (0..times.len()).map(move |point| ResponseAt { response, point });
    let wanted: Vec<ResponseAt> = (0..outputs).flat_map(points).collect();
    let scales: Vec<f64> = b.iter().map(|x| if *x == 0.0 { 1.0 } else { x.abs() }).collect();
    check(analysis.as_ref(), &methods(analysis.as_ref()), b, &scales, &wanted)
}

#[cfg(test)]
mod tests {
    use super::*;
    use autodiff::Scalar;
    use mechanics::mechanism::Pose;
    use mechanics::motion::Harmonic;
    use mechanics::{Mechanism, Result};

    /// A mass of 1.3 kg on a spring of the stiffness b₀ with dry friction, which a force of the angular frequency `rate` moves.
    struct Rubbing {
        rate: f64,
    }

    impl ParametricMechanism for Rubbing {
        fn build<S: Scalar>(&self, b: &[S]) -> Result<Mechanism<S>> {
            let zero = S::from(0.0);
            let mut m = Mechanism::new();
            let mass = m.point_mass("mass", S::from(1.3), zero, zero);
            let ground = m.ground();
            m.coordinate_spring("spring", ground.x, mass.x, [b[0], zero, zero, zero]);
            m.dry_friction("friction", ground.x, mass.x, [S::from(1.2), S::from(1.1), zero]);
            m.load("force", ground.x, mass.x, Harmonic, &[zero, S::from(5.0), S::from(self.rate), zero]);
            let sensor = m.coordinate_sensor("motion", ground.x, mass.x);
            let position = m.measure(sensor, "position")?;
            m.output("x", &[position]);
            Ok(m)
        }
    }

    /// Direct derivatives up to an earlier time take the steps of the whole motion, with those that end at events.
    #[test]
    fn derivatives_of_adaptive_explicit_steps_with_dry_friction_are_right() {
        for settings in [Explicit::adaptive(1e-9), Explicit::eighth_order(1e-9)] {
            check_model(Rubbing { rate: 2.0 }, &[60.0], settings, &[0.5, 1.7, 3.3, 5.0]).unwrap().expect_right();
        }
    }

    /// A double pendulum with a spring: adaptive implicit steps rescale the velocities that violate the constraints.
    struct Swinging;

    impl ParametricMechanism for Swinging {
        fn build<S: Scalar>(&self, b: &[S]) -> Result<Mechanism<S>> {
            let zero = S::from(0.0);
            let mut m = Mechanism::with_gravity(zero, S::from(-9.81));
            let half = b[0] * 0.5;
            let arms =
                [half, half + b[0]].map(|x| m.body("arm", b[1], S::from(0.02), Pose { x, y: zero, theta: zero }));
            m.revolute("pin", m.ground().origin(), arms[0].at(-half, zero));
            m.revolute("elbow", arms[0].at(half, zero), arms[1].at(-half, zero));
            let sensor = m.coordinate_sensor("motion", m.ground().theta, arms[1].theta);
            for measure in ["position", "velocity", "acceleration"] {
                let value = m.measure(sensor, measure)?;
                m.output(measure, &[value]);
            }
            Ok(m)
        }
    }

    #[test]
    fn derivatives_of_adaptive_implicit_steps_are_those_of_the_rescaled_velocities() {
        for tolerance in [1e-6, 1e-7] {
            let settings = Dynamics::adaptive(tolerance);
            check_model(Swinging, &[0.7, 1.3], settings, &[0.3, 0.8, 1.5]).unwrap().expect_right();
        }
    }

    /// The differences across many changes of the step in which an event falls have the slope of the exact motion.
    #[test]
    fn derivatives_of_fixed_steps_with_dry_friction_are_right() {
        check_model(Rubbing { rate: 5.0 }, &[60.0], Dynamics::fixed(1e-3), &[1.5, 2.5, 3.5, 5.0])
            .unwrap()
            .expect_right();
    }
}
