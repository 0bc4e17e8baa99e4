//! Outputs of a mechanism, or of an ordinary differential equation, as responses of an optimization problem.

mod gradient_check;
mod modal;
mod ode;
mod quasi_static;
mod transient;

pub use gradient_check::{AnalysisSettings, check_model};
pub use modal::{ModalQuantity, ModalResponses, NaturalFrequency};
pub use ode::{OdeModel, OdeResponses};
pub use quasi_static::{InstantAnalysis, KinematicResponses, QuasiStaticResponses, StaticResponses};
pub use transient::{Integration, Transient};

use crate::Result;
use crate::problem::ResponseAt;
use autodiff::Scalar;
use mechanics::derivatives::history::SensitiveHistory;
use mechanics::mechanism::{Mechanism, ParametricMechanism};
use nalgebra::DMatrix;

/// Gradients of the wanted responses, one in each row; `places` are the indices of their times in the history.
fn gradient_rows(
    history: &SensitiveHistory,
    variables: usize,
    wanted: &[ResponseAt],
    places: &[usize],
) -> DMatrix<f64> {
    let row = |(at, &place): (&ResponseAt, &usize)| history.gradients[at.response][place].iter().copied();
    DMatrix::from_row_iterator(wanted.len(), variables, wanted.iter().zip(places).flat_map(row))
}

/// A mechanism of which only some outputs are differentiated: the others may have no derivatives, as those of reactions that redundant
/// constraints leave indeterminate.
struct WithWantedOutputs<'m, M> {
    model: &'m M,
    /// Numbers of the outputs.
    wanted: Vec<usize>,
}

impl<'m, M> WithWantedOutputs<'m, M> {
    fn new(model: &'m M, wanted: impl Iterator<Item = usize>) -> Self {
        let mut wanted: Vec<usize> = wanted.collect();
        wanted.sort_unstable();
        wanted.dedup();
        Self { model, wanted }
    }
}

impl<M: ParametricMechanism> ParametricMechanism for WithWantedOutputs<'_, M> {
    fn build<S: Scalar>(&self, b: &[S]) -> Result<Mechanism<S>> {
        let mut mechanism = self.model.build(b)?;
        mechanism.differentiate_only(|output| self.wanted.binary_search(&output).is_ok());
        Ok(mechanism)
    }
}
