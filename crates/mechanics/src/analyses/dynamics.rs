//! The motion of a mechanism over time.

use crate::analyses::sampling::{Sampler, interpolate};
use crate::analyses::statics::Statics;
use crate::checkpointing::recording::Recording;
use crate::diagnostics;
use crate::events::location::Event;
use crate::initial_conditions::Assembly;
use crate::integrators::generalized_alpha::{GeneralizedAlpha, Newton, Prescribed};
use crate::integrators::time_stepper::TimeStepper;
use crate::mechanism::Mechanism;
use crate::system::state::State;
use crate::{Error, Result};

/// Accelerations at the start of the motion.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum InitialAcceleration {
    /// Those of the equations of motion.
    Consistent,
    /// Zero, with zero multipliers: a mechanism at rest and unloaded.
    Zero,
}

/// Positions at the start of the motion.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum InitialConfiguration {
    /// Those that the mechanism was built in, assembled.
    Built,
    /// Those of the static equilibrium at the start, which is sought from there. Velocities are still those that it was built
    /// with, made consistent.
    Equilibrium(Statics),
}

/// Lengths of the time steps.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum StepSize {
    /// Steps of this length in s, cut in halves where Newton's iteration fails.
    Fixed(f64),
    /// Steps chosen so that the local error of positions stays near a tolerance.
    Adaptive {
        /// Tolerated local error of a position in m or rad.
        tolerance: f64,
        /// First step in s.
        first: f64,
        /// Longest step in s.
        longest: f64,
    },
}

/// Settings of a dynamic analysis by implicit steps.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Dynamics {
    /// Start of the motion in s.
    pub start: f64,
    /// The method.
    pub scheme: GeneralizedAlpha,
    /// Step sizes.
    pub step: StepSize,
    /// The iteration in a step.
    pub newton: Newton,
    /// Assembly of the initial positions.
    pub assembly: Assembly,
    /// Positions at the start.
    pub origin: InitialConfiguration,
    /// Accelerations at the start.
    pub initial: InitialAcceleration,
    /// Velocity and acceleration of prescribed coordinates.
    pub prescribed: Prescribed,
}

impl Dynamics {
    /// Fixed steps of `h` seconds by the generalized-α method of spectral radius 0.9.
    pub fn fixed(h: f64) -> Self {
        Self {
            start: 0.0,
            scheme: GeneralizedAlpha::chung_hulbert(0.9).expect("0.9 is in range"),
            step: StepSize::Fixed(h),
            newton: Newton::default(),
            assembly: Assembly::default(),
            origin: InitialConfiguration::Built,
            initial: InitialAcceleration::Consistent,
            prescribed: Prescribed::Exact,
        }
    }

    /// Adaptive steps with the given local error of positions.
    pub fn adaptive(tolerance: f64) -> Self {
        let step = StepSize::Adaptive { tolerance, first: 1e-4, longest: f64::INFINITY };
        Self { step, ..Self::fixed(1.0) }
    }

    /// **Errors.** [`Error::Option`] if a setting is out of range, [`Error::Definition`] if times are not increasing.
    pub fn check(&self, times: &[f64]) -> Result<()> {
        let positive = |x: f64| x > 0.0 && !x.is_nan();
        match self.step {
            StepSize::Fixed(h) => Error::check_option("time step", "positive", h, positive(h) && h.is_finite())?,
            StepSize::Adaptive { tolerance, first, longest } => {
                Error::check_option("step tolerance", "positive", tolerance, positive(tolerance))?;
                Error::check_option("first step", "positive", first, positive(first))?;
                Error::check_option("longest step", "positive", longest, positive(longest))?;
            }
        }
        Error::check_option("Newton tolerance", "positive", self.newton.tolerance, positive(self.newton.tolerance))?;
        check_times(self.start, times)
    }
}

/// **Errors.** Unless times begin at `start` or later, increase and are finite.
pub fn check_times(start: f64, times: &[f64]) -> Result<()> {
    let first = times.first().copied().unwrap_or(start);
    Error::check_option("first output time", "not before the start", first, first >= start)?;
    if let Some(pair) = times.windows(2).find(|pair| !(pair[0] < pair[1])) {
        let why = format!("{} s is followed by {} s", pair[0], pair[1]);
        return Err(Error::definition("output times", why, "give increasing times"));
    }
    match times.last() {
        Some(last) if !last.is_finite() => Error::check_option("last output time", "finite", *last, false),
        _ => Ok(()),
    }
}

