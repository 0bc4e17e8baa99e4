//! Derivatives that go along with implicit steps, one chunk of design variables at a time.

use crate::analyses::dynamics::{Dynamics, is_before};
use crate::analyses::sampling::{Sampler, interpolate};
use crate::derivatives::forward::initial_conditions::StartSolver;
use crate::derivatives::forward::step_block::{ConvergedStep, StepBlock, StepConsumer, StepSource};
use crate::derivatives::saltation::{apply_impact, apply_switch};
use crate::derivatives::seeding::{set_values, take_values};
use crate::diagnostics::check_finite;
use crate::elements::element::ElementWorkspace;
use crate::integrators::generalized_alpha::Step;
use crate::linalg::factor::{Factor, SolveWorkspace};
use crate::mechanism::Mechanism;
use crate::mechanism::scalars::{DerivativeScalar, ElementScalar, Jet2};
use crate::system::System;
use crate::system::state::State;
use crate::{Error, Result};

/// One chunk of derivatives.
pub(crate) struct ForwardSensitivity<'m, T, const L: usize> {
    plain: &'m Mechanism<f64>,
    mechanism: &'m Mechanism<T>,
    /// The equations, for their numbering and rows.
    system: System,
    settings: &'m Dynamics,
    times: &'m [f64],
    /// Number of `times` that have been passed.
    passed: usize,
    step: Step<T>,
    at: State<T>,
    started: bool,
    /// The contact that the last step has closed, and the values there.
    closed: Option<(usize, State<f64>)>,
    workspace: ElementWorkspace<T>,
    solve_workspace: SolveWorkspace,
    rows: Vec<T>,
    changes: Vec<[f64; L]>,
    sampler: Sampler<T>,
    outputs: Vec<T>,
    slopes: Vec<f64>,
}

