//! Derivatives that go along with implicit steps, one chunk of design variables at a time.

use super::seeded::set_values;
use super::start::StartSolver;
use super::stretch::{Follow, Source, Stretch, Taken};
use crate::Result;
use crate::analysis::dynamics::{Dynamics, check_finite, is_before};
use crate::analysis::generalized_alpha::Step;
use crate::analysis::sampling::{Sampler, interpolate};
use crate::analysis::{State, System};
use crate::linalg::SolveRoom;
use crate::multibody::element::Room;
use crate::multibody::{Jet, Mechanism, Number, Real};
use crate::scalar::Tangent;

/// One chunk of derivatives.
pub(super) struct Companion<'m, const N: usize> {
    mechanism: &'m Mechanism<Tangent<N>>,
    /// The equations, for their numbering and rows.
    system: System,
    settings: &'m Dynamics,
    times: &'m [f64],
    /// Number of `times` that have been passed.
    passed: usize,
    step: Step<Tangent<N>>,
    at: State<Tangent<N>>,
    started: bool,
    room: Room<Tangent<N>>,
    solve_room: SolveRoom,
    rows: Vec<Tangent<N>>,
    changes: Vec<[f64; N]>,
    sampler: Sampler<Tangent<N>>,
    outputs: Vec<Tangent<N>>,
    slopes: Vec<f64>,
}

impl<'m, const N: usize> Companion<'m, N>
where
    Tangent<N>: Real,
    Jet<Tangent<N>>: Number,
{
    /// Derivatives of the initial state.
    pub fn start(
        mechanism: &'m Mechanism<Tangent<N>>,
        source: &mut Source<'_>,
        settings: &'m Dynamics,
        times: &'m [f64],
    ) -> Result<Self> {
        let Source { mechanism: plain, system, start: values, projection, .. } = source;
        let state = StartSolver::new(plain, mechanism, system).start(values, projection, settings.initial)?;
        let (rows, changes) = (vec![Tangent::constant(0.0); system.size()], vec![[0.0; N]; system.size()]);
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
            slopes: Vec::with_capacity(times.len() * mechanism.outputs.len() * N),
        };
        companion.sample()?;
        Ok(companion)
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
        self.step.new.take_values(values);
        let (position, _) = scheme.seeds(*h);
        self.system.residual(self.mechanism, &self.step.new, 1.0 / position, &mut self.room, &mut self.rows);
        self.changes.iter_mut().zip(&self.rows).for_each(|(change, row)| *change = row.eps.map(|x| -x));
        factor.solve_in(&mut self.changes, &mut self.solve_room);
        let change = |equation: usize| Tangent { re: 0.0, eps: self.changes[equation] };
        self.step.correct(&self.system, scheme, *h, change);
    }

    /// Outputs at the times that the step has reached.
    fn sample(&mut self) -> Result<()> {
        while let Some(&t) = self.times.get(self.passed) {
            if is_before(self.settings.start, self.step.new.t, t) {
                break;
            }
            interpolate(&self.step.old, &self.step.new, t, &mut self.at);
            self.sampler.outputs(self.mechanism, &self.at, &mut self.outputs);
            check_finite(self.mechanism, &self.outputs, t)?;
            self.slopes.extend(self.outputs.iter().flat_map(|output| output.eps));
            self.passed += 1;
        }
        Ok(())
    }
}

impl<const N: usize> Follow for Companion<'_, N>
where
    Tangent<N>: Real,
    Jet<Tangent<N>>: Number,
{
    fn follow(&mut self, stretch: &Stretch) -> Result<()> {
        stretch.taken().iter().try_for_each(|taken| {
            self.take(taken);
            self.sample()
        })
    }
}
