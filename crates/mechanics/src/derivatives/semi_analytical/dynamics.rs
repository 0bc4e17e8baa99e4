//! Semi-analytical differentiation of a motion by implicit steps.

use crate::analyses::dynamics::Dynamics;
use crate::analyses::sampling::{Sampler, interpolate};
use crate::checkpointing::recording::Recording;
use crate::derivatives::forward::implicit_steps::{ConvergedStep, ImplicitSteps, OutputTimes, StepBlock};
use crate::derivatives::history::{OutputGradients, SensitiveHistory};
use crate::derivatives::indeterminate::check_outputs;
use crate::derivatives::propagation::{Schedule, StepConsumer, propagate};
use crate::derivatives::semi_analytical::central_difference::CentralDifference;
use crate::derivatives::semi_analytical::initial_conditions::InitialDifferences;
use crate::elements::element::ElementWorkspace;
use crate::events::impact;
use crate::integrators::generalized_alpha::Step;
use crate::linalg::factor::SolveWorkspace;
use crate::mechanism::{Mechanism, ParametricMechanism};
use crate::system::System;
use crate::system::state::State;
use crate::{Error, Result};

/// Simulates `model` at the design `b` and differentiates its outputs at `times` (s) semi-analytically, with the relative
/// step `step` of the differences (see [`STEP`](crate::derivatives::semi_analytical::STEP)).
///
/// # Errors
/// As [`simulate`](crate::analyses::dynamics::simulate); [`Error::Option`](crate::Error::Option) for a step that is not
/// between 0 and 1; [`Error::Definition`](crate::Error::Definition) if the design decides which elements are built, or
/// if the mechanism has impacts.
pub fn differentiate_semi_analytically<M: ParametricMechanism>(
    model: &M,
    b: &[f64],
    settings: &Dynamics,
    times: &[f64],
    step: f64,
) -> Result<SensitiveHistory> {
    let mechanism = model.build(b)?;
    let differences = CentralDifference::by_each_variable(model, b, step, &mechanism)?;
    let mut steps = ImplicitSteps::simulated(&mechanism, settings, times)?;
    let gradients = propagate_differences(differences, settings, times, &mut steps)?;
    let (recorder, work) = steps.finish().expect("the steps are simulated");
    Ok(SensitiveHistory::new(&mechanism, times, recorder, (&gradients, b.len()), work))
}

/// Differentiates semi-analytically along the steps of a recording of `model` at `b`, which reaches the last of `times`.
///
/// # Errors
/// As [`differentiate_semi_analytically`], without those of the simulation.
pub fn differentiate_recorded<M: ParametricMechanism>(
    model: &M,
    b: &[f64],
    settings: &Dynamics,
    times: &[f64],
    recording: &Recording,
    step: f64,
) -> Result<OutputGradients> {
    let mechanism = model.build(b)?;
    let differences = CentralDifference::by_each_variable(model, b, step, &mechanism)?;
    let mut steps = ImplicitSteps::recorded(&mechanism, recording, settings, times);
    propagate_differences(differences, settings, times, &mut steps)
}

/// Propagates the derivatives with respect to all design variables to the end of the motion.
fn propagate_differences(
    mut differences: Vec<CentralDifference>,
    settings: &Dynamics,
    times: &[f64],
    steps: &mut ImplicitSteps<'_>,
) -> Result<OutputGradients> {
    let (plain, start) = (steps.mechanism, steps.start.clone());
    impact::refuse(plain, "semi-analytical derivatives")?;
    check_outputs(&steps.system, plain, &start)?;
    let mut initial = InitialDifferences { plain, system: &mut steps.system };
    let states = initial.start(&mut differences, &start, &steps.projection, settings)?;
    let begin = |pair| DifferenceSensitivity::new(pair, plain, &steps.system, &start, settings, times);
    let mut sensitivities = differences.into_iter().zip(states).map(begin).collect::<Result<Vec<_>>>()?;
    propagate(steps, &mut sensitivities, Schedule::Overlapped)?;
    let derivatives = sensitivities.into_iter().map(|sensitivity| sensitivity.derivatives).collect();
    Ok(OutputGradients::new(plain.outputs.len(), 1, derivatives))
}

/// Largest number of differences of the residual in a step; two suffice unless rounding or curvature is large.
const PASSES: usize = 4;

/// A correction that is small enough to stop, and the largest one that the last pass may leave, as fractions of the
/// derivatives.
const SETTLED: f64 = 1e-9;
const UNSETTLED: f64 = 1e-3;

/// The derivatives of a motion with respect to one design variable, which are propagated along implicit steps.
struct DifferenceSensitivity<'m> {
    difference: CentralDifference,
    plain: &'m Mechanism<f64>,
    system: System,
    settings: &'m Dynamics,
    times: OutputTimes<'m>,
    /// The state at both ends of the step.
    old: State<f64>,
    new: State<f64>,
    /// The derivatives of the state at both ends.
    sensitivity: Step<f64>,
    started: bool,
    at: State<f64>,
    sensitivity_at: State<f64>,
    workspace: ElementWorkspace<f64>,
    solve_workspace: SolveWorkspace,
    changes: Vec<[f64; 1]>,
    sampler: Sampler<f64>,
    /// Of the outputs, by time and output.
    derivatives: Vec<f64>,
}

