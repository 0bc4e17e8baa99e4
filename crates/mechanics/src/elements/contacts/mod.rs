//! Contacts, compliant and rigid.

pub(crate) mod bump_stop;
pub(crate) mod hunt_crossley;
pub(crate) mod rigid_stop;
pub(crate) mod rigid_wall;
pub(crate) mod wall_contact;

pub use bump_stop::BumpStop;
pub use wall_contact::WallContact;

use crate::elements::drives::Driver;
use crate::elements::forces::StateFunction;
use crate::elements::joints::PointOnLine;
use crate::elements::kind::ElementKind;
use crate::motion::{Fixed, Motion};

/// Contacts that model files can name.
pub fn kinds<F: Motion, L: StateFunction>() -> Vec<ElementKind<F, L>> {
    vec![
        ElementKind::plain(BumpStop),
        ElementKind::plain(WallContact),
        ElementKind::rigid_contact(&rigid_stop::DESCRIPTOR, Driver(Fixed)),
        ElementKind::rigid_contact(&rigid_wall::DESCRIPTOR, PointOnLine),
    ]
}
