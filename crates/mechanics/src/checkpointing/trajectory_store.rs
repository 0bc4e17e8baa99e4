//! The steps of a motion in a limited memory: all of them, or check-points to go on from.

use crate::Result;

/// A motion that goes on from step to step, and from any of its check-points with the same bits.
pub trait Checkpointable {
    /// All that it takes to go on.
    type Checkpoint: Clone;

    /// Number of steps taken.
    fn taken(&self) -> usize;

    /// Takes the next step.
    fn step(&mut self) -> Result<()>;

    /// A check-point after the steps taken.
    fn mark(&self) -> Self::Checkpoint;

    /// Memory of a check-point in bytes.
    fn mark_bytes(&self) -> usize;

    /// Goes back, or forward, to a check-point of the same motion.
    fn resume(&mut self, mark: &Self::Checkpoint) -> Result<()>;

    /// Adds what is kept of the step just taken: always as many numbers.
    fn write(&self, to: &mut Vec<f64>);

    /// How many numbers that are.
    fn width(&self) -> usize;
}

/// How a memory is divided: half for steps in a row, a quarter each for check-points laid while the motion is simulated
/// and for more of them on the way back.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Budget {
    /// In bytes.
    pub limit: usize,
    /// Most check-points of either kind.
    pub marks: usize,
    /// Most steps in a row.
    pub window: usize,
    /// Least bytes with which there is a way back: four check-points, or two pairs of steps if they are longer.
    pub least: usize,
}

impl Budget {
    fn of(course: &impl Checkpointable, limit: usize) -> Self {
        let (mark, row) = (course.mark_bytes().max(1), (size_of::<f64>() * course.width()).max(1));
        Self { limit, marks: limit / 4 / mark, window: (limit / 2 / row).max(1), least: (4 * mark).max(4 * row) }
    }
}

/// The steps of a motion, all of them if the memory suffices.
#[derive(Clone)]
pub struct TrajectoryStore<M> {
    pub budget: Budget,
    /// Check-points, each with the number of steps before it, evenly spread.
    pub marks: Vec<(usize, M)>,
    /// Steps between check-points.
    stride: usize,
    mark_bytes: usize,
    width: usize,
    count: usize,
    is_whole: bool,
    values: Vec<f64>,
    /// Output times with the number of steps that reach them.
    reached: Vec<(f64, usize)>,
}

impl<M: Clone> TrajectoryStore<M> {
    /// For a motion that has not begun, in at most `limit` bytes.
    pub fn of(course: &impl Checkpointable<Checkpoint = M>, limit: usize) -> Self {
        let budget = Budget::of(course, limit);
        Self {
            budget,
            marks: Vec::new(),
            stride: budget.window,
            mark_bytes: course.mark_bytes(),
            width: course.width(),
            count: 0,
            is_whole: true,
            values: Vec::new(),
            reached: Vec::new(),
        }
    }

    /// Takes note of the step just taken.
    pub fn keep(&mut self, course: &impl Checkpointable<Checkpoint = M>) {
        self.count += 1;
        if self.count.is_multiple_of(self.stride) && self.budget.marks > 0 {
            if self.marks.len() == self.budget.marks {
                self.stride *= 2;
                self.marks.retain(|(count, _)| count.is_multiple_of(self.stride));
            }
            if self.count.is_multiple_of(self.stride) {
                self.marks.push((self.count, course.mark()));
            }
        }
        let bytes = self.bytes() + size_of::<f64>() * self.width;
        if self.is_whole && bytes > self.budget.limit {
            (self.is_whole, self.values) = (false, Vec::new());
        }
        if self.is_whole {
            course.write(&mut self.values);
        }
    }

    /// Takes note that an output time has been reached.
    pub fn advance_to(&mut self, t: f64) {
        self.reached.push((t, self.count));
    }

    /// Number of steps that reach the output time `t`.
    pub fn steps_to(&self, t: f64) -> usize {
        self.reached.iter().find(|(reached, _)| *reached >= t).map_or(self.count, |&(_, count)| count)
    }

    /// Number of steps.
    pub fn steps(&self) -> usize {
        self.count
    }

    /// Whether every step was kept.
    pub fn is_whole(&self) -> bool {
        self.is_whole
    }

    /// Memory of steps and check-points in bytes.
    pub fn bytes(&self) -> usize {
        size_of_val(&self.values[..]) + self.marks.len() * self.mark_bytes
    }

    /// Memory of one check-point in bytes.
    pub fn mark_bytes(&self) -> usize {
        self.mark_bytes
    }

    /// What was kept of step `k` (from 0), if all were.
    pub fn row(&self, k: usize) -> &[f64] {
        &self.values[k * self.width..(k + 1) * self.width]
    }
}
