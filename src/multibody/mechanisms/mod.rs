//! Reference mechanisms.

pub mod four_bar;

pub use four_bar::FourBar;
