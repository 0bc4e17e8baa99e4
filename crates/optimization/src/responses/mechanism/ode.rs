//! The outputs of an ordinary differential equation as responses, at time points and between them.

use crate::Result;
use crate::problem::{Analysis, ContinuousTime, ResponseAt, Responses, seed_block};
use autodiff::{BLOCK, HyperDual, Scalar};
use mechanics::derivatives::forward::explicit::differentiate_ode;
use mechanics::integrators::explicit::{Explicit, Ode, integrate};
use nalgebra::{Const, DMatrix, SMatrix, SVector, U1};
use num_dual::Derivative;
use std::sync::{Arc, OnceLock};

/// dy/dt = f(b, t, y) with y(t₀) = y₀(b), and outputs r_h(b, t, y), written once over the scalar, time included.
pub trait OdeModel: Send + Sync {
    /// The state at the start.
    fn start<S: Scalar>(&self, b: &[S]) -> Vec<S>;
    /// Writes dy/dt at time `t` (s) to `out`. Branch on real parts only.
    fn rates<S: Scalar>(&self, b: &[S], t: S, y: &[S], out: &mut [S]);
    /// Output `h`, in its unit.
    fn output<S: Scalar>(&self, h: usize, b: &[S], t: S, y: &[S]) -> S;
    /// Number of outputs.
    fn outputs(&self) -> usize;
}

/// The outputs of an [`OdeModel`] over one time grid, as responses of an optimization problem in continuous time.
///
/// The state is integrated by explicit steps and differentiated along with them; between time points the integration continues
/// from the last one. Outputs are differentiated with respect to design and time in dual numbers.
pub struct OdeResponses<E> {
    model: E,
    settings: Explicit,
    times: Vec<f64>,
}

/// States at the time points and, after the first request, their derivatives.
struct StoredStates {
    design: Vec<f64>,
    /// `states[p][component]`.
    states: Vec<Vec<f64>>,
    /// `gradients[component][p]`.
    gradients: OnceLock<Vec<Vec<Vec<f64>>>>,
}

/// The differential equation with any initial state, which may depend on the design.
struct Restarted<'e, E> {
    model: &'e E,
    /// None for the initial state of the model.
    state: Option<InitialState<'e>>,
}

/// A state from which the integration continues.
struct InitialState<'e> {
    values: &'e [f64],
    /// Its gradients with respect to the design, component by component; empty where they are not needed.
    gradients: Vec<&'e [f64]>,
    /// The design of these derivatives.
    design: &'e [f64],
}

impl<E: OdeModel> Ode for Restarted<'_, E> {
    fn start<S: Scalar>(&self, b: &[S]) -> Vec<S> {
        let Some(InitialState { values, gradients, design }) = &self.state else { return self.model.start(b) };
        let component = |(i, &y): (usize, &f64)| {
            let gradient = gradients.get(i).copied().unwrap_or(&[]);
            let steps = b.iter().zip(*design).zip(gradient).map(|((b, d), s)| (*b - *d) * *s);
            steps.fold(S::from(y), |sum, step| sum + step)
        };
        values.iter().enumerate().map(component).collect()
    }

    fn rates<S: Scalar>(&self, b: &[S], t: f64, y: &[S], out: &mut [S]) {
        self.model.rates(b, S::from(t), y, out);
    }
}

impl<E: OdeModel> OdeResponses<E> {
    /// Responses from the outputs of `model` at `times` (s, increasing).
    ///
    /// # Errors
    ///
    /// [`crate::Error::Option`] or [`crate::Error::Definition`] if a setting or the times are impossible.
    pub fn new(model: E, settings: Explicit, times: &[f64]) -> Result<Self> {
        settings.check(times)?;
        Ok(Self { model, settings, times: times.to_vec() })
    }

