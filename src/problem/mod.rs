//! The optimization problem: design variables, responses over time, objective and constraints.
//!
//! The problem is (1)–(3) of Etman, van Campen & Schoofs (1998): minimize F(r(b, t), b, t) subject to
//! g_j(r(b, t), b, t) ≤ c_j for all t, within bˡ ≤ b ≤ bᵘ. Responses r come from an expensive [`Analysis`]; objective
//! and constraints are cheap explicit functions of (responses, design variables, time), written once over the scalar.

mod alternatives;
mod builder;
pub mod check;
mod closed_form;
mod continuous;
mod coupling;
mod curvatures;
mod definition;
mod differences;
mod equivalents;
mod function;
mod grid;
mod intermediate;
mod number;
mod quantity;
mod responses;
mod selection;
mod sensitivities;
mod variable;

pub use alternatives::{Differentiated, GradientMethod};
pub use builder::ProblemBuilder;
pub use closed_form::{Analytic, ClosedForm};
pub(crate) use continuous::maxima;
pub use continuous::{ContinuousTime, Peak, PeakTime};
pub use coupling::DirectCoupling;
pub use definition::{Evaluation, Problem, RowId};
pub use differences::Differences;
pub use equivalents::{Envelope, MeanExcess};
pub use function::{Function, Functional, IntermediateMap, Point, WeightedSum};
pub use grid::TimeGrid;
pub use intermediate::{Intermediate, Intermediates};
pub use number::ProblemScalar;
#[doc(hidden)]
pub use number::{AnyFunction, AnyFunctional, AnyMap};
pub use quantity::{Constraint, Quantity};
pub use responses::{Analysis, Response, ResponseAt, Responses};
pub use selection::Selection;
pub use sensitivities::Sensitivities;
pub use variable::DesignVariable;
