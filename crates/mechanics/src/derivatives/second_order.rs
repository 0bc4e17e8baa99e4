//! Second derivatives by the direct method: the same equations in hyper-dual numbers.
//!
//! Differentiating F(x(b), b) = 0 twice leaves the matrix of the first derivatives,
//!
//! $$ \frac{\partial F}{\partial x} \frac{\partial^2 x}{\partial a\,\partial b} = -F_{ab}, $$
//!
//! where F_ab, everything that the first derivatives of x contribute, is the mixed part of one more evaluation of the
//! residual in [`HyperDual4`] numbers: one more back-substitution a step.

use crate::analyses::dynamics::Dynamics;
use crate::analyses::statics::Statics;
use crate::checkpointing::recording::Recording;
use crate::derivatives::forward::dynamics::follow_all;
use crate::derivatives::forward::instants::{follow_equilibria, follow_kinematics};
use crate::derivatives::forward::step_block::StepSource;
use crate::derivatives::history::Record;
use crate::derivatives::seeding::build_seeded;
use crate::initial_conditions::Assembly;
use crate::integrators::time_stepper::TimeStepper;
use crate::mechanism::scalars::HyperDual4;
use crate::mechanism::{Mechanism, ParametricMechanism};
use crate::{Error, Result};
use nalgebra::DMatrix;

/// Pairs of directions that one number carries.
const PAIRS: usize = 4;

/// Which second derivatives with respect to the n design variables are wanted.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum HessianPart<'v> {
    /// ∂²r/∂bᵢ²: n numbers.
    Diagonal,
    /// The Hessian ∂²r/∂bᵢ∂bⱼ: n (n + 1)/2 numbers.
    Full,
    /// The Hessian times this vector (length n): n numbers.
    Times(&'v [f64]),
}

/// A direction in the space of the design variables.
#[derive(Clone, Copy)]
enum Direction<'v> {
    Unit(usize),
    DifferenceSensitivity(&'v [f64]),
}

impl Direction<'_> {
    fn component(&self, variable: usize) -> f64 {
        match *self {
            Self::Unit(i) => f64::from(u8::from(i == variable)),
            Self::DifferenceSensitivity(v) => v[variable],
        }
    }
}

impl<'v> HessianPart<'v> {
    fn pairs(self, n: usize) -> Vec<[Direction<'v>; 2]> {
        use Direction::{DifferenceSensitivity, Unit};
        match self {
            Self::Diagonal => (0..n).map(|i| [Unit(i), Unit(i)]).collect(),
            Self::Full => (0..n).flat_map(|i| (i..n).map(move |j| [Unit(i), Unit(j)])).collect(),
            Self::Times(v) => (0..n).map(|i| [Unit(i), DifferenceSensitivity(v)]).collect(),
        }
    }

    /// The design at `b` once for each [`PAIRS`] pairs of directions.
    fn designs(self, b: &[f64]) -> Vec<Vec<HyperDual4>> {
        let seed = |pairs: &[[Direction<'_>; 2]], i: usize, side: usize| {
            std::array::from_fn(|k| pairs.get(k).map_or(0.0, |pair| pair[side].component(i)))
        };
        let variable =
            |pairs: &[_], (i, &x): (usize, &f64)| HyperDual4::seeded(x, seed(pairs, i, 0), seed(pairs, i, 1));
        let design = |pairs: &[_]| b.iter().enumerate().map(|x| variable(pairs, x)).collect();
        self.pairs(b.len()).chunks(PAIRS).map(design).collect()
    }

    /// The mechanism once for each of these designs.
    fn carriers<M: ParametricMechanism>(
        self,
        model: &M,
        b: &[f64],
        like: &Mechanism<f64>,
    ) -> Result<Vec<Mechanism<HyperDual4>>> {
        if let Self::Times(v) = self {
            Error::check_length("vector to multiply the Hessian with", b.len(), v.len())?;
        }
        self.designs(b).iter().map(|design| build_seeded(model, design, like)).collect()
    }
}

/// Outputs over time with first and second derivatives.
#[derive(Clone, Debug)]
pub struct HessianHistory {
    /// Names of the outputs.
    pub names: Vec<String>,
    /// Times in s.
    pub times: Vec<f64>,
    variables: usize,
    is_full: bool,
    /// By chunk of [`PAIRS`] pairs, then time, output and derivative.
    chunks: Vec<Vec<f64>>,
}

impl HessianHistory {
    fn new(mechanism: &Mechanism<f64>, b: &[f64], times: &[f64], what: HessianPart<'_>, chunks: Vec<Vec<f64>>) -> Self {
        let names = mechanism.outputs.iter().map(|output| output.name.clone()).collect();
        Self { names, times: times.to_vec(), variables: b.len(), is_full: what == HessianPart::Full, chunks }
    }

