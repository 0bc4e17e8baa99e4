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
//! analyses a design, keeps only the critical constraints at the critical time points, differentiates those responses,
//! builds an approximate problem from intermediate design variables and intermediate responses, solves it inside move
//! limits, and checks the approximation errors. SI units and radians inside; `docs/notation.md` has the letters.
//!
//! # The house
//!
//! Two wings stand on one ground floor and meet in [`sao`]; arrows point down only.
//!
//! ```text
//!                      cli                     arguments in, exit code out
//!           papers · model                     papers regenerated, ours beside theirs; the model file
//!               report                         tables, figures, animations
//!               library                        problems of the field with their optima
//!                 sao                          the sequence of cycles
//!        ┌─────────┴──────────┐
//!   sensitivity           subproblem           LP, QP, SQP, duals; an independent KKT check
//!    analysis            approximation         models of responses, the approximate problem
//!    multibody              problem            variables, grids, responses, objective, constraints
//!        └─────────┬──────────┘
//!        scalar · linalg · error               one number type for values, derivatives and degrees
//! ```
//!
//! # An optimization
//!
//! Stiffness and damping of an impact absorber, so that the peak acceleration is least while the mass travels at most
//! one metre: six analyses and five sensitivity analyses, as in the paper's Table I.
//!
//! ```
//! use linkwright::{cases::impact_absorber, sao::{Method, Status}};
//!
//! let problem = impact_absorber::peak_acceleration()?;
//! let end = Method::default().solve(&problem, |_| ())?;
//! assert_eq!(end.status, Status::Converged);
//! assert_eq!((end.counters.analyses, end.counters.sensitivity_analyses), (6, 5));
//! assert!((end.evaluation.objective - 0.52028604).abs() < 1e-8);
//! # Ok::<(), linkwright::Error>(())
//! ```

pub mod approximation;
pub mod cases;
#[cfg(feature = "model")]
pub mod model_file;
#[cfg(all(feature = "report", feature = "mechanics"))]
pub mod papers;
pub mod problem;
#[cfg(feature = "report")]
pub mod report;
pub mod responses;
pub mod sao;

pub use autodiff;
pub use error;
#[cfg(feature = "mechanics")]
pub use mechanics;
pub use nlp;

pub use error::{Error, Result};

/// The README's listing is a test.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;
