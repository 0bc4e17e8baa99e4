//! Direct coupling of optimizer and analysis: a program whose every evaluation is an analysis.

use super::{AnalyzedDesign, Evaluation, Problem, ResponseAt, RowId, Sensitivities};
use error::Result;
use nalgebra::DMatrix;
use nlp::{Gradients, Program, Values};
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Arc, Mutex};

/// The problem as one [`Program`]: every time point is a row, every evaluation is an analysis.
///
/// This is the classical coupling that sequential approximation is compared with. Rows read ĝ − 1 ≤ 0. Gradients at the
/// design that was analyzed last cost no second analysis. The row of a time point next to a local maximum of a constraint in continuous
/// time has the value and the gradient of the maximum.
pub struct DirectCoupling<'a> {
    problem: &'a Problem,
    rows: Vec<RowId>,
    wanted: Vec<ResponseAt>,
    bounds: (Vec<f64>, Vec<f64>),
    last: Mutex<Option<Arc<AnalyzedDesign>>>,
    analyses: AtomicUsize,
    sensitivity_analyses: AtomicUsize,
}

impl<'a> DirectCoupling<'a> {
    /// Couples a problem, with all its constraints at all their time points.
    pub fn new(problem: &'a Problem) -> Self {
        let rows: Vec<RowId> = problem.all_rows();
        let quantities = rows.iter().map(|r| (&problem.constraints[r.constraint].quantity, r.point));
        let all = quantities.chain([(&problem.objective.quantity, 0)]);
        let mut wanted: Vec<ResponseAt> = all.flat_map(|(q, p)| problem.responses_of(q, p)).collect();
        wanted.sort_unstable();
        wanted.dedup();
        let bounds = problem.variables.iter().map(|v| (v.lower, v.upper)).unzip();
        Self { problem, rows, wanted, bounds, last: None.into(), analyses: 0.into(), sensitivity_analyses: 0.into() }
    }

    /// The analysis at `x`; the last one is reused.
    fn analyzed(&self, x: &[f64]) -> Result<Arc<AnalyzedDesign>> {
        let last = || self.last.lock().expect("nothing panics under the lock");
        if let Some(last) = last().as_ref().filter(|last| last.design == x) {
            return Ok(last.clone());
        }
        self.analyses.fetch_add(1, Ordering::Relaxed);
        let fresh = Arc::new(self.problem.analyze_design(x)?);
        *last() = Some(fresh.clone());
        Ok(fresh)
    }

    fn values_of(&self, evaluation: &Evaluation) -> Values {
        let rows = self.rows.iter().map(|r| evaluation.residuals[r.constraint][r.point]).collect();
        Values { objective: evaluation.objective, rows }
    }

    /// The constraint and time point of row number `i`.
    pub fn row(&self, i: usize) -> RowId {
        self.rows[i]
    }

    /// Number of analyses so far.
    pub fn analyses(&self) -> usize {
        self.analyses.load(Ordering::Relaxed)
    }

    /// Number of sensitivity analyses so far.
    pub fn sensitivity_analyses(&self) -> usize {
        self.sensitivity_analyses.load(Ordering::Relaxed)
    }
}

impl Program for DirectCoupling<'_> {
    fn variables(&self) -> usize {
        self.problem.n()
    }
    fn rows(&self) -> usize {
        self.rows.len()
    }
    fn lower(&self) -> &[f64] {
        &self.bounds.0
    }
    fn upper(&self) -> &[f64] {
        &self.bounds.1
    }

    fn is_equality(&self, i: usize) -> bool {
        self.problem.constraints[self.rows[i].constraint].is_equality()
    }

    fn values(&self, x: &[f64]) -> Result<Values> {
        Ok(self.values_of(&self.analyzed(x)?.evaluation))
    }

    fn gradients(&self, x: &[f64]) -> Result<Gradients> {
        let (problem, n) = (self.problem, self.problem.n());
        let analyzed = self.analyzed(x)?;
        let AnalyzedDesign { responses, evaluation, .. } = &*analyzed;
        self.sensitivity_analyses.fetch_add(1, Ordering::Relaxed);
        let rows = problem.sensitivities(x, responses, &self.wanted)?;
        let sensitivities = Sensitivities { at: self.wanted.clone(), rows };
        let objective = problem.total_derivative(problem.objective.signed(), 0, x, responses, &sensitivities);
        let mut jacobian = DMatrix::zeros(self.rows.len(), n);
        for (i, row) in self.rows.iter().enumerate() {
            let slope = problem.residual_gradient(*row, evaluation.peak_of(*row), &analyzed, &sensitivities)?;
            (0..n).for_each(|k| jacobian[(i, k)] = slope[k]);
        }
        let values = self.values_of(evaluation);
        Ok(Gradients { values, objective, rows: jacobian })
    }
}
