//! Mechanisms and states that carry derivatives.

use crate::analysis::State;
use crate::multibody::{Mechanism, Model, Sensitive};
use crate::scalar::WIDTH;
use crate::{Error, Result};

/// The mechanism once for each chunk of [`WIDTH`] design variables, with these seeded.
///
/// **Errors.** [`Error::Definition`] if the model makes another mechanism than `like`.
pub(super) fn build_sensitive<M: Model>(
    model: &M,
    b: &[f64],
    like: &Mechanism<f64>,
) -> Result<Vec<Mechanism<Sensitive>>> {
    (0..b.len()).step_by(WIDTH).map(|first| build_chunk(model, b, first, like)).collect()
}

fn build_chunk<M: Model>(model: &M, b: &[f64], first: usize, like: &Mechanism<f64>) -> Result<Mechanism<Sensitive>> {
    let seed = |(i, &value): (usize, &f64)| match i.checked_sub(first) {
        Some(k) if k < WIDTH => Sensitive::seeded(value, k),
        _ => Sensitive::constant(value),
    };
    let mechanism = model.build(&b.iter().enumerate().map(seed).collect::<Vec<_>>())?;
    if mechanism.same_topology(like) {
        return Ok(mechanism);
    }
    let why = "makes different elements for the same design in another number type";
    Err(Error::definition("model", why, "do not let the number type decide what is built"))
}

/// Values with no derivatives.
pub(super) fn set_values(to: &mut [Sensitive], from: &[f64]) {
    to.iter_mut().zip(from).for_each(|(to, &from)| *to = Sensitive::constant(from));
}

impl State<Sensitive> {
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
