//! Derivatives that go along with implicit steps, one chunk of design variables at a time.

use super::seeded::{set_values, take_values};
use super::start::StartSolver;
use super::stretch::{Source, Stretch, Taken};
use crate::Result;
use crate::analysis::dynamics::{Dynamics, check_finite, is_before};
use crate::analysis::generalized_alpha::Step;
use crate::analysis::sampling::{Sampler, interpolate};
use crate::analysis::{State, System};
use crate::linalg::SolveRoom;
use crate::multibody::element::Room;
use crate::multibody::{Carrier, Jet, Mechanism, Number};

/// One chunk of derivatives.
pub(super) struct Companion<'m, T, const L: usize> {
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
    room: Room<T>,
    solve_room: SolveRoom,
    rows: Vec<T>,
    changes: Vec<[f64; L]>,
    sampler: Sampler<T>,
    outputs: Vec<T>,
    slopes: Vec<f64>,
}

impl<'m, T: Carrier<L>, const L: usize> Companion<'m, T, L>
where
    Jet<T>: Number,
{
    /// Derivatives of the initial state.
    pub fn start(
        mechanism: &'m Mechanism<T>,
        source: &mut Source<'_>,
        settings: &'m Dynamics,
        times: &'m [f64],
    ) -> Result<Self> {
        let Source { mechanism: plain, system, start: values, projection, .. } = source;
        let state = StartSolver::new(plain, mechanism, system).start(values, projection, settings.initial)?;
        let (rows, changes) = (vec![T::from(0.0); system.size()], vec![[0.0; L]; system.size()]);
        let mut companion = Self {
            mechanism,
            solve_room: system.solve_room(),
            system: system.clone(),
            settings,
            times,
            passed: 0,
            at: state.clone(),
            step: Step::from(state),
            started: false,
            room: Room::default(),
            rows,
            changes,
            sampler: Sampler::new(mechanism),
            outputs: Vec::new(),
            slopes: Vec::with_capacity(times.len() * mechanism.outputs.len() * L),
        };
        companion.sample()?;
        Ok(companion)
    }

    /// Derivatives along a stretch of steps, and of the outputs there.
    pub fn follow(&mut self, stretch: &Stretch) -> Result<()> {
        stretch.taken().iter().try_for_each(|taken| {
            self.take(taken);
            self.sample()
        })
    }

    /// Derivatives of the outputs, by time, output and design variable.
    pub fn into_slopes(self) -> Vec<f64> {
        self.slopes
    }

    fn take(&mut self, Taken { h, end: values, factor }: &Taken) {
        if self.started {
            self.step.accept();
        }
        self.started = true;
        let Dynamics { scheme, prescribed, .. } = self.settings;
        set_values(&mut self.step.new.a, &values.a);
        set_values(&mut self.step.new.l, &values.l);
        self.step.march(self.mechanism, scheme, *prescribed, *h);
        take_values(&mut self.step.new, values);
        let (position, _) = scheme.seeds(*h);
        for _ in 0..T::ORDER {
            self.system.residual(self.mechanism, &self.step.new, 1.0 / position, &mut self.room, &mut self.rows);
            self.changes.iter_mut().zip(&self.rows).for_each(|(change, row)| *change = row.derivatives().map(|x| -x));
            factor.solve_in(&mut self.changes, &mut self.solve_room);
            self.step.correct(&self.system, scheme, *h, |equation| T::with(0.0, self.changes[equation]));
        }
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
