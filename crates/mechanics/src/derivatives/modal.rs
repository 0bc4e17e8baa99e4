//! Derivatives of natural frequencies with respect to the design.

use crate::Result;
use crate::analyses::modal::modes;
use crate::analyses::statics::{Statics, find_equilibrium};
use crate::derivatives::forward::initial_conditions::{InitialDerivatives, ProjectedPart, equilibrium};
use crate::derivatives::seeding::{build_chunks, set_values};
use crate::elements::element::ElementWorkspace;
use crate::events::unilateral::refuse_friction;
use crate::initial_conditions::{Assembly, assemble};
use crate::mechanism::scalars::{Dual8, ElementScalar, Jet2};
use crate::mechanism::{Mechanism, ParametricMechanism};
use crate::system::state::State;
use crate::system::{System, Unknown};
use autodiff::WIDTH;
use nalgebra::{DMatrix, DVector};
use std::ops::Range;

/// State at rest about which the equations are linearized.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum About {
    /// The assembled initial positions, without reactions: no prestress.
    Assembled,
    /// The static equilibrium, with its reactions.
    Equilibrium(Statics),
}

/// Squares of natural frequencies and their derivatives.
#[derive(Clone, Debug, PartialEq)]
pub struct ModeSensitivities {
    /// ω² in rad²/s², increasing.
    pub squares: Vec<f64>,
    /// `gradients[mode]` is the gradient of ω² with respect to the design variables; dω/db is the gradient over 2 ω.
    ///
    /// A repeated frequency has only one-sided derivatives along each variable. These are sorted for each variable
    /// separately: those of mode k are those of the k-th frequency while the variable grows. They do not add up for several
    /// variables at once.
    pub gradients: Vec<Vec<f64>>,
}

/// Squares whose relative difference is smaller count as one repeated frequency.
const REPEATED: f64 = 1e-7;

/// Natural frequencies of `model` at the design `b` and time `t`, with exact derivatives.
///
/// For a mode K φ + Φ_qᵀ μ = ω² M φ, Φ_q φ = 0, φᵀ M φ = 1, with K and M symmetric,
///
/// $$ \frac{d\omega^2}{db} = \varphi^T\left(\frac{dK}{db} - \omega^2\frac{dM}{db}\right)\varphi
///    + 2\,\mu^T\frac{d\Phi_q}{db}\varphi $$
///
/// where K, M and Φ_q depend on the design also through the state. One evaluation of every element gives all terms, in
/// numbers with derivatives along φ and with respect to [`WIDTH`] design variables. For a repeated frequency the
/// derivatives are the eigenvalues of the matrix of this expression for all pairs of its modes.
///
/// # Errors
/// As [`modes`], [`assemble`] and [`equilibria`](crate::analyses::statics::equilibria).
///
/// # Sources
/// Fox & Kapoor, *AIAA J.* 6 (1968) 2426–2429; for repeated frequencies Seyranian, Lund & Olhoff, *Struct. Optim.* 8
/// (1994) 207–227.
pub fn differentiate_modes<M: ParametricMechanism>(
    model: &M,
    b: &[f64],
    about: About,
    t: f64,
) -> Result<ModeSensitivities> {
    let mechanism = model.build(b)?;
    differentiate_seeded(&mechanism, &build_chunks(model, b, &mechanism)?, b.len(), about, t)
}

/// Squares ω² of the natural angular frequencies in rad²/s², increasing, without derivatives.
///
/// # Errors
/// As [`differentiate_modes`].
pub fn squared_frequencies(mechanism: &Mechanism<f64>, about: About, t: f64) -> Result<Vec<f64>> {
    Ok(differentiate_seeded(mechanism, &[], 0, about, t)?.squares)
}

