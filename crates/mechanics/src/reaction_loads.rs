//! Accelerations and reactions of mechanisms with forces that depend on reactions, such as friction in joints.

use crate::elements::element::ElementWorkspace;
use crate::mechanism::Mechanism;
use crate::mechanism::scalars::Jet2;
use crate::system::linearization::Linearization;
use crate::system::state::State;
use crate::system::{System, Unknown};
use crate::{Error, Result};
use error::Seconds;

/// Largest number of Newton iterations.
const ITERATIONS: usize = 40;

/// Relative change of accelerations and reactions after which the iteration ends: the next change is about its square.
const CONVERGED: f64 = 1e-11;

/// Relative change that is accepted if rounding errors prevent a further decrease.
const ROUNDING: f64 = 1e-8;

/// Smallest size of a force or an acceleration with which a change is compared: smaller numbers have fewer digits.
const SMALLEST: f64 = f64::MIN_POSITIVE / f64::EPSILON;

/// Solves M q̈ + Φ_qᵀ λ = f(q, q̇, λ), Φ̈ = 0 by Newton's method, from accelerations and multipliers in `state`.
///
/// Forces depend nonlinearly on reactions: the friction of a pin depends on the magnitude of its reaction. The matrix has
/// the derivatives −∂f/∂λ next to Φ_qᵀ; its factor stays in `system`.
///
/// `load` is the largest of the forces M q̈ − f without free accelerations and reactions. Forces of this size cancel each other in
/// mechanisms at rest and in free fall, and leave accelerations or reactions of rounding errors: changes are compared with it, too.
///
/// # Errors
///
/// [`Error::Analysis`] naming the elements if the iteration does not converge. There is more than one solution, or none, if
/// friction is large enough to lock the mechanism.
pub(crate) fn iterate(
    system: &mut System,
    mechanism: &Mechanism<f64>,
    state: &mut State<f64>,
    (rows, load): (&mut [[f64; 1]], f64),
    jets: &mut ElementWorkspace<Jet2<f64>>,
) -> Result<()> {
    let mut last = f64::INFINITY;
    for _ in 0..ITERATIONS {
        system.assemble(mechanism, state, Linearization::accelerations(), rows);
        system.constraint_rates(mechanism, state, 2, jets, rows.as_flattened_mut());
        let excess = system.largest_coordinate_row(rows);
        system.factorize(mechanism, state.t).map_err(|_| locked(mechanism, state.t))?;
        system.factor().solve(rows);
        let change = subtract(system, rows, state, [excess, load]);
        if change <= CONVERGED || (change <= ROUNDING && change >= 0.5 * last) {
            return Ok(());
        }
        last = change;
    }
    Err(locked(mechanism, state.t))
}

/// Subtracts a correction from the free accelerations and the multipliers. Returns the larger of both relative changes.
///
/// `excess` is the largest force that was not in equilibrium before, `load` the largest applied one. If the excess is small, so is the
/// change of the inertia forces, for any change of the accelerations.
fn subtract(system: &System, rows: &[[f64; 1]], state: &mut State<f64>, [excess, load]: [f64; 2]) -> f64 {
    let (mut change, mut size) = ([0.0f64; 2], [SMALLEST, load.max(SMALLEST)]);
    for (unknown, &[row]) in system.unknowns().iter().zip(rows) {
        if !row.is_finite() {
            return f64::INFINITY; // `f64::max` ignores NaN, which must not pass as converged
        }
        let (k, value) = match *unknown {
            Unknown::Coordinate(i) => (0, &mut state.a[i]),
            Unknown::Multiplier(m) => (1, &mut state.l[m]),
        };
        *value -= row;
        change[k] = change[k].max(row.abs());
        size[k] = size[k].max(value.abs());
    }
    (change[0] / size[0]).min(excess / size[1]).max(change[1] / size[1])
}

/// Relative change of reactions after which Newton's iteration of an implicit step may end: the next change is about its square.
const SETTLED: f64 = 1e-8;

/// Relative change of reactions up to which a change that no longer decreases counts as rounding, which grows with 1/h².
const NOISE: f64 = 1e-4;

/// Change of the multipliers from iteration to iteration of an implicit step.
///
/// Driven coordinates converge before the reactions, on which friction depends.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ReactionChange {
    /// The largest of the forces without free accelerations and reactions, with which reactions are compared, too.
    load: f64,
    last: Option<f64>,
}

impl ReactionChange {
    /// The record of a step that begins in the positions and velocities of `state`, before its first iteration.
    pub fn new(
        system: &System,
        mechanism: &Mechanism<f64>,
        state: &State<f64>,
        workspace: &mut ElementWorkspace<f64>,
        rows: &mut [[f64; 1]],
    ) -> Self {
        let mut loaded = state.clone();
        loaded.l.fill(0.0);
        let free = system.unknowns().iter().filter_map(|unknown| match *unknown {
            Unknown::Coordinate(i) => Some(i),
            Unknown::Multiplier(_) => None,
        });
        free.for_each(|i| loaded.a[i] = 0.0);
        system.residual(mechanism, &loaded, 1.0, workspace, rows.as_flattened_mut());
        Self { load: system.largest_coordinate_row(rows), last: None }
    }

    /// Returns whether the multipliers of `state`, corrected by `rows`, have converged.
    pub fn is_settled(&mut self, system: &System, rows: &[[f64; 1]], state: &State<f64>) -> bool {
        let (mut change, mut size) = (0.0f64, self.load.max(SMALLEST));
        for (unknown, [row]) in system.unknowns().iter().zip(rows) {
            if let Unknown::Multiplier(m) = *unknown {
                change = change.max(row.abs());
                size = size.max(state.l[m].abs());
            }
        }
        let change = change / size;
        let is_noise = change <= NOISE && self.last.is_some_and(|last| change >= 0.5 * last);
        self.last = Some(change);
        change <= SETTLED || is_noise
    }
}

fn locked(mechanism: &Mechanism<f64>, t: f64) -> Error {
    let names: Vec<&str> = mechanism.reaction_loads().map(|instance| instance.name.as_str()).collect();
    let why =
        format!("friction and the reactions that it depends on have no common solution at t = {t}", t = Seconds(t));
    let remedy = "the joint locks: use a smaller coefficient of friction, or drive the mechanism in another place";
    Error::analysis(names.join(", "), why, remedy)
}
