//! Solutions that are known from elsewhere.

/// Where a solution was found.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Origin {
    /// In print, with the digits given there or more.
    Published,
    /// In closed form, or by optimizers to tight tolerance; not in print.
    Computed,
}

/// A solution that is known from elsewhere.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Optimum {
    /// The objective there, in its unit.
    pub objective: f64,
    /// The design, in the order of the problem's variables; none where it is not unique, not known or too long to print.
    pub design: Option<&'static [f64]>,
    /// Whether it is in print.
    pub origin: Origin,
    /// Relative uncertainty of the objective: what its digits leave open.
    pub uncertainty: f64,
    /// Who found it, and where.
    pub source: &'static str,
}

impl Optimum {
    /// A published solution, known to eight digits or so.
    pub const fn published(objective: f64, design: &'static [f64], source: &'static str) -> Self {
        Self { objective, design: Some(design), origin: Origin::Published, uncertainty: 0.0, source }
    }

    /// A solution found by other optimizers.
    pub const fn computed(objective: f64, design: &'static [f64], source: &'static str) -> Self {
        Self { origin: Origin::Computed, ..Self::published(objective, design, source) }
    }

    /// The same, known to this relative accuracy only.
    #[must_use]
    pub const fn within(self, uncertainty: f64) -> Self {
        Self { uncertainty, ..self }
    }

    /// The same without a design: it is not unique, not known or too long to print.
    #[must_use]
    pub const fn of_any_design(self) -> Self {
        Self { design: None, ..self }
    }

    /// (F − F*) / |F*|: how far an objective is above this one, relative to it; in its unit if F* is zero.
    pub fn excess(&self, objective: f64) -> f64 {
        let scale = if self.objective == 0.0 { 1.0 } else { self.objective.abs() };
        (objective - self.objective) / scale
    }
}
