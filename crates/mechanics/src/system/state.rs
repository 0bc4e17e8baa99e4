//! The state of a mechanism at one instant.

use crate::mechanism::Mechanism;
use crate::mechanism::scalars::StateScalar;

/// Positions, velocities and accelerations of all coordinates, and all multipliers, at time `t` (s).
#[derive(Clone, Debug, PartialEq)]
pub struct State<T> {
    /// Time in s. It carries derivatives where the design decides when something happens.
    pub t: T,
    /// Positions, one per coordinate.
    pub q: Vec<T>,
    /// Velocities.
    pub v: Vec<T>,
    /// Accelerations.
    pub a: Vec<T>,
    /// Multipliers: reactions of the joints.
    pub l: Vec<T>,
}

impl<T: StateScalar> State<T> {
    /// The state that the mechanism was built in, its prescribed coordinates where the motions want them at `t`.
    pub fn built(mechanism: &Mechanism<T>, t: f64) -> Self {
        let zero = T::from(0.0);
        let mut state = Self {
            t: T::from(t),
            q: mechanism.coordinates.iter().map(|c| c.position).collect(),
            v: mechanism.coordinates.iter().map(|c| c.velocity).collect(),
            a: vec![zero; mechanism.coordinates.len()],
            l: vec![zero; mechanism.multipliers],
        };
        state.prescribe(mechanism);
        state
    }

    /// Puts the prescribed coordinates where the motions want them at the state's time.
    pub fn prescribe(&mut self, mechanism: &Mechanism<T>) {
        for (i, coordinate) in mechanism.coordinates.iter().enumerate() {
            if let Some((motion, parameters)) = &coordinate.motion {
                [self.q[i], self.v[i], self.a[i]] = T::motion(motion.as_ref(), parameters, self.t);
            }
        }
    }

    /// Copies `other` without allocating.
    pub fn copy_from(&mut self, other: &Self) {
        self.t = other.t;
        self.q.copy_from_slice(&other.q);
        self.v.copy_from_slice(&other.v);
        self.a.copy_from_slice(&other.a);
        self.l.copy_from_slice(&other.l);
    }
}
