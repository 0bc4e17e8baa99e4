//! The problems by name, with their optima and sources.

use super::{
    Optimum, cantilever, eight_bar_truss, impact_absorber, quadratic_forms, segmented_cantilever, slider_crank,
    ten_bar_truss, two_bar_truss, two_spheres,
};
use crate::problem::Problem;
use error::{Error, Result};

/// A problem with its known optima.
#[derive(Clone, Copy, Debug)]
pub struct CatalogueEntry {
    /// Name on the command line: lower case with hyphens.
    pub name: &'static str,
    /// Description in a few words.
    pub title: &'static str,
    /// Author and publication.
    pub source: &'static str,
    /// Builds the problem, start design included.
    pub build: fn() -> Result<Problem>,
    /// Known optima: the one to reach first, then local ones.
    pub optima: &'static [Optimum],
    /// True if a constraint depends on time.
    pub time_dependent: bool,
    /// True if an analysis takes more than some milliseconds; `compare --all` skips such problems.
    pub expensive: bool,
}

/// All problems, similar ones next to each other.
pub fn catalogue() -> &'static [CatalogueEntry] {
    ENTRIES
}

/// Finds a problem by name.
///
/// # Errors
/// [`Error::Definition`] with the nearest names if there is no such problem.
pub fn find(name: &str) -> Result<&'static CatalogueEntry> {
    let known = || Error::unknown("problem", name, catalogue().iter().map(|entry| entry.name));
    catalogue().iter().find(|entry| entry.name == name).ok_or_else(known)
}

const SVANBERG_1987: &str = "Svanberg, Int. J. Numer. Meth. Eng. 24 (1987) 359-373";
const SVANBERG_2002: &str = "Svanberg, SIAM J. Optim. 12 (2002) 555-573";
const HAFTKA: &str = "Haftka & Gürdal, Elements of Structural Optimization (1992)";
const PAPER: &str = "Etman, van Campen & Schoofs, Multibody Syst. Dyn. 2 (1998) 393-415";

