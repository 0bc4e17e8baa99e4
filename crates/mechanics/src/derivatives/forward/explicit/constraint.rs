//! Derivatives of one constraint along a motion, in closed form or in jets of dual numbers.

use crate::elements::element::{ConstraintDerivatives, ElementState, ElementWorkspace, Variable};
use crate::mechanism::ElementInstance;
use crate::mechanism::scalars::{Dual4, Dual8, ElementScalar, Jet2};
use crate::system::state::State;
use autodiff::{DualVec, WIDTH};

/// Quantity in the rows of the constraints: a time derivative of Φ, or a linearized correction.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum ConstraintDerivative {
    /// Φ̈ with the accelerations of the state.
    Accelerations,
    /// Φ + Φ_q δ, where δ are the accelerations of the state.
    Positions,
    /// Φ̇, without the rows of the reaction forces Φ_qᵀ λ.
    Velocities,
    /// Φ̇, with the rows of the reaction forces.
    Rates,
    /// Φ_q ε, where ε are the accelerations of the state.
    Corrections,
}

impl ConstraintDerivative {
    /// Returns whether positions move with the velocities of the state, and time advances.
    pub fn follows_motion(self) -> bool {
        matches!(self, Self::Accelerations | Self::Velocities | Self::Rates)
    }

    /// The derivative of a constraint row from those of Φ, Φ̇ and Φ̈.
    pub fn of(self, derivatives: [f64; 3]) -> f64 {
        match self {
            Self::Accelerations => derivatives[2],
            Self::Velocities | Self::Rates | Self::Corrections => derivatives[1],
            Self::Positions => derivatives[0] + derivatives[1],
        }
    }
}

/// Derivatives of a constraint's rows with respect to a few of its variables, variable by variable.
#[derive(Clone, Default)]
pub(crate) struct ConstraintTerms {
    /// Of Φ_qᵀ λ, for each coordinate.
    dynamics: Vec<f64>,
    /// Of Φ, Φ̇ and Φ̈, for each multiplier.
    constraint: Vec<[f64; 3]>,
    rows: [usize; 2],
    plain: ElementWorkspace<f64>,
    jets: ElementWorkspace<Jet2<Dual8>>,
    short_jets: ElementWorkspace<Jet2<Dual4>>,
}

impl ConstraintTerms {
    /// Differentiates the constraint `instance` along the motion that `constraint` prescribes: in closed form if there is
    /// one, or else in jets of dual numbers.
    ///
    /// A constraint is evaluated on seeded positions that move in time (jets). Velocities need no separate columns:
    /// the derivative of Φ̈ with respect to velocities is twice that of Φ̇ with respect to positions.
    pub fn evaluate(
        &mut self,
        instance: &ElementInstance<f64>,
        variables: &[Variable],
        state: &State<f64>,
        constraint: ConstraintDerivative,
    ) {
        self.rows = [instance.coordinates.len(), instance.num_constraints];
        self.dynamics.clear();
        self.dynamics.resize(variables.len() * instance.coordinates.len(), 0.0);
        self.constraint.clear();
        self.constraint.resize(variables.len() * instance.num_constraints, [0.0; 3]);
        self.load(instance, state, constraint);
        let local = ElementState { p: &instance.parameters, ..self.plain.local(state.t) };
        let mut derivatives = ConstraintDerivatives { dynamics: &mut self.dynamics, constraint: &mut self.constraint };
        if instance.element.constraint_derivatives(&local, variables, &mut derivatives) {
            return;
        }
        let time_rate = f64::from(u8::from(constraint.follows_motion()));
        if variables.len() <= 4 {
            return self.evaluate_chunk(instance, variables, 0, state.t, time_rate, |terms| &mut terms.short_jets);
        }
        for (k, chunk) in variables.chunks(WIDTH).enumerate() {
            self.evaluate_chunk(instance, chunk, k * WIDTH, state.t, time_rate, |terms| &mut terms.jets);
        }
    }

    /// Derivative of Φ_qᵀ λ in the row of the coordinate `row` with respect to variable `k`.
    #[inline]
    pub fn dynamics(&self, row: usize, k: usize) -> f64 {
        self.dynamics[k * self.rows[0] + row]
    }

    /// Derivatives of Φ, Φ̇ and Φ̈ with respect to variable `k`.
    #[inline]
    pub fn constraint(&self, row: usize, k: usize) -> [f64; 3] {
        self.constraint[k * self.rows[1] + row]
    }

    /// Loads the motion and the multipliers.
    fn load(&mut self, instance: &ElementInstance<f64>, state: &State<f64>, constraint: ConstraintDerivative) {
        let rates = if constraint.follows_motion() { &state.v } else { &state.a };
        let ElementWorkspace { q, v, a, l, .. } = &mut self.plain;
        for (to, from) in [(q, &state.q), (v, rates), (&mut *a, &state.a)] {
            to.clear();
            to.extend(instance.coordinates.iter().map(|&i| from[i]));
        }
        if constraint != ConstraintDerivative::Accelerations {
            a.fill(0.0);
        }
        l.clear();
        l.extend_from_slice(&state.l[instance.multipliers()]);
    }

    /// Evaluates the residual with `chunk` seeded, the variables from number `first` on.
    fn evaluate_chunk<const N: usize>(
        &mut self,
        instance: &ElementInstance<f64>,
        chunk: &[Variable],
        first: usize,
        t: f64,
        time_rate: f64,
        workspace: impl Fn(&mut Self) -> &mut ElementWorkspace<Jet2<DualVec<N>>>,
    ) where
        Jet2<DualVec<N>>: ElementScalar,
    {
        let mut jets = std::mem::take(workspace(self));
        let number = DualVec::constant;
        let constant = |x: &f64| Jet2::new(number(*x), number(0.0), number(0.0));
        jets.p.clear();
        jets.p.extend(instance.parameters.iter().map(constant));
        let ElementWorkspace { q, v, a, l, .. } = &self.plain;
        jets.q.clear();
        jets.q.extend((0..q.len()).map(|i| Jet2::new(number(q[i]), number(v[i]), number(a[i]))));
        for zeros in [&mut jets.v, &mut jets.a] {
            zeros.resize(q.len(), constant(&0.0)); // the entries that exist are zero as well
        }
        jets.l.clear();
        jets.l.extend(l.iter().map(constant));
        for (k, variable) in chunk.iter().enumerate() {
            match *variable {
                Variable::Coordinate(i) => jets.q[i].re.eps[k] = 1.0,
                Variable::Parameter(i) => jets.p[i].re.eps[k] = 1.0,
            }
        }
        let t = Jet2::new(number(t), number(time_rate), number(0.0));
        Jet2::<DualVec<N>>::residual(instance.element.as_ref(), t, &mut jets);
        let [n, m] = self.rows;
        for k in 0..chunk.len() {
            let dynamics = &mut self.dynamics[(first + k) * n..(first + k + 1) * n];
            dynamics.iter_mut().zip(&jets.dynamics).for_each(|(to, from)| *to = from.re.eps[k]);
            let constraint = &mut self.constraint[(first + k) * m..(first + k + 1) * m];
            let derivatives = jets.constraint.iter().map(|x| [x.re.eps[k], x.v1.eps[k], x.v2.eps[k]]);
            constraint.iter_mut().zip(derivatives).for_each(|(to, from)| *to = from);
        }
        *workspace(self) = jets;
    }
}