    /// First derivatives along the first directions, or mixed derivatives, of all pairs.
    fn part(&self, part: usize, output: usize, time: usize, count: usize) -> Vec<f64> {
        let size = 3 * PAIRS;
        let first = (time * self.names.len() + output) * size + part * PAIRS;
        let lanes = self.chunks.iter().flat_map(|chunk| &chunk[first..first + PAIRS]);
        lanes.copied().take(count).collect()
    }

    /// Gradient of an output at a time point (by number).
    pub fn gradient(&self, output: usize, time: usize) -> Vec<f64> {
        let n = self.variables;
        if !self.is_full {
            return self.part(0, output, time, n);
        }
        let all = self.part(0, output, time, n * (n + 1) / 2);
        (0..n).map(|i| all[upper(n, i, i)]).collect()
    }

    /// What was asked for, of an output at a time point: the diagonal, the product, or the upper triangle row by row.
    pub fn second(&self, output: usize, time: usize) -> Vec<f64> {
        let n = self.variables;
        self.part(2, output, time, if self.is_full { n * (n + 1) / 2 } else { n })
    }

    /// The Hessian (n × n) of an output at a time point, if all of it was asked for.
    pub fn hessian(&self, output: usize, time: usize) -> Option<DMatrix<f64>> {
        let (n, entries) = (self.variables, self.second(output, time));
        let entry = |i: usize, j: usize| entries[upper(n, i.min(j), i.max(j))];
        self.is_full.then(|| DMatrix::from_fn(n, n, entry))
    }
}

/// Place of the entry (i, j), i ≤ j, of a symmetric matrix of size n in its upper triangle, row by row.
fn upper(n: usize, i: usize, j: usize) -> usize {
    i * n - i * (i + 1) / 2 + j
}

/// Simulates `model` by implicit steps at the design `b` and differentiates its outputs at `times` twice.
///
/// The derivatives are those of the discrete solution. A pass carries four numbers of what is wanted and costs about
/// four passes of [`differentiate`](crate::derivatives::forward::dynamics::differentiate).
///
/// **Errors.** As [`differentiate`](crate::derivatives::forward::dynamics::differentiate), and [`Error::Length`] for a vector of another length than `b`.
pub fn differentiate_twice<M: ParametricMechanism>(
    model: &M,
    b: &[f64],
    settings: &Dynamics,
    times: &[f64],
    what: HessianPart<'_>,
) -> Result<HessianHistory> {
    let mechanism = model.build(b)?;
    let carriers = what.carriers(model, b, &mechanism)?;
    let run = TimeStepper::new(&mechanism, settings, times)?;
    let mut source = StepSource::running(run, Record::new(&mechanism, 0, times), settings, times)?;
    let chunks = follow_all(&carriers, settings, times, &mut source)?;
    Ok(HessianHistory::new(&mechanism, b, times, what, chunks))
}

/// The same at the steps of a recording of `model` at `b`, which reaches the last of `times`: nothing is iterated.
pub fn differentiate_recorded_twice<M: ParametricMechanism>(
    model: &M,
    b: &[f64],
    settings: &Dynamics,
    times: &[f64],
    what: HessianPart<'_>,
    recording: &Recording,
) -> Result<HessianHistory> {
    let mechanism = model.build(b)?;
    let carriers = what.carriers(model, b, &mechanism)?;
    let mut source = StepSource::recorded(&mechanism, recording, settings, times);
    let chunks = follow_all(&carriers, settings, times, &mut source)?;
    Ok(HessianHistory::new(&mechanism, b, times, what, chunks))
}

/// As [`differentiate_kinematics`](crate::derivatives::forward::instants::differentiate_kinematics), twice.
///
/// **Errors.** As there.
pub fn differentiate_kinematics_twice<M: ParametricMechanism>(
    model: &M,
    b: &[f64],
    assembly: Assembly,
    times: &[f64],
    what: HessianPart<'_>,
) -> Result<HessianHistory> {
    let mechanism = model.build(b)?;
    let carriers = what.carriers(model, b, &mechanism)?;
    let chunks = follow_kinematics(&mechanism, &carriers, assembly, times, &mut Record::new(&mechanism, 0, times))?;
    Ok(HessianHistory::new(&mechanism, b, times, what, chunks))
}

/// As [`differentiate_equilibria`](crate::derivatives::forward::instants::differentiate_equilibria), twice.
///
/// **Errors.** As there.
pub fn differentiate_equilibria_twice<M: ParametricMechanism>(
    model: &M,
    b: &[f64],
    settings: &Statics,
    times: &[f64],
    what: HessianPart<'_>,
) -> Result<HessianHistory> {
    let mechanism = model.build(b)?;
    let carriers = what.carriers(model, b, &mechanism)?;
    let chunks = follow_equilibria(&mechanism, &carriers, settings, times, &mut Record::new(&mechanism, 0, times))?;
    Ok(HessianHistory::new(&mechanism, b, times, what, chunks))
}
