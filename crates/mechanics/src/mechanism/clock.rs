//! The time that a running simulation has reached.

use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

/// The time in s that the running simulations of a mechanism have reached, for a display of their progress.
///
/// Clones share one time. If several simulations run at once, it is that of the last step of any of them; results do not depend on it.
///
/// ```
/// use linkwright_mechanics::prelude::*;
/// use linkwright_mechanics::{SimulationClock, simulate};
///
/// let mut mechanism = Mechanism::<f64>::with_gravity(0.0, -9.81);
/// mechanism.body("stone", 1.0, 0.1, Pose { x: 0.0, y: 0.0, theta: 0.0 });
/// let clock = SimulationClock::default();
/// assert_eq!(clock.time(), None);
/// mechanism.set_clock(clock.clone());
/// simulate(&mechanism, &Dynamics::fixed(0.01), &[0.0, 0.5])?;
/// assert!(clock.time().is_some_and(|t| (t - 0.5).abs() < 1e-9));
/// # Ok::<(), linkwright_mechanics::Error>(())
/// ```
#[derive(Clone, Debug)]
pub struct SimulationClock(Arc<AtomicU64>);

impl Default for SimulationClock {
    fn default() -> Self {
        Self(Arc::new(AtomicU64::new(f64::NAN.to_bits())))
    }
}

impl SimulationClock {
    /// The time at the end of the last step in s; `None` before the first one.
    pub fn time(&self) -> Option<f64> {
        Some(f64::from_bits(self.0.load(Ordering::Relaxed))).filter(|time| time.is_finite())
    }

    pub(crate) fn set(&self, time: f64) {
        self.0.store(time.to_bits(), Ordering::Relaxed);
    }
}
