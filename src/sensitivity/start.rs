//! Derivatives of assembled positions, consistent velocities and accelerations.

use super::seeded::set_values;
use crate::Result;
use crate::analysis::State;
use crate::analysis::dynamics::InitialAcceleration;
use crate::analysis::start::{Projection, acceleration_rows};
use crate::analysis::system::{Linearization, System, Unknown};
use crate::multibody::element::Room;
use crate::multibody::{Jet, Mechanism, Number, Real};
use crate::scalar::Tangent;

/// Differentiates the initial state: each of its three problems has a matrix and a residual.
pub(super) struct StartSolver<'s, 'm, const N: usize> {
    plain: &'s Mechanism<f64>,
    mechanism: &'m Mechanism<Tangent<N>>,
    system: &'s mut System,
    rows: Vec<Tangent<N>>,
    changes: Vec<[f64; N]>,
}

impl<'s, 'm, const N: usize> StartSolver<'s, 'm, N>
where
    Tangent<N>: Real,
    Jet<Tangent<N>>: Number,
{
    /// For the derivatives of `mechanism`, with the matrices of `plain`.
    pub fn new(plain: &'s Mechanism<f64>, mechanism: &'m Mechanism<Tangent<N>>, system: &'s mut System) -> Self {
        let (rows, changes) = (vec![Tangent::constant(0.0); system.size()], vec![[0.0; N]; system.size()]);
        Self { plain, mechanism, system, rows, changes }
    }

    /// The state `values` at the start of a motion with its derivatives.
    pub fn start(
        mut self,
        values: &State<f64>,
        projection: &Projection,
        initial: InitialAcceleration,
    ) -> Result<State<Tangent<N>>> {
        let mut state = State::built(self.mechanism, values.t);
        if self.mechanism.multipliers > 0 {
            self.positions(values, projection, &mut state)?;
            self.velocities(values, projection, &mut state)?;
        }
        if initial == InitialAcceleration::Consistent {
            self.accelerations(values, &mut state)?;
        }
        Ok(state)
    }

    /// q − q_guess + Φ_qᵀ μ = 0, Φ = 0.
    pub fn positions(
        &mut self,
        values: &State<f64>,
        projection: &Projection,
        state: &mut State<Tangent<N>>,
    ) -> Result<()> {
        let mut at = values.clone();
        at.l.copy_from_slice(&projection.position);
        // At fixed unknowns: coordinates carry only the derivatives of prescribed ones.
        let guess = state.q.clone();
        self.hold(values, state, |state| &mut state.q);
        set_values(&mut state.l, &projection.position);
        self.system.constraint_rows(self.mechanism, state, &mut Room::default(), &mut self.rows);
        for (row, unknown) in self.rows.iter_mut().zip(self.system.unknowns()) {
            if let Unknown::Coordinate(i) = *unknown {
                *row += state.q[i] - guess[i];
            }
        }
        self.solve(&at, Linearization::projection())?;
        self.add_changes(|state| &mut state.q, state);
        set_values(&mut state.l, &values.l);
        Ok(())
    }

    /// v − v_guess + Φ_qᵀ μ = 0, Φ̇ = 0.
    pub fn velocities(
        &mut self,
        values: &State<f64>,
        projection: &Projection,
        state: &mut State<Tangent<N>>,
    ) -> Result<()> {
        let guess = state.v.clone();
        self.hold(values, state, |state| &mut state.v);
        set_values(&mut state.l, &projection.velocity);
        self.system.constraint_rows(self.mechanism, state, &mut Room::default(), &mut self.rows);
        for (row, unknown) in self.rows.iter_mut().zip(self.system.unknowns()) {
            if let Unknown::Coordinate(i) = *unknown {
                *row += state.v[i] - guess[i];
            }
        }
        self.system.closure_rates(self.mechanism, state, 1, &mut Room::<Jet<Tangent<N>>>::default(), &mut self.rows);
        let mut at = values.clone();
        at.l.fill(0.0); // Φ̇ is linear in v: its matrix is Φ_q, the rest is the identity
        self.solve(&at, Linearization::projection())?;
        self.add_changes(|state| &mut state.v, state);
        set_values(&mut state.l, &values.l);
        Ok(())
    }

    /// M q̈ + Φ_qᵀ λ = f, Φ̈ = 0.
    pub fn accelerations(&mut self, values: &State<f64>, state: &mut State<Tangent<N>>) -> Result<()> {
        self.hold(values, state, |state| &mut state.a);
        set_values(&mut state.l, &values.l);
        let (mut room, mut jets) = (Room::default(), Room::<Jet<Tangent<N>>>::default());
        acceleration_rows(self.system, self.mechanism, state, &mut room, &mut jets, &mut self.rows);
        let mut at = values.clone();
        at.l.fill(0.0);
        self.solve(&at, Linearization::accelerations())?;
        self.add_changes(|state| &mut state.a, state);
        for m in 0..state.l.len() {
            state.l[m].eps = self.changes[self.system.equation_of_multiplier(m)];
        }
        Ok(())
    }

    /// Gives the free coordinates their converged values without derivatives.
    fn hold(
        &self,
        values: &State<f64>,
        state: &mut State<Tangent<N>>,
        which: impl Fn(&mut State<Tangent<N>>) -> &mut Vec<Tangent<N>>,
    ) {
        let mut kept = which(state).clone();
        state.take_values(values);
        for (i, x) in kept.iter_mut().enumerate() {
            x.re = which(state)[i].re;
            if self.system.equation_of(i).is_some() {
                x.eps = [0.0; N];
            }
        }
        *which(state) = kept;
    }

    fn solve(&mut self, at: &State<f64>, how: Linearization) -> Result<()> {
        let mut scratch = vec![[0.0]; self.system.size()];
        self.system.assemble(self.plain, at, how, &mut scratch);
        self.system.factorize(self.plain, at.t)?;
        self.changes.iter_mut().zip(&self.rows).for_each(|(change, row)| *change = row.eps.map(|x| -x));
        self.system.factor().solve(&mut self.changes);
        Ok(())
    }

    fn add_changes(
        &self,
        which: impl Fn(&mut State<Tangent<N>>) -> &mut Vec<Tangent<N>>,
        state: &mut State<Tangent<N>>,
    ) {
        for (change, unknown) in self.changes.iter().zip(self.system.unknowns()) {
            if let Unknown::Coordinate(i) = *unknown {
                which(state)[i].eps = *change;
            }
        }
    }
}
