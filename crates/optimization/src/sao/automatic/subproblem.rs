//! Proposed designs: the solution of the approximate problem of a cycle, and other designs with their prediction.

use super::acceptance::DesignMerit;
use super::cycle_context::{CycleContext, SurrogateKind};
use super::proposal::{Proposal, Purpose};
use super::surrogate::{BoxedSurrogate, Surrogate};
use crate::problem::RowId;
use crate::sao::Region;
use error::Result;
use nlp::{Curvature, KktResidual, Solution, Sqp, SubproblemSolver};

/// Fraction of the half width within which a variable counts as at its move limit.
const AT_LIMIT: f64 = 1e-3;
/// Largest fraction of a possible decrease of the violation that a restoration may leave, and of the distance to a move limit.
const LEFT: f64 = 0.01;

impl CycleContext<'_> {
    /// The box of the next step, inside the domain of a surrogate.
    pub(super) fn domain(&self, surrogate: &Surrogate) -> Region {
        let mut region = self.sides(&self.memory.widths);
        for j in 0..self.n() {
            let lower = surrogate.lower(j).min(self.state.design[j]);
            if lower > region.lower[j] {
                (region.lower[j], region.is_limit[j][0]) = (lower, true);
            }
        }
        region
    }

    /// Solves the surrogate in its box.
    pub(super) fn solve(&self, surrogate: &Surrogate, region: Region, restoration: Option<f64>) -> Result<Proposal> {
        let unit = |row: &RowId| self.units.rows[row.constraint];
        // The relaxation must exceed rounding errors, so that the relaxed rows are compatible, but not the possible gain of the rows.
        let relaxed = |t: f64| -> Vec<f64> {
            let relaxed = t + (1e-7 * t + 1e-10).min(LEFT * (self.violation - t));
            self.linearized.rows.iter().map(|r| unit(r) * relaxed).collect()
        };
        let relaxation = restoration.map(relaxed);
        let objective = self.state.evaluation.objective;
        let widths: Vec<f64> = (0..self.n())
            .map(|j| {
                let d = self.state.design[j];
                let reach = (region.upper[j] - d).max(d - region.lower[j]);
                if reach > 0.0 { reach } else { self.units.lengths[j] }
            })
            .collect();
        let sides = [&region.lower[..], &region.upper[..]];
        let program =
            BoxedSurrogate::new(surrogate, &widths, sides, &self.linearized.equality, relaxation.clone(), objective);
        let sqp = Sqp::default().with_curvature(Curvature::Absolute).with_iterations(self.settings.iterations)?;
        let solver = nlp::AutoSolver::default().with_sqp(sqp);
        let found = solver.solve(&program, &vec![1.0; self.n()])?;
        let design: Vec<f64> = program
            .design(&found.x)
            .into_iter()
            .zip(region.lower.iter().zip(&region.upper))
            .map(|(x, (l, u))| x.clamp(*l, *u))
            .collect();
        let values = surrogate.values(&design);
        let at_limit = self.at_limit(&design, &region, restoration);
        Ok(Proposal {
            predicted: self.merit(values.objective, &values.rows),
            restoration,
            purpose: Purpose::Improvement,
            at_limit,
            solution: Solution {
                x: design.clone(),
                objective: values.objective,
                multipliers: program.multipliers(&found.multipliers),
                rows: values.rows,
                relaxation: relaxation.map(|t| t.into_iter().fold(0.0, f64::max)),
                relaxed_rows: vec![],
                ..found
            },
            region,
            design,
        })
    }

    /// A proposed design that is not the solution of a subproblem, with the prediction of the linear surrogate.
    pub(super) fn with_linear_prediction(&self, design: Vec<f64>, region: Region, purpose: Purpose) -> Proposal {
        let surrogate = self.surrogate(SurrogateKind::Linear).expect("only the Lagrangian may be missing");
        let values = surrogate.values(&design);
        let mut predicted = self.merit(values.objective, &values.rows);
        if purpose != Purpose::Improvement {
            predicted.violation = f64::INFINITY;
        }
        let (from, lengths) = (&self.state.design, &self.units.lengths);
        let solution = Solution {
            x: design.clone(),
            objective: values.objective,
            multipliers: self.linearized.least_squares_multipliers(self.problem, from, lengths),
            rows: values.rows,
            lower_multipliers: vec![],
            upper_multipliers: vec![],
            iterations: 0,
            evaluations: nlp::Evaluations::default(),
            status: nlp::ProgramStatus::Relaxed,
            relaxation: None,
            relaxed_rows: vec![],
            kkt: KktResidual::default(),
        };
        let at_limit = self.at_limit(&design, &region, None);
        Proposal { design, region, at_limit, solution, restoration: None, predicted, purpose }
    }

    /// The merit with these values of the objective and the retained rows.
    pub(super) fn merit(&self, objective: f64, rows: &[f64]) -> DesignMerit {
        let mut violations = vec![f64::NEG_INFINITY; self.problem.constraints.len()];
        for ((row, c), equality) in self.linearized.rows.iter().zip(rows).zip(&self.linearized.equality) {
            let v = &mut violations[row.constraint];
            *v = v.max(if *equality { c.abs() } else { *c });
        }
        DesignMerit::new(objective, &violations, &self.units)
    }

    /// Marks the variables that are at a move limit.
    pub(super) fn at_limit(&self, design: &[f64], region: &Region, restoration: Option<f64>) -> Vec<bool> {
        let tolerance = if restoration.is_some() { 2.0 * LEFT } else { AT_LIMIT };
        let one = |j: usize| {
            let here = self.state.design[j];
            let near = tolerance * (region.upper[j] - here).max(here - region.lower[j]);
            (region.is_limit[j][0] && design[j] - region.lower[j] <= near)
                || (region.is_limit[j][1] && region.upper[j] - design[j] <= near)
        };
        (0..self.n()).map(one).collect()
    }
}
