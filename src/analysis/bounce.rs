//! A run over time that bounces off rigid contacts: where a step closes one it is shortened to end there.

use super::dynamics::StepSize;
use super::impact::strike;
use super::run::Run;
use crate::{Error, Result};

/// An impact during a motion.
#[derive(Clone, Debug, PartialEq)]
pub struct Impact {
    /// Name of the contact.
    pub contact: String,
    /// When, in s.
    pub t: f64,
}

/// Steps tried in search of the instant at which a contact closes.
const TRIALS: usize = 60;

/// Shortest flight between two impacts of a contact, in nominal steps.
const SHORTEST: f64 = 1e-6;

impl Run<'_> {
    /// Refuses a start in which a contact is closed.
    pub(super) fn check_contacts(&self) -> Result<()> {
        let state = &self.integrator.step.new;
        for impact in &self.integrator.mechanism.impacts {
            let (gap, rate) = (impact.gap(state), impact.rate(state, &state.v));
            if !(gap > 0.0 || (gap == 0.0 && rate > 0.0)) {
                let why =
                    format!("the motion starts at t = {:.6e} s with a gap of {gap:.3e} that is not opening", state.t);
                return Err(Error::analysis(&impact.part.name, why, "start with the contact open"));
            }
        }
        Ok(())
    }

    /// Bounces off the contact that the last step has closed, if it has.
    pub(super) fn bounce(&mut self) -> Result<()> {
        self.bounced = self.closed.take();
        let Some(contact) = self.bounced else { return Ok(()) };
        let integrator = &mut self.integrator;
        let mut state = integrator.step.new.clone();
        strike(&mut integrator.system, integrator.mechanism, contact, &mut state)?;
        integrator.step.restart(&state);
        let name = integrator.mechanism.impacts[contact].part.name.clone();
        self.impacts.push(Impact { contact: name, t: state.t });
        Ok(())
    }

    /// Shortens the step `h` that was taken so that it ends where the first contact closes. Returns its length.
    pub(super) fn stop_at_contact(&mut self, mut h: f64) -> Result<f64> {
        while let Some(contact) = self.first_closed() {
            h = self.close(contact, h)?;
            self.closed = Some(contact);
        }
        Ok(h)
    }

    /// The contact that the step leaves closed, of several the one that seems to close first.
    fn first_closed(&self) -> Option<usize> {
        let (old, new) = (&self.integrator.step.old, &self.integrator.step.new);
        let gaps = self.integrator.mechanism.impacts.iter().enumerate().filter(|(k, _)| self.closed != Some(*k));
        let closed = gaps.map(|(k, impact)| (k, impact.gap(old), impact.gap(new))).filter(|(.., gap)| *gap < 0.0);
        let share = |before: f64, after: f64| before.max(0.0) / (before.max(0.0) - after);
        closed.min_by(|a, b| share(a.1, a.2).total_cmp(&share(b.1, b.2))).map(|(k, ..)| k)
    }

    /// Takes the step anew so that it ends where `contact` closes, somewhere in a step `h`.
    ///
    /// By the Illinois method, on the gap; after an impact on the gap over the time since, which does not begin with zero.
    ///
    /// **Source.** Dowell & Jarratt, *BIT* 11 (1971) 168–174.
    fn close(&mut self, contact: usize, h: f64) -> Result<f64> {
        let (mechanism, again) = (self.integrator.mechanism, self.bounced == Some(contact));
        let impact = &mechanism.impacts[contact];
        let old = &self.integrator.step.old;
        let begin = if again { impact.rate(old, &old.v) } else { impact.gap(old) };
        let open = |run: &Self, h: f64| impact.gap(&run.integrator.step.new) / if again { h } else { 1.0 };
        let (mut low, mut high) = ([0.0, begin], [h, open(self, h)]);
        let small = 4.0 * f64::EPSILON * (begin - high[1]);
        let mut tried = h;
        for _ in 0..TRIALS {
            let wished = (low[0] * high[1] - high[0] * low[1]) / (high[1] - low[1]);
            if !(begin > 0.0 && low[0] < wished && wished < high[0]) {
                break;
            }
            tried = wished;
            self.integrator.solve(tried)?;
            let gap = open(self, tried);
            if gap.abs() <= small {
                break;
            }
            // The end that stays counts half, so that it does not stay for ever.
            if gap > 0.0 {
                low = [tried, gap];
                high[1] *= 0.5;
            } else {
                high = [tried, gap];
                low[1] *= 0.5;
            }
        }
        if begin > 0.0 && (!again || tried > SHORTEST * self.nominal()) {
            Ok(tried)
        } else {
            Err(self.lasting(contact))
        }
    }

    /// A step's usual length in s.
    fn nominal(&self) -> f64 {
        match self.settings.step {
            StepSize::Fixed(h) => h,
            StepSize::Adaptive { first, .. } => first,
        }
    }

    fn lasting(&self, contact: usize) -> Error {
        let name = &self.integrator.mechanism.impacts[contact].part.name;
        let why =
            format!("it stays closed from t = {:.6e} s on: the rebounds have died out", self.integrator.step.old.t);
        let remedy =
            "model a contact that lasts with stiffness and damping (a wall contact, a bump stop), or end before";
        Error::analysis(name, why, remedy)
    }
}
