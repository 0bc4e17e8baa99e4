//! Step control of explicit methods.

use crate::integrators::explicit::defect::DefectControl;
use crate::integrators::explicit::grading::Grading;
use crate::integrators::explicit::settings::{Explicit, ReplayedStep, StepControl};
use crate::integrators::explicit::stepper::{OdeRhs, Stepper};
use crate::integrators::explicit::switching::SwitchLocator;
use crate::integrators::inspection::InspectionTimes;
use crate::integrators::settings::{StepCount, Work};
use crate::{Error, Result};
use error::Seconds;

/// An integration in progress, advanced step by step.
#[derive(Debug)]
pub struct OdeDriver<F> {
    /// The current step.
    pub stepper: Stepper<F>,
    /// Lengths of the steps taken in s.
    pub steps: Vec<f64>,
    /// Rejected trial steps, repeated with a smaller size.
    pub failed_steps: usize,
    /// Workspace for a rate.
    pub(crate) scratch: Vec<f64>,
    start: f64,
    step_control: StepControl,
    end: f64,
    pub(crate) next: f64,
    pub(crate) switches: SwitchLocator,
    pub(crate) given: SplitStep,
    inspections: InspectionTimes,
    defect: DefectControl,
    count: StepCount,
}

/// The current one of given steps, which events may split.
#[derive(Clone, Copy, Debug)]
pub(crate) struct SplitStep {
    /// End in s.
    end: f64,
    /// Number of given steps up to this end.
    count: usize,
}

impl SplitStep {
    /// Sets the end of the step that begins at the time `t` (s): that of the given step which an event has split, or of the next one.
    /// `length` returns the length in s of the given step with a number.
    fn begin_step(&mut self, t: f64, length: impl Fn(usize) -> Option<f64>) -> Result<()> {
        let length = |k: usize| {
            length(k).ok_or_else(|| {
                let why = format!("{k} steps end at t = {t}, before the last output", t = Seconds(t));
                Error::definition("given steps", why, "give steps up to the last output time")
            })
        };
        while self.count == 0 || self.end - t <= TINY * length(self.count - 1)? {
            self.end += length(self.count)?;
            self.count += 1;
        }
        Ok(())
    }
}

/// Number of step lengths for which memory is allocated at the start, so that steps do not allocate.
const EXPECTED_STEPS: usize = 1 << 14;

/// Fraction of a grid step. After an event, a shorter remainder of the grid step is merged with the next grid step.
const TINY: f64 = 1e-4;

impl<F: OdeRhs> OdeDriver<F> {
    /// Integration of `rhs` from `settings.start` in the state `y` to the end of the motion, for outputs at `times` (s).
    ///
    /// # Errors
    ///
    /// Settings that [`Explicit::check`] or [`Explicit::check_size`] rejects, and errors of `rhs`.
    pub fn new(rhs: F, settings: &Explicit, y: Vec<f64>, times: &[f64]) -> Result<Self> {
        settings.check(times)?;
        settings.check_size(rhs.size())?;
        let mut stepper = Stepper::new(rhs, settings.method, settings.start, y)?;
        let end = settings.end_after(times);
        let next = match &settings.step_control {
            StepControl::Fixed(h) => *h,
            StepControl::Given(_) | StepControl::Taken(_) => 0.0,
            StepControl::Adaptive { tolerance, longest } if end > settings.start => {
                stepper.first_step(tolerance)?.min(*longest)
            }
            StepControl::Adaptive { longest, .. } => *longest,
        };
        let switches = match &settings.step_control {
            StepControl::Adaptive { .. } | StepControl::Taken(_) => {
                SwitchLocator::new(&mut stepper.rhs, settings.start, &stepper.old)
            }
            _ => SwitchLocator::default(),
        };
        let steps = Vec::with_capacity(EXPECTED_STEPS);
        let (start, step_control, scratch) = (settings.start, settings.step_control.clone(), Vec::new());
        let given = SplitStep { end: start, count: 0 };
        let inspected = settings.inspected.as_deref().unwrap_or(times);
        let inspections = InspectionTimes::new(start, end, inspected, &stepper.rhs.breaks());
        let defect = DefectControl::new(stepper.old.len());
        let count = StepCount::new([start, end], stepper.rhs.may_end());
        Ok(Self {
            stepper,
            steps,
            failed_steps: 0,
            scratch,
            start,
            step_control,
            end,
            next,
            switches,
            given,
            inspections,
            defect,
            count,
        })
    }

    /// The largest absolute tolerance of the local error of a component; `None` for fixed and given steps.
    pub fn tolerance(&self) -> Option<f64> {
        match &self.step_control {
            StepControl::Adaptive { tolerance, .. } => tolerance.absolute.iter().copied().reduce(f64::max),
            _ => None,
        }
    }

    /// Returns whether the motion continues and the current step ends before `t` (s).
    pub fn is_before(&self, t: f64) -> bool {
        !self.stepper.rhs.has_ended() && t - self.stepper.t[1] > 1e-12 * (t - self.start).abs()
    }

