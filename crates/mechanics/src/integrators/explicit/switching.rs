//! Adaptive steps that end where the rates are not smooth: where a contact closes or opens.

use crate::Result;
use crate::integrators::explicit::stepper::{OdeRhs, Stepper};

/// Signs of the switching functions along a motion.
///
/// A step across a point where the rates are not smooth loses the order of the method, in values and still more in their
/// derivatives, which have one smooth derivative less. A step that ends there loses nothing: in the designs around, the
/// part of the step on the other side is infinitely short, and the rates themselves are continuous.
#[derive(Clone, Debug, Default)]
pub(crate) struct SwitchLocator {
    /// For each function, true if it is positive at the end of the current step.
    pub sides: Vec<bool>,
    /// The function that changes its sign at the end of the current step.
    pub crossed: Option<usize>,
    values: Vec<f64>,
    y: Vec<f64>,
}

/// Fractions of a step at which signs are compared.
const SAMPLES: [f64; 4] = [0.25, 0.5, 0.75, 1.0];

/// Fraction of a step next to its ends at which a change of sign belongs to the end.
const AT_END: f64 = 1e-9;

/// Largest number of halvings in the search for a zero.
const MOST_TRIALS: usize = 80;

impl SwitchLocator {
    /// Locator at the start of a motion in the state `y`.
    pub fn new<F: OdeRhs>(rhs: &mut F, t: f64, y: &[f64]) -> Self {
        let mut locator = Self { y: y.to_vec(), ..Self::default() };
        rhs.switching_functions(t, y, &mut locator.values);
        locator.sides = locator.values.iter().map(|value| *value > 0.0).collect();
        locator
    }

    /// Shortens the completed step so that it ends at the first zero of a switching function, if there is one in it.
    pub fn end_step<F: OdeRhs>(&mut self, stepper: &mut Stepper<F>) -> Result<()> {
        self.crossed = None;
        if self.sides.is_empty() {
            return Ok(());
        }
        if self.is_crossed(stepper, AT_END, false) {
            self.store_sides(); // the zero at the beginning of the step, with the sign of rounding errors
        }
        let mut low = AT_END;
        for high in SAMPLES {
            if !self.is_crossed(stepper, high, false) {
                low = high;
                continue;
            }
            stepper.make_dense()?;
            let root = self.first_zero(stepper, low, high);
            self.is_crossed(stepper, (root + AT_END).min(1.0), true);
            self.crossed = self.values.iter().zip(&self.sides).position(|(value, side)| (*value > 0.0) != *side);
            self.store_sides();
            if root < 1.0 - AT_END {
                let [begin, end] = stepper.t;
                stepper.attempt(begin + root * (end - begin), None)?;
            }
            return Ok(());
        }
        Ok(())
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

    /// Returns whether a function has another sign at the fraction `x` of the step than at its beginning.
    fn is_crossed<F: OdeRhs>(&mut self, stepper: &mut Stepper<F>, x: f64, is_dense: bool) -> bool {
        let t = if x == 1.0 { stepper.t[1] } else { stepper.t[0] + x * stepper.length() };
        match (x == 1.0, is_dense) {
            (true, _) => self.y.copy_from_slice(&stepper.new),
            (_, true) => stepper.interpolate(t, &mut self.y),
            (_, false) => stepper.interpolate_coarsely(x, &mut self.y),
        }
        stepper.rhs.switching_functions(t, &self.y, &mut self.values);
        self.values.iter().zip(&self.sides).any(|(value, side)| (*value > 0.0) != *side)
    }

    /// Stores the signs of the last evaluation.
    fn store_sides(&mut self) {
        self.sides.iter_mut().zip(&self.values).for_each(|(side, value)| *side = *value > 0.0);
    }
}
