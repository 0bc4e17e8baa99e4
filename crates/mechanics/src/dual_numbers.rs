//! Number types with derivatives in which mechanisms are evaluated, besides `f64`.

use autodiff::{DualVec, HyperDualVec, WIDTH};

/// A dual number with the derivatives with respect to one chunk of [`WIDTH`] design variables.
pub type Dual8 = DualVec<WIDTH>;

/// A dual number with four derivatives, for designs of at most four variables.
pub type Dual4 = DualVec<4>;

/// A hyper-dual number with first and second derivatives along four pairs of directions in the design space.
pub type HyperDual4 = HyperDualVec<4>;

pub use autodiff::Jet2;