impl<'m, T: DerivativeScalar<L>, const L: usize> ForwardSensitivity<'m, T, L>
where
    Jet2<T>: ElementScalar,
{
    /// Derivatives of the initial state.
    pub fn start<'s: 'm>(
        mechanism: &'m Mechanism<T>,
        source: &mut StepSource<'s>,
        settings: &'m Dynamics,
        times: &'m [f64],
    ) -> Result<Self> {
        let StepSource { mechanism: plain, system, start: values, projection, .. } = source;
        let state = StartSolver::new(plain, mechanism, system).start(values, projection, settings)?;
        let (rows, changes) = (vec![T::from(0.0); system.size()], vec![[0.0; L]; system.size()]);
        let mut companion = Self {
            plain,
            mechanism,
            solve_workspace: system.solve_workspace(),
            system: system.clone(),
            settings,
            times,
            passed: 0,
            at: state.clone(),
            step: Step::from(state),
            started: false,
            closed: None,
            workspace: ElementWorkspace::default(),
            rows,
            changes,
            sampler: Sampler::new(mechanism),
            outputs: Vec::new(),
            slopes: Vec::with_capacity(times.len() * mechanism.outputs.len() * L),
        };
        companion.sample()?;
        Ok(companion)
    }

    /// Derivatives of the outputs, by time, output and design variable.
    pub fn into_slopes(self) -> Vec<f64> {
        self.slopes
    }

    fn take(&mut self, taken: &ConvergedStep) -> Result<()> {
        self.bounce()?;
        if self.started {
            self.step.accept();
        }
        self.started = true;
        let begin = self.step.old.t;
        match taken.closed {
            Some(contact) => self.close(taken, contact)?,
            None if begin.is_constant() || !taken.is_on_grid => self.correct(taken),
            // Its beginning depends on the design, its end does not.
            None => self.correct_for(taken, -begin + taken.end.t),
        }
        Ok(())
    }

    /// A step of given length.
    fn correct(&mut self, ConvergedStep { h, end: values, factor, .. }: &ConvergedStep) {
        let Dynamics { scheme, prescribed, .. } = self.settings;
        set_values(&mut self.step.new.a, &values.a);
        set_values(&mut self.step.new.l, &values.l);
        self.step.march(self.mechanism, scheme, *prescribed, *h);
        take_values(&mut self.step.new, values);
        for _ in 0..T::ORDER {
            self.change(*h, factor);
            self.step.correct(&self.system, scheme, *h, |equation| T::with(0.0, self.changes[equation]));
        }
    }

    /// A step whose length `h` carries derivatives.
    fn correct_for(&mut self, ConvergedStep { h: value, end: values, factor, .. }: &ConvergedStep, h: T) {
        let Dynamics { scheme, prescribed, .. } = self.settings;
        set_values(&mut self.step.new.a, &values.a);
        set_values(&mut self.step.new.l, &values.l);
        for correction in 0..=T::ORDER {
            self.step.march(self.mechanism, scheme, *prescribed, h);
            take_values(&mut self.step.new, values);
            if correction < T::ORDER {
                self.change(*value, factor);
                self.step.improve(&self.system, |equation| T::with(0.0, self.changes[equation]));
            }
        }
    }

    /// Corrections of accelerations and multipliers at the end of a step `h`.
    fn change(&mut self, h: f64, factor: &Factor) {
        let (position, _) = self.settings.scheme.newmark_coefficients(h);
        self.system.residual(self.mechanism, &self.step.new, 1.0 / position, &mut self.workspace, &mut self.rows);
        self.changes.iter_mut().zip(&self.rows).for_each(|(change, row)| *change = row.derivatives().map(|x| -x));
        factor.solve_in(&mut self.changes, &mut self.solve_workspace);
    }

    /// A step that ends where `contact` closes, whenever that is.
    fn close(&mut self, taken: &ConvergedStep, contact: usize) -> Result<()> {
        let (impact, given) = (&self.mechanism.impacts[contact], T::from(taken.h));
        let unit = T::with(0.0, std::array::from_fn(|k| f64::from(u8::from(k == 0))));
        let [still, moved] = [given, given + unit].map(|h| {
            self.correct_for(taken, h);
            impact.gap(&self.step.new).derivatives()[0]
        });
        let speed = moved - still;
        if speed == 0.0 || !speed.is_finite() {
            let why = format!("it is only touched at t = {:.6e} s: there is no derivative", taken.end.t);
            return Err(Error::analysis(&impact.part.name, why, "change the design a little"));
        }
        let mut h = given;
        for _ in 0..T::ORDER {
            self.correct_for(taken, h);
            h -= T::with(0.0, impact.gap(&self.step.new).derivatives().map(|gap| gap / speed));
        }
        self.correct_for(taken, h);
        self.closed = Some((contact, taken.end.clone()));
        Ok(())
    }

    /// Bounces off the contact that the last step has closed, if it has.
    fn bounce(&mut self) -> Result<()> {
        let Some((contact, values)) = self.closed.take() else { return Ok(()) };
        let mut state = self.step.new.clone();
        let (plain, mechanism, system) = (self.plain, self.mechanism, &mut self.system);
        match plain.impacts[contact].restitution {
            Some(_) => apply_impact(plain, mechanism, system, contact, &values, &mut state)?,
            None => apply_switch(plain, mechanism, system, self.settings.step.ahead(), &values, &mut state)?,
        }
        self.step.restart(&state);
        Ok(())
    }

    /// Outputs at the times that the step has reached.
    fn sample(&mut self) -> Result<()> {
        while let Some(&t) = self.times.get(self.passed) {
            if is_before(self.settings.start, self.step.new.t.value(), t) {
                break;
            }
            interpolate(&self.step.old, &self.step.new, t, &mut self.at);
            self.sampler.outputs(self.mechanism, &self.at, &mut self.outputs);
            check_finite(self.mechanism, &self.outputs, t)?;
            self.slopes.extend(self.outputs.iter().flat_map(|output| output.derivatives()));
            self.passed += 1;
        }
        Ok(())
    }
}

impl<T: DerivativeScalar<L>, const L: usize> StepConsumer for ForwardSensitivity<'_, T, L>
where
    Jet2<T>: ElementScalar,
{
    fn follow(&mut self, stretch: &StepBlock) -> Result<()> {
        stretch.taken().iter().try_for_each(|taken| {
            self.take(taken)?;
            self.sample()
        })
    }
}
