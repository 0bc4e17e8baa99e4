//! Residual rows in any number type.

use crate::elements::element::Room;
use crate::mechanism::Mechanism;
use crate::mechanism::PartData;
use crate::mechanism::scalars::{Jet, Number, Real};
use crate::system::System;
use crate::system::dof_map::Place;
use crate::system::state::State;

impl System {
    /// Residual rows by equation in any number type: balance rows, and closure rows times `closure`.
    pub fn residual<T: Real>(
        &self,
        mechanism: &Mechanism<T>,
        state: &State<T>,
        closure: f64,
        room: &mut Room<T>,
        rows: &mut [T],
    ) {
        rows.fill(T::from(0.0));
        for (part, place) in mechanism.parts.iter().zip(&self.places) {
            if !place.active.is_empty() {
                evaluate(part, state, room);
                scatter(part, place, room, closure, rows);
            }
        }
    }

    /// Rows of the projection onto the constraints: λ Φ_q in the coordinate rows, Φ in the others.
    pub fn constraint_rows<T: Real>(
        &self,
        mechanism: &Mechanism<T>,
        state: &State<T>,
        room: &mut Room<T>,
        rows: &mut [T],
    ) {
        rows.fill(T::from(0.0));
        for (part, place) in mechanism.parts.iter().zip(&self.places) {
            if part.closures > 0 {
                evaluate(part, state, room);
                scatter(part, place, room, 1.0, rows);
            }
        }
    }

    /// Overwrites the closure rows with the constraints' `order`-th time derivative (1 or 2) along the motion.
    pub fn closure_rates<T: Real>(
        &self,
        mechanism: &Mechanism<T>,
        state: &State<T>,
        order: usize,
        room: &mut Room<Jet<T>>,
        rows: &mut [T],
    ) where
        Jet<T>: Number,
    {
        let (zero, one) = (T::from(0.0), T::from(1.0));
        let constant = |&x: &T| Jet::new(x, zero, zero);
        for part in mechanism.parts.iter().filter(|part| part.closures > 0) {
            room.p.clear();
            room.p.extend(part.parameters.iter().map(constant));
            room.q.clear();
            room.q.extend(part.coordinates.iter().map(|&i| Jet::new(state.q[i], state.v[i], state.a[i])));
            for still in [&mut room.v, &mut room.a] {
                still.clear();
                still.resize(part.coordinates.len(), constant(&zero));
            }
            room.l.clear();
            room.l.resize(part.closures, constant(&zero));
            Jet::<T>::residual(part.element.as_ref(), Jet::new(state.t, one, zero), room);
            for (k, closure) in room.closure.iter().enumerate() {
                let rate = if order == 1 { closure.v1 } else { closure.v2 };
                rows[self.multiplier_equation[part.first_multiplier + k]] = rate;
            }
        }
    }
}

/// Copies the element's variables out of the state; parameters are left to the caller.
pub(crate) fn gather<T: Real>(part: &PartData<T>, state: &State<T>, room: &mut Room<T>) {
    for (to, from) in [(&mut room.q, &state.q), (&mut room.v, &state.v), (&mut room.a, &state.a)] {
        to.clear();
        to.extend(part.coordinates.iter().map(|&i| from[i]));
    }
    room.l.clear();
    room.l.extend_from_slice(&state.l[part.first_multiplier..part.first_multiplier + part.closures]);
}

/// Evaluates an element's residual into `room`.
pub(crate) fn evaluate<T: Real>(part: &PartData<T>, state: &State<T>, room: &mut Room<T>) {
    gather(part, state, room);
    T::residual_of(part.element.as_ref(), &part.parameters, state.t, room);
}

fn scatter<T: Real>(part: &PartData<T>, place: &Place, room: &Room<T>, closure: f64, rows: &mut [T]) {
    let n = part.coordinates.len();
    for (&r, &equation) in place.active.iter().zip(&place.equations) {
        rows[equation] += if r < n { room.balance[r] } else { room.closure[r - n] * closure };
    }
}
