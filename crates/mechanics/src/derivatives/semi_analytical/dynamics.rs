//! Slopes along implicit steps, for one design variable.

use crate::Result;
use crate::analyses::dynamics::{Dynamics, is_before};
use crate::analyses::sampling::{Sampler, interpolate};
use crate::derivatives::forward::step_block::{ConvergedStep, StepBlock, StepConsumer};
use crate::derivatives::semi_analytical::central_difference::CentralDifference;
use crate::diagnostics::check_finite;
use crate::elements::element::ElementWorkspace;
use crate::integrators::generalized_alpha::Step;
use crate::linalg::factor::SolveWorkspace;
use crate::mechanism::Mechanism;
use crate::system::System;
use crate::system::state::State;

/// Goes along with converged steps.
pub(crate) struct DifferenceSensitivity<'m> {
    beside: CentralDifference,
    plain: &'m Mechanism<f64>,
    system: System,
    settings: &'m Dynamics,
    times: &'m [f64],
    /// Number of `times` that have been passed.
    passed: usize,
    /// The state at both ends of the step.
    old: State<f64>,
    new: State<f64>,
    /// Its slopes there.
    slopes: Step<f64>,
    started: bool,
    at: State<f64>,
    slopes_at: State<f64>,
    workspace: ElementWorkspace<f64>,
    solve_workspace: SolveWorkspace,
    changes: Vec<[f64; 1]>,
    sampler: Sampler<f64>,
    found: Vec<f64>,
}

impl<'m> DifferenceSensitivity<'m> {
    /// From the start of a motion with its slopes.
    pub fn new(
        (beside, slopes): (CentralDifference, State<f64>),
        plain: &'m Mechanism<f64>,
        system: &System,
        start: &State<f64>,
        settings: &'m Dynamics,
        times: &'m [f64],
    ) -> Result<Self> {
        let mut along = Self {
            beside,
            plain,
            solve_workspace: system.solve_workspace(),
            changes: vec![[0.0]; system.size()],
            system: system.clone(),
            settings,
            times,
            passed: 0,
            old: start.clone(),
            new: start.clone(),
            at: start.clone(),
            slopes_at: slopes.clone(),
            slopes: Step::from(slopes),
            started: false,
            workspace: ElementWorkspace::default(),
            sampler: Sampler::new(plain),
            found: Vec::with_capacity(times.len() * plain.outputs.len()),
        };
        along.sample()?;
        Ok(along)
    }

    /// Slopes of the outputs, by time and output.
    pub fn into_slopes(self) -> Vec<f64> {
        self.found
    }

    fn take(&mut self, ConvergedStep { h, end, factor, .. }: &ConvergedStep) {
        if self.started {
            self.slopes.accept();
        }
        self.started = true;
        std::mem::swap(&mut self.old, &mut self.new);
        self.new.copy_from(end);
        let Dynamics { scheme, prescribed, .. } = self.settings;
        // At fixed unknowns: what moves is the old state and what is prescribed.
        let slopes = &mut self.slopes.new;
        slopes.t = end.t;
        slopes.a.fill(0.0);
        slopes.l.fill(0.0);
        self.beside.prescribe(slopes, |mechanism, state| state.prescribe_positions(mechanism, *prescribed));
        self.slopes.march_prescribed(self.plain, scheme, *prescribed, *h);
        let (position, _) = scheme.newmark_coefficients(*h);
        let (system, workspace, size) = (&self.system, &mut self.workspace, self.changes.len());
        let slope = self.beside.slope(end, &self.slopes.new, |mechanism, state, rows| {
            rows.resize(size, 0.0);
            system.residual(mechanism, state, 1.0 / position, workspace, rows);
        });
        self.changes.iter_mut().zip(slope).for_each(|(change, slope)| *change = [-slope]);
        factor.solve_in(&mut self.changes, &mut self.solve_workspace);
        let changes = &self.changes;
        self.slopes.correct(&self.system, scheme, *h, |equation| changes[equation][0]);
    }

    /// Slopes of the outputs at the times that the step has reached.
    fn sample(&mut self) -> Result<()> {
        while let Some(&t) = self.times.get(self.passed) {
            if is_before(self.settings.start, self.new.t, t) {
                break;
            }
            interpolate(&self.old, &self.new, t, &mut self.at);
            (self.slopes.old.t, self.slopes.new.t) = (self.old.t, self.new.t);
            interpolate(&self.slopes.old, &self.slopes.new, t, &mut self.slopes_at);
            let (from, sampler) = (self.found.len(), &mut self.sampler);
            let slopes = self.beside.slope(&self.at, &self.slopes_at, |mechanism, state, outputs| {
                sampler.outputs(mechanism, state, outputs);
            });
            self.found.extend(slopes);
            check_finite(self.plain, &self.found[from..], t)?;
            self.passed += 1;
        }
        Ok(())
    }
}

impl StepConsumer for DifferenceSensitivity<'_> {
    fn follow(&mut self, stretch: &StepBlock) -> Result<()> {
        stretch.taken().iter().try_for_each(|taken| {
            self.take(taken);
            self.sample()
        })
    }
}
