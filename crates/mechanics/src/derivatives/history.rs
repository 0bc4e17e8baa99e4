//! Outputs over time with their derivatives.

use crate::Result;
use crate::analyses::dynamics::Work;
use crate::analyses::sampling::Sampler;
use crate::diagnostics;
use crate::mechanism::Mechanism;
use crate::system::state::State;

/// Outputs over time with their derivatives.
#[derive(Clone, Debug, PartialEq)]
pub struct SensitiveHistory {
    /// Names of the outputs.
    pub names: Vec<String>,
    /// Times in s.
    pub times: Vec<f64>,
    /// One series per output, one value per time.
    pub values: Vec<Vec<f64>>,
    /// `gradients[output][time]` is the gradient with respect to the design variables.
    pub gradients: Vec<Vec<Vec<f64>>>,
    /// Work of the analysis; the derivatives add one back-substitution per step and chunk of design variables.
    pub work: Work,
}

/// Collects values and slopes time by time.
pub struct Record {
    history: SensitiveHistory,
    sampler: Sampler<f64>,
    outputs: Vec<f64>,
}

impl Record {
    /// Room for the outputs of `mechanism` at `times`.
    pub fn new(mechanism: &Mechanism<f64>, variables: usize, times: &[f64]) -> Self {
        let count = mechanism.outputs.len();
        let history = SensitiveHistory {
            names: mechanism.output_names(),
            times: times.to_vec(),
            values: vec![vec![0.0; times.len()]; count],
            gradients: vec![vec![vec![0.0; variables]; times.len()]; count],
            work: Work::default(),
        };
        Self { history, sampler: Sampler::new(mechanism), outputs: Vec::new() }
    }

    /// Slopes for the design variables from `first` on.
    pub fn slopes<'s>(&mut self, time: usize, first: usize, outputs: impl IntoIterator<Item = &'s [f64]>) {
        for (series, output) in self.history.gradients.iter_mut().zip(outputs) {
            let slopes = &mut series[time][first..];
            slopes.iter_mut().zip(output).for_each(|(slope, value)| *slope = *value);
        }
    }

    /// Values in `f64`, the same bits as a plain analysis.
    pub fn values(&mut self, time: usize, mechanism: &Mechanism<f64>, at: &State<f64>) -> Result<()> {
        self.sampler.outputs(mechanism, at, &mut self.outputs);
        diagnostics::check(mechanism, at, &self.outputs)?;
        for (series, &value) in self.history.values.iter_mut().zip(&self.outputs) {
            series[time] = value;
        }
        Ok(())
    }

    /// The finished history.
    pub fn finish(self, work: Work) -> SensitiveHistory {
        SensitiveHistory { work, ..self.history }
    }
}
