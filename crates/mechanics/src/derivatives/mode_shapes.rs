//! Amplitudes of outputs in natural modes, with derivatives with respect to the design.

use crate::analyses::modal::modes;
use crate::derivatives::modal::{About, Vibration, VibrationMatrices, clusters, mode_rows, states_at_rest};
use crate::derivatives::seeding::{build_chunks, build_seeded};
use crate::mechanism::scalars::{Dual8, HyperDual4};
use crate::mechanism::{Mechanism, ParametricMechanism};
use crate::system::outputs::Sampler;
use crate::system::state::State;
use crate::system::{System, Unknown};
use crate::{Error, Result};
use autodiff::WIDTH;
use nalgebra::{DMatrix, DVector};

/// Number of design variables in one pass of second derivatives.
const PAIRS: usize = 4;

/// Components whose absolute value differs by less, relative to the largest one, count as equal for the sign of a shape.
const SAME_SIZE: f64 = 1e-6;

/// Amplitudes of outputs in natural modes, and their derivatives.
#[derive(Clone, Debug, PartialEq)]
pub struct ModeShapes {
    /// `values[k][output]`: amplitude of the output in the k-th requested mode.
    pub values: Vec<Vec<f64>>,
    /// `gradients[k][output]`: its gradient with respect to the design variables; empty without derivatives.
    pub gradients: Vec<Vec<Vec<f64>>>,
}

/// Amplitudes of all outputs of `model` in the natural modes of the numbers `which`, from zero, at the design `b` and time `t` (s).
///
/// The amplitude of an output y is its derivative along the vibration q = q₀ + φ cos ωt, in phase with it: positions move by φ,
/// accelerations by −ω² φ and reactions by those of the mode. Velocities are out of phase and do not contribute. Shapes are normalized by
/// mass, φᵀ M φ = 1; the component with the largest absolute value is positive, of components of equal size the first one, in the
/// order of the coordinates. Amplitudes of translations are in 1/√kg.
///
/// # Errors
/// As [`modes`], and [`Error::Analysis`] if there is no such mode.
pub fn mode_shapes<M: ParametricMechanism>(
    model: &M,
    b: &[f64],
    about: About<'_>,
    t: f64,
    which: &[usize],
) -> Result<Vec<Vec<f64>>> {
    let mechanism = model.build(b)?;
    let constants: Vec<HyperDual4> = b.iter().map(|&x| HyperDual4::variable(x, [0.0; 4], [0.0; 4])).collect();
    let hyper = [build_seeded(model, &constants, &mechanism)?];
    Ok(shapes_seeded(&mechanism, &[], &hyper, 0, about, t, which)?.values)
}

/// [`mode_shapes`] with exact derivatives.
///
/// A shape and its reactions μ solve, next to ω², a linear system that is regular for a simple frequency:
///
/// $$ \begin{bmatrix} K-\omega^2 M & \Phi_q^T & -M\varphi \\ \Phi_q & 0 & 0 \\ \varphi^T M & 0 & 0 \end{bmatrix}
///    \begin{bmatrix} \varphi' \\ \mu' \\ (\omega^2)' \end{bmatrix} = -
///    \begin{bmatrix} (K'-\omega^2 M')\varphi + \Phi_q'^T\mu \\ \Phi_q'\varphi \\ \tfrac12\varphi^T M'\varphi \end{bmatrix} $$
///
/// # Errors
/// As [`mode_shapes`], and [`Error::Unsupported`] for a repeated frequency, whose shapes are not determined.
///
/// # Sources
/// Nelson, *AIAA J.* 14 (1976) 1201–1205; Lee & Jung, *Comput. Struct.* 62 (1997) 429–435, for the bordered system.
pub fn differentiate_mode_shapes<M: ParametricMechanism>(
    model: &M,
    b: &[f64],
    about: About<'_>,
    t: f64,
    which: &[usize],
) -> Result<ModeShapes> {
    let mechanism = model.build(b)?;
    let chunks = build_chunks(model, b, &mechanism)?;
    let seeded = |first: usize| {
        let unit = |i: usize| std::array::from_fn(|k| f64::from(u8::from(first + k == i)));
        let design: Vec<HyperDual4> =
            b.iter().enumerate().map(|(i, &x)| HyperDual4::variable(x, [0.0; 4], unit(i))).collect();
        build_seeded(model, &design, &mechanism)
    };
    let hyper = (0..b.len()).step_by(PAIRS).map(seeded).collect::<Result<Vec<_>>>()?;
    shapes_seeded(&mechanism, &chunks, &hyper, b.len(), about, t, which)
}

