//! Derivatives of natural frequencies with respect to the design.

use crate::analyses::modal::{VibrationModes, modes};
use crate::analyses::statics::{Statics, find_equilibrium};
use crate::derivatives::forward::initial_conditions::{InitialDerivatives, ProjectedPart, equilibrium};
use crate::derivatives::forward::instants::factorize_equilibrium;
use crate::derivatives::seeding::{build_chunks, set_values};
use crate::elements::element::ElementWorkspace;
use crate::events::unilateral::refuse_friction;
use crate::initial_conditions::{Assembly, Projection, assemble};
use crate::mechanism::scalars::{Dual8, ElementScalar, Jet2};
use crate::mechanism::{Mechanism, ParametricMechanism};
use crate::system::linearization::Linearization;
use crate::system::state::State;
use crate::system::{System, Unknown};
use crate::{Error, Result};
use autodiff::WIDTH;
use nalgebra::{DMatrix, DVector};
use std::ops::Range;

/// State at rest about which the equations are linearized.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum About<'s> {
    /// The assembled initial positions, without reactions: no prestress.
    Assembled,
    /// The static equilibrium, with its reactions, that is found from the initial positions.
    Equilibrium(Statics),
    /// A static equilibrium that is known, such as one on a [load path](crate::analyses::statics::equilibrium_states).
    At(&'s State<f64>),
}

/// Squares of natural frequencies and their derivatives.
#[derive(Clone, Debug, PartialEq)]
pub struct ModeSensitivities {
    /// ω² in rad²/s², increasing.
    pub squares: Vec<f64>,
    /// `gradients[mode]` is the gradient of ω² with respect to the design variables; dω/db is the gradient divided by 2 ω.
    ///
    /// A repeated frequency has one-sided derivatives only. Where the modes do not interact, such as a symmetric and an antisymmetric one whose
    /// frequencies cross, each gradient is that of one branch, which is smooth. Otherwise the derivatives are sorted for each variable
    /// separately: those of mode k are those of the k-th frequency as the variable increases. For a change of several variables they
    /// must not be added.
    pub gradients: Vec<Vec<f64>>,
}

/// Squares whose relative difference is smaller count as one repeated frequency.
const REPEATED: f64 = 1e-7;

/// Multiples of it have fractional parts that are spread evenly.
const GOLDEN: f64 = 0.618_033_988_749_894_9;

/// Off-diagonal part of the derivatives of an eigenspace, relative to the largest, below which its modes do not interact.
const NO_INTERACTION: f64 = 1e-6;

/// Singular value of Φ_q Φ_qᵀ, as a fraction of its largest entry, that counts as zero: constraints are redundant.
const REDUNDANT: f64 = 1e-13;

/// Natural frequencies of `model` at the design `b` and time `t`, with exact derivatives.
///
/// For a mode K φ + Φ_qᵀ μ = ω² M φ, Φ_q φ = 0, with its left vector Kᵀ ψ + Φ_qᵀ ν = ω² M ψ, Φ_q ψ = 0, ψᵀ M φ = 1,
///
/// $$ \frac{d\omega^2}{db} = \psi^T\left(\frac{dK}{db} - \omega^2\frac{dM}{db}\right)\varphi
///    + \psi^T\frac{d\Phi_q^T}{db}\mu + \nu^T\frac{d\Phi_q}{db}\varphi $$
///
/// where K, M and Φ_q depend on the design also through the state. If all forces have a potential, ψ = φ and ν = μ. One evaluation
/// of every element gives all terms, in numbers with derivatives along φ and with respect to [`WIDTH`] design variables. For a
/// repeated frequency the derivatives are the eigenvalues of the matrix of this expression for all pairs of its modes.
///
/// # Errors
/// As [`modes`], [`assemble`] and [`equilibria`](crate::analyses::statics::equilibria); [`Error::Unsupported`] for a repeated frequency
/// with forces that have no potential.
///
/// # Sources
/// Fox & Kapoor, *AIAA J.* 6 (1968) 2426–2429; for an unsymmetric K, Rogers, *AIAA J.* 8 (1970) 943–944; for repeated
/// frequencies Seyranian, Lund & Olhoff, *Struct. Optim.* 8
/// (1994) 207–227.
pub fn differentiate_modes<M: ParametricMechanism>(
    model: &M,
    b: &[f64],
    about: About<'_>,
    t: f64,
) -> Result<ModeSensitivities> {
    let mechanism = model.build(b)?;
    differentiate_seeded(&mechanism, &build_chunks(model, b, &mechanism)?, b.len(), about, t)
}

