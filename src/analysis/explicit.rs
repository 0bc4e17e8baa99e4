//! Explicit Runge–Kutta steps for smooth, non-stiff motions at high accuracy.

use super::dynamics::check_times;
use super::start::{AccelerationSolver, Assembly, Projection, assemble, make_velocities_consistent};
use super::state::State;
use super::system::System;
use super::tableau::{DORMAND_PRINCE_5, DORMAND_PRINCE_8, Tableau};
use crate::multibody::{Mechanism, Real};
use crate::{Error, Result};
use std::ops::Range;

/// Settings of an analysis by explicit steps.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Explicit {
    /// Start of the motion in s.
    pub start: f64,
    /// The method.
    pub tableau: Tableau,
    /// Tolerated local error of positions (m, rad) and velocities; infinite for steps of the first size.
    pub tolerance: f64,
    /// First step in s.
    pub first: f64,
    /// Longest step in s.
    pub longest: f64,
    /// Whether to put every step back on the constraints.
    pub project: bool,
    /// Assembly of the initial positions and projection.
    pub assembly: Assembly,
}

impl Explicit {
    /// Adaptive steps of Dormand and Prince's fifth-order method.
    pub fn adaptive(tolerance: f64) -> Self {
        let (start, first, longest) = (0.0, 1e-3, f64::INFINITY);
        let tableau = DORMAND_PRINCE_5;
        Self { start, tableau, tolerance, first, longest, project: true, assembly: Assembly::default() }
    }

    /// Adaptive steps of Dormand and Prince's eighth-order method: cheaper below a tolerance of about 1e-7.
    pub fn eighth_order(tolerance: f64) -> Self {
        Self { tableau: DORMAND_PRINCE_8, ..Self::adaptive(tolerance) }
    }

    /// **Errors.** [`Error::Option`] for a setting out of range, [`Error::Definition`] if times are not increasing.
    pub fn check(&self, times: &[f64]) -> Result<()> {
        check_times(self.start, times)?;
        Error::check_option("tolerance", "positive", self.tolerance, self.tolerance > 0.0)?;
        Error::check_option("first step", "positive", self.first, self.first > 0.0)?;
        Error::check_option("longest step", "positive", self.longest, self.longest > 0.0)
    }
}

/// Velocities and accelerations at the stages of one step, in any number type.
#[derive(Clone, Debug)]
pub struct Stages<T> {
    velocities: Vec<Vec<T>>,
    accelerations: Vec<Vec<T>>,
}

impl<T: Real> Stages<T> {
    /// Room for the stages of `tableau` with `coordinates` coordinates.
    pub fn new(tableau: &Tableau, coordinates: usize) -> Self {
        let room = vec![vec![T::from(0.0); coordinates]; tableau.nodes.len()];
        Self { velocities: room.clone(), accelerations: room }
    }

    /// The state at stage `s` of a step `h` from `start`, without accelerations.
    pub fn state(
        &self,
        mechanism: &Mechanism<T>,
        tableau: &Tableau,
        s: usize,
        h: f64,
        start: &State<T>,
        at: &mut State<T>,
    ) {
        self.combine(mechanism, tableau.stages[s], h, start, at);
        at.t = start.t + tableau.nodes[s] * h;
        at.prescribe(mechanism);
    }

    /// Positions and velocities at the part `x` of a step `h`, without accelerations.
    ///
    /// By the method's own dense output where it has one (its additional stages must be there), else by Hermite's
    /// quintic through positions, velocities and accelerations of both ends.
    pub fn between(
        &self,
        mechanism: &Mechanism<T>,
        tableau: &Tableau,
        x: f64,
        [old, new]: [&State<T>; 2],
        at: &mut State<T>,
    ) {
        let h = new.t - old.t;
        if tableau.dense.is_empty() {
            quintic(old, new, x, at);
        } else {
            for i in 0..at.q.len() {
                let sum = |series: &[Vec<T>], weights: &[f64]| -> T {
                    weights.iter().zip(series).filter(|(w, _)| **w != 0.0).map(|(&w, k)| k[i] * w).sum()
                };
                let position = [old.q[i], new.q[i], old.v[i] * h, new.v[i] * h];
                at.q[i] = dense(position, |j| sum(&self.velocities, tableau.dense[j]) * h, x);
                let velocity = [old.v[i], new.v[i], old.a[i] * h, new.a[i] * h];
                at.v[i] = dense(velocity, |j| sum(&self.accelerations, tableau.dense[j]) * h, x);
            }
        }
        at.t = old.t + x * h;
        at.prescribe(mechanism);
    }

    /// The result of a step `h`, without accelerations.
    pub fn result(&self, mechanism: &Mechanism<T>, tableau: &Tableau, h: f64, start: &State<T>, at: &mut State<T>) {
        self.combine(mechanism, tableau.weights, h, start, at);
        at.t = start.t + h;
        at.prescribe(mechanism);
    }

