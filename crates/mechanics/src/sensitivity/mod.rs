//! Derivatives of analyses with respect to the design.
//!
//! | file | what |
//! |---|---|
//! | `adjoint/` | derivatives of few responses by many design variables, backwards along implicit and explicit steps, and of single instants |
//! | `companion` | one chunk of derivatives that goes along with implicit steps |
//! | `dependence` | what of a mechanism depends on the design |
//! | `differentiation` | which method differentiates an analysis |
//! | `direct` | derivatives along with implicit steps, running or recorded: one residual in dual numbers and one back-substitution per step |
//! | `explicit` | derivatives along with explicit steps: the same at every stage |
//! | `instant` | derivatives of kinematics, inverse dynamics and statics, instant by instant |
//! | `jump` | derivatives through an impact |
//! | `modes` | derivatives of natural frequencies |
//! | `second` | second derivatives: the same equations in hyper-dual numbers |
//! | `semi_analytical/` | the direct method with differenced residuals instead of dual numbers |
//! | `start` | derivatives of assembled positions, consistent velocities and accelerations |
//! | `stretch` | converged implicit steps in a row, with their factorized matrices |

pub mod adjoint;
mod companion;
mod dependence;
pub mod differentiation;
pub mod direct;
pub mod explicit;
pub mod instant;
mod jump;
pub mod modes;
pub mod record;
pub mod second;
mod seeded;
pub mod semi_analytical;
mod start;
mod stretch;

pub use adjoint::{
    Functional, Spent, differentiate_backwards, differentiate_backwards_within, differentiate_equilibria_backwards,
    differentiate_explicitly_backwards, differentiate_explicitly_backwards_within, differentiate_kinematics_backwards,
};
pub use differentiation::{Cost, Differentiation};
pub use direct::differentiate;
pub use modes::{About, ModeSensitivities, differentiate_modes};
pub use record::SensitiveHistory;
pub use second::{Second, SecondHistory, differentiate_twice};
pub use semi_analytical::differentiate_semi_analytically;
