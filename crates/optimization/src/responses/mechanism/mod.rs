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

use crate::problem::ResponseAt;
use mechanics::derivatives::history::SensitiveHistory;
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
