//! LU factorizations of sparse unsymmetric matrices with a fixed pattern.
//!
//! | type | method | used for |
//! |---|---|---|
//! | [`StaticOrderLu`] | no interchanges, minimum-fill order, operations determined once | most mechanisms: chains,
//! loops, beams |
//! | [`Banded`] | row interchanges in a band, numbered by [`reverse_cuthill_mckee`] | matrices with small pivots and a narrow band |
//! | [`Sparse`] | faer's sparse LU, COLAMD, partial pivoting | matrices with a wide band |
//! | [`Factor`] | chooses one of them, by the pattern and then by the pivots | [`System`](crate::system::System) |
//!
//! `benches/linear_solvers.rs` compares them for chains of 8 to 10 000 links.

pub(crate) mod banded;
pub(crate) mod determinant;
pub(crate) mod factor;
pub(crate) mod ordering;
pub(crate) mod redundancy;
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
