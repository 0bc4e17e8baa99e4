//! Generalized-α and HHT-α steps on the index-3 equations of motion.

use crate::constraint_rank::singular_position;
use crate::elements::element::ElementWorkspace;
use crate::initial_conditions::{CONTRADICTION, check_contradictions};
use crate::integrators::consistent_ends::ConsistentEnds;
use crate::integrators::predictor::Predictor;
use crate::integrators::prescribed_jumps::refuse_position_jumps;
use crate::mechanism::Mechanism;
use crate::mechanism::scalars::StateScalar;
use crate::reaction_loads::ReactionChange;
use crate::system::linearization::Linearization;
use crate::system::state::State;
use crate::system::{System, Unknown};
use crate::{Error, Result, diagnostics};
use autodiff::Scalar;
use error::Seconds;
use std::ops::{Add, Mul};

/// Coefficients of a generalized-α method.
///
/// With the auxiliary acceleration w, the steps are
///
/// $$ (1-\alpha_m) w_1 + \alpha_m w_0 = (1-\alpha_f)\ddot q_1 + \alpha_f \ddot q_0 $$
/// $$ q_1 = q_0 + h\dot q_0 + h^2\left((\tfrac12-\beta) w_0 + \beta w_1\right),\qquad
///    \dot q_1 = \dot q_0 + h\left((1-\gamma) w_0 + \gamma w_1\right) $$
///
/// and the equations of motion and the constraints hold at the end of the step. For a constant mass matrix and
/// α_m = 0 this is the HHT-α method, M w₁ + (1−α) f(q₁) + α f(q₀) = 0.
///
/// **Steps of other lengths.** The auxiliary acceleration is that of another time, w(t) = q̈(t + (α_m − α_f) h) up to h². In a
/// step h that follows a longer one, w₀ − q̈₀ is therefore multiplied by the ratio of the lengths. The two steps
/// after an event, where the acceleration jumps, begin with w₀ = q̈₀ and are those of [`GeneralizedAlpha::without_history`].
/// Where steps are adaptive, the velocities are rescaled as well. Those of a steady motion violate the constraints Φ̇ = 0 by
/// (1/6 − β − (α_m − α_f)/2) h² times the third derivative of the motion along the constraints. A step of another length multiplies this
/// part of q̇₀ by the square of the ratio of the lengths. If it did not, each change of the length would cause errors of the
/// accelerations and reactions of the order h, which change their sign from step to step and decay with the spectral radius.
///
/// Without these rules, the steps around an event have errors of the velocities of the order h² that depend on the place of
/// the event between two times of the grid, and derivatives of second order do not converge.
///
/// # Sources
///
/// Arnold & Brüls, *Multibody Syst. Dyn.* 18 (2007) 185–202; Hilber, Hughes & Taylor, *Earthq. Eng.
/// Struct. Dyn.* 5 (1977) 283–292; Chung & Hulbert, *J. Appl. Mech.* 60 (1993) 371–375; for the time of w, Arnold, Brüls &
/// Cardona, *Numer. Math.* 129 (2015) 149–179.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GeneralizedAlpha {
    /// Weight of the old auxiliary acceleration.
    pub alpha_m: f64,
    /// Weight of the old acceleration.
    pub alpha_f: f64,
    /// Newmark's position coefficient.
    pub beta: f64,
    /// Newmark's velocity coefficient.
    pub gamma: f64,
}

impl GeneralizedAlpha {
    /// HHT-α with `alpha` from 0 (no numerical damping) to 1/3.
    pub fn hht(alpha: f64) -> Result<Self> {
        Error::check_option("HHT alpha", "from 0 to 1/3", alpha, (0.0..=1.0 / 3.0).contains(&alpha))?;
        Ok(Self::of(0.0, alpha))
    }

    /// Chung and Hulbert's method with the spectral radius `rho` at infinite frequency, from 0 to 1 (no numerical damping).
    pub fn chung_hulbert(rho: f64) -> Result<Self> {
        Error::check_option("spectral radius", "from 0 to 1", rho, (0.0..=1.0).contains(&rho))?;
        Ok(Self::of((2.0 * rho - 1.0) / (rho + 1.0), rho / (rho + 1.0)))
    }

