//! An end for motions that need ever shorter steps.

use crate::Error;

/// Time steps of a run; one that takes more would never end, or fill the memory before.
pub(crate) const MOST_STEPS: usize = 20_000_000;

/// What is said of it.
pub(crate) fn too_many_steps(t: f64) -> Error {
    let why = format!("{MOST_STEPS} time steps have come to t = {t:.6e} s only");
    Error::analysis("the integration", why, "loosen the tolerance, take longer steps, or end sooner")
}
