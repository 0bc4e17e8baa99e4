//! Which time points of a time-dependent constraint are kept.

/// The time points of a constraint history that enter the approximate problem.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Selection {
    /// The full grid (equation 5), those above the cut-off.
    All,
    /// Local maxima above the cut-off, with this many time points before and after each that are above it too, and
    /// the first and the last time point whenever they are above it. `NearMaxima(0)` keeps critical time points
    /// alone (equation 8); the paper uses two neighbours (Section 4).
    NearMaxima(usize),
}
