//! CPU time of this process, which depends less on other work of the machine than elapsed time.

/// CPU time of all threads of this process in s; wall time if the system does not provide it.
pub fn cpu() -> f64 {
    let tasks = std::fs::read_dir("/proc/self/task").into_iter().flatten().flatten();
    let spent = tasks.filter_map(|task| {
        let text = std::fs::read_to_string(task.path().join("schedstat")).ok()?;
        text.split_whitespace().next()?.parse::<f64>().ok()
    });
    let spent: Vec<f64> = spent.collect();
    let wall = || std::time::SystemTime::now().duration_since(std::time::UNIX_EPOCH).map_or(0.0, |d| d.as_secs_f64());
    // A process that has just begun has spent nothing.
    if spent.is_empty() { wall() } else { spent.iter().sum::<f64>() * 1e-9 }
}

/// Minimum over several batches of the mean CPU time of a run, in s; a batch takes 0.2 s because the clock is coarse.
pub fn least<T>(batches: usize, mut run: impl FnMut() -> T) -> f64 {
    let mut batch = || {
        let (start, mut runs) = (cpu(), 0.0);
        loop {
            std::hint::black_box(run());
            runs += 1.0;
            let spent = cpu() - start;
            if spent >= 0.2 {
                return spent / runs;
            }
        }
    };
    (0..batches).map(|_| batch()).fold(f64::INFINITY, f64::min)
}

/// [`least`] for several jobs that alternate, so that other work of the machine affects all of them equally.
#[allow(dead_code)] // not every benchmark compares
pub fn in_turns<const N: usize>(rounds: usize, mut jobs: [&mut dyn FnMut(); N]) -> [f64; N] {
    let mut best = [f64::INFINITY; N];
    for _ in 0..rounds {
        for (best, job) in best.iter_mut().zip(&mut jobs) {
            *best = best.min(least(1, job));
        }
    }
    best
}
