//! Direct differentiation of a dynamic analysis by implicit steps.

use super::record::{Record, SensitiveHistory};
use super::seeded::{build_sensitive, set_values};
use super::start::StartSolver;
use crate::Result;
use crate::analysis::dynamics::{Dynamics, InitialAcceleration, Run, check_finite};
use crate::analysis::generalized_alpha::Step;
use crate::analysis::sampling::{Sampler, interpolate};
use crate::analysis::{Integrator, Recording, State};
use crate::multibody::element::Room;
use crate::multibody::{Jet, Mechanism, Model, Number, Real};
use crate::scalar::{Tangent, WIDTH};

/// Simulates `model` at the design `b` and differentiates its outputs at `times` with respect to `b`.
///
/// The derivatives are those of the discrete solution. At a converged step, F(x₁, x₀, b) = 0, so
///
/// $$ \frac{\partial F}{\partial x_1}\frac{dx_1}{db} = -\frac{\partial F}{\partial x_0}\frac{dx_0}{db} - \frac{\partial F}{\partial b} $$
///
/// whose right-hand side is one evaluation of the residual in dual numbers, [`WIDTH`] design variables at a time,
/// and whose matrix is factorized once at the converged step; all design variables share it.
///
/// **Errors.** As [`crate::analysis::simulate`], and [`crate::Error::Definition`] if the model makes another mechanism in
/// dual numbers than in `f64`.
///
/// **Source.** Haug, Wehage & Mani, *J. Mech. Trans. Autom. Des.* 106 (1984) 156–162, for the method; the paper's
/// equations (22) to (25).
pub fn differentiate<M: Model>(model: &M, b: &[f64], settings: &Dynamics, times: &[f64]) -> Result<SensitiveHistory> {
    let mechanism = model.build(b)?;
    follow(model, b, Run::new(&mechanism, settings, times)?, settings.initial, times)
}

/// The same at the steps of a recording of `model` at `b` that reaches the last of `times`: nothing is iterated.
///
/// **Errors.** As [`differentiate`].
pub fn differentiate_recorded<M: Model>(
    model: &M,
    b: &[f64],
    settings: &Dynamics,
    times: &[f64],
    recording: &Recording,
) -> Result<SensitiveHistory> {
    let mechanism = model.build(b)?;
    follow(model, b, Run::replay(&mechanism, settings, times, recording)?, settings.initial, times)
}

/// In numbers that are not much wider than the design.
fn follow<M: Model>(
    model: &M,
    b: &[f64],
    run: Run<'_>,
    initial: InitialAcceleration,
    times: &[f64],
) -> Result<SensitiveHistory> {
    match b.len() {
        0..=4 => follow_in_chunks::<M, 4>(model, b, run, initial, times),
        _ => follow_in_chunks::<M, WIDTH>(model, b, run, initial, times),
    }
}

fn follow_in_chunks<M: Model, const N: usize>(
    model: &M,
    b: &[f64],
    mut run: Run<'_>,
    initial: InitialAcceleration,
    times: &[f64],
) -> Result<SensitiveHistory>
where
    Tangent<N>: Real,
    Jet<Tangent<N>>: Number,
{
    let mechanism = run.integrator.mechanism;
    let sensitive = build_sensitive::<M, N>(model, b, mechanism)?;
    let mut companions = Vec::with_capacity(sensitive.len());
    for chunk in &sensitive {
        companions.push(Companion::start(chunk, &mut run, initial)?);
    }
    let mut record = Record::new(mechanism, b.len(), times);
    let mut at = run.integrator.step.new.clone();
    for (k, &t) in times.iter().enumerate() {
        while run.lags(t) {
            let h = run.advance()?;
            run.integrator.linearize(h)?;
            companions.iter_mut().for_each(|companion| companion.follow(&mut run.integrator, h));
        }
        for (chunk, companion) in companions.iter_mut().enumerate() {
            companion.sample(t)?;
            record.slopes(k, chunk * N, &companion.outputs);
        }
        interpolate(&run.integrator.step.old, &run.integrator.step.new, t, &mut at);
        record.values(k, mechanism, &at)?;
    }
    Ok(record.finish(run.work()))
}

/// One chunk of derivatives that goes along with a running simulation.
struct Companion<'m, const N: usize> {
    mechanism: &'m Mechanism<Tangent<N>>,
    step: Step<Tangent<N>>,
    at: State<Tangent<N>>,
    room: Room<Tangent<N>>,
    rows: Vec<Tangent<N>>,
    changes: Vec<[f64; N]>,
    sampler: Sampler<Tangent<N>>,
    outputs: Vec<Tangent<N>>,
    started: bool,
}

