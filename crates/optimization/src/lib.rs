//! Sequential approximate optimization of designs whose responses are expensive.
//!
//! A [`Problem`](problem::Problem) has design variables, responses of an [`Analysis`](problem::Analysis) (at time points or
//! independent of time), and an objective and constraints that are cheap explicit functions of these. A
//! [`Method`](sao::Method) solves it in cycles: analyse the design, retain the critical constraints at the critical time
//! points, differentiate their responses, build and solve an approximate problem inside move limits, compare it with the
//! analysis of its optimum.
//!
//! | module | contents |
//! |---|---|
//! | [`prelude`] | the names that most programs need |
//! | [`cases`] | problems of the literature with their optima and sources |
//! | [`sao`] | the sequence of cycles: methods, screening, move limits, globalization, stop test, state |
//! | [`approximation`] | approximations of responses, and the approximate problem of a cycle |
//! | [`responses`] | analyses: finite differences of any analysis, and mechanisms (feature `mechanics`) |
//! | [`gradient_check`] | derivatives by all methods of an analysis, compared with finite differences |
//! | [`problem`] | design variables, time grids, responses, objective, constraints, the trait of an analysis |
//! | [`storage`] | a hash of texts, and files of a folder |
//!
//! Modules depend only on those below them.
//!
//! # Examples
//!
//! Stiffness and damping of an impact absorber, so that the peak acceleration is least while the mass travels at most
//! one metre: five analyses and five sensitivity analyses; Table I of Etman, van Campen & Schoofs (1998) has six and five.
//!
//! ```
//! use linkwright_optimization::{cases::impact_absorber, prelude::*};
//!
//! let problem = impact_absorber::peak_acceleration()?;
//! let end = Method::default().solve(&problem, |_| ())?;
//! assert_eq!(end.status, Status::Converged);
//! assert_eq!((end.counters.analyses, end.counters.sensitivity_analyses), (5, 5));
//! # Ok::<(), linkwright_optimization::Error>(())
//! ```

pub mod approximation;
pub mod cases;
pub mod gradient_check;
pub mod problem;
pub mod responses;
pub mod sao;
pub mod storage;

pub use autodiff;
#[cfg(feature = "mechanics")]
pub use mechanics;
pub use nlp;

pub use error::{Error, Result};

/// The names that most programs need.
///
/// Analyses of mechanisms are in [`responses`], approximations in [`approximation`], and problems of the literature in
/// [`cases`].
pub mod prelude {
    pub use crate::function;
    pub use crate::problem::{
        Analysis, ClosedForm, Constraint, DesignVariable, Problem, ProblemBuilder, Quantity, TimeGrid,
    };
    pub use crate::sao::{Method, RunState, Screening, Status, Stop};
    pub use autodiff::Scalar;
}

/// The README's listing is a test.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;
