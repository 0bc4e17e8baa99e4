//! Derivatives of responses with respect to the state and to the parameters (cotangents), for a batch of responses.

use crate::analyses::sampling::Weights;
use crate::integrators::generalized_alpha::{GeneralizedAlpha, Prescribed};
use crate::mechanism::scalars::{Dual8, ElementScalar, StateScalar};
use crate::mechanism::{CoordinateData, Mechanism};
use autodiff::WIDTH;
use nalgebra::DMatrix;

/// Number of responses in a batch.
pub(crate) const BATCH: usize = 4;

/// One number for each response of a batch.
pub(crate) type BatchValues = [f64; BATCH];

/// Adds `factor` times `b` to `a`.
#[inline]
pub(crate) fn add(a: &mut BatchValues, factor: f64, b: &BatchValues) {
    a.iter_mut().zip(b).for_each(|(a, b)| *a += factor * b);
}

/// Derivatives of responses with respect to a state of the motion and its auxiliary accelerations.
#[derive(Clone, Debug)]
pub(crate) struct AdjointState {
    /// With respect to positions.
    pub q: Vec<BatchValues>,
    /// With respect to velocities.
    pub v: Vec<BatchValues>,
    /// With respect to accelerations.
    pub a: Vec<BatchValues>,
    /// With respect to multipliers.
    pub l: Vec<BatchValues>,
    /// With respect to auxiliary accelerations.
    pub w: Vec<BatchValues>,
}

impl AdjointState {
    /// Zero derivatives, of the size of `mechanism`.
    pub fn new(mechanism: &Mechanism<f64>) -> Self {
        let n = mechanism.coordinates.len();
        let zeros = |count| vec![[0.0; BATCH]; count];
        Self { q: zeros(n), v: zeros(n), a: zeros(n), l: zeros(mechanism.multipliers), w: zeros(n) }
    }

    /// Sets the derivatives with respect to velocities to zero. Returns them.
    pub fn take_velocities(&mut self) -> Vec<BatchValues> {
        let zeros = vec![[0.0; BATCH]; self.v.len()];
        std::mem::replace(&mut self.v, zeros)
    }

    /// Sets all derivatives to zero.
    pub fn clear(&mut self) {
        [&mut self.q, &mut self.v, &mut self.a, &mut self.l, &mut self.w]
            .into_iter()
            .for_each(|x| x.fill([0.0; BATCH]));
    }

    /// Adds the derivatives with respect to auxiliary accelerations to those with respect to accelerations: at the start of a
    /// motion the auxiliary accelerations are the accelerations.
    pub fn join_accelerations(&mut self) {
        self.a.iter_mut().zip(&mut self.w).for_each(|(a, w)| add(a, 1.0, &std::mem::take(w)));
    }

    /// Propagates the adjoint of a state between two ends to the ends: the transpose of
    /// [`interpolate`](crate::analyses::sampling::interpolate).
    pub fn propagate_to_ends(&self, weights: Weights, ends: [&mut Self; 2]) {
        let Weights { value, rate, linear } = weights;
        for (k, end) in ends.into_iter().enumerate() {
            for i in 0..self.q.len() {
                add(&mut end.q[i], value[k], &self.q[i]);
                add(&mut end.v[i], rate[k], &self.q[i]);
                add(&mut end.v[i], value[k], &self.v[i]);
                add(&mut end.a[i], rate[k], &self.v[i]);
                add(&mut end.a[i], linear[k], &self.a[i]);
            }
            end.l.iter_mut().zip(&self.l).for_each(|(to, from)| add(to, linear[k], from));
        }
    }

    /// Adds the transpose of w₀ = q̈₀ + `factor` (w − q̈₀), the auxiliary acceleration in a step that is shorter than the one
    /// before: on return, derivatives with respect to auxiliary accelerations are those with respect to w.
    pub fn rescale_auxiliary(&mut self, factor: f64) {
        for (a, w) in self.a.iter_mut().zip(&mut self.w) {
            add(a, 1.0 - factor, w);
            w.iter_mut().for_each(|w| *w *= factor);
        }
    }

    /// Propagates the lead of the auxiliary acceleration at the end of a step without history, w₁ = q̈₁ + `lead` (q̈₁ − q̈₀), to
    /// the accelerations at its ends. The rest of the transpose is that of w₁ = q̈₁.
    pub fn propagate_lead(&mut self, before: &mut Self, lead: f64) {
        for ((w, a), old) in self.w.iter().zip(&mut self.a).zip(&mut before.a) {
            add(a, lead, w);
            add(old, -lead, w);
        }
    }

    /// Derivative with respect to the new acceleration of a free coordinate, which determines its position and velocity.
    pub fn by_acceleration(&self, scheme: &GeneralizedAlpha, h: f64, i: usize) -> BatchValues {
        let (position, velocity) = scheme.newmark_coefficients(h);
        let mut adjoint = self.a[i];
        add(&mut adjoint, scheme.ratio(), &self.w[i]);
        add(&mut adjoint, position, &self.q[i]);
        add(&mut adjoint, velocity, &self.v[i]);
        adjoint
    }

    /// Propagates the adjoint of a free coordinate from the end of the step `h` to its beginning.
    pub fn propagate_free(&self, before: &mut Self, scheme: &GeneralizedAlpha, h: f64, i: usize) {
        let mut auxiliary = self.w[i];
        add(&mut auxiliary, h * h * scheme.beta, &self.q[i]);
        add(&mut auxiliary, h * scheme.gamma, &self.v[i]);
        before.add_explicit_part(scheme, h, i, &self.q[i], &self.v[i], &auxiliary);
    }

