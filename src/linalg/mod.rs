//! Factorizations of the matrices that mechanisms make: sparse, unsymmetric, of one pattern all along.
//!
//! A mechanism's equations couple only what its joints and beams connect. Numbered along the connections
//! ([`bandwidth_order`]) the matrix is a narrow band, and a banded factorization ([`Banded`]) is cheaper than a general
//! sparse one up to the size where the band becomes wide; then [`Sparse`] takes over. [`Factor`] chooses.

mod banded;
mod factor;
mod ordering;
mod sparse;

pub use banded::Banded;
pub use factor::{Factor, Singular, SolveRoom};
pub use ordering::bandwidth_order;
pub use sparse::Sparse;
