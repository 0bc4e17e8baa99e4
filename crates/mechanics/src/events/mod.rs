//! Events: impacts of rigid contacts, and switches of forces.

pub(crate) mod event;
pub(crate) mod impact;
pub mod location;
