//! The discrete adjoint: few responses by many design variables.
//!
//! Where the direct method carries one derivative of the state per design variable forward, the adjoint carries one per
//! response backward. With the converged steps F(x₁, x₀, p) = 0 of the analysis and a response J, from the last step to
//! the first,
//!
//! $$ \left(\frac{\partial F}{\partial x_1}\right)^{\!T}\psi = -\bar x_1,\qquad
//!    \bar x_0 \mathrel{+}= \left(\frac{\partial F}{\partial x_0}\right)^{\!T}\psi,\qquad
//!    \bar p \mathrel{+}= \left(\frac{\partial F}{\partial p}\right)^{\!T}\psi $$
//!
//! where x̄ is dJ/dx and p are the parameters of elements and motions; dJ/db = p̄ᵀ dp/db + x̄ᵀ dx/db at the start. The
//! transposed products are taken element by element from the same residuals in dual numbers. Let the step go to zero
//! and ψ/h solves the paper's adjoint equations (26) to (33).
//!
//! | file | what |
//! |---|---|
//! | `backward` | the recursion over the recorded steps |
//! | `bars` | x̄ and the transpose of a step's own formulas |
//! | `design` | p̄, and from there to the design variables |
//! | `explicit` | the motion of a mechanism by explicit steps |
//! | `instants` | equilibria, and kinematics with inverse dynamics |
//! | `batch` | the responses on their way, and ψᵀ ∂F for all elements |
//! | `local` | weighted rows of one element, differentiated by its variables |
//! | `outputs` | outputs differentiated by the state |
//! | `settle` | the transposes of assembly, consistent velocities and accelerations |
//! | `spent` | memory, and steps integrated again for want of it |
//! | `stages` | an explicit step backwards: its stages, its projection, states inside it |

pub(crate) mod adjoint_state;
pub(crate) mod backward;
pub(crate) mod batch;
pub(crate) mod design;
pub(crate) mod element_vjp;
pub(crate) mod explicit;
pub(crate) mod initial_conditions;
pub(crate) mod instants;
pub(crate) mod output_vjp;
pub(crate) mod replay_statistics;
pub(crate) mod stages;

use crate::analyses::dynamics::InitialAcceleration;
use crate::analyses::dynamics::{Dynamics, simulate_recorded};
use crate::checkpointing::recording::Recording;
use crate::derivatives::activity::Dependence;
use crate::derivatives::seeding::build_sensitive;
use crate::events::impact;
use crate::mechanism::scalars::Dual8;
use crate::mechanism::{Mechanism, ParametricMechanism};
use crate::{Error, Result};
use adjoint_state::BATCH;
use autodiff::WIDTH;
use backward::Backward;
use batch::AdjointBatch;
pub use explicit::differentiate_explicit_recording_backwards;
pub use explicit::differentiate_explicitly_backwards;
pub use explicit::differentiate_explicitly_backwards_within;
use initial_conditions::InitialConditionAdjoint;
pub use instants::differentiate_equilibria_backwards;
pub use instants::differentiate_kinematics_backwards;
use nalgebra::DMatrix;
pub use replay_statistics::ReplayStatistics;

/// One output at one time point, with a weight.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Weighted {
    /// Number of the output.
    pub output: usize,
    /// Number of the time point.
    pub point: usize,
    /// Its weight.
    pub weight: f64,
}

/// A response of a motion: a weighted sum of outputs at time points.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Functional {
    /// The terms.
    pub terms: Vec<Weighted>,
}

impl Functional {
    /// An output at one time point.
    pub fn at(output: usize, point: usize) -> Self {
        Self { terms: vec![Weighted { output, point, weight: 1.0 }] }
    }

    /// The integral of an output over `times` (s) by the trapezoidal rule.
    pub fn integral(output: usize, times: &[f64]) -> Self {
        let width = |from: usize, to: usize| times[to] - times[from];
        let last = times.len().saturating_sub(1);
        let weight = |point: usize| 0.5 * width(point.saturating_sub(1), (point + 1).min(last));
        Self { terms: (0..times.len()).map(|point| Weighted { output, point, weight: weight(point) }).collect() }
    }
}