/// Computes the amplitudes. Not generic over the model: compiled once, in this crate.
fn shapes_seeded(
    mechanism: &Mechanism<f64>,
    chunks: &[Mechanism<Dual8>],
    hyper: &[Mechanism<HyperDual4>],
    variables: usize,
    about: About<'_>,
    t: f64,
    which: &[usize],
) -> Result<ModeShapes> {
    let mut system = System::at(mechanism, t)?;
    let (values, states) = states_at_rest(&mut system, mechanism, chunks, about, t)?;
    let natural = modes(&mut system, mechanism, &values)?;
    let squares: Vec<f64> = natural.frequencies.iter().map(|w| w * w.abs()).collect();
    let matrices = VibrationMatrices::new(&mut system, mechanism, &values);
    let mut shapes = ModeShapes { values: Vec::new(), gradients: Vec::new() };
    for &mode in which {
        let Some(&square) = squares.get(mode) else {
            let why = format!("mode {} at t = {t} s: there are only {}", mode + 1, squares.len());
            return Err(Error::analysis("modes", why, "ask for a lower one; each degree of freedom has one"));
        };
        let cluster = clusters(&squares).into_iter().find(|cluster| cluster.contains(&mode));
        if let Some(cluster) = cluster.filter(|cluster| cluster.len() > 1 && variables > 0) {
            let (first, last) = (cluster.start + 1, cluster.end);
            let why = format!("the shapes of the equal frequencies {first} to {last} at t = {t} s are not determined");
            return Err(Error::unsupported("modes", why, "separate the frequencies, or ask for another mode"));
        }
        let shape = with_sign(natural.shapes.column(mode).iter().copied().collect());
        let solved = Mode { reactions: matrices.reactions(&shape, square, false), shape, square };
        let derivatives = solved.derivatives(&system, &matrices, (chunks, &states), variables)?;
        let mut gradients = vec![Vec::with_capacity(variables); mechanism.outputs.len()];
        let mut amplitudes = Vec::new();
        for (c, mechanism) in hyper.iter().enumerate() {
            let first = c * PAIRS;
            let state = solved.state(mechanism, &values, &states, &derivatives, first);
            let mut outputs = Vec::new();
            Sampler::new(mechanism).outputs(mechanism, &state, &mut outputs);
            amplitudes = outputs.iter().map(|output| output.a[0]).collect();
            for (gradient, output) in gradients.iter_mut().zip(&outputs) {
                gradient.extend_from_slice(&output.ab[..PAIRS.min(variables - variables.min(first))]);
            }
        }
        shapes.values.push(amplitudes);
        shapes.gradients.push(gradients);
    }
    Ok(shapes)
}

/// The shape or its negative, see [`mode_shapes`].
fn with_sign(shape: Vec<f64>) -> Vec<f64> {
    let largest = shape.iter().fold(0.0f64, |a, x| a.max(x.abs()));
    let leading = shape.iter().find(|x| x.abs() >= (1.0 - SAME_SIZE) * largest).copied().unwrap_or(0.0);
    if leading < 0.0 { shape.into_iter().map(|x| -x).collect() } else { shape }
}

/// A mode: shape by coordinate, reactions by multiplier, and square of its frequency.
struct Mode {
    shape: Vec<f64>,
    reactions: Vec<f64>,
    square: f64,
}

/// Derivatives of a mode with respect to one design variable.
struct ModeDerivative {
    shape: Vec<f64>,
    reactions: Vec<f64>,
    square: f64,
}

impl Mode {
    /// Derivatives with respect to all design variables.
    fn derivatives(
        &self,
        system: &System,
        matrices: &VibrationMatrices,
        (chunks, states): (&[Mechanism<Dual8>], &[State<Dual8>]),
        variables: usize,
    ) -> Result<Vec<ModeDerivative>> {
        if variables == 0 {
            return Ok(Vec::new());
        }
        let matrix = self.bordered(system, matrices);
        let right = self.right_sides(system, (chunks, states), variables);
        let solution = if system.allows_redundancy() {
            matrix.svd(true, true).solve(&right, 1e-12).ok()
        } else {
            matrix.lu().solve(&right)
        };
        let solution = solution.ok_or_else(|| {
            let why = "the shape of a mode has no derivative: the constraints depend on each other";
            Error::unsupported("modes", why, "remove redundant joints")
        })?;
        Ok((0..variables).map(|column| self.derivative(system, solution.column(column).as_slice())).collect())
    }

