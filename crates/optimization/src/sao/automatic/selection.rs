//! Selection of approximations by their prediction errors at analysed designs.

use super::candidates::{ApproximationKind, FittedApproximation};
use super::numbers::{ApproximatedValue, NumberGroup};
use nlp::Gradients;
use serde::{Deserialize, Serialize};

/// Score of another candidate, relative to that of the preferred one, below which it is used instead.
const HYSTERESIS: f64 = 0.8;
/// Quotient of a candidate in whose domain the design is not.
const OUTSIDE: f64 = 2.0;
/// Limits of a quotient.
const QUOTIENTS: [f64; 2] = [1e-6, 1e3];
/// Rounding error of a prediction, relative to value and change.
const ROUNDING: f64 = 1e-12;

/// Scores of the candidates: geometric means of their prediction errors relative to the linear one, where each error counts
/// half as much as the next.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub struct Scores {
    /// For each group of numbers, in order of [`ApproximationKind::ALL`].
    pub groups: Vec<(NumberGroup, [Option<f64>; 6])>,
    /// Of the Lagrangian by the selected candidates.
    #[serde(rename = "mixture")]
    pub selected: Option<f64>,
    /// Of the Lagrangian by linear responses and a BFGS matrix of the Lagrangian.
    pub lagrangian: Option<f64>,
}

impl Scores {
    /// The candidate for a group: that of symmetric rank-one updates, unless another one is clearly better.
    pub fn select(&self, group: NumberGroup) -> ApproximationKind {
        let preferred = ApproximationKind::Sr1;
        let Ok(k) = self.groups.binary_search_by_key(&group, |(g, _)| *g) else { return preferred };
        // Until it has a score, the preferred candidate has that of the linear one.
        let score = |c: ApproximationKind| {
            self.groups[k].1[c as usize].unwrap_or(if c == preferred { 1.0 } else { f64::INFINITY })
        };
        let best =
            ApproximationKind::ALL.into_iter().min_by(|a, b| score(*a).total_cmp(&score(*b))).unwrap_or(preferred);
        if score(best) < HYSTERESIS * score(preferred) { best } else { preferred }
    }

    /// True if the BFGS matrix of the Lagrangian predicts clearly better than the selected candidates.
    pub fn prefers_lagrangian(&self) -> bool {
        matches!((self.selected, self.lagrangian), (Some(selected), Some(whole)) if whole < HYSTERESIS * selected)
    }

    /// Updates the scores of a group by quotients.
    pub(super) fn update(&mut self, group: NumberGroup, quotients: [Option<f64>; 6]) {
        let k = match self.groups.binary_search_by_key(&group, |(g, _)| *g) {
            Ok(k) => k,
            Err(k) => {
                self.groups.insert(k, (group, [None; 6]));
                k
            }
        };
        self.groups[k].1.iter_mut().zip(quotients).for_each(|(score, q)| discount(score, q));
    }
}

/// S ← √(S q), or q if there is no score.
pub(super) fn discount(score: &mut Option<f64>, quotient: Option<f64>) {
    if let Some(q) = quotient {
        *score = Some(score.map_or(q, |s| (s * q).sqrt()));
    }
}

/// An analysed design, with which predictions are compared.
pub(super) struct Observation<'a> {
    pub design: &'a [f64],
    /// w of the errors of derivatives: ½ (|sⱼ| + ℓⱼ rms(s/ℓ)).
    pub weights: Vec<f64>,
    /// Numbers there in the order of the current design; gradients are empty where they are not known.
    pub numbers: Vec<(f64, Vec<f64>)>,
}

impl<'a> Observation<'a> {
    /// The observation at `design` after a step from `origin`.
    pub fn new(design: &'a [f64], origin: &[f64], lengths: &[f64], numbers: Vec<(f64, Vec<f64>)>) -> Self {
        let n = design.len() as f64;
        let step = |j: usize| (design[j] - origin[j]).abs();
        let mean = (lengths.iter().enumerate().map(|(j, l)| (step(j) / l).powi(2)).sum::<f64>() / n).sqrt();
        let weights = lengths.iter().enumerate().map(|(j, l)| 0.5 * (step(j) + l * mean)).collect();
        Self { design, weights, numbers }
    }

    /// Prediction error of a model of number `k`.
    fn error(&self, k: usize, model: &FittedApproximation) -> f64 {
        let (value, gradient) = &self.numbers[k];
        let off = (model.value(self.design) - value).abs();
        if gradient.is_empty() {
            return off;
        }
        off + weighted_difference(&model.gradient(self.design), gradient, &self.weights)
    }