    fn of(alpha_m: f64, alpha_f: f64) -> Self {
        let shift = alpha_f - alpha_m;
        Self { alpha_m, alpha_f, beta: (1.0 + shift).powi(2) / 4.0, gamma: 0.5 + shift }
    }

    /// The method of a step that begins with w₀ = q̈₀ after an event.
    ///
    /// It is Newmark's method with γ = ½ and β + (α_m − α_f)/2, to which a generalized-α step with
    /// w₀ = q̈₀ + (α_m − α_f)(q̈₁ − q̈₀) is equal.
    pub fn without_history(&self) -> Self {
        Self { alpha_m: 0.0, alpha_f: 0.0, beta: self.beta + 0.5 * self.lead(), gamma: 0.5 }
    }

    /// The method of the step that begins `steps` steps after an event.
    pub(crate) fn after_event(&self, steps: usize) -> Self {
        if steps < WITHOUT_HISTORY { self.without_history() } else { *self }
    }

    /// The time to which the auxiliary acceleration belongs, after that of the state, in steps.
    pub(crate) fn lead(&self) -> f64 {
        self.alpha_m - self.alpha_f
    }

    /// True if the spectral radius at infinite frequency is 1.
    ///
    /// Errors of the reactions of joints then change sign from step to step and do not decay. Singular positions amplify them.
    ///
    /// # Sources
    ///
    /// Cardona & Géradin, *Comput. Struct.* 33 (1989) 801–820.
    pub fn is_undamped(&self) -> bool {
        self.gamma <= 0.5
    }

    /// Derivative of the new auxiliary acceleration with respect to the new acceleration.
    pub(crate) fn ratio(&self) -> f64 {
        (1.0 - self.alpha_f) / (1.0 - self.alpha_m)
    }

    /// Weights of the old acceleration and the old auxiliary acceleration in the new auxiliary acceleration.
    pub(crate) fn history(&self) -> [f64; 2] {
        let share = 1.0 / (1.0 - self.alpha_m);
        [self.alpha_f * share, -(self.alpha_m * share)]
    }

    /// Derivatives of position (s²) and velocity (s) with respect to the new acceleration, in a step `h` (s).
    pub fn newmark_coefficients(&self, h: f64) -> (f64, f64) {
        (h * h * self.beta * self.ratio(), h * self.gamma * self.ratio())
    }
}

/// Source of the velocity and acceleration of a prescribed coordinate.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Prescribed {
    /// The derivatives of the motion.
    Exact,
    /// The integration formulas, from the positions at the steps.
    Newmark,
}

/// Settings of Newton's iteration in a step.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Newton {
    /// Largest position correction (m or rad) of the last iteration. A larger one suffices if the error that remains after it
    /// is estimated to be a millionth of the tolerance.
    pub tolerance: f64,
    /// Largest number of iterations.
    pub iterations: usize,
}

impl Default for Newton {
    fn default() -> Self {
        Self { tolerance: 1e-9, iterations: 12 }
    }
}

/// States at the two ends of a step, in any number type.
#[derive(Clone, Debug)]
pub struct Step<T> {
    /// Beginning of the step.
    pub old: State<T>,
    /// End of the step.
    pub new: State<T>,
    old_auxiliary: Vec<T>,
    new_auxiliary: Vec<T>,
    /// Lengths in s of the previous step, if there is one, and of this one.
    lengths: [Option<T>; 2],
    /// The part of the velocities at the beginning that violates the constraints, if the step rescales it.
    violation: Option<Vec<T>>,
    /// Numbers of steps since the last event at the two ends, up to [`WITHOUT_HISTORY`]; that number if there was no event.
    since_event: [usize; 2],
}

/// Number of steps after an event that begin without a history. The second one may be longer than the first one by any factor, by which a
/// history would be extrapolated.
pub(crate) const WITHOUT_HISTORY: usize = 2;

/// Relative difference below which the lengths of two steps count as equal.
const SAME_LENGTH: f64 = 1e-9;

