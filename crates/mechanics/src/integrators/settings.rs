//! Settings of a dynamic analysis by implicit steps, and the counts and limits of steps of every integration.

use crate::initial_conditions::{Assembly, Statics};
use crate::integrators::generalized_alpha::{GeneralizedAlpha, Newton, Prescribed};
use crate::{Error, Result};
use error::Seconds;

/// Accelerations at the start of the motion.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum InitialAcceleration {
    /// Accelerations and multipliers that satisfy the equations of motion.
    Consistent,
    /// Zero, with zero multipliers: a mechanism at rest and unloaded.
    Zero,
}

/// Positions at the start of the motion.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum InitialConfiguration {
    /// The positions that the mechanism was built with, assembled.
    Built,
    /// The static equilibrium at the start, solved for from the assembled positions. Velocities are those that the mechanism
    /// was built with, made consistent with the constraints.
    Equilibrium(Statics),
}

/// Lengths of the time steps.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum StepSize {
    /// Steps of this length in s, halved where Newton's iteration fails.
    Fixed(f64),
    /// Steps whose local error of positions is near a tolerance.
    Adaptive {
        /// Tolerated local error of a position in m or rad.
        tolerance: f64,
        /// First step in s.
        first: f64,
        /// Longest step in s.
        longest: f64,
    },
}

/// Shortest and longest first step of a motion, as fractions of its length.
const SPAN: [f64; 2] = [1e-6, 1e-2];

impl StepSize {
    /// Bounds adaptive steps by the length `bound` in s.
    pub fn with_longest(self, bound: f64) -> Self {
        match self {
            Self::Adaptive { tolerance, first, .. } => {
                Self::Adaptive { tolerance, first: first.min(bound), longest: bound }
            }
            fixed => fixed,
        }
    }

    /// Adapts the first of adaptive steps to the length `span` (s) of the motion: it is between 10⁻⁶ and 10⁻² of it.
    pub fn for_span(self, span: f64) -> Self {
        match self {
            Self::Adaptive { tolerance, first, longest } if span > 0.0 => {
                let first = first.max(SPAN[0] * span).min(SPAN[1] * span).min(longest);
                Self::Adaptive { tolerance, first, longest }
            }
            other => other,
        }
    }

    /// Nominal length of a step in s: the fixed length, or that of the first step.
    pub(crate) fn nominal(&self) -> f64 {
        match *self {
            Self::Fixed(h) => h,
            Self::Adaptive { first, .. } => first,
        }
    }
}

/// Settings of a dynamic analysis by implicit steps.
///
/// Start from [`Dynamics::fixed`] or [`Dynamics::adaptive`] and change single fields by struct update syntax:
///
/// ```
/// use linkwright_mechanics::{Dynamics, GeneralizedAlpha};
/// let settings = Dynamics { scheme: GeneralizedAlpha::hht(0.1)?, ..Dynamics::fixed(1e-3) };
/// assert!(settings.check(&[0.0, 0.5, 1.0]).is_ok());
/// assert!(settings.check(&[0.5, 0.5]).is_err());
/// # Ok::<(), linkwright_mechanics::Error>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Dynamics {
    /// Start of the motion in s.
    pub start: f64,
    /// Integration method.
    pub scheme: GeneralizedAlpha,
    /// Step sizes.
    pub step: StepSize,
    /// Newton's iteration in a step.
    pub newton: Newton,
    /// Settings of the assembly.
    pub assembly: Assembly,
    /// Initial configuration: as built, or in static equilibrium.
    pub initial_configuration: InitialConfiguration,
    /// Initial accelerations: consistent with the equations of motion, or zero.
    pub initial_acceleration: InitialAcceleration,
    /// Velocities and accelerations of prescribed coordinates.
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
            initial_configuration: InitialConfiguration::Built,
            initial_acceleration: InitialAcceleration::Consistent,
            prescribed: Prescribed::Exact,
        }
    }

    /// Adaptive steps; `tolerance` is the local error of positions in m or rad. The first step is 10⁻⁴ s: see [`StepSize::for_span`] for motions
    /// shorter than 0.01 s or longer than 100 s.
    pub fn adaptive(tolerance: f64) -> Self {
        let step = StepSize::Adaptive { tolerance, first: 1e-4, longest: f64::INFINITY };
        Self { step, ..Self::fixed(1.0) }
    }

    /// Checks the settings, and that the output `times` (s) increase.
    ///
    /// # Errors
    ///
    /// [`Error::Option`] if a setting is out of range, [`Error::Definition`] if the times do not increase.
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

