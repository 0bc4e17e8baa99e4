//! The discrete adjoint method, for few responses and many design variables.
//!
//! The direct method carries one derivative of the state per design variable forward; the adjoint method carries one per
//! response backward. F(x₁, x₀, p) = 0 are the converged steps of the analysis, and J is a response. The steps are processed
//! from the last to the first:
//!
//! $$ \left(\frac{\partial F}{\partial x_1}\right)^{\!T}\psi = -\bar x_1,\qquad
//!    \bar x_0 \mathrel{+}= \left(\frac{\partial F}{\partial x_0}\right)^{\!T}\psi,\qquad
//!    \bar p \mathrel{+}= \left(\frac{\partial F}{\partial p}\right)^{\!T}\psi $$
//!
//! where x̄ is dJ/dx and p are the parameters of elements and motions; dJ/db = p̄ᵀ dp/db + x̄ᵀ dx/db at the start. The
//! transposed products (vector-Jacobian products, VJP) are evaluated element by element, from the same residuals in dual
//! numbers. For step sizes towards zero, ψ/h solves the adjoint equations (26) to (33) of the paper.
//!
//! | module | contents |
//! |---|---|
//! | `dynamics` | motions by implicit steps |
//! | `event_window` | steps around an event |
//! | `explicit` | motions by explicit steps |
//! | `relative` | motions by explicit steps in relative coordinates |
//! | `stage_replay` | explicit steps in reverse, repeated for their stages |
//! | `instants` | equilibria, and kinematics with inverse dynamics |
//! | `initial_conditions` | transposes of assembly, consistent velocities and accelerations, initial equilibrium |
//! | `problem` | responses, the loop over recorded steps, and the gradients with respect to the design |
//! | `adjoint_state` | x̄ and p̄ of a batch of responses |
//! | `batch` | ψ of a batch of responses, and ψᵀ ∂F of all elements |
//! | `element_vjp` | VJP of one element |
//! | `output_vjp` | VJP of the outputs |

pub(crate) mod adjoint_state;
pub(crate) mod batch;
pub(crate) mod dynamics;
pub(crate) mod element_vjp;
pub(crate) mod event_window;
pub(crate) mod explicit;
pub(crate) mod initial_conditions;
pub(crate) mod instants;
pub(crate) mod output_vjp;
pub(crate) mod problem;
pub(crate) mod relative;
mod stage_replay;

pub use dynamics::differentiate_backwards;
pub use dynamics::differentiate_backwards_within;
pub use dynamics::differentiate_recording_backwards;
pub use explicit::differentiate_explicit_recording_backwards;
pub use explicit::differentiate_explicitly_backwards;
pub use explicit::differentiate_explicitly_backwards_within;
pub use instants::differentiate_equilibria_backwards;
pub use instants::differentiate_kinematics_backwards;
pub use problem::AdjointFunctional;
pub use problem::ReplayStatistics;
pub use problem::Weighted;
