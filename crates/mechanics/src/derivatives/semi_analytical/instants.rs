//! Semi-analytical derivatives of kinematics, inverse dynamics and statics, time point by time point.

use crate::Result;
use crate::analyses::kinematics::KinematicDriver;
use crate::analyses::statics::Statics;
use crate::derivatives::forward::instants::{for_each_driven_state, for_each_equilibrium, record_instants};
use crate::derivatives::history::{OutputGradients, SensitiveHistory};
use crate::derivatives::semi_analytical::central_difference::CentralDifference;
use crate::derivatives::semi_analytical::initial_conditions::InitialDifferences;
use crate::initial_conditions::Assembly;
use crate::mechanism::{Mechanism, ParametricMechanism};
use crate::system::outputs::Sampler;
use crate::system::state::State;

/// Solves kinematics and inverse dynamics of `model` at `times` (s) and differentiates all outputs semi-analytically, with
/// the relative step `step` of the differences (see [`STEP`](crate::derivatives::semi_analytical::STEP)).
///
/// # Errors
/// As [`differentiate_kinematics`](crate::derivatives::forward::instants::differentiate_kinematics), and
/// [`Error::Option`](crate::Error::Option) for a step that is not between 0 and 1.
pub fn difference_kinematics<M: ParametricMechanism>(
    model: &M,
    b: &[f64],
    assembly: Assembly,
    times: &[f64],
    step: f64,
) -> Result<SensitiveHistory> {
    let mechanism = model.build(b)?;
    let mut all = OutputDifferences::new(&mechanism, CentralDifference::by_each_variable(model, b, step, &mechanism)?);
    record_instants(&mechanism, b.len(), times, |recorder| {
        for_each_driven_state(&mechanism, assembly, times, |_, driver| {
            let KinematicDriver { state: values, projection, system, .. } = driver;
            recorder.record(&mechanism, values)?;
            let mut initial = InitialDifferences { plain: &mechanism, system };
            let mut sensitivities = initial.consistent(&mut all.differences, values, projection)?;
            initial.accelerations(&mut all.differences, values, &mut sensitivities)?;
            all.extend(values, &sensitivities);
            Ok(())
        })?;
        Ok(all.finish())
    })
}

/// Finds static equilibria of `model` at `times` (s), a load path, and differentiates all outputs semi-analytically, with
/// the relative step `step` of the differences (see [`STEP`](crate::derivatives::semi_analytical::STEP)).
///
/// # Errors
/// As [`differentiate_equilibria`](crate::derivatives::forward::instants::differentiate_equilibria), and
/// [`Error::Option`](crate::Error::Option) for a step that is not between 0 and 1.
pub fn difference_equilibria<M: ParametricMechanism>(
    model: &M,
    b: &[f64],
    settings: &Statics,
    times: &[f64],
    step: f64,
) -> Result<SensitiveHistory> {
    let mechanism = model.build(b)?;
    let mut all = OutputDifferences::new(&mechanism, CentralDifference::by_each_variable(model, b, step, &mechanism)?);
    record_instants(&mechanism, b.len(), times, |recorder| {
        for_each_equilibrium(&mechanism, settings, times, |_, system, values| {
            recorder.record(&mechanism, values)?;
            let mut initial = InitialDifferences { plain: &mechanism, system };
            let sensitivities = initial.equilibrium(&mut all.differences, values);
            all.extend(values, &sensitivities);
            Ok(())
        })?;
        Ok(all.finish())
    })
}

/// Differences of the outputs with respect to every design variable.
struct OutputDifferences {
    differences: Vec<CentralDifference>,
    sampler: Sampler<f64>,
    outputs: usize,
    /// By design variable, then time and output.
    derivatives: Vec<Vec<f64>>,
}

impl OutputDifferences {
    fn new(mechanism: &Mechanism<f64>, differences: Vec<CentralDifference>) -> Self {
        let (sampler, outputs) = (Sampler::new(mechanism), mechanism.outputs.len());
        Self { derivatives: vec![Vec::new(); differences.len()], differences, sampler, outputs }
    }

    /// Adds the derivatives of the outputs at one time, where the state `values` has the derivatives `sensitivities`.
    fn extend(&mut self, values: &State<f64>, sensitivities: &[State<f64>]) {
        let Self { differences, sampler, derivatives, .. } = self;
        for ((difference, sensitivity), to) in differences.iter_mut().zip(sensitivities).zip(derivatives) {
            to.extend(difference.derivatives(values, sensitivity, |mechanism, state, outputs| {
                sampler.outputs(mechanism, state, outputs);
            }));
        }
    }

    fn finish(&mut self) -> OutputGradients {
        OutputGradients::new(self.outputs, 1, std::mem::take(&mut self.derivatives))
    }
}
