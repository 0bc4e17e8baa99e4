//! Explicit Runge–Kutta steps for smooth, non-stiff motions at high accuracy.

use super::start::{AccelerationSolver, Assembly, Projection, assemble, make_velocities_consistent};
use super::state::State;
use super::system::System;
use crate::multibody::{Mechanism, Real};
use crate::{Error, Result};

/// Coefficients of an explicit Runge–Kutta method with an embedded error estimate.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Tableau {
    /// Order of the method.
    pub order: u8,
    /// Times of the stages in parts of the step.
    pub nodes: &'static [f64],
    /// Weights of the earlier stages in each stage.
    pub stages: &'static [&'static [f64]],
    /// Weights of the result.
    pub weights: &'static [f64],
    /// Weights of the error estimate.
    pub errors: &'static [f64],
    /// Order of the error estimate, plus one.
    pub error_order: u8,
}

/// Dormand and Prince's method of order 5 with an estimate of order 4.
///
/// **Source.** Dormand & Prince, *J. Comput. Appl. Math.* 6 (1980) 19–26.
pub const DORMAND_PRINCE_5: Tableau = Tableau {
    order: 5,
    nodes: &[0.0, 0.2, 0.3, 0.8, 8.0 / 9.0, 1.0, 1.0],
    stages: &[
        &[],
        &[0.2],
        &[3.0 / 40.0, 9.0 / 40.0],
        &[44.0 / 45.0, -56.0 / 15.0, 32.0 / 9.0],
        &[19372.0 / 6561.0, -25360.0 / 2187.0, 64448.0 / 6561.0, -212.0 / 729.0],
        &[9017.0 / 3168.0, -355.0 / 33.0, 46732.0 / 5247.0, 49.0 / 176.0, -5103.0 / 18656.0],
        &[35.0 / 384.0, 0.0, 500.0 / 1113.0, 125.0 / 192.0, -2187.0 / 6784.0, 11.0 / 84.0],
    ],
    weights: &[35.0 / 384.0, 0.0, 500.0 / 1113.0, 125.0 / 192.0, -2187.0 / 6784.0, 11.0 / 84.0, 0.0],
    errors: &[71.0 / 57600.0, 0.0, -71.0 / 16695.0, 71.0 / 1920.0, -17253.0 / 339200.0, 22.0 / 525.0, -1.0 / 40.0],
    error_order: 5,
};

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

    /// **Errors.** [`Error::Option`] for a setting out of range.
    pub fn check(&self) -> Result<()> {
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
    at: State<f64>,
    solver: AccelerationSolver,
}

impl<'m> ExplicitRun<'m> {
    /// Assembles the mechanism and finds its accelerations.
    pub fn new(mechanism: &'m Mechanism<f64>, settings: &Explicit) -> Result<Self> {
        settings.check()?;
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
            self.evaluate_stages(h, followers)?;
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

    fn evaluate_stages(&mut self, h: f64, followers: &mut [impl Follower]) -> Result<()> {
        let Self { mechanism, system, old, stages, at, solver, settings, .. } = self;
        for s in 0..settings.tableau.nodes.len() {
            stages.state(mechanism, &settings.tableau, s, h, old, at);
            solver.solve(system, mechanism, at)?;
            stages.keep(s, at);
            followers.iter_mut().for_each(|follower| follower.stage(s, h, at, system));
        }
        self.evaluations += settings.tableau.nodes.len();
        Ok(())
    }

    /// Estimated local error of positions and velocities; velocities count times the step.
    fn error(&self, h: f64) -> f64 {
        let largest = |series: &[Vec<f64>], i: usize| -> f64 {
            self.settings.tableau.errors.iter().zip(series).map(|(w, k)| w * k[i]).sum::<f64>().abs()
        };
        let free = self.mechanism.coordinates.iter().enumerate().filter(|(_, c)| c.motion.is_none());
        let errors =
            free.map(|(i, _)| h * largest(&self.stages.velocities, i).max(largest(&self.stages.accelerations, i) * h));
        errors.fold(0.0, |a, b| if b > a || b.is_nan() { b } else { a })
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

/// The state at `t` in a step: positions by the quintic through positions, velocities and accelerations of both ends,
/// velocities and accelerations as its derivatives, multipliers linearly.
pub fn interpolate_smoothly<T: Real>(old: &State<T>, new: &State<T>, t: f64, at: &mut State<T>) {
    let h = new.t - old.t;
    if (new.t - t).abs() <= 1e-12 * h {
        return at.copy_from(new);
    }
    let x = (t - old.t) / h;
    at.t = t;
    for i in 0..at.q.len() {
        let (q0, v0, a0) = (old.q[i], old.v[i] * h, old.a[i] * (h * h * 0.5));
        let (rise, slope, bend) =
            (new.q[i] - q0 - v0 - a0, new.v[i] * h - v0 - a0 * 2.0, new.a[i] * (h * h) - a0 * 2.0);
        let c3 = rise * 10.0 - slope * 4.0 + bend * 0.5;
        let c4 = rise * -15.0 + slope * 7.0 - bend;
        let c5 = rise * 6.0 - slope * 3.0 + bend * 0.5;
        at.q[i] = q0 + (v0 + (a0 + (c3 + (c4 + c5 * x) * x) * x) * x) * x;
        at.v[i] = (v0 + (a0 * 2.0 + (c3 * 3.0 + (c4 * 4.0 + c5 * (5.0 * x)) * x) * x) * x) * (1.0 / h);
        at.a[i] = (a0 * 2.0 + (c3 * 6.0 + (c4 * 12.0 + c5 * (20.0 * x)) * x) * x) * (1.0 / (h * h));
    }
    for ((at, &old), &new) in at.l.iter_mut().zip(&old.l).zip(&new.l) {
        *at = old * (1.0 - x) + new * x;
    }
}
