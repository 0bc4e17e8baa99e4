//! A mechanism at both sides of a design, and central differences between them.

use crate::mechanism::{Mechanism, ParametricMechanism};
use crate::system::state::State;
use crate::{Error, Result};

/// Default relative step ε of the differences, a fraction of a design variable.
pub const STEP: f64 = 1e-5;

/// Checks a relative step ε of the differences.
///
/// # Errors
/// [`Error::Option`] unless it is between 0 and 1.
pub fn check_step(step: f64) -> Result<()> {
    Error::check_option(
        "relative step of the residual's differences",
        "between 0 and 1",
        step,
        step > 0.0 && step < 1.0,
    )
}

/// Central differences between the mechanisms at the designs b + δ e_k and b − δ e_k.
pub(crate) struct CentralDifference {
    mechanisms: [Mechanism<f64>; 2],
    /// 2 δ in the unit of the design variable, as the difference of the two designs.
    width: f64,
    /// |b_k|, or 1 where it is zero.
    size: f64,
    moved: State<f64>,
    values: [Vec<f64>; 2],
    /// Derivative of the time of the states that are moved; zero unless it is the time of an event.
    pub time_rate: f64,
}

impl CentralDifference {
    /// Differences for each design variable, with the relative step `step`; all mechanisms have the elements of `like`.
    ///
    /// # Errors
    /// As [`check_step`] and [`CentralDifference::new`].
    pub fn by_each_variable<M: ParametricMechanism>(
        model: &M,
        b: &[f64],
        step: f64,
        like: &Mechanism<f64>,
    ) -> Result<Vec<Self>> {
        check_step(step)?;
        (0..b.len()).map(|k| Self::new(model, b, k, step, like)).collect()
    }

    /// Differences for the variable `k`, with δ the fraction `step` of its value, or `step` itself where the value is zero.
    ///
    /// # Errors
    /// [`Error::Definition`] if the model builds other elements than `like` at one of the designs.
    fn new<M: ParametricMechanism>(model: &M, b: &[f64], k: usize, step: f64, like: &Mechanism<f64>) -> Result<Self> {
        let size = if b[k] == 0.0 { 1.0 } else { b[k].abs() };
        let distance = step * size;
        let at = |by: f64| -> Result<(f64, Mechanism<f64>)> {
            let mut moved = b.to_vec();
            moved[k] += by;
            let mechanism = model.build(&moved)?;
            if !mechanism.same_topology(like) {
                let why = format!("makes different elements when design variable {k} moves by {by:e}");
                let remedy = "do not let the design decide what is built, or use a smaller step of the differences";
                return Err(Error::definition("model", why, remedy));
            }
            Ok((moved[k], mechanism))
        };
        let ((above, first), (below, second)) = (at(distance)?, at(-distance)?);
        let rounded = 0.5 * (above - below); // of the design variables, in floating point
        let moved = State::built(&first, 0.0);
        Ok(Self {
            mechanisms: [first, second],
            width: 2.0 * rounded,
            size,
            moved,
            values: Default::default(),
            time_rate: 0.0,
        })
    }

    /// Size of the design variable: its absolute value, or 1 where it is zero.
    pub fn size(&self) -> f64 {
        self.size
    }

    /// The derivatives of what `evaluate` writes, where the state `values` has the derivatives `sensitivity`.
    pub fn derivatives(
        &mut self,
        values: &State<f64>,
        sensitivity: &State<f64>,
        mut evaluate: impl FnMut(&Mechanism<f64>, &State<f64>, &mut Vec<f64>),
    ) -> impl Iterator<Item = f64> + '_ {
        let width = self.width;
        for (side, sign) in [1.0, -1.0].into_iter().enumerate() {
            shift(&mut self.moved, values, sensitivity, sign * (0.5 * width));
            self.moved.t += sign * (0.5 * width) * self.time_rate;
            evaluate(&self.mechanisms[side], &self.moved, &mut self.values[side]);
        }
        let [above, below] = &self.values;
        above.iter().zip(below).map(move |(above, below)| (above - below) / width)
    }

    /// 2 δ in the unit of the design variable.
    pub fn width(&self) -> f64 {
        self.width
    }

    /// The mechanisms at both sides, each with its distance from the design.
    pub fn sides(&self) -> [(&Mechanism<f64>, f64); 2] {
        let [above, below] = &self.mechanisms;
        [(above, 0.5 * self.width), (below, -0.5 * self.width)]
    }

    /// Derivatives of the state in which the mechanism is built, prescribed coordinates at the time `t`.
    pub fn built(&self, t: f64) -> State<f64> {
        let [mut sensitivity, below] = [0, 1].map(|side| State::built(&self.mechanisms[side], t));
        let below = [&below.q, &below.v, &below.a, &below.l];
        for (above, below) in vectors_of(&mut sensitivity).into_iter().zip(below) {
            above.iter_mut().zip(below).for_each(|(above, below)| *above = (*above - below) / self.width);
        }
        sensitivity
    }

    /// Derivatives of what `prescribe` writes to a state, for the prescribed coordinates of `sensitivity`.
    pub fn prescribe(&mut self, sensitivity: &mut State<f64>, prescribe: impl Fn(&Mechanism<f64>, &mut State<f64>)) {
        self.moved.t = sensitivity.t;
        prescribe(&self.mechanisms[0], sensitivity);
        prescribe(&self.mechanisms[1], &mut self.moved);
        let is_driven = |i: &usize| self.mechanisms[0].coordinates[*i].motion.is_some();
        for i in (0..sensitivity.q.len()).filter(is_driven) {
            sensitivity.q[i] = (sensitivity.q[i] - self.moved.q[i]) / self.width;
            sensitivity.v[i] = (sensitivity.v[i] - self.moved.v[i]) / self.width;
            sensitivity.a[i] = (sensitivity.a[i] - self.moved.a[i]) / self.width;
        }
    }
}

fn vectors_of(state: &mut State<f64>) -> [&mut Vec<f64>; 4] {
    [&mut state.q, &mut state.v, &mut state.a, &mut state.l]
}

/// The state `values` + `by` · `sensitivity`, whose time has the derivative `time_rate`.
pub(crate) fn moved_state(values: &State<f64>, sensitivity: &State<f64>, time_rate: f64, by: f64) -> State<f64> {
    let mut moved = values.clone();
    shift(&mut moved, values, sensitivity, by);
    moved.t += by * time_rate;
    moved
}

/// Sets `to` to the difference of two states, divided by `width`.
pub(crate) fn set_difference(to: &mut State<f64>, [above, below]: [&State<f64>; 2], width: f64) {
    let above = [&above.q, &above.v, &above.a, &above.l];
    let below = [&below.q, &below.v, &below.a, &below.l];
    for (to, (above, below)) in vectors_of(to).into_iter().zip(above.into_iter().zip(below)) {
        to.iter_mut().zip(above.iter().zip(below)).for_each(|(to, (above, below))| *to = (above - below) / width);
    }
}

/// `moved` = `values` + `by` · `sensitivity`.
fn shift(moved: &mut State<f64>, values: &State<f64>, sensitivity: &State<f64>, by: f64) {
    moved.copy_from(values);
    let derivatives = [&sensitivity.q, &sensitivity.v, &sensitivity.a, &sensitivity.l];
    for (moved, derivatives) in vectors_of(moved).into_iter().zip(derivatives) {
        moved.iter_mut().zip(derivatives).for_each(|(moved, derivative)| *moved += by * derivative);
    }
}