/// Simulates `model` at the design `b` and differentiates `responses` of its outputs at `times`, a row each, with respect
/// to `b`, backwards in time.
///
/// The result is that of [`differentiate`](crate::derivatives::forward::dynamics::differentiate) up to rounding. Up to four responses cost less than
/// three analyses, this one included, however many design variables there are (`cargo bench --bench adjoint`).
/// The states of all steps are kept.
///
/// **Errors.** As [`differentiate`](crate::derivatives::forward::dynamics::differentiate), and [`Error::Definition`] if a response has a term that there
/// is not.
pub fn differentiate_backwards<M: ParametricMechanism>(
    model: &M,
    b: &[f64],
    settings: &Dynamics,
    times: &[f64],
    responses: &[Functional],
) -> Result<DMatrix<f64>> {
    differentiate_backwards_within(usize::MAX, model, b, settings, times, responses).map(|(rows, _)| rows)
}

/// The same in at most `memory` bytes for the states of steps, and what of them it took.
///
/// Where they do not suffice there are check-points, from which the steps are integrated again on the way back, with the
/// same bits. A memory for the square root of all steps costs one more analysis.
///
/// **Errors.** As [`differentiate_backwards`], and [`Error::Definition`] if the memory does not hold four check-points.
pub fn differentiate_backwards_within<M: ParametricMechanism>(
    memory: usize,
    model: &M,
    b: &[f64],
    settings: &Dynamics,
    times: &[f64],
    responses: &[Functional],
) -> Result<(DMatrix<f64>, ReplayStatistics)> {
    let (_, recording) = simulate_recorded(&model.build(b)?, settings, times, memory)?;
    differentiate_recording_backwards(model, b, settings, times, responses, &recording)
}

/// The same at the steps of a recording of `model` at `b`.
pub fn differentiate_recording_backwards<M: ParametricMechanism>(
    model: &M,
    b: &[f64],
    settings: &Dynamics,
    times: &[f64],
    responses: &[Functional],
    recording: &Recording,
) -> Result<(DMatrix<f64>, ReplayStatistics)> {
    let mechanism = model.build(b)?;
    impact::refuse(&mechanism, "adjoint derivatives")?;
    check(responses, mechanism.outputs.len(), times.len())?;
    let sensitive = build_sensitive::<M, WIDTH>(model, b, &mechanism)?;
    let dependence = Dependence::of(&sensitive, &mechanism);
    let mut backward = Backward::new(&mechanism, recording, settings, times, responses, &dependence)?;
    backward.run()?;
    let spent = backward.spent();
    let Backward { mut batches, mut system, .. } = backward;
    let mut initial_conditions = InitialConditionAdjoint::new(&mechanism, &dependence, &system);
    let consistent = settings.initial == InitialAcceleration::Consistent;
    let mut all: Vec<&mut AdjointBatch> = batches.iter_mut().collect();
    all.iter_mut().for_each(|batch| batch.now.join());
    initial_conditions.back(
        &mut system,
        &recording.start,
        &recording.projection,
        consistent,
        settings.origin,
        &mut all,
    )?;
    Ok((contract(&batches, &sensitive, responses.len(), b.len()), spent))
}

/// The responses' derivatives with respect to the design, from those with respect to what depends on it.
fn contract(batches: &[AdjointBatch], chunks: &[Mechanism<Dual8>], responses: usize, variables: usize) -> DMatrix<f64> {
    let mut rows = DMatrix::zeros(responses, variables);
    for (c, chunk) in chunks.iter().enumerate() {
        for (k, batch) in batches.iter().enumerate() {
            batch.design.contract(chunk, &batch.now, &mut rows, [k * BATCH, c * WIDTH]);
        }
    }
    rows
}

fn check(responses: &[Functional], outputs: usize, points: usize) -> Result<()> {
    let terms = responses.iter().enumerate().flat_map(|(k, response)| response.terms.iter().map(move |term| (k, term)));
    let mut wrong = terms.filter(|(_, term)| term.output >= outputs || term.point >= points);
    wrong.next().map_or(Ok(()), |(k, term)| {
        let why = format!("it has output {} at time point {}", term.output, term.point);
        let remedy = format!("outputs go to {}, time points to {}", outputs.max(1) - 1, points.max(1) - 1);
        Err(Error::definition(format!("response {k}"), why, remedy))
    })
}
