//! Playback of steps from the last to the first, recomputed from checkpoints where they are not stored.

use crate::checkpointing::trajectory_store::{Checkpointable, TrajectoryStore};
use crate::{Error, Result};

/// The steps of a motion from the last to the first, within the memory limit of their store.
///
/// If the store does not hold every step, steps are integrated again from the last checkpoint before them, with the same
/// bits. If these are too many for the memory, extra checkpoints are stored by a binomial schedule: with s checkpoints, and
/// no step integrated more than r times, β(s, r) = (s+r)!/(s! r!) blocks of steps can be played back.
///
/// # Sources
///
/// Griewank & Walther, *ACM Trans. Math. Softw.* 26 (2000) 19–45 (algorithm 799, "revolve").
pub(crate) struct ReversePlayback<'s, C: Checkpointable> {
    store: &'s TrajectoryStore<C::Checkpoint>,
    /// The simulation and its first checkpoint, unless every step is stored.
    replay: Option<(C, C::Checkpoint)>,
    /// Checkpoints stored during playback, with the number of steps before them.
    extra_checkpoints: Vec<(usize, C::Checkpoint)>,
    /// Values of consecutive steps, from step `first` on.
    values: Vec<f64>,
    first: usize,
    /// Largest memory in use so far, in bytes.
    peak: usize,
    /// Number of steps integrated again.
    repeated: usize,
}

impl<'s, C: Checkpointable> ReversePlayback<'s, C> {
    /// Playback from the last step in `store`; `simulation` returns the same simulation before its first step.
    ///
    /// # Errors
    ///
    /// [`Error::Definition`] if the memory does not suffice for four checkpoints.
    pub fn new(store: &'s TrajectoryStore<C::Checkpoint>, simulation: impl FnOnce() -> Result<C>) -> Result<Self> {
        let (budget, peak) = (store.budget, store.bytes());
        let whole = Self {
            store,
            replay: None,
            extra_checkpoints: Vec::new(),
            values: Vec::new(),
            first: 0,
            peak,
            repeated: 0,
        };
        if store.is_complete() {
            return Ok(whole);
        }
        if budget.limit < budget.least || budget.checkpoints == 0 {
            let why = format!("the adjoint method needs checkpoints, and {} bytes do not hold them", budget.limit);
            let remedy = format!("give at least {} bytes, or use the direct method", budget.least);
            return Err(Error::definition("memory for steps", why, remedy));
        }
        let simulation = simulation()?;
        let begin = simulation.checkpoint();
        Ok(Self { replay: Some((simulation, begin)), ..whole })
    }

    /// Values stored for step `k` (from 0); `k` must not increase from call to call.
    pub fn row(&mut self, k: usize) -> Result<&[f64]> {
        let Some((mut simulation, begin)) = self.replay.take() else { return Ok(self.store.row(k)) };
        let width = simulation.width();
        if !(self.first..self.first + self.values.len() / width).contains(&k) {
            self.integrate_to(k + 1, &mut simulation, &begin)?;
        }
        self.replay = Some((simulation, begin));
        Ok(&self.values[(k - self.first) * width..(k - self.first + 1) * width])
    }

    /// Largest memory of steps and checkpoints, in bytes.
    pub fn peak(&self) -> usize {
        self.peak
    }

    /// Number of steps integrated again.
    pub fn repeated(&self) -> usize {
        self.repeated
    }

    /// Re-integrates a block of steps that ends with step `end` − 1.
    fn integrate_to(&mut self, end: usize, simulation: &mut C, begin: &C::Checkpoint) -> Result<()> {
        self.values.clear();
        self.extra_checkpoints.retain(|(count, _)| *count < end);
        self.resume_before(end, simulation, begin)?;
        let (window, from) = (self.store.budget.window, simulation.steps_taken());
        loop {
            let left = (end - simulation.steps_taken()).div_ceil(window);
            let free = self.store.budget.checkpoints - self.extra_checkpoints.len();
            if left <= 1 || free == 0 {
                break;
            }
            advance(simulation, window * first_segment(left, free + 1))?;
            self.extra_checkpoints.push((simulation.steps_taken(), simulation.checkpoint()));
        }
        let rest = end - simulation.steps_taken();
        advance(simulation, rest.saturating_sub(window))?;
        self.first = simulation.steps_taken();
        self.values.reserve_exact(window.min(rest) * simulation.width());
        while simulation.steps_taken() < end {
            advance(simulation, 1)?;
            simulation.write(&mut self.values);
        }
        self.repeated += end - from;
        let used = self.store.bytes()
            + self.extra_checkpoints.len() * self.store.checkpoint_bytes()
            + size_of_val(&self.values[..]);
        self.peak = self.peak.max(used);
        Ok(())
    }

