//! Second derivatives by the direct method in hyper-dual numbers.
//!
//! Differentiating F(x(b), b) = 0 twice leaves the matrix of the first derivatives,
//!
//! $$ \frac{\partial F}{\partial x} \frac{\partial^2 x}{\partial a\,\partial b} = -F_{ab}, $$
//!
//! where F_ab collects the terms of the first derivatives of x. It is the mixed part of one more evaluation of the
//! residual in [`HyperDual4`] numbers, and takes one more back-substitution per step.

use crate::analyses::dynamics::Dynamics;
use crate::analyses::sampling::OutputRecorder;
use crate::analyses::statics::Statics;
use crate::checkpointing::recording::Recording;
use crate::derivatives::forward::dynamics::propagate_all;
use crate::derivatives::forward::explicit::dual_steps::propagate_repeated;
use crate::derivatives::forward::implicit_steps::ImplicitSteps;
use crate::derivatives::forward::instants::{equilibrium_derivatives, kinematic_derivatives};
use crate::derivatives::history::OutputGradients;
use crate::derivatives::seeding::build_seeded;
use crate::initial_conditions::Assembly;
use crate::integrators::explicit::settings::Explicit;
use crate::mechanism::scalars::HyperDual4;
use crate::mechanism::{Mechanism, ParametricMechanism};
use crate::{Error, Result};
use nalgebra::DMatrix;

/// Number of pairs of directions in one hyper-dual number.
const PAIRS: usize = 4;

/// The second derivatives to compute, with respect to n design variables.
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
enum DesignDirection<'v> {
    Unit(usize),
    Along(&'v [f64]),
}

impl DesignDirection<'_> {
    fn component(&self, variable: usize) -> f64 {
        match *self {
            Self::Unit(i) => f64::from(u8::from(i == variable)),
            Self::Along(v) => v[variable],
        }
    }
}

impl<'v> HessianPart<'v> {
    fn pairs(self, n: usize) -> Vec<[DesignDirection<'v>; 2]> {
        use DesignDirection::{Along, Unit};
        match self {
            Self::Diagonal => (0..n).map(|i| [Unit(i), Unit(i)]).collect(),
            Self::Full => (0..n).flat_map(|i| (i..n).map(move |j| [Unit(i), Unit(j)])).collect(),
            Self::Times(v) => (0..n).map(|i| [Unit(i), Along(v)]).collect(),
        }
    }

