//! Mechanisms and states in numbers that carry derivatives, and activity analysis.

use crate::mechanism::scalars::{DerivativeScalar, Dual4, Dual8, StateScalar};
use crate::mechanism::{Mechanism, ParametricMechanism};
use crate::system::state::State;
use crate::{Error, Result};
use autodiff::{DualVec, WIDTH};

/// A mechanism in dual numbers, once per chunk of design variables, in the narrowest numbers for the design.
pub(crate) enum SeededMechanisms {
    /// For designs of at most four variables.
    Narrow(Vec<Mechanism<Dual4>>),
    /// For chunks of [`WIDTH`] design variables.
    Wide(Vec<Mechanism<Dual8>>),
}

impl SeededMechanisms {
    /// Builds `model` at the design `b`; it must have the same elements as `like`.
    ///
    /// # Errors
    /// As [`build_seeded`].
    pub fn build<M: ParametricMechanism>(model: &M, b: &[f64], like: &Mechanism<f64>) -> Result<Self> {
        Ok(match b.len() <= 4 {
            true => Self::Narrow(build_chunks::<M, 4>(model, b, like)?),
            false => Self::Wide(build_chunks::<M, WIDTH>(model, b, like)?),
        })
    }
}

/// Builds the mechanism once for each chunk of `N` design variables, with these seeded.
///
/// # Errors
/// As [`build_seeded`].
pub(crate) fn build_chunks<M: ParametricMechanism, const N: usize>(
    model: &M,
    b: &[f64],
    like: &Mechanism<f64>,
) -> Result<Vec<Mechanism<DualVec<N>>>>
where
    DualVec<N>: StateScalar,
{
    (0..b.len()).step_by(N).map(|first| build_seeded(model, &seed_chunk(b, first), like)).collect()
}

/// Dual numbers with the values `x`, seeded in the `N` variables from number `first` on.
pub(crate) fn seed_chunk<const N: usize>(x: &[f64], first: usize) -> Vec<DualVec<N>> {
    let seed = |(i, &value): (usize, &f64)| match i.checked_sub(first) {
        Some(k) if k < N => DualVec::variable(value, k),
        _ => DualVec::constant(value),
    };
    x.iter().enumerate().map(seed).collect()
}

/// Builds the mechanism at a design whose numbers carry derivatives.
///
/// # Errors
/// [`Error::Definition`] if the elements differ from those of `like`.
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

/// Overwrites `to` with values that carry no derivatives.
pub(crate) fn set_values<T: StateScalar>(to: &mut [T], from: &[f64]) {
    to.iter_mut().zip(from).for_each(|(to, &from)| *to = T::from(from));
}

/// The values of a `state` without its derivatives.
pub(crate) fn values_of<T: StateScalar>(state: &State<T>) -> State<f64> {
    let values = |x: &[T]| x.iter().map(|x| x.value()).collect();
    let State { t, q, v, a, l, modes } = state;
    State { t: t.value(), q: values(q), v: values(v), a: values(a), l: values(l), modes: modes.clone() }
}

/// Overwrites the values of `state` and keeps its derivatives.
pub(crate) fn take_values<T: DerivativeScalar<L>, const L: usize>(state: &mut State<T>, values: &State<f64>) {
    state.t = T::with(values.t, state.t.derivatives());
    let State { q, v, a, l, .. } = state;
    for (to, from) in [(q, &values.q), (v, &values.v), (a, &values.a), (l, &values.l)] {
        to.iter_mut().zip(from).for_each(|(to, &from)| *to = T::with(from, to.derivatives()));
    }
}

/// The parameters of elements and motions that depend on the design.
pub(crate) struct Activity {
    /// For each element, the local numbers of its active parameters.
    pub parameters: Vec<Vec<usize>>,
    /// For each coordinate, true if its prescribed motion depends on the design.
    pub motions: Vec<bool>,
}

impl Activity {
    /// Activity of `mechanism`, from its chunks of seeded design variables.
    pub fn of(chunks: &[Mechanism<Dual8>], mechanism: &Mechanism<f64>) -> Self {
        let is_active = |x: &Dual8| x.eps.iter().any(|derivative| *derivative != 0.0);
        let parameter = |element: usize, k: usize| chunks.iter().any(|c| is_active(&c.elements[element].parameters[k]));
        let parameters = |element: usize| {
            (0..mechanism.elements[element].parameters.len()).filter(|&k| parameter(element, k)).collect()
        };
        let motion = |c: &Mechanism<Dual8>, i: usize| {
            c.coordinates[i].motion.as_ref().is_some_and(|(_, parameters)| parameters.iter().any(is_active))
        };
        Self {
            parameters: (0..mechanism.elements.len()).map(parameters).collect(),
            motions: (0..mechanism.coordinates.len()).map(|i| chunks.iter().any(|c| motion(c, i))).collect(),
        }
    }

    /// Coordinates whose prescribed motion depends on the design, increasing.
    pub fn moving_coordinates(&self) -> impl Iterator<Item = usize> + '_ {
        (0..self.motions.len()).filter(|&i| self.motions[i])
    }

    /// Returns whether derivatives with respect to a coordinate are needed: it is an unknown, or its prescribed motion
    /// depends on the design.
    pub fn is_differentiated(&self, mechanism: &Mechanism<f64>, coordinate: usize) -> bool {
        self.motions[coordinate] || mechanism.coordinates[coordinate].motion.is_none()
    }
}
