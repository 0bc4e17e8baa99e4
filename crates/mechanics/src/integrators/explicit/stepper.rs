//! One explicit step, its error estimate and dense output.

use crate::integrators::explicit::grading::Grading;
use crate::integrators::explicit::settings::Tolerance;
use crate::integrators::explicit::tableau::Tableau;
use crate::integrators::inspection::InspectionTimes;
use crate::{Error, Result};
use autodiff::Jet2;

/// Right-hand side of a system of first-order differential equations.
pub trait OdeRhs {
    /// Number of components.
    fn size(&self) -> usize;

    /// Writes dy/dt at (`t`, `y`) to `k`, the derivative of the step's `slot`.
    fn rates(&mut self, slot: usize, t: f64, y: &[f64], k: &mut [f64]) -> Result<()>;

    /// Prepares the evaluations of a step that begins at (`t`, `y`).
    fn begin_step(&mut self, _t: f64, _y: &[f64]) -> Result<()> {
        Ok(())
    }

    /// Projects the end of a step onto the manifold of the solution.
    fn project(&mut self, _t: f64, _y: &mut [f64]) -> Result<()> {
        Ok(())
    }

    /// Called at the end of each step that is not repeated.
    fn accept(&mut self) {}

    /// Writes the values of functions at whose zeros the rates are not smooth, always the same number of them.
    ///
    /// Adaptive steps end there.
    fn switching_functions(&mut self, _t: f64, _y: &[f64], out: &mut Vec<f64>) {
        out.clear();
    }

    /// Returns whether the rates have a power of switching function number `k` that is not an integer, where it is positive.
    fn has_fractional_power(&self, _k: usize) -> bool {
        false
    }

    /// Makes the rates those on one side of each switching function, positive if `sides` is true, whatever the signs of the functions are.
    fn hold_sides(&mut self, _sides: &[bool]) {}

    /// Times in s at which functions of time in the rates change their form, increasing.
    fn breaks(&self) -> Vec<f64> {
        Vec::new()
    }

    /// Shortens the completed step so that it ends at the first event in it, if there is one.
    ///
    /// Events are looked for at the `times`, too.
    fn end_at_event(_stepper: &mut Stepper<Self>, _times: &InspectionTimes) -> Result<()>
    where
        Self: Sized,
    {
        Ok(())
    }

    /// Begins the next step after an event at the end of the last one, if there is one. Returns whether there is.
    fn begin_after_event(_stepper: &mut Stepper<Self>) -> Result<bool>
    where
        Self: Sized,
    {
        Ok(false)
    }

    /// Returns whether the current step ends at an event that ends the motion.
    fn has_ended(&self) -> bool {
        false
    }

    /// Returns whether an event may end the motion.
    fn may_end(&self) -> bool {
        false
    }

    /// Name of a component, for messages.
    fn name(&self, component: usize) -> String;

    /// The reason why no step from (`t`, `y`) succeeds, if the system has one.
    fn diagnose(&mut self, _t: f64, _y: &[f64]) -> Option<Error> {
        None
    }
}

/// Steps of one method for one system; it allocates only when it is created.
#[derive(Debug)]
pub struct Stepper<F> {
    /// Right-hand side of the system.
    pub rhs: F,
    /// Integration method.
    pub method: &'static Tableau,
    /// Distribution of the stages of the step.
    pub grading: Grading,
    /// Beginning and end of the step in s.
    pub t: [f64; 2],
    /// State at the beginning.
    pub old: Vec<f64>,
    /// State at the end.
    pub new: Vec<f64>,
    /// Evaluations of the system so far.
    pub evaluations: usize,
    slots: Vec<Vec<f64>>,
    stage: Vec<f64>,
    /// Time in s after the beginning of the step at which the rates there are evaluated, if it begins after an event.
    offset: f64,
    has_end: bool,
    is_dense: bool,
}

impl<F: OdeRhs> Stepper<F> {
    /// Stepper at the time `t` (s) in the state `y`.
    pub fn new(rhs: F, method: &'static Tableau, t: f64, y: Vec<f64>) -> Result<Self> {
        let size = y.len();
        let mut slots = vec![vec![0.0; size]; method.slots()];
        let mut rhs = rhs;
        rhs.rates(0, t, &y, &mut slots[0])?;
        let stage = y.clone();
        let (grading, has_end, is_dense) = (Grading::Even, false, false);
        Ok(Self {
            rhs,
            method,
            grading,
            t: [t; 2],
            new: y.clone(),
            old: y,
            evaluations: 1,
            slots,
            stage,
            offset: 0.0,
            has_end,
            is_dense,
        })
    }

    /// Length of the step in s.
    pub fn length(&self) -> f64 {
        self.t[1] - self.t[0]
    }

