//! Forces as functions of time and state.

use autodiff::Scalar;

/// A force or torque as a function of time and of the motion of some coordinates, written once over the scalar type: a
/// controller, a drag, a magnet.
///
/// Branch on real parts only.
pub trait StateFunction: Send + Sync + 'static {
    /// The generalized force (N or N·m) at time `t` (s) for the parameters `p`, with positions `q` and velocities `v` of the
    /// observed coordinates.
    fn generalized_force<T: Scalar>(&self, p: &[T], t: T, q: &[T], v: &[T]) -> T;
}
