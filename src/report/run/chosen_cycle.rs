//! Numbers and curves of the cycle that a reader of the page chooses.

use super::{OptimizationReport, ShownCycle, number};
use crate::report::outcome;
use crate::report::page::PageChoice;
use serde_json::json;

/// The curves of a figure, one for each shown cycle.
pub(super) struct CycleCurves {
    /// Name of the figure.
    pub figure: String,
    pub times: Vec<f64>,
    pub values: Vec<Vec<f64>>,
}

/// Largest size of all curves in bytes; beyond, they have fewer points.
const CURVES: usize = 80_000;
/// Size of a point.
const POINT: usize = 18;
/// Design variables in the line of a cycle; the table of the cycles has all.
const MOST: usize = 8;

impl OptimizationReport<'_> {
    /// The cycles that a reader can choose, with their curves.
    pub(super) fn choices(&self, curves: &[CycleCurves]) -> Vec<PageChoice> {
        let most = (CURVES / (POINT * self.cycles.len() * curves.len()).max(1)).max(10);
        let of = |k: usize| {
            let one = |all: &CycleCurves| {
                let stride = all.times.len().div_ceil(most);
                // The last point belongs to every curve.
                let last = all.times.len() - 1;
                let points = (0..last).step_by(stride).chain([last]);
                let digits = |v: f64| format!("{v:.4e}").parse::<f64>().unwrap_or(v);
                let points: Vec<[f64; 2]> = points.map(|p| [all.times[p], all.values[k][p]].map(digits)).collect();
                (all.figure.clone(), json!(points))
            };
            serde_json::Value::Object(curves.iter().map(one).collect())
        };
        let choice = |(k, shown): (usize, &ShownCycle<'_>)| PageChoice {
            number: shown.step.cycle,
            text: self.numbers(shown),
            curves: of(k),
        };
        self.cycles.iter().enumerate().map(choice).collect()
    }

    /// Objective, violation and design variables of a cycle in one line.
    fn numbers(&self, shown: &ShownCycle<'_>) -> String {
        let with_unit =
            |name: &str, value: f64, unit: &str| format!("{name} {} {unit}", number(value)).trim_end().to_owned();
        let objective = &self.problem.objective;
        let violation = outcome::violation(self.problem, shown.step)
            .map(|violation| format!("largest violation {} %", number(violation.max(0.0))));
        let variables = self.problem.variables.iter().zip(&shown.step.design).take(MOST);
        let variables = variables.map(|(variable, value)| with_unit(&variable.name, *value, &variable.unit));
        let objective = with_unit(&objective.name, shown.objective, &objective.unit);
        let all = [objective].into_iter().chain(violation).chain(variables);
        let more = self.problem.n().saturating_sub(MOST);
        let more = (more > 0).then(|| format!("{more} more variables in the table of the cycles"));
        all.chain(more).collect::<Vec<_>>().join(" · ")
    }
}