    /// Right sides of the bordered equations, one column per design variable.
    fn right_sides(
        &self,
        system: &System,
        (chunks, states): (&[Mechanism<Dual8>], &[State<Dual8>]),
        variables: usize,
    ) -> DMatrix<f64> {
        let n = system.size();
        let mut right = DMatrix::zeros(n + 1, variables);
        let accelerations: Vec<f64> = self.shape.iter().map(|x| -self.square * x).collect();
        let zeros = vec![0.0; self.shape.len()];
        let vibration = Vibration { positions: &self.shape, accelerations: &accelerations, reactions: &self.reactions };
        let none = vec![0.0; self.reactions.len()];
        let inertia = Vibration { positions: &zeros, accelerations: &self.shape, reactions: &none };
        for (c, (mechanism, state)) in chunks.iter().zip(states).enumerate() {
            let rows = mode_rows(system, mechanism, state, &vibration);
            let inertia = mode_rows(system, mechanism, state, &inertia);
            for k in 0..WIDTH.min(variables - c * WIDTH) {
                let column = c * WIDTH + k;
                for (i, unknown) in system.unknowns().iter().enumerate() {
                    right[(i, column)] = -rows[i].eps[k];
                    if let Unknown::Coordinate(coordinate) = *unknown {
                        right[(n, column)] -= 0.5 * self.shape[coordinate] * inertia[i].eps[k];
                    }
                }
            }
        }
        right
    }

    /// The derivative from a solution of the bordered equations.
    fn derivative(&self, system: &System, solution: &[f64]) -> ModeDerivative {
        let mut derivative = ModeDerivative {
            shape: vec![0.0; self.shape.len()],
            reactions: vec![0.0; self.reactions.len()],
            square: solution[system.size()],
        };
        for (unknown, value) in system.unknowns().iter().zip(solution) {
            match *unknown {
                Unknown::Coordinate(i) => derivative.shape[i] = *value,
                Unknown::Multiplier(m) => derivative.reactions[m] = *value,
            }
        }
        derivative
    }

    /// The bordered matrix, see [`differentiate_mode_shapes`].
    fn bordered(&self, system: &System, matrices: &VibrationMatrices) -> DMatrix<f64> {
        let (VibrationMatrices { stiffness, mass, .. }, n) = (matrices, system.size());
        let unknowns = system.unknowns();
        let of_shape = |unknown: &Unknown| match *unknown {
            Unknown::Coordinate(i) => self.shape[i],
            Unknown::Multiplier(_) => 0.0,
        };
        let is_coordinate = |i: usize| matches!(unknowns[i], Unknown::Coordinate(_));
        let shape = DVector::from_iterator(n, unknowns.iter().map(of_shape));
        let mut matrix = DMatrix::zeros(n + 1, n + 1);
        for i in 0..n {
            for j in 0..n {
                let both = is_coordinate(i) && is_coordinate(j);
                matrix[(i, j)] = stiffness[(i, j)] - if both { self.square * mass[(i, j)] } else { 0.0 };
            }
            if is_coordinate(i) {
                let inertia: f64 = (0..n).filter(|&j| is_coordinate(j)).map(|j| mass[(i, j)] * shape[j]).sum();
                (matrix[(i, n)], matrix[(n, i)]) = (-inertia, inertia);
            }
        }
        matrix
    }

    /// The state that vibrates in the first directions of the pairs, with the design variables from number `first` on in the
    /// second ones.
    fn state(
        &self,
        mechanism: &Mechanism<HyperDual4>,
        values: &State<f64>,
        states: &[State<Dual8>],
        derivatives: &[ModeDerivative],
        first: usize,
    ) -> State<HyperDual4> {
        let by_variable = |of: &dyn Fn(usize) -> f64| -> [f64; PAIRS] {
            std::array::from_fn(|k| if first + k < derivatives.len() { of(first + k) } else { 0.0 })
        };
        let number = |re: f64, a: f64, b: [f64; PAIRS], ab: [f64; PAIRS]| HyperDual4 { re, a: [a; PAIRS], b, ab };
        let mut state = State::built(mechanism, values.t);
        for i in 0..values.q.len() {
            let moved = |x: fn(&State<Dual8>) -> &Vec<Dual8>| {
                by_variable(&|variable| x(&states[variable / WIDTH])[i].eps[variable % WIDTH])
            };
            let shape = by_variable(&|variable| derivatives[variable].shape[i]);
            let acceleration = by_variable(&|variable| {
                let derivative = &derivatives[variable];
                -derivative.square * self.shape[i] - self.square * derivative.shape[i]
            });
            state.q[i] = number(values.q[i], self.shape[i], moved(|state| &state.q), shape);
            state.v[i] = number(values.v[i], 0.0, moved(|state| &state.v), [0.0; PAIRS]);
            state.a[i] = number(values.a[i], -self.square * self.shape[i], moved(|state| &state.a), acceleration);
        }
        for m in 0..values.l.len() {
            let moved = by_variable(&|variable| states[variable / WIDTH].l[m].eps[variable % WIDTH]);
            let reaction = by_variable(&|variable| derivatives[variable].reactions[m]);
            state.l[m] = number(values.l[m], self.reactions[m], moved, reaction);
        }
        state
    }
}
