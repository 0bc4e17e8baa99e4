//! Outputs of a mechanism, or of a differential equation, as responses of an optimization problem.

mod check;
mod instants;
mod trajectory;
mod transient;

pub use check::{Study, check_model};
pub use instants::{Balanced, Driven, Instants};
pub use trajectory::{Evolution, Trajectory};
pub use transient::{Integration, Transient};

use crate::problem::Instant;
use mechanics::derivatives::history::SensitiveHistory;
use nalgebra::DMatrix;

/// Gradients of the wanted responses, one in each row; `places` are the indices of their times in the history.
fn gradient_rows(history: &SensitiveHistory, variables: usize, wanted: &[Instant], places: &[usize]) -> DMatrix<f64> {
    let row = |(instant, &place): (&Instant, &usize)| history.slopes[instant.response][place].iter().copied();
    DMatrix::from_row_iterator(wanted.len(), variables, wanted.iter().zip(places).flat_map(row))
}
