//! A constrained mechanism as a system of first-order equations, and its events along the steps.

pub use crate::integrators::explicit::tableau::SAMPLE;

use crate::constraint_rank::singular_position;
use crate::diagnostics::not_finite;
use crate::elements::element::{ElementState, ElementWorkspace, SwitchSides};
use crate::events::mode_transition::{assemble_closed, set_initial_modes};
use crate::initial_conditions::{Projection, assemble, make_velocities_consistent};
use crate::integrators::event_location::{EventLocator, StepBeforeSwitch, TrialStep};
use crate::integrators::explicit::constraint_drift::ConstraintDrift;
use crate::integrators::explicit::ode_driver::OdeDriver;
use crate::integrators::explicit::relative::{RelativeRhs, relative_tree};
use crate::integrators::explicit::settings::{Coordinates, Explicit, StepControl};
use crate::integrators::explicit::stepper::{OdeRhs, Stepper};
use crate::integrators::inspection::{InspectionTimes, breaks};
use crate::integrators::prescribed_jumps::{StepKind, refuse_position_jumps, refuse_velocity_jumps};
use crate::integrators::settings::StepSize;
use crate::linalg::factor::Factor;
use crate::mechanism::scalars::{Jet2, StateScalar};
use crate::mechanism::{Mechanism, refuse_switches};
use crate::system::linearization::Linearization;
use crate::system::state::{State, gather};
use crate::system::{System, Unknown};
use crate::{Error, Result, reaction_loads};
use error::Seconds;
use std::sync::Arc;

/// A mechanism as a system of first-order equations: all positions, followed by all velocities.
///
/// Accelerations and multipliers come from the saddle-point system
///
/// $$ \begin{bmatrix} M & \Phi_q^T \\ \Phi_q & 0 \end{bmatrix} \begin{bmatrix} \ddot q \\ \lambda \end{bmatrix} =
///    \begin{bmatrix} f \\ -\dot\Phi_q \dot q - \dots \end{bmatrix} $$
///
/// whose pattern is analysed once, by Newton's method if forces depend on multipliers (friction in joints). At the end of a step,
/// positions and velocities are projected onto Φ = 0 and Φ̇ = 0 by one least-squares step each, with one factorization.
/// Components of prescribed coordinates are not used.
///
/// In [relative coordinates](crate::integrators::explicit::Coordinates) the components are the joint coordinates, followed by
/// their velocities. The state has accelerations and multipliers only after evaluations for outputs.
///
/// # Sources
///
/// Hairer & Wanner, *Solving Ordinary Differential Equations II*, 2nd ed. (1996), Sections VII.1 and VII.2.
pub struct MechanismRhs<'m> {
    /// The mechanism.
    pub mechanism: &'m Mechanism<f64>,
    /// Equations of motion.
    pub system: System,
    /// State of the last evaluation, including accelerations and multipliers.
    pub state: State<f64>,
    /// Record of the current step, for motions that are differentiated.
    pub record: Option<StepRecord>,
    /// Violation of the constraints so far.
    pub drift: ConstraintDrift,
    /// Events of the motion, for a mechanism with events.
    pub(crate) locator: Option<EventLocator>,
    /// Ends of the current step, for a mechanism with events.
    pub(crate) step_ends: Option<StepEnds>,
    /// Equations of motion in relative coordinates, if these are the unknowns.
    pub(crate) relative: Option<Box<RelativeRhs>>,
    /// Multipliers without effect in the last consistent position, if constraints are redundant: they are excluded from solutions.
    without_effect: Arc<[Vec<f64>]>,
    rows: Vec<[f64; 1]>,
    jets: ElementWorkspace<Jet2<f64>>,
    /// Elements with switching functions.
    switching: Vec<usize>,
    /// For each switching function, true if forces have a power of it that is not an integer.
    fractional_powers: Vec<bool>,
    workspace: ElementWorkspace<f64>,
}

