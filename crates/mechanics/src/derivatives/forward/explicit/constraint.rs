//! Derivatives of one constraint along a motion.

use crate::derivatives::forward::explicit::linearize::Closure;
use crate::elements::element::{Local, Room, Slopes, Variable};
use crate::mechanism::PartData;
use crate::mechanism::scalars::{Jet, Narrow, Number, Sensitive};
use crate::system::state::State;
use autodiff::{Tangent, WIDTH};

/// Derivatives of a constraint's rows with respect to a few of its variables, variable by variable.
#[derive(Clone, Default)]
pub(crate) struct ConstraintSlopes {
    /// Of Φ_qᵀ λ, for each coordinate.
    balance: Vec<f64>,
    /// Of Φ, Φ̇ and Φ̈, for each multiplier.
    closure: Vec<[f64; 3]>,
    rows: [usize; 2],
    plain: Room<f64>,
    jets: Room<Jet<Sensitive>>,
    short_jets: Room<Jet<Narrow>>,
}

impl ConstraintSlopes {
    /// Differentiates `part` along the motion that `closure` wants: in closed form, or else in jets of dual numbers.
    ///
    /// A constraint is evaluated on positions that move in time (jets) and are seeded: its velocities need no columns of
    /// their own, as the derivative of Φ̈ with respect to velocities is twice that of Φ̇ with respect to positions.
    pub fn evaluate(&mut self, part: &PartData<f64>, variables: &[Variable], state: &State<f64>, closure: Closure) {
        self.rows = [part.coordinates.len(), part.closures];
        self.balance.clear();
        self.balance.resize(variables.len() * part.coordinates.len(), 0.0);
        self.closure.clear();
        self.closure.resize(variables.len() * part.closures, [0.0; 3]);
        self.place(part, state, closure);
        let local = Local { p: &part.parameters, ..self.plain.local(state.t) };
        let mut slopes = Slopes { balance: &mut self.balance, closure: &mut self.closure };
        if part.element.slopes(&local, variables, &mut slopes) {
            return;
        }
        let pace = f64::from(u8::from(closure.follows_motion()));
        if variables.len() <= 4 {
            return self.chunk(part, variables, 0, state.t, pace, |slopes| &mut slopes.short_jets);
        }
        for (k, chunk) in variables.chunks(WIDTH).enumerate() {
            self.chunk(part, chunk, k * WIDTH, state.t, pace, |slopes| &mut slopes.jets);
        }
    }

    /// Derivative of Φ_qᵀ λ in the row of the coordinate `row` with respect to variable `k`.
    #[inline]
    pub fn balance(&self, row: usize, k: usize) -> f64 {
        self.balance[k * self.rows[0] + row]
    }

    /// Derivatives of Φ, Φ̇ and Φ̈ with respect to variable `k`.
    #[inline]
    pub fn closure(&self, row: usize, k: usize) -> [f64; 3] {
        self.closure[k * self.rows[1] + row]
    }

    /// Puts the motion and the multipliers in place.
    fn place(&mut self, part: &PartData<f64>, state: &State<f64>, closure: Closure) {
        let rates = if closure.follows_motion() { &state.v } else { &state.a };
        let Room { q, v, a, l, .. } = &mut self.plain;
        for (to, from) in [(q, &state.q), (v, rates), (&mut *a, &state.a)] {
            to.clear();
            to.extend(part.coordinates.iter().map(|&i| from[i]));
        }
        if closure != Closure::Accelerations {
            a.fill(0.0);
        }
        l.clear();
        l.extend_from_slice(&state.l[part.first_multiplier..part.first_multiplier + part.closures]);
    }

    /// Evaluates the residual with one chunk of the variables seeded, the `first` of them and what follows.
    fn chunk<const N: usize>(
        &mut self,
        part: &PartData<f64>,
        chunk: &[Variable],
        first: usize,
        t: f64,
        pace: f64,
        room: impl Fn(&mut Self) -> &mut Room<Jet<Tangent<N>>>,
    ) where
        Jet<Tangent<N>>: Number,
    {
        let mut jets = std::mem::take(room(self));
        let number = Tangent::constant;
        let constant = |x: &f64| Jet::new(number(*x), number(0.0), number(0.0));
        jets.p.clear();
        jets.p.extend(part.parameters.iter().map(constant));
        let Room { q, v, a, l, .. } = &self.plain;
        jets.q.clear();
        jets.q.extend((0..q.len()).map(|i| Jet::new(number(q[i]), number(v[i]), number(a[i]))));
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
        let t = Jet::new(number(t), number(pace), number(0.0));
        Jet::<Tangent<N>>::residual(part.element.as_ref(), t, &mut jets);
        let [n, m] = self.rows;
        for k in 0..chunk.len() {
            let balance = &mut self.balance[(first + k) * n..(first + k + 1) * n];
            balance.iter_mut().zip(&jets.balance).for_each(|(to, from)| *to = from.re.eps[k]);
            let closure = &mut self.closure[(first + k) * m..(first + k + 1) * m];
            let slopes = jets.closure.iter().map(|x| [x.re.eps[k], x.v1.eps[k], x.v2.eps[k]]);
            closure.iter_mut().zip(slopes).for_each(|(to, from)| *to = from);
        }
        *room(self) = jets;
    }
}
