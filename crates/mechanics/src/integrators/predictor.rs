//! A first guess for the next step from the steps before.

use crate::system::state::State;

/// Accelerations and multipliers of past steps, continued by a polynomial in time.
///
/// Constant, linear and quadratic continuation are compared on the last step: whichever would have predicted it best is
/// used for the next. Smooth motions take the quadratic one, which leaves Newton's iteration one correction to do;
/// oscillations and jumps fall back to the constant one.
#[derive(Clone, Debug)]
pub struct Predictor {
    /// The latest first; the last of them only serves to judge.
    past: Vec<StepEnd>,
    known: usize,
    /// Degree of the polynomial.
    degree: usize,
}

#[derive(Clone, Debug)]
struct StepEnd {
    t: f64,
    a: Vec<f64>,
    l: Vec<f64>,
}

/// Highest degree.
const DEGREE: usize = 2;

impl Predictor {
    /// At the beginning.
    pub fn new(start: &State<f64>) -> Self {
        let instant = StepEnd { t: start.t, a: start.a.clone(), l: start.l.clone() };
        Self { past: vec![instant; DEGREE + 2], known: 1, degree: 0 }
    }

    /// Numbers that it holds.
    pub fn numbers(&self) -> usize {
        self.past.iter().map(|instant| 1 + instant.a.len() + instant.l.len()).sum()
    }

    /// Takes note of the state at the end of a step.
    pub fn learn(&mut self, state: &State<f64>) {
        self.past.rotate_right(1);
        let latest = &mut self.past[0];
        latest.t = state.t;
        latest.a.copy_from_slice(&state.a);
        latest.l.copy_from_slice(&state.l);
        self.known = (self.known + 1).min(self.past.len());
        self.degree = 0;
        let mut least = f64::INFINITY;
        for degree in 0..=DEGREE.min(self.known - 2) {
            let miss = self.miss(degree);
            if miss < least {
                (least, self.degree) = (miss, degree);
            }
        }
    }

    /// Puts the guess for its time into `state`.
    pub fn guess(&self, state: &mut State<f64>) {
        let points = &self.past[..=self.degree];
        let weights = weights(points, state.t);
        state.a.fill(0.0);
        state.l.fill(0.0);
        for (point, weight) in points.iter().zip(weights) {
            state.a.iter_mut().zip(&point.a).for_each(|(to, from)| *to += weight * from);
            state.l.iter_mut().zip(&point.l).for_each(|(to, from)| *to += weight * from);
        }
    }

    /// How far the latest accelerations are from what a polynomial through those before gives.
    fn miss(&self, degree: usize) -> f64 {
        let (latest, points) = (&self.past[0], &self.past[1..degree + 2]);
        let weights = weights(points, latest.t);
        let guess = |i: usize| points.iter().zip(weights).map(|(point, weight)| weight * point.a[i]).sum::<f64>();
        (0..latest.a.len()).fold(0.0, |worst, i| f64::max(worst, (guess(i) - latest.a[i]).abs()))
    }
}

/// Lagrange's weights of the `points` at time `t`.
fn weights(points: &[StepEnd], t: f64) -> [f64; DEGREE + 1] {
    std::array::from_fn(|i| {
        let others = (0..points.len()).filter(|&j| j != i && i < points.len());
        others.map(|j| (t - points[j].t) / (points[i].t - points[j].t)).product()
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn state(t: f64, a: f64) -> State<f64> {
        State { t, q: vec![0.0], v: vec![0.0], a: vec![a], l: vec![2.0 * a] }
    }

    #[test]
    fn parabolas_are_continued_and_jumps_are_not() {
        let parabola = |t: f64| 3.0 - t + 2.0 * t * t;
        let mut predictor = Predictor::new(&state(0.0, parabola(0.0)));
        for t in [0.1, 0.15, 0.3, 0.4] {
            predictor.learn(&state(t, parabola(t)));
        }
        let mut next = state(0.6, 0.0);
        predictor.guess(&mut next);
        assert!((next.a[0] - parabola(0.6)).abs() < 1e-12 && (next.l[0] - 2.0 * parabola(0.6)).abs() < 1e-12);
        for (t, sign) in [(0.5, 1.0), (0.6, -1.0), (0.7, 1.0)] {
            predictor.learn(&state(t, sign));
        }
        predictor.guess(&mut next);
        assert_eq!(next.a, [1.0]);
    }
}
