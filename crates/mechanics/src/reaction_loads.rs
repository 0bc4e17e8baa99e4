//! Accelerations and reactions of mechanisms with forces that depend on reactions, such as friction in joints.

use crate::elements::element::ElementWorkspace;
use crate::mechanism::Mechanism;
use crate::mechanism::scalars::Jet2;
use crate::system::linearization::Linearization;
use crate::system::state::State;
use crate::system::{System, Unknown};
use crate::{Error, Result};

/// Largest number of Newton iterations.
const ITERATIONS: usize = 40;

/// Change of accelerations and reactions, relative to the largest one, after which the iteration ends: the next change is about
/// its square.
const CONVERGED: f64 = 1e-11;

/// Relative change that is accepted if it does not decrease any more, by rounding.
const ROUNDING: f64 = 1e-8;

/// Solves M q̈ + Φ_qᵀ λ = f(q, q̇, λ), Φ̈ = 0 by Newton's method, from accelerations and multipliers in `state`.
///
/// Forces depend on reactions but not linearly: the friction of a pin depends on the magnitude of its reaction. The matrix has
/// the derivatives −∂f/∂λ next to Φ_qᵀ; its factor stays in `system`.
///
/// # Errors
///
/// [`Error::Analysis`] naming the elements if the iteration does not converge. There is more than one solution, or none, if
/// friction is large enough to lock the mechanism.
pub(crate) fn iterate(
    system: &mut System,
    mechanism: &Mechanism<f64>,
    state: &mut State<f64>,
    rows: &mut [[f64; 1]],
    jets: &mut ElementWorkspace<Jet2<f64>>,
) -> Result<()> {
    let mut last = f64::INFINITY;
    for _ in 0..ITERATIONS {
        system.assemble(mechanism, state, Linearization::accelerations(), rows);
        system.constraint_rates(mechanism, state, 2, jets, rows.as_flattened_mut());
        system.factorize(mechanism, state.t).map_err(|_| locked(mechanism, state.t))?;
        system.factor().solve(rows);
        let change = subtract(system, rows, state);
        if change <= CONVERGED || (change <= ROUNDING && change >= 0.5 * last) {
            return Ok(());
        }
        last = change;
    }
    Err(locked(mechanism, state.t))
}

/// Subtracts a correction from the free accelerations and the multipliers. Returns the larger of both relative changes.
fn subtract(system: &System, rows: &[[f64; 1]], state: &mut State<f64>) -> f64 {
    let (mut change, mut size) = ([0.0f64; 2], [f64::MIN_POSITIVE; 2]);
    for (unknown, &[row]) in system.unknowns().iter().zip(rows) {
        let (k, value) = match *unknown {
            Unknown::Coordinate(i) => (0, &mut state.a[i]),
            Unknown::Multiplier(m) => (1, &mut state.l[m]),
        };
        *value -= row;
        // `f64::max` ignores NaN, which must not pass as converged.
        change[k] = if row.is_finite() { change[k].max(row.abs()) } else { f64::INFINITY };
        size[k] = size[k].max(value.abs());
    }
    (change[0] / size[0]).max(change[1] / size[1])
}

/// Relative change of reactions after which Newton's iteration of an implicit step may end: the next change is about its square.
const SETTLED: f64 = 1e-8;

/// Relative change of reactions that rounding, which grows with 1/h², may keep alive.
const NOISE: f64 = 1e-4;

/// Change of the multipliers from iteration to iteration of an implicit step.
///
/// Driven coordinates converge before the reactions, on which friction depends.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct ReactionChange {
    last: Option<f64>,
}

impl ReactionChange {
    /// Returns whether the multipliers of `state`, corrected by `rows`, have converged.
    pub fn is_settled(&mut self, system: &System, rows: &[[f64; 1]], state: &State<f64>) -> bool {
        let (mut change, mut size) = (0.0f64, f64::MIN_POSITIVE);
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
    let loads = mechanism.elements.iter().filter(|instance| instance.num_reactions > 0);
    let names: Vec<&str> = loads.map(|instance| instance.name.as_str()).collect();
    let why = format!("friction and the reactions that it depends on have no common solution at t = {t:.6e} s");
    let remedy = "the joint locks: use a smaller coefficient of friction, or drive the mechanism in another place";
    Error::analysis(names.join(", "), why, remedy)
}
