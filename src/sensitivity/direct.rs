//! Direct differentiation of a dynamic analysis.

use crate::analysis::dynamics::{Dynamics, InitialAcceleration, Run, Work, check_finite};
use crate::analysis::generalized_alpha::Step;
use crate::analysis::sampling::{Sampler, interpolate};
use crate::analysis::start::{Projection, acceleration_rows};
use crate::analysis::system::{Linearization, System, Unknown};
use crate::analysis::{Integrator, State};
use crate::multibody::element::Room;
use crate::multibody::{Jet, Mechanism, Model, Sensitive};
use crate::scalar::WIDTH;
use crate::{Error, Result};

/// Outputs over time with their derivatives.
#[derive(Clone, Debug, PartialEq)]
pub struct SensitiveHistory {
    /// Names of the outputs.
    pub names: Vec<String>,
    /// Times in s.
    pub times: Vec<f64>,
    /// One series per output, one value per time.
    pub values: Vec<Vec<f64>>,
    /// `slopes[output][time]` is the gradient with respect to the design variables.
    pub slopes: Vec<Vec<Vec<f64>>>,
    /// Work of the analysis; the derivatives add one back-substitution per step and chunk of design variables.
    pub work: Work,
}

/// Simulates `model` at the design `b` and differentiates its outputs at `times` with respect to `b`.
///
/// The derivatives are those of the discrete solution. At a converged step, F(x₁, x₀, b) = 0, so
///
/// $$ \frac{\partial F}{\partial x_1}\frac{dx_1}{db} = -\frac{\partial F}{\partial x_0}\frac{dx_0}{db} - \frac{\partial F}{\partial b} $$
///
/// whose right-hand side is one evaluation of the residual in dual numbers, [`WIDTH`] design variables at a time,
/// and whose matrix is factorized already: it is the last one of Newton's iteration.
///
/// **Errors.** As [`crate::analysis::simulate`], and [`Error::Definition`] if the model makes another mechanism in
/// dual numbers than in `f64`.
///
/// **Source.** Haug, Wehage & Mani, *J. Mech. Trans. Autom. Des.* 106 (1984) 156–162, for the method; the paper's
/// equations (22) to (25).
pub fn differentiate<M: Model>(model: &M, b: &[f64], settings: &Dynamics, times: &[f64]) -> Result<SensitiveHistory> {
    let mechanism = model.build(b)?;
    let chunks: Vec<usize> = (0..b.len()).step_by(WIDTH).collect();
    let sensitive = chunks.iter().map(|&first| build_sensitive(model, b, first, &mechanism));
    let sensitive = sensitive.collect::<Result<Vec<_>>>()?;
    let mut run = Run::new(&mechanism, settings, times)?;
    let mut companions = Vec::with_capacity(chunks.len());
    for mechanism in &sensitive {
        companions.push(Companion::start(mechanism, &mut run, settings.initial)?);
    }
    let mut record = Record::new(&mechanism, b.len(), times);
    for (k, &t) in times.iter().enumerate() {
        while run.lags(t) {
            let h = run.advance()?;
            companions.iter_mut().for_each(|companion| companion.follow(&mut run.integrator, h));
        }
        for (companion, &first) in companions.iter_mut().zip(&chunks) {
            companion.sample(t)?;
            record.slopes(k, first, &companion.outputs);
        }
        record.values(k, &mechanism, &run, t)?;
    }
    Ok(record.finish(run.work()))
}

/// The mechanism with the derivatives of the design variables `first .. first + WIDTH` seeded.
fn build_sensitive<M: Model>(
    model: &M,
    b: &[f64],
    first: usize,
    like: &Mechanism<f64>,
) -> Result<Mechanism<Sensitive>> {
    let seed = |(i, &value): (usize, &f64)| match i.checked_sub(first) {
        Some(k) if k < WIDTH => Sensitive::seeded(value, k),
        _ => Sensitive::constant(value),
    };
    let mechanism = model.build(&b.iter().enumerate().map(seed).collect::<Vec<_>>())?;
    if mechanism.same_topology(like) {
        return Ok(mechanism);
    }
    let why = "makes different elements for the same design in another number type";
    Err(Error::definition("model", why, "do not let the number type decide what is built"))
}

/// One chunk of derivatives that goes along with a running simulation.
struct Companion<'m> {
    mechanism: &'m Mechanism<Sensitive>,
    step: Step<Sensitive>,
    at: State<Sensitive>,
    room: Room<Sensitive>,
    rows: Vec<Sensitive>,
    changes: Vec<[f64; WIDTH]>,
    sampler: Sampler<Sensitive>,
    outputs: Vec<Sensitive>,
    started: bool,
}

