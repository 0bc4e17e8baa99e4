//! Solvers of programs.

mod argmin_state;
mod auto;
mod concurrent;
mod cone;
mod dual;
mod elastic;
mod interior_point;
mod multi_start;
mod qp;
mod scaling;
mod sqp;

pub use auto::AutoSolver;
pub use concurrent::{ConcurrentSolver, SolverComparison};
pub use cone::SecondOrder;
pub use dual::{Falk, FalkState};
pub use interior_point::InteriorPoint;
pub use multi_start::MultiStart;
pub use qp::Conic;
pub use sqp::{Curvature, Sqp, SqpState, least_squares_multipliers};
