//! How long a run may still take.

use linkwright::sao::{State, Stop};

/// Accepted cycles whose progress is extrapolated.
const LAST: usize = 4;

/// Cycles to go.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Forecast {
    /// If what is left to settle goes on to shrink as it did; none while it does not shrink.
    pub likely: Option<usize>,
    /// If all cycles are used up.
    pub most: usize,
}

impl Forecast {
    /// From the changes of the objective over the last accepted cycles, and the violations there.
    pub fn of(state: &State, stop: &Stop) -> Self {
        let accepted: Vec<[f64; 2]> = state
            .history
            .iter()
            .filter(|c| c.accepted)
            .map(|c| [c.objective, c.violation_pct.max(0.0) / 100.0])
            .collect();
        let changes: Vec<f64> = accepted.windows(2).map(|w| unsettled(w[0][0], w[1])).collect();
        let most = stop.max_cycles.saturating_sub(state.history.len() - 1);
        Self { likely: cycles_to(&changes, stop.accuracy).map(|n| n.min(most)), most }
    }
}

/// What the stop test compares with the accuracy: relative change of the objective, or violation.
fn unsettled(before: f64, [objective, violation]: [f64; 2]) -> f64 {
    ((objective - before).abs() / objective.abs().max(f64::MIN_POSITIVE)).max(violation)
}

/// Further cycles until a sequence that shrinks geometrically is below `accuracy`.
fn cycles_to(changes: &[f64], accuracy: f64) -> Option<usize> {
    let last = &changes[changes.len().saturating_sub(LAST)..];
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