/// States at both ends of the current explicit step of a mechanism with events.
#[derive(Clone)]
pub(crate) struct StepEnds {
    /// States with accelerations and multipliers: after an event at the beginning, and before one at the end.
    pub states: [State<f64>; 2],
    /// Length of the step in s.
    pub length: f64,
    /// Slot of the evaluation at the end.
    end: usize,
}

impl StepEnds {
    /// The initial `state` of a motion by steps whose ends are evaluated in the slot `end`.
    pub fn new(state: &State<f64>, end: usize) -> Self {
        Self { states: [state.clone(), state.clone()], length: 0.0, end }
    }

    /// Stores the state that was evaluated in `slot`, if it is one of the ends.
    pub fn store(&mut self, slot: usize, state: &State<f64>) {
        match slot {
            0 => self.states[0].copy_from(state),
            _ if slot == self.end => self.states[1].copy_from(state),
            _ => {}
        }
    }
}

/// States and factorizations of one step, for its derivatives.
pub struct StepRecord {
    /// One evaluation per slot; the last one is for outputs.
    pub stages: Vec<StageRecord>,
    /// The projections at the end of the step.
    pub projected: Projected,
}

/// One evaluation of accelerations.
pub struct StageRecord {
    /// The state with its accelerations and multipliers.
    pub state: State<f64>,
    /// The factorized saddle-point matrix.
    pub factor: Factor,
}

/// The projections at the end of a step.
pub struct Projected {
    /// Positions and velocities before the projections. The accelerations store the position correction δ, the
    /// multipliers μ.
    pub before: State<f64>,
    /// Projected positions, and velocities before their projection. The accelerations store the velocity correction ε, the
    /// multipliers ν.
    pub after: State<f64>,
    /// Factor of \[I Φ_qᵀ; Φ_q 0\] before the projections.
    pub factor: Factor,
}

impl StepRecord {
    /// Record for the steps of a mechanism, of the size of `state`.
    pub fn new(system: &mut System, state: &State<f64>) -> Self {
        let mut stage = || StageRecord { state: state.clone(), factor: system.factor().clone() };
        let stages = (0..=SAMPLE).map(|_| stage()).collect();
        let projected = Projected { before: state.clone(), after: state.clone(), factor: system.factor().clone() };
        Self { stages, projected }
    }
}

impl<'m> MechanismRhs<'m> {
    /// Right-hand side, from the consistent initial state `state`.
    pub fn new(mechanism: &'m Mechanism<f64>, system: System, state: State<f64>) -> Self {
        let rows = vec![[0.0]; system.size()];
        let (jets, workspace) = (ElementWorkspace::default(), ElementWorkspace::default());
        let elements = &mechanism.elements;
        let switching: Vec<_> = (0..elements.len()).filter(|&k| elements[k].sides.is_some()).collect();
        let kinds = |&k: &usize| {
            let element = &elements[k].element;
            let fractional = element.num_fractional_powers();
            (0..element.num_switching_functions()).map(move |function| function < fractional)
        };
        let fractional_powers = switching.iter().flat_map(kinds).collect();
        Self {
            mechanism,
            system,
            state,
            record: None,
            drift: ConstraintDrift::default(),
            locator: None,
            step_ends: None,
            relative: None,
            without_effect: Arc::default(),
            rows,
            jets,
            switching,
            fractional_powers,
            workspace,
        }
    }

    /// Appends the switching functions of element number `k` at the current state.
    fn add_switching_functions(&mut self, k: usize, out: &mut Vec<f64>) {
        let instance = &self.mechanism.elements[k];
        gather(instance, &self.state, &mut self.workspace);
        let local = self.workspace.local(self.state.t);
        let local = ElementState { p: &instance.parameters, sides: SwitchSides::default(), ..local };
        f64::switching_functions(instance.element.as_ref(), &local, out);
    }

