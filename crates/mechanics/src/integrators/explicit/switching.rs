//! Adaptive steps that end where the rates are not smooth: where a contact closes or opens.

use crate::integrators::explicit::grading::Grading;
use crate::integrators::explicit::stepper::{OdeRhs, Stepper};
use crate::integrators::inspection::InspectionTimes;
use crate::{Error, Result};

/// Signs of the switching functions along a motion.
///
/// A step across a point where the rates are not smooth loses the order of the method, in values and still more in
/// derivatives, which are less smooth by one order. A step that ends there keeps the order: in neighbouring designs, the
/// part of the step on the other side is infinitely short, and the rates themselves are continuous.
///
/// Along a step the rates are those of the sides on which it begins. They are smooth beyond the end of the step, where trial steps and
/// stages may lie. At its end only their derivatives jump: the next step begins with rates of the other side.
///
/// Where the rates have a power of the function that is not an integer, the steps that begin or end at its zero are graded towards it.
///
/// # Sources
/// Hairer, Nørsett & Wanner, *Solving Ordinary Differential Equations I*, 2nd ed. (1993), Section II.6; Shampine & Thompson, *Comput.
/// Math. Appl.* 39 (2000) 43–54.
#[derive(Clone, Debug, Default)]
pub(crate) struct SwitchLocator {
    /// For each function, true if it is positive along the current step. Empty without functions, and for steps that are not adaptive.
    pub held: Vec<bool>,
    /// For each function, true if it is positive after the current step.
    pub sides: Vec<bool>,
    /// The function that changes its sign at the end of the current step.
    pub crossed: Option<usize>,
    /// True if the current step begins with rates of other sides than the last one ends with.
    pub is_restarted: bool,
    /// True if the current step begins at the zero of a function of which the rates then have a power that is not an integer.
    begins_at_power: bool,
    /// The function with such a power at whose zero the current step is to end.
    ends_at_power: Option<usize>,
    /// True if the current step does not end at such a zero, although extrapolation of the function predicts one.
    is_even: bool,
    values: Vec<f64>,
    ahead: Vec<f64>,
    y: Vec<f64>,
}

/// Sides of switching functions along a recorded step, and the distribution of its stages.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct HeldSides {
    pub sides: Vec<bool>,
    pub grading: Grading,
}

impl HeldSides {
    /// Reads the values that [`SwitchLocator::write`] has written.
    pub fn read(values: &[f64]) -> Self {
        let Some((&grading, sides)) = values.split_last() else {
            return Self { sides: Vec::new(), grading: Grading::Even };
        };
        Self { sides: sides.iter().map(|side| *side != 0.0).collect(), grading: Grading::ALL[grading as usize] }
    }
}

/// Length over which a function is extrapolated at the end of a step, as a fraction of the step.
const CLOSE: f64 = 1e-3;

/// Distance in time of the end of a step from a zero, as a fraction of the step, that counts as zero; the rounding error of times is added.
const AT_ZERO: f64 = 1e-11;

/// Largest number of corrections of the end of a step towards a zero.
const MOST_CORRECTIONS: usize = 6;

/// Fractions of a step at which signs are compared.
const SAMPLES: [f64; 4] = [0.25, 0.5, 0.75, 1.0];

/// Least of the values of a function in a step, as a fraction of its largest one, below which signs are compared at more places.
const NEAR: f64 = 0.1;

/// Number of these places.
const CLOSE_SAMPLES: usize = 16;

/// Fraction of a step next to its ends at which a change of sign belongs to the end.
const AT_END: f64 = 1e-9;

/// Largest number of halvings in the search for a zero.
const MOST_TRIALS: usize = 80;

impl SwitchLocator {
    /// Locator at the start of a motion in the state `y`.
    pub fn new<F: OdeRhs>(rhs: &mut F, t: f64, y: &[f64]) -> Self {
        let mut locator = Self { y: y.to_vec(), ..Self::default() };
        rhs.switching_functions(t, y, &mut locator.values);
        locator.held = locator.values.iter().map(|value| *value > 0.0).collect();
        locator.sides.clone_from(&locator.held);
        rhs.hold_sides(&locator.held);
        locator
    }

    /// Begins a step: after an event with the sides of its new state, otherwise with the sides at the end of the last step.
    pub fn begin_step<F: OdeRhs>(&mut self, stepper: &mut Stepper<F>, is_after_event: bool) -> Result<()> {
        (self.is_restarted, self.crossed) = (false, None);
        (self.begins_at_power, self.is_even) = (false, false);
        if is_after_event && !self.held.is_empty() {
            stepper.rhs.switching_functions(stepper.t[0], &stepper.old, &mut self.values);
            self.store_sides();
        }
        if self.sides == self.held { Ok(()) } else { self.hold(stepper) }
    }

