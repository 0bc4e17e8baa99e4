//! Derivatives of analyses with respect to the design.
//!
//! | file | what |
//! |---|---|
//! | `along` | responses that carry their derivatives from the analysis on |
//! | `balanced` | static equilibria as responses of an optimization problem |
//! | `direct` | derivatives along with implicit steps: one residual in dual numbers and one back-substitution per step |
//! | `driven` | the outputs of a driven mechanism as responses of an optimization problem |
//! | `explicit` | derivatives along with explicit steps: the same at every stage |
//! | `instant` | derivatives of kinematics, inverse dynamics and statics, instant by instant |
//! | `modes` | derivatives of natural frequencies |
//! | `start` | derivatives of assembled positions, consistent velocities and accelerations |
//! | `trajectory` | the outputs of a differential equation as responses, also between time points |
//! | `transient` | the outputs of a mechanism as responses of an optimization problem |

pub mod along;
pub mod balanced;
pub mod direct;
pub mod driven;
pub mod explicit;
pub mod instant;
pub mod modes;
mod record;
mod seeded;
mod start;
pub mod trajectory;
pub mod transient;

pub use along::Along;
pub use balanced::Balanced;
pub use direct::differentiate;
pub use driven::Driven;
pub use modes::{About, ModeSensitivities, differentiate_modes};
pub use record::SensitiveHistory;
pub use trajectory::{Evolution, Trajectory};
pub use transient::{Integration, Transient};
