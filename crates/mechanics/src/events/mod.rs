//! Events: impacts of rigid contacts, and switches of forces.
//!
//! | file | contents |
//! |---|---|
//! | `event` | contacts and switches of a mechanism, the record of an event |
//! | `impact` | jump of the velocities at an impact, accelerations after a switch |
//!
//! [`Dynamics`](crate::integrators::settings::Dynamics) handles events. Explicit steps, kinematics, equilibria and adjoint
//! derivatives reject mechanisms with events.

pub(crate) mod event;
pub(crate) mod impact;

pub use event::Event;