static ENTRIES: &[CatalogueEntry] = &[
    CatalogueEntry {
        name: "impact-absorber",
        title: "impact absorber, least peak acceleration at 101 time points",
        source: PAPER,
        build: impact_absorber::peak_acceleration,
        optima: &[impact_absorber::peak_acceleration_optimum()],
        time_dependent: true,
        expensive: false,
    },
    CatalogueEntry {
        name: "impact-absorber-comfort",
        title: "impact absorber, least mean square acceleration",
        source: PAPER,
        build: impact_absorber::comfort,
        optima: &[impact_absorber::comfort_optimum()],
        time_dependent: true,
        expensive: false,
    },
    CatalogueEntry {
        name: "impact-absorber-continuous",
        title: "impact absorber, least peak acceleration at all times",
        source: PAPER,
        build: || Ok(impact_absorber::peak_acceleration()?.in_continuous_time()),
        optima: &[impact_absorber::continuous_peak_acceleration_optimum()],
        time_dependent: true,
        expensive: false,
    },
    CatalogueEntry {
        name: "slider-crank",
        title: "slider-crank, path generation from the first stand-in start",
        source: "Paradis & Willmert 1983; Etman et al. 1998",
        build: || slider_crank::path_generation(slider_crank::STAND_IN_START),
        optima: &[slider_crank::optimum()],
        time_dependent: false,
        expensive: false,
    },
    CatalogueEntry {
        name: "slider-crank-second",
        title: "slider-crank, path generation from the second stand-in start",
        source: "Paradis & Willmert 1983; Etman et al. 1998",
        build: || slider_crank::path_generation(slider_crank::SECOND_STAND_IN_START),
        optima: &[slider_crank::optimum()],
        time_dependent: false,
        expensive: false,
    },
    CatalogueEntry {
        name: "cantilever",
        title: "cantilever of five segments, least weight at a bounded deflection",
        source: SVANBERG_1987,
        build: cantilever::problem,
        optima: &[cantilever::optimum()],
        time_dependent: false,
        expensive: false,
    },
    CatalogueEntry {
        name: "two-bar-truss",
        title: "two-bar truss, an area and a shape variable",
        source: SVANBERG_1987,
        build: two_bar_truss::problem,
        optima: &[two_bar_truss::optimum()],
        time_dependent: false,
        expensive: false,
    },
    CatalogueEntry {
        name: "eight-bar-truss",
        title: "eight-bar truss in space with bounded stresses",
        source: SVANBERG_1987,
        build: eight_bar_truss::problem,
        optima: &[eight_bar_truss::optimum()],
        time_dependent: false,
        expensive: false,
    },
    CatalogueEntry {
        name: "ten-bar-truss",
        title: "ten-bar truss, equal allowed stresses",
        source: HAFTKA,
        build: ten_bar_truss::equal_strengths,
        optima: &[ten_bar_truss::equal_strengths_optimum()],
        time_dependent: false,
        expensive: false,
    },
    CatalogueEntry {
        name: "ten-bar-truss-strong",
        title: "ten-bar truss with a stronger ninth bar",
        source: HAFTKA,
        build: ten_bar_truss::strong_ninth_bar,
        optima: &[ten_bar_truss::strong_ninth_bar_optimum()],
        time_dependent: false,
        expensive: false,
    },
    CatalogueEntry {
        name: "segmented-cantilever",
        title: "cantilever of five segments with widths and heights",
        source: "Vanderplaats, Numerical Optimization Techniques for Engineering Design (1984)",
        build: || segmented_cantilever::problem(5),
        optima: &[segmented_cantilever::five_segments_optimum()],
        time_dependent: false,
        expensive: false,
    },
    CatalogueEntry {
        name: "two-spheres",
        title: "nearest point of two balls",
        source: "Svanberg, MMA and GCMMA - two methods for nonlinear optimization (2007)",
        build: two_spheres::problem,
        optima: &[two_spheres::optimum()],
        time_dependent: false,
        expensive: false,
    },
    CatalogueEntry {
        name: "quadratic-forms-1",
        title: "quadratic forms with full matrices, first problem, 20 variables",
        source: SVANBERG_2002,
        build: || quadratic_forms::first_problem(20),
        optima: &[quadratic_forms::FIRST_20],
        time_dependent: false,
        expensive: false,
    },
    CatalogueEntry {
        name: "quadratic-forms-2",
        title: "quadratic forms with full matrices, second problem, 20 variables",
        source: SVANBERG_2002,
        build: || quadratic_forms::second_problem(20),
        optima: &[quadratic_forms::SECOND_20],
        time_dependent: false,
        expensive: false,
    },
    #[cfg(feature = "mechanics")]
    CatalogueEntry {
        name: "impact-absorber-nonlinear",
        title: "impact absorber with cubic spring and orifice damper",
        source: "after Afimiwala & Mayne 1974; ours",
        build: super::nonlinear_absorber::peak_acceleration,
        optima: &[super::nonlinear_absorber::optimum()],
        time_dependent: true,
        expensive: false,
    },
    #[cfg(feature = "mechanics")]
    CatalogueEntry {
        name: "impact-absorber-nonlinear-continuous",
        title: "impact absorber with cubic spring and orifice damper, at all times",
        source: "after Afimiwala & Mayne 1974; ours",
        build: || Ok(super::nonlinear_absorber::peak_acceleration()?.in_continuous_time()),
        optima: &[super::nonlinear_absorber::continuous_optimum()],
        time_dependent: true,
        expensive: true,
    },
    #[cfg(feature = "mechanics")]
    CatalogueEntry {
        name: "vehicle-suspension",
        title: "five-degree-of-freedom vehicle on a bump, least peak acceleration of the seat",
        source: "Haug & Arora, Applied Optimal Design (1979); Hsieh & Arora 1984",
        build: super::vehicle_suspension::peak_acceleration,
        optima: &super::vehicle_suspension::optima(),
        time_dependent: true,
        expensive: false,
    },
    #[cfg(feature = "mechanics")]
    CatalogueEntry {
        name: "vehicle-suspension-continuous",
        title: "five-degree-of-freedom vehicle on a bump, at all times",
        source: "Haug & Arora, Applied Optimal Design (1979); Hsieh & Arora 1984",
        build: || Ok(super::vehicle_suspension::peak_acceleration()?.in_continuous_time()),
        optima: &[super::vehicle_suspension::continuous_optimum()],
        time_dependent: true,
        expensive: true,
    },
    #[cfg(feature = "mechanics")]
    CatalogueEntry {
        name: "four-bar",
        title: "flexible four-bar with bounded stress, modelled as published",
        source: "Sohoni & Haug 1982; Etman et al. 1998",
        build: || super::four_bar::StressConstrained::as_published().problem(),
        optima: &super::four_bar::published_optima(),
        time_dependent: true,
        expensive: true,
    },
    #[cfg(feature = "mechanics")]
    CatalogueEntry {
        name: "four-bar-stiff",
        title: "flexible four-bar with bounded stress and ten times Young's modulus",
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
    fn names_are_unique_and_entries_describe_their_problems() {
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
