//! The choice of steps.

use crate::integrators::explicit::settings::{Explicit, StepControl};
use crate::integrators::explicit::stepper::{OdeRhs, Stepper};
use crate::integrators::step_limit::{MOST_STEPS, too_many_steps};
use crate::{Error, Result};

/// A running integration: advanced step by step to wanted times.
#[derive(Debug)]
pub struct OdeDriver<F> {
    /// The current step.
    pub stepper: Stepper<F>,
    /// Lengths of the steps taken, in s.
    pub steps: Vec<f64>,
    /// Steps tried again with a smaller size.
    pub failed_steps: usize,
    /// Room for a rate that is not kept.
    pub(crate) scratch: Vec<f64>,
    start: f64,
    pace: StepControl,
    end: f64,
    pub(crate) next: f64,
}

/// Room for step lengths that is made at the start, so that steps allocate nothing.
const EXPECTED_STEPS: usize = 1 << 14;

impl<F: OdeRhs> OdeDriver<F> {
    /// From `settings.start` in the state `y` up to the last of `times`.
    pub fn new(flow: F, settings: &Explicit, y: Vec<f64>, times: &[f64]) -> Result<Self> {
        settings.check(times)?;
        settings.check_size(flow.size())?;
        let mut stepper = Stepper::new(flow, settings.method, settings.start, y)?;
        let end = times.last().copied().unwrap_or(settings.start);
        let next = match &settings.pace {
            StepControl::Fixed(h) => *h,
            StepControl::Given(_) => 0.0,
            StepControl::Adaptive { tolerance, longest } if end > settings.start => {
                stepper.first_step(tolerance)?.min(*longest)
            }
            StepControl::Adaptive { longest, .. } => *longest,
        };
        let steps = Vec::with_capacity(EXPECTED_STEPS);
        let (start, pace, scratch) = (settings.start, settings.pace.clone(), Vec::new());
        Ok(Self { stepper, steps, failed_steps: 0, scratch, start, pace, end, next })
    }

    /// Whether the current step ends before `t`.
    pub fn is_before(&self, t: f64) -> bool {
        t - self.stepper.t[1] > 1e-12 * (t - self.start).abs()
    }

    /// Takes one step.
    ///
    /// **Errors.** [`Error::Analysis`] naming component and time if the step would have to become too small, or what
    /// the system could not evaluate.
    pub fn advance(&mut self) -> Result<()> {
        if !self.steps.is_empty() {
            self.stepper.accept();
        }
        let old = self.stepper.t[0];
        if self.steps.len() >= MOST_STEPS {
            return Err(too_many_steps(old));
        }
        match &self.pace {
            StepControl::Fixed(h) => {
                let target = self.start + h * (self.steps.len() + 1) as f64;
                self.stepper.attempt(target, None)?;
            }
            StepControl::Given(steps) => {
                let h = *steps.get(self.steps.len()).ok_or_else(|| {
                    let why = format!("{} steps end at t = {old:.6e} s, before the last output", steps.len());
                    Error::definition("given steps", why, "give steps up to the last output time")
                })?;
                self.stepper.attempt(old + h, None)?;
            }
            StepControl::Adaptive { .. } => self.advance_adaptive()?,
        }
        self.steps.push(self.stepper.t[1] - old);
        Ok(())
    }

    fn advance_adaptive(&mut self) -> Result<()> {
        let StepControl::Adaptive { tolerance, longest } = &self.pace else { unreachable!("the pace is adaptive") };
        let (old, exponent, mut rejected) = (self.stepper.t[0], self.stepper.exponent(), false);
        let mut h = self.next;
        loop {
            let last = old + 1.01 * h >= self.end;
            let outcome = self.stepper.attempt(if last { self.end } else { old + h }, Some(tolerance));
            let error = outcome.as_ref().map_or(f64::INFINITY, |&(error, _)| error);
            let growth = (0.9 * error.powf(-exponent)).clamp(0.2, if rejected { 1.0 } else { 6.0 });
            if error <= 1.0 {
                let taken = self.stepper.length();
                self.next = (taken * growth).min(*longest);
                return Ok(());
            }
            (rejected, h) = (true, self.stepper.length() * if growth.is_nan() { 0.2 } else { growth.min(0.9) });
            self.failed_steps += 1;
            if old + 0.1 * h == old || h < 1e-15 * (self.end - self.start) {
                let component = outcome?.1;
                let why = format!("the step becomes too small ({h:.1e} s) at t = {old:.6e} s");
                let remedy = "loosen the tolerance, or take an implicit method: the motion may be stiff or not smooth";
                return Err(Error::analysis(self.stepper.flow.name(component), why, remedy));
            }
        }
    }

    /// Writes the state at `t`, which the current step reaches. Returns whether dense output was needed for it.
    pub fn sample(&mut self, t: f64, y: &mut [f64]) -> Result<bool> {
        let tiny = 1e-12 * (t - self.start).abs();
        let stepper = &mut self.stepper;
        if (stepper.t[1] - t).abs() <= tiny {
            y.copy_from_slice(&stepper.new);
            return Ok(false);
        }
        stepper.make_dense()?;
        stepper.interpolate(t, y);
        Ok(true)
    }
}
