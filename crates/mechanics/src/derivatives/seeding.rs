//! Mechanisms and states that carry derivatives.

use crate::mechanism::scalars::{DerivativeScalar, StateScalar};
use crate::mechanism::{Mechanism, ParametricMechanism};
use crate::system::state::State;
use crate::{Error, Result};
use autodiff::DualVec;

/// The mechanism once for each chunk of `N` design variables, with these seeded.
///
/// **Errors.** [`Error::Definition`] if the model makes another mechanism than `like`.
pub(crate) fn build_sensitive<M: ParametricMechanism, const N: usize>(
    model: &M,
    b: &[f64],
    like: &Mechanism<f64>,
) -> Result<Vec<Mechanism<DualVec<N>>>>
where
    DualVec<N>: StateScalar,
{
    let seed = |first: usize, (i, &value): (usize, &f64)| match i.checked_sub(first) {
        Some(k) if k < N => DualVec::seeded(value, k),
        _ => DualVec::constant(value),
    };
    let design = |first| b.iter().enumerate().map(|variable| seed(first, variable)).collect::<Vec<_>>();
    (0..b.len()).step_by(N).map(|first| build_seeded(model, &design(first), like)).collect()
}

/// The mechanism for a design that carries derivatives.
///
/// **Errors.** [`Error::Definition`] if the model makes another mechanism than `like`.
pub(crate) fn build_seeded<M: ParametricMechanism, T: StateScalar>(
    model: &M,
    design: &[T],
    like: &Mechanism<f64>,
) -> Result<Mechanism<T>> {
    let mechanism = model.build(design)?;
    if mechanism.same_topology(like) {
        return Ok(mechanism);
    }
    let why = "makes different elements for the same design in another number type";
    Err(Error::definition("model", why, "do not let the number type decide what is built"))
}

/// Values with no derivatives.
pub(crate) fn set_values<T: StateScalar>(to: &mut [T], from: &[f64]) {
    to.iter_mut().zip(from).for_each(|(to, &from)| *to = T::from(from));
}

/// Takes over the values and keeps the derivatives.
pub(crate) fn take_values<T: DerivativeScalar<L>, const L: usize>(state: &mut State<T>, values: &State<f64>) {
    state.t = T::with(values.t, state.t.derivatives());
    let State { q, v, a, l, .. } = state;
    for (to, from) in [(q, &values.q), (v, &values.v), (a, &values.a), (l, &values.l)] {
        to.iter_mut().zip(from).for_each(|(to, &from)| *to = T::with(from, to.derivatives()));
    }
}