    /// Begins a step of a recorded simulation, on the given `sides`.
    ///
    /// # Errors
    /// [`Error::Definition`] if they are not one for each switching function, and errors of the rates.
    pub fn begin_replayed_step<F: OdeRhs>(&mut self, stepper: &mut Stepper<F>, sides: &[bool]) -> Result<()> {
        if sides.len() != self.held.len() {
            let why = format!(
                "a step has the sides of {} switching functions, the mechanism {}",
                sides.len(),
                self.held.len()
            );
            return Err(Error::definition("taken steps", why, "give steps of a simulation of the same model"));
        }
        self.sides.copy_from_slice(sides);
        if self.sides == self.held { Ok(()) } else { self.hold(stepper) }
    }

    /// Continues on the present sides from the beginning of the step.
    fn hold<F: OdeRhs>(&mut self, stepper: &mut Stepper<F>) -> Result<()> {
        let mut changes = self.sides.iter().zip(&self.held).enumerate();
        self.begins_at_power |= changes.any(|(k, (side, held))| *side && !held && stepper.rhs.has_fractional_power(k));
        self.held.clone_from(&self.sides);
        self.is_restarted = true;
        stepper.rhs.hold_sides(&self.held);
        stepper.restart_rates()
    }

    /// Changes the sides of functions that are zero at the beginning of the completed step and leave it to the other
    /// side. Returns whether there are any: the step then has to be repeated.
    pub fn correct_beginning<F: OdeRhs>(&mut self, stepper: &mut Stepper<F>) -> Result<bool> {
        if self.held.is_empty() || !self.is_crossed(stepper, AT_END, false) {
            return Ok(false);
        }
        self.store_sides();
        self.hold(stepper)?;
        Ok(true)
    }

    /// Grades a trial step that begins or ends at the zero of a function of which the rates have a power that is not an integer. Returns its
    /// length: `h`, or less where such a zero lies ahead, which is at most `rest` away.
    ///
    /// No step ends shortly before the zero: its derivatives would be less accurate than its values.
    pub fn grade_step<F: OdeRhs>(&mut self, stepper: &mut Stepper<F>, h: f64, rest: f64) -> f64 {
        stepper.grading = if self.begins_at_power { Grading::Start } else { Grading::Even };
        self.ends_at_power = None;
        if self.begins_at_power || self.is_even {
            return h;
        }
        let is_ahead = |(_, time): &(usize, f64)| 0.0 < *time && *time <= rest;
        let zeros = self.times_to_zeros(stepper, false, h).into_iter().filter(is_ahead);
        let Some((function, time)) = zeros.min_by(|(_, a), (_, b)| a.total_cmp(b)) else { return h };
        if h >= time {
            (stepper.grading, self.ends_at_power) = (Grading::End, Some(function));
            time
        } else {
            h.min(0.5 * time)
        }
    }

    /// Moves the end of a completed step that is to end at a zero to this zero. Returns false if there is none: the step has to be
    /// repeated.
    pub fn move_end_to_zero<F: OdeRhs>(&mut self, stepper: &mut Stepper<F>) -> Result<bool> {
        let Some(function) = self.ends_at_power else { return Ok(true) };
        let planned = stepper.length();
        for _ in 0..MOST_CORRECTIONS {
            let length = stepper.length();
            let times = self.times_to_zeros(stepper, true, CLOSE * length);
            let Some((_, change)) = times.into_iter().find(|(k, _)| *k == function) else { break };
            if change.abs() <= AT_ZERO * length + f64::EPSILON * stepper.t[1].abs() {
                return Ok(true);
            }
            if !(0.5 * planned..=2.0 * planned).contains(&(length + change)) {
                break;
            }
            stepper.attempt(stepper.t[1] + change, None)?;
        }
        self.is_even = true;
        Ok(false)
    }

    /// The functions on whose present side the rates have a power that is not an integer, with the times in s from an end of the step to
    /// their zeros, by linear extrapolation over the time `after`.
    fn times_to_zeros<F: OdeRhs>(&mut self, stepper: &mut Stepper<F>, is_end: bool, after: f64) -> Vec<(usize, f64)> {
        let mut times = Vec::new();
        let is_held = |k: &usize| self.held[*k] && stepper.rhs.has_fractional_power(*k);
        let functions: Vec<usize> = (0..self.held.len()).filter(is_held).collect();
        if functions.is_empty() {
            return times;
        }
        for (time, to) in [(0.0, &mut self.values), (after, &mut self.ahead)] {
            let t = stepper.extrapolate(is_end, time, &mut self.y);
            stepper.rhs.switching_functions(t, &self.y, to);
        }
        for k in functions {
            let [value, ahead] = [self.values[k], self.ahead[k]];
            if ahead < value {
                times.push((k, after * value / (value - ahead)));
            }
        }
        times
    }