    /// The design `b` once for each [`PAIRS`] pairs of directions, seeded with these.
    fn seed(self, b: &[f64]) -> Vec<Vec<HyperDual4>> {
        let components = |pairs: &[[DesignDirection<'_>; 2]], i: usize, side: usize| {
            std::array::from_fn(|k| pairs.get(k).map_or(0.0, |pair| pair[side].component(i)))
        };
        let variable = |pairs: &[_], (i, &x): (usize, &f64)| {
            HyperDual4::variable(x, components(pairs, i, 0), components(pairs, i, 1))
        };
        let design = |pairs: &[_]| b.iter().enumerate().map(|x| variable(pairs, x)).collect();
        self.pairs(b.len()).chunks(PAIRS).map(design).collect()
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
    /// Per chunk of [`PAIRS`] pairs: derivatives along the first directions, along the second ones, and mixed ones.
    derivatives: OutputGradients,
}

impl HessianHistory {
    /// The parts of all pairs, `part` being 0 for derivatives along the first directions and 2 for mixed ones.
    fn part(&self, part: usize, output: usize, time: usize, count: usize) -> Vec<f64> {
        let chunks = self.derivatives.chunks(time, output);
        chunks.flat_map(|chunk| &chunk[part * PAIRS..(part + 1) * PAIRS]).copied().take(count).collect()
    }

    /// The gradient of an output at time number `time`.
    pub fn gradient(&self, output: usize, time: usize) -> Vec<f64> {
        let n = self.variables;
        if !self.is_full {
            return self.part(0, output, time, n);
        }
        let all = self.part(0, output, time, n * (n + 1) / 2);
        (0..n).map(|i| all[upper(n, i, i)]).collect()
    }

    /// The [`HessianPart`] of an output at time number `time`: the diagonal, the product, or the upper triangle by rows.
    pub fn second_derivatives(&self, output: usize, time: usize) -> Vec<f64> {
        let n = self.variables;
        self.part(2, output, time, if self.is_full { n * (n + 1) / 2 } else { n })
    }

    /// The Hessian (n × n) of an output at time number `time`, after [`HessianPart::Full`].
    pub fn hessian(&self, output: usize, time: usize) -> Option<DMatrix<f64>> {
        let (n, entries) = (self.variables, self.second_derivatives(output, time));
        let entry = |i: usize, j: usize| entries[upper(n, i.min(j), i.max(j))];
        self.is_full.then(|| DMatrix::from_fn(n, n, entry))
    }
}

/// Index of the entry (i, j), i ≤ j, of a symmetric matrix of size n in its upper triangle, row by row.
fn upper(n: usize, i: usize, j: usize) -> usize {
    i * n - i * (i + 1) / 2 + j
}

/// Simulates `model` by implicit steps at the design `b` and differentiates its outputs at `times` (s) twice.
///
/// The derivatives are those of the discrete solution. One pass carries four of the requested numbers and costs about
/// four passes of [`differentiate`](crate::derivatives::forward::dynamics::differentiate).
///
/// # Errors
/// As [`differentiate`](crate::derivatives::forward::dynamics::differentiate), and [`Error::Length`] unless the vector of
/// [`HessianPart::Times`] is as long as `b`.
pub fn differentiate_twice<M: ParametricMechanism>(
    model: &M,
    b: &[f64],
    settings: &Dynamics,
    times: &[f64],
    part: HessianPart<'_>,
) -> Result<HessianHistory> {
    TwiceSeeded::build(model, b, part)?.dynamics(settings, times, None)
}

/// Simulates `model` by explicit steps at the design `b` and differentiates its outputs at `times` (s) twice.
///
/// The stages of every step are repeated in hyper-dual numbers. One pass carries four of the requested numbers.
///
/// # Errors
/// As [`differentiate_explicitly`](crate::derivatives::forward::explicit::differentiate_explicitly), and [`Error::Length`] unless
/// the vector of [`HessianPart::Times`] is as long as `b`.
pub fn differentiate_explicitly_twice<M: ParametricMechanism>(
    model: &M,
    b: &[f64],
    settings: &Explicit,
    times: &[f64],
    part: HessianPart<'_>,
) -> Result<HessianHistory> {
    TwiceSeeded::build(model, b, part)?.explicit_dynamics(settings, times)
}

/// Differentiates twice along the steps of a recording of `model` at `b`, which reaches the last of `times`.
///
/// # Errors
/// As [`differentiate_twice`], without those of the simulation.
pub fn differentiate_recorded_twice<M: ParametricMechanism>(
    model: &M,
    b: &[f64],
    settings: &Dynamics,
    times: &[f64],
    part: HessianPart<'_>,
    recording: &Recording,
) -> Result<HessianHistory> {
    TwiceSeeded::build(model, b, part)?.dynamics(settings, times, Some(recording))
}

/// Solves kinematics and inverse dynamics of `model` at `times` (s) and differentiates all outputs twice.
///
/// # Errors
/// As [`differentiate_kinematics`](crate::derivatives::forward::instants::differentiate_kinematics).
pub fn differentiate_kinematics_twice<M: ParametricMechanism>(
    model: &M,
    b: &[f64],
    assembly: Assembly,
    times: &[f64],
    part: HessianPart<'_>,
) -> Result<HessianHistory> {
    TwiceSeeded::build(model, b, part)?.kinematics(assembly, times)
}

/// Finds static equilibria of `model` at `times` (s), a load path, and differentiates all outputs twice.
///
/// # Errors
/// As [`differentiate_equilibria`](crate::derivatives::forward::instants::differentiate_equilibria).
pub fn differentiate_equilibria_twice<M: ParametricMechanism>(
    model: &M,
    b: &[f64],
    settings: &Statics,
    times: &[f64],
    part: HessianPart<'_>,
) -> Result<HessianHistory> {
    TwiceSeeded::build(model, b, part)?.equilibria(settings, times)
}

/// A mechanism in `f64`, and in hyper-dual numbers once per [`PAIRS`] pairs of directions.
struct TwiceSeeded {
    mechanism: Mechanism<f64>,
    variable: Vec<Mechanism<HyperDual4>>,
    variables: usize,
    is_full: bool,
}

impl TwiceSeeded {
    fn build<M: ParametricMechanism>(model: &M, b: &[f64], part: HessianPart<'_>) -> Result<Self> {
        let mechanism = model.build(b)?;
        if let HessianPart::Times(v) = part {
            Error::check_length("vector to multiply the Hessian with", b.len(), v.len())?;
        }
        let variable =
            part.seed(b).iter().map(|design| build_seeded(model, design, &mechanism)).collect::<Result<_>>()?;
        Ok(Self { mechanism, variable, variables: b.len(), is_full: part == HessianPart::Full })
    }

    // The methods below are not generic over the model: they are compiled once, in this crate.

    fn dynamics(&self, settings: &Dynamics, times: &[f64], recording: Option<&Recording>) -> Result<HessianHistory> {
        let mut steps = match recording {
            Some(recording) => ImplicitSteps::recorded(&self.mechanism, recording, settings, times),
            None => ImplicitSteps::simulated(&self.mechanism, settings, times)?,
        };
        Ok(self.history(times, propagate_all(&self.variable, settings, times, &mut steps)?))
    }

    fn explicit_dynamics(&self, settings: &Explicit, times: &[f64]) -> Result<HessianHistory> {
        let (_, _, derivatives) = propagate_repeated(&self.mechanism, &self.variable, settings, times)?;
        Ok(self.history(times, derivatives))
    }

    fn kinematics(&self, assembly: Assembly, times: &[f64]) -> Result<HessianHistory> {
        let mut recorder = OutputRecorder::new(&self.mechanism, times.len());
        let derivatives = kinematic_derivatives(&self.mechanism, &self.variable, assembly, times, &mut recorder)?;
        Ok(self.history(times, derivatives))
    }

    fn equilibria(&self, settings: &Statics, times: &[f64]) -> Result<HessianHistory> {
        let mut recorder = OutputRecorder::new(&self.mechanism, times.len());
        let derivatives = equilibrium_derivatives(&self.mechanism, &self.variable, settings, times, &mut recorder)?;
        Ok(self.history(times, derivatives))
    }

    fn history(&self, times: &[f64], derivatives: OutputGradients) -> HessianHistory {
        HessianHistory {
            names: self.mechanism.output_names(),
            times: times.to_vec(),
            variables: self.variables,
            is_full: self.is_full,
            derivatives,
        }
    }
}
