//! Residual rows in any number type.

use crate::elements::element::ElementWorkspace;
use crate::mechanism::ElementInstance;
use crate::mechanism::Mechanism;
use crate::mechanism::scalars::{ElementScalar, Jet2, StateScalar};
use crate::system::System;
use crate::system::dof_map::DofMap;
use crate::system::state::State;

impl System {
    /// Residual rows by equation in any number type: balance rows, and closure rows times `constraint`.
    pub fn residual<T: StateScalar>(
        &self,
        mechanism: &Mechanism<T>,
        state: &State<T>,
        constraint: f64,
        workspace: &mut ElementWorkspace<T>,
        rows: &mut [T],
    ) {
        rows.fill(T::from(0.0));
        for (part, place) in mechanism.parts.iter().zip(&self.places) {
            if !place.active.is_empty() {
                evaluate(part, state, workspace);
                scatter(part, place, workspace, constraint, rows);
            }
        }
    }

    /// Rows of the projection onto the constraints: λ Φ_q in the coordinate rows, Φ in the others.
    pub fn constraint_rows<T: StateScalar>(
        &self,
        mechanism: &Mechanism<T>,
        state: &State<T>,
        workspace: &mut ElementWorkspace<T>,
        rows: &mut [T],
    ) {
        rows.fill(T::from(0.0));
        for (part, place) in mechanism.parts.iter().zip(&self.places) {
            if part.num_constraints > 0 {
                evaluate(part, state, workspace);
                scatter(part, place, workspace, 1.0, rows);
            }
        }
    }

    /// Overwrites the closure rows with the constraints' `order`-th time derivative (1 or 2) along the motion.
    pub fn closure_rates<T: StateScalar>(
        &self,
        mechanism: &Mechanism<T>,
        state: &State<T>,
        order: usize,
        workspace: &mut ElementWorkspace<Jet2<T>>,
        rows: &mut [T],
    ) where
        Jet2<T>: ElementScalar,
    {
        let (zero, one) = (T::from(0.0), T::from(1.0));
        let constant = |&x: &T| Jet2::new(x, zero, zero);
        for part in mechanism.parts.iter().filter(|part| part.num_constraints > 0) {
            workspace.p.clear();
            workspace.p.extend(part.parameters.iter().map(constant));
            workspace.q.clear();
            workspace.q.extend(part.coordinates.iter().map(|&i| Jet2::new(state.q[i], state.v[i], state.a[i])));
            for still in [&mut workspace.v, &mut workspace.a] {
                still.clear();
                still.resize(part.coordinates.len(), constant(&zero));
            }
            workspace.l.clear();
            workspace.l.resize(part.num_constraints, constant(&zero));
            Jet2::<T>::residual(part.element.as_ref(), Jet2::new(state.t, one, zero), workspace);
            for (k, constraint) in workspace.constraint.iter().enumerate() {
                let rate = if order == 1 { constraint.v1 } else { constraint.v2 };
                rows[self.multiplier_equation[part.first_multiplier + k]] = rate;
            }
        }
    }
}

/// Copies the element's variables out of the state; parameters are left to the caller.
pub(crate) fn gather<T: StateScalar>(part: &ElementInstance<T>, state: &State<T>, workspace: &mut ElementWorkspace<T>) {
    for (to, from) in [(&mut workspace.q, &state.q), (&mut workspace.v, &state.v), (&mut workspace.a, &state.a)] {
        to.clear();
        to.extend(part.coordinates.iter().map(|&i| from[i]));
    }
    workspace.l.clear();
    workspace.l.extend_from_slice(&state.l[part.first_multiplier..part.first_multiplier + part.num_constraints]);
}

/// Evaluates an element's residual into `workspace`.
pub(crate) fn evaluate<T: StateScalar>(
    part: &ElementInstance<T>,
    state: &State<T>,
    workspace: &mut ElementWorkspace<T>,
) {
    gather(part, state, workspace);
    T::residual_of(part.element.as_ref(), &part.parameters, state.t, workspace);
}

fn scatter<T: StateScalar>(
    part: &ElementInstance<T>,
    place: &DofMap,
    workspace: &ElementWorkspace<T>,
    constraint: f64,
    rows: &mut [T],
) {
    let n = part.coordinates.len();
    for (&r, &equation) in place.active.iter().zip(&place.equations) {
        rows[equation] += if r < n { workspace.dynamics[r] } else { workspace.constraint[r - n] * constraint };
    }
}
