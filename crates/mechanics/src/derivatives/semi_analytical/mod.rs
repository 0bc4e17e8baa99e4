//! Semi-analytical derivatives: the linear systems of the direct method with differenced residuals.
//!
//! At a converged step, F(x₁, x₀, b) = 0, and the direct method solves
//!
//! $$ \frac{\partial F}{\partial x_1}\frac{dx_1}{db_k} = -\frac{\partial F}{\partial x_0}\frac{dx_0}{db_k} - \frac{\partial F}{\partial b_k} $$
//!
//! The right-hand side is a central difference of the residual in `f64`. The mechanism is built at b ± δ e_k, and the old
//! state is moved by ± δ dx₀/db_k; the matrix is that of the analysis. The solution is corrected by further differences along
//! the corrected direction: the first direction violates the linearized constraints, and its error can be large.
//!
//! Assembly, consistent velocities and accelerations, kinematics, statics and outputs are differentiated in the same way. No
//! dual number is involved: the method checks the derivatives of the model and of its elements. Use the direct or the adjoint
//! method for anything else.
//!
//! The step δ is the fraction ε of the design variable ([`STEP`] by default; ε itself where the variable is zero). The
//! error of a difference is of the order δ² of the curvature plus 10⁻¹⁶/ε of rounding, relative to the largest term.
//! Where large terms cancel, as in beams with large rotations, fewer digits remain (docs/sensitivities.md has measured figures).
//!
//! | module | contents |
//! |---|---|
//! | `central_difference` | a mechanism at both sides of a design, and differences between them |
//! | `initial_conditions` | initial states, consistent states and equilibria |
//! | `dynamics` | implicit steps |
//! | `instants` | kinematics with inverse dynamics, and statics |
//!
//! # Sources
//! Section 5 of the paper for the term; Haftka & Adelman, *Struct. Optim.* 1 (1989) 137–151; Barthelemy & Haftka,
//! *Mech. Struct. Mach.* 18 (1990) 407–432, for the errors.

pub(crate) mod central_difference;
pub(crate) mod dynamics;
pub(crate) mod initial_conditions;
pub(crate) mod instants;

pub use central_difference::STEP;
pub use central_difference::check_step;
pub use dynamics::differentiate_recorded;
pub use dynamics::differentiate_semi_analytically;
pub use instants::difference_equilibria;
pub use instants::difference_kinematics;
