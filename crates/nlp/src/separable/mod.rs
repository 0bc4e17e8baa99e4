//! Programs whose objective and rows are sums over the variables.
//!
//! $$ f_i(x) = r_i + \sum_{j=1}^{n} f_{ij}(x_j),\qquad i = 0 \dots m $$
//!
//! with convex scalar functions fᵢⱼ; i = 0 is the objective. The classical approximations of structural optimization
//! have this form: [`MovingAsymptotesProgram`] (MMA), [`ReciprocalProgram`] (CONLIN), [`DiagonalQuadraticProgram`]. For
//! given multipliers the Lagrangian separates into n problems of one variable, so that programs with a million
//! variables can be solved.

mod blocks;
mod evaluation;
mod moving_asymptotes;
mod quadratic;
mod reciprocal;

pub use crate::program::{DualSums, Separable, Term};
pub(crate) use evaluation::{CHUNK, evaluate_terms};
pub use evaluation::{gradients, hessian, values};
pub use moving_asymptotes::MovingAsymptotesProgram;
pub use quadratic::DiagonalQuadraticProgram;
pub use reciprocal::ReciprocalProgram;
