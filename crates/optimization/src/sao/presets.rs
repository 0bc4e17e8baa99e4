//! Methods of the literature by name: presets of the interchangeable parts.

use super::{
    AcceptAlways, Conservatism, Filter, FilteredConservatism, FixedLimits, Globalization, Merit, Method, MoveLimits,
    RelativeLimits, TrustRegion,
};
use crate::approximation::{
    Approximation, Asymptotes, Conlin, CurvatureRule, DiagonalQuadratic, FullQuadratic, Hessian, LagrangianCurvature,
    Linear, Mma, Reciprocal, Regression, Tana, TwoPointExponential,
};
use error::{Error, Result};

/// A named method.
#[derive(Clone, Copy, Debug)]
pub struct Preset {
    /// Name on the command line: lower case with hyphens.
    pub name: &'static str,
    /// Approximation, acceptance and move limits in one line.
    pub title: &'static str,
    /// Makes the method, with the default stop test and subproblem solver.
    pub method: fn() -> Method,
}

/// All presets, in the order: first derivatives at one design, first derivatives at several designs, second derivatives.
pub fn presets() -> &'static [Preset] {
    PRESETS
}

/// Name of the preset that is used where none is named, that of [`Method::default`].
pub const DEFAULT_PRESET: &str = "automatic";

/// The preset of that name, or of a former name: `paper` is `slp`.
///
/// # Errors
///
/// [`Error::Unknown`] with the nearest names if no preset has this name.
pub fn preset(name: &str) -> Result<&'static Preset> {
    let name = FORMER_NAMES.iter().find(|(former, _)| *former == name).map_or(name, |(_, current)| current);
    let unknown = || Error::unknown("method", name, PRESETS.iter().map(|p| p.name));
    PRESETS.iter().find(|p| p.name == name).ok_or_else(unknown)
}

/// Acceptance by the errors of the approximation, as in the paper.
fn by_errors(approximation: impl Approximation + 'static) -> Method {
    Method::slp().with_approximation(approximation)
}

/// Acceptance by a filter; a trust region limits the step.
fn by_filter(approximation: impl Approximation + 'static) -> Method {
    with(approximation, Filter::default(), TrustRegion::default())
}

/// Acceptance by a filter, with more conservatism after a rejection; move limits are those of the whole design space.
fn by_filtered_conservatism(approximation: impl Approximation + 'static) -> Method {
    with(approximation, FilteredConservatism::default(), FixedLimits::default())
}

fn with(
    approximation: impl Approximation + 'static,
    globalization: impl Globalization + 'static,
    move_limits: impl MoveLimits + 'static,
) -> Method {
    by_errors(approximation).with_globalization(globalization).with_move_limits(move_limits)
}

/// The paper's move limits with wider first limits, for approximations with second derivatives.
fn wide_limits() -> RelativeLimits {
    RelativeLimits { initial: 0.7, cap: 1.0, ..RelativeLimits::default() }
}

const EXPONENTIAL: TwoPointExponential = TwoPointExponential { least: -3.0, most: 3.0, otherwise: -1.0 };

/// Former names of presets with the current ones.
const FORMER_NAMES: &[(&str, &str)] = &[("paper", "slp"), ("paper-fixed-times", "slp-fixed-times")];