    /// Takes one step.
    ///
    /// # Errors
    ///
    /// [`Error::Analysis`] naming component and time if the step becomes too small, and errors of the right-hand side.
    pub fn advance(&mut self) -> Result<()> {
        if !self.steps.is_empty() {
            self.stepper.accept();
            let is_after_event = F::begin_after_event(&mut self.stepper)?;
            self.switches.begin_step(&mut self.stepper, is_after_event)?;
        }
        let old = self.stepper.t[0];
        let (y, rhs) = (&self.stepper.old, &self.stepper.rhs);
        self.count.check(self.steps.len(), old, y, |component| rhs.name(component))?;
        match &self.step_control {
            StepControl::Fixed(h) => {
                let taken = ((old - self.start) / h + TINY).floor();
                let target = self.start + h * (taken + 1.0);
                self.stepper.attempt(target, None)?;
            }
            StepControl::Given(steps) => {
                self.given.begin_step(old, |k| steps.get(k).copied())?;
                self.stepper.attempt(self.given.end, None)?;
            }
            StepControl::Taken(steps) => {
                self.given.begin_step(old, |k| steps.get(k).map(|step| step.length))?;
                let ReplayedStep { sides, grading, .. } = &steps[self.given.count - 1];
                self.stepper.grading = *grading;
                self.switches.begin_replayed_step(&mut self.stepper, sides)?;
                self.stepper.attempt(self.given.end, None)?;
            }
            StepControl::Adaptive { .. } => self.advance_adaptive()?,
        }
        let end = self.stepper.t[1];
        F::end_at_event(&mut self.stepper, &self.inspections)?;
        if self.stepper.t[1] != end {
            self.switches.end_before();
        }
        self.stepper.rhs.accept();
        self.steps.push(self.stepper.t[1] - old);
        Ok(())
    }

    /// Takes the longest step whose error is below the tolerance.
    fn advance_adaptive(&mut self) -> Result<()> {
        let StepControl::Adaptive { tolerance, longest } = &self.step_control else {
            unreachable!("the steps are adaptive")
        };
        let (old, exponent, mut rejected) = (self.stepper.t[0], self.stepper.exponent(), false);
        let (mut h, mut is_corrected) = (self.next, false);
        loop {
            let planned = self.switches.grade_step(&mut self.stepper, h, self.end - old);
            let last = self.stepper.grading != Grading::End && old + 1.01 * planned >= self.end;
            let outcome = self.stepper.attempt(if last { self.end } else { old + planned }, Some(tolerance));
            let error = outcome.as_ref().map_or(f64::INFINITY, |&(error, _)| error);
            let growth = (0.9 * error.powf(-exponent)).clamp(0.2, if rejected { 1.0 } else { 6.0 });
            if error <= 1.0 && !is_corrected && self.switches.correct_beginning(&mut self.stepper)? {
                is_corrected = true;
                continue;
            }
            if error <= 1.0 && !self.switches.move_end_to_zero(&mut self.stepper)? {
                continue;
            }
            if error <= 1.0
                && let Some(t) = self.defect.first_miss(&mut self.stepper, &self.inspections, tolerance)
            {
                // The missed load or motion is then at the end of the next trial step, or inside a later one.
                (rejected, h) = (true, (t - old).min(0.5 * self.stepper.length()));
                self.failed_steps += 1;
                continue;
            }
            if error <= 1.0 {
                let taken = self.stepper.length();
                self.next = (taken * growth).min(*longest);
                return self.switches.end_step(&mut self.stepper, &self.inspections);
            }
            (rejected, h) = (true, self.stepper.length() * if growth.is_nan() { 0.2 } else { growth.min(0.9) });
            self.failed_steps += 1;
            if old + 0.1 * h == old || h < 1e-15 * (self.end - self.start) {
                let stepper = &mut self.stepper;
                if let Some(error) = stepper.rhs.diagnose(old, &stepper.old) {
                    return Err(error);
                }
                let component = outcome?.1;
                let why = format!("the step becomes too small ({h:.1e} s) at t = {old}", old = Seconds(old));
                let remedy = "loosen the tolerance, or use an implicit method: the motion may be stiff or not smooth";
                return Err(Error::analysis(self.stepper.rhs.name(component), why, remedy));
            }
        }
    }

    /// The current step, to be taken in another simulation.
    pub fn replayed_step(&self) -> ReplayedStep {
        let (sides, grading) = (self.switches.held.clone(), self.stepper.grading);
        ReplayedStep { length: self.steps.last().copied().unwrap_or(0.0), sides, grading }
    }

    /// Writes the state at the time `t` (s) in the current step to `y`. Returns whether dense output was
    /// used.
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

    /// The end of the motion in s.
    pub fn end(&self) -> f64 {
        self.end
    }

    /// Numbers of steps and evaluations so far.
    pub fn work(&self) -> Work {
        Work { steps: self.steps.len(), failed_steps: self.failed_steps, iterations: self.stepper.evaluations }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    struct Clock;

    impl OdeRhs for Clock {
        fn size(&self) -> usize {
            1
        }

        fn rates(&mut self, _slot: usize, _t: f64, _y: &[f64], k: &mut [f64]) -> Result<()> {
            k[0] = 1.0;
            Ok(())
        }

        fn name(&self, _component: usize) -> String {
            "time".to_owned()
        }
    }

    #[test]
    fn an_endless_integration_is_rejected() {
        let integrate = |h: f64| {
            let settings = Explicit::eighth_order(1.0).with_step_control(StepControl::Fixed(h));
            let mut driver = OdeDriver::new(Clock, &settings, vec![0.0], &[1.0])?;
            while driver.is_before(1.0) {
                driver.advance()?;
            }
            Ok(())
        };
        let error: Error = integrate(1e-6).unwrap_err();
        let message =
            "reached only t = 0.01 s after 10000 time steps, and needs more than 200000; time is 1.0e-2 there";
        assert!(error.to_string().contains(message), "{error}");
        assert_eq!(integrate(1e-5), Ok(()));
    }
}
