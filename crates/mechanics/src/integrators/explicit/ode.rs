//! Systems of ordinary differential equations, written once over the scalar.

use crate::analyses::dynamics::Work;
use crate::integrators::explicit::ode_driver::OdeDriver;
use crate::integrators::explicit::settings::Explicit;
use crate::integrators::explicit::stepper::OdeRhs;
use crate::{Error, Result};
use autodiff::Scalar;

/// dy/dt = f(b, t, y) with y(t₀) = y₀(b), where b are design variables.
///
/// ```
/// use linkwright_mechanics::integrators::explicit::{Explicit, Ode, integrate};
/// use autodiff::Scalar;
/// struct Decay;
/// impl Ode for Decay {
///     fn start<S: Scalar>(&self, _b: &[S]) -> Vec<S> {
///         vec![S::from(1.0)]
///     }
///     fn rates<S: Scalar>(&self, b: &[S], _t: f64, y: &[S], out: &mut [S]) {
///         out[0] = -b[0] * y[0];
///     }
/// }
/// let history = integrate(&Decay, &[2.0], &Explicit::eighth_order(1e-10), &[0.5, 1.0]).unwrap();
/// assert!((history.values[0][1] - (-2.0f64).exp()).abs() < 1e-10);
/// ```
pub trait Ode: Send + Sync {
    /// The state at the start.
    fn start<S: Scalar>(&self, b: &[S]) -> Vec<S>;

    /// Writes dy/dt at time `t` (s) to `out`. Branch on real parts only.
    fn rates<S: Scalar>(&self, b: &[S], t: f64, y: &[S], out: &mut [S]);

    /// Name of a component, for messages.
    fn name(&self, component: usize) -> String {
        format!("component {component}")
    }
}

/// A solution at the wanted times.
#[derive(Clone, Debug, PartialEq)]
pub struct OdeHistory {
    /// Times in s.
    pub times: Vec<f64>,
    /// One series per component, one value per time.
    pub values: Vec<Vec<f64>>,
    /// Steps taken, in s.
    pub steps: Vec<f64>,
    /// Work done; iterations are evaluations.
    pub work: Work,
}

/// Integrates `ode` for the design variables `b` and records its state at `times` (increasing, s).
///
/// **Errors.** [`Error::Analysis`] naming component and time if a rate is not finite or steps become too small.
pub fn integrate<O: Ode>(ode: &O, b: &[f64], settings: &Explicit, times: &[f64]) -> Result<OdeHistory> {
    let mut march = OdeDriver::new(OdeModelRhs::new(ode, b), settings, ode.start(b), times)?;
    let mut values = vec![Vec::with_capacity(times.len()); march.stepper.old.len()];
    let mut y = march.stepper.old.clone();
    for &t in times {
        while march.is_before(t) {
            march.advance()?;
        }
        march.sample(t, &mut y)?;
        values.iter_mut().zip(&y).for_each(|(series, y)| series.push(*y));
    }
    let work = march.work();
    Ok(OdeHistory { times: times.to_vec(), values, steps: march.steps, work })
}

impl<F: OdeRhs> OdeDriver<F> {
    /// Work so far.
    pub fn work(&self) -> Work {
        Work { steps: self.steps.len(), failed_steps: self.failed_steps, iterations: self.stepper.evaluations }
    }
}

/// [`Ode`] at one design, in `f64`; it remembers where it was evaluated if asked to.
pub struct OdeModelRhs<'o, O> {
    ode: &'o O,
    b: &'o [f64],
    size: usize,
    /// Time and state of each slot, if remembered.
    pub visited: Option<Vec<(f64, Vec<f64>)>>,
}

impl<'o, O: Ode> OdeModelRhs<'o, O> {
    /// At the design variables `b`.
    pub fn new(ode: &'o O, b: &'o [f64]) -> Self {
        Self { ode, b, size: ode.start(b).len(), visited: None }
    }
}

impl<O: Ode> OdeRhs for OdeModelRhs<'_, O> {
    fn size(&self) -> usize {
        self.size
    }

    fn rates(&mut self, slot: usize, t: f64, y: &[f64], k: &mut [f64]) -> Result<()> {
        self.ode.rates(self.b, t, y, k);
        if let Some(visited) = &mut self.visited {
            visited[slot].0 = t;
            visited[slot].1.copy_from_slice(y);
        }
        k.iter().position(|rate| !rate.is_finite()).map_or(Ok(()), |i| {
            let why = format!("its rate is {} at t = {t:.6e} s", k[i]);
            Err(Error::analysis(self.name(i), why, "check the function that gives the rates"))
        })
    }

    fn name(&self, component: usize) -> String {
        self.ode.name(component)
    }
}
