//! Conservative approximations: the inner loop of GCMMA.

use super::{Globalization, GlobalizationState, StepVerdict, Trial};
use crate::problem::{Evaluation, Problem};
use error::{Error, Result};

/// Accepts a design if the approximations of the objective and of all retained rows are not below the analysed values.
///
/// Otherwise the cycle is repeated from the same design without new sensitivities. ρᵢ w(b) with w = ½ Σ (Δbₖ/scaleₖ)²
/// is added to each approximation i that was too low. With the shortfall δᵢ = (fᵢ − f̃ᵢ)/w,
///
/// $$ ρ_i \leftarrow \min\{ 10 ρ_i,\ 1.1 (ρ_i + δ_i) \} , $$
///
/// where the limit 10 ρᵢ does not apply to the first increase from [`least`](Self::least). After an accepted design
/// ρᵢ ← max(0.1 ρᵢ, least). With a feasible start, every accepted design is feasible and the
/// objective decreases.
///
/// # Units
///
/// ρ has the unit of the objective for i = 0; rows are normalized. The least ρ of the objective is `least` × its
/// value at the start. Equality rows are not considered.
///
/// # Sources
///
/// Svanberg, *SIAM J. Optim.* 12 (2002) 555–573, section 4. We differ: the lengths in w are fixed for the run, and
/// the first increase is not limited.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Conservatism {
    /// Smallest ρ; positive.
    pub least: f64,
    /// Tolerated shortfall, relative to the value of the objective or as a fraction of a limit.
    pub tolerance: f64,
    /// Largest ρ, in the same units; a cycle that needs more is repeated with other move limits instead.
    pub most: f64,
}

impl Default for Conservatism {
    fn default() -> Self {
        Self { least: 1e-6, tolerance: 1e-7, most: 1e8 }
    }
}

impl Conservatism {
    /// The conservatism at a start design.
    pub(super) fn initial(&self, problem: &Problem, first: &Evaluation) -> GlobalizationState {
        let objective = self.least * unit(first.objective);
        let rows = std::iter::repeat_n(self.least, problem.constraints.len());
        GlobalizationState { conservatism: std::iter::once(objective).chain(rows).collect(), ..Default::default() }
    }

    /// True if no approximation was too low.
    pub(super) fn is_conservative(&self, trial: &Trial) -> bool {
        let Some(outcome) = &trial.outcome else { return false };
        (0..outcome.shortfall.len()).all(|i| outcome.shortfall[i] <= self.tolerance * scale(trial, i))
    }

    /// Increases the conservatism of approximations that were too low; [`StepVerdict::Reject`] beyond the largest conservatism.
    pub(super) fn increase(&self, trial: &Trial, state: &mut GlobalizationState) -> StepVerdict {
        let Some(outcome) = &trial.outcome else { return StepVerdict::Reject };
        for (i, rho) in state.conservatism.iter_mut().enumerate() {
            let unit = scale(trial, i);
            if outcome.shortfall[i] > self.tolerance * unit {
                let wanted = 1.1 * (*rho + outcome.shortfall[i] / trial.distance);
                let capped = if *rho > 2.0 * self.least * unit { wanted.min(10.0 * *rho) } else { wanted };
                if !(capped < self.most * unit) {
                    return StepVerdict::Reject;
                }
                *rho = capped;
            }
        }
        StepVerdict::IncreaseConservatism
    }

    /// Reduces the conservatism after an accepted design.
    pub(super) fn relax(&self, trial: &Trial, state: &mut GlobalizationState) {
        for (i, rho) in state.conservatism.iter_mut().enumerate() {
            *rho = (0.1 * *rho).max(self.least * scale(trial, i));
        }
    }
}

/// The unit in which function i is measured: the objective's own value, 1 for a normalized row.
fn scale(trial: &Trial, i: usize) -> f64 {
    if i == 0 { unit(trial.objective_before) } else { 1.0 }
}

fn unit(objective: f64) -> f64 {
    if objective == 0.0 { 1.0 } else { objective.abs() }
}

impl Globalization for Conservatism {
    fn check(&self) -> Result<()> {
        Error::check_option("least conservatism", "positive", self.least, self.least > 0.0)?;
        Error::check_option("largest conservatism", "above the least", self.most, self.most > self.least)?;
        Error::check_option("tolerance of conservatism", "at least 0", self.tolerance, self.tolerance >= 0.0)
    }

    fn keeps_feasible(&self) -> bool {
        true
    }

    fn start(&self, problem: &Problem, first: &Evaluation) -> GlobalizationState {
        self.initial(problem, first)
    }

    fn judge(&self, trial: &Trial, state: &mut GlobalizationState) -> StepVerdict {
        if self.is_conservative(trial) {
            self.relax(trial, state);
            return StepVerdict::Accept;
        }
        self.increase(trial, state)
    }
}
