//! Mechanisms and states that carry derivatives.

use crate::analysis::State;
use crate::multibody::{Mechanism, Model, Real};
use crate::scalar::Tangent;
use crate::{Error, Result};

/// The mechanism once for each chunk of `N` design variables, with these seeded.
///
/// **Errors.** [`Error::Definition`] if the model makes another mechanism than `like`.
pub(super) fn build_sensitive<M: Model, const N: usize>(
    model: &M,
    b: &[f64],
    like: &Mechanism<f64>,
) -> Result<Vec<Mechanism<Tangent<N>>>>
where
    Tangent<N>: Real,
{
    (0..b.len()).step_by(N).map(|first| build_chunk(model, b, first, like)).collect()
}

fn build_chunk<M: Model, const N: usize>(
    model: &M,
    b: &[f64],
    first: usize,
    like: &Mechanism<f64>,
) -> Result<Mechanism<Tangent<N>>>
where
    Tangent<N>: Real,
{
    let seed = |(i, &value): (usize, &f64)| match i.checked_sub(first) {
        Some(k) if k < N => Tangent::seeded(value, k),
        _ => Tangent::constant(value),
    };
    let mechanism = model.build(&b.iter().enumerate().map(seed).collect::<Vec<_>>())?;
    if mechanism.same_topology(like) {
        return Ok(mechanism);
    }
    let why = "makes different elements for the same design in another number type";
    Err(Error::definition("model", why, "do not let the number type decide what is built"))
}

/// Values with no derivatives.
pub(super) fn set_values<const N: usize>(to: &mut [Tangent<N>], from: &[f64]) {
    to.iter_mut().zip(from).for_each(|(to, &from)| *to = Tangent::constant(from));
}

impl<const N: usize> State<Tangent<N>> {
    /// Takes over the values and keeps the derivatives.
    pub(super) fn take_values(&mut self, values: &State<f64>) {
        self.t = values.t;
        for (to, from) in
            [(&mut self.q, &values.q), (&mut self.v, &values.v), (&mut self.a, &values.a), (&mut self.l, &values.l)]
        {
            to.iter_mut().zip(from).for_each(|(to, &from)| to.re = from);
        }
    }
}
