//! Recorded time steps within a memory limit, and their playback from the last to the first.
//!
//! | file | contents |
//! |---|---|
//! | `trajectory_store` | all steps of a motion, or checkpoints if they do not fit into memory |
//! | `reverse_playback` | steps from the last to the first, recomputed from checkpoints (revolve) |
//! | `recording` | recordings of motions by implicit and explicit steps |

pub mod recording;
pub(crate) mod reverse_playback;
pub(crate) mod trajectory_store;

pub use recording::{ExplicitRecording, Recording};
