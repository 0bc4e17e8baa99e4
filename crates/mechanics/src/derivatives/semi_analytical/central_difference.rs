//! A mechanism on both sides of a design, and what differs between them.

use crate::mechanism::{Mechanism, ParametricMechanism};
use crate::system::state::State;
use crate::{Error, Result};

/// The mechanism at the designs b + δ e_k and b − δ e_k.
pub(crate) struct CentralDifference {
    mechanisms: [Mechanism<f64>; 2],
    /// Distance δ in the unit of the design variable.
    distance: f64,
    moved: State<f64>,
    values: [Vec<f64>; 2],
}

impl CentralDifference {
    /// For the derivatives by variable `k`, with δ the part `step` of its value, or `step` itself where that is zero.
    ///
    /// **Errors.** [`Error::Definition`] if the model makes another mechanism than `like` at one of the designs.
    pub fn new<M: ParametricMechanism>(
        model: &M,
        b: &[f64],
        k: usize,
        step: f64,
        like: &Mechanism<f64>,
    ) -> Result<Self> {
        let wished = step * if b[k] == 0.0 { 1.0 } else { b[k].abs() };
        let at = |by: f64| -> Result<(f64, Mechanism<f64>)> {
            let mut moved = b.to_vec();
            moved[k] += by;
            let mechanism = model.build(&moved)?;
            if !mechanism.same_topology(like) {
                let why = format!("makes different elements when design variable {k} moves by {by:e}");
                let remedy = "do not let the design decide what is built, or take a smaller step of the differences";
                return Err(Error::definition("model", why, remedy));
            }
            Ok((moved[k], mechanism))
        };
        let ((ahead, first), (behind, second)) = (at(wished)?, at(-wished)?);
        let distance = 0.5 * (ahead - behind); // what the sums can hold
        let moved = State::built(&first, 0.0);
        Ok(Self { mechanisms: [first, second], distance, moved, values: Default::default() })
    }

    /// The derivative of what `evaluate` writes, while the state moves from `values` along `slopes`.
    pub fn slope(
        &mut self,
        values: &State<f64>,
        slopes: &State<f64>,
        mut evaluate: impl FnMut(&Mechanism<f64>, &State<f64>, &mut Vec<f64>),
    ) -> impl Iterator<Item = f64> + '_ {
        for (side, sign) in [1.0, -1.0].into_iter().enumerate() {
            shift(&mut self.moved, values, slopes, sign * self.distance);
            evaluate(&self.mechanisms[side], &self.moved, &mut self.values[side]);
        }
        let width = 2.0 * self.distance;
        let [ahead, behind] = &self.values;
        ahead.iter().zip(behind).map(move |(ahead, behind)| (ahead - behind) / width)
    }

    /// Slopes of the state that the mechanism is built in, prescribed coordinates at the time `t`.
    pub fn built(&self, t: f64) -> State<f64> {
        let [mut slopes, behind] = [0, 1].map(|side| State::built(&self.mechanisms[side], t));
        self.divide(&mut slopes, &behind);
        slopes
    }

    /// Slopes of what `prescribe` writes to a state, for the prescribed coordinates of `slopes`.
    pub fn prescribe(&mut self, slopes: &mut State<f64>, prescribe: impl Fn(&Mechanism<f64>, &mut State<f64>)) {
        self.moved.t = slopes.t;
        prescribe(&self.mechanisms[0], slopes);
        prescribe(&self.mechanisms[1], &mut self.moved);
        let width = 2.0 * self.distance;
        let driven = |i: &usize| self.mechanisms[0].coordinates[*i].motion.is_some();
        for i in (0..slopes.q.len()).filter(driven) {
            slopes.q[i] = (slopes.q[i] - self.moved.q[i]) / width;
            slopes.v[i] = (slopes.v[i] - self.moved.v[i]) / width;
            slopes.a[i] = (slopes.a[i] - self.moved.a[i]) / width;
        }
    }

    fn divide(&self, ahead: &mut State<f64>, behind: &State<f64>) {
        let width = 2.0 * self.distance;
        for (ahead, behind) in parts(ahead).into_iter().zip([&behind.q, &behind.v, &behind.a, &behind.l]) {
            ahead.iter_mut().zip(behind).for_each(|(ahead, behind)| *ahead = (*ahead - behind) / width);
        }
    }
}

fn parts(state: &mut State<f64>) -> [&mut Vec<f64>; 4] {
    [&mut state.q, &mut state.v, &mut state.a, &mut state.l]
}

/// `moved` = `values` + `by` · `slopes`.
fn shift(moved: &mut State<f64>, values: &State<f64>, slopes: &State<f64>, by: f64) {
    moved.copy_from(values);
    for (moved, slopes) in parts(moved).into_iter().zip([&slopes.q, &slopes.v, &slopes.a, &slopes.l]) {
        moved.iter_mut().zip(slopes).for_each(|(moved, slope)| *moved += by * slope);
    }
}
