//! Violation of the constraints along explicit steps.

use error::Seconds;
/// Largest violation of the constraints at the ends of explicit steps, after their projection.
///
/// The projection is one least-squares step for positions and one for velocities: what remains is of second order in the
/// error of the step.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ConstraintDrift {
    /// Largest |Φ| in m or rad.
    pub position: f64,
    /// Largest |Φ̇| in m/s or rad/s.
    pub velocity: f64,
    /// First time in s at which a violation exceeds [`NOTABLE`] times the largest position or velocity so far, and
    /// [`NEGLIGIBLE`], if it does.
    pub notable_from: Option<f64>,
    /// Largest position and velocity so far.
    sizes: [f64; 2],
    /// Time, violations, and largest position and velocity at the end of the last trial step, which may be rejected.
    trial: Option<(f64, [f64; 2], [f64; 2])>,
}

/// Fraction of the largest position or velocity above which a violation is worth a warning.
pub const NOTABLE: f64 = 1e-3;

/// Violation in m, rad, m/s or rad/s that is never worth a warning: rounding errors of a mechanism that stands still, or nearly so.
pub const NEGLIGIBLE: f64 = 1e-9;

impl ConstraintDrift {
    /// Records the violations Φ and Φ̇ at the time `t` (s) at the end of a trial step, with the positions and velocities there.
    pub(crate) fn set_trial(&mut self, t: f64, violations: [f64; 2], states: [&[f64]; 2]) {
        let largest = |state: &[f64]| state.iter().fold(0.0f64, |size, x| size.max(x.abs()));
        self.trial = Some((t, violations, states.map(largest)));
    }

    /// Adds the violations of the last trial step, which is accepted.
    pub(crate) fn accept(&mut self) {
        let Some((t, violations, sizes)) = self.trial.take() else { return };
        self.sizes.iter_mut().zip(sizes).for_each(|(size, new)| *size = size.max(new));
        // `f64::max` ignores NaN; a state that is not finite is an error elsewhere.
        (self.position, self.velocity) = (self.position.max(violations[0]), self.velocity.max(violations[1]));
        let limits = self.sizes.map(|size| NEGLIGIBLE.max(NOTABLE * size));
        let is_notable = violations.iter().zip(limits).any(|(violation, limit)| *violation > limit);
        if is_notable && self.notable_from.is_none() {
            self.notable_from = Some(t);
        }
    }

    /// A sentence about a violation that is worth a warning: how much, when, and what to do.
    pub fn warning(&self) -> Option<String> {
        let (from, Self { position, velocity, .. }) = (self.notable_from?, self);
        Some(format!(
            "the steps leave the constraints from t = {from} on: they are violated by up to {position:.3e} m or rad, their \
             rates by up to {velocity:.3e} m/s or rad/s. Take shorter steps, steps with a tolerance, or an implicit scheme.",
            from = Seconds(from)
        ))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_violation_is_compared_with_the_motion_and_with_rounding() {
        let warns = |violations: [f64; 2], velocity: f64| {
            let mut drift = ConstraintDrift::default();
            drift.set_trial(0.2, [1e9, 1e9], [&[0.5], &[1.0]]); // it is rejected
            drift.set_trial(0.3, violations, [&[0.5, -0.2], &[velocity]]);
            drift.accept();
            drift.warning().is_some()
        };
        assert!(!warns([1e-15, 9.9e-324], 0.0) && !warns([4e-4, 1e-3], 2.0));
        assert!(warns([6e-4, 0.0], 0.0) && warns([0.0, 3e-3], 2.0) && warns([0.0, 2e-9], 1e-8));
    }
}