/// Work done by an analysis.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Work {
    /// Time steps taken.
    pub steps: usize,
    /// Steps tried again with a smaller size.
    pub failed_steps: usize,
    /// Newton iterations with an assembly, a factorization and a solution each; those that keep a matrix are not counted.
    pub iterations: usize,
}

/// Outputs over time.
#[derive(Clone, Debug, PartialEq)]
pub struct History {
    /// Names of the outputs.
    pub names: Vec<String>,
    /// Times in s.
    pub times: Vec<f64>,
    /// One series per output, one value per time.
    pub values: Vec<Vec<f64>>,
    /// The state at the last time.
    pub last: State<f64>,
    /// Impacts, in their order.
    pub impacts: Vec<Event>,
    /// Work done.
    pub work: Work,
}

impl History {
    /// The series of the output `name`.
    pub fn series(&self, name: &str) -> Option<&[f64]> {
        self.names.iter().position(|n| n == name).map(|k| self.values[k].as_slice())
    }
}

/// Simulates `mechanism` and records its outputs at `times` (increasing, s).
///
/// **Errors.** [`Error::Analysis`] naming element and time if the mechanism cannot be built, assembled or moved on.
pub fn simulate(mechanism: &Mechanism<f64>, settings: &Dynamics, times: &[f64]) -> Result<History> {
    record(mechanism, TimeStepper::new(mechanism, settings, times)?, times, None)
}

/// As [`simulate`], and keeps the steps in at most `memory` bytes.
///
/// A motion with more steps than that is simulated all the same; its recording then has check-points.
///
/// **Errors.** As [`simulate`].
pub fn simulate_recorded(
    mechanism: &Mechanism<f64>,
    settings: &Dynamics,
    times: &[f64],
    memory: usize,
) -> Result<(History, Recording)> {
    let run = TimeStepper::new(mechanism, settings, times)?;
    let mut recording = Recording::of(&run, memory);
    let history = record(mechanism, run, times, Some(&mut recording))?;
    Ok((history, recording))
}

fn record(
    mechanism: &Mechanism<f64>,
    mut run: TimeStepper<'_>,
    times: &[f64],
    mut recording: Option<&mut Recording>,
) -> Result<History> {
    let mut sampler = Sampler::new(mechanism);
    let mut outputs = Vec::new();
    let mut values: Vec<Vec<f64>> = vec![Vec::with_capacity(times.len()); mechanism.outputs.len()];
    let mut at = run.integrator.step.old.clone();
    for &t in times {
        while run.is_before(t) {
            run.advance()?;
            recording.iter_mut().for_each(|recording| recording.log.keep(&run));
        }
        recording.iter_mut().for_each(|recording| recording.log.advance_to(t));
        interpolate(&run.integrator.step.old, &run.integrator.step.new, t, &mut at);
        sampler.outputs(mechanism, &at, &mut outputs);
        diagnostics::check(mechanism, &at, &outputs)?;
        values.iter_mut().zip(&outputs).for_each(|(series, &value)| series.push(value));
    }
    let work = run.work();
    let history = History {
        names: mechanism.output_names(),
        times: times.to_vec(),
        values,
        last: at,
        impacts: run.impacts,
        work,
    };
    Ok(history)
}

pub(crate) fn check_finite<T: crate::mechanism::scalars::StateScalar>(
    mechanism: &Mechanism<T>,
    outputs: &[T],
    t: f64,
) -> Result<()> {
    outputs.iter().position(|value| !value.value().is_finite()).map_or(Ok(()), |k| {
        let why = format!("the output is {} at t = {t:.6e} s", outputs[k].value());
        Err(Error::analysis(&mechanism.outputs[k].name, why, "check the element that it measures"))
    })
}

/// Whether a step of a motion from `start` that ends at `end` does not reach `t`, beyond rounding.
pub fn is_before(start: f64, end: f64, t: f64) -> bool {
    t - end > 1e-9 * (t - start).abs().max(1e-300)
}
