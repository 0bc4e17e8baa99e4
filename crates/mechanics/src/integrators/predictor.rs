//! Extrapolation of accelerations and multipliers to the next step.

use crate::system::state::State;

/// Extrapolates accelerations and multipliers of past steps by a polynomial in time.
///
/// The polynomial is constant, linear or quadratic: the degree that predicts the last step best is used for the next. For
/// smooth motions it is two, and Newton's iteration needs one correction. For oscillations and jumps it is zero. A step that is much longer
/// than those before, as after several events in a short time, has a lower degree: extrapolation would amplify rounding errors.
#[derive(Clone, Debug)]
pub struct Predictor {
    /// Ends of past steps, the latest first; the oldest only serves to choose the degree.
    past: Vec<PredictorState>,
    count: usize,
    /// Degree of the polynomial for the next step.
    degree: usize,
}

#[derive(Clone, Debug)]
struct PredictorState {
    t: f64,
    a: Vec<f64>,
    l: Vec<f64>,
}

/// Highest degree.
const DEGREE: usize = 2;

/// Largest ratio of the length of a step to those of the steps from whose ends its values are extrapolated.
const REACH: f64 = 20.0;

impl Predictor {
    /// Predictor at the start of the motion.
    pub fn new(start: &State<f64>) -> Self {
        let end = PredictorState { t: start.t, a: start.a.clone(), l: start.l.clone() };
        Self { past: vec![end; DEGREE + 2], count: 1, degree: 0 }
    }

    /// Number of stored numbers.
    pub fn numbers(&self) -> usize {
        self.past.iter().map(|end| 1 + end.a.len() + end.l.len()).sum()
    }

    /// Adds the state at the end of a step.
    pub fn add(&mut self, state: &State<f64>) {
        self.past.rotate_right(1);
        let latest = &mut self.past[0];
        latest.t = state.t;
        latest.a.copy_from_slice(&state.a);
        latest.l.copy_from_slice(&state.l);
        self.count = (self.count + 1).min(self.past.len());
        self.degree = 0;
        let mut least = f64::INFINITY;
        for degree in 0..=DEGREE.min(self.count - 2) {
            let error = self.error(degree);
            if error < least {
                (least, self.degree) = (error, degree);
            }
        }
    }

    /// Sets accelerations and multipliers of `state` to the prediction for its time.
    pub fn predict(&self, state: &mut State<f64>) {
        let ahead = state.t - self.past[0].t;
        let is_long = |pair: &&[PredictorState]| REACH * (pair[0].t - pair[1].t) >= ahead;
        let degree = self.past[..=self.degree].windows(2).take_while(is_long).count();
        let points = &self.past[..=degree];
        let weights = weights(points, state.t);
        state.a.fill(0.0);
        state.l.fill(0.0);
        for (point, weight) in points.iter().zip(weights) {
            state.a.iter_mut().zip(&point.a).for_each(|(to, from)| *to += weight * from);
            state.l.iter_mut().zip(&point.l).for_each(|(to, from)| *to += weight * from);
        }
    }

    /// Largest error of the latest accelerations as predicted by a polynomial of `degree` through those before.
    fn error(&self, degree: usize) -> f64 {
        let (latest, points) = (&self.past[0], &self.past[1..degree + 2]);
        let weights = weights(points, latest.t);
        let predicted = |i: usize| points.iter().zip(weights).map(|(point, weight)| weight * point.a[i]).sum::<f64>();
        (0..latest.a.len()).fold(0.0, |worst, i| f64::max(worst, (predicted(i) - latest.a[i]).abs()))
    }
}

/// Lagrange weights of the `points` at the time `t` (s).
fn weights(points: &[PredictorState], t: f64) -> [f64; DEGREE + 1] {
    std::array::from_fn(|i| {
        let others = (0..points.len()).filter(|&j| j != i && i < points.len());
        others.map(|j| (t - points[j].t) / (points[i].t - points[j].t)).product()
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn state(t: f64, a: f64) -> State<f64> {
        State { t, q: vec![0.0], v: vec![0.0], a: vec![a], l: vec![2.0 * a], modes: Default::default() }
    }

    #[test]
    fn parabolas_are_continued_and_jumps_are_not() {
        let parabola = |t: f64| 3.0 - t + 2.0 * t * t;
        let mut predictor = Predictor::new(&state(0.0, parabola(0.0)));
        for t in [0.1, 0.15, 0.3, 0.4] {
            predictor.add(&state(t, parabola(t)));
        }
        let mut next = state(0.6, 0.0);
        predictor.predict(&mut next);
        assert!((next.a[0] - parabola(0.6)).abs() < 1e-12 && (next.l[0] - 2.0 * parabola(0.6)).abs() < 1e-12);
        for (t, sign) in [(0.5, 1.0), (0.6, -1.0), (0.7, 1.0)] {
            predictor.add(&state(t, sign));
        }
        predictor.predict(&mut next);
        assert_eq!(next.a, [1.0]);
    }

    #[test]
    fn rounding_errors_of_short_steps_are_not_extrapolated() {
        let mut predictor = Predictor::new(&state(0.0, 1.0));
        for k in 1..4 {
            predictor.add(&state(1e-9 * f64::from(k), 1.0 + 1e-15 * f64::from(k * k)));
        }
        let mut next = state(1.0, 0.0);
        predictor.predict(&mut next);
        assert!((next.a[0] - 1.0).abs() < 1e-12, "{:?}", next.a);
    }
}
