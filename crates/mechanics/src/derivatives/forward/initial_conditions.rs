//! Derivatives of assembled positions, consistent velocities and accelerations, and static equilibria.
//!
//! Each of these problems has a matrix in `f64` and a residual in numbers that carry derivatives. The semi-analytical
//! and the adjoint method factorize the same matrices.

use crate::analyses::dynamics::{Dynamics, InitialAcceleration, InitialConfiguration};
use crate::derivatives::seeding::{set_values, take_values};
use crate::elements::element::ElementWorkspace;
use crate::initial_conditions::{Projection, acceleration_rows};
use crate::initial_velocities::{VelocityMatrix, VelocityProjection, sticking_coordinates};
use crate::mechanism::Mechanism;
use crate::mechanism::scalars::{DerivativeScalar, ElementScalar, Jet2};
use crate::system::linearization::{HELD, Linearization};
use crate::system::modes::Modes;
use crate::system::state::State;
use crate::system::{System, Unknown};
use crate::{Error, Result};

/// A projection of part of a state onto the constraints: W (x − x_guess) + Φ_qᵀ μ = 0 with one of these constraints. The weights W are one, and zero
/// for coordinates that follow others; velocities of followers that are held have a very large one.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum ProjectedPart {
    /// Positions q, with Φ = 0.
    Positions,
    /// Velocities v, with Φ̇ = 0.
    Velocities,
}

impl ProjectedPart {
    /// The entries of `state` that are projected.
    pub fn of<T>(self, state: &mut State<T>) -> &mut Vec<T> {
        match self {
            Self::Positions => &mut state.q,
            Self::Velocities => &mut state.v,
        }
    }

    /// The weight of a coordinate in the projection, with the `modes` of the motion.
    pub fn weight<S>(self, mechanism: &Mechanism<S>, modes: &Modes, coordinate: usize) -> f64 {
        let coordinate = &mechanism.coordinates[coordinate];
        let is_held = || coordinate.holding.is_some_and(|switch| modes.is_on(switch));
        match self {
            _ if !coordinate.is_follower => 1.0,
            Self::Velocities if is_held() => HELD,
            _ => 0.0,
        }
    }

    /// The multipliers μ of the projection.
    pub fn multipliers(self, projection: &Projection) -> &[f64] {
        match self {
            Self::Positions => &projection.position,
            Self::Velocities => &projection.nearest_velocity,
        }
    }

    /// Factorizes the matrix of the projection whose result is in `values`.
    pub fn factorize(
        self,
        system: &mut System,
        mechanism: &Mechanism<f64>,
        values: &State<f64>,
        projection: &Projection,
    ) -> Result<()> {
        let linearization = match self {
            Self::Positions => Linearization::projection(),
            Self::Velocities => Linearization::velocity_projection(),
        };
        let at = State { l: self.multipliers(projection).to_vec(), ..values.clone() };
        factorize(system, mechanism, &at, linearization)
    }
}

/// Derivative of the velocity of friction that sticks, as a fraction of the largest one of all velocities, that counts as zero.
const ROUNDING: f64 = 1e-12;

/// Factorizes the matrix of M q̈ + Φ_qᵀ λ = f, Φ̈ = 0 at `values`.
pub(crate) fn factorize_accelerations(
    system: &mut System,
    mechanism: &Mechanism<f64>,
    values: &State<f64>,
) -> Result<()> {
    factorize(system, mechanism, values, Linearization::accelerations())
}

/// Factorizes the matrix of the equilibrium from which a motion with the initial state `values` starts, and returns it.
pub(crate) fn factorize_initial_equilibrium(
    system: &mut System,
    mechanism: &Mechanism<f64>,
    values: &State<f64>,
    projection: &Projection,
) -> Result<State<f64>> {
    let mut rest = values.clone();
    rest.v.fill(0.0);
    rest.a.fill(0.0);
    rest.l.copy_from_slice(&projection.position);
    factorize(system, mechanism, &rest, Linearization::statics())?;
    Ok(rest)
}

fn factorize(
    system: &mut System,
    mechanism: &Mechanism<f64>,
    at: &State<f64>,
    linearization: Linearization,
) -> Result<()> {
    let mut rows = vec![[0.0]; system.size()];
    system.assemble(mechanism, at, linearization, &mut rows);
    system.factorize(mechanism, at.t)
}

/// Differentiates consistent states of `mechanism`, with the matrices of `plain`, its values.
pub(crate) struct InitialDerivatives<'s, 'm, T, const L: usize> {
    plain: &'s Mechanism<f64>,
    mechanism: &'m Mechanism<T>,
    system: &'s mut System,
    rows: Vec<T>,
    changes: Vec<[f64; L]>,
}

