//! Direct differentiation of a dynamic analysis by implicit steps.

use crate::Result;
use crate::analyses::dynamics::Dynamics;
use crate::checkpointing::recording::Recording;
use crate::derivatives::forward::forward_sensitivity::ForwardSensitivity;
use crate::derivatives::forward::step_block::{StepBlock, StepConsumer, StepSource};
use crate::derivatives::history::{Record, SensitiveHistory};
use crate::derivatives::seeding::build_sensitive;
use crate::integrators::time_stepper::TimeStepper;
use crate::mechanism::scalars::{DerivativeScalar, ElementScalar, Jet2};
use crate::mechanism::{Mechanism, ParametricMechanism};
use autodiff::WIDTH;
use rayon::prelude::*;

/// Simulates `model` at the design `b` and differentiates its outputs at `times` with respect to `b`.
///
/// The derivatives are those of the discrete solution. At a converged step, F(x₁, x₀, b) = 0, so
///
/// $$ \frac{\partial F}{\partial x_1}\frac{dx_1}{db} = -\frac{\partial F}{\partial x_0}\frac{dx_0}{db} - \frac{\partial F}{\partial b} $$
///
/// whose right-hand side is one evaluation of the residual in dual numbers, [`WIDTH`] design variables at a time (four if
/// there are no more), and whose matrix is factorized once at the converged step; all design variables share it. The
/// matrices of the next steps are made while the derivatives follow the last ones, on another thread if there is one.
///
/// **Errors.** As [`crate::analyses::dynamics::simulate`], and [`crate::Error::Definition`] if the model makes another mechanism in
/// dual numbers than in `f64`.
///
/// **Source.** Haug, Wehage & Mani, *J. Mech. Trans. Autom. Des.* 106 (1984) 156–162, for the method; the paper's
/// equations (22) to (25).
pub fn differentiate<M: ParametricMechanism>(
    model: &M,
    b: &[f64],
    settings: &Dynamics,
    times: &[f64],
) -> Result<SensitiveHistory> {
    let mechanism = model.build(b)?;
    let run = TimeStepper::new(&mechanism, settings, times)?;
    let record = Record::new(&mechanism, b.len(), times);
    let mut source = StepSource::running(run, record, settings, times)?;
    let slopes = follow(model, b, settings, times, &mut source)?;
    let (mut record, work) = source.finish().expect("it was simulated");
    slopes.enter(&mut record, times.len());
    Ok(record.finish(work))
}

/// The derivatives at the steps of a recording of `model` at `b`, which reaches the last of `times`: nothing is iterated.
pub fn differentiate_recorded<M: ParametricMechanism>(
    model: &M,
    b: &[f64],
    settings: &Dynamics,
    times: &[f64],
    recording: &Recording,
) -> Result<Slopes> {
    let mechanism = model.build(b)?;
    follow(model, b, settings, times, &mut StepSource::recorded(&mechanism, recording, settings, times))
}

/// Derivatives of all outputs at all times.
pub struct Slopes {
    /// Number of outputs.
    pub outputs: usize,
    /// Design variables in a chunk.
    pub width: usize,
    /// By chunk of `width` design variables, then time, output and variable.
    pub chunks: Vec<Vec<f64>>,
}

impl Slopes {
    /// Of the output at time number `time` with respect to a design variable.
    pub fn at(&self, time: usize, output: usize, variable: usize) -> f64 {
        let (chunk, k) = (variable / self.width, variable % self.width);
        self.chunks[chunk][(time * self.outputs + output) * self.width + k]
    }

    /// Writes them to `record`, as far as there are design variables.
    pub fn enter(&self, record: &mut Record, times: usize) {
        for (chunk, slopes) in self.chunks.iter().enumerate() {
            for (time, slopes) in slopes.chunks(self.outputs * self.width).enumerate().take(times) {
                record.slopes(time, chunk * self.width, slopes.chunks(self.width));
            }
        }
    }
}

/// In numbers that are not much wider than the design.
fn follow<M: ParametricMechanism>(
    model: &M,
    b: &[f64],
    settings: &Dynamics,
    times: &[f64],
    source: &mut StepSource<'_>,
) -> Result<Slopes> {
    let (mechanism, narrow) = (source.mechanism, b.len() <= 4);
    let chunks = match narrow {
        true => follow_all(&build_sensitive::<M, 4>(model, b, mechanism)?, settings, times, source)?,
        false => follow_all(&build_sensitive::<M, WIDTH>(model, b, mechanism)?, settings, times, source)?,
    };
    Ok(Slopes { outputs: mechanism.outputs.len(), width: if narrow { 4 } else { WIDTH }, chunks })
}

/// To the end of the motion with mechanisms that carry `L` derivatives each. For each of them the derivatives of the
/// outputs, by time, output and number.
pub(crate) fn follow_all<T: DerivativeScalar<L>, const L: usize>(
    carriers: &[Mechanism<T>],
    settings: &Dynamics,
    times: &[f64],
    source: &mut StepSource<'_>,
) -> Result<Vec<Vec<f64>>>
where
    Jet2<T>: ElementScalar,
{
    let mut companions = Vec::with_capacity(carriers.len());
    for carrier in carriers {
        companions.push(ForwardSensitivity::start(carrier, source, settings, times)?);
    }
    rayon::scope(|_| go(&mut companions, source))?; // once into the pool, not at every stretch
    Ok(companions.into_iter().map(ForwardSensitivity::into_slopes).collect())
}

/// To the end of the motion.
pub(crate) fn go<C: StepConsumer>(companions: &mut [C], source: &mut StepSource<'_>) -> Result<()> {
    let mut stretches = [StepBlock::new(source), StepBlock::new(source)];
    stretches[0].fill(source)?;
    while !stretches[0].is_empty() {
        let [now, next] = &mut stretches;
        let follow = || companions.par_iter_mut().map(|companion| companion.follow(now)).collect::<Vec<_>>();
        let (followed, filled) = rayon::join(follow, || next.fill(source));
        followed.into_iter().chain([filled]).collect::<Result<()>>()?;
        stretches.swap(0, 1);
    }
    Ok(())
}
