//! Outputs of a mechanism, or of a differential equation, as responses of an optimization problem.

mod check;
mod instants;
mod trajectory;
mod transient;

pub use check::{AnalysisSettings, check_model};
pub use instants::{KinematicResponses, QuasiStaticResponses, StaticResponses};
pub use trajectory::{OdeModel, OdeResponses};
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
    let row = |(instant, &place): (&ResponseAt, &usize)| history.gradients[instant.response][place].iter().copied();
    DMatrix::from_row_iterator(wanted.len(), variables, wanted.iter().zip(places).flat_map(row))
}
