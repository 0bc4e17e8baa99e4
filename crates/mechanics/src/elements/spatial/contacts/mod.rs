//! Compliant contacts in space.

pub(crate) mod sphere_contact3;
pub(crate) mod sphere_plane3;
pub(crate) mod sphere_sphere3;

pub use sphere_plane3::SpherePlane3;
pub use sphere_sphere3::SphereSphere3;

use crate::elements::kind::ElementKind;
use crate::elements::state_function::StateFunction;
use crate::motion::Motion;

/// Contacts in space by their declarations.
pub fn kinds<F: Motion, L: StateFunction>() -> Vec<ElementKind<F, L>> {
    vec![ElementKind::plain(SpherePlane3::object()), ElementKind::plain(SphereSphere3::object())]
}
