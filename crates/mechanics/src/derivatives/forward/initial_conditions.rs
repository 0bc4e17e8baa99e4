//! Derivatives of assembled positions, consistent velocities and accelerations.

use crate::Result;
use crate::analyses::dynamics::{Dynamics, InitialAcceleration, InitialConfiguration};
use crate::derivatives::forward::instants::equilibrium;
use crate::derivatives::seeding::{set_values, take_values};
use crate::elements::element::ElementWorkspace;
use crate::initial_conditions::{Projection, acceleration_rows};
use crate::mechanism::Mechanism;
use crate::mechanism::scalars::{DerivativeScalar, ElementScalar, Jet2};
use crate::system::linearization::Linearization;
use crate::system::state::State;
use crate::system::{System, Unknown};

/// The equilibrium that a motion with the initial state `values` starts from.
pub(crate) fn at_rest(values: &State<f64>, projection: &Projection) -> State<f64> {
    let mut rest = values.clone();
    rest.v.fill(0.0);
    rest.a.fill(0.0);
    rest.l.copy_from_slice(&projection.position);
    rest
}

/// Differentiates the initial state: each of its three problems has a matrix and a residual.
pub(crate) struct StartSolver<'s, 'm, T, const L: usize> {
    plain: &'s Mechanism<f64>,
    mechanism: &'m Mechanism<T>,
    system: &'s mut System,
    rows: Vec<T>,
    changes: Vec<[f64; L]>,
}

/// The unknowns of one of the three problems beside the multipliers.
type Which<T> = fn(&mut State<T>) -> &mut Vec<T>;

impl<'s, 'm, T: DerivativeScalar<L>, const L: usize> StartSolver<'s, 'm, T, L>
where
    Jet2<T>: ElementScalar,
{
    /// For the derivatives of `mechanism`, with the matrices of `plain`.
    pub fn new(plain: &'s Mechanism<f64>, mechanism: &'m Mechanism<T>, system: &'s mut System) -> Self {
        let (rows, changes) = (vec![T::from(0.0); system.size()], vec![[0.0; L]; system.size()]);
        Self { plain, mechanism, system, rows, changes }
    }

    /// The state `values` at the start of a motion with its derivatives.
    pub fn start(mut self, values: &State<f64>, projection: &Projection, settings: &Dynamics) -> Result<State<T>> {
        let mut state = State::built(self.mechanism, values.t);
        let is_jointed = self.mechanism.multipliers > 0;
        match settings.origin {
            InitialConfiguration::Equilibrium(_) => state.q = self.equilibrium(values, projection)?,
            InitialConfiguration::Built if is_jointed => self.positions(values, projection, &mut state)?,
            InitialConfiguration::Built => {}
        }
        if is_jointed {
            self.velocities(values, projection, &mut state)?;
        }
        if settings.initial == InitialAcceleration::Consistent {
            self.accelerations(values, &mut state)?;
        }
        Ok(state)
    }

    /// The positions of the equilibrium at rest whose reactions are those of the projection.
    fn equilibrium(&mut self, values: &State<f64>, projection: &Projection) -> Result<Vec<T>> {
        let rest = at_rest(values, projection);
        self.factorize(&rest, Linearization::statics())?;
        Ok(equilibrium(self.mechanism, &rest, self.system).q)
    }

    /// q − q_guess + Φ_qᵀ μ = 0, Φ = 0.
    pub fn positions(&mut self, values: &State<f64>, projection: &Projection, state: &mut State<T>) -> Result<()> {
        let mut at = values.clone();
        at.l.copy_from_slice(&projection.position);
        let guess = state.q.clone();
        self.hold(values, state, |state| &mut state.q);
        set_values(&mut state.l, &projection.position);
        self.factorize(&at, Linearization::projection())?;
        for _ in 0..T::ORDER {
            self.projection_rows(state, &guess, |state| &mut state.q);
            self.correct(state, |state| &mut state.q);
        }
        set_values(&mut state.l, &values.l);
        Ok(())
    }

    /// v − v_guess + Φ_qᵀ μ = 0, Φ̇ = 0.
    pub fn velocities(&mut self, values: &State<f64>, projection: &Projection, state: &mut State<T>) -> Result<()> {
        let mut at = values.clone();
        at.l.fill(0.0); // Φ̇ is linear in v: its matrix is Φ_q, the rest is the identity
        let guess = state.v.clone();
        self.hold(values, state, |state| &mut state.v);
        set_values(&mut state.l, &projection.velocity);
        self.factorize(&at, Linearization::projection())?;
        let mut jets = ElementWorkspace::<Jet2<T>>::default();
        for _ in 0..T::ORDER {
            self.projection_rows(state, &guess, |state| &mut state.v);
            self.system.closure_rates(self.mechanism, state, 1, &mut jets, &mut self.rows);
            self.correct(state, |state| &mut state.v);
        }
        set_values(&mut state.l, &values.l);
        Ok(())
    }

    /// M q̈ + Φ_qᵀ λ = f, Φ̈ = 0.
    pub fn accelerations(&mut self, values: &State<f64>, state: &mut State<T>) -> Result<()> {
        let mut at = values.clone();
        at.l.fill(0.0);
        self.hold(values, state, |state| &mut state.a);
        set_values(&mut state.l, &values.l);
        self.factorize(&at, Linearization::accelerations())?;
        let (mut workspace, mut jets) = (ElementWorkspace::default(), ElementWorkspace::<Jet2<T>>::default());
        for _ in 0..T::ORDER {
            acceleration_rows(self.system, self.mechanism, state, &mut workspace, &mut jets, &mut self.rows);
            self.correct(state, |state| &mut state.a);
        }
        Ok(())
    }

    /// Gives the free coordinates their converged values without derivatives: they carry only those of prescribed ones.
    fn hold(&self, values: &State<f64>, state: &mut State<T>, which: Which<T>) {
        take_values(state, values);
        for (i, x) in which(state).iter_mut().enumerate() {
            if self.system.equation_of(i).is_some() {
                *x = T::from(x.value());
            }
        }
    }

    /// Rows of the nearest point to `guess` on the constraints: x − guess + Φ_qᵀ μ, and Φ.
    fn projection_rows(&mut self, state: &mut State<T>, guess: &[T], which: Which<T>) {
        self.system.constraint_rows(self.mechanism, state, &mut ElementWorkspace::default(), &mut self.rows);
        for (row, unknown) in self.rows.iter_mut().zip(self.system.unknowns()) {
            if let Unknown::Coordinate(i) = *unknown {
                *row += which(state)[i] - guess[i];
            }
        }
    }

    fn factorize(&mut self, at: &State<f64>, how: Linearization) -> Result<()> {
        let mut scratch = vec![[0.0]; self.system.size()];
        self.system.assemble(self.plain, at, how, &mut scratch);
        self.system.factorize(self.plain, at.t)
    }

    /// One correction of the derivatives of the unknowns, multipliers among them.
    fn correct(&mut self, state: &mut State<T>, which: Which<T>) {
        self.changes.iter_mut().zip(&self.rows).for_each(|(change, row)| *change = row.derivatives().map(|x| -x));
        self.system.factor().solve(&mut self.changes);
        for (change, unknown) in self.changes.iter().zip(self.system.unknowns()) {
            let change = T::with(0.0, *change);
            match *unknown {
                Unknown::Coordinate(i) => which(state)[i] += change,
                Unknown::Multiplier(m) => state.l[m] += change,
            }
        }
    }
}
