//! A running simulation by implicit steps.

use crate::analyses::dynamics::{Dynamics, InitialAcceleration, InitialConfiguration, StepSize, Work, is_before};
use crate::analyses::statics::{Statics, find_equilibrium};
use crate::events::location::Event;
use crate::initial_conditions::{AccelerationSolver, Projection, assemble, make_velocities_consistent};
use crate::integrators::generalized_alpha::Integrator;
use crate::integrators::step_limit::{MOST_STEPS, too_many_steps};
use crate::mechanism::Mechanism;
use crate::system::System;
use crate::system::state::State;
use crate::{Error, Result};

/// Moves `state` to the equilibrium at its time, with the velocities that it has. Returns the reactions there.
fn solve_initial_configuration(
    system: &mut System,
    mechanism: &Mechanism<f64>,
    state: &mut State<f64>,
    statics: &Statics,
) -> Result<Vec<f64>> {
    let velocities = state.v.clone();
    find_equilibrium(system, mechanism, state, statics)?;
    state.v = velocities;
    state.prescribe(mechanism);
    Ok(std::mem::replace(&mut state.l, vec![0.0; mechanism.multipliers]))
}

/// A running simulation: advanced time by time, by one step after the other.
pub struct TimeStepper<'m> {
    /// The integrator with the current step.
    pub integrator: Integrator<'m>,
    /// Multipliers of the initial projections.
    pub projection: Projection,
    /// Impacts so far.
    pub impacts: Vec<Event>,
    /// The contact that the current step has closed.
    pub(crate) closed: Option<usize>,
    /// The contact that the current step comes from.
    pub(crate) bounced: Option<usize>,
    /// Whether the current step ends at a time of the grid.
    pub(crate) is_on_grid: bool,
    pub(crate) settings: Dynamics,
    end: f64,
    pub(crate) next: f64,
    /// Length of the current step in s.
    pub(crate) length: f64,
    pub(crate) steps: usize,
    pub(crate) grid_steps: usize,
    pub(crate) failed_steps: usize,
}

/// What is left of a grid step after an impact is not gone by itself if it is less than this part of the step.
const TINY: f64 = 1e-4;

/// Smallest step in parts of the wanted one.
const SMALLEST: f64 = 1.0 / 1024.0;

impl<'m> TimeStepper<'m> {
    /// Assembles the mechanism and puts it in its initial state.
    pub fn new(mechanism: &'m Mechanism<f64>, settings: &Dynamics, times: &[f64]) -> Result<Self> {
        settings.check(times)?;
        let mut system = System::at(mechanism, settings.start)?;
        let mut state = State::built(mechanism, settings.start);
        let mut projection = assemble(&mut system, mechanism, &mut state, settings.assembly)?;
        if let InitialConfiguration::Equilibrium(statics) = &settings.origin {
            projection.position = solve_initial_configuration(&mut system, mechanism, &mut state, statics)?;
        }
        projection.velocity = make_velocities_consistent(&mut system, mechanism, &mut state)?;
        if settings.initial == InitialAcceleration::Consistent {
            AccelerationSolver::default().solve(&mut system, mechanism, &mut state)?;
        }
        let (scheme, newton) = (settings.scheme, settings.newton);
        let integrator = Integrator::new(mechanism, system, scheme, settings.prescribed, newton, state);
        let next = match settings.step {
            StepSize::Fixed(h) => h,
            StepSize::Adaptive { first, longest, .. } => first.min(longest),
        };
        let end = times.last().copied().unwrap_or(settings.start);
        let (steps, grid_steps, failed_steps) = (0, 0, 0);
        let (settings, length) = (*settings, 0.0);
        let (impacts, closed, bounced, is_on_grid) = (Vec::new(), None, None, false);
        let run = Self {
            integrator,
            projection,
            impacts,
            closed,
            bounced,
            is_on_grid,
            settings,
            end,
            next,
            length,
            steps,
            grid_steps,
            failed_steps,
        };
        run.check_contacts()?;
        Ok(run)
    }

    /// Takes steps until the current one ends at or after `t`.
    pub fn advance_to(&mut self, t: f64) -> Result<()> {
        while self.is_before(t) {
            self.advance()?;
        }
        Ok(())
    }

    /// Whether the current step ends before `t`.
    pub fn is_before(&self, t: f64) -> bool {
        is_before(self.settings.start, self.integrator.step.new.t, t)
    }