    /// Keeps what was found at stage `s`.
    pub fn keep(&mut self, s: usize, at: &State<T>) {
        self.velocities[s].copy_from_slice(&at.v);
        self.accelerations[s].copy_from_slice(&at.a);
    }

    fn combine(&self, mechanism: &Mechanism<T>, weights: &[f64], h: f64, start: &State<T>, at: &mut State<T>) {
        at.q.copy_from_slice(&start.q);
        at.v.copy_from_slice(&start.v);
        for (s, &weight) in weights.iter().enumerate().filter(|(_, w)| **w != 0.0) {
            for (i, coordinate) in mechanism.coordinates.iter().enumerate() {
                if coordinate.motion.is_none() {
                    at.q[i] += self.velocities[s][i] * (h * weight);
                    at.v[i] += self.accelerations[s][i] * (h * weight);
                }
            }
        }
    }
}

/// Something that goes along with the stages and steps of an explicit integration: derivatives.
pub trait Follower {
    /// After the accelerations at stage `s` of a step `h` were found; `system` holds their factorization.
    fn stage(&mut self, s: usize, h: f64, at: &State<f64>, system: &mut System);
    /// After a step `h` was accepted and ended in `end`.
    fn accepted(
        &mut self,
        h: f64,
        end: &State<f64>,
        projection: Option<&Projection>,
        system: &mut System,
    ) -> Result<()>;
}

/// Takes explicit steps in `f64`.
pub struct ExplicitRun<'m> {
    /// The mechanism.
    pub mechanism: &'m Mechanism<f64>,
    /// Its equations.
    pub system: System,
    /// Beginning of the current step, with accelerations.
    pub old: State<f64>,
    /// End of the current step, with accelerations.
    pub new: State<f64>,
    /// Multipliers of the initial projections.
    pub projection: Projection,
    /// Steps taken.
    pub steps: usize,
    /// Evaluations of the accelerations.
    pub evaluations: usize,
    settings: Explicit,
    next: f64,
    stages: Stages<f64>,
    /// Whether the stages for dense output are there.
    dense: bool,
    at: State<f64>,
    solver: AccelerationSolver,
}

impl<'m> ExplicitRun<'m> {
    /// Assembles the mechanism and finds its accelerations.
    pub fn new(mechanism: &'m Mechanism<f64>, settings: &Explicit) -> Result<Self> {
        settings.check(&[])?;
        let mut system = System::new(mechanism)?;
        let mut state = State::built(mechanism, settings.start);
        let mut projection = assemble(&mut system, mechanism, &mut state, settings.assembly)?;
        projection.velocity = make_velocities_consistent(&mut system, mechanism, &mut state)?;
        let mut solver = AccelerationSolver::default();
        solver.solve(&mut system, mechanism, &mut state)?;
        Ok(Self {
            mechanism,
            system,
            old: state.clone(),
            new: state.clone(),
            projection,
            steps: 0,
            evaluations: 1,
            settings: *settings,
            next: settings.first.min(settings.longest),
            stages: Stages::new(&settings.tableau, mechanism.coordinates.len()),
            dense: false,
            at: state,
            solver,
        })
    }

    /// Takes one step; its followers' stages are solved with its factorizations.
    ///
    /// **Errors.** [`Error::Analysis`] if the step shrinks to nothing.
    pub fn advance(&mut self, followers: &mut [impl Follower]) -> Result<f64> {
        if self.steps > 0 {
            std::mem::swap(&mut self.old, &mut self.new);
        }
        self.steps += 1;
        let (mut h, mut shrunk) = (self.next, false);
        loop {
            self.evaluate_stages(0..self.settings.tableau.weights.len(), h, followers)?;
            self.dense = false;
            let error = self.error(h) / self.settings.tolerance;
            let growth = 0.9 * error.max(1e-10).powf(-1.0 / f64::from(self.settings.tableau.error_order));
            if error <= 1.0 || self.settings.tolerance == f64::INFINITY {
                let growth = if self.settings.tolerance == f64::INFINITY { 1.0 } else { growth };
                self.next = (h * growth.clamp(0.2, if shrunk { 1.0 } else { 5.0 })).min(self.settings.longest);
                self.finish(h, followers)?;
                return Ok(h);
            }
            shrunk = true;
            h *= if growth.is_finite() { growth.clamp(0.1, 0.9) } else { 0.1 };
            if h < 1e-14 * (1.0 + self.old.t.abs()) {
                let why = format!("the step shrinks to {h:.1e} s at t = {:.6e} s", self.old.t);
                return Err(Error::analysis("explicit steps", why, "use implicit steps: the motion is stiff"));
            }
        }
    }