    /// Takes a trial step from the beginning to `end` (s).
    ///
    /// Returns its error in units of the tolerance, and the component with the largest error.
    pub fn attempt(&mut self, end: f64, tolerance: Option<&Tolerance>) -> Result<(f64, usize)> {
        self.t[1] = end;
        (self.has_end, self.is_dense) = (false, false);
        self.rhs.begin_step(self.t[0], &self.old)?;
        for slot in 1..self.method.end {
            self.evaluate(slot)?;
        }
        self.combine(self.method.end);
        self.new.copy_from_slice(&self.stage);
        let early = tolerance.filter(|_| !self.method.error_needs_end).map(|tolerance| self.error(tolerance));
        if let Some((error, component)) = early
            && !(error <= 1.0)
        {
            return Ok((error, component));
        }
        self.rhs.project(end, &mut self.new)?;
        self.rhs.rates(self.method.end, end, &self.new, &mut self.slots[self.method.end])?;
        self.evaluations += 1;
        self.has_end = true;
        Ok(early.or_else(|| tolerance.map(|tolerance| self.error(tolerance))).unwrap_or((0.0, 0)))
    }

    /// Begins the next step in the state `y` after an event. Functions that jump there have jumped after the time `offset` (s).
    pub(crate) fn restart(&mut self, y: &[f64], offset: f64) -> Result<()> {
        self.old.copy_from_slice(y);
        self.offset = offset;
        self.restart_rates()
    }

    /// Evaluates the rates at the beginning of the step again, which jump there or have derivatives that jump.
    pub(crate) fn restart_rates(&mut self) -> Result<()> {
        self.evaluations += 1;
        self.rhs.begin_step(self.t[0], &self.old)?;
        self.rhs.rates(0, self.t[0], &self.old, &mut self.slots[0])?;
        if self.offset == 0.0 {
            return Ok(());
        }
        let mut after = std::mem::take(&mut self.stage);
        let t = self.extrapolate(false, self.offset, &mut after);
        self.evaluations += 1;
        let evaluated = self.rhs.rates(0, t, &after, &mut self.slots[0]);
        self.stage = after;
        evaluated
    }

    /// Makes the end of the step the beginning of the next one.
    pub fn accept(&mut self) {
        debug_assert!(self.has_end, "only a complete step can be accepted");
        (self.t[0], self.offset) = (self.t[1], 0.0);
        std::mem::swap(&mut self.old, &mut self.new);
        self.slots.swap(0, self.method.end);
        (self.has_end, self.is_dense) = (false, false);
    }

    /// Rates at the end of the step, or at the start if no step was taken.
    pub(crate) fn rates_at_end(&self, is_step: bool) -> &[f64] {
        &self.slots[if is_step { self.method.end } else { 0 }]
    }

    /// Sets time, state and rates to those in `row`: the end of a step, or the beginning of one.
    pub(crate) fn put(&mut self, row: &[f64], is_end: bool) {
        let (state, rates) = row[1..=2 * self.old.len()].split_at(self.old.len());
        self.t = [row[0]; 2];
        self.new.copy_from_slice(state);
        self.old.copy_from_slice(state);
        self.slots[if is_end { self.method.end } else { 0 }].copy_from_slice(rates);
        (self.has_end, self.is_dense) = (is_end, false);
    }

    /// Evaluates the slots of dense output, once per step. Returns whether they were not evaluated before.
    pub fn make_dense(&mut self) -> Result<bool> {
        if self.is_dense {
            return Ok(false);
        }
        for slot in self.method.end + 1..self.method.slots() {
            self.evaluate(slot)?;
        }
        self.is_dense = true;
        Ok(true)
    }

    /// The state at time `t` inside the step, after [`Stepper::make_dense`].
    pub fn interpolate(&self, t: f64, y: &mut [f64]) {
        let h = self.length();
        let weights = self.method.graded_dense_weights((t - self.t[0]) / h, self.grading);
        for ((y, old), new) in y.iter_mut().zip(&self.old).zip(&self.new) {
            *y = old + weights.change * (new - old);
        }
        for (slot, weight) in self.slots.iter().zip(weights.slots).filter(|(_, weight)| *weight != 0.0) {
            y.iter_mut().zip(slot).for_each(|(y, k)| *y += h * weight * k);
        }
    }

    /// The rates of dense output at time `t` inside the step, after [`Stepper::make_dense`].
    pub(crate) fn interpolate_rates(&self, t: f64, rates: &mut [f64]) {
        let h = self.length();
        let weights = self.method.graded_dense_weights(Jet2::new((t - self.t[0]) / h, 1.0, 0.0), self.grading);
        for ((rate, old), new) in rates.iter_mut().zip(&self.old).zip(&self.new) {
            *rate = weights.change.v1 / h * (new - old);
        }
        for (slot, weight) in self.slots.iter().zip(weights.slots).filter(|(_, weight)| weight.v1 != 0.0) {
            rates.iter_mut().zip(slot).for_each(|(rate, k)| *rate += weight.v1 * k);
        }
    }