impl<'m> DifferenceSensitivity<'m> {
    /// Sensitivity at the initial state `start` of a motion, with its derivatives.
    fn new(
        (difference, sensitivity): (CentralDifference, State<f64>),
        plain: &'m Mechanism<f64>,
        system: &System,
        start: &State<f64>,
        settings: &'m Dynamics,
        times: &'m [f64],
    ) -> Result<Self> {
        let mut begin = Self {
            difference,
            plain,
            solve_workspace: system.solve_workspace(),
            changes: vec![[0.0]; system.size()],
            system: system.clone(),
            settings,
            times: OutputTimes::new(settings.start, times),
            old: start.clone(),
            new: start.clone(),
            at: start.clone(),
            sensitivity_at: sensitivity.clone(),
            sensitivity: Step::from(sensitivity),
            started: false,
            workspace: ElementWorkspace::default(),
            sampler: Sampler::new(plain),
            derivatives: Vec::with_capacity(times.len() * plain.outputs.len()),
        };
        begin.record_outputs()?;
        Ok(begin)
    }

    /// Propagates the derivatives from the beginning of a step to its end.
    ///
    /// The derivatives of accelerations and multipliers start from those of the last step, and are corrected by the
    /// differenced residual until the correction is small. The first difference is taken along a direction that violates the
    /// linearized constraints and stretches stiff elements; its error grows with the cube of this violation. The next one is
    /// taken along a direction that satisfies them.
    fn advance(&mut self, step: &ConvergedStep) -> Result<()> {
        if self.started {
            self.sensitivity.accept();
        }
        self.started = true;
        std::mem::swap(&mut self.old, &mut self.new);
        self.new.copy_from(&step.end);
        let Dynamics { scheme, prescribed, .. } = self.settings;
        let (h, Step { old, new, .. }) = (step.h, &mut self.sensitivity);
        new.t = step.end.t;
        new.a.copy_from_slice(&old.a);
        new.l.copy_from_slice(&old.l);
        self.difference.prescribe(new, |mechanism, state| state.prescribe_positions(mechanism, *prescribed));
        self.sensitivity.integrate_prescribed(self.plain, scheme, *prescribed, h);
        let mut correction = f64::INFINITY;
        for pass in 0..PASSES {
            correction = self.correct(step);
            if pass > 0 && correction <= SETTLED * self.scale() {
                return Ok(());
            }
        }
        if correction <= UNSETTLED * self.scale() { Ok(()) } else { Err(self.failure(correction)) }
    }

    /// Corrects the derivatives at the end of a step; returns the largest correction of a position.
    fn correct(&mut self, ConvergedStep { h, end, factor, .. }: &ConvergedStep) -> f64 {
        let scheme = &self.settings.scheme;
        let (position, _) = scheme.newmark_coefficients(*h);
        let (system, workspace, size) = (&self.system, &mut self.workspace, self.changes.len());
        let derivatives = self.difference.derivatives(end, &self.sensitivity.new, |mechanism, state, rows| {
            rows.resize(size, 0.0);
            system.residual(mechanism, state, 1.0 / position, workspace, rows);
        });
        self.changes.iter_mut().zip(derivatives).for_each(|(change, derivative)| *change = [-derivative]);
        factor.solve_in(&mut self.changes, &mut self.solve_workspace);
        let changes = &self.changes;
        self.sensitivity.correct(&self.system, scheme, *h, |equation| changes[equation][0]);
        system.largest_coordinate_row(changes) * position
    }

    /// Size of a position's derivative: the largest of them, but at least the largest position for a change of the design
    /// variable by its own size.
    fn scale(&self) -> f64 {
        let largest = |all: &[f64]| all.iter().fold(0.0, |most: f64, x| most.max(x.abs()));
        largest(&self.sensitivity.new.q).max(largest(&self.new.q) / self.difference.size())
    }

    /// The error of differences that do not settle: the derivatives would be noise.
    fn failure(&self, correction: f64) -> Error {
        let why = format!(
            "the differences of the residual do not settle at t = {:.6e} s: the last correction of a position's derivative is \
             {correction:.1e}",
            self.new.t
        );
        Error::analysis(
            "the semi-analytical derivative",
            why,
            "take the direct or adjoint method, or another step of the differences",
        )
    }

    /// Records the derivatives of the outputs at the times that the step has reached.
    fn record_outputs(&mut self) -> Result<()> {
        while let Some(t) = self.times.next_until(self.new.t) {
            interpolate(&self.old, &self.new, t, &mut self.at);
            (self.sensitivity.old.t, self.sensitivity.new.t) = (self.old.t, self.new.t);
            interpolate(&self.sensitivity.old, &self.sensitivity.new, t, &mut self.sensitivity_at);
            let (from, sampler) = (self.derivatives.len(), &mut self.sampler);
            let derivatives =
                self.difference.derivatives(&self.at, &self.sensitivity_at, |mechanism, state, outputs| {
                    sampler.outputs(mechanism, state, outputs);
                });
            self.derivatives.extend(derivatives);
            if let Some(k) = self.derivatives[from..].iter().position(|derivative| !derivative.is_finite()) {
                let why = format!("its semi-analytical derivative is not finite at t = {t:.6e} s");
                let remedy = "take a shorter step of the differences, or the direct or adjoint method";
                return Err(Error::analysis(&self.plain.outputs[k].name, why, remedy));
            }
        }
        Ok(())
    }
}

impl StepConsumer<StepBlock> for DifferenceSensitivity<'_> {
    fn propagate(&mut self, block: &StepBlock) -> Result<()> {
        block.steps().iter().try_for_each(|step| {
            self.advance(step)?;
            self.record_outputs()
        })
    }
}