/// Factor of the history in a step of the given `length` (s) after a `previous` one; `None` if it is 1.
///
/// It is the ratio of the lengths in a step that is shorter than the one before. Histories are not extrapolated to longer steps:
/// after a contact, that would amplify jumps of the acceleration.
pub(crate) fn history_factor<T: StateScalar>(length: T, previous: T) -> Option<T> {
    let ratio = length * previous.recip();
    (ratio.value() < 1.0 - SAME_LENGTH).then_some(ratio)
}

/// Largest ratio of the lengths of two steps for which velocities are rescaled. Lengths double at the start of a motion, where rescaling
/// would amplify rounding errors of the shortest steps; the first step after an event may be followed by one that is longer by any factor.
const LARGEST_RATIO: f64 = 1.5;

/// Change of the velocities that violate the constraints, as a fraction of them, in a step of the given `length` (s) after a `previous`
/// one; `None` if they do not change.
pub(crate) fn rescaling<T: StateScalar>(length: T, previous: T) -> Option<T> {
    let ratio = length * previous.recip();
    let is_other = (ratio.value() - 1.0).abs() > SAME_LENGTH && ratio.value() <= LARGEST_RATIO;
    is_other.then(|| ratio * ratio - T::from(1.0))
}

impl<T: StateScalar> Step<T> {
    /// A step that ends at the `start` of the motion.
    pub fn from(start: State<T>) -> Self {
        let (new, auxiliary) = (start.clone(), start.a.clone());
        let (lengths, since_event) = ([None, None], [WITHOUT_HISTORY; 2]);
        Self {
            new,
            old: start,
            new_auxiliary: auxiliary.clone(),
            old_auxiliary: auxiliary,
            lengths,
            violation: None,
            since_event,
        }
    }

    /// A step that ends at the state `end` with these auxiliary accelerations, after a step of the given length (s), and
    /// `since_event` steps after an event.
    pub(crate) fn ending_at(end: State<T>, auxiliary: Vec<T>, length: Option<f64>, since_event: usize) -> Self {
        let lengths = [None, length.map(T::from)];
        Self { lengths, since_event: [since_event; 2], new_auxiliary: auxiliary, ..Self::from(end) }
    }

    /// Auxiliary accelerations at the end.
    pub(crate) fn auxiliary(&self) -> &[T] {
        &self.new_auxiliary
    }

    /// A step that begins where this one does, in the state `old` + `by` · `rates.old`, where `rates` and `length_rate` are the
    /// derivatives of this step and of the length of the step before.
    pub(crate) fn moved(&self, rates: &Self, old: State<T>, length_rate: f64, by: f64) -> Self {
        let auxiliary = self.old_auxiliary.iter().zip(&rates.old_auxiliary).map(|(&w, &rate)| w + rate * by).collect();
        let lengths = [self.lengths[0].map(|length| length + length_rate * by), None];
        let violation = self.violation.as_ref().zip(rates.violation.as_ref());
        let violation = violation.map(|(v, rates)| v.iter().zip(rates).map(|(&v, &rate)| v + rate * by).collect());
        Self { old, old_auxiliary: auxiliary, lengths, violation, ..self.clone() }
    }

    /// Sets the end of this step of derivatives to the difference of two ends, divided by `width`, without the multipliers.
    pub(crate) fn set_end_difference(&mut self, [above, below]: [&Self; 2], width: f64, length: T) {
        let ends = [(&above.new.q, &below.new.q), (&above.new.v, &below.new.v), (&above.new.a, &below.new.a)];
        let to = [&mut self.new.q, &mut self.new.v, &mut self.new.a];
        let auxiliary = (&mut self.new_auxiliary, (&above.new_auxiliary, &below.new_auxiliary));
        for (to, (above, below)) in to.into_iter().zip(ends).chain([auxiliary]) {
            let differences = above.iter().zip(below).map(|(&above, &below)| (above - below) * (1.0 / width));
            to.iter_mut().zip(differences).for_each(|(to, difference)| *to = difference);
        }
        self.lengths[1] = Some(length);
    }

    /// Length in s, if the step is not the start of a motion.
    pub(crate) fn length(&self) -> Option<T> {
        self.lengths[1]
    }

    /// Numbers of steps since the last event, up to [`WITHOUT_HISTORY`], at the two ends.
    pub(crate) fn steps_since_event(&self) -> [usize; 2] {
        self.since_event
    }