    /// Rounding error of a prediction of `number`.
    fn noise(&self, number: &ApproximatedValue, origin: &[f64]) -> f64 {
        let change = |j: usize| (number.gradient[j] * (self.design[j] - origin[j])).abs();
        ROUNDING * (number.value.abs() + (0..origin.len()).map(change).sum::<f64>())
    }

    /// Quotients of all candidates of one group: errors of its numbers, over those of the linear candidates.
    ///
    /// `fit` returns a candidate of number `k`, and `members` are the indices of the numbers.
    pub fn quotients(
        &self,
        members: &[usize],
        current: (&[ApproximatedValue], &[f64]),
        fit: impl Fn(usize, ApproximationKind) -> Option<FittedApproximation>,
    ) -> [Option<f64>; 6] {
        let noise: f64 = members.iter().map(|&k| self.noise(&current.0[k], current.1)).sum();
        let linear: Vec<f64> = members
            .iter()
            .map(|&k| fit(k, ApproximationKind::Linear).map_or(0.0, |model| self.error(k, &model)))
            .collect();
        let reference = linear.iter().sum::<f64>() + noise;
        ApproximationKind::ALL.map(|candidate| {
            if candidate == ApproximationKind::Linear {
                return Some(1.0);
            }
            let (mut sum, mut is_fitted, mut is_defined) = (noise, false, true);
            for (&k, linear) in members.iter().zip(&linear) {
                match fit(k, candidate) {
                    None => sum += linear,
                    Some(model) => {
                        (is_fitted, is_defined) = (true, is_defined && model.is_defined(self.design));
                        sum += self.error(k, &model);
                    }
                }
            }
            is_fitted.then(|| quotient(sum, reference, is_defined))
        })
    }
}

/// Σ |aⱼ − bⱼ| wⱼ.
fn weighted_difference(a: &[f64], b: &[f64], weights: &[f64]) -> f64 {
    a.iter().zip(b).zip(weights).map(|((a, b), w)| (a - b).abs() * w).sum()
}

fn quotient(error: f64, reference: f64, is_defined: bool) -> f64 {
    let q = if is_defined { error / reference } else { OUTSIDE };
    if q.is_finite() { q.clamp(QUOTIENTS[0], QUOTIENTS[1]) } else { 1.0 }
}

/// The Lagrangian F + Σ λᵢ cᵢ at an analysed design, with its gradient if it is known.
pub(super) struct ObservedLagrangian {
    pub value: f64,
    pub gradient: Option<Vec<f64>>,
}

impl ObservedLagrangian {
    /// The prediction error of `predicted`, summed over the rows with `multipliers`.
    pub fn error(&self, predicted: &Gradients, multipliers: &[f64], weights: &[f64]) -> f64 {
        let rows = predicted.values.rows.iter().zip(multipliers).filter(|(_, λ)| **λ != 0.0);
        let value = predicted.values.objective + rows.map(|(c, λ)| c * λ).sum::<f64>();
        let off = (value - self.value).abs();
        let Some(gradient) = &self.gradient else { return off };
        let held = |j: usize| predicted.rows.column(j).iter().zip(multipliers).map(|(g, λ)| g * λ).sum::<f64>();
        let slope: Vec<f64> = (0..weights.len()).map(|j| predicted.objective[j] + held(j)).collect();
        off + weighted_difference(&slope, gradient, weights)
    }

    /// The quotient of two errors, the second one by the linear candidates.
    pub fn quotient(&self, error: f64, linear: f64, is_defined: bool) -> f64 {
        let noise = ROUNDING * self.value.abs();
        quotient(error + noise, linear + noise, is_defined)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn another_candidate_must_be_clearly_better() {
        let (group, mut scores) = (NumberGroup::Objective, Scores::default());
        assert_eq!(scores.select(group), ApproximationKind::Sr1);
        scores.update(group, [Some(1.0), Some(0.85), None, None, Some(1.0), None]);
        assert_eq!(scores.select(group), ApproximationKind::Sr1);
        scores.update(group, [Some(1.0), Some(0.1), None, None, Some(1.0), None]);
        assert_eq!(scores.select(group), ApproximationKind::Diagonal);
    }

    #[test]
    fn old_errors_count_half() {
        let mut score = None;
        [0.01, 1.0].into_iter().for_each(|q| discount(&mut score, Some(q)));
        assert_eq!(score, Some(0.1));
    }
}
