//! Outputs over time with their derivatives.

use crate::analyses::dynamics::Work;
use crate::analyses::sampling::OutputRecorder;
use crate::mechanism::Mechanism;

/// Outputs over time with their gradients.
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

impl SensitiveHistory {
    /// History of the outputs of `mechanism` at `times` (s), with `gradients` with respect to `variables` design variables.
    pub(crate) fn new(
        mechanism: &Mechanism<f64>,
        times: &[f64],
        recorder: OutputRecorder,
        (gradients, variables): (&OutputGradients, usize),
        work: Work,
    ) -> Self {
        let gradients = gradients.to_series(times.len(), variables);
        Self { names: mechanism.output_names(), times: times.to_vec(), values: recorder.series, gradients, work }
    }
}

/// Derivatives of all outputs at all times, in chunks of design variables.
#[derive(Clone, Debug, PartialEq)]
pub struct OutputGradients {
    outputs: usize,
    width: usize,
    chunks: Vec<Vec<f64>>,
}

impl OutputGradients {
    /// From `chunks` of `width` derivatives each, ordered by time, output and derivative.
    pub(crate) fn new(outputs: usize, width: usize, chunks: Vec<Vec<f64>>) -> Self {
        Self { outputs, width, chunks }
    }

    /// The derivative of an output at time number `time` with respect to one design variable.
    pub fn at(&self, time: usize, output: usize, variable: usize) -> f64 {
        self.chunk(variable / self.width, time, output)[variable % self.width]
    }

    /// The derivatives of an output at time number `time`, chunk by chunk.
    pub(crate) fn chunks(&self, time: usize, output: usize) -> impl Iterator<Item = &[f64]> {
        (0..self.chunks.len()).map(move |chunk| self.chunk(chunk, time, output))
    }

    /// `[output][time]`: gradients with respect to `variables` design variables, without the padding of the last chunk.
    pub(crate) fn to_series(&self, times: usize, variables: usize) -> Vec<Vec<Vec<f64>>> {
        let gradient = |output, time| {
            let mut gradient = Vec::with_capacity(variables);
            for chunk in self.chunks(time, output) {
                gradient.extend_from_slice(&chunk[..self.width.min(variables - gradient.len())]);
            }
            gradient
        };
        (0..self.outputs).map(|output| (0..times).map(|time| gradient(output, time)).collect()).collect()
    }

    fn chunk(&self, chunk: usize, time: usize, output: usize) -> &[f64] {
        let first = (time * self.outputs + output) * self.width;
        &self.chunks[chunk][first..first + self.width]
    }
}
