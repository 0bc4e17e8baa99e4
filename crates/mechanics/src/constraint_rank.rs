//! Rank of the constraints: redundant constraints, indeterminate reactions, coordinates that no drive moves.

use crate::Error;
use crate::mechanism::Mechanism;
use crate::system::state::State;
use crate::system::{System, Unknown, name_of};
use error::Seconds;
use nalgebra::DMatrix;

/// Norm of the part of a gradient that is orthogonal to the gradients before it, relative to the whole, below which it counts as linearly
/// dependent.
const DEPENDENT: f64 = 1e-9;

/// Rank of the gradients Φ_q with respect to the free coordinates in one state, by Gram–Schmidt in the order of the joints.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct ConstraintRank {
    /// Multipliers whose gradients depend on those before them.
    pub redundant: Vec<usize>,
    /// Orthonormal basis of the gradients, as (coordinate, value): joints connect few coordinates.
    basis: Vec<Vec<(usize, f64)>>,
    /// The smallest relative norm of the part of a gradient that is independent of those before it, and its multiplier.
    smallest: (f64, usize),
}

impl ConstraintRank {
    /// The rank of the active constraints in the given state.
    pub fn of(system: &System, mechanism: &Mechanism<f64>, state: &State<f64>) -> Self {
        let (mut rank, is_active) = (Self::none(), active_constraints(mechanism, state));
        let rows = system.constraint_jacobian(mechanism, state).into_iter().enumerate();
        rows.filter(|(m, _)| is_active[*m]).for_each(|(m, row)| {
            rank.add(m, row);
        });
        rank
    }

    /// The rank of no constraints.
    pub fn none() -> Self {
        Self { redundant: Vec::new(), basis: Vec::new(), smallest: (f64::INFINITY, 0) }
    }

    /// Adds the gradient `row` of the multiplier `m`. Returns whether it is independent of the gradients before it.
    pub fn add(&mut self, m: usize, mut row: Vec<f64>) -> bool {
        let whole = norm(&row);
        self.project(&mut row);
        let rest = norm(&row);
        let share = rest / whole.max(1e-300);
        if share < self.smallest.0 {
            self.smallest = (share, m);
        }
        let is_independent = rest > DEPENDENT * whole.max(1e-300);
        match is_independent {
            true => {
                let entries = row.iter().enumerate().filter(|(_, x)| **x != 0.0);
                self.basis.push(entries.map(|(i, x)| (i, x / rest)).collect());
            }
            false => self.redundant.push(m),
        }
        is_independent
    }

    /// Returns whether the gradient `row` depends on those that were added.
    pub fn depends(&self, mut row: Vec<f64>) -> bool {
        let whole = norm(&row);
        self.project(&mut row);
        norm(&row) <= DEPENDENT * whole.max(1e-300)
    }

    /// The multiplier whose gradient has the smallest independent part.
    pub fn most_dependent(&self) -> Option<usize> {
        self.smallest.0.is_finite().then_some(self.smallest.1)
    }

    /// Number of independent constraints.
    pub fn rank(&self) -> usize {
        self.basis.len()
    }

    /// Subtracts from `direction` its components along the gradients; the rest satisfies Φ_q d = 0.
    pub fn project(&self, direction: &mut [f64]) {
        for _ in 0..2 {
            for other in &self.basis {
                let share: f64 = other.iter().map(|&(i, b)| direction[i] * b).sum();
                if share != 0.0 {
                    other.iter().for_each(|&(i, b)| direction[i] -= share * b);
                }
            }
        }
    }
}

/// For each multiplier, true if its joint is active. The gradient of an inactive one, such as an open contact, is zero.
fn active_constraints(mechanism: &Mechanism<f64>, state: &State<f64>) -> Vec<bool> {
    let mut is_active = vec![true; mechanism.multipliers];
    for instance in mechanism.elements.iter().filter(|instance| !state.modes.is_active(instance)) {
        is_active[instance.first_multiplier..][..instance.num_constraints].fill(false);
    }
    is_active
}

/// Relative norm of the independent part of a gradient below which a position counts as singular for an integration that stops near it.
const SINGULAR: f64 = 1e-3;

/// The error of an analysis that stops in or near a singular position, where constraints that are independent elsewhere
/// depend on each other: a dead centre, or a flat parallelogram. `None` if `state` is not near one.
pub(crate) fn singular_position(system: &System, mechanism: &Mechanism<f64>, state: &State<f64>) -> Option<Error> {
    let remedy = "if a drive moves it, the drive exceeds the reach of the mechanism: reduce its stroke, or change lengths; otherwise start \
                  elsewhere, replace a joint by a stiff bushing, or take fixed steps, which may step over the position, and check the energy";
    singular_within(SINGULAR, remedy, system, mechanism, state)
}