    /// The state at time `t` of the current step, with its own accelerations and multipliers, written to `at`.
    ///
    /// The factor of these accelerations stays in `system`.
    pub fn sample(&mut self, t: f64, followers: &mut [impl Follower], at: &mut State<f64>) -> Result<()> {
        let h = self.new.t - self.old.t;
        let stages = self.settings.tableau.weights.len()..self.settings.tableau.nodes.len();
        if !self.dense && !stages.is_empty() {
            self.evaluate_stages(stages, h, followers)?;
            self.dense = true;
        }
        let x = (t - self.old.t) / h;
        self.stages.between(self.mechanism, &self.settings.tableau, x, [&self.old, &self.new], at);
        self.evaluations += 1;
        self.solver.solve(&mut self.system, self.mechanism, at)
    }

    fn evaluate_stages(&mut self, which: Range<usize>, h: f64, followers: &mut [impl Follower]) -> Result<()> {
        self.evaluations += which.len();
        let Self { mechanism, system, old, stages, at, solver, settings, .. } = self;
        for s in which {
            stages.state(mechanism, &settings.tableau, s, h, old, at);
            solver.solve(system, mechanism, at)?;
            stages.keep(s, at);
            followers.iter_mut().for_each(|follower| follower.stage(s, h, at, system));
        }
        Ok(())
    }

    /// Estimated local error of positions and velocities; velocities count times the step.
    fn error(&self, h: f64) -> f64 {
        let largest = |weights: &[f64]| {
            let sum =
                |series: &[Vec<f64>], i: usize| weights.iter().zip(series).map(|(w, k)| w * k[i]).sum::<f64>().abs();
            let free =
                (0..self.mechanism.coordinates.len()).filter(|&i| self.mechanism.coordinates[i].motion.is_none());
            let errors = free.map(|i| h * sum(&self.stages.velocities, i).max(h * sum(&self.stages.accelerations, i)));
            // NaN must not be lost in a maximum.
            errors.fold(0.0, |a, b| if b > a || b.is_nan() { b } else { a })
        };
        let (fine, coarse) = (largest(self.settings.tableau.errors), largest(self.settings.tableau.coarse_errors));
        // Order 8 from estimates of orders 5 and 3 (Hairer, Nørsett & Wanner, Section II.10).
        if coarse > 0.0 { fine * fine / (fine * fine + 0.01 * coarse * coarse).sqrt() } else { fine }
    }

    fn finish(&mut self, h: f64, followers: &mut [impl Follower]) -> Result<()> {
        let Self { mechanism, system, old, new, stages, solver, settings, .. } = self;
        stages.result(mechanism, &settings.tableau, h, old, new);
        let mut projection = None;
        if settings.project && mechanism.multipliers > 0 {
            let mut used = assemble(system, mechanism, new, settings.assembly)?;
            used.velocity = make_velocities_consistent(system, mechanism, new)?;
            projection = Some(used);
        }
        solver.solve(system, mechanism, new)?;
        self.evaluations += 1;
        for follower in followers {
            follower.accepted(h, &self.new, projection.as_ref(), &mut self.system)?;
        }
        Ok(())
    }
}

/// Positions by the quintic through positions, velocities and accelerations of both ends; velocities as its rate.
fn quintic<T: Real>(old: &State<T>, new: &State<T>, x: f64, at: &mut State<T>) {
    let h = new.t - old.t;
    for i in 0..at.q.len() {
        let (q0, v0, a0) = (old.q[i], old.v[i] * h, old.a[i] * (h * h * 0.5));
        let (rise, slope, bend) =
            (new.q[i] - q0 - v0 - a0, new.v[i] * h - v0 - a0 * 2.0, new.a[i] * (h * h) - a0 * 2.0);
        let c3 = rise * 10.0 - slope * 4.0 + bend * 0.5;
        let c4 = rise * -15.0 + slope * 7.0 - bend;
        let c5 = rise * 6.0 - slope * 3.0 + bend * 0.5;
        at.q[i] = q0 + (v0 + (a0 + (c3 + (c4 + c5 * x) * x) * x) * x) * x;
        at.v[i] = (v0 + (a0 * 2.0 + (c3 * 3.0 + (c4 * 4.0 + c5 * (5.0 * x)) * x) * x) * x) * (1.0 / h);
    }
}

/// Dense output of order 7 from both ends' values and rates (times the step) and four sums over the stages.
///
/// **Source.** Hairer, Nørsett & Wanner, *Solving ODEs I*, 2nd ed., Section II.6.
fn dense<T: Real>([y0, y1, r0, r1]: [T; 4], sum: impl Fn(usize) -> T, x: f64) -> T {
    let rise = y1 - y0;
    let (start, end) = (r0 - rise, rise - r1 - (r0 - rise));
    let z = 1.0 - x;
    let tail = sum(0) + (sum(1) + (sum(2) + sum(3) * x) * z) * x;
    y0 + (rise + (start + (end + tail * z) * x) * z) * x
}
