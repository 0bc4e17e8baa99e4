//! Factorizations of the matrices that mechanisms make: sparse, unsymmetric, of one pattern all along.
//!
//! A mechanism's equations couple only what its joints and beams connect, and most of what is coupled has mass: then
//! [`StaticOrderLu`] eliminates without interchanges in an order of little fill. A matrix that wants interchanges gets them:
//! numbered along the connections ([`reverse_cuthill_mckee`]) it is a narrow band ([`Banded`]), and where the band is wide
//! [`Sparse`] takes over. [`Factor`] chooses.

pub(crate) mod banded;
pub(crate) mod elimination;
pub(crate) mod factor;
pub(crate) mod ordering;
pub(crate) mod simd;
pub(crate) mod sparse;
pub(crate) mod static_order;

pub use banded::Banded;
pub use factor::Factor;
pub use factor::Singular;
pub use factor::SolveWorkspace;
pub use ordering::reverse_cuthill_mckee;
pub use sparse::Sparse;
pub use static_order::StaticOrderLu;