    /// Takes one step. Returns its length in s.
    pub fn advance(&mut self) -> Result<f64> {
        self.bounce()?;
        if self.steps > 0 {
            self.integrator.accept();
        }
        if self.steps >= MOST_STEPS {
            return Err(too_many_steps(self.integrator.step.new.t));
        }
        self.steps += 1;
        self.length = match self.settings.step {
            StepSize::Fixed(h) => self.advance_fixed(h)?,
            StepSize::Adaptive { tolerance, longest, .. } => self.advance_adaptive(tolerance, longest)?,
        };
        Ok(self.length)
    }

    /// Goes to, or half-way, quarter-way … to, the next time of the grid.
    fn advance_fixed(&mut self, h: f64) -> Result<f64> {
        let grid = |k: usize| self.settings.start + h * k as f64;
        if grid(self.grid_steps + 1) - self.integrator.step.old.t < TINY * h {
            self.grid_steps += 1; // the last impact was there
        }
        let target = grid(self.grid_steps + 1);
        let rest = target - self.integrator.step.old.t;
        let mut tried = self.next.min(rest);
        if rest - tried < 1e-6 * h {
            tried = rest;
        }
        loop {
            match self.integrator.solve(tried) {
                Ok(()) => break,
                Err(error) if tried < h * SMALLEST => return Err(error),
                Err(_) => {
                    self.failed_steps += 1;
                    tried *= 0.5;
                }
            }
        }
        let taken = self.stop_at_contact(tried)?;
        self.is_on_grid = taken == rest;
        if self.is_on_grid {
            self.grid_steps += 1;
            self.integrator.step.new.t = target;
        }
        // An impact decides the length of this step, but not that of the next.
        let length = if self.bounced.is_some() { self.next } else { tried };
        self.next = (2.0 * length).min(h);
        Ok(taken)
    }

    fn advance_adaptive(&mut self, tolerance: f64, longest: f64) -> Result<f64> {
        let (wanted, old) = (self.next, self.integrator.step.old.t);
        let mut tried = wanted;
        loop {
            let is_smallest = tried < wanted * SMALLEST * SMALLEST || old + 0.1 * tried == old;
            let error = match self.integrator.solve(tried) {
                Ok(()) => self.local_error(tried) / tolerance,
                Err(error) if is_smallest => return Err(error),
                Err(_) => f64::INFINITY,
            };
            if is_smallest && !(error <= 1.0) {
                return Err(self.too_small(tried));
            }
            let growth = (0.9 * error.powf(-1.0 / 3.0)).clamp(0.25, 2.0);
            if error <= 1.0 {
                self.next = (tried * growth).min(longest);
                return self.stop_at_contact(tried);
            }
            self.failed_steps += 1;
            tried *= growth.min(0.9);
        }
    }

    /// The coordinate whose acceleration does not let steps be as long as rounding demands.
    fn too_small(&self, h: f64) -> Error {
        let step = &self.integrator.step;
        let change = |i: &usize| (step.new.a[*i] - step.old.a[*i]).abs();
        let worst = (0..step.new.a.len()).max_by(|i, j| change(i).total_cmp(&change(j)));
        let what = worst.map_or("the mechanism", |i| &self.integrator.mechanism.coordinates[i].name);
        let why = format!("the step becomes too small ({h:.1e} s) at t = {:.6e} s", step.old.t);
        Error::analysis(what, why, "loosen the tolerance, or smooth what jumps there")
    }

    /// Local error of the positions: Newmark's h² |β − 1/6| times the change of the acceleration.
    ///
    /// **Source.** Zienkiewicz & Xie, *Earthq. Eng. Struct. Dyn.* 20 (1991) 871–887.
    fn local_error(&self, h: f64) -> f64 {
        let step = &self.integrator.step;
        let changes = step.new.a.iter().zip(&step.old.a).map(|(new, old)| (new - old).abs());
        h * h * (self.settings.scheme.beta - 1.0 / 6.0).abs() * changes.fold(0.0, f64::max)
    }

    /// Work so far.
    pub fn work(&self) -> Work {
        Work { steps: self.steps, failed_steps: self.failed_steps, iterations: self.integrator.iterations }
    }

    /// The last requested time.
    pub fn end(&self) -> f64 {
        self.end
    }
}
