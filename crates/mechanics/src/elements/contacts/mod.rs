//! Compliant contacts.

pub(crate) mod bump_stop;
pub(crate) mod hunt_crossley;
pub(crate) mod wall_contact;

pub use bump_stop::BumpStop;
pub use wall_contact::WallContact;