    /// Positions and velocities of `state` as one vector.
    pub fn vector(state: &State<f64>) -> Vec<f64> {
        state.q.iter().chain(&state.v).copied().collect()
    }

    /// The unknowns: absolute or relative coordinates.
    pub fn coordinates(&self) -> Coordinates {
        if self.relative.is_some() { Coordinates::Relative } else { Coordinates::Absolute }
    }

    /// The state of all coordinates at the time `t` (s) with the components `y`, without accelerations and multipliers.
    pub(crate) fn state_of(&self, t: f64, y: &[f64]) -> State<f64> {
        let mut state = State { t, ..self.state.clone() };
        match &self.relative {
            Some(relative) => relative.dynamics.clone().place(self.mechanism, t, y, &mut state),
            None => {
                let (q, v) = y.split_at(state.q.len());
                state.q.copy_from_slice(q);
                state.v.copy_from_slice(v);
                state.prescribe(self.mechanism);
            }
        }
        state
    }

    /// Sets time, positions and velocities.
    fn set_state(&mut self, t: f64, y: &[f64]) {
        if let Some(relative) = &mut self.relative {
            return relative.dynamics.place(self.mechanism, t, y, &mut self.state);
        }
        let n = self.state.q.len();
        self.state.t = t;
        self.state.q.copy_from_slice(&y[..n]);
        self.state.v.copy_from_slice(&y[n..]);
        self.state.a.fill(0.0);
        self.state.l.fill(0.0);
        self.state.prescribe(self.mechanism);
    }

    /// Solves for accelerations and multipliers.
    fn solve_accelerations(&mut self) -> Result<()> {
        self.system.assemble(self.mechanism, &self.state, Linearization::accelerations(), &mut self.rows);
        self.system.constraint_rates(self.mechanism, &self.state, 2, &mut self.jets, self.rows.as_flattened_mut());
        if self.rows.iter().any(|row| !row[0].is_finite()) {
            return Err(self.non_finite_error());
        }
        let load = self.system.largest_coordinate_row(&self.rows);
        self.system.factor().exclude(&self.without_effect);
        self.system.factorize(self.mechanism, self.state.t)?;
        self.system.factor().solve(&mut self.rows);
        self.system.set_accelerations(&self.rows, &mut self.state);
        if self.mechanism.has_reactions_as_loads() {
            let (system, rows) = (&mut self.system, (&mut self.rows[..], load));
            reaction_loads::iterate(system, self.mechanism, &mut self.state, rows, &mut self.jets)?;
        }
        Ok(())
    }

    /// Finds the multipliers without effect in the consistent state `y` at the time `t` (s).
    ///
    /// Forces that depend on reactions need multipliers of least norm at each stage, which exclusions of another position do not give.
    fn find_multipliers_without_effect(&mut self, t: f64, y: &[f64]) -> Result<()> {
        self.without_effect = Arc::default();
        let is_needed = self.system.allows_redundancy() && !self.mechanism.has_reactions_as_loads();
        if self.relative.is_some() || !is_needed {
            return Ok(());
        }
        self.set_state(t, y);
        self.system.assemble(self.mechanism, &self.state, Linearization::accelerations(), &mut self.rows);
        self.system.factor().exclude(&self.without_effect);
        self.system.factorize(self.mechanism, t)?;
        self.without_effect = self.system.factor().null_space();
        Ok(())
    }

    /// The error of a system that is not finite at the current state.
    fn non_finite_error(&self) -> Error {
        not_finite(self.mechanism, &self.state).unwrap_or_else(|| {
            let why = format!("its rates are not finite at t = {}", Seconds(self.state.t));
            Error::analysis(
                self.system.dominant_residual(self.mechanism, &self.rows),
                why,
                "use shorter steps or, with adaptive ones, a smaller tolerance",
            )
        })
    }