impl<'s, 'm, T: DerivativeScalar<L>, const L: usize> InitialDerivatives<'s, 'm, T, L>
where
    Jet2<T>: ElementScalar,
{
    pub fn new(plain: &'s Mechanism<f64>, mechanism: &'m Mechanism<T>, system: &'s mut System) -> Self {
        let (rows, changes) = (vec![T::from(0.0); system.size()], vec![[0.0; L]; system.size()]);
        Self { plain, mechanism, system, rows, changes }
    }

    /// The initial state `values` of a motion, with its derivatives.
    pub fn start(mut self, values: &State<f64>, projection: &Projection, settings: &Dynamics) -> Result<State<T>> {
        let mut state = match settings.initial_configuration {
            InitialConfiguration::Built => self.consistent(values, projection)?,
            InitialConfiguration::Equilibrium(_) => {
                let rest = factorize_initial_equilibrium(self.system, self.plain, values, projection)?;
                let mut state = State { modes: values.modes.clone(), ..State::built(self.mechanism, values.t) };
                state.q = equilibrium(self.mechanism, &rest, self.system).q;
                if self.mechanism.multipliers > 0 {
                    self.velocities(values, projection, &mut state)?;
                }
                state
            }
        };
        if settings.initial_acceleration == InitialAcceleration::Consistent {
            self.accelerations(values, &mut state)?;
        }
        Ok(state)
    }

    /// The state with assembled positions and consistent velocities `values`, with their derivatives.
    pub fn consistent(&mut self, values: &State<f64>, projection: &Projection) -> Result<State<T>> {
        let mut state = State { modes: values.modes.clone(), ..State::built(self.mechanism, values.t) };
        if self.mechanism.multipliers > 0 {
            self.project(ProjectedPart::Positions, values, projection, &mut state)?;
            self.velocities(values, projection, &mut state)?;
        }
        Ok(state)
    }

    /// Differentiates the consistent velocities in `values`, from the given ones in `state`.
    fn velocities(&mut self, values: &State<f64>, projection: &Projection, state: &mut State<T>) -> Result<()> {
        self.given_velocities(values, projection, state)?;
        let held = sticking_coordinates(self.plain, &values.modes);
        let rates: Vec<_> = held.iter().map(|&i| state.v[i].derivatives()).collect();
        let largest = state.v.iter().flat_map(|v| v.derivatives()).fold(0.0f64, |a, rate| a.max(rate.abs()));
        if rates.as_flattened().iter().all(|rate| rate.abs() <= ROUNDING * largest) {
            return Ok(());
        }
        if T::ORDER > 1 {
            let why = "friction sticks at the start: a motion has no second derivatives with respect to velocities that it stops";
            let remedy = "start with friction that slides, or leave these velocities out of the design";
            return Err(Error::unsupported(&self.plain.coordinates[held[0]].name, why, remedy));
        }
        let matrix = VelocityMatrix::new(self.system, self.plain, values, &held)?;
        matrix.stopping_change(&rates, &mut self.changes);
        for (change, unknown) in self.changes.iter().zip(self.system.unknowns()) {
            if let Unknown::Coordinate(i) = *unknown {
                state.v[i] += T::with(0.0, *change);
            }
        }
        Ok(())
    }

    /// Differentiates the velocities that satisfy the constraints, without friction.
    fn given_velocities(&mut self, values: &State<f64>, projection: &Projection, state: &mut State<T>) -> Result<()> {
        if !projection.nearest_velocity.is_empty() {
            return self.project(ProjectedPart::Velocities, values, projection, state);
        }
        let velocity = &projection.velocity;
        let VelocityProjection { multipliers, held, .. } = velocity;
        let given: Vec<T> = held.iter().map(|&i| state.v[i]).collect();
        self.set_unknowns(values, state, |state| &mut state.v);
        set_values(&mut state.l, multipliers);
        let matrix = VelocityMatrix::new(self.system, self.plain, values, held)?;
        let mut jets = ElementWorkspace::<Jet2<T>>::default();
        let mut impulses = vec![T::from(0.0); held.len()];
        for _ in 0..T::ORDER {
            self.system.constraint_rows(self.mechanism, state, &mut ElementWorkspace::default(), &mut self.rows);
            self.system.constraint_rates(self.mechanism, state, 1, &mut jets, &mut self.rows);
            let deviations = velocity.deviations(self.mechanism, &state.v);
            matrix.add_momenta(self.system, self.mechanism, (state, &deviations), &mut jets, &mut self.rows);
            for (&i, &p) in held.iter().zip(&impulses) {
                if let Some(equation) = self.system.equation_of(i) {
                    self.rows[equation] -= p;
                }
            }
            negative_derivatives(&self.rows, &mut self.changes);
            let errors = held.iter().zip(&given).map(|(&i, &g)| (g - state.v[i]).derivatives());
            let mut changes: Vec<_> = errors.collect();
            matrix.solve(self.system, &mut self.changes, &mut changes);
            add_changes(self.system, &self.changes, state, |state| &mut state.v);
            impulses.iter_mut().zip(changes).for_each(|(p, change)| *p += T::with(0.0, change));
        }
        set_values(&mut state.l, &values.l);
        Ok(())
    }

    /// Differentiates a projection onto the constraints, from the guess in `state` to the result in `values`.
    pub fn project(
        &mut self,
        part: ProjectedPart,
        values: &State<f64>,
        projection: &Projection,
        state: &mut State<T>,
    ) -> Result<()> {
        let guess = part.of(state).clone();
        self.set_unknowns(values, state, |state| part.of(state));
        set_values(&mut state.l, part.multipliers(projection));
        part.factorize(self.system, self.plain, values, projection)?;
        let mut jets = ElementWorkspace::<Jet2<T>>::default();
        for _ in 0..T::ORDER {
            self.projection_rows(part, (&guess, &values.modes), state);
            if part == ProjectedPart::Velocities {
                self.system.constraint_rates(self.mechanism, state, 1, &mut jets, &mut self.rows);
            }
            correct(self.system, &self.rows, &mut self.changes, state, |state| part.of(state));
        }
        set_values(&mut state.l, &values.l);
        Ok(())
    }

    /// Differentiates the accelerations and multipliers of `values`: M q̈ + Φ_qᵀ λ = f, Φ̈ = 0.
    pub fn accelerations(&mut self, values: &State<f64>, state: &mut State<T>) -> Result<()> {
        self.set_unknowns(values, state, |state| &mut state.a);
        set_values(&mut state.l, &values.l);
        factorize_accelerations(self.system, self.plain, values)?;
        let (mut workspace, mut jets) = (ElementWorkspace::default(), ElementWorkspace::<Jet2<T>>::default());
        for _ in 0..T::ORDER {
            acceleration_rows(self.system, self.mechanism, state, &mut workspace, &mut jets, &mut self.rows);
            correct(self.system, &self.rows, &mut self.changes, state, |state| &mut state.a);
        }
        Ok(())
    }

    /// Sets the free coordinates to their converged values without derivatives; prescribed ones keep theirs.
    fn set_unknowns(&self, values: &State<f64>, state: &mut State<T>, which: impl Fn(&mut State<T>) -> &mut Vec<T>) {
        take_values(state, values);
        for (i, x) in which(state).iter_mut().enumerate() {
            if self.system.equation_of(i).is_some() {
                *x = T::from(x.value());
            }
        }
    }

    /// Rows of the point on the constraints nearest to `guess`: W (x − guess) + Φ_qᵀ μ, and Φ.
    fn projection_rows(&mut self, part: ProjectedPart, (guess, modes): (&[T], &Modes), state: &mut State<T>) {
        self.system.constraint_rows(self.mechanism, state, &mut ElementWorkspace::default(), &mut self.rows);
        for (row, unknown) in self.rows.iter_mut().zip(self.system.unknowns()) {
            if let Unknown::Coordinate(i) = *unknown {
                let weight = part.weight(self.plain, modes, i);
                *row += (part.of(state)[i] - guess[i]) * weight;
            }
        }
    }
}

