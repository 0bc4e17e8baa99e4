//! Problems of the field with their data, optimum and source: to test with, to compare on, to learn from.

#[cfg(feature = "multibody")]
pub mod four_bar;
pub mod impact_absorber;
pub mod slider_crank;

/// A solution that is known from elsewhere.
#[derive(Clone, Debug, PartialEq)]
pub struct Optimum {
    /// The design, in the order of the problem's variables.
    pub design: Vec<f64>,
    /// The objective there.
    pub objective: f64,
    /// Who found it, and where.
    pub source: &'static str,
}