/// Squares ω² of the natural angular frequencies in rad²/s², increasing, without derivatives.
///
/// # Errors
/// As [`differentiate_modes`].
pub fn squared_frequencies(mechanism: &Mechanism<f64>, about: About<'_>, t: f64) -> Result<Vec<f64>> {
    Ok(differentiate_seeded(mechanism, &[], 0, about, t)?.squares)
}

/// Differentiates the modes. Not generic over the model: compiled once, in this crate.
fn differentiate_seeded(
    mechanism: &Mechanism<f64>,
    chunks: &[Mechanism<Dual8>],
    variables: usize,
    about: About<'_>,
    t: f64,
) -> Result<ModeSensitivities> {
    let mut system = System::at(mechanism, t)?;
    let (values, states) = states_at_rest(&mut system, mechanism, chunks, about, t)?;
    let natural = modes(&mut system, mechanism, &values)?;
    let squares: Vec<f64> = natural.frequencies.iter().map(|w| w * w.abs()).collect();
    let matrices = VibrationMatrices::new(&mut system, mechanism, &values);
    let mut gradients = vec![vec![0.0; variables]; squares.len()];
    for cluster in clusters(&squares) {
        if cluster.len() > 1 && variables > 0 && !natural.is_symmetric {
            let (first, last) = (cluster.start + 1, cluster.end);
            let why = format!(
                "the equal frequencies {first} to {last} at t = {t} s have no derivatives: forces have no potential"
            );
            return Err(Error::unsupported("modes", why, "separate the frequencies, or reduce these forces"));
        }
        let square = cluster.clone().map(|k| squares[k]).sum::<f64>() / cluster.len() as f64;
        let eigenspace = Eigenspace::new(&system, &matrices, &natural, cluster.clone(), square);
        let mut pairs = Vec::with_capacity(variables);
        for (c, (mechanism, state)) in chunks.iter().zip(&states).enumerate() {
            let rows = eigenspace.rows(&system, mechanism, state);
            pairs.extend((0..WIDTH.min(variables - c * WIDTH)).map(|k| eigenspace.derivatives(&rows, k)));
        }
        for (variable, derivatives) in split(&pairs).iter().enumerate() {
            cluster.clone().zip(derivatives).for_each(|(mode, x)| gradients[mode][variable] = *x);
        }
    }
    Ok(ModeSensitivities { squares, gradients })
}

/// The modes of one frequency, which may be repeated.
struct Eigenspace {
    /// ω² in rad²/s².
    square: f64,
    /// Mode shapes by coordinate.
    shapes: Vec<Vec<f64>>,
    /// Their reactions by multiplier.
    reactions: Vec<Vec<f64>>,
    /// Left vectors by equation.
    weights: Vec<Vec<f64>>,
}

impl Eigenspace {
    fn new(
        system: &System,
        matrices: &VibrationMatrices,
        natural: &VibrationModes,
        modes: Range<usize>,
        square: f64,
    ) -> Self {
        let column = |of: &DMatrix<f64>, k: usize| -> Vec<f64> { of.column(k).iter().copied().collect() };
        let shapes: Vec<_> = modes.clone().map(|k| column(&natural.shapes, k)).collect();
        let reactions = shapes.iter().map(|shape| matrices.reactions(shape, square, false)).collect();
        let weights = |k: usize| {
            let left = column(&natural.left, k);
            let reactions = matrices.reactions(&left, square, true);
            let weight = |unknown: &Unknown| match *unknown {
                Unknown::Coordinate(i) => left[i],
                Unknown::Multiplier(m) => reactions[m],
            };
            system.unknowns().iter().map(weight).collect()
        };
        Self { square, shapes, reactions, weights: modes.map(weights).collect() }
    }

    /// The rows of each mode, with their derivatives.
    fn rows(&self, system: &System, mechanism: &Mechanism<Dual8>, state: &State<Dual8>) -> Vec<Vec<Dual8>> {
        let rows = |(shape, reactions): (&Vec<f64>, &Vec<f64>)| {
            let accelerations: Vec<f64> = shape.iter().map(|x| -self.square * x).collect();
            let vibration = Vibration { positions: shape, accelerations: &accelerations, reactions };
            mode_rows(system, mechanism, state, &vibration)
        };
        self.shapes.iter().zip(&self.reactions).map(rows).collect()
    }