    /// Resumes from the last checkpoint before the end of step `end` − 1.
    fn resume_before(&self, end: usize, simulation: &mut C, begin: &C::Checkpoint) -> Result<()> {
        let stored = self.store.checkpoints.iter().rfind(|(count, _)| *count < end);
        let all = self.extra_checkpoints.last().into_iter().chain(stored);
        simulation.resume(all.max_by_key(|(count, _)| *count).map_or(begin, |(_, checkpoint)| checkpoint))
    }
}

/// Takes a number of steps.
fn advance(simulation: &mut impl Checkpointable, steps: usize) -> Result<()> {
    (0..steps).try_for_each(|_| simulation.step())
}

/// Number of blocks to integrate before the next checkpoint, for `blocks` > 1 and `checkpoints` > 1, of which one is at the
/// beginning of the blocks.
fn first_segment(blocks: usize, checkpoints: usize) -> usize {
    let reachable = |checkpoints: usize, times: usize| {
        (1..=times).fold(1usize, |product, k| (product.saturating_mul(checkpoints + k) / k).min(1 << 48))
    };
    let times =
        (0..).find(|&times| reachable(checkpoints, times) >= blocks).expect("the number grows with the repetitions");
    blocks.saturating_sub(reachable(checkpoints - 1, times)).clamp(1, blocks - 1)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// x ← a x + 1, whose state is x alone.
    struct Map {
        steps_taken: usize,
        x: f64,
    }

    impl Checkpointable for Map {
        type Checkpoint = (usize, f64);
        fn steps_taken(&self) -> usize {
            self.steps_taken
        }
        fn step(&mut self) -> Result<()> {
            (self.steps_taken, self.x) = (self.steps_taken + 1, 0.7 * self.x + 1.0);
            Ok(())
        }
        fn checkpoint(&self) -> Self::Checkpoint {
            (self.steps_taken, self.x)
        }
        fn checkpoint_bytes(&self) -> usize {
            16
        }
        fn resume(&mut self, checkpoint: &Self::Checkpoint) -> Result<()> {
            (self.steps_taken, self.x) = *checkpoint;
            Ok(())
        }
        fn write(&self, to: &mut Vec<f64>) {
            to.push(self.x);
        }
        fn width(&self) -> usize {
            1
        }
    }

    /// Steps repeated and peak memory of the playback of `steps` steps in `limit` bytes.
    fn play_back(steps: usize, limit: usize) -> (usize, usize) {
        let start = || Map { steps_taken: 0, x: 0.3 };
        let mut simulation = start();
        let (mut store, mut expected) = (TrajectoryStore::of(&simulation, limit), Vec::new());
        for _ in 0..steps {
            simulation.step().unwrap();
            expected.push(simulation.x);
            store.push(&simulation);
        }
        let mut playback = ReversePlayback::new(&store, || Ok(start())).unwrap();
        for k in (0..steps).rev() {
            assert_eq!(playback.row(k).unwrap(), [expected[k]]);
        }
        assert!(playback.peak() <= limit, "{} of {limit}", playback.peak());
        (playback.repeated(), playback.peak())
    }

    #[test]
    fn every_step_is_played_back_with_any_memory() {
        for steps in [1, 2, 7, 100, 1000, 4321] {
            for limit in [64, 100, 256, 1000, 5000] {
                play_back(steps, limit);
            }
        }
        assert_eq!(play_back(100, 8 * 120 + 2 * 16), (0, 800 + 16));
        // Twice as long as the memory: every step except those of the last block is taken once more.
        let (repeated, _) = play_back(1000, 4096);
        assert!(repeated <= 1000, "{repeated}");
        // A hundredth of the memory of all steps.
        let (repeated, _) = play_back(10_000, 800);
        assert!(repeated < 80_000, "{repeated}");
    }

    #[test]
    fn too_little_memory_is_rejected() {
        let mut store = TrajectoryStore::of(&Map { steps_taken: 0, x: 0.0 }, 50);
        (0..20).for_each(|_| store.push(&Map { steps_taken: 0, x: 0.0 }));
        let error = ReversePlayback::new(&store, || Ok(Map { steps_taken: 0, x: 0.0 })).err().unwrap();
        assert!(error.to_string().contains("64 bytes"), "{error}");
    }

    #[test]
    fn checkpoints_follow_the_binomial_schedule() {
        // β(3, 2) = 10 blocks with three checkpoints: first the blocks beyond the reach of two, 10 − β(2, 2).
        assert_eq!(first_segment(10, 3), 4);
        assert_eq!(first_segment(2, 2), 1);
    }
}
