//! Known optima of problems.

/// Provenance of a known solution.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Provenance {
    /// Published, with the printed digits or more.
    Published,
    /// From a closed form, or from optimizers with tight tolerances; not published.
    Computed,
}

/// A known optimum of a problem.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Optimum {
    /// Optimal objective, in its unit.
    pub objective: f64,
    /// Optimal design, in the order of the variables; `None` if it is not unique, unknown or too long to print.
    pub design: Option<&'static [f64]>,
    /// Published or computed.
    pub provenance: Provenance,
    /// Relative uncertainty of the objective, from its number of digits.
    pub uncertainty: f64,
    /// Author and publication, or method of computation.
    pub source: &'static str,
}

impl Optimum {
    /// A published solution, known to about eight digits.
    pub const fn published(objective: f64, design: &'static [f64], source: &'static str) -> Self {
        Self { objective, design: Some(design), provenance: Provenance::Published, uncertainty: 0.0, source }
    }

    /// A computed solution.
    pub const fn computed(objective: f64, design: &'static [f64], source: &'static str) -> Self {
        Self { provenance: Provenance::Computed, ..Self::published(objective, design, source) }
    }

    /// Sets the relative uncertainty of the objective.
    #[must_use]
    pub const fn within(self, uncertainty: f64) -> Self {
        Self { uncertainty, ..self }
    }

    /// Removes the design, which is not unique, not known or too long to print.
    #[must_use]
    pub const fn of_any_design(self) -> Self {
        Self { design: None, ..self }
    }

    /// Relative excess (F − F*) / |F*| of an objective; absolute if F* is zero.
    pub fn excess(&self, objective: f64) -> f64 {
        let scale = if self.objective == 0.0 { 1.0 } else { self.objective.abs() };
        (objective - self.objective) / scale
    }
}