impl<'m, const N: usize> Companion<'m, N>
where
    Tangent<N>: Real,
    Jet<Tangent<N>>: Number,
{
    /// Derivatives of the initial state.
    fn start(mechanism: &'m Mechanism<Tangent<N>>, run: &mut Run<'_>, initial: InitialAcceleration) -> Result<Self> {
        let values = run.integrator.step.new.clone();
        let mut state = State::built(mechanism, values.t);
        let mut solver = StartSolver::new(run.integrator.mechanism, mechanism, &mut run.integrator.system);
        if mechanism.multipliers > 0 {
            solver.positions(&values, &run.projection, &mut state)?;
            solver.velocities(&values, &run.projection, &mut state)?;
        }
        if initial == InitialAcceleration::Consistent {
            solver.accelerations(&values, &mut state)?;
        }
        let (rows, changes) = solver.into_room();
        Ok(Self {
            mechanism,
            at: state.clone(),
            step: Step::from(state),
            room: Room::default(),
            rows,
            changes,
            sampler: Sampler::new(mechanism),
            outputs: Vec::new(),
            started: false,
        })
    }

    /// Derivatives of the step `h` that `integrator` has just taken and linearized.
    fn follow(&mut self, integrator: &mut Integrator<'_>, h: f64) {
        if self.started {
            self.step.accept();
        }
        self.started = true;
        let values = &integrator.step.new;
        set_values(&mut self.step.new.a, &values.a);
        set_values(&mut self.step.new.l, &values.l);
        self.step.march(self.mechanism, &integrator.scheme, integrator.prescribed, h);
        self.step.new.take_values(values);
        let (position, _) = integrator.scheme.seeds(h);
        let system = &mut integrator.system;
        system.residual(self.mechanism, &self.step.new, 1.0 / position, &mut self.room, &mut self.rows);
        self.changes.iter_mut().zip(&self.rows).for_each(|(change, row)| *change = row.eps.map(|x| -x));
        system.factor().solve(&mut self.changes);
        let changes = &self.changes;
        let change = |equation: usize| Tangent { re: 0.0, eps: changes[equation] };
        self.step.correct(system, &integrator.scheme, h, change);
    }

    fn sample(&mut self, t: f64) -> Result<()> {
        interpolate(&self.step.old, &self.step.new, t, &mut self.at);
        self.sampler.outputs(self.mechanism, &self.at, &mut self.outputs);
        check_finite(self.mechanism, &self.outputs, t)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::multibody::mechanisms::FourBar;

    /// Central differences of plain simulations, Richardson-extrapolated.
    fn richardson(b: &[f64; 3], k: usize, h: f64) -> Vec<Vec<f64>> {
        let model = FourBar::as_published();
        let run = |step: f64| {
            let mut moved = *b;
            moved[k] += step;
            let mechanism = model.build(&moved).unwrap();
            crate::analysis::simulate(&mechanism, &model.dynamics().unwrap(), &FourBar::window()).unwrap().values
        };
        let (far, near) = ([run(h), run(-h)], [run(h / 2.0), run(-h / 2.0)]);
        let slope = |o: usize, t: usize| {
            let coarse = (far[0][o][t] - far[1][o][t]) / (2.0 * h);
            let fine = (near[0][o][t] - near[1][o][t]) / h;
            (4.0 * fine - coarse) / 3.0
        };
        (0..21).map(|o| (0..201).map(|t| slope(o, t)).collect()).collect()
    }

    #[test]
    fn moments_of_the_four_bar_agree_with_differences() {
        let (model, b) = (FourBar::as_published(), [0.0385, 0.0252, 0.02]);
        let history = differentiate(&model, &b, &model.dynamics().unwrap(), &FourBar::window()).unwrap();
        let plain =
            crate::analysis::simulate(&model.build(&b).unwrap(), &model.dynamics().unwrap(), &FourBar::window())
                .unwrap();
        assert_eq!(history.values, plain.values);
        for k in 0..3 {
            let differences = richardson(&b, k, 1e-4 * b[k]);
            let (mut worst, mut largest) = (0.0f64, 0.0f64);
            for (series, differences) in history.slopes.iter().zip(&differences) {
                for (slopes, difference) in series.iter().zip(differences) {
                    worst = worst.max((slopes[k] - difference).abs());
                    largest = largest.max(difference.abs());
                }
            }
            assert!(worst < 3e-7 * largest, "variable {k}: {worst:.2e} of {largest:.2e}");
        }
    }
}
