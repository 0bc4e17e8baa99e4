//! Events: impacts of rigid contacts, switches of forces, and events by a condition.
//!
//! | file | contents |
//! |---|---|
//! | `event` | contacts and switches of a mechanism, the record of an event |
//! | `impact` | jump of the velocities at an impact, accelerations after a switch |
//! | `repeated_impacts` | impacts of several contacts that end at a finite time |
//! | `condition` | events by a condition: joints that are released, forces that are switched, the end of a motion |
//! | `unilateral` | rigid contacts that last, dry friction that sticks |
//! | `mode_transition` | their modes after an event and at the start |
//! | `consistent_modes` | these modes where releasing one part after the other does not find them |
//! | `sticking_friction` | friction at rest: held by a constraint, or by others |
//! | `complementarity` | forces within limits and accelerations of several parts |
//! | `held_outputs` | outputs that keep their value from an event on |
//!
//! [`Dynamics`](crate::integrators::settings::Dynamics) handles events, with derivatives by all methods; only switches have no
//! semi-analytical ones. Explicit steps reject switches, kinematics and equilibria reject all mechanisms with events.

pub(crate) mod complementarity;
pub(crate) mod condition;
pub(crate) mod consistent_modes;
pub(crate) mod event;
pub(crate) mod held_outputs;
pub(crate) mod impact;
pub(crate) mod mode_transition;
pub(crate) mod repeated_impacts;
pub(crate) mod sticking_friction;
pub(crate) mod unilateral;

pub use crate::system::modes::Modes;
pub use condition::{Action, EventIndex};
pub use event::Event;
