//! Systems of ordinary differential equations, generic over the scalar.

use crate::integrators::explicit::ode_driver::OdeDriver;
use crate::integrators::explicit::settings::Explicit;
use crate::integrators::explicit::stepper::OdeRhs;
use crate::integrators::settings::Work;
use crate::{Error, Result};
use autodiff::Scalar;
use error::Seconds;

/// A system dy/dt = f(b, t, y) with y(t₀) = y₀(b) and design variables b.
///
/// # Examples
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

/// Solution of an ODE at the output times.
#[derive(Clone, Debug, PartialEq)]
pub struct OdeHistory {
    /// Times in s.
    pub times: Vec<f64>,
    /// One series per component, one value per time.
    pub values: Vec<Vec<f64>>,
    /// Lengths of the steps taken in s.
    pub steps: Vec<f64>,
    /// Numbers of steps and evaluations (`iterations`).
    pub work: Work,
}

/// Integrates `ode` for the design variables `b` and records its state at `times` (increasing, s).
///
/// # Errors
///
/// [`Error::Analysis`] naming component and time if a rate is not finite or the step becomes too small.
pub fn integrate<O: Ode>(ode: &O, b: &[f64], settings: &Explicit, times: &[f64]) -> Result<OdeHistory> {
    let mut driver = OdeDriver::new(OdeModelRhs::new(ode, b), settings, ode.start(b), times)?;
    let mut values = vec![Vec::with_capacity(times.len()); driver.stepper.old.len()];
    let mut y = driver.stepper.old.clone();
    for &t in times {
        while driver.is_before(t) {
            driver.advance()?;
        }
        driver.sample(t, &mut y)?;
        values.iter_mut().zip(&y).for_each(|(series, y)| series.push(*y));
    }
    let work = driver.work();
    Ok(OdeHistory { times: times.to_vec(), values, steps: driver.steps, work })
}

/// Right-hand side of an [`Ode`] at one design; it can record the states at which it is evaluated.
pub struct OdeModelRhs<'o, O> {
    ode: &'o O,
    b: &'o [f64],
    size: usize,
    /// Time and state of each slot, if they are recorded.
    pub stages: Option<Vec<(f64, Vec<f64>)>>,
}

impl<'o, O: Ode> OdeModelRhs<'o, O> {
    /// Right-hand side at the design variables `b`.
    pub fn new(ode: &'o O, b: &'o [f64]) -> Self {
        Self { ode, b, size: ode.start(b).len(), stages: None }
    }
}

impl<O: Ode> OdeRhs for OdeModelRhs<'_, O> {
    fn size(&self) -> usize {
        self.size
    }

    fn rates(&mut self, slot: usize, t: f64, y: &[f64], k: &mut [f64]) -> Result<()> {
        self.ode.rates(self.b, t, y, k);
        if let Some((time, state)) = self.stages.as_mut().and_then(|stages| stages.get_mut(slot)) {
            *time = t;
            state.copy_from_slice(y);
        }
        k.iter().position(|rate| !rate.is_finite()).map_or(Ok(()), |i| {
            let why = format!("its rate is {} at t = {t}", k[i], t = Seconds(t));
            Err(Error::analysis(self.name(i), why, "check the function that computes the rates"))
        })
    }

    fn name(&self, component: usize) -> String {
        self.ode.name(component)
    }
}