    /// Writes the state at the fraction `x` of the step by Hermite's cubic, without further evaluations.
    pub(crate) fn interpolate_coarsely(&self, x: f64, y: &mut [f64]) {
        let (h, x1) = (self.length(), 1.0 - x);
        let [first, last] = [&self.slots[0], &self.slots[self.method.end]];
        let [v0, v1] = [x1 * x1 * (1.0 + 2.0 * x), x * x * (1.0 + 2.0 * x1)];
        let [r0, r1] = [h * x * x1 * x1, -h * x * x * x1];
        for (i, y) in y.iter_mut().enumerate() {
            *y = v0 * self.old[i] + v1 * self.new[i] + r0 * first[i] + r1 * last[i];
        }
    }

    /// Writes the time in s after the end (`is_end`) or the beginning of the step, and the state there by the present rates.
    pub(crate) fn extrapolate(&self, is_end: bool, after: f64, y: &mut [f64]) -> f64 {
        let (t, state, rates) = match is_end {
            true => (self.t[1], &self.new, &self.slots[self.method.end]),
            false => (self.t[0], &self.old, &self.slots[0]),
        };
        y.iter_mut().zip(state).zip(rates).for_each(|((y, state), rate)| *y = state + after * rate);
        t + after
    }

    /// Length of the first step in s, estimated from the first and second derivative.
    ///
    /// # Sources
    ///
    /// Hairer, Nørsett & Wanner, *Solving Ordinary Differential Equations I*, 2nd ed. (1993), Section II.4.
    pub fn first_step(&mut self, tolerance: &Tolerance) -> Result<f64> {
        let size = |x: &[f64], y: &[f64]| {
            let scaled = x.iter().zip(y).enumerate().map(|(i, (x, y))| (x / tolerance.at(i, y.abs())).powi(2));
            (scaled.sum::<f64>() / x.len().max(1) as f64).sqrt()
        };
        let (state, rate) = (size(&self.old, &self.old), size(&self.slots[0], &self.old));
        let guess = if state < 1e-5 || rate < 1e-5 { 1e-6 } else { 0.01 * state / rate };
        for ((stage, y), k) in self.stage.iter_mut().zip(&self.old).zip(&self.slots[0]) {
            *stage = y + guess * k;
        }
        self.rhs.rates(1, self.t[0] + guess, &self.stage, &mut self.slots[1])?;
        self.evaluations += 1;
        let changes = self.stage.iter_mut().zip(&self.slots[1]).zip(&self.slots[0]);
        changes.for_each(|((stage, new), old)| *stage = new - old);
        let second_rate = size(&self.stage, &self.old) / guess;
        let largest = rate.max(second_rate);
        let step = if largest <= 1e-15 { (guess * 1e-3).max(1e-6) } else { (0.01 / largest).powf(self.exponent()) };
        Ok(step.min(100.0 * guess))
    }

    /// One over the order of the local error: the exponent of step control.
    pub fn exponent(&self) -> f64 {
        1.0 / f64::from(self.method.error_order + 1)
    }

    /// Evaluates the derivative of a slot.
    fn evaluate(&mut self, slot: usize) -> Result<()> {
        self.combine(slot);
        let t = self.t[0] + self.grading.fraction(self.method.nodes[slot]) * self.length();
        self.evaluations += 1;
        self.rhs.rates(slot, t, &self.stage, &mut self.slots[slot])
    }

    /// Writes the state at which a slot is evaluated to `stage`.
    fn combine(&mut self, slot: usize) {
        self.method.combine(slot, (self.length(), self.grading), &self.old, |j| &self.slots[j], &mut self.stage);
    }

    /// Error estimate in units of the tolerance, and the component with the largest error.
    fn error(&self, tolerance: &Tolerance) -> (f64, usize) {
        let (h, mut sums, mut worst) = (self.length(), [0.0; 2], (0.0, 0));
        for i in 0..self.old.len() {
            let scale = tolerance.at(i, self.old[i].abs().max(self.new[i].abs()));
            for (sum, row) in sums.iter_mut().zip(self.method.errors) {
                let weights = row.iter().map(|&(j, weight)| (j, weight * self.grading.slope(self.method.nodes[j])));
                let error: f64 = weights.map(|(j, weight)| weight * self.slots[j][i]).sum::<f64>() / scale;
                *sum += error * error;
                if error.abs() > worst.0 || error.is_nan() {
                    worst = (error.abs(), i);
                }
            }
        }
        let count = self.old.len().max(1) as f64;
        let error = match self.method.errors.len() {
            1 => h * (sums[0] / count).sqrt(),
            // The estimates of a graded step are of other orders than those whose ratio gives the order of the method.
            _ if self.grading != Grading::Even => h * (sums[0] / count).sqrt(),
            _ if sums[0] == 0.0 => 0.0,
            _ => h * sums[0] / (count * (sums[0] + 0.01 * sums[1])).sqrt(),
        };
        (error, worst.1)
    }
}