    /// The matrix of derivatives of ω² with respect to design variable `k` of the `rows`, for all pairs of modes.
    fn derivatives(&self, rows: &[Vec<Dual8>], k: usize) -> DMatrix<f64> {
        let dot = |i: usize, j: usize| self.weights[i].iter().zip(&rows[j]).map(|(x, row)| x * row.eps[k]).sum::<f64>();
        DMatrix::from_fn(rows.len(), rows.len(), |i, j| 0.5 * (dot(i, j) + dot(j, i)))
    }
}

/// The derivatives of the frequencies of an eigenspace, from the matrices of its `pairs` of modes for each variable.
///
/// Modes that do not interact are found as the eigenvectors of a combination of the matrices: all matrices are diagonal for them.
fn split(pairs: &[DMatrix<f64>]) -> Vec<Vec<f64>> {
    let weighted = pairs.iter().enumerate().map(|(k, matrix)| {
        let weight = 1.0 + (GOLDEN * (k + 1) as f64).fract();
        matrix * (weight / matrix.amax().max(f64::MIN_POSITIVE))
    });
    let Some(generic) = weighted.reduce(|a, b| a + b) else { return Vec::new() };
    let eigen = generic.symmetric_eigen();
    let mut order: Vec<usize> = (0..eigen.eigenvalues.len()).collect();
    order.sort_by(|&a, &b| eigen.eigenvalues[a].total_cmp(&eigen.eigenvalues[b]));
    let modes = eigen.eigenvectors.select_columns(&order);
    let rotated: Vec<DMatrix<f64>> = pairs.iter().map(|matrix| modes.transpose() * matrix * &modes).collect();
    let is_diagonal = |matrix: &DMatrix<f64>| {
        let largest = matrix.amax();
        let n = matrix.nrows();
        (0..n).all(|i| (0..n).all(|j| i == j || matrix[(i, j)].abs() <= NO_INTERACTION * largest))
    };
    if rotated.iter().all(is_diagonal) {
        return rotated.iter().map(|matrix| matrix.diagonal().iter().copied().collect()).collect();
    }
    let sorted = |matrix: &DMatrix<f64>| {
        let mut derivatives: Vec<f64> = matrix.clone().symmetric_eigenvalues().iter().copied().collect();
        derivatives.sort_by(f64::total_cmp);
        derivatives
    };
    pairs.iter().map(sorted).collect()
}

/// Ranges of increasing squares that count as equal.
pub(crate) fn clusters(squares: &[f64]) -> Vec<Range<usize>> {
    let mut clusters: Vec<Range<usize>> = Vec::new();
    for k in 0..squares.len() {
        match clusters.last_mut() {
            Some(last) if squares[k] - squares[last.start] <= REPEATED * squares[k].abs() => last.end = k + 1,
            _ => clusters.push(k..k + 1),
        }
    }
    clusters
}

/// The state at rest, and its derivatives for each chunk of design variables.
pub(crate) fn states_at_rest(
    system: &mut System,
    mechanism: &Mechanism<f64>,
    chunks: &[Mechanism<Dual8>],
    about: About<'_>,
    t: f64,
) -> Result<(State<f64>, Vec<State<Dual8>>)> {
    refuse_friction(mechanism, "a vibration about a state at rest")?;
    let mut values = State::built(mechanism, t);
    let projection = match about {
        About::At(state) => {
            values.copy_from(state);
            factorize_equilibrium(system, mechanism, &values)?;
            Projection::default()
        }
        About::Assembled | About::Equilibrium(_) => assemble(system, mechanism, &mut values, Assembly::default())?,
    };
    values.v.fill(0.0);
    if let About::Equilibrium(settings) = about {
        find_equilibrium(system, mechanism, &mut values, &settings)?;
    }
    let mut states = Vec::with_capacity(chunks.len());
    for chunk in chunks {
        let mut state = State::built(chunk, t);
        match about {
            About::Equilibrium(_) | About::At(_) => state = equilibrium(chunk, &values, system),
            About::Assembled if mechanism.multipliers > 0 => {
                InitialDerivatives::new(mechanism, chunk, system).project(
                    ProjectedPart::Positions,
                    &values,
                    &projection,
                    &mut state,
                )?;
            }
            About::Assembled => {}
        }
        set_values(&mut state.v, &values.v);
        set_values(&mut state.a, &values.a);
        states.push(state);
    }
    Ok((values, states))
}

/// Amplitudes of positions and accelerations by coordinate, and of reactions by multiplier.
pub(crate) struct Vibration<'a> {
    pub positions: &'a [f64],
    pub accelerations: &'a [f64],
    pub reactions: &'a [f64],
}

