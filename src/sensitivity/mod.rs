//! Derivatives of analyses with respect to the design.
//!
//! | file | what |
//! |---|---|
//! | `adjoint/` | derivatives of few responses by many design variables, backwards along implicit steps |
//! | `balanced` | static equilibria as responses of an optimization problem |
//! | `check` | the derivatives of a model, proved |
//! | `companion` | one chunk of derivatives that goes along with implicit steps |
//! | `differentiation` | which method differentiates an analysis |
//! | `direct` | derivatives along with implicit steps, running or recorded: one residual in dual numbers and one back-substitution per step |
//! | `driven` | the outputs of a driven mechanism as responses of an optimization problem |
//! | `explicit` | derivatives along with explicit steps: the same at every stage |
//! | `instant` | derivatives of kinematics, inverse dynamics and statics, instant by instant |
//! | `modes` | derivatives of natural frequencies |
//! | `semi_analytical/` | the direct method with differenced residuals instead of dual numbers |
//! | `start` | derivatives of assembled positions, consistent velocities and accelerations |
//! | `stretch` | converged implicit steps in a row, with their factorized matrices |
//! | `trajectory` | the outputs of a differential equation as responses, also between time points |
//! | `transient` | the outputs of a mechanism as responses of an optimization problem |

pub mod adjoint;
pub mod balanced;
mod check;
mod companion;
mod differentiation;
pub mod direct;
pub mod driven;
pub mod explicit;
pub mod instant;
pub mod modes;
mod record;
mod seeded;
pub mod semi_analytical;
mod start;
mod stretch;
pub mod trajectory;
pub mod transient;

pub use adjoint::{Functional, differentiate_backwards};
pub use balanced::Balanced;
pub use check::{Study, check_model};
pub use differentiation::Differentiation;
pub use direct::differentiate;
pub use driven::Driven;
pub use modes::{About, ModeSensitivities, differentiate_modes};
pub use record::SensitiveHistory;
pub use semi_analytical::differentiate_semi_analytically;
pub use trajectory::{Evolution, Trajectory};
pub use transient::{Integration, Transient};