    /// Returns whether this step begins without a history.
    pub(crate) fn is_without_history(&self) -> bool {
        self.since_event[0] < WITHOUT_HISTORY
    }

    /// The method of this step: that without a history after an event, otherwise `scheme`.
    pub(crate) fn scheme(&self, scheme: &GeneralizedAlpha) -> GeneralizedAlpha {
        scheme.after_event(self.since_event[0])
    }

    /// Returns whether the step may rescale its first velocities: it follows another one, and does not begin at an event.
    pub(crate) fn may_rescale(&self) -> bool {
        self.lengths[0].is_some() && self.since_event[0] > 0
    }

    /// Sets the part of the velocities at the beginning that violates the constraints: the difference of the velocities and the `consistent` ones.
    pub(crate) fn set_violation(&mut self, consistent: &[T]) {
        self.violation = Some(self.old.v.iter().zip(consistent).map(|(&v, &consistent)| v - consistent).collect());
    }

    /// Factor of w₀ − q̈₀ in a step of the given `length` (s); `None` if it is 1.
    fn history_factor(&self, length: T) -> Option<T> {
        if self.is_without_history() {
            return Some(T::from(0.0));
        }
        history_factor(length, self.lengths[0]?)
    }

    /// Makes the end of the step the beginning of the next one.
    pub fn accept(&mut self) {
        std::mem::swap(&mut self.old, &mut self.new);
        std::mem::swap(&mut self.old_auxiliary, &mut self.new_auxiliary);
        self.new.modes.copy_from(&self.old.modes);
        (self.lengths, self.violation) = ([self.lengths[1], None], None);
        self.since_event = [self.since_event[1], (self.since_event[1] + 1).min(WITHOUT_HISTORY)];
    }

    /// Replaces the end of the step by `state`, from which the motion restarts after an event.
    pub fn restart(&mut self, state: &State<T>) {
        self.new.copy_from(state);
        self.since_event[1] = 0;
    }

    /// Sets the end of the step, of the length `h` (s), to q₀ + h q̇₀ + ½ h² q̈₀ and q̇₀ + h q̈₀, with the accelerations and multipliers of its beginning.
    ///
    /// `h` is a plain number, or carries derivatives if it depends on the design.
    pub(crate) fn extrapolate<H: Scalar>(&mut self, mechanism: &Mechanism<T>, h: H)
    where
        T: Add<H, Output = T> + Mul<H, Output = T>,
    {
        self.new.copy_from(&self.old);
        self.new.t = self.old.t + h;
        for i in 0..self.new.q.len() {
            let (v, a) = (self.old.v[i], self.old.a[i]);
            self.new.q[i] = self.old.q[i] + (v + a * h * 0.5) * h;
            self.new.v[i] = v + a * h;
        }
        self.new.prescribe(mechanism);
        self.new_auxiliary.clone_from(&self.old_auxiliary);
    }

    /// Integrates to the end of the step `h` (s), with the free accelerations `self.new.a` and multipliers `self.new.l`.
    ///
    /// `h` is a plain number, or carries derivatives if it ends at an event that depends on the design.
    pub fn integrate<H: Scalar>(
        &mut self,
        mechanism: &Mechanism<T>,
        scheme: &GeneralizedAlpha,
        prescribed: Prescribed,
        h: H,
    ) where
        T: Add<H, Output = T> + Mul<H, Output = T>,
    {
        self.new.t = self.old.t + h;
        self.new.prescribe_positions(mechanism, prescribed);
        self.integrate_prescribed(mechanism, scheme, prescribed, h);
    }

