//! Steps from the last to the first, integrated again from check-points where they were not kept.

use crate::checkpointing::trajectory_store::{Checkpointable, TrajectoryStore};
use crate::{Error, Result};

/// The steps of a motion on the way back, in the memory that its log was given.
///
/// Where the log is not whole, the steps before the one that is wanted are integrated again from the check-point before
/// them, with the same bits. While they are too many to be kept, further check-points are laid on the way, where a
/// binomial schedule wants them: with s check-points and no step integrated more than r times over, β(s, r) = (s+r)!/(s! r!)
/// stretches can be gone back.
///
/// **Source.** Griewank & Walther, *ACM Trans. Math. Softw.* 26 (2000) 19–45 (algorithm 799, "revolve").
pub(crate) struct ReversePlayback<'l, C: Checkpointable> {
    log: &'l TrajectoryStore<C::Checkpoint>,
    /// The motion and its first check-point, if the log is not whole.
    again: Option<(C, C::Checkpoint)>,
    /// Check-points laid on the way back.
    extra_checkpoints: Vec<(usize, C::Checkpoint)>,
    /// Steps in a row, from number `first` on.
    values: Vec<f64>,
    first: usize,
    /// Most memory in use so far, in bytes.
    peak: usize,
    /// Steps that were integrated again.
    repeated: usize,
}

impl<'l, C: Checkpointable> ReversePlayback<'l, C> {
    /// At the end of the motion that left `log`; `course` makes the same before its first step.
    ///
    /// **Errors.** [`Error::Definition`] if the memory does not suffice for four check-points.
    pub fn new(log: &'l TrajectoryStore<C::Checkpoint>, course: impl FnOnce() -> Result<C>) -> Result<Self> {
        let (budget, peak) = (log.budget, log.bytes());
        if log.is_whole() {
            return Ok(Self {
                log,
                again: None,
                extra_checkpoints: Vec::new(),
                values: Vec::new(),
                first: 0,
                peak,
                repeated: 0,
            });
        }
        if budget.limit < budget.least || budget.marks == 0 {
            let why = format!("the adjoint needs check-points, and {} bytes do not hold them", budget.limit);
            let remedy = format!("give at least {} bytes, or take the direct method", budget.least);
            return Err(Error::definition("memory for steps", why, remedy));
        }
        let course = course()?;
        let begin = course.mark();
        let again = Some((course, begin));
        Ok(Self { log, again, extra_checkpoints: Vec::new(), values: Vec::new(), first: 0, peak, repeated: 0 })
    }

    /// What was kept of step `k` (from 0), which is not after the one asked for before.
    pub fn row(&mut self, k: usize) -> Result<&[f64]> {
        let Some((mut course, begin)) = self.again.take() else { return Ok(self.log.row(k)) };
        let width = course.width();
        if !(self.first..self.first + self.values.len() / width).contains(&k) {
            self.integrate_to(k + 1, &mut course, &begin)?;
        }
        self.again = Some((course, begin));
        Ok(&self.values[(k - self.first) * width..(k - self.first + 1) * width])
    }

    /// Most memory that steps and check-points took, in bytes.
    pub fn peak(&self) -> usize {
        self.peak
    }

    /// Steps that were integrated again.
    pub fn repeated(&self) -> usize {
        self.repeated
    }

    /// Makes a row of steps of which number `end` − 1 is the last.
    fn integrate_to(&mut self, end: usize, course: &mut C, begin: &C::Checkpoint) -> Result<()> {
        self.values.clear();
        self.extra_checkpoints.retain(|(count, _)| *count < end);
        self.resume_before(end, course, begin)?;
        let (window, from) = (self.log.budget.window, course.taken());
        loop {
            let left = (end - course.taken()).div_ceil(window);
            let free = self.log.budget.marks - self.extra_checkpoints.len();
            if left <= 1 || free == 0 {
                break;
            }
            go(course, window * first_part(left, free + 1))?;
            self.extra_checkpoints.push((course.taken(), course.mark()));
        }
        let rest = end - course.taken();
        go(course, rest.saturating_sub(window))?;
        self.first = course.taken();
        self.values.reserve_exact(window.min(rest) * course.width());
        while course.taken() < end {
            go(course, 1)?;
            course.write(&mut self.values);
        }
        self.repeated += end - from;
        let used =
            self.log.bytes() + self.extra_checkpoints.len() * self.log.mark_bytes() + size_of_val(&self.values[..]);
        self.peak = self.peak.max(used);
        Ok(())
    }

