//! Every problem of the library by name, with its optima and sources.

use super::{Optimum, impact_absorber, slider_crank};
use crate::error::{Error, Result};
use crate::problem::Problem;

/// A problem of the field.
#[derive(Clone, Copy, Debug)]
pub struct Entry {
    /// Name on the command line: lower case with hyphens.
    pub name: &'static str,
    /// What it is, in a few words.
    pub title: &'static str,
    /// Who posed it, and where.
    pub source: &'static str,
    /// Makes the problem, start design included.
    pub build: fn() -> Result<Problem>,
    /// Known optima, the one to reach first; local ones behind it.
    pub optima: &'static [Optimum],
    /// Whether there are constraints over time.
    pub time_dependent: bool,
    /// Whether one analysis takes more than some milliseconds: left out where all problems are run.
    pub expensive: bool,
}

impl Entry {
    /// The known optimum whose objective is nearest to `objective`.
    pub fn nearest_optimum(&self, objective: f64) -> Option<&'static Optimum> {
        let apart = |o: &Optimum| o.excess(objective).abs();
        self.optima.iter().min_by(|a, b| apart(a).total_cmp(&apart(b)))
    }
}

/// All problems, in the order of their families.
pub fn catalogue() -> &'static [Entry] {
    ENTRIES
}

/// The problem of that name.
///
/// **Errors.** [`Error::Definition`] with the nearest names if there is none.
pub fn find(name: &str) -> Result<&'static Entry> {
    let known = || Error::unknown("problem", name, catalogue().iter().map(|entry| entry.name));
    catalogue().iter().find(|entry| entry.name == name).ok_or_else(known)
}

const PAPER: &str = "Etman, van Campen & Schoofs, Multibody Syst. Dyn. 2 (1998) 393-415";

static ENTRIES: &[Entry] = &[
    Entry {
        name: "impact-absorber",
        title: "impact absorber, least peak acceleration at 101 time points",
        source: PAPER,
        build: impact_absorber::peak_acceleration,
        optima: &[impact_absorber::peak_acceleration_optimum()],
        time_dependent: true,
        expensive: false,
    },
    Entry {
        name: "impact-absorber-comfort",
        title: "impact absorber, least mean square acceleration",
        source: PAPER,
        build: impact_absorber::comfort,
        optima: &[impact_absorber::comfort_optimum()],
        time_dependent: true,
        expensive: false,
    },
    Entry {
        name: "impact-absorber-continuous",
        title: "impact absorber, least peak acceleration at all times",
        source: PAPER,
        build: || Ok(impact_absorber::peak_acceleration()?.in_continuous_time()),
        optima: &[impact_absorber::continuous_peak_acceleration_optimum()],
        time_dependent: true,
        expensive: false,
    },
    Entry {
        name: "slider-crank",
        title: "slider-crank, path generation from the first stand-in start",
        source: "Paradis & Willmert 1983; Etman et al. 1998",
        build: || slider_crank::path_generation(slider_crank::STAND_IN_START),
        optima: &[slider_crank::optimum()],
        time_dependent: false,
        expensive: false,
    },
    Entry {
        name: "slider-crank-second",
        title: "slider-crank, path generation from the second stand-in start",
        source: "Paradis & Willmert 1983; Etman et al. 1998",
        build: || slider_crank::path_generation(slider_crank::SECOND_STAND_IN_START),
        optima: &[slider_crank::optimum()],
        time_dependent: false,
        expensive: false,
    },
    #[cfg(feature = "multibody")]
    Entry {
        name: "four-bar",
        title: "flexible four-bar with bounded stress, modelled as published",
        source: "Sohoni & Haug 1982; Etman et al. 1998",
        build: || super::four_bar::StressConstrained::as_published().problem(),
        optima: &super::four_bar::published_optima(),
        time_dependent: true,
        expensive: true,
    },
    #[cfg(feature = "multibody")]
    Entry {
        name: "four-bar-stiff",
        title: "the same with ten times Young's modulus",
        source: "Sohoni & Haug 1982; Etman et al. 1998",
        build: || super::four_bar::StressConstrained::as_published().stiffened(10.0).problem(),
        optima: &[super::four_bar::published_stiff_optimum()],
        time_dependent: true,
        expensive: true,
    },
];

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_unknown_name_is_answered_with_the_nearest_ones() {
        assert_eq!(find("slider-crank").unwrap().name, "slider-crank");
        let message = find("slider-krank").unwrap_err().to_string();
        assert!(message.contains("`slider-krank`") && message.contains("try `slider-crank`"), "{message}");
        assert!(find("comfort").unwrap_err().to_string().contains("try `impact-absorber-comfort`"));
    }

    #[test]
    fn names_are_unique_and_entries_keep_what_they_say() {
        let mut names: Vec<&str> = catalogue().iter().map(|e| e.name).collect();
        names.sort_unstable();
        names.dedup();
        assert_eq!(names.len(), catalogue().len());
        for entry in catalogue() {
            let problem = (entry.build)().unwrap();
            let over_time = problem.constraints.iter().any(|c| c.quantity.is_transient());
            assert_eq!(over_time, entry.time_dependent, "{}", entry.name);
            let fits = |o: &Optimum| o.design.is_none_or(|d| d.len() == problem.n());
            assert!(entry.optima.iter().all(fits), "{}", entry.name);
        }
    }
}