    /// Propagates the adjoint of a coordinate whose velocity and acceleration follow from its prescribed positions by the
    /// formulas of the method. Returns the derivative with respect to the prescribed position.
    pub fn propagate_prescribed(&self, before: &mut Self, scheme: &GeneralizedAlpha, h: f64, i: usize) -> BatchValues {
        let mut auxiliary = self.w[i];
        add(&mut auxiliary, h * scheme.gamma, &self.v[i]);
        add(&mut auxiliary, 1.0 / scheme.ratio(), &self.a[i]);
        let mut position = self.q[i];
        let factor = 1.0 / (h * h * scheme.beta);
        add(&mut position, factor, &auxiliary);
        let explicit = auxiliary.map(|x| -factor * x);
        let history = self.a[i].map(|x| -x / scheme.ratio());
        before.add_explicit_part(scheme, h, i, &explicit, &self.v[i], &history);
        position
    }

    /// The transpose of the explicit part of a step: q₀ + h v₀ + h² (½ − β) w₀, v₀ + h (1 − γ) w₀, and the history of w₁.
    fn add_explicit_part(
        &mut self,
        scheme: &GeneralizedAlpha,
        h: f64,
        i: usize,
        q: &BatchValues,
        v: &BatchValues,
        history: &BatchValues,
    ) {
        let [old, auxiliary] = scheme.history();
        add(&mut self.q[i], 1.0, q);
        add(&mut self.v[i], h, q);
        add(&mut self.v[i], 1.0, v);
        add(&mut self.w[i], h * h * (0.5 - scheme.beta), q);
        add(&mut self.w[i], h * (1.0 - scheme.gamma), v);
        add(&mut self.w[i], auxiliary, history);
        add(&mut self.a[i], old, history);
    }
}

/// Derivatives of responses with respect to parameters, summed over a motion.
#[derive(Clone, Debug)]
pub(crate) struct DesignAdjoint {
    /// With respect to each parameter of each element.
    pub parameters: Vec<Vec<BatchValues>>,
    /// With respect to each parameter of each coordinate's motion.
    motions: Vec<Vec<BatchValues>>,
    /// With respect to the weight of each term of each output.
    pub weights: Vec<Vec<BatchValues>>,
}

impl DesignAdjoint {
    /// Zero derivatives, of the size of `mechanism`.
    pub fn new(mechanism: &Mechanism<f64>) -> Self {
        let zeros = |count| vec![[0.0; BATCH]; count];
        let motion = |c: &CoordinateData<f64>| zeros(c.motion.as_ref().map_or(0, |(_, parameters)| parameters.len()));
        Self {
            parameters: mechanism.elements.iter().map(|instance| zeros(instance.parameters.len())).collect(),
            motions: mechanism.coordinates.iter().map(motion).collect(),
            weights: mechanism.outputs.iter().map(|output| zeros(output.terms.len())).collect(),
        }
    }

    /// Adds the derivatives with respect to the parameters of the motion of coordinate `i`. `adjoints` are those with respect
    /// to its prescribed position, velocity and acceleration at the time `t` (s).
    pub fn add_motion(
        &mut self,
        mechanism: &Mechanism<f64>,
        i: usize,
        t: f64,
        prescribed: Prescribed,
        adjoints: [&BatchValues; 3],
    ) {
        let Some((motion, parameters)) = &mechanism.coordinates[i].motion else { return };
        let seeded: Vec<_> = parameters.iter().enumerate().map(|(k, &p)| Dual8::variable(p, k)).collect();
        let motion = match prescribed {
            Prescribed::Exact => Dual8::motion(motion.as_ref(), &seeded, Dual8::constant(t)),
            Prescribed::Newmark => {
                let position = Dual8::position(motion.as_ref(), &seeded, Dual8::constant(t));
                [position, Dual8::constant(0.0), Dual8::constant(0.0)]
            }
        };
        for (value, adjoint) in motion.iter().zip(adjoints) {
            self.motions[i].iter_mut().zip(value.eps).for_each(|(to, derivative)| add(to, derivative, adjoint));
        }
    }

    /// Adds the gradients of the responses with respect to the design variables from number `first` on, which are seeded in
    /// `chunk`, to the rows from number `row` on. `start` has the derivatives with respect to the positions and velocities
    /// with which free coordinates were built.
    pub fn add_gradients(
        &self,
        chunk: &Mechanism<Dual8>,
        start: &AdjointState,
        rows: &mut DMatrix<f64>,
        [row, first]: [usize; 2],
    ) {
        let parameters = chunk.elements.iter().zip(&self.parameters);
        let parameters = parameters.flat_map(|(instance, adjoints)| instance.parameters.iter().zip(adjoints));
        let coordinates = || chunk.coordinates.iter().enumerate();
        let driven = coordinates().filter_map(|(i, c)| c.motion.as_ref().map(|(_, parameters)| (i, parameters)));
        let motions = driven.flat_map(|(i, parameters)| parameters.iter().zip(&self.motions[i]));
        let weights = chunk.outputs.iter().zip(&self.weights);
        let weights = weights.flat_map(|(output, adjoints)| output.terms.iter().map(|term| &term.weight).zip(adjoints));
        let free = coordinates().filter(|(_, c)| c.motion.is_none());
        let built = free.flat_map(|(i, c)| [(&c.position, &start.q[i]), (&c.velocity, &start.v[i])]);
        let mut sums = [[0.0; BATCH]; WIDTH];
        for (value, adjoint) in parameters.chain(motions).chain(weights).chain(built) {
            sums.iter_mut().zip(value.eps).for_each(|(sum, derivative)| add(sum, derivative, adjoint));
        }
        for response in 0..BATCH.min(rows.nrows() - row) {
            for k in 0..WIDTH.min(rows.ncols() - first) {
                rows[(row + response, first + k)] += sums[k][response];
            }
        }
    }
}
