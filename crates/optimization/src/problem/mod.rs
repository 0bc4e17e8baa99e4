//! The optimization problem: design variables, responses over time, objective and constraints.
//!
//! The problem is (1)–(3) of Etman, van Campen & Schoofs (1998): minimize F(r(b, t), b, t) subject to
//! g_j(r(b, t), b, t) ≤ c_j for all t, within bˡ ≤ b ≤ bᵘ. Responses r come from an expensive [`Analysis`]; objective
//! and constraints are cheap explicit functions of (responses, design variables, time), written once over the scalar.

mod analysis;
mod builder;
mod closed_form;
mod constraint;
mod continuous_time;
mod curvatures;
mod differentiated;
mod direct_coupling;
mod equivalent_constraints;
mod evaluation;
mod function;
mod grid;
mod intermediate;
mod objective;
#[expect(clippy::module_inception, reason = "the file of the type")]
mod problem;
mod problem_scalar;
mod quantity;
mod reduced_histories;
mod scaling;
mod sensitivities;
mod variable;
mod words;

pub use analysis::{Analysis, ContinuousTime, GradientMethod, Response, ResponseAt, ResponseSum, Responses};
pub use builder::ProblemBuilder;
pub use closed_form::{Analytic, ClosedForm};
pub use constraint::{Constraint, Selection, Side};
pub use continuous_time::Peak;
pub(crate) use continuous_time::seed_block;
pub use differentiated::Differentiated;
pub use direct_coupling::DirectCoupling;
pub use equivalent_constraints::{Envelope, MeanExcess};
pub use evaluation::{AnalyzedDesign, Evaluation, PeakTime, RowId};
pub(crate) use evaluation::{maxima, violation};
pub use function::{Function, Functional, IntermediateMap, Point, WeightedSum};
pub use grid::TimeGrid;
pub use intermediate::{Intermediate, Intermediates};
pub use objective::{Goal, Objective, PeakBound};
pub use problem::Problem;
pub use problem_scalar::ProblemScalar;
#[doc(hidden)]
pub use problem_scalar::{AnyFunction, AnyFunctional, AnyMap};
pub(crate) use quantity::QuantityForm;
pub use quantity::{Quantity, SignedQuantity};
pub use scaling::ScalingAdvice;
pub use sensitivities::Sensitivities;
pub(crate) use sensitivities::responses_without_derivatives;
pub use variable::DesignVariable;
pub use words::not_finite;