/// As [`singular_position`], for a time point of kinematics at which positions are known and velocities are not: an independent part
/// below `largest_share` is left of a gradient.
pub(crate) fn singular_instant(
    largest_share: f64,
    system: &System,
    mechanism: &Mechanism<f64>,
    state: &State<f64>,
) -> Option<Error> {
    let remedy = "at the end of its reach, reduce the stroke of the drive or change lengths; at a change point, take other time points, which \
                  step over it, or dynamics";
    singular_within(largest_share, remedy, system, mechanism, state)
}

fn singular_within(
    largest_share: f64,
    remedy: &str,
    system: &System,
    mechanism: &Mechanism<f64>,
    state: &State<f64>,
) -> Option<Error> {
    if mechanism.multipliers == 0 || system.allows_redundancy() || state.q.iter().any(|q| !q.is_finite()) {
        return None;
    }
    let (share, multiplier) = ConstraintRank::of(system, mechanism, state).smallest;
    (share < largest_share).then(|| {
        let why = format!(
            "the mechanism is in a singular position at t = {}, where this constraint depends on the others (an \
             independent part of {share:.0e} is left) and the motion can branch",
            Seconds(state.t)
        );
        Error::analysis(name_of(mechanism, Unknown::Multiplier(multiplier)), why, remedy)
    })
}

fn norm(row: &[f64]) -> f64 {
    row.iter().map(|x| x * x).sum::<f64>().sqrt()
}

/// Names of the constraints whose gradients depend on those of the constraints before them.
pub fn redundant_constraints(system: &System, mechanism: &Mechanism<f64>, state: &State<f64>) -> Vec<String> {
    let name = |m: &usize| name_of(mechanism, Unknown::Multiplier(*m));
    ConstraintRank::of(system, mechanism, state).redundant.iter().map(name).collect()
}

/// Orthonormal basis of the multipliers without effect, Φ_qᵀ n = 0: one vector per redundant constraint.
pub fn self_stresses(system: &System, mechanism: &Mechanism<f64>, state: &State<f64>) -> Vec<Vec<f64>> {
    let jacobian = system.constraint_jacobian(mechanism, state);
    let mut gram = DMatrix::from_fn(jacobian.len(), jacobian.len(), |i, j| {
        jacobian[i].iter().zip(&jacobian[j]).map(|(a, b)| a * b).sum::<f64>()
    });
    if gram.is_empty() {
        return Vec::new();
    }
    let largest = gram.amax().max(f64::MIN_POSITIVE);
    let inactive = active_constraints(mechanism, state).into_iter().enumerate().filter(|(_, is_active)| !is_active);
    inactive.for_each(|(m, _)| gram[(m, m)] = largest);
    let eigen = gram.symmetric_eigen();
    let null = (0..jacobian.len()).filter(|&k| eigen.eigenvalues[k].abs() <= 1e-14 * largest);
    null.map(|k| eigen.eigenvectors.column(k).iter().copied().collect()).collect()
}

/// Names of the constraints whose reactions redundant constraints leave indeterminate.
///
/// An analysis returns the reactions of least norm. The motion does not depend on them.
pub fn indeterminate_reactions(system: &System, mechanism: &Mechanism<f64>, state: &State<f64>) -> Vec<String> {
    let free = self_stresses(system, mechanism, state);
    let is_free = |m: &usize| free.iter().any(|stress| stress[*m].abs() > 1e-6);
    (0..mechanism.multipliers).filter(is_free).map(|m| name_of(mechanism, Unknown::Multiplier(m))).collect()
}

/// Names of free coordinates that the constraints leave undetermined: one for each degree of freedom.
///
/// Eliminates the coordinates with the largest gradients first; the remaining ones can move while all drives are at rest.
pub fn undetermined_coordinates(system: &System, mechanism: &Mechanism<f64>, state: &State<f64>) -> Vec<String> {
    let mut rows = system.constraint_jacobian(mechanism, state);
    let mut left: Vec<usize> = (0..mechanism.coordinates.len()).filter(|&i| system.equation_of(i).is_some()).collect();
    let largest = rows.iter().flatten().fold(0.0f64, |a, x| a.max(x.abs()));
    loop {
        let entries = rows.iter().enumerate().flat_map(|(r, row)| left.iter().map(move |&i| (row[i].abs(), r, i)));
        // Of equal entries the one of the last coordinate is eliminated: the rotation of the first body remains.
        let Some((size, r, i)) = entries.reduce(|a, b| if b.0 >= a.0 * (1.0 - 1e-9) { b } else { a }) else { break };
        if size <= DEPENDENT * largest {
            break;
        }
        let pivot = rows.swap_remove(r);
        for row in &mut rows {
            let factor = row[i] / pivot[i];
            row.iter_mut().zip(&pivot).for_each(|(x, p)| *x -= factor * p);
        }
        left.retain(|&other| other != i);
    }
    left.iter().map(|&i| mechanism.coordinates[i].name.clone()).collect()
}
