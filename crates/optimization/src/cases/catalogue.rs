//! The problems by name, with their optima and sources.

use super::KnownSolution::Optima;
use super::{
    CatalogueEntry, cantilever, eight_bar_truss, impact_absorber, quadratic_forms, segmented_cantilever, slider_crank,
    ten_bar_truss, two_bar_truss, two_spheres,
};

/// The mechanisms and structures; similar ones are adjacent. [`suite::problems`](super::suite::problems) lists the problems of all suites.
pub fn catalogue() -> &'static [CatalogueEntry] {
    ENTRIES
}

const SVANBERG_1987: &str = "Svanberg, Int. J. Numer. Meth. Eng. 24 (1987) 359-373";
const SVANBERG_2002: &str = "Svanberg, SIAM J. Optim. 12 (2002) 555-573";
const HAFTKA: &str = "Haftka & Gürdal, Elements of Structural Optimization (1992)";
const PAPER: &str = "Etman, van Campen & Schoofs, Multibody Syst. Dyn. 2 (1998) 393-415";

static ENTRIES: &[CatalogueEntry] = &[
    CatalogueEntry::new(
        "impact-absorber",
        "impact absorber, least peak acceleration at 101 time points",
        PAPER,
        impact_absorber::peak_acceleration,
    )
    .solved_by(Optima(const { &[impact_absorber::peak_acceleration_optimum()] }))
    .over_time(),
    CatalogueEntry::new(
        "impact-absorber-comfort",
        "impact absorber, least mean square acceleration",
        PAPER,
        impact_absorber::comfort,
    )
    .solved_by(Optima(const { &[impact_absorber::comfort_optimum()] }))
    .over_time(),
    CatalogueEntry::new(
        "impact-absorber-continuous",
        "impact absorber, least peak acceleration at all times",
        PAPER,
        || Ok(impact_absorber::peak_acceleration()?.in_continuous_time()),
    )
    .solved_by(Optima(const { &[impact_absorber::continuous_peak_acceleration_optimum()] }))
    .over_time(),
    CatalogueEntry::new(
        "slider-crank",
        "slider-crank, path generation from the first stand-in start",
        "Paradis & Willmert 1983; Etman et al. 1998",
        || slider_crank::path_generation(slider_crank::STAND_IN_START),
    )
    .solved_by(Optima(const { &[slider_crank::optimum()] })),
    CatalogueEntry::new(
        "slider-crank-second",
        "slider-crank, path generation from the second stand-in start",
        "Paradis & Willmert 1983; Etman et al. 1998",
        || slider_crank::path_generation(slider_crank::SECOND_STAND_IN_START),
    )
    .solved_by(Optima(const { &[slider_crank::optimum()] })),
    CatalogueEntry::new(
        "cantilever",
        "cantilever of five segments, least weight at a bounded deflection",
        SVANBERG_1987,
        cantilever::problem,
    )
    .solved_by(Optima(const { &[cantilever::optimum()] })),
    CatalogueEntry::new(
        "two-bar-truss",
        "two-bar truss, an area and a shape variable",
        SVANBERG_1987,
        two_bar_truss::problem,
    )
    .solved_by(Optima(const { &[two_bar_truss::optimum()] })),
    CatalogueEntry::new(
        "eight-bar-truss",
        "eight-bar truss in space with bounded stresses",
        SVANBERG_1987,
        eight_bar_truss::problem,
    )
    .solved_by(Optima(const { &[eight_bar_truss::optimum()] })),
    CatalogueEntry::new(
        "ten-bar-truss",
        "ten-bar truss, equal allowed stresses",
        HAFTKA,
        ten_bar_truss::equal_strengths,
    )
    .solved_by(Optima(const { &[ten_bar_truss::equal_strengths_optimum()] })),
    CatalogueEntry::new(
        "ten-bar-truss-strong",
        "ten-bar truss with a stronger ninth bar",
        HAFTKA,
        ten_bar_truss::strong_ninth_bar,
    )
    .solved_by(Optima(const { &[ten_bar_truss::strong_ninth_bar_optimum()] })),
    CatalogueEntry::new(
        "segmented-cantilever",
        "cantilever of five segments with widths and heights",
        "Vanderplaats, Numerical Optimization Techniques for Engineering Design (1984)",
        || segmented_cantilever::problem(5),
    )
    .solved_by(Optima(const { &[segmented_cantilever::five_segments_optimum()] })),
    CatalogueEntry::new(
        "two-spheres",
        "nearest point of two balls",
        "Svanberg, MMA and GCMMA - two methods for nonlinear optimization (2007)",
        two_spheres::problem,
    )
    .solved_by(Optima(const { &[two_spheres::optimum()] })),
    CatalogueEntry::new(
        "quadratic-forms-1",
        "quadratic forms with full matrices, first problem, 20 variables",
        SVANBERG_2002,
        || quadratic_forms::first_problem(20),
    )
    .solved_by(Optima(const { &[quadratic_forms::FIRST_20] })),
    CatalogueEntry::new(
        "quadratic-forms-2",
        "quadratic forms with full matrices, second problem, 20 variables",
        SVANBERG_2002,
        || quadratic_forms::second_problem(20),
    )
    .solved_by(Optima(const { &[quadratic_forms::SECOND_20] })),
    #[cfg(feature = "mechanics")]
    CatalogueEntry::new(
        "impact-absorber-nonlinear",
        "impact absorber with cubic spring and orifice damper",
        "after Afimiwala & Mayne 1974; ours",
        super::nonlinear_absorber::peak_acceleration,
    )
    .solved_by(Optima(const { &[super::nonlinear_absorber::optimum()] }))
    .over_time(),
    #[cfg(feature = "mechanics")]
    CatalogueEntry::new(
        "impact-absorber-nonlinear-continuous",
        "impact absorber with cubic spring and orifice damper, at all times",
        "after Afimiwala & Mayne 1974; ours",
        || Ok(super::nonlinear_absorber::peak_acceleration()?.in_continuous_time()),
    )
    .solved_by(Optima(const { &[super::nonlinear_absorber::continuous_optimum()] }))
    .over_time()
    .expensive(),
    #[cfg(feature = "mechanics")]
    CatalogueEntry::new(
        "vehicle-suspension",
        "five-degree-of-freedom vehicle on a bump, least peak acceleration of the seat",
        "Haug & Arora, Applied Optimal Design (1979); Hsieh & Arora 1984",
        super::vehicle_suspension::peak_acceleration,
    )
    .solved_by(Optima(const { &super::vehicle_suspension::optima() }))
    .over_time(),
    #[cfg(feature = "mechanics")]
    CatalogueEntry::new(
        "vehicle-suspension-continuous",
        "five-degree-of-freedom vehicle on a bump, at all times",
        "Haug & Arora, Applied Optimal Design (1979); Hsieh & Arora 1984",
        || Ok(super::vehicle_suspension::peak_acceleration()?.in_continuous_time()),
    )
    .solved_by(Optima(const { &[super::vehicle_suspension::continuous_optimum()] }))
    .over_time()
    .expensive(),
    #[cfg(feature = "mechanics")]
    CatalogueEntry::new(
        "four-bar",
        "flexible four-bar with bounded stress, modelled as published",
        "Sohoni & Haug 1982; Etman et al. 1998",
        || super::four_bar::StressConstrained::as_published().problem(),
    )
    .solved_by(Optima(const { &super::four_bar::published_optima() }))
    .over_time()
    .expensive(),
    #[cfg(feature = "mechanics")]
    CatalogueEntry::new(
        "four-bar-stiff",
        "flexible four-bar with bounded stress and ten times Young's modulus",
        "Sohoni & Haug 1982; Etman et al. 1998",
        || super::four_bar::StressConstrained::as_published().stiffened(10.0).problem(),
    )
    .solved_by(Optima(const { &[super::four_bar::published_stiff_optimum()] }))
    .over_time()
    .expensive(),
];