    /// Corrects positions (`order` 0) or velocities (`order` 1) with the factor of the projection.
    fn correct(&mut self, order: usize) {
        if order == 1 {
            self.rows.fill([0.0]);
            self.system.constraint_rates(self.mechanism, &self.state, 1, &mut self.jets, self.rows.as_flattened_mut());
        }
        self.system.factor().solve(&mut self.rows);
        if let Some(record) = &mut self.record {
            let projected = &mut record.projected;
            let to = if order == 0 { &mut projected.before } else { &mut projected.after };
            to.copy_from(&self.state);
            to.a.fill(0.0); // a prescribed coordinate is not corrected, although it may accelerate
            self.system.set_accelerations(&self.rows, to);
        }
        let values = if order == 0 { &mut self.state.q } else { &mut self.state.v };
        for (unknown, change) in self.system.unknowns().iter().zip(&self.rows) {
            if let Unknown::Coordinate(i) = *unknown {
                values[i] -= change[0];
            }
        }
    }
}

impl MechanismRhs<'_> {
    /// Largest |Φ| (`order` 0) or |Φ̇| (`order` 1) at the current state.
    fn violation(&mut self, order: usize) -> f64 {
        self.rows.fill([0.0]);
        let rows = self.rows.as_flattened_mut();
        self.system.constraint_rates(self.mechanism, &self.state, order, &mut self.jets, rows);
        rows.iter().fold(0.0, |largest: f64, row| largest.max(row.abs()))
    }
}

