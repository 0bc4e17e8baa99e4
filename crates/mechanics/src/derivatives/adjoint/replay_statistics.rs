//! What a way back takes besides itself.

use crate::checkpointing::reverse_playback::ReversePlayback;
use crate::checkpointing::trajectory_store::Checkpointable;

/// Memory for the steps of a motion, and steps that were integrated again because it did not suffice for all.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct ReplayStatistics {
    /// Most bytes in use at a time for steps and check-points.
    pub memory: usize,
    /// Steps of the motion.
    pub steps: usize,
    /// Steps integrated again.
    pub repeated: usize,
}

impl ReplayStatistics {
    pub(crate) fn of<C: Checkpointable>(steps: usize, rewind: &ReversePlayback<'_, C>) -> Self {
        Self { memory: rewind.peak(), steps, repeated: rewind.repeated() }
    }
}