    fn restarted(&self) -> Restarted<'_, E> {
        Restarted { model: &self.model, state: None }
    }

    fn states(&self, b: &[f64]) -> Result<StoredStates> {
        let history = integrate(&self.restarted(), b, &self.settings, &self.times)?;
        let state = |p: usize| history.values.iter().map(|series| series[p]).collect();
        let states = (0..self.times.len()).map(state).collect();
        Ok(StoredStates { design: b.to_vec(), states, gradients: OnceLock::new() })
    }

    /// The stored states of the analysis of `b`, or new ones.
    fn trace(&self, b: &[f64], responses: &Responses) -> Result<Arc<StoredStates>> {
        let stored = responses.trace.clone().and_then(|trace| trace.downcast::<StoredStates>().ok());
        stored.filter(|trace| trace.design == b).map_or_else(|| self.states(b).map(Arc::new), Ok)
    }

    fn gradients<'t>(&self, b: &[f64], trace: &'t StoredStates) -> Result<&'t Vec<Vec<Vec<f64>>>> {
        if trace.gradients.get().is_none() {
            let gradients = differentiate_ode(&self.restarted(), b, &self.settings, &self.times)?.gradients;
            return Ok(trace.gradients.get_or_init(|| gradients));
        }
        Ok(trace.gradients.get().expect("it is set above or before"))
    }

    /// The last time point up to `t`, and the settings from that point.
    fn before(&self, t: f64) -> (usize, Explicit) {
        let p = self.times.partition_point(|&point| point <= t).saturating_sub(1);
        (p, Explicit { start: self.times[p], ..self.settings.clone() })
    }

    /// The state at any time from the first time point on.
    fn state(&self, b: &[f64], trace: &StoredStates, t: f64) -> Result<Vec<f64>> {
        let (p, settings) = self.before(t);
        if t <= self.times[p] {
            return Ok(trace.states[p].clone());
        }
        let from = Restarted {
            model: &self.model,
            state: Some(InitialState { values: &trace.states[p], gradients: vec![], design: b }),
        };
        Ok(integrate(&from, b, &settings, &[t])?.values.iter().map(|series| series[0]).collect())
    }

    /// The gradients of the state at the time `t` (s): one for each component.
    fn state_gradients(&self, b: &[f64], trace: &StoredStates, t: f64) -> Result<Vec<Vec<f64>>> {
        let (p, settings) = self.before(t);
        let gradients = self.gradients(b, trace)?;
        let here: Vec<&[f64]> = gradients.iter().map(|series| &series[p][..]).collect();
        if t <= self.times[p] {
            return Ok(here.iter().map(|s| s.to_vec()).collect());
        }
        let from = Restarted {
            model: &self.model,
            state: Some(InitialState { values: &trace.states[p], gradients: here, design: b }),
        };
        let onward = differentiate_ode(&from, b, &settings, &[t])?;
        Ok(onward.gradients.into_iter().map(|mut series| series.swap_remove(0)).collect())
    }

    fn rates_at<S: Scalar>(&self, b: &[S], t: S, y: &[S]) -> Vec<S> {
        let mut out = vec![S::from(0.0); y.len()];
        self.model.rates(b, t, y, &mut out);
        out
    }
}

/// A number with derivatives with respect to up to [`BLOCK`] variables and to time, and mixed ones.
fn number(value: f64, first: &[f64], rate: f64, mixed: &[f64]) -> HyperDual {
    let entry = |v: &[f64], a: usize| v.get(a).copied().unwrap_or(0.0);
    let across = SVector::<f64, BLOCK>::from_fn(|a, _| entry(first, a));
    let along = SVector::<f64, BLOCK>::from_fn(|c, _| if c == 0 { rate } else { 0.0 }).transpose();
    let both = SMatrix::<f64, BLOCK, BLOCK>::from_fn(|a, c| if c == 0 { entry(mixed, a) } else { 0.0 });
    HyperDual::new(value, Derivative::some(across), Derivative::some(along), Derivative::some(both))
}

fn first_derivatives(value: &HyperDual) -> SVector<f64, BLOCK> {
    value.eps1.unwrap_generic(Const::<BLOCK>, U1)
}

fn mixed_derivatives(value: &HyperDual) -> SVector<f64, BLOCK> {
    value.eps1eps2.unwrap_generic(Const::<BLOCK>, Const::<BLOCK>).column(0).into_owned()
}

impl<E: OdeModel> Analysis for OdeResponses<E> {
    fn analyze(&self, b: &[f64]) -> Result<Responses> {
        let trace = self.states(b)?;
        let series = |h| self.times.iter().zip(&trace.states).map(move |(&t, y)| (h, t, y));
        let value = |(h, t, y): (usize, f64, &Vec<f64>)| self.model.output(h, b, t, y);
        let values = (0..self.model.outputs()).map(|h| series(h).map(value).collect()).collect();
        Ok(Responses { trace: Some(Arc::new(trace)), ..Responses::new(values) })
    }

    fn sensitivities(&self, b: &[f64], responses: &Responses, wanted: &[ResponseAt]) -> Result<DMatrix<f64>> {
        let trace = self.trace(b, responses)?;
        let gradients = self.gradients(b, &trace)?;
        let mut rows = DMatrix::zeros(wanted.len(), b.len());
        for (row, at) in wanted.iter().enumerate() {
            let (t, y) = (HyperDual::from(self.times[at.point]), &trace.states[at.point]);
            for start in (0..b.len()).step_by(BLOCK) {
                let of = |(i, &y): (usize, &f64)| number(y, &gradients[i][at.point][start..], 0.0, &[]);
                let y: Vec<HyperDual> = y.iter().enumerate().map(of).collect();
                let first = first_derivatives(&self.model.output(at.response, &seed_block(b, start), t, &y));
                (0..BLOCK.min(b.len() - start)).for_each(|a| rows[(row, start + a)] = first[a]);
            }
        }
        Ok(rows)
    }

    fn continuous(&self) -> Option<&dyn ContinuousTime> {
        Some(self)
    }
}