/// Derivatives of the equilibrium `values`, with the matrix factorized there.
pub(crate) fn equilibrium<T: DerivativeScalar<L>, const L: usize>(
    mechanism: &Mechanism<T>,
    values: &State<f64>,
    system: &mut System,
) -> State<T> {
    let mut state = State::built(mechanism, values.t);
    for (i, coordinate) in mechanism.coordinates.iter().enumerate() {
        if coordinate.motion.is_none() {
            state.q[i] = T::from(values.q[i]);
        }
    }
    set_values(&mut state.v, &values.v);
    set_values(&mut state.a, &values.a);
    set_values(&mut state.l, &values.l);
    let (mut rows, mut changes) = (vec![T::from(0.0); system.size()], vec![[0.0; L]; system.size()]);
    let mut workspace = ElementWorkspace::default();
    for _ in 0..T::ORDER {
        system.residual(mechanism, &state, 1.0, &mut workspace, &mut rows);
        correct(system, &rows, &mut changes, &mut state, |state| &mut state.q);
    }
    state
}

/// Subtracts from the unknowns of `state` the derivatives of the residual `rows`, solved with the factor of `system`.
fn correct<T: DerivativeScalar<L>, const L: usize>(
    system: &mut System,
    rows: &[T],
    changes: &mut [[f64; L]],
    state: &mut State<T>,
    which: impl Fn(&mut State<T>) -> &mut Vec<T>,
) {
    negative_derivatives(rows, changes);
    system.factor().solve(changes);
    add_changes(system, changes, state, which);
}

fn negative_derivatives<T: DerivativeScalar<L>, const L: usize>(rows: &[T], changes: &mut [[f64; L]]) {
    changes.iter_mut().zip(rows).for_each(|(change, row)| *change = row.derivatives().map(|x| -x));
}

/// Adds the `changes` of derivatives, by equation, to the unknowns of `state`.
fn add_changes<T: DerivativeScalar<L>, const L: usize>(
    system: &System,
    changes: &[[f64; L]],
    state: &mut State<T>,
    which: impl Fn(&mut State<T>) -> &mut Vec<T>,
) {
    for (change, unknown) in changes.iter().zip(system.unknowns()) {
        let change = T::with(0.0, *change);
        match *unknown {
            Unknown::Coordinate(i) => which(state)[i] += change,
            Unknown::Multiplier(m) => state.l[m] += change,
        }
    }
}
