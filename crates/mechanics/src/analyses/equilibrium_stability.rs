//! Warnings about static equilibria that are unstable.

use crate::constraint_rank::ConstraintRank;
use crate::equilibrium::largest_force;
use crate::mechanism::Mechanism;
use crate::system::linearization::Linearization;
use crate::system::state::State;
use crate::system::{System, Unknown};
use error::Seconds;
use nalgebra::{Cholesky, DMatrix, DVector};

/// Largest negative stiffness that counts as zero, relative to the largest one of the mechanism: equilibria that are neutral have one of the
/// size of rounding errors.
const NEUTRAL: f64 = 1e-11;

/// Largest difference of the stiffness from its transpose, relative to its largest entry, at which all forces have a potential.
const SYMMETRIC: f64 = 1e-11;

/// Largest sum of the cubes of the numbers of coordinates over all equilibria that are examined.
const LARGEST_WORK: f64 = 5e8;

/// Number of steps of the inverse iteration for the direction in which an equilibrium is unstable.
const ITERATIONS: usize = 30;

/// Recorder of unstable equilibria.
///
/// An equilibrium is unstable if the derivative of the forces, reduced to the motions that satisfy the constraints, has a negative
/// eigenvalue. This holds for forces with a potential; equilibria in which the reduced matrix is not symmetric, as with follower forces, are not
/// examined. Of many equilibria of a large mechanism some are examined only, and none of one with more than 790 coordinates.
pub(crate) struct StabilityWatch {
    system: Option<System>,
    /// Each equilibrium whose number is a multiple of this one is examined.
    stride: usize,
    /// Number of recorded equilibria.
    count: usize,
    /// The time in s of the first one that is unstable, and the coordinate that moves most away from it.
    first: Option<(f64, usize)>,
    /// Number of further ones.
    others: usize,
}

impl StabilityWatch {
    /// Recorder of `count` equilibria.
    pub fn new(mechanism: &Mechanism<f64>, count: usize) -> Self {
        let system = System::new(mechanism).ok();
        let size = system.as_ref().map_or(0, |system| coordinates_of(system).len());
        let most = (LARGEST_WORK / (size as f64).powi(3)).min(count as f64).floor() as usize;
        let stride = if most == 0 { 0 } else { count.div_ceil(most) };
        Self { system: system.filter(|_| most > 0), stride, count: 0, first: None, others: 0 }
    }

    /// Records the equilibrium `state`, with its reactions.
    pub fn add(&mut self, mechanism: &Mechanism<f64>, state: &State<f64>) {
        let Some(system) = &mut self.system else { return };
        self.count += 1;
        if !(self.count - 1).is_multiple_of(self.stride) {
            return;
        }
        if let Some(coordinate) = unstable_coordinate(system, mechanism, state) {
            match self.first {
                None => self.first = Some((state.t, coordinate)),
                Some(_) => self.others += 1,
            }
        }
    }

    /// The warning about the first unstable equilibrium.
    pub fn warning(&self, mechanism: &Mechanism<f64>) -> Option<String> {
        let (t, coordinate) = self.first?;
        let others = match self.others {
            0 => String::new(),
            count => format!(" (and {count} more)"),
        };
        Some(format!(
            "{}: the static equilibrium at t = {}{others} is unstable: after a small disturbance this coordinate moves away from it; start \
             from other positions, or disturb it by a small load or imperfection, to find a stable one",
            mechanism.coordinates[coordinate].name,
            Seconds(t)
        ))
    }
}

/// The warning about one equilibrium, if it is unstable.
pub(crate) fn warn_of_unstable_equilibrium(mechanism: &Mechanism<f64>, state: &State<f64>) -> Option<String> {
    let mut watch = StabilityWatch::new(mechanism, 1);
    watch.add(mechanism, state);
    watch.warning(mechanism)
}

/// Equations and numbers of the free coordinates.
fn coordinates_of(system: &System) -> Vec<(usize, usize)> {
    let coordinate = |(equation, unknown): (usize, &Unknown)| match *unknown {
        Unknown::Coordinate(i) => Some((equation, i)),
        Unknown::Multiplier(_) => None,
    };
    system.unknowns().iter().enumerate().filter_map(coordinate).collect()
}

/// The coordinate that moves most along the motion of the most negative stiffness, if the equilibrium `state` is unstable and all forces have
/// a potential.
fn unstable_coordinate(system: &mut System, mechanism: &Mechanism<f64>, state: &State<f64>) -> Option<usize> {
    let free = coordinates_of(system);
    let constraints = ConstraintRank::of(system, mechanism, state);
    if free.len() == constraints.rank() {
        return None;
    }
    let mut rows = vec![[0.0]; system.size()];
    system.assemble(mechanism, state, Linearization::statics(), &mut rows);
    let dense = system.dense();
    let stiffness = DMatrix::from_fn(free.len(), free.len(), |i, j| dense[(free[i].0, free[j].0)]);
    let scale = stiffness.amax().max(largest_force(mechanism, state));
    if !(scale > 0.0 && scale.is_finite()) {
        return None;
    }
    let project = |matrix: &DMatrix<f64>| projected(&constraints, &free, matrix, state.q.len());
    let reduced = project(&project(&stiffness).transpose());
    if (&reduced - reduced.transpose()).amax() > SYMMETRIC * scale {
        return None;
    }
    // Directions that violate the constraints get the stiffness `scale`.
    let identity = DMatrix::identity(free.len(), free.len());
    let held = &identity - project(&identity);
    let reduced = (&reduced + reduced.transpose()) * 0.5 + held * scale;
    let shifted = |shift: f64| Cholesky::new(&reduced + &identity * shift);
    if shifted(NEUTRAL * scale).is_some() {
        return None;
    }
    // Of a matrix that a shift makes positive definite, the smallest eigenvalue is the most negative one of the stiffness.
    let shifts = (1..).map(|k| NEUTRAL * scale * 10f64.powi(k)).take_while(|shift| shift.is_finite());
    let factor = shifts.into_iter().find_map(shifted)?;
    let mut direction = DVector::from_fn(free.len(), |i, _| (1.0 + 2.3 * i as f64).sin());
    for _ in 0..ITERATIONS {
        factor.solve_mut(&mut direction);
        direction /= direction.amax();
    }
    Some(free[direction.iamax()].1)
}

/// The matrix with the columns reduced to the motions that satisfy the constraints.
fn projected(
    constraints: &ConstraintRank,
    free: &[(usize, usize)],
    matrix: &DMatrix<f64>,
    size: usize,
) -> DMatrix<f64> {
    let (mut projected, mut motion) = (matrix.clone(), vec![0.0; size]);
    for mut column in projected.column_iter_mut() {
        free.iter().zip(column.iter()).for_each(|(&(_, i), x)| motion[i] = *x);
        constraints.project(&mut motion);
        free.iter().zip(column.iter_mut()).for_each(|(&(_, i), x)| *x = motion[i]);
    }
    projected
}
