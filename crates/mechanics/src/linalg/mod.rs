//! Factorizations of the matrices that mechanisms make: sparse, unsymmetric, of one pattern all along.
//!
//! A mechanism's equations couple only what its joints and beams connect, and most of what is coupled has mass: then
//! [`Ordered`] eliminates without interchanges in an order of little fill. A matrix that wants interchanges gets them:
//! numbered along the connections ([`bandwidth_order`]) it is a narrow band ([`Banded`]), and where the band is wide
//! [`Sparse`] takes over. [`Factor`] chooses.

mod banded;
mod elimination;
mod factor;
mod ordered;
mod ordering;
mod sparse;
mod wide;

pub use banded::Banded;
pub use factor::{Factor, Singular, SolveRoom};
pub use ordered::Ordered;
pub use ordering::bandwidth_order;
pub use sparse::Sparse;
pub(crate) use wide::{Kernel, subtract, widely};
