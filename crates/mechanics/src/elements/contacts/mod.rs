//! Contacts, compliant and rigid.

pub(crate) mod bump_stop;
pub(crate) mod hunt_crossley;
pub(crate) mod rigid_stop;
pub(crate) mod rigid_wall;
pub(crate) mod wall_contact;

pub use bump_stop::BumpStop;
pub use wall_contact::WallContact;

use crate::elements::forces::StateFunction;
use crate::elements::joints::PointOnLine;
use crate::elements::kind::ElementKind;
use crate::motion::Motion;

/// Contacts that model files can name.
pub fn kinds<F: Motion, L: StateFunction>() -> Vec<ElementKind<F, L>> {
    vec![
        ElementKind::plain(BumpStop::object()),
        ElementKind::plain(WallContact::object()),
        ElementKind::rigid_contact(&rigid_stop::DESCRIPTOR, rigid_stop::gap()),
        ElementKind::rigid_contact(&rigid_wall::DESCRIPTOR, PointOnLine::object()),
    ]
}
