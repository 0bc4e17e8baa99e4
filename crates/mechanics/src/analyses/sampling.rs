//! States between steps, and the recorder of outputs.

pub use crate::system::outputs::{Sampler, energy};

use crate::events::held_outputs::HeldOutputs;
use crate::mechanism::Mechanism;
use crate::mechanism::scalars::StateScalar;
use crate::system::state::State;
use crate::{Error, Result, diagnostics};
use autodiff::Scalar;
use error::Seconds;
use std::ops::Mul;

/// Writes the state at the time `t` (s) between `old` and `new` to `at`.
///
/// Positions follow the cubic through positions and velocities, and velocities the cubic through velocities and
/// accelerations; accelerations and multipliers are linear. This has the order of the integrator. At the two ends the
/// result is `old` or `new`, bit for bit.
pub fn interpolate<T: StateScalar>(old: &State<T>, new: &State<T>, t: f64, at: &mut State<T>) {
    let ends = [old.t, new.t];
    if ends.iter().all(T::is_constant) {
        match Interval::of(ends.map(|end| end.value()), t) {
            Interval::Old => at.copy_from(old),
            Interval::New => at.copy_from(new),
            Interval::Inside(weights) => blend(old, new, &weights, at),
        }
    } else {
        // The time is fixed, and the ends depend on the design.
        blend(old, new, &Weights::inside(ends, t), at);
    }
    at.t = T::from(t);
    at.modes.copy_from(&new.modes);
}

/// [`interpolate`] for a time that may be outside the step by rounding or by a small change of its ends.
pub(crate) fn interpolate_inside<T: StateScalar>(old: &State<T>, new: &State<T>, t: f64, at: &mut State<T>) {
    blend(old, new, &Weights::inside([old.t, new.t], t), at);
    at.t = T::from(t);
    at.modes.copy_from(&new.modes);
}

/// Writes the weighted sum of two states to `at`.
fn blend<T: StateScalar + Mul<W, Output = T>, W: Scalar>(
    old: &State<T>,
    new: &State<T>,
    by: &Weights<W>,
    at: &mut State<T>,
) {
    let Weights { value, rate, linear } = *by;
    let cubic = |y0: &[T], d0: &[T], y1: &[T], d1: &[T], out: &mut [T]| {
        for (i, out) in out.iter_mut().enumerate() {
            *out = y0[i] * value[0] + y1[i] * value[1] + d0[i] * rate[0] + d1[i] * rate[1];
        }
    };
    cubic(&old.q, &old.v, &new.q, &new.v, &mut at.q);
    cubic(&old.v, &old.a, &new.v, &new.a, &mut at.v);
    for (at, old, new) in [(&mut at.a, &old.a, &new.a), (&mut at.l, &old.l, &new.l)] {
        for ((at, &old), &new) in at.iter_mut().zip(old).zip(new) {
            *at = old * linear[0] + new * linear[1];
        }
    }
}

/// Position of a time in a step.
enum Interval {
    Old,
    New,
    Inside(Weights),
}

impl Interval {
    fn of([old, new]: [f64; 2], t: f64) -> Self {
        let h = new - old;
        match () {
            () if (new - t).abs() <= 1e-9 * h => Self::New,
            () if (t - old).abs() <= 1e-9 * h => Self::Old,
            () => Self::Inside(Weights::inside([old, new], t)),
        }
    }
}

/// Weights of the two ends of a step in a state between them.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Weights<T = f64> {
    /// Weights of the values in Hermite's cubic.
    pub value: [T; 2],
    /// Weights of the rates in Hermite's cubic in s.
    pub rate: [T; 2],
    /// Weights of accelerations and multipliers.
    pub linear: [T; 2],
}

impl Weights {
    /// Weights used by [`interpolate`]; at one of the ends the other has no weight.
    pub fn of(ends: [f64; 2], t: f64) -> Self {
        let alone = |end: [f64; 2]| Self { value: end, rate: [0.0; 2], linear: end };
        match Interval::of(ends, t) {
            Interval::Old => alone([1.0, 0.0]),
            Interval::New => alone([0.0, 1.0]),
            Interval::Inside(weights) => weights,
        }
    }
}

impl<T: Scalar> Weights<T> {
    /// Weights inside a step, in any number type.
    fn inside([old, new]: [T; 2], t: f64) -> Self {
        let (h, one) = (new - old, T::from(1.0));
        let x = (T::from(t) - old) / h;
        let b = x * x * (-(x * 2.0) + 3.0);
        let rate = [x * (one - x) * (one - x) * h, x * x * (x - 1.0) * h];
        Self { value: [one - b, b], rate, linear: [one - x, x] }
    }
}

/// Recorder of checked outputs: one series per output, one value per recorded state.
pub(crate) struct OutputRecorder {
    sampler: Sampler<f64>,
    outputs: Vec<f64>,
    /// One series per output, one value per recorded state.
    pub series: Vec<Vec<f64>>,
}

impl OutputRecorder {
    /// Recorder for the outputs of `mechanism` at a number of `times`.
    pub fn new(mechanism: &Mechanism<f64>, times: usize) -> Self {
        let series = vec![Vec::with_capacity(times); mechanism.outputs.len()];
        Self { sampler: Sampler::new(mechanism), outputs: Vec::new(), series }
    }

    /// Appends the outputs at `state`.
    ///
    /// # Errors
    ///
    /// [`Error::Analysis`](crate::Error::Analysis) if a prescribed motion or an output is not finite.
    pub fn record(&mut self, mechanism: &Mechanism<f64>, state: &State<f64>) -> Result<()> {
        self.record_held(mechanism, state, None)
    }

    /// [`Self::record`] with the outputs that are `held` since an event.
    pub fn record_held(
        &mut self,
        mechanism: &Mechanism<f64>,
        state: &State<f64>,
        held: Option<&HeldOutputs<f64>>,
    ) -> Result<()> {
        self.sampler.outputs(mechanism, state, &mut self.outputs);
        if let Some(held) = held {
            held.replace(&mut self.outputs);
        }
        diagnostics::check(mechanism, state, &self.outputs).map_err(|error| match self.sampler.undefined.take() {
            Some((output, why)) => {
                let why = format!("{why}, at t = {}", Seconds(state.t));
                let remedy = "keep the argument in its range: by bounds of the design, or by min, max or if(…)";
                Error::analysis(&mechanism.outputs[output].name, why, remedy)
            }
            None => error,
        })?;
        self.series.iter_mut().zip(&self.outputs).for_each(|(series, &value)| series.push(value));
        Ok(())
    }
}
