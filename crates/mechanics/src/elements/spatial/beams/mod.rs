//! Beams in space.

pub(crate) mod beam3;
pub(crate) mod section3;

pub use beam3::Beam3;
pub use section3::BeamSection3;

use crate::elements::kind::ElementKind;
use crate::elements::state_function::StateFunction;
use crate::motion::Motion;

/// Beams in space by their declarations.
pub fn kinds<F: Motion, L: StateFunction>() -> Vec<ElementKind<F, L>> {
    vec![ElementKind::plain(Beam3::object())]
}
