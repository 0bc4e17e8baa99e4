//! Semi-analytical derivatives: the linear systems of the direct method, with differenced residuals.
//!
//! At a converged step, F(x₁, x₀, b) = 0, and the direct method solves
//!
//! $$ \frac{\partial F}{\partial x_1}\frac{dx_1}{db_k} = -\frac{\partial F}{\partial x_0}\frac{dx_0}{db_k} - \frac{\partial F}{\partial b_k} $$
//!
//! Here the right-hand side is a central difference of the residual in `f64`, with the mechanism built at b ± δ e_k, and the
//! old state moved along with it by ± δ dx₀/db_k; the matrix is that of the analysis. Nothing of it is a dual number: neither
//! the model nor its elements are asked for derivatives, which makes it a witness against them. Assembly, consistent
//! velocities and accelerations, kinematics and statics likewise, and outputs.
//!
//! The step δ is the part ε of the design variable ([`STEP`] unless told; ε itself where the variable is zero). The error
//! of a residual's difference is of the order δ² of curvature plus 10⁻¹⁶/ε of rounding, in parts of the largest term: where
//! large terms cancel, as in beams that turn far, less is left (docs/sensitivities.md has measured figures).
//!
//! **Source.** The paper's Section 5 for the term; Haftka & Adelman, *Struct. Optim.* 1 (1989) 137–151; for the errors
//! Barthelemy & Haftka, *Mech. Struct. Mach.* 18 (1990) 407–432.
//!
//! | file | what |
//! |---|---|
//! | `along` | slopes along implicit steps |
//! | `beside` | a mechanism on both sides of a design |
//! | `instants` | kinematics, inverse dynamics and statics |
//! | `start` | initial states and equilibria |

pub(crate) mod central_difference;
pub(crate) mod dynamics;
pub(crate) mod initial_conditions;
pub(crate) mod instants;

pub use instants::difference_equilibria;
pub use instants::difference_kinematics;

use crate::analyses::dynamics::Dynamics;
use crate::checkpointing::recording::Recording;
use crate::derivatives::forward::dynamics::go;
use crate::derivatives::forward::step_block::StepSource;
use crate::derivatives::history::{Record, SensitiveHistory};
use crate::events::impact;
use crate::integrators::time_stepper::TimeStepper;
use crate::mechanism::{Mechanism, ParametricMechanism};
use crate::{Error, Result};
use central_difference::CentralDifference;
use dynamics::DifferenceSensitivity;
use initial_conditions::Starter;

/// The part ε of a design variable by which residuals are differenced unless told otherwise.
pub const STEP: f64 = 1e-5;

/// Simulates `model` at the design `b` and differentiates its outputs at `times` semi-analytically, with the relative step ε
/// `step` (see [`STEP`]).
///
/// **Errors.** As [`crate::analyses::dynamics::simulate`]; [`Error::Option`] for a step that is not positive; [`Error::Definition`] if
/// the design decides which elements there are.
pub fn differentiate_semi_analytically<M: ParametricMechanism>(
    model: &M,
    b: &[f64],
    settings: &Dynamics,
    times: &[f64],
    step: f64,
) -> Result<SensitiveHistory> {
    let mechanism = model.build(b)?;
    let run = TimeStepper::new(&mechanism, settings, times)?;
    let record = Record::new(&mechanism, b.len(), times);
    let mut source = StepSource::running(run, record, settings, times)?;
    let slopes = follow(besides(model, b, &mechanism, step)?, settings, times, &mut source)?;
    let (mut record, work) = source.finish().expect("it was simulated");
    let outputs = slopes.outputs;
    for (k, slopes) in slopes.by_variable.iter().enumerate() {
        for time in 0..times.len() {
            record.slopes(time, k, slopes[time * outputs..].chunks(1));
        }
    }
    Ok(record.finish(work))
}

/// Derivatives of all outputs at all times.
pub struct Slopes {
    outputs: usize,
    /// By design variable, then time and output.
    by_variable: Vec<Vec<f64>>,
}

impl Slopes {
    /// Of the output at time number `time` with respect to a design variable.
    pub fn at(&self, time: usize, output: usize, variable: usize) -> f64 {
        self.by_variable[variable][time * self.outputs + output]
    }
}

/// The same from a recording of `model` at `b`, which reaches the last of `times`.
pub fn differentiate_recorded<M: ParametricMechanism>(
    model: &M,
    b: &[f64],
    settings: &Dynamics,
    times: &[f64],
    recording: &Recording,
    step: f64,
) -> Result<Slopes> {
    let mechanism = model.build(b)?;
    let besides = besides(model, b, &mechanism, step)?;
    follow(besides, settings, times, &mut StepSource::recorded(&mechanism, recording, settings, times))
}

/// Both sides of every design variable.
fn besides<M: ParametricMechanism>(
    model: &M,
    b: &[f64],
    mechanism: &Mechanism<f64>,
    step: f64,
) -> Result<Vec<CentralDifference>> {
    check_step(step)?;
    (0..b.len()).map(|k| CentralDifference::new(model, b, k, step, mechanism)).collect()
}

/// **Errors.** [`Error::Option`] for a relative step that is not positive or too large to be one.
pub fn check_step(step: f64) -> Result<()> {
    Error::check_option(
        "relative step of the residual's differences",
        "between 0 and 1",
        step,
        step > 0.0 && step < 1.0,
    )
}

fn follow(
    mut besides: Vec<CentralDifference>,
    settings: &Dynamics,
    times: &[f64],
    source: &mut StepSource<'_>,
) -> Result<Slopes> {
    let (plain, start) = (source.mechanism, source.start.clone());
    impact::refuse(plain, "semi-analytical derivatives")?;
    let mut starter = Starter { plain, system: &mut source.system };
    let slopes = starter.start(&mut besides, &start, &source.projection, settings)?;
    let mut all = Vec::with_capacity(besides.len());
    for pair in besides.into_iter().zip(slopes) {
        all.push(DifferenceSensitivity::new(pair, plain, &source.system, &start, settings, times)?);
    }
    rayon::scope(|_| go(&mut all, source))?; // once into the pool, not at every stretch
    let by_variable = all.into_iter().map(DifferenceSensitivity::into_slopes).collect();
    Ok(Slopes { outputs: plain.outputs.len(), by_variable })
}
