//! States between steps, and named outputs of a state.

use super::state::State;
use super::system::gather;
use crate::multibody::element::{Room, reset};
use crate::multibody::{Local, Mechanism, Real};

/// The state at time `t` between `old` and `new`, written to `at`.
///
/// Positions by the cubic through positions and velocities, velocities by the cubic through velocities and
/// accelerations, accelerations and multipliers linearly: of the order of the integrator. At the ends the states
/// themselves, bit for bit.
pub fn interpolate<T: Real>(old: &State<T>, new: &State<T>, t: f64, at: &mut State<T>) {
    let h = new.t - old.t;
    if (new.t - t).abs() <= 1e-9 * h {
        return at.copy_from(new);
    }
    if (t - old.t).abs() <= 1e-9 * h {
        return at.copy_from(old);
    }
    at.t = t;
    let x = (t - old.t) / h;
    cubic(&old.q, &old.v, &new.q, &new.v, h, x, &mut at.q);
    cubic(&old.v, &old.a, &new.v, &new.a, h, x, &mut at.v);
    for (at, old, new) in [(&mut at.a, &old.a, &new.a), (&mut at.l, &old.l, &new.l)] {
        for ((at, &old), &new) in at.iter_mut().zip(old).zip(new) {
            *at = old * (1.0 - x) + new * x;
        }
    }
}

/// Hermite's cubic at the part `x` of a step `h`.
fn cubic<T: Real>(y0: &[T], d0: &[T], y1: &[T], d1: &[T], h: f64, x: f64, out: &mut [T]) {
    let (b, c) = (x * x * (3.0 - 2.0 * x), x * (1.0 - x) * (1.0 - x) * h);
    let d = x * x * (x - 1.0) * h;
    for (i, out) in out.iter_mut().enumerate() {
        *out = y0[i] * (1.0 - b) + y1[i] * b + d0[i] * c + d1[i] * d;
    }
}

/// Evaluates the named outputs of a mechanism: every element that is asked is asked once.
#[derive(Clone, Debug)]
pub struct Sampler<T> {
    /// Elements that are asked, with the place of their first measure in `measured`.
    asked: Vec<(usize, usize)>,
    place: Vec<usize>,
    measured: Vec<T>,
    room: Room<T>,
}

impl<T: Real> Sampler<T> {
    /// For the outputs of `mechanism`.
    pub fn new(mechanism: &Mechanism<T>) -> Self {
        let mut place = vec![usize::MAX; mechanism.parts.len()];
        let (mut asked, mut count) = (Vec::new(), 0);
        for term in mechanism.outputs.iter().flat_map(|output| &output.terms) {
            if place[term.part] == usize::MAX {
                place[term.part] = count;
                asked.push((term.part, count));
                count += mechanism.parts[term.part].element.measures().len();
            }
        }
        Self { asked, place, measured: vec![T::from(0.0); count], room: Room::default() }
    }

    /// Writes the outputs at `state`, in the order of the mechanism's outputs.
    pub fn outputs(&mut self, mechanism: &Mechanism<T>, state: &State<T>, out: &mut Vec<T>) {
        self.measured.fill(T::from(0.0));
        for &(index, first) in &self.asked {
            let part = &mechanism.parts[index];
            gather(part, state, &mut self.room);
            let local = Local { p: &part.parameters, ..self.room.local(T::from(state.t)) };
            let count = part.element.measures().len();
            T::measure(part.element.as_ref(), &local, &mut self.measured[first..first + count]);
        }
        reset(out, mechanism.outputs.len());
        for (out, output) in out.iter_mut().zip(&mechanism.outputs) {
            for term in &output.terms {
                *out += self.measured[self.place[term.part] + term.measure] * term.weight;
            }
        }
    }
}

/// Kinetic and potential energy of the whole mechanism in J.
pub fn energy<T: Real>(mechanism: &Mechanism<T>, state: &State<T>) -> [T; 2] {
    let mut room = Room::default();
    let mut total = [T::from(0.0); 2];
    for part in &mechanism.parts {
        gather(part, state, &mut room);
        let local = Local { p: &part.parameters, ..room.local(T::from(state.t)) };
        let energy = T::energy(part.element.as_ref(), &local);
        total[0] += energy.kinetic;
        total[1] += energy.potential;
    }
    total
}