impl<'m> Companion<'m> {
    /// Derivatives of the initial state.
    fn start(mechanism: &'m Mechanism<Sensitive>, run: &mut Run<'_>, initial: InitialAcceleration) -> Result<Self> {
        let values = run.integrator.step.new.clone();
        let mut state = State::built(mechanism, values.t);
        let zero = Sensitive::constant(0.0);
        let mut solver = StartSolver {
            plain: run.integrator.mechanism,
            mechanism,
            rows: vec![zero; run.integrator.system.size()],
            changes: vec![[0.0; WIDTH]; run.integrator.system.size()],
            system: &mut run.integrator.system,
        };
        if mechanism.multipliers > 0 {
            solver.positions(&values, &run.projection, &mut state)?;
            solver.velocities(&values, &run.projection, &mut state)?;
        }
        if initial == InitialAcceleration::Consistent {
            solver.accelerations(&values, &mut state)?;
        }
        let (rows, changes) = (solver.rows, solver.changes);
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

    /// Derivatives of the step `h` that `integrator` has just taken, with its factorization.
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
        let change = |equation: usize| Sensitive { re: 0.0, eps: changes[equation] };
        self.step.correct(system, &integrator.scheme, h, change);
    }

    fn sample(&mut self, t: f64) -> Result<()> {
        interpolate(&self.step.old, &self.step.new, t, &mut self.at);
        self.sampler.outputs(self.mechanism, &self.at, &mut self.outputs);
        check_finite(self.mechanism, &self.outputs, t)
    }
}

/// Values with no derivatives.
fn set_values(to: &mut [Sensitive], from: &[f64]) {
    to.iter_mut().zip(from).for_each(|(to, &from)| *to = Sensitive::constant(from));
}

impl State<Sensitive> {
    /// Takes over the values and keeps the derivatives.
    fn take_values(&mut self, values: &State<f64>) {
        self.t = values.t;
        for (to, from) in
            [(&mut self.q, &values.q), (&mut self.v, &values.v), (&mut self.a, &values.a), (&mut self.l, &values.l)]
        {
            to.iter_mut().zip(from).for_each(|(to, &from)| to.re = from);
        }
    }
}

/// Differentiates the initial state: each of its three problems has a matrix and a residual.
struct StartSolver<'s, 'm> {
    plain: &'s Mechanism<f64>,
    mechanism: &'m Mechanism<Sensitive>,
    system: &'s mut System,
    rows: Vec<Sensitive>,
    changes: Vec<[f64; WIDTH]>,
}

impl StartSolver<'_, '_> {
    /// q − q_guess + Φ_qᵀ μ = 0, Φ = 0.
    fn positions(&mut self, values: &State<f64>, projection: &Projection, state: &mut State<Sensitive>) -> Result<()> {
        let mut at = values.clone();
        at.l.copy_from_slice(&projection.position);
        // At fixed unknowns: coordinates carry only the derivatives of prescribed ones.
        let guess = state.q.clone();
        self.hold(values, state, |state| &mut state.q);
        set_values(&mut state.l, &projection.position);
        self.system.constraint_rows(self.mechanism, state, &mut Room::default(), &mut self.rows);
        for (row, unknown) in self.rows.iter_mut().zip(self.system.unknowns()) {
            if let Unknown::Coordinate(i) = *unknown {
                *row += state.q[i] - guess[i];
            }
        }
        self.solve(&at, Linearization::projection())?;
        self.add_changes(|state| &mut state.q, state);
        set_values(&mut state.l, &values.l);
        Ok(())
    }

    /// v − v_guess + Φ_qᵀ μ = 0, Φ̇ = 0.
    fn velocities(&mut self, values: &State<f64>, projection: &Projection, state: &mut State<Sensitive>) -> Result<()> {
        let guess = state.v.clone();
        self.hold(values, state, |state| &mut state.v);
        set_values(&mut state.l, &projection.velocity);
        self.system.constraint_rows(self.mechanism, state, &mut Room::default(), &mut self.rows);
        for (row, unknown) in self.rows.iter_mut().zip(self.system.unknowns()) {
            if let Unknown::Coordinate(i) = *unknown {
                *row += state.v[i] - guess[i];
            }
        }
        self.system.closure_rates(self.mechanism, state, 1, &mut Room::<Jet<Sensitive>>::default(), &mut self.rows);
        let mut at = values.clone();
        at.l.fill(0.0); // Φ̇ is linear in v: its matrix is Φ_q, the rest is the identity
        self.solve(&at, Linearization::projection())?;
        self.add_changes(|state| &mut state.v, state);
        set_values(&mut state.l, &values.l);
        Ok(())
    }

