//! Recorded time steps within a memory limit, and their playback from the last to the first.

pub mod recording;
pub(crate) mod reverse_playback;
pub(crate) mod trajectory_store;
