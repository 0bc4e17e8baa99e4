//! Where responses come from.

#[cfg(feature = "mechanics")]
pub mod mechanism;