impl<E: OdeModel> ContinuousTime for OdeResponses<E> {
    fn rates(&self, b: &[f64], responses: &Responses, h: usize, t: f64) -> Result<[f64; 3]> {
        let trace = self.trace(b, responses)?;
        let y = self.state(b, &trace, t)?;
        let rates = self.rates_at(b, t, &y);
        let constants: Vec<HyperDual> = b.iter().map(|&v| HyperDual::from_re(v)).collect();
        let moving: Vec<HyperDual> = y.iter().zip(&rates).map(|(&y, &r)| number(y, &[r], 0.0, &[])).collect();
        let second = self.rates_at(&constants, number(t, &[1.0], 0.0, &[]), &moving);
        let state =
            y.iter().zip(&rates).zip(&second).map(|((&y, &r), s)| number(y, &[r], r, &[first_derivatives(s)[0]]));
        let value = self.model.output(h, &constants, number(t, &[1.0], 1.0, &[]), &state.collect::<Vec<_>>());
        Ok([value.re, first_derivatives(&value)[0], mixed_derivatives(&value)[0]])
    }

    fn rate_sensitivities(&self, b: &[f64], responses: &Responses, h: usize, t: f64) -> Result<[Vec<f64>; 2]> {
        let trace = self.trace(b, responses)?;
        let (y, gradients) = (self.state(b, &trace, t)?, self.state_gradients(b, &trace, t)?);
        let mut sensitivities = [Vec::with_capacity(b.len()), Vec::with_capacity(b.len())];
        for start in (0..b.len()).step_by(BLOCK) {
            let design = seed_block(b, start);
            let still: Vec<HyperDual> =
                y.iter().zip(&gradients).map(|(&y, s)| number(y, &s[start..], 0.0, &[])).collect();
            let rates = self.rates_at(&design, HyperDual::from_re(t), &still);
            let state = y.iter().zip(&gradients).zip(&rates);
            let state = state.map(|((&y, s), r)| number(y, &s[start..], r.re, first_derivatives(r).as_slice()));
            let time = number(t, &[], 1.0, &[]);
            let value = self.model.output(h, &design, time, &state.collect::<Vec<_>>());
            let count = BLOCK.min(b.len() - start);
            sensitivities[0].extend(first_derivatives(&value).iter().take(count));
            sensitivities[1].extend(mixed_derivatives(&value).iter().take(count));
        }
        Ok(sensitivities)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// ẏ = −b₀ y + sin(b₁ t), y(0) = b₂; outputs y² and b₁ t y: five derivatives against differences.
    struct ForcedOscillator;

    impl OdeModel for ForcedOscillator {
        fn start<S: Scalar>(&self, b: &[S]) -> Vec<S> {
            vec![b[2]]
        }
        fn rates<S: Scalar>(&self, b: &[S], t: S, y: &[S], out: &mut [S]) {
            out[0] = (b[1] * t).sin() - b[0] * y[0];
        }
        fn output<S: Scalar>(&self, h: usize, b: &[S], t: S, y: &[S]) -> S {
            if h == 0 { y[0] * y[0] } else { b[1] * t * y[0] }
        }
        fn outputs(&self) -> usize {
            2
        }
    }

    #[test]
    fn derivatives_by_design_and_time_are_those_of_differences() {
        let analysis =
            OdeResponses::new(ForcedOscillator, Explicit::eighth_order(1e-13), &[0.0, 0.5, 1.0, 2.0]).unwrap();
        let b = [0.7, 2.0, 0.4];
        let responses = analysis.analyze(&b).unwrap();
        let value = |b: &[f64], h, t| analysis.rates(b, &analysis.analyze(b).unwrap(), h, t).unwrap();
        let (h, t, step) = (1, 1.3, 1e-4);
        let [_, rate, second] = value(&b, h, t);
        let (up, down) = (value(&b, h, t + step), value(&b, h, t - step));
        assert!((rate - (up[0] - down[0]) / (2.0 * step)).abs() < 1e-7);
        assert!((second - (up[1] - down[1]) / (2.0 * step)).abs() < 1e-6);
        let [first, cross] = analysis.rate_sensitivities(&b, &responses, h, t).unwrap();
        for k in 0..3 {
            let moved =
                |s: f64| value(&std::array::from_fn::<f64, 3, _>(|i| b[i] + if i == k { s } else { 0.0 }), h, t);
            let (up, down) = (moved(step), moved(-step));
            assert!((first[k] - (up[0] - down[0]) / (2.0 * step)).abs() < 1e-7, "{k}");
            assert!((cross[k] - (up[1] - down[1]) / (2.0 * step)).abs() < 1e-7, "{k}");
        }
        // At a time point both ways agree, even without stored states.
        let plain = Responses::new(responses.values.clone());
        let row = analysis.sensitivities(&b, &plain, &[ResponseAt { response: 0, point: 2 }]).unwrap();
        let [there, _] = analysis.rate_sensitivities(&b, &responses, 0, 1.0).unwrap();
        (0..3).for_each(|k| assert!((row[(0, k)] - there[k]).abs() < 1e-12));
    }
}