    /// Shortens the completed step so that it ends at the first zero of a switching function, if there is one in it.
    ///
    /// Signs are compared at `times`, too.
    pub fn end_step<F: OdeRhs>(&mut self, stepper: &mut Stepper<F>, times: &InspectionTimes) -> Result<()> {
        if self.held.is_empty() {
            return Ok(());
        }
        let change = match self.first_change(stepper)? {
            Some(change) => Some(change),
            None => self.first_change_at(stepper, times)?,
        };
        let Some([low, high]) = change else {
            self.crossed = self.ends_at_power;
            self.crossed.iter().for_each(|&k| self.sides[k] = false);
            return Ok(());
        };
        stepper.make_dense()?;
        let root = self.first_zero(stepper, low, high);
        self.is_crossed(stepper, (root + AT_END).min(1.0), true);
        self.crossed = self.values.iter().zip(&self.held).position(|(value, side)| (*value > 0.0) != *side);
        self.store_sides();
        if root < 1.0 - AT_END {
            let [begin, end] = stepper.t;
            stepper.attempt(begin + root * (end - begin), None)?;
        }
        Ok(())
    }

    /// Ends the step at an event before the zero of a switching function.
    pub fn end_before(&mut self) {
        self.crossed = None;
        self.sides.clone_from(&self.held);
    }

    /// Fractions of the completed step between which the first function changes its sign, if one does.
    fn first_change<F: OdeRhs>(&mut self, stepper: &mut Stepper<F>) -> Result<Option<[f64; 2]>> {
        let mut low = AT_END;
        let mut extremes = vec![[f64::INFINITY, 0.0f64]; self.held.len()];
        for high in SAMPLES {
            if self.is_crossed(stepper, high, false) {
                return Ok(Some([low, high]));
            }
            low = high;
            for ([least, largest], value) in extremes.iter_mut().zip(&self.values) {
                (*least, *largest) = (least.min(value.abs()), largest.max(value.abs()));
            }
        }
        if extremes.iter().all(|[least, largest]| *least >= NEAR * largest) {
            return Ok(None);
        }
        stepper.make_dense()?;
        let places = (0..=CLOSE_SAMPLES).map(|k| if k == 0 { AT_END } else { k as f64 / CLOSE_SAMPLES as f64 });
        let places: Vec<f64> = places.collect();
        let change = places.windows(2).find(|place| self.is_crossed(stepper, place[1], true));
        Ok(change.map(|place| [place[0], place[1]]))
    }

    /// Fractions of the completed step at two of the `times` inside it between which the first function changes its sign, if one does.
    fn first_change_at<F: OdeRhs>(
        &mut self,
        stepper: &mut Stepper<F>,
        times: &InspectionTimes,
    ) -> Result<Option<[f64; 2]>> {
        let (inside, mut low) = (times.inside(stepper.t), AT_END);
        if inside.is_empty() {
            return Ok(None);
        }
        stepper.make_dense()?;
        for t in inside {
            let high = (t - stepper.t[0]) / stepper.length();
            if high > AT_END && self.is_crossed(stepper, high, true) {
                return Ok(Some([low, high]));
            }
            low = high;
        }
        Ok(None)
    }

    /// Fraction of the step at which the first function changes its sign, by bisection of dense output.
    fn first_zero<F: OdeRhs>(&mut self, stepper: &mut Stepper<F>, mut low: f64, mut high: f64) -> f64 {
        for _ in 0..MOST_TRIALS {
            let middle = 0.5 * (low + high);
            if !(low < middle && middle < high) {
                break;
            }
            if self.is_crossed(stepper, middle, true) {
                high = middle;
            } else {
                low = middle;
            }
        }
        high
    }

    /// Returns whether a function has another sign at the fraction `x` of the step than along it.
    fn is_crossed<F: OdeRhs>(&mut self, stepper: &mut Stepper<F>, x: f64, is_dense: bool) -> bool {
        let t = if x == 1.0 { stepper.t[1] } else { stepper.t[0] + x * stepper.length() };
        match (x == 1.0, is_dense) {
            (true, _) => self.y.copy_from_slice(&stepper.new),
            (_, true) => stepper.interpolate(t, &mut self.y),
            (_, false) => stepper.interpolate_coarsely(x, &mut self.y),
        }
        stepper.rhs.switching_functions(t, &self.y, &mut self.values);
        self.values.iter().zip(&self.held).any(|(value, side)| (*value > 0.0) != *side)
    }

    /// Number of values that describe the current step.
    pub fn width(&self) -> usize {
        if self.held.is_empty() { 0 } else { self.held.len() + 1 }
    }

    /// Appends the values of [`HeldSides`] of the current step, which has a `grading`.
    pub fn write(&self, grading: Grading, to: &mut Vec<f64>) {
        if !self.held.is_empty() {
            to.extend(self.held.iter().map(|&side| f64::from(u8::from(side))));
            to.push(f64::from(grading as u8));
        }
    }

    /// Stores the signs of the last evaluation.
    fn store_sides(&mut self) {
        self.sides.iter_mut().zip(&self.values).for_each(|(side, value)| *side = *value > 0.0);
    }
}