    /// M q̈ + Φ_qᵀ λ = f, Φ̈ = 0.
    fn accelerations(&mut self, values: &State<f64>, state: &mut State<Sensitive>) -> Result<()> {
        self.hold(values, state, |state| &mut state.a);
        set_values(&mut state.l, &values.l);
        let (mut room, mut jets) = (Room::default(), Room::<Jet<Sensitive>>::default());
        acceleration_rows(self.system, self.mechanism, state, &mut room, &mut jets, &mut self.rows);
        let mut at = values.clone();
        at.l.fill(0.0);
        self.solve(&at, Linearization::accelerations())?;
        self.add_changes(|state| &mut state.a, state);
        for m in 0..state.l.len() {
            state.l[m].eps = self.changes[self.system.equation_of_multiplier(m)];
        }
        Ok(())
    }

    /// Gives the free coordinates their converged values without derivatives.
    fn hold(
        &self,
        values: &State<f64>,
        state: &mut State<Sensitive>,
        which: impl Fn(&mut State<Sensitive>) -> &mut Vec<Sensitive>,
    ) {
        let mut kept = which(state).clone();
        state.take_values(values);
        for (i, x) in kept.iter_mut().enumerate() {
            x.re = which(state)[i].re;
            if self.system.equation_of(i).is_some() {
                x.eps = [0.0; WIDTH];
            }
        }
        *which(state) = kept;
    }

    fn solve(&mut self, at: &State<f64>, how: Linearization) -> Result<()> {
        let mut scratch = vec![[0.0]; self.system.size()];
        self.system.assemble(self.plain, at, how, &mut scratch);
        self.system.factorize(self.plain, at.t)?;
        self.changes.iter_mut().zip(&self.rows).for_each(|(change, row)| *change = row.eps.map(|x| -x));
        self.system.factor().solve(&mut self.changes);
        Ok(())
    }

    fn add_changes(&self, which: impl Fn(&mut State<Sensitive>) -> &mut Vec<Sensitive>, state: &mut State<Sensitive>) {
        for (change, unknown) in self.changes.iter().zip(self.system.unknowns()) {
            if let Unknown::Coordinate(i) = *unknown {
                which(state)[i].eps = *change;
            }
        }
    }
}

/// Collects values and slopes time by time.
struct Record {
    history: SensitiveHistory,
    sampler: Sampler<f64>,
    outputs: Vec<f64>,
    at: Option<State<f64>>,
}

impl Record {
    fn new(mechanism: &Mechanism<f64>, variables: usize, times: &[f64]) -> Self {
        let count = mechanism.outputs.len();
        let history = SensitiveHistory {
            names: mechanism.output_names(),
            times: times.to_vec(),
            values: vec![vec![0.0; times.len()]; count],
            slopes: vec![vec![vec![0.0; variables]; times.len()]; count],
            work: Work::default(),
        };
        Self { history, sampler: Sampler::new(mechanism), outputs: Vec::new(), at: None }
    }

    fn slopes(&mut self, time: usize, first: usize, outputs: &[Sensitive]) {
        for (series, output) in self.history.slopes.iter_mut().zip(outputs) {
            let slopes = &mut series[time][first..];
            slopes.iter_mut().zip(output.eps).for_each(|(slope, value)| *slope = value);
        }
    }

    /// Values in `f64`, the same bits as a plain simulation.
    fn values(&mut self, time: usize, mechanism: &Mechanism<f64>, run: &Run<'_>, t: f64) -> Result<()> {
        let step = &run.integrator.step;
        let at = self.at.get_or_insert_with(|| step.new.clone());
        interpolate(&step.old, &step.new, t, at);
        self.sampler.outputs(mechanism, at, &mut self.outputs);
        check_finite(mechanism, &self.outputs, t)?;
        for (series, &value) in self.history.values.iter_mut().zip(&self.outputs) {
            series[time] = value;
        }
        Ok(())
    }

    fn finish(self, work: Work) -> SensitiveHistory {
        SensitiveHistory { work, ..self.history }
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