impl OdeRhs for MechanismRhs<'_> {
    fn size(&self) -> usize {
        2 * self.relative.as_ref().map_or(self.state.q.len(), |relative| relative.dynamics.tree.count)
    }

    fn rates(&mut self, slot: usize, t: f64, y: &[f64], k: &mut [f64]) -> Result<()> {
        if let Some(relative) = &mut self.relative {
            return relative.rates(self.mechanism, slot, (t, y), &mut self.state, k);
        }
        if slot == SAMPLE {
            self.find_multipliers_without_effect(t, y)?;
        }
        self.set_state(t, y);
        self.solve_accelerations()?;
        let n = self.state.q.len();
        k.fill(0.0);
        for unknown in self.system.unknowns() {
            if let Unknown::Coordinate(i) = *unknown {
                (k[i], k[n + i]) = (self.state.v[i], self.state.a[i]);
            }
        }
        if let Some(record) = &mut self.record {
            let stage = &mut record.stages[slot];
            stage.state.copy_from(&self.state);
            std::mem::swap(&mut stage.factor, self.system.factor());
        }
        if let Some(ends) = &mut self.step_ends {
            ends.store(slot, &self.state);
        }
        Ok(())
    }

    fn begin_step(&mut self, t: f64, y: &[f64]) -> Result<()> {
        self.find_multipliers_without_effect(t, y)
    }

    fn project(&mut self, t: f64, y: &mut [f64]) -> Result<()> {
        self.mechanism.tick(t);
        if let Some(relative) = &mut self.relative {
            return relative.project(self.mechanism, t, y, &mut self.state, &mut self.drift);
        }
        if self.mechanism.multipliers == 0 {
            return Ok(());
        }
        self.set_state(t, y);
        self.system.assemble(self.mechanism, &self.state, Linearization::projection(), &mut self.rows);
        if self.rows.iter().any(|row| !row[0].is_finite()) {
            return Err(self.non_finite_error());
        }
        self.system.factor().exclude(&self.without_effect);
        self.system.factorize(self.mechanism, t)?;
        self.correct(0);
        self.correct(1);
        let violations = [0, 1].map(|order| self.violation(order));
        self.drift.set_trial(t, violations, [&self.state.q, &self.state.v]);
        let n = self.state.q.len();
        y[..n].copy_from_slice(&self.state.q);
        y[n..].copy_from_slice(&self.state.v);
        if let Some(record) = &mut self.record {
            std::mem::swap(&mut record.projected.factor, self.system.factor());
        }
        self.find_multipliers_without_effect(t, y)
    }

    fn switching_functions(&mut self, t: f64, y: &[f64], out: &mut Vec<f64>) {
        out.clear();
        if self.switching.is_empty() {
            return;
        }
        self.set_state(t, y);
        for k in 0..self.switching.len() {
            self.add_switching_functions(self.switching[k], out);
        }
    }

    fn has_fractional_power(&self, k: usize) -> bool {
        self.fractional_powers.get(k).is_some_and(|is_fractional| *is_fractional)
    }

    fn hold_sides(&mut self, mut sides: &[bool]) {
        for &k in &self.switching {
            let instance = &self.mechanism.elements[k];
            let count = instance.element.num_switching_functions();
            let Some((these, others)) = sides.split_at_checked(count) else { return };
            self.state.modes.set_sides(instance, SwitchSides::held(these));
            sides = others;
        }
    }

    fn accept(&mut self) {
        self.drift.accept();
    }

    fn breaks(&self) -> Vec<f64> {
        breaks(self.mechanism)
    }

    fn end_at_event(stepper: &mut Stepper<Self>, times: &InspectionTimes) -> Result<()> {
        let (rhs, t) = (&stepper.rhs, stepper.t);
        let state = || rhs.state_of(t[1], &stepper.new);
        refuse_position_jumps(&rhs.system, rhs.mechanism, t, state)?;
        refuse_velocity_jumps(&rhs.system, rhs.mechanism, t, StepKind::Explicit, state)?;
        end_at_event(stepper, times)
    }

    fn begin_after_event(stepper: &mut Stepper<Self>) -> Result<bool> {
        begin_after_event(stepper)
    }

    fn has_ended(&self) -> bool {
        let is_end = |(locator, ends): (&EventLocator, &StepEnds)| {
            locator.has_ended(&self.system, self.mechanism, &ends.states[1], ends.length)
        };
        self.locator.as_ref().zip(self.step_ends.as_ref()).is_some_and(is_end)
    }

    fn may_end(&self) -> bool {
        self.mechanism.may_end()
    }

    fn name(&self, component: usize) -> String {
        let n = self.size() / 2;
        let what = if component < n { "position" } else { "velocity" };
        let name = match &self.relative {
            Some(relative) => &relative.dynamics.tree.names[component % n],
            None => &self.mechanism.coordinates[component % n].name,
        };
        format!("{name} ({what})")
    }

    fn diagnose(&mut self, t: f64, y: &[f64]) -> Option<Error> {
        if self.relative.as_ref().is_some_and(|relative| relative.dynamics.tree.cuts.is_empty()) {
            return None; // there are no constraints
        }
        self.set_state(t, y);
        singular_position(&self.system, self.mechanism, &self.state)
    }
}

/// Fractions of a step at which a contact may be closed, or a condition hold, for less than the step.
const FRACTIONS: [f64; 3] = [0.25, 0.5, 0.75];

/// A completed explicit step that is repeated with other lengths.
struct Repeated<'s, 'm> {
    stepper: &'s mut Stepper<MechanismRhs<'m>>,
}

impl TrialStep for Repeated<'_, '_> {
    type Solution = f64;

    fn mechanism(&self) -> &Mechanism<f64> {
        self.stepper.rhs.mechanism
    }

    fn system(&self) -> &System {
        &self.stepper.rhs.system
    }

    fn ends(&self) -> [&State<f64>; 2] {
        self.stepper.rhs.step_ends.as_ref().expect("a mechanism with events").states.each_ref()
    }

    fn solve(&mut self, h: f64) -> Result<()> {
        self.stepper.attempt(self.stepper.t[0] + h, None).map(|_| ())
    }

    fn solve_after(&mut self, _earlier: &StepBeforeSwitch, h: f64) -> Result<()> {
        self.solve(h)
    }

    fn solution(&self, h: f64) -> f64 {
        h
    }