    /// To the last check-point before step number `end` ends.
    fn resume_before(&self, end: usize, course: &mut C, begin: &C::Checkpoint) -> Result<()> {
        let of_log = self.log.marks.iter().rfind(|(count, _)| *count < end);
        let all = self.extra_checkpoints.last().into_iter().chain(of_log);
        course.resume(all.max_by_key(|(count, _)| *count).map_or(begin, |(_, mark)| mark))
    }
}

fn go(course: &mut impl Checkpointable, steps: usize) -> Result<()> {
    (0..steps).try_for_each(|_| course.step())
}

/// Of `stretches` > 1 in a row the number before the next check-point, if with the one at the beginning there can be
/// `marks` > 1.
fn first_part(stretches: usize, marks: usize) -> usize {
    let advance_to = |marks: usize, times: usize| {
        (1..=times).fold(1usize, |product, k| (product.saturating_mul(marks + k) / k).min(1 << 48))
    };
    let times = (0..).find(|&times| advance_to(marks, times) >= stretches).expect("it grows");
    stretches.saturating_sub(advance_to(marks - 1, times)).clamp(1, stretches - 1)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// x ← a x + 1, whose state is x alone.
    struct Map {
        taken: usize,
        x: f64,
    }

    impl Checkpointable for Map {
        type Checkpoint = (usize, f64);
        fn taken(&self) -> usize {
            self.taken
        }
        fn step(&mut self) -> Result<()> {
            (self.taken, self.x) = (self.taken + 1, 0.7 * self.x + 1.0);
            Ok(())
        }
        fn mark(&self) -> Self::Checkpoint {
            (self.taken, self.x)
        }
        fn mark_bytes(&self) -> usize {
            16
        }
        fn resume(&mut self, mark: &Self::Checkpoint) -> Result<()> {
            (self.taken, self.x) = *mark;
            Ok(())
        }
        fn write(&self, to: &mut Vec<f64>) {
            to.push(self.x);
        }
        fn width(&self) -> usize {
            1
        }
    }

    /// Steps repeated and peak memory of going back over `steps` steps in `limit` bytes.
    fn back(steps: usize, limit: usize) -> (usize, usize) {
        let start = || Map { taken: 0, x: 0.3 };
        let mut course = start();
        let (mut log, mut expected) = (TrajectoryStore::of(&course, limit), Vec::new());
        for _ in 0..steps {
            course.step().unwrap();
            expected.push(course.x);
            log.keep(&course);
        }
        let mut rewind = ReversePlayback::new(&log, || Ok(start())).unwrap();
        for k in (0..steps).rev() {
            assert_eq!(rewind.row(k).unwrap(), [expected[k]]);
        }
        assert!(rewind.peak() <= limit, "{} of {limit}", rewind.peak());
        (rewind.repeated(), rewind.peak())
    }

    #[test]
    fn every_step_comes_back_whatever_the_memory() {
        for steps in [1, 2, 7, 100, 1000, 4321] {
            for limit in [64, 100, 256, 1000, 5000] {
                back(steps, limit);
            }
        }
        assert_eq!(back(100, 8 * 120 + 2 * 16), (0, 800 + 16));
        // Twice as long as the memory: every step but those of the last row is taken once more.
        let (repeated, _) = back(1000, 4096);
        assert!(repeated <= 1000, "{repeated}");
        // A hundredth of the memory that all steps would take.
        let (repeated, _) = back(10_000, 800);
        assert!(repeated < 80_000, "{repeated}");
    }

    #[test]
    fn too_little_memory_is_refused() {
        let mut log = TrajectoryStore::of(&Map { taken: 0, x: 0.0 }, 50);
        (0..20).for_each(|_| log.keep(&Map { taken: 0, x: 0.0 }));
        let error = ReversePlayback::new(&log, || Ok(Map { taken: 0, x: 0.0 })).err().unwrap();
        assert!(error.to_string().contains("64 bytes"), "{error}");
    }

    #[test]
    fn binomial_numbers_of_stretches_are_gone_back() {
        // β(3, 2) = 10 stretches with three check-points: first those that two check-points cannot take, 10 − β(2, 2).
        assert_eq!(first_part(10, 3), 4);
        assert_eq!(first_part(2, 2), 1);
    }
}