    /// [`Step::integrate`] after the prescribed coordinates of `self.new` have been set. It is linear in both ends of the step, so
    /// derivatives are integrated by the same formulas.
    pub(crate) fn integrate_prescribed<H: Scalar>(
        &mut self,
        mechanism: &Mechanism<T>,
        scheme: &GeneralizedAlpha,
        prescribed: Prescribed,
        h: H,
    ) where
        T: Mul<H, Output = T>,
    {
        let (length, lead) = (T::from(1.0) * h, self.end_lead(scheme));
        self.lengths[1] = Some(length);
        let (scheme, factor) = (self.scheme(scheme), self.history_factor(length));
        let (ratio, [old, auxiliary]) = (scheme.ratio(), scheme.history());
        let rescaling = self.lengths[0].and_then(|previous| rescaling(length, previous));
        let rescaled = rescaling.zip(self.violation.as_ref());
        for (i, coordinate) in mechanism.coordinates.iter().enumerate() {
            let (q0, v0, a0) = (self.old.q[i], self.old.v[i], self.old.a[i]);
            let v0 = rescaled.map_or(v0, |(change, violation)| v0 + violation[i] * change);
            let w0 = self.old_auxiliary[i];
            let w0 = factor.map_or(w0, |factor| a0 + (w0 - a0) * factor);
            let history = a0 * old + w0 * auxiliary;
            let predicted = q0 + v0 * h + w0 * (h * h * (0.5 - scheme.beta));
            let w1 = match coordinate.motion {
                Some(_) if prescribed == Prescribed::Newmark => {
                    (self.new.q[i] - predicted) * (h * h * scheme.beta).recip()
                }
                _ => self.new.a[i] * ratio + history,
            };
            match coordinate.motion {
                Some(_) if prescribed == Prescribed::Newmark => self.new.a[i] = (w1 - history) * (1.0 / ratio),
                Some(_) => {}
                None => self.new.q[i] = predicted + w1 * (h * h * scheme.beta),
            }
            if coordinate.motion.is_none() || prescribed == Prescribed::Newmark {
                self.new.v[i] = v0 + (w0 * (1.0 - scheme.gamma) + w1 * scheme.gamma) * h;
            }
            self.new_auxiliary[i] = lead.map_or(w1, |lead| w1 + (self.new.a[i] - a0) * lead);
        }
    }

    /// Factor of (q̈₁ − q̈₀) that is added to the auxiliary acceleration at the end of a step without history; `None` for other
    /// steps, whose formulas contain it.
    fn end_lead(&self, scheme: &GeneralizedAlpha) -> Option<f64> {
        self.is_without_history().then(|| scheme.lead())
    }

    /// Adds `change(equation)` to accelerations and multipliers only; call [`Step::integrate`] after it.
    pub fn add_accelerations(&mut self, system: &System, change: impl Fn(usize) -> T) {
        for (equation, unknown) in system.unknowns().iter().enumerate() {
            match *unknown {
                Unknown::Multiplier(m) => self.new.l[m] += change(equation),
                Unknown::Coordinate(i) => self.new.a[i] += change(equation),
            }
        }
    }

    /// Adds `change(equation)` to accelerations and multipliers, and its effect to positions and velocities.
    pub fn correct(&mut self, system: &System, scheme: &GeneralizedAlpha, h: f64, change: impl Fn(usize) -> T) {
        let auxiliary = self.end_lead(scheme).map_or(scheme.ratio(), |lead| 1.0 + lead);
        let (position, velocity) = self.scheme(scheme).newmark_coefficients(h);
        for (equation, unknown) in system.unknowns().iter().enumerate() {
            let change = change(equation);
            match *unknown {
                Unknown::Multiplier(m) => self.new.l[m] += change,
                Unknown::Coordinate(i) => {
                    self.new.a[i] += change;
                    self.new_auxiliary[i] += change * auxiliary;
                    self.new.v[i] += change * velocity;
                    self.new.q[i] += change * position;
                }
            }
        }
    }
}

impl<T: StateScalar> State<T> {
    /// Sets the prescribed coordinates at the state's time; with [`Prescribed::Newmark`] their positions only.
    pub(crate) fn prescribe_positions(&mut self, mechanism: &Mechanism<T>, prescribed: Prescribed) {
        for (i, coordinate) in mechanism.coordinates.iter().enumerate() {
            if let Some((motion, parameters)) = &coordinate.motion {
                match prescribed {
                    Prescribed::Newmark => self.q[i] = T::position(motion.as_ref(), parameters, self.t),
                    Prescribed::Exact => {
                        [self.q[i], self.v[i], self.a[i]] = T::motion(motion.as_ref(), parameters, self.t);
                    }
                }
            }
        }
    }
}

