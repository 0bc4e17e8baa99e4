//! A problem by name, with its known solution and the group that it belongs to.

use super::Optimum;
use crate::problem::Problem;
use error::Result;

/// A problem with its known solution.
#[derive(Clone, Copy, Debug)]
#[non_exhaustive]
pub struct CatalogueEntry {
    /// Name on the command line: lower case with hyphens.
    pub name: &'static str,
    /// Description in a few words.
    pub title: &'static str,
    /// Author and publication.
    pub source: &'static str,
    /// Group of problems.
    pub suite: Suite,
    /// Builds the problem, start design included.
    pub build: fn() -> Result<Problem>,
    /// Builds the problem with another number of time points, where it has a formula for all times; its optima are those of
    /// [`build`](Self::build).
    pub on_points: Option<fn(usize) -> Result<Problem>>,
    /// Builds the problem with objective and rows given directly as functions of the design, where it has no time.
    pub explicit: Option<fn() -> Result<Problem>>,
    /// Known solution.
    pub solution: KnownSolution,
    /// True if a constraint depends on time.
    pub time_dependent: bool,
    /// True if an analysis takes more than some milliseconds; `compare --all` skips such problems.
    pub expensive: bool,
}

/// Solution of a problem: its known optima, or the reason why there are none.
#[derive(Clone, Copy, Debug)]
pub enum KnownSolution {
    /// The best one first, then local ones.
    Optima(&'static [Optimum]),
    /// No design is feasible.
    Infeasible,
    /// The objective has no lower limit in the feasible region.
    Unbounded,
}

impl CatalogueEntry {
    /// A cheap problem of the catalogue without time, without known optima.
    pub const fn new(
        name: &'static str,
        title: &'static str,
        source: &'static str,
        build: fn() -> Result<Problem>,
    ) -> Self {
        let (suite, solution) = (Suite::Catalogue, KnownSolution::Optima(&[]));
        let (time_dependent, expensive) = (false, false);
        Self { name, title, source, suite, build, on_points: None, explicit: None, solution, time_dependent, expensive }
    }

    /// Sets the known solution.
    #[must_use]
    pub const fn solved_by(self, solution: KnownSolution) -> Self {
        Self { solution, ..self }
    }

    /// Known optima: the best one first, then local ones; empty for a problem without optimum.
    pub const fn optima(&self) -> &'static [Optimum] {
        match self.solution {
            KnownSolution::Optima(optima) => optima,
            KnownSolution::Infeasible | KnownSolution::Unbounded => &[],
        }
    }

    /// Moves the problem to another suite.
    #[must_use]
    pub const fn of(self, suite: Suite) -> Self {
        Self { suite, ..self }
    }

    /// Marks a problem with constraints over time.
    #[must_use]
    pub const fn over_time(self) -> Self {
        Self { time_dependent: true, ..self }
    }

    /// Adds the problem with directly given functions.
    #[must_use]
    pub const fn explicitly(self, build: fn() -> Result<Problem>) -> Self {
        Self { explicit: Some(build), ..self }
    }

    /// Adds the number of time points as a parameter.
    #[must_use]
    pub const fn on_points(self, build: fn(usize) -> Result<Problem>) -> Self {
        Self { on_points: Some(build), ..self }
    }

    /// Marks a problem whose analysis takes more than some milliseconds.
    #[must_use]
    pub const fn expensive(self) -> Self {
        Self { expensive: true, ..self }
    }
}

/// Group of problems.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Suite {
    /// Mechanisms and structures of the [catalogue](super::catalogue()).
    Catalogue,
    /// Problems of Hock & Schittkowski (1981).
    HockSchittkowski,
    /// Problems that mislead optimizers.
    Adversarial,
    /// Semi-infinite problems and Chebyshev fits on a grid of 101 points.
    Time,
}