/// The rows of a vibration with their derivatives: K φ + M a + Φ_qᵀ μ in those of the coordinates and Φ_q φ in those of the
/// multipliers, with the positions φ, accelerations a and reactions μ.
pub(crate) fn mode_rows(
    system: &System,
    mechanism: &Mechanism<Dual8>,
    state: &State<Dual8>,
    vibration: &Vibration<'_>,
) -> Vec<Dual8> {
    let (zero, mut workspace) = (Dual8::constant(0.0), ElementWorkspace::<Jet2<Dual8>>::default());
    let mut rows = vec![zero; system.size()];
    let along = |x: Dual8, rate: f64| Jet2::new(x, Dual8::constant(rate), zero);
    for (index, instance) in mechanism.elements.iter().enumerate().filter(|(_, instance)| !instance.element.is_sensor())
    {
        // Positions, accelerations and reactions move at once: one pass gives all terms.
        let fill = |to: &mut Vec<Jet2<Dual8>>, from: &[Dual8], rate: &dyn Fn(usize) -> f64| {
            to.clear();
            to.extend(instance.coordinates.iter().map(|&i| along(from[i], rate(i))));
        };
        fill(&mut workspace.q, &state.q, &|i| vibration.positions[i]);
        fill(&mut workspace.v, &state.v, &|_| 0.0);
        fill(&mut workspace.a, &state.a, &|i| vibration.accelerations[i]);
        workspace.p.clear();
        workspace.p.extend(instance.parameters.iter().map(|&p| along(p, 0.0)));
        workspace.l.clear();
        workspace.l.extend(instance.multipliers().map(|m| along(state.l[m], vibration.reactions[m])));
        Jet2::<Dual8>::residual(instance.element.as_ref(), along(state.t, 0.0), &mut workspace);
        let n = instance.coordinates.len();
        for (local, equation) in system.rows_of(index) {
            rows[equation] += if local < n { workspace.dynamics[local].v1 } else { workspace.constraint[local - n].v1 };
        }
    }
    rows
}

/// K, M and Φ_q of vibrations about a state.
pub(crate) struct VibrationMatrices {
    /// For each equation, its unknown.
    unknowns: Vec<Unknown>,
    /// K, with Φ_q and Φ_qᵀ in the rows and columns of the multipliers.
    pub stiffness: DMatrix<f64>,
    /// M in the rows and columns of the coordinates.
    pub mass: DMatrix<f64>,
    constraint_gradients: Vec<Vec<f64>>,
}

impl VibrationMatrices {
    pub fn new(system: &mut System, mechanism: &Mechanism<f64>, values: &State<f64>) -> Self {
        let mut rows = vec![[0.0]; system.size()];
        system.assemble(mechanism, values, Linearization::statics(), &mut rows);
        let stiffness = system.dense();
        system.assemble(mechanism, values, Linearization::accelerations(), &mut rows);
        let (mass, constraint_gradients) = (system.dense(), system.constraint_jacobian(mechanism, values));
        Self { unknowns: system.unknowns().to_vec(), stiffness, mass, constraint_gradients }
    }

    /// Reactions μ of a mode, of least norm: Φ_qᵀ μ = (ω² M − K) φ, or with the transposed K for a left vector.
    pub fn reactions(&self, shape: &[f64], square: f64, transposed: bool) -> Vec<f64> {
        let mut force = vec![0.0; shape.len()];
        for (i, row) in self.unknowns.iter().enumerate() {
            let Unknown::Coordinate(c) = *row else { continue };
            for (j, column) in self.unknowns.iter().enumerate() {
                if let Unknown::Coordinate(d) = *column {
                    let stiffness = self.stiffness[if transposed { (j, i) } else { (i, j) }];
                    force[c] += (stiffness - square * self.mass[(i, j)]) * shape[d];
                }
            }
        }
        let rows = &self.constraint_gradients;
        if rows.is_empty() {
            return Vec::new();
        }
        let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
        let normal = DMatrix::from_fn(rows.len(), rows.len(), |i, j| dot(&rows[i], &rows[j]));
        let right = DVector::from_iterator(rows.len(), rows.iter().map(|row| -dot(row, &force)));
        let rounding = REDUNDANT * normal.amax();
        let reactions = normal.svd(true, true).solve(&right, rounding).expect("both sides are computed");
        reactions.iter().copied().collect()
    }
}
