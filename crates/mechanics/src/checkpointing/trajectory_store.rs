//! Steps of a motion within a memory limit: all steps, or checkpoints from which they can be recomputed.

use crate::Result;

/// A simulation that can be resumed from a checkpoint with the same bits.
pub trait Checkpointable {
    /// All data needed to resume.
    type Checkpoint: Clone;

    /// Number of steps taken.
    fn steps_taken(&self) -> usize;

    /// Takes the next step.
    fn step(&mut self) -> Result<()>;

    /// A checkpoint after the steps taken.
    fn checkpoint(&self) -> Self::Checkpoint;

    /// Memory of a checkpoint in bytes.
    fn checkpoint_bytes(&self) -> usize;

    /// Returns to a checkpoint of the same simulation.
    fn resume(&mut self, checkpoint: &Self::Checkpoint) -> Result<()>;

    /// Appends the numbers stored for the step just taken: [`Checkpointable::width`] of them.
    fn write(&self, to: &mut Vec<f64>);

    /// Number of values stored per step.
    fn width(&self) -> usize;
}

/// Division of the memory: half for consecutive steps, a quarter for checkpoints of the simulation and a quarter for extra
/// checkpoints of the playback.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct MemoryDivision {
    /// Memory limit in bytes.
    pub limit: usize,
    /// Largest number of checkpoints of either kind.
    pub checkpoints: usize,
    /// Largest number of consecutive steps.
    pub window: usize,
    /// Smallest number of bytes for which playback is possible: the larger of four checkpoints and four steps.
    pub least: usize,
}

impl MemoryDivision {
    fn of(simulation: &impl Checkpointable, limit: usize) -> Self {
        let (checkpoint, row) = (simulation.checkpoint_bytes().max(1), (size_of::<f64>() * simulation.width()).max(1));
        let (checkpoints, window) = (limit / 4 / checkpoint, (limit / 2 / row).max(1));
        Self { limit, checkpoints, window, least: (4 * checkpoint).max(4 * row) }
    }
}

/// Steps of a motion: all of them if they fit into memory, and evenly spaced checkpoints.
#[derive(Clone)]
pub struct TrajectoryStore<C> {
    /// Division of the memory.
    pub budget: MemoryDivision,
    /// Checkpoints, each with the number of steps before it.
    pub checkpoints: Vec<(usize, C)>,
    /// Steps between checkpoints.
    stride: usize,
    checkpoint_bytes: usize,
    width: usize,
    count: usize,
    is_complete: bool,
    values: Vec<f64>,
    /// Output times with the number of steps up to them.
    reached: Vec<(f64, usize)>,
}

impl<C: Clone> TrajectoryStore<C> {
    /// Store for a motion that has not begun, in at most `limit` bytes.
    pub fn of(simulation: &impl Checkpointable<Checkpoint = C>, limit: usize) -> Self {
        let budget = MemoryDivision::of(simulation, limit);
        Self {
            budget,
            checkpoints: Vec::new(),
            stride: budget.window,
            checkpoint_bytes: simulation.checkpoint_bytes(),
            width: simulation.width(),
            count: 0,
            is_complete: true,
            values: Vec::new(),
            reached: Vec::new(),
        }
    }

    /// Stores the step just taken.
    pub fn push(&mut self, simulation: &impl Checkpointable<Checkpoint = C>) {
        self.count += 1;
        if self.count.is_multiple_of(self.stride) && self.budget.checkpoints > 0 {
            if self.checkpoints.len() == self.budget.checkpoints {
                self.stride *= 2;
                self.checkpoints.retain(|(count, _)| count.is_multiple_of(self.stride));
            }
            if self.count.is_multiple_of(self.stride) {
                self.checkpoints.push((self.count, simulation.checkpoint()));
            }
        }
        let bytes = self.bytes() + size_of::<f64>() * self.width;
        if self.is_complete && bytes > self.budget.limit {
            (self.is_complete, self.values) = (false, Vec::new());
        }
        if self.is_complete {
            simulation.write(&mut self.values);
        }
    }

    /// Records that the steps so far reach the output time `t` (s).
    pub fn mark_output(&mut self, t: f64) {
        self.reached.push((t, self.count));
    }

    /// Number of steps up to the output time `t` (s).
    pub fn steps_to(&self, t: f64) -> usize {
        self.reached.iter().find(|(reached, _)| *reached >= t).map_or(self.count, |&(_, count)| count)
    }

    /// Number of steps.
    pub fn steps(&self) -> usize {
        self.count
    }

    /// Returns whether every step is stored.
    pub fn is_complete(&self) -> bool {
        self.is_complete
    }

    /// Memory of steps and checkpoints in bytes.
    pub fn bytes(&self) -> usize {
        size_of_val(&self.values[..]) + self.checkpoints.len() * self.checkpoint_bytes
    }

    /// Memory of one checkpoint in bytes.
    pub fn checkpoint_bytes(&self) -> usize {
        self.checkpoint_bytes
    }

    /// Values stored for step `k` (from 0), if every step is stored.
    pub fn row(&self, k: usize) -> &[f64] {
        &self.values[k * self.width..(k + 1) * self.width]
    }
}
