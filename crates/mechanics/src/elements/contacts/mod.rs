//! Contacts, compliant and rigid.

pub(crate) mod bump_stop;
pub(crate) mod hunt_crossley;
pub(crate) mod profile;
pub(crate) mod profile_contact;
pub(crate) mod profile_face;
pub(crate) mod rigid;
pub(crate) mod wall_contact;

pub use bump_stop::BumpStop;
pub use profile::profile_curve;
pub use profile_contact::ProfileContact;
pub use profile_face::ProfileFace;
pub use wall_contact::WallContact;

use crate::elements::kind::ElementKind;
use crate::elements::state_function::StateFunction;
use crate::motion::Motion;

/// Contacts that model files can name.
pub fn kinds<F: Motion, L: StateFunction>() -> Vec<ElementKind<F, L>> {
    vec![
        ElementKind::plain(BumpStop::object()),
        ElementKind::plain(WallContact::object()),
        ElementKind::plain(ProfileContact::object()),
        ElementKind::plain(ProfileFace::object()),
        ElementKind::rigid_contact(&rigid::STOP, rigid::stop_gap()),
        ElementKind::rigid_contact(&rigid::WALL, rigid::wall_gap()),
    ]
}
