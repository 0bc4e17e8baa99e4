//! Derivatives of one constraint along a motion.

use crate::derivatives::forward::explicit::linearize::ConstraintDerivative;
use crate::elements::element::{ConstraintDerivatives, ElementState, ElementWorkspace, Variable};
use crate::mechanism::ElementInstance;
use crate::mechanism::scalars::{Dual4, Dual8, ElementScalar, Jet2};
use crate::system::state::State;
use autodiff::{DualVec, WIDTH};

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
    /// Differentiates `part` along the motion that `constraint` wants: in closed form, or else in jets of dual numbers.
    ///
    /// A constraint is evaluated on positions that move in time (jets) and are seeded: its velocities need no columns of
    /// their own, as the derivative of Φ̈ with respect to velocities is twice that of Φ̇ with respect to positions.
    pub fn evaluate(
        &mut self,
        part: &ElementInstance<f64>,
        variables: &[Variable],
        state: &State<f64>,
        constraint: ConstraintDerivative,
    ) {
        self.rows = [part.coordinates.len(), part.num_constraints];
        self.dynamics.clear();
        self.dynamics.resize(variables.len() * part.coordinates.len(), 0.0);
        self.constraint.clear();
        self.constraint.resize(variables.len() * part.num_constraints, [0.0; 3]);
        self.place(part, state, constraint);
        let local = ElementState { p: &part.parameters, ..self.plain.local(state.t) };
        let mut slopes = ConstraintDerivatives { dynamics: &mut self.dynamics, constraint: &mut self.constraint };
        if part.element.constraint_derivatives(&local, variables, &mut slopes) {
            return;
        }
        let pace = f64::from(u8::from(constraint.follows_motion()));
        if variables.len() <= 4 {
            return self.chunk(part, variables, 0, state.t, pace, |slopes| &mut slopes.short_jets);
        }
        for (k, chunk) in variables.chunks(WIDTH).enumerate() {
            self.chunk(part, chunk, k * WIDTH, state.t, pace, |slopes| &mut slopes.jets);
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

    /// Puts the motion and the multipliers in place.
    fn place(&mut self, part: &ElementInstance<f64>, state: &State<f64>, constraint: ConstraintDerivative) {
        let rates = if constraint.follows_motion() { &state.v } else { &state.a };
        let ElementWorkspace { q, v, a, l, .. } = &mut self.plain;
        for (to, from) in [(q, &state.q), (v, rates), (&mut *a, &state.a)] {
            to.clear();
            to.extend(part.coordinates.iter().map(|&i| from[i]));
        }
        if constraint != ConstraintDerivative::Accelerations {
            a.fill(0.0);
        }
        l.clear();
        l.extend_from_slice(&state.l[part.first_multiplier..part.first_multiplier + part.num_constraints]);
    }

    /// Evaluates the residual with one chunk of the variables seeded, the `first` of them and what follows.
    fn chunk<const N: usize>(
        &mut self,
        part: &ElementInstance<f64>,
        chunk: &[Variable],
        first: usize,
        t: f64,
        pace: f64,
        workspace: impl Fn(&mut Self) -> &mut ElementWorkspace<Jet2<DualVec<N>>>,
    ) where
        Jet2<DualVec<N>>: ElementScalar,
    {
        let mut jets = std::mem::take(workspace(self));
        let number = DualVec::constant;
        let constant = |x: &f64| Jet2::new(number(*x), number(0.0), number(0.0));
        jets.p.clear();
        jets.p.extend(part.parameters.iter().map(constant));
        let ElementWorkspace { q, v, a, l, .. } = &self.plain;
        jets.q.clear();
        jets.q.extend((0..q.len()).map(|i| Jet2::new(number(q[i]), number(v[i]), number(a[i]))));
        for still in [&mut jets.v, &mut jets.a] {
            still.resize(q.len(), constant(&0.0)); // what is there already is zero as well
        }
        jets.l.clear();
        jets.l.extend(l.iter().map(constant));
        for (k, variable) in chunk.iter().enumerate() {
            match *variable {
                Variable::Coordinate(i) => jets.q[i].re.eps[k] = 1.0,
                Variable::Parameter(i) => jets.p[i].re.eps[k] = 1.0,
            }
        }
        let t = Jet2::new(number(t), number(pace), number(0.0));
        Jet2::<DualVec<N>>::residual(part.element.as_ref(), t, &mut jets);
        let [n, m] = self.rows;
        for k in 0..chunk.len() {
            let dynamics = &mut self.dynamics[(first + k) * n..(first + k + 1) * n];
            dynamics.iter_mut().zip(&jets.dynamics).for_each(|(to, from)| *to = from.re.eps[k]);
            let constraint = &mut self.constraint[(first + k) * m..(first + k + 1) * m];
            let slopes = jets.constraint.iter().map(|x| [x.re.eps[k], x.v1.eps[k], x.v2.eps[k]]);
            constraint.iter_mut().zip(slopes).for_each(|(to, from)| *to = from);
        }
        *workspace(self) = jets;
    }
}