static PRESETS: &[Preset] = &[
    Preset {
        name: DEFAULT_PRESET,
        title: "approximations selected by their prediction errors; filter; trust region; correction after a rejection",
        method: Method::automatic,
    },
    Preset {
        name: "slp",
        title: "linear; approximation errors; relative move limits (Etman et al. 1998); peaks in continuous time move",
        method: Method::slp,
    },
    Preset {
        name: "slp-fixed-times",
        title: "linear; approximation errors; relative move limits (Etman et al. 1998); peaks in continuous time keep their times",
        method: || Method { moving_peaks: false, ..Method::slp() },
    },
    Preset {
        name: "slp-filter",
        title: "linear; filter; trust region (Fletcher et al. 2002)",
        method: || by_filter(Linear),
    },
    Preset {
        name: "sqp-filter",
        title: "linear with the curvature of the Lagrangian by limited-memory BFGS (SQP); filter; trust region",
        method: || Method {
            curvature: Some(LagrangianCurvature::default()),
            ..with(Linear, Filter::default(), TrustRegion { merit: Merit::Lagrangian, ..TrustRegion::default() })
        },
    },
    Preset {
        name: "linear-conservative",
        title: "linear with a convex term that is raised until it is conservative",
        method: || with(Linear, Conservatism::default(), FixedLimits::default()),
    },
    Preset {
        name: "reciprocal",
        title: "reciprocal (Schmit & Farshi 1974); approximation errors; relative move limits",
        method: || by_errors(Reciprocal),
    },
    Preset {
        name: "conlin",
        title: "convex linearization (Fleury & Braibant 1986); everything is accepted",
        method: || with(Conlin, AcceptAlways, FixedLimits::default()),
    },
    Preset {
        name: "mma",
        title: "moving asymptotes (Svanberg 1987); everything is accepted",
        method: || with(Mma::SVANBERG_1987, AcceptAlways, FixedLimits::default()),
    },
    Preset {
        name: "mma-2007",
        title: "moving asymptotes with the rules of 2007 (Svanberg); steps of at most half the range; everything is accepted",
        method: || with(Mma::SVANBERG_2002, AcceptAlways, FixedLimits { width: 0.5 }),
    },
    Preset {
        name: "gcmma",
        title: "moving asymptotes made conservative (Svanberg 2002)",
        method: || with(Mma::SVANBERG_2002, Conservatism::default(), FixedLimits::default()),
    },
    Preset {
        name: "mma-filtered",
        title: "moving asymptotes; filtered conservatism (Groenwold & Etman 2010)",
        method: || by_filtered_conservatism(Mma::SVANBERG_2002),
    },
    Preset {
        name: "quadratic-mma",
        title: "diagonal quadratic with the curvature of moving asymptotes; filtered conservatism",
        method: || {
            by_filtered_conservatism(DiagonalQuadratic {
                curvature: CurvatureRule::Asymptotes(Asymptotes::SVANBERG_2002),
            })
        },
    },
    Preset {
        name: "quadratic-reciprocal",
        title: "diagonal quadratic with the curvature of reciprocals; filtered conservatism",
        method: || by_filtered_conservatism(DiagonalQuadratic { curvature: CurvatureRule::Reciprocal }),
    },
    Preset {
        name: "quadratic-spherical",
        title: "one curvature for all variables from the last two gradients; filtered conservatism",
        method: || by_filtered_conservatism(DiagonalQuadratic { curvature: CurvatureRule::SphericalGradient }),
    },
    Preset {
        name: "quadratic-exponential",
        title: "diagonal quadratic with the curvature of two-point exponentials; filtered conservatism",
        method: || by_filtered_conservatism(DiagonalQuadratic { curvature: CurvatureRule::Exponential }),
    },
    Preset {
        name: "exponential",
        title: "two-point exponentials (Fadel et al. 1990); approximation errors; relative move limits",
        method: || by_errors(EXPONENTIAL),
    },
    Preset {
        name: "tana",
        title: "two-point TANA-3 (Xu & Grandhi 1998); approximation errors; relative move limits",
        method: || by_errors(Tana::default()),
    },
    Preset {
        name: "multipoint",
        title: "regression over the last designs, linear or multiplicative (Toropov et al. 1993); approximation errors; relative move limits",
        method: || by_errors(Regression::default()),
    },
    Preset {
        name: "bfgs",
        title: "full quadratic by damped BFGS updates; filter; trust region",
        method: || by_filter(FullQuadratic { hessian: Hessian::Bfgs(10) }),
    },
    Preset {
        name: "quadratic-exact",
        title: "diagonal of the exact second derivatives; filtered conservatism",
        method: || by_filtered_conservatism(DiagonalQuadratic { curvature: CurvatureRule::Exact }),
    },
    Preset {
        name: "hessian",
        title: "convex part of the exact second derivatives; filter; trust region",
        method: || by_filter(FullQuadratic { hessian: Hessian::ExactConvex }),
    },
    Preset {
        name: "hessian-errors",
        title: "exact second derivatives; approximation errors; relative move limits from 70 %",
        method: || by_errors(FullQuadratic { hessian: Hessian::Exact }).with_move_limits(wide_limits()),
    },
];

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_rules_of_2007_limit_a_step_to_half_the_range() {
        let problem = (crate::cases::find("cantilever").unwrap().build)().unwrap();
        let method = (preset("mma-2007").unwrap().method)();
        let end = method.solve(&problem, |_| ()).unwrap();
        // The optimum of Svanberg's cantilever (1987), in its printed digits.
        assert!((end.evaluation.objective - 1.340).abs() < 5e-4, "{}", end.evaluation.objective);
        let v = &problem.variables[0];
        let region = method.move_limits.region(&problem, &[v.lower; 5], &method.move_limits.start(5));
        assert!((region.upper[0] - 0.5 * (v.lower + v.upper)).abs() < 1e-12 * v.upper, "{}", region.upper[0]);
    }

    #[test]
    fn names_are_unique_and_near_ones_are_found() {
        let mut names: Vec<&str> = presets().iter().map(|p| p.name).collect();
        names.sort_unstable();
        names.dedup();
        assert_eq!(names.len(), presets().len());
        assert_eq!(preset("gcmma").unwrap().name, "gcmma");
        assert_eq!(preset("paper").unwrap().name, "slp");
        assert!(preset("gcma").unwrap_err().to_string().contains("try `gcmma`"));
    }
}