/// A correction of Newton's iteration.
#[derive(Clone, Copy)]
struct Correction {
    /// Largest change of a position in m or rad.
    largest: f64,
    /// Estimated ratio of the next correction to this one.
    rate: f64,
    /// True if the matrix of the previous iteration is reused.
    is_reused: bool,
}

/// Largest ratio of two successive corrections for which the next iteration reuses the matrix.
const REUSE_RATE: f64 = 1e-2;

/// Largest error after the last iteration, as a fraction of the tolerance: small enough for differences of two analyses.
const REMAINDER: f64 = 1e-6;

/// Smallest assumed ratio of a correction to the square of the previous one, in 1/m or 1/rad: a motion with linear forces may enter a contact in
/// the next step.
const LEAST_CURVATURE: f64 = 10.0;

/// Solver of the steps in `f64`; it keeps the factorization of the last one.
pub struct Integrator<'m> {
    /// The mechanism.
    pub mechanism: &'m Mechanism<f64>,
    /// Equations of motion; the factor is that of the last Newton iteration.
    pub system: System,
    /// Integration method.
    pub scheme: GeneralizedAlpha,
    /// Velocities and accelerations of prescribed coordinates.
    pub prescribed: Prescribed,
    /// Settings of Newton's iteration.
    pub newton: Newton,
    /// The current step.
    pub step: Step<f64>,
    /// Newton iterations so far with an assembly, a factorization and a solution each; iterations that
    /// reuse the previous matrix (modified Newton) are not counted.
    pub iterations: usize,
    rows: Vec<[f64; 1]>,
    workspace: ElementWorkspace<f64>,
    pub(crate) predictor: Predictor,
    /// Last ratio of a correction to the square of the previous one, in 1/m or 1/rad.
    pub(crate) curvature: f64,
    /// Forces of held parts at the ends of the step, for a mechanism with such parts.
    pub(crate) consistent: Option<Box<ConsistentEnds>>,
}

impl<'m> Integrator<'m> {
    /// Integrator at the start of the motion, in the state `start`.
    pub fn new(
        mechanism: &'m Mechanism<f64>,
        system: System,
        scheme: GeneralizedAlpha,
        prescribed: Prescribed,
        newton: Newton,
        start: State<f64>,
    ) -> Self {
        let (mut rows, mut workspace) = (vec![[0.0]; system.size()], ElementWorkspace::default());
        system.residual(mechanism, &start, 1.0, &mut workspace, rows.as_flattened_mut()); // allocates the workspace
        let (predictor, step) = (Predictor::new(&start), Step::from(start));
        let consistent = ConsistentEnds::new(mechanism, &system, &step.new);
        let (iterations, curvature) = (0, f64::INFINITY);
        Self {
            mechanism,
            system,
            scheme,
            prescribed,
            newton,
            step,
            iterations,
            rows,
            workspace,
            predictor,
            curvature,
            consistent,
        }
    }

    /// Makes the end of the step the beginning of the next one.
    pub fn accept(&mut self) {
        self.step.accept();
        self.predictor.add(&self.step.old);
    }

    /// Factorizes the matrix at the end of the step, for the derivatives of the converged step.
    pub fn linearize(&mut self, h: f64) -> Result<()> {
        let (position, velocity) = self.step.scheme(&self.scheme).newmark_coefficients(h);
        let linearization = Linearization::step(position, velocity);
        self.system.assemble(self.mechanism, &self.step.new, linearization, &mut self.rows);
        diagnostics::factorize(&mut self.system, self.mechanism, &self.step.new)
    }

    /// Solves the step `h` (s); its end is then in `step.new`. A failed step does not change its beginning.
    ///
    /// # Errors
    ///
    /// [`Error::Analysis`] naming the equation with the largest residual and the time.
    pub fn solve(&mut self, h: f64) -> Result<()> {
        self.step.new.t = self.step.old.t + h;
        self.predictor.predict(&mut self.step.new);
        self.solve_from_guess(h)
    }

