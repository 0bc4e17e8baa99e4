//! Adjoint variables of a step: what a change of its end would do to the responses.

use crate::analyses::sampling::Weights;
use crate::integrators::generalized_alpha::GeneralizedAlpha;
use crate::mechanism::Mechanism;

/// Responses that one pass backward carries side by side.
pub(crate) const BATCH: usize = 4;

/// One number for each of these responses.
pub(crate) type BatchValues = [f64; BATCH];

/// Adds `factor` times `b` to `a`.
#[inline]
pub(crate) fn add(a: &mut BatchValues, factor: f64, b: &BatchValues) {
    a.iter_mut().zip(b).for_each(|(a, b)| *a += factor * b);
}

/// The derivatives of responses with respect to a state of the motion, its auxiliary accelerations included.
#[derive(Clone, Debug)]
pub(crate) struct AdjointState {
    /// By positions.
    pub q: Vec<BatchValues>,
    /// By velocities.
    pub v: Vec<BatchValues>,
    /// By accelerations.
    pub a: Vec<BatchValues>,
    /// By multipliers.
    pub l: Vec<BatchValues>,
    /// By auxiliary accelerations.
    pub w: Vec<BatchValues>,
}

impl AdjointState {
    /// Zeros.
    pub fn new(mechanism: &Mechanism<f64>) -> Self {
        let n = mechanism.coordinates.len();
        let zeros = |count| vec![[0.0; BATCH]; count];
        Self { q: zeros(n), v: zeros(n), a: zeros(n), l: zeros(mechanism.multipliers), w: zeros(n) }
    }

    /// Makes everything zero.
    pub fn clear(&mut self) {
        [&mut self.q, &mut self.v, &mut self.a, &mut self.l, &mut self.w]
            .into_iter()
            .for_each(|x| x.fill([0.0; BATCH]));
    }

    /// At the start auxiliary accelerations are accelerations.
    pub fn join(&mut self) {
        self.a.iter_mut().zip(&mut self.w).for_each(|(a, w)| add(a, 1.0, &std::mem::take(w)));
    }

    /// Hands those of a state between two ends on to the ends: the transpose of
    /// [`interpolate`](crate::analyses::sampling::interpolate).
    pub fn spread(&self, weights: Weights, ends: [&mut Self; 2]) {
        let Weights { value, slope, linear } = weights;
        for (k, end) in ends.into_iter().enumerate() {
            for i in 0..self.q.len() {
                add(&mut end.q[i], value[k], &self.q[i]);
                add(&mut end.v[i], slope[k], &self.q[i]);
                add(&mut end.v[i], value[k], &self.v[i]);
                add(&mut end.a[i], slope[k], &self.v[i]);
                add(&mut end.a[i], linear[k], &self.a[i]);
            }
            end.l.iter_mut().zip(&self.l).for_each(|(to, from)| add(to, linear[k], from));
        }
    }

    /// By the new acceleration of a free coordinate, at fixed equations.
    pub fn by_acceleration(&self, scheme: &GeneralizedAlpha, h: f64, i: usize) -> BatchValues {
        let (position, velocity) = scheme.newmark_coefficients(h);
        let mut bar = self.a[i];
        add(&mut bar, scheme.ratio(), &self.w[i]);
        add(&mut bar, position, &self.q[i]);
        add(&mut bar, velocity, &self.v[i]);
        bar
    }

    /// Hands those of a free coordinate at the end of the step `h` on to its beginning.
    pub fn free_to(&self, before: &mut Self, scheme: &GeneralizedAlpha, h: f64, i: usize) {
        let mut auxiliary = self.w[i];
        add(&mut auxiliary, h * h * scheme.beta, &self.q[i]);
        add(&mut auxiliary, h * scheme.gamma, &self.v[i]);
        before.coast(scheme, h, i, &self.q[i], &self.v[i], &auxiliary);
    }

    /// The same for a coordinate whose velocity and acceleration follow from its prescribed positions by the method's own
    /// formulas. Returns the derivative by the prescribed position.
    pub fn prescribed_to(&self, before: &mut Self, scheme: &GeneralizedAlpha, h: f64, i: usize) -> BatchValues {
        let mut auxiliary = self.w[i];
        add(&mut auxiliary, h * scheme.gamma, &self.v[i]);
        add(&mut auxiliary, 1.0 / scheme.ratio(), &self.a[i]);
        let mut position = self.q[i];
        let slope = 1.0 / (h * h * scheme.beta);
        add(&mut position, slope, &auxiliary);
        let coast = auxiliary.map(|x| -slope * x);
        let history = self.a[i].map(|x| -x / scheme.ratio());
        before.coast(scheme, h, i, &coast, &self.v[i], &history);
        position
    }

    /// The transpose of a step's explicit part: q₀ + h v₀ + h² (½ − β) w₀ and v₀ + h (1 − γ) w₀, and the history of w₁.
    fn coast(
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
