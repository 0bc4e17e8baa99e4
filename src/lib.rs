//! Design optimization of multibody systems by sequential approximation, with exact sensitivities.
//!
//! The problem (Etman, van Campen & Schoofs, *Multibody System Dynamics* 2 (1998) 393–415) is to find the n design
//! variables b that
//!
//! * minimize F(r(b, t), b, t),
//! * subject to g_j(r(b, t), b, t) ≤ c_j for all t in \[t₀, t_f\], j = 1 … m,
//! * within bˡ ≤ b ≤ bᵘ,
//!
//! where the responses r(b, t) come from an expensive analysis and F and g_j are cheap explicit functions. A cycle
//! analyses a design, retains only the critical constraints at the critical time points, differentiates those responses,
//! builds an approximate problem from intermediate design variables and intermediate responses, solves it inside move
//! limits, and evaluates the approximation errors. Units are SI and radians; `docs/notation.md` has the letters.
//!
//! # Modules
//!
//! Modules depend only on those below them in the table. [`cases`] to [`storage`] are modules of `linkwright-optimization`; the
//! last four are crates. [`nlp`] and `mechanics` do not depend on each other.
//!
//! | module | contents | feature |
//! |---|---|---|
//! | [`prelude`] | the names that most programs need | |
//! | `study` | many runs of one model: samples, many starts, sweeps, tolerances, Pareto fronts, sensitivity indices | `model` and `report` |
//! | `model_file` | mechanism, problem and method as a text file | `model` |
//! | `papers` | tables of papers, computed and compared with the printed ones, and figures | `report` and `mechanics` |
//! | `report` | plots, tables, pages and animations | `report` |
//! | [`cases`] | problems of the literature with their optima and sources | |
//! | [`sao`] | the sequence of cycles: methods, screening, move limits, globalization, stop test, state | |
//! | [`approximation`] | approximations of responses, and the approximate problem of a cycle | |
//! | [`responses`] | analyses: finite differences of any analysis, and mechanisms | `mechanics` for the latter |
//! | [`gradient_check`] | derivatives by all methods of an analysis, compared with finite differences | |
//! | [`problem`] | design variables, time grids, responses, objective, constraints, the trait of an analysis | |
//! | [`storage`] | hashes, and files that are written completely or not at all | |
//! | `mechanics` | planar and spatial mechanisms, their analyses, and exact derivatives of these | `mechanics` |
//! | [`nlp`] | programs (linear, quadratic, conic, separable, general), solvers, and an independent KKT check | |
//! | [`autodiff`] | numbers that carry derivatives or polynomial degrees | |
//! | [`error`] | the error type | |
//!
//! # Examples
//!
//! Stiffness and damping of an impact absorber that minimize the peak acceleration of a mass that may travel at most one
//! metre: five analyses and five sensitivity analyses; the paper's Table I has six and five.
//!
//! ```
//! use linkwright::{cases::impact_absorber, prelude::*};
//!
//! let problem = impact_absorber::peak_acceleration()?;
//! let end = Method::default().solve(&problem, |_| ())?;
//! assert_eq!(end.status, Status::Converged);
//! assert_eq!((end.counters.analyses, end.counters.sensitivity_analyses), (5, 5));
//! assert!((end.evaluation.objective - 0.52028604).abs() < 1e-8);
//! # Ok::<(), linkwright::Error>(())
//! ```

#[cfg(feature = "model")]
pub mod model_file;
#[cfg(all(feature = "report", feature = "mechanics"))]
pub mod papers;
#[cfg(feature = "report")]
pub mod report;
#[cfg(all(feature = "model", feature = "report"))]
pub mod study;

pub use autodiff;
pub use error;
#[cfg(feature = "mechanics")]
pub use mechanics;
pub use nlp;
pub use optimization::{approximation, cases, function, gradient_check, prelude, problem, responses, sao, storage};

pub use error::{Error, Readable, Result};

/// The README's listing is a test.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;