    fn restore(&mut self, h: f64) -> Result<()> {
        self.solve(h)
    }
}

/// Shortens the completed step so that it ends at the first event in it, if there is one. The step may become a little longer
/// if a contact is almost closed at its end.
fn end_at_event(stepper: &mut Stepper<MechanismRhs<'_>>, times: &InspectionTimes) -> Result<()> {
    let Some(mut locator) = stepper.rhs.locator.take() else { return Ok(()) };
    let h = end_near_event(&locator, stepper, times)?;
    let length = locator.locate(&mut Repeated { stepper }, h)?;
    stepper.rhs.locator = Some(locator);
    stepper.rhs.step_ends.iter_mut().for_each(|ends| ends.length = length);
    Ok(())
}

/// Shortens the step if an event happens in it that the states at its ends do not show. Returns the length of the step in s.
///
/// The state is interpolated at a few fractions of the step. Forces of held parts, and reactions, are computed at the `times` inside it.
fn end_near_event(
    locator: &EventLocator,
    stepper: &mut Stepper<MechanismRhs<'_>>,
    times: &InspectionTimes,
) -> Result<f64> {
    let ([begin, end], mut y) = (stepper.t, stepper.new.clone());
    let states = stepper.rhs.step_ends.as_ref().map(|ends| &ends.states);
    let Some([old, new]) = states else { return Ok(end - begin) };
    let mut inside = new.clone();
    let is_closed = |fraction: &f64| {
        stepper.interpolate_coarsely(*fraction, &mut y);
        let (q, v) = y.split_at(inside.q.len());
        inside.t = begin + fraction * (end - begin);
        inside.q.copy_from_slice(q);
        inside.v.copy_from_slice(v);
        inside.prescribe(stepper.rhs.mechanism);
        locator.has_closed(stepper.rhs.mechanism, [old, &inside], fraction * (end - begin))
    };
    let coarse = FRACTIONS.into_iter().find(is_closed).map(|fraction| fraction * (end - begin));
    let old = old.clone();
    let fine = first_closed_at(locator, stepper, &old, times)?;
    let Some(h) = coarse.into_iter().chain(fine).min_by(f64::total_cmp) else { return Ok(end - begin) };
    stepper.attempt(begin + h, None)?;
    Ok(h)
}

/// Time in s from the beginning of the step, the state `old`, to the first of the `times` inside it before which an event has happened.
fn first_closed_at(
    locator: &EventLocator,
    stepper: &mut Stepper<MechanismRhs<'_>>,
    old: &State<f64>,
    times: &InspectionTimes,
) -> Result<Option<f64>> {
    let (begin, inside) = (stepper.t[0], times.inside(stepper.t));
    if inside.is_empty() {
        return Ok(None);
    }
    stepper.make_dense()?;
    let (mut y, mut rates) = (stepper.new.clone(), stepper.new.clone());
    for &t in inside {
        stepper.interpolate(t, &mut y);
        stepper.evaluations += 1;
        let is_solved = stepper.rhs.rates(SAMPLE, t, &y, &mut rates).is_ok();
        let MechanismRhs { mechanism, state, .. } = &stepper.rhs;
        if is_solved && locator.has_closed(mechanism, [old, state], t - begin) {
            return Ok(Some(t - begin));
        }
    }
    Ok(None)
}

/// Begins the next step after an event at the end of the last one, if there is one. Returns whether there is.
fn begin_after_event(stepper: &mut Stepper<MechanismRhs<'_>>) -> Result<bool> {
    let MechanismRhs { mechanism, system, state, locator, step_ends, .. } = &mut stepper.rhs;
    let (Some(locator), Some(ends)) = (locator, step_ends) else { return Ok(false) };
    let [begin, end] = &mut ends.states;
    let Some(after) = locator.apply(system, mechanism, end, ends.length)? else {
        begin.copy_from(end);
        return Ok(false);
    };
    let offset = locator.offset(mechanism, &after);
    state.modes.copy_from(&after.modes);
    stepper.restart(&MechanismRhs::vector(&after), offset)?;
    if let Some(ends) = &mut stepper.rhs.step_ends {
        ends.states[0].copy_from(&after);
    }
    Ok(true)
}

