//! Responses whose derivatives are taken along with the motion, once.

use super::{SensitiveHistory, Transient, differentiate};
use crate::Result;
use crate::analysis::Dynamics;
use crate::multibody::Model;
use crate::problem::{Analysis, Instant, Responses};
use nalgebra::DMatrix;
use std::sync::Arc;

/// As [`Transient`], but every analysis differentiates its outputs along with the motion and leaves the derivatives in
/// [`Responses::trace`], where asking for sensitivities finds them.
///
/// Derivatives along with a motion cost much less than the motion, those after it the motion once more. This pays where
/// most designs that are analysed are differentiated too, as in an optimization with few rejected tries. Without a
/// trace, as after a restart, the motion is integrated again.
pub struct Along<M> {
    transient: Transient<M>,
    settings: Dynamics,
    times: Vec<f64>,
}

impl<M: Model> Along<M> {
    /// For the outputs of `model` at `times` (s, increasing).
    ///
    /// **Errors.** As [`Transient::new`].
    pub fn new(model: M, settings: Dynamics, times: &[f64]) -> Result<Self> {
        Ok(Self { transient: Transient::new(model, settings, times)?, settings, times: times.to_vec() })
    }
}

/// What an analysis leaves behind: the design, and the derivatives there.
struct Trace {
    design: Vec<f64>,
    history: SensitiveHistory,
}

impl<M: Model> Analysis for Along<M> {
    fn analyze(&self, b: &[f64]) -> Result<Responses> {
        let history = differentiate(self.transient.model(), b, &self.settings, &self.times)?;
        let values = history.values.clone();
        Ok(Responses { values, trace: Some(Arc::new(Trace { design: b.to_vec(), history })) })
    }

    fn sensitivities(&self, b: &[f64], responses: &Responses, wanted: &[Instant]) -> Result<DMatrix<f64>> {
        let trace = responses.trace.as_ref().and_then(|trace| trace.downcast_ref::<Trace>());
        let Some(Trace { history, .. }) = trace.filter(|trace| trace.design == b) else {
            return self.transient.sensitivities(b, responses, wanted);
        };
        let row = |i: &Instant| history.slopes[i.response][i.point].iter().copied();
        Ok(DMatrix::from_row_iterator(wanted.len(), b.len(), wanted.iter().flat_map(row)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::multibody::mechanisms::FourBar;

    #[test]
    fn with_and_without_a_trace_the_derivatives_are_the_same() {
        let (model, times) = (FourBar::as_published(), [0.1, 0.11]);
        let settings = model.dynamics().unwrap();
        let along = Along::new(model, settings, &times).unwrap();
        let b = [0.0385, 0.0252, 0.02];
        let responses = along.analyze(&b).unwrap();
        let plain = Transient::new(model, settings, &times).unwrap().analyze(&b).unwrap();
        assert_eq!(responses.values, plain.values);
        let wanted = [Instant { response: 10, point: 1 }, Instant { response: 0, point: 0 }];
        let found = along.sensitivities(&b, &responses, &wanted).unwrap();
        assert_eq!(found, along.sensitivities(&b, &plain, &wanted).unwrap());
        // A trace of another design is not taken for this one's.
        let other = [0.04, 0.0252, 0.02];
        assert_ne!(found, along.sensitivities(&other, &responses, &wanted).unwrap());
    }
}
