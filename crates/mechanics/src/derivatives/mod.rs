//! Derivatives of analyses with respect to the design.
//!
//! All methods differentiate the discrete solution that an analysis has converged to; nothing is iterated again.
//!
//! | module | contents |
//! |---|---|
//! | [`method`] | choice between the direct, the adjoint and the semi-analytical method |
//! | [`forward`] | direct method: forward sensitivities along implicit and explicit steps, kinematics, statics |
//! | [`adjoint`] | discrete adjoint method: few responses, many design variables |
//! | [`semi_analytical`] | direct method with residuals differenced in `f64`, a check of the others |
//! | [`second_order`] | Hessians by the direct method in hyper-dual numbers |
//! | [`modal`] | derivatives of natural frequencies |
//! | [`mode_shapes`] | amplitudes of outputs in natural modes, with derivatives |
//! | [`history`] | outputs over time with their gradients |
//! | `indeterminate` | outputs without derivatives, because constraints are redundant |
//! | `propagation` | the loop that propagates derivatives along the steps of an analysis |
//! | `seeding` | mechanisms in dual numbers, and the parameters that depend on the design |

pub mod adjoint;
pub mod forward;
pub mod history;
pub(crate) mod indeterminate;
pub mod method;
pub mod modal;
pub mod mode_shapes;
pub(crate) mod propagation;
pub mod second_order;
pub(crate) mod seeding;
pub mod semi_analytical;