/// Checks that `times` begin at `start` or later, increase and are finite.
///
/// # Errors
///
/// [`Error::Option`] for the first or last time, [`Error::Definition`] if the times do not increase.
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

/// Numbers of steps and iterations of an analysis.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Work {
    /// Time steps taken.
    pub steps: usize,
    /// Rejected trial steps, repeated with a smaller size.
    pub failed_steps: usize,
    /// Newton iterations with an assembly, a factorization and a solution each; iterations that
    /// reuse the previous matrix (modified Newton) are not counted.
    pub iterations: usize,
}

/// Returns whether `end` (s) is before `t` by more than rounding, for a motion that starts at `start`.
pub fn is_before(start: f64, end: f64, t: f64) -> bool {
    t - end > 1e-9 * (t - start).abs().max(1e-300)
}

/// Largest number of time steps of an integration.
const MOST_STEPS: usize = if cfg!(test) { 200_000 } else { 20_000_000 };

/// Number of steps after which those of the whole integration are estimated.
const ESTIMATED: usize = MOST_STEPS / 20;

/// Estimates how many time steps an integration needs, and ends one that needs too many: a motion that grows without limit takes ever shorter
/// steps.
#[derive(Clone, Copy, Debug)]
pub(crate) struct StepCount {
    /// Time in s at which the steps of the estimate begin.
    since: f64,
    /// End of the integration in s.
    end: f64,
}

impl StepCount {
    /// Steps between two times (s). If an event `may_end` the motion earlier, they are counted and not estimated.
    pub fn new([start, end]: [f64; 2], may_end: bool) -> Self {
        Self { since: start, end: if may_end { f64::NEG_INFINITY } else { end } }
    }

    /// To be called before each step, from the time `t` (s) and the state `y` after a number of `steps`. `name` names a component, for messages.
    ///
    /// # Errors
    ///
    /// [`Error::Analysis`] for more than 20 million steps, or if the last million of them leads to more.
    pub fn check(&mut self, steps: usize, t: f64, y: &[f64], name: impl Fn(usize) -> String) -> Result<()> {
        if steps == 0 || !steps.is_multiple_of(ESTIMATED) {
            return Ok(());
        }
        let rest = ((self.end - t) / (t - self.since)).max(0.0) * ESTIMATED as f64;
        self.since = t;
        let needed = steps as f64 + rest;
        if steps < MOST_STEPS && needed <= MOST_STEPS as f64 {
            return Ok(());
        }
        let largest = (0..y.len()).max_by(|&i, &j| y[i].abs().total_cmp(&y[j].abs()));
        let there = largest.map(|i| format!("; {} is {:.1e} there", name(i), y[i])).unwrap_or_default();
        let t = Seconds(t);
        let why = format!("reached only t = {t} after {steps} time steps, and needs more than {MOST_STEPS}{there}");
        let remedy = "loosen the tolerance, or use longer steps or a shorter interval; if the motion grows without limit, change what drives it, or \
                      bound the design away from this point";
        Err(Error::analysis("the integration", why, remedy))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Steps of a count up to the time 1 s, each of the length that a function of the time gives; the number of them at the error.
    fn counted(may_end: bool, length: impl Fn(f64) -> f64) -> Option<usize> {
        let (mut count, mut t, mut steps) = (StepCount::new([0.0, 1.0], may_end), 0.0, 0);
        while t < 1.0 {
            if count.check(steps, t, &[0.0, -2.0], |i| format!("component {i}")).is_err() {
                return Some(steps);
            }
            (t, steps) = (t + length(t), steps + 1);
        }
        None
    }

    #[test]
    fn integrations_that_need_too_many_steps_end_early() {
        assert_eq!(counted(false, |_| 6e-6), None);
        assert_eq!(counted(false, |_| 4e-6), Some(ESTIMATED));
        // Short steps at first only, and ever shorter ones.
        assert_eq!(counted(false, |t| if t < 0.1 { 6e-6 } else { 1e-3 }), None);
        let ended = counted(false, |t| 1e-3 * (0.7 - t).max(1e-9)).unwrap();
        assert!(ended <= 3 * ESTIMATED, "{ended}");
        // An event may end the motion soon.
        assert_eq!(counted(true, |_| 4e-6), Some(MOST_STEPS));
        let error = StepCount::new([0.0, 1.0], false).check(ESTIMATED, 1e-3, &[0.0, -2.0], |i| format!("part {i}"));
        let message = error.unwrap_err().to_string();
        assert!(
            message.contains("t = 0.001 s after 10000 time steps") && message.contains("part 1 is -2.0e0"),
            "{message}"
        );
    }
}
