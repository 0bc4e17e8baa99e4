//! Derivatives of the solution of a differential equation.

use crate::Result;
use crate::derivatives::forward::explicit::forward_step::{Block, OdeForwardSensitivity};
use crate::integrators::explicit::ode::OdeModelRhs;
use crate::integrators::explicit::ode::{Ode, OdeHistory};
use crate::integrators::explicit::ode_driver::OdeDriver;
use crate::integrators::explicit::settings::Explicit;
use autodiff::{DualVec, WIDTH};
use rayon::prelude::*;

/// A solution with its derivatives.
#[derive(Clone, Debug, PartialEq)]
pub struct OdeSensitivity {
    /// The solution.
    pub history: OdeHistory,
    /// `gradients[component][time]` is the gradient with respect to the design variables.
    pub gradients: Vec<Vec<Vec<f64>>>,
}

/// Integrates `ode` at the design `b` and differentiates its state at `times` with respect to `b`.
///
/// The right-hand side is evaluated once more at every stage, in dual numbers of [`WIDTH`] design variables at a time;
/// chunks run in parallel and the result has the same bits for any number of threads.
///
/// **Errors.** As [`crate::integrators::explicit::ode::integrate`].
///
/// **Source.** Hairer, Nørsett & Wanner, *Solving Ordinary Differential Equations I*, 2nd ed. (1993), Section II.6,
/// "internal differentiation" after Bock (1981).
pub fn differentiate_ode<O: Ode>(ode: &O, b: &[f64], settings: &Explicit, times: &[f64]) -> Result<OdeSensitivity> {
    let start = ode.start(b);
    let mut flow = OdeModelRhs::new(ode, b);
    flow.visited = Some(vec![(settings.start, start.clone()); settings.method.slots()]);
    let size = start.len();
    let mut march = OdeDriver::new(flow, settings, start, times)?;
    let chunks: Vec<usize> = (0..b.len()).step_by(WIDTH).collect();
    let mut followers: Vec<_> = chunks.iter().map(|&first| sensitivity(ode, b, first, &march)).collect();
    let mut values = vec![Vec::with_capacity(times.len()); size];
    let mut gradients = vec![vec![vec![0.0; b.len()]; times.len()]; size];
    let (mut y, mut dy) = (march.stepper.old.clone(), vec![[0.0; WIDTH]; size]);
    for (k, &t) in times.iter().enumerate() {
        while march.is_before(t) {
            march.advance()?;
            let (tape, span) = (march.stepper.flow.visited.as_ref().expect("it remembers"), march.stepper.t);
            followers.par_iter_mut().for_each(|sensitivity| sensitivity.follow(tape, span));
        }
        let dense = march.sample(t, &mut y)?;
        let tape = march.stepper.flow.visited.as_ref().expect("it remembers");
        for (sensitivity, &first) in followers.iter_mut().zip(&chunks) {
            if dense {
                sensitivity.make_dense(tape);
                sensitivity.interpolate(t, &mut dy);
            } else {
                dy.copy_from_slice(sensitivity.end());
            }
            for (series, slope) in gradients.iter_mut().zip(&dy) {
                series[k][first..].iter_mut().zip(slope).for_each(|(to, from)| *to = *from);
            }
        }
        values.iter_mut().zip(&y).for_each(|(series, y)| series.push(*y));
    }
    let work = march.work();
    let history = OdeHistory { times: times.to_vec(), values, steps: march.steps, work };
    Ok(OdeSensitivity { history, gradients })
}

type Dual = DualVec<WIDTH>;

fn sensitivity<'o, O: Ode>(
    ode: &'o O,
    b: &[f64],
    first: usize,
    march: &OdeDriver<OdeModelRhs<'o, O>>,
) -> OdeForwardSensitivity<'o, O> {
    let seed = |(i, &value): (usize, &f64)| match i.checked_sub(first) {
        Some(k) if k < WIDTH => Dual::seeded(value, k),
        _ => Dual::constant(value),
    };
    let b: Vec<Dual> = b.iter().enumerate().map(seed).collect();
    let start: Vec<Block> = ode.start(&b).iter().map(|y| y.eps).collect();
    let workspace = vec![Dual::constant(0.0); start.len()];
    let linear = LinearOde { ode, b, y: workspace.clone(), k: workspace };
    let stepper = &march.stepper;
    let tape = stepper.flow.visited.as_ref().expect("it remembers");
    OdeForwardSensitivity::new(linear, stepper.method, start, stepper.t[0], tape)
}

/// The right-hand side in dual numbers.
pub(crate) struct LinearOde<'o, O> {
    ode: &'o O,
    b: Vec<Dual>,
    y: Vec<Dual>,
    k: Vec<Dual>,
}

/// Time and state of each slot.
pub(crate) type StepRecord = Vec<(f64, Vec<f64>)>;

impl<O: Ode> LinearOde<'_, O> {
    /// Writes the derivatives of dy/dt at the visit of `slot`, where those of the state are `y`.
    pub fn rates(&mut self, tape: &StepRecord, slot: usize, y: &[Block], k: &mut [Block]) {
        let (t, values) = &tape[slot];
        for ((dual, &re), &eps) in self.y.iter_mut().zip(values).zip(y) {
            *dual = Dual { re, eps };
        }
        self.ode.rates(&self.b, *t, &self.y, &mut self.k);
        k.iter_mut().zip(&self.k).for_each(|(k, dual)| *k = dual.eps);
    }
}