/// Assembles the mechanism and prepares its integration, with a record of each step if `recorded`.
pub(crate) fn start<'m>(
    mechanism: &'m Mechanism<f64>,
    settings: &Explicit,
    times: &[f64],
    recorded: bool,
) -> Result<(OdeDriver<MechanismRhs<'m>>, ConsistentState)> {
    settings.check(times)?;
    let why = "the stages of an explicit step that ends at a switch have forces of both sides of it";
    refuse_switches(&mechanism.events, why, "use implicit steps, or an event that activates the force")?;
    let mut system = System::at(mechanism, settings.start)?;
    let mut state = State::built(mechanism, settings.start);
    let mut projection = assemble(&mut system, mechanism, &mut state, settings.assembly)?;
    projection.velocity = make_velocities_consistent(&mut system, mechanism, &mut state)?;
    if set_initial_modes(&mut system, mechanism, &mut state)? {
        projection = assemble_closed(&mut system, mechanism, &mut state, settings.assembly)?;
    }
    state.l.fill(0.0);
    if let Some(mut tree) = relative_tree(mechanism, &system, settings)? {
        tree.choose_signs(mechanism, &state);
        if system.allows_redundancy() {
            tree.count_independent(mechanism, &state);
        }
        let (relative, y) = RelativeRhs::new(tree, mechanism, &system, &state, recorded);
        let mut rhs = MechanismRhs::new(mechanism, system, state.clone());
        rhs.relative = Some(Box::new(relative));
        return Ok((OdeDriver::new(rhs, settings, y, times)?, ConsistentState { state, projection }));
    }
    let y = MechanismRhs::vector(&state);
    let record = recorded.then(|| StepRecord::new(&mut system, &state));
    let mut rhs = MechanismRhs { record, ..MechanismRhs::new(mechanism, system, state.clone()) };
    if mechanism.has_events() {
        rhs.locator = Some(EventLocator::new(mechanism, &state, nominal_step(settings, times))?);
        rhs.step_ends = Some(StepEnds::new(&state, settings.method.end));
    }
    Ok((OdeDriver::new(rhs, settings, y, times)?, ConsistentState { state, projection }))
}

/// Nominal length of adaptive steps, with which the times between events are compared, as a fraction of the duration of the motion.
const NOMINAL: f64 = 1e-3;

/// The size of the steps that bounds the times between events.
fn nominal_step(settings: &Explicit, times: &[f64]) -> StepSize {
    StepSize::Fixed(match &settings.step_control {
        StepControl::Fixed(h) => *h,
        _ => NOMINAL * (settings.end_after(times) - settings.start),
    })
}

/// Consistent initial state and the multipliers of its projections.
pub struct ConsistentState {
    /// Initial state.
    pub state: State<f64>,
    /// Multipliers of the projections.
    pub projection: Projection,
}

/// Computes the state at the time `t` (s), including accelerations and multipliers. Returns whether dense
/// output was used. After the end of a motion it is the state at the end.
pub(crate) fn sample(driver: &mut OdeDriver<MechanismRhs<'_>>, y: &mut [f64], t: f64) -> Result<bool> {
    let t = if driver.stepper.rhs.has_ended() { t.min(driver.stepper.t[1]) } else { t };
    let dense = driver.sample(t, y)?;
    let mut rates = std::mem::take(&mut driver.scratch);
    rates.resize(y.len(), 0.0);
    driver.stepper.rhs.rates(SAMPLE, t, y, &mut rates)?;
    driver.stepper.evaluations += 1;
    driver.scratch = rates;
    Ok(dense)
}