    /// [`Integrator::solve`] where Newton's iteration starts from the accelerations and multipliers in `step.new`.
    ///
    /// Where a force jumps within the step, the step may have two solutions, with the force on and off; the iteration finds
    /// the one near its start.
    pub(crate) fn solve_from_guess(&mut self, h: f64) -> Result<()> {
        let (position, velocity) = self.step.scheme(&self.scheme).newmark_coefficients(h);
        if self.system.allows_redundancy() {
            self.step.new.l.fill(0.0); // so that the multipliers have the least norm
        }
        self.step.integrate(self.mechanism, &self.scheme, self.prescribed, h);
        let mut previous: Option<Correction> = None;
        let mut reactions = self.mechanism.has_reaction_loads().then(|| {
            let (workspace, rows) = (&mut self.workspace, &mut self.rows);
            ReactionChange::new(&self.system, self.mechanism, &self.step.new, workspace, rows)
        });
        for _ in 0..self.newton.iterations {
            let is_reused = reactions.is_none() && previous.is_some_and(|previous| previous.rate <= REUSE_RATE);
            if is_reused {
                let rows = self.rows.as_flattened_mut();
                self.system.residual(self.mechanism, &self.step.new, 1.0 / position, &mut self.workspace, rows);
            } else {
                self.linearize(h)?;
                self.iterations += 1;
            }
            self.system.factor().solve(&mut self.rows);
            let largest = self.system.largest_coordinate_row(&self.rows) * position;
            if !(largest < 1e6) {
                break;
            }
            let rows = &self.rows;
            self.step.correct(&self.system, &self.scheme, h, |equation| -rows[equation][0]);
            let rate = self.rate(largest, is_reused, previous);
            let is_settled = match &mut reactions {
                Some(change) => change.is_settled(&self.system, &self.rows, &self.step.new),
                None => true,
            };
            let is_small =
                rate * largest <= REMAINDER * self.newton.tolerance || (!is_reused && largest <= self.newton.tolerance);
            if is_settled && is_small {
                return self.check_redundant_constraints();
            }
            previous = Some(Correction { largest, rate, is_reused });
        }
        Err(self.failure(Linearization::step(position, velocity)))
    }

    /// Checks that redundant constraints hold. If they contradict each other, the iteration converges to positions that violate them.
    fn check_redundant_constraints(&mut self) -> Result<()> {
        if !self.system.allows_redundancy() {
            return Ok(());
        }
        let Self { system, mechanism, step, rows, .. } = self;
        let rows = rows.as_flattened_mut();
        rows.fill(0.0);
        system.constraint_rates(mechanism, &step.new, 0, &mut ElementWorkspace::default(), rows);
        check_contradictions(system, mechanism, step.new.t, (rows, "m or rad"), CONTRADICTION)
    }

    /// Estimated ratio of the next correction to this one of size `largest`.
    fn rate(&mut self, largest: f64, is_reused: bool, previous: Option<Correction>) -> f64 {
        if let Some(previous) = previous.filter(|previous| !previous.is_reused) {
            self.curvature = (largest / previous.largest.powi(2)).max(LEAST_CURVATURE);
        }
        match previous {
            Some(previous) if is_reused => largest / previous.largest,
            _ => self.curvature * largest,
        }
    }

    /// The error of a step that does not converge.
    fn failure(&mut self, linearization: Linearization) -> Error {
        if let Some(error) = diagnostics::not_finite(self.mechanism, &self.step.new) {
            return error;
        }
        if let Some(error) = singular_position(&self.system, self.mechanism, &self.step.old) {
            return error;
        }
        let (t, h) = (self.step.old.t, self.step.new.t - self.step.old.t);
        if let Err(error) = refuse_position_jumps(&self.system, self.mechanism, [t, t + h], || self.step.old.clone()) {
            return error;
        }
        self.system.assemble(self.mechanism, &self.step.new, linearization, &mut self.rows);
        let what = diagnostics::dominant_residual(&self.system, self.mechanism, &self.step.new, &self.rows);
        let why = format!("Newton's iteration does not converge from t = {t} with a step of {h:.3e} s", t = Seconds(t));
        let remedy = match self.scheme.is_undamped() && !self.step.new.l.is_empty() {
            true => {
                "add numerical damping, a spectral radius below 1: without it, errors of the reactions of joints change sign \
                 from step to step and do not decay"
            }
            false => "use a smaller step, or a stiffer or heavier design",
        };
        Error::analysis(what, why, remedy)
    }
}
