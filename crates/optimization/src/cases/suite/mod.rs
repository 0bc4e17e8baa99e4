//! Suites of small problems with known solutions, for comparisons of methods.
//!
//! | file | contents |
//! |---|---|
//! | `hs_bounds`, `hs_inequalities`, `hs_equalities`, `hs_mixed`, `hs_larger`, `hs_applications` | problems of Hock & Schittkowski |
//! | `adversarial`, `starts`, `fits` | problems that mislead optimizers |
//! | `semi_infinite` | constraints on a parameter, Chebyshev fits |
//! | `statement` | statement of a problem, and the macro in which the lists are written |
//! | `transformation` | other units of objective, variables and constraints; other starts |
//! | `runs`, `verification` | runs of methods on the problems; verification of what they claim |
//!
//! # Sources
//!
//! Hock & Schittkowski, *Test Examples for Nonlinear Programming Codes* (1981). A start outside the bounds is moved to the nearest
//! bound.

mod adversarial;
mod fits;
mod hs_applications;
mod hs_bounds;
mod hs_equalities;
mod hs_inequalities;
mod hs_larger;
mod hs_mixed;
mod noise;
mod runs;
mod semi_infinite;
mod starts;
mod statement;
mod transformation;
mod verification;

pub use super::Suite;
pub use runs::{SuiteRun, run};
pub use transformation::{StartDesign, Transformation};
pub use verification::{Claim, TOLERANCE, Verdict, Verification, verify_claim};

use super::{CatalogueEntry, catalogue};
use error::{Error, Result};

impl Suite {
    /// The problems of the suite; of the catalogue those with a cheap analysis.
    pub fn problems(self) -> Vec<&'static CatalogueEntry> {
        problems().filter(|entry| entry.suite == self && !entry.expensive).collect()
    }
}

/// The lists, in the order in which they are shown.
const LISTS: [&[CatalogueEntry]; 11] = [
    hs_bounds::PROBLEMS,
    hs_inequalities::PROBLEMS,
    hs_equalities::PROBLEMS,
    hs_mixed::PROBLEMS,
    hs_larger::PROBLEMS,
    hs_applications::PROBLEMS,
    adversarial::PROBLEMS,
    adversarial::EXPLICIT,
    starts::PROBLEMS,
    fits::PROBLEMS,
    semi_infinite::PROBLEMS,
];

/// The problems of all suites, those of the catalogue with an expensive analysis included.
pub fn problems() -> impl Iterator<Item = &'static CatalogueEntry> {
    catalogue().iter().chain(LISTS.into_iter().flatten())
}

/// Finds a problem of the catalogue or of a suite by name.
///
/// # Errors
/// [`Error::Definition`] with the nearest names if there is no such problem.
pub fn find(name: &str) -> Result<&'static CatalogueEntry> {
    let known = || Error::unknown("problem", name, problems().map(|entry| entry.name));
    problems().find(|entry| entry.name == name).ok_or_else(known)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cases::{KnownSolution, Optimum};

    #[test]
    fn an_unknown_name_is_answered_with_the_nearest_ones() {
        assert_eq!(find("slider-crank").unwrap().name, "slider-crank");
        let message = find("slider-krank").unwrap_err().to_string();
        assert!(message.contains("`slider-krank`") && message.contains("try `slider-crank`"), "{message}");
        assert!(find("comfort").unwrap_err().to_string().contains("try `impact-absorber-comfort`"));
    }

    #[test]
    fn names_are_unique_and_entries_describe_their_problems() {
        let mut names: Vec<&str> = problems().map(|e| e.name).collect();
        names.sort_unstable();
        names.dedup();
        assert_eq!(names.len(), problems().count());
        for entry in problems() {
            let problem = (entry.build)().unwrap();
            let over_time = problem.constraints.iter().any(|c| c.quantity.is_transient());
            assert_eq!(over_time, entry.time_dependent, "{}", entry.name);
            let fits = |o: &Optimum| o.design.is_none_or(|d| d.len() == problem.n());
            assert!(entry.optima().iter().all(fits), "{}", entry.name);
        }
    }

    /// The published digits of some optima; a few have seven.
    const DIGITS: f64 = 2e-6;

    #[test]
    fn published_optima_are_feasible_and_have_their_objectives() {
        for entry in problems().filter(|e| e.suite != Suite::Catalogue) {
            let problem = (entry.build)().unwrap();
            for optimum in entry.optima() {
                let design = optimum.design.unwrap();
                let found =
                    verify_claim(entry, &Transformation::default(), &problem, Claim::Converged, design).unwrap();
                assert!(found.violation < DIGITS, "{}: violation {:e}", entry.name, found.violation);
                let apart = (found.objective - optimum.objective).abs() / optimum.objective.abs().max(1.0);
                assert!(apart < DIGITS, "{}: F = {} at {}", entry.name, found.objective, optimum.objective);
                assert!(found.verdict.is_solved(), "{}: {found:?}", entry.name);
            }
            assert_eq!(
                entry.optima().is_empty(),
                !matches!(entry.solution, KnownSolution::Optima(_)),
                "{}",
                entry.name
            );
        }
    }
}
