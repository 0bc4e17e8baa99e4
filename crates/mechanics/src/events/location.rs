//! A run over time that bounces off rigid contacts and passes switches: a step ends where one of them closes.

use crate::analyses::dynamics::StepSize;
use crate::events::impact::{apply_impact, apply_switch};
use crate::integrators::time_stepper::TimeStepper;
use crate::{Error, Result};

/// An impact during a motion, or a switch that was passed.
#[derive(Clone, Debug, PartialEq)]
pub struct Event {
    /// Name of the contact.
    pub contact: String,
    /// When, in s.
    pub t: f64,
}

/// Steps tried in search of the instant at which a contact closes.
const TRIALS: usize = 100;

/// Shortest flight between two impacts of a contact, in nominal steps.
const SHORTEST: f64 = 1e-6;

/// A contact closes with a step already if so much of the gap is left: a step that short would be rounding only.
const NEAR: f64 = 1e-6;

/// How far beyond a switch what it switches is looked at, in nominal steps.
const AHEAD: f64 = 1e-6;

impl TimeStepper<'_> {
    /// Refuses a start in which a contact is closed.
    pub(crate) fn check_contacts(&self) -> Result<()> {
        let state = &self.integrator.step.new;
        for impact in self.integrator.mechanism.impacts.iter().filter(|impact| impact.restitution.is_some()) {
            let (gap, rate) = (impact.gap(state), impact.rate(state, &state.v));
            let is_open = gap > 0.0 || (gap == 0.0 && rate > 0.0);
            if !is_open {
                let why =
                    format!("the motion starts at t = {:.6e} s with a gap of {gap:.3e} that is not opening", state.t);
                return Err(Error::analysis(&impact.part.name, why, "start with the contact open"));
            }
        }
        Ok(())
    }

    /// Bounces off the contact that the last step has closed, or passes the switch, if it has.
    pub(crate) fn bounce(&mut self) -> Result<()> {
        self.bounced = self.closed.take();
        let Some(contact) = self.bounced else { return Ok(()) };
        let ahead = self.settings.step.ahead();
        let integrator = &mut self.integrator;
        let (mechanism, mut state) = (integrator.mechanism, integrator.step.new.clone());
        match mechanism.impacts[contact].restitution {
            Some(_) => _ = apply_impact(&mut integrator.system, mechanism, contact, &mut state)?,
            None => _ = apply_switch(&mut integrator.system, mechanism, ahead, &mut state)?,
        }
        integrator.step.restart(&state);
        self.impacts.push(Event { contact: mechanism.impacts[contact].part.name.clone(), t: state.t });
        Ok(())
    }

    /// Takes the step `h` anew so that it ends where the first contact closes, if any does. Returns its length.
    pub(crate) fn stop_at_contact(&mut self, mut h: f64) -> Result<f64> {
        while let Some(contact) = self.first_closed(h) {
            let Some(shorter) = self.close(contact, h)? else { break };
            (h, self.closed) = (shorter, Some(contact));
        }
        Ok(h)
    }

    /// How far a contact is open at the beginning of the step and at the end of what has been taken of it, `h`: positive is
    /// open. The gap, or after an impact, or where it is zero, the gap over the time since; of a switch on the side where it was.
    fn openings(&self, contact: usize, h: f64) -> [f64; 2] {
        let (impact, old) = (&self.integrator.mechanism.impacts[contact], &self.integrator.step.old);
        let (before, after) = (impact.gap(old), impact.gap(&self.integrator.step.new));
        let [begin, end] = match self.bounced == Some(contact) || before == 0.0 {
            true => [impact.rate(old, &old.v), after / h],
            false => [before, after],
        };
        let side = if impact.restitution.is_none() && begin < 0.0 { -1.0 } else { 1.0 };
        [side * begin, side * end]
    }

    /// The contact that the step `h` closes, of several the one that seems to close first.
    fn first_closed(&self, h: f64) -> Option<usize> {
        let others = (0..self.integrator.mechanism.impacts.len()).filter(|k| self.closed != Some(*k));
        let openings = others.map(|contact| (contact, self.openings(contact, h)));
        let closed = openings.filter(|(_, [begin, end])| *end <= NEAR * begin.max(0.0) && (*end < 0.0 || *begin > 0.0));
        let share = |[begin, end]: [f64; 2]| begin.max(0.0) / (begin.max(0.0) - end);
        closed.min_by(|a, b| share(a.1).total_cmp(&share(b.1))).map(|(contact, _)| contact)
    }

    /// Takes the step anew so that it ends where `contact` closes, somewhere in a step `h` or a little after it.
    ///
    /// By the Illinois method. None if the contact only comes near.
    ///
    /// **Source.** Dowell & Jarratt, *BIT* 11 (1971) 168–174.
    fn close(&mut self, contact: usize, h: f64) -> Result<Option<f64>> {
        let [begin, mut end] = self.openings(contact, h);
        if !(begin > 0.0) {
            return Err(self.lasting(contact));
        }
        let mut longest = h;
        if end > 0.0 {
            longest = h + 2.0 * h * end / (begin - end);
            self.integrator.solve(longest)?;
            end = self.openings(contact, longest)[1];
            if end > 0.0 {
                self.integrator.solve(h)?;
                return Ok(None);
            }
        }
        let (mut low, mut high) = ([0.0, begin], [longest, end]);
        let (small, mut tried) = (4.0 * f64::EPSILON * (begin - end), longest);
        for _ in 0..TRIALS {
            let wished = (low[0] * high[1] - high[0] * low[1]) / (high[1] - low[1]);
            if !(low[0] < wished && wished < high[0]) {
                break;
            }
            tried = wished;
            // A step to just beyond a switch may have no solution on either side of it.
            let solved = self.integrator.solve(tried).is_ok();
            let open = if solved { self.openings(contact, tried)[1] } else { -low[1] };
            if solved && open.abs() <= small || high[0] - low[0] <= 4.0 * f64::EPSILON * high[0] {
                break;
            }
            // The end that stays counts half, so that it does not stay for ever.
            if open > 0.0 {
                low = [tried, open];
                high[1] *= 0.5;
            } else {
                high = [tried, open];
                low[1] *= if solved { 0.5 } else { 1.0 };
            }
        }
        if self.integrator.solve(tried).is_err() {
            tried = low[0];
            self.integrator.solve(tried)?;
        }
        let is_short = self.bounced == Some(contact) && tried <= SHORTEST * self.settings.step.nominal();
        if is_short { Err(self.lasting(contact)) } else { self.on_this_side(contact, tried).map(Some) }
    }

    /// A step that ends before the switch, by rounding: what is switched must not have been.
    fn on_this_side(&mut self, contact: usize, mut h: f64) -> Result<f64> {
        if self.integrator.mechanism.impacts[contact].restitution.is_none() {
            let mut less = f64::EPSILON * (h + self.integrator.step.new.t.abs());
            for _ in 0..8 {
                let [_, open] = self.openings(contact, h);
                if open > 0.0 {
                    break;
                }
                h -= less;
                less *= 2.0;
                self.integrator.solve(h)?;
            }
        }
        Ok(h)
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

impl StepSize {
    /// A step's usual length in s.
    fn nominal(&self) -> f64 {
        match *self {
            Self::Fixed(h) => h,
            Self::Adaptive { first, .. } => first,
        }
    }

    /// How far beyond a switch what it switches is looked at, in s.
    pub(crate) fn ahead(&self) -> f64 {
        AHEAD * self.nominal()
    }
}
