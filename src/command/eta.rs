//! Estimated number of cycles to the end of a run.

use linkwright::sao::{RunState, Stop};

/// Number of accepted cycles whose progress is extrapolated.
const LAST: usize = 4;

/// Remaining cycles.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct RemainingCycles {
    /// Estimate at the current rate of decrease; `None` if the residuals do not decrease.
    pub estimate: Option<usize>,
    /// Upper limit: the cycles left of `max_cycles`.
    pub limit: usize,
}

impl RemainingCycles {
    /// Estimates from the changes of the objective over the last accepted cycles, and the violations.
    pub fn new(state: &RunState, stop: &Stop) -> Self {
        let last = state.history.iter().rev().filter(|c| c.accepted).take(LAST + 1);
        let mut accepted: Vec<[f64; 2]> = last.map(|c| [c.objective, c.violation_pct.max(0.0) / 100.0]).collect();
        accepted.reverse();
        let residuals: Vec<f64> = accepted.windows(2).map(|w| stop_residual(w[0][0], w[1])).collect();
        let limit = stop.max_cycles.saturating_sub(state.history.len() - 1);
        Self { estimate: cycles_to(&residuals, stop.accuracy).map(|n| n.min(limit)), limit }
    }
}

/// The quantity that the stop test compares with the accuracy: relative change of the objective, or violation.
fn stop_residual(before: f64, [objective, violation]: [f64; 2]) -> f64 {
    ((objective - before).abs() / objective.abs().max(f64::MIN_POSITIVE)).max(violation)
}

/// Further cycles until a geometrically decreasing sequence is below `accuracy`.
fn cycles_to(residuals: &[f64], accuracy: f64) -> Option<usize> {
    let last = &residuals[residuals.len().saturating_sub(LAST)..];
    let (first, now) = (*last.first()?, *last.last()?);
    if now <= accuracy {
        return Some(1);
    }
    let rate = (now / first).ln() / (last.len() - 1) as f64;
    let cycles = ((accuracy / now).ln() / rate).ceil();
    (rate < -0.05 && cycles.is_finite()).then_some(cycles as usize)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_geometric_sequence_is_extrapolated() {
        // 1, 0.1, 0.01: below 1.5e-5 after three more.
        assert_eq!(cycles_to(&[1.0, 0.1, 0.01], 1.5e-5), Some(3));
        assert_eq!(cycles_to(&[1.0, 1.0], 1e-5), None);
        assert_eq!(cycles_to(&[1.0], 1e-5), None);
        assert_eq!(cycles_to(&[], 1e-5), None);
        assert_eq!(cycles_to(&[1e-6], 1e-5), Some(1));
    }
}