/// Differentiates the modes. Not generic over the model: compiled once, in this crate.
fn differentiate_seeded(
    mechanism: &Mechanism<f64>,
    chunks: &[Mechanism<Dual8>],
    variables: usize,
    about: About,
    t: f64,
) -> Result<ModeSensitivities> {
    let mut system = System::at(mechanism, t)?;
    let (values, states) = states_at_rest(&mut system, mechanism, chunks, about, t)?;
    let natural = modes(&mut system, mechanism, &values)?;
    let squares: Vec<f64> = natural.frequencies.iter().map(|w| w * w.abs()).collect();
    let constraint_gradients = system.constraint_jacobian(mechanism, &values);
    let mut gradients = vec![vec![0.0; variables]; squares.len()];
    for cluster in clusters(&squares) {
        let square = cluster.clone().map(|k| squares[k]).sum::<f64>() / cluster.len() as f64;
        let shapes: Vec<Vec<f64>> =
            cluster.clone().map(|k| natural.shapes.column(k).iter().copied().collect()).collect();
        for (c, (mechanism, state)) in chunks.iter().zip(&states).enumerate() {
            let rows = |shape: &Vec<f64>| {
                let accelerations: Vec<f64> = shape.iter().map(|x| -square * x).collect();
                let reactions = vec![0.0; state.l.len()];
                let vibration = Vibration { positions: shape, accelerations: &accelerations, reactions: &reactions };
                mode_rows(&system, mechanism, state, &vibration)
            };
            let rows: Vec<_> = shapes.iter().map(rows).collect();
            let weights =
                |(shape, rows): (&Vec<f64>, &Vec<Dual8>)| weights(&system, &constraint_gradients, shape, rows);
            let weights: Vec<_> = shapes.iter().zip(&rows).map(weights).collect();
            for k in 0..WIDTH.min(variables - c * WIDTH) {
                let dot =
                    |i: usize, j: usize| weights[i].iter().zip(&rows[j]).map(|(x, row)| x * row.eps[k]).sum::<f64>();
                let pairs = DMatrix::from_fn(rows.len(), rows.len(), |i, j| 0.5 * (dot(i, j) + dot(j, i)));
                let mut derivatives: Vec<f64> = pairs.symmetric_eigenvalues().iter().copied().collect();
                derivatives.sort_by(f64::total_cmp);
                cluster.clone().zip(derivatives).for_each(|(mode, x)| gradients[mode][c * WIDTH + k] = x);
            }
        }
    }
    Ok(ModeSensitivities { squares, gradients })
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
    about: About,
    t: f64,
) -> Result<(State<f64>, Vec<State<Dual8>>)> {
    refuse_friction(mechanism, "a vibration about a state at rest")?;
    let mut values = State::built(mechanism, t);
    let projection = assemble(system, mechanism, &mut values, Assembly::default())?;
    values.v.fill(0.0);
    if let About::Equilibrium(settings) = about {
        find_equilibrium(system, mechanism, &mut values, &settings)?;
    }
    let mut states = Vec::with_capacity(chunks.len());
    for chunk in chunks {
        let mut state = State::built(chunk, t);
        match about {
            About::Equilibrium(_) => state = equilibrium(chunk, &values, system),
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

/// Weights of a mode's rows: φ, and 2 μ from Φ_qᵀ μ = (ω² M − K) φ by least squares.
fn weights(system: &System, constraint_gradients: &[Vec<f64>], shape: &[f64], rows: &[Dual8]) -> Vec<f64> {
    let mut force = vec![0.0; shape.len()];
    for (unknown, row) in system.unknowns().iter().zip(rows) {
        if let Unknown::Coordinate(i) = *unknown {
            force[i] = row.re;
        }
    }
    let multipliers = modal_multipliers(constraint_gradients, &force);
    let value = |unknown: &Unknown| match *unknown {
        Unknown::Coordinate(i) => shape[i],
        Unknown::Multiplier(m) => 2.0 * multipliers[m],
    };
    system.unknowns().iter().map(value).collect()
}

/// Reactions μ of a mode, from Φ_qᵀ μ = −`force` by least squares, where the force is (K − ω² M) φ by coordinate.
pub(crate) fn modal_multipliers(constraint_gradients: &[Vec<f64>], force: &[f64]) -> Vec<f64> {
    let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
    let (n, rows) = (constraint_gradients.len(), constraint_gradients);
    let normal = DMatrix::from_fn(n, n, |i, j| dot(&rows[i], &rows[j]));
    let right = DVector::from_iterator(n, rows.iter().map(|row| -dot(row, force)));
    let multipliers = if n == 0 { right } else { normal.lu().solve(&right).unwrap_or(right) };
    multipliers.iter().copied().collect()
}
