//! Vibration modes: small undamped vibrations about a state.

use crate::events::unilateral::refuse_friction;
use crate::mechanism::Mechanism;
use crate::system::linearization::Linearization;
use crate::system::state::State;
use crate::system::{System, Unknown};
use crate::{Error, Result};
use nalgebra::{Cholesky, DMatrix};

/// Natural angular frequencies (rad/s, increasing) and mode shapes about a state, without damping.
#[derive(Clone, Debug)]
pub struct Modes {
    /// Angular frequencies in rad/s; −√(−ω²) for an unstable direction with ω² < 0.
    pub frequencies: Vec<f64>,
    /// Mode shapes, normalized by mass: one row per coordinate, one column per mode.
    pub shapes: DMatrix<f64>,
}

/// Solves K φ = ω² M φ for the motions that satisfy the constraints.
///
/// K and M are the derivatives of the residual with respect to positions (with the reactions of `state`) and
/// accelerations; the constraints are eliminated by an orthogonal basis of the null space of Φ_q.
///
/// # Errors
///
/// [`Error::Analysis`] if a motion that satisfies the constraints has no mass; [`Error::Unsupported`] for dry friction that sticks.
pub fn modes(system: &mut System, mechanism: &Mechanism<f64>, state: &State<f64>) -> Result<Modes> {
    refuse_friction(mechanism, "a vibration about a state at rest")?;
    let mut rows = vec![[0.0]; system.size()];
    system.assemble(mechanism, state, Linearization::statics(), &mut rows);
    let stiffness = system.dense();
    // Reactions would add the geometric stiffness of the joints to the mass matrix.
    let unloaded = State { l: vec![0.0; state.l.len()], ..state.clone() };
    system.assemble(mechanism, &unloaded, Linearization::accelerations(), &mut rows);
    let mass = system.dense();
    let free: Vec<usize> =
        (0..system.size()).filter(|&e| matches!(system.unknowns()[e], Unknown::Coordinate(_))).collect();
    let constrained: Vec<usize> = (0..system.size()).filter(|e| !free.contains(e)).collect();
    let pick = |m: &DMatrix<f64>, rows: &[usize]| m.select_rows(rows).select_columns(&free);
    let basis = null_space(&pick(&stiffness, &constrained), free.len());
    let reduce = |m: &DMatrix<f64>| basis.transpose() * pick(m, &free) * &basis;
    let (stiffness, mass) = (reduce(&stiffness), reduce(&mass));
    let lower = Cholesky::new((&mass + mass.transpose()) * 0.5)
        .ok_or_else(|| Error::analysis("modes", "an allowed motion has no mass", "give every free coordinate mass"))?;
    let inverse = lower.l().try_inverse().expect("a Cholesky factor is regular");
    let scaled = &inverse * ((&stiffness + stiffness.transpose()) * 0.5) * inverse.transpose();
    let eigen = scaled.symmetric_eigen();
    let mut order: Vec<usize> = (0..eigen.eigenvalues.len()).collect();
    order.sort_by(|&i, &j| eigen.eigenvalues[i].total_cmp(&eigen.eigenvalues[j]));
    let frequencies =
        order.iter().map(|&k| eigen.eigenvalues[k].abs().sqrt() * eigen.eigenvalues[k].signum()).collect();
    let reduced = &basis * inverse.transpose() * eigen.eigenvectors.select_columns(&order);
    let mut shapes = DMatrix::zeros(mechanism.coordinates.len(), order.len());
    for (row, &equation) in free.iter().enumerate() {
        if let Unknown::Coordinate(i) = system.unknowns()[equation] {
            shapes.row_mut(i).copy_from(&reduced.row(row));
        }
    }
    Ok(Modes { frequencies, shapes })
}

/// Orthonormal basis of the null space of `constraints`, with `n` columns.
fn null_space(constraints: &DMatrix<f64>, n: usize) -> DMatrix<f64> {
    if constraints.nrows() == 0 {
        return DMatrix::identity(n, n);
    }
    let gram = constraints.transpose() * constraints;
    let largest = gram.amax().max(f64::MIN_POSITIVE);
    let eigen = gram.symmetric_eigen();
    let null: Vec<usize> = (0..n).filter(|&k| eigen.eigenvalues[k].abs() <= 1e-12 * largest).collect();
    eigen.eigenvectors.select_columns(&null)
}
