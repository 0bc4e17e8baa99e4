//! Small vibrations about a state.

use crate::mechanism::Mechanism;
use crate::system::linearization::Linearization;
use crate::system::state::State;
use crate::system::{System, Unknown};
use crate::{Error, Result};
use nalgebra::{Cholesky, DMatrix};

/// Natural angular frequencies (rad/s, rising) and mode shapes about a state, damping left out.
#[derive(Clone, Debug)]
pub struct Modes {
    /// Angular frequencies; an unstable direction has a negative one (minus the square root of −ω²).
    pub frequencies: Vec<f64>,
    /// One column per mode, one row per coordinate, mass-normalised.
    pub shapes: DMatrix<f64>,
}

/// Solves K φ = ω² M φ on the motions that the constraints allow.
///
/// K and M are the derivatives of the residual with respect to positions (with the reactions of `state`) and
/// accelerations; the constraints are eliminated by an orthogonal basis of the null space of Φ_q.
///
/// **Errors.** [`Error::Analysis`] if an allowed motion has no mass.
pub fn modes(system: &mut System, mechanism: &Mechanism<f64>, state: &State<f64>) -> Result<Modes> {
    let mut rows = vec![[0.0]; system.size()];
    system.assemble(mechanism, state, Linearization::statics(), &mut rows);
    let stiffness = system.dense();
    // Without reactions: with them the rows of the joints would add their geometric stiffness to the mass.
    let unloaded = State { l: vec![0.0; state.l.len()], ..state.clone() };
    system.assemble(mechanism, &unloaded, Linearization::accelerations(), &mut rows);
    let mass = system.dense();
    let free: Vec<usize> =
        (0..system.size()).filter(|&e| matches!(system.unknowns()[e], Unknown::Coordinate(_))).collect();
    let held: Vec<usize> = (0..system.size()).filter(|e| !free.contains(e)).collect();
    let pick = |m: &DMatrix<f64>, rows: &[usize]| m.select_rows(rows).select_columns(&free);
    let basis = null_space(&pick(&stiffness, &held), free.len());
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

/// An orthonormal basis of the vectors that the rows of `held` map to zero.
fn null_space(held: &DMatrix<f64>, n: usize) -> DMatrix<f64> {
    if held.nrows() == 0 {
        return DMatrix::identity(n, n);
    }
    let gram = held.transpose() * held;
    let largest = gram.amax().max(f64::MIN_POSITIVE);
    let eigen = gram.symmetric_eigen();
    let null: Vec<usize> = (0..n).filter(|&k| eigen.eigenvalues[k].abs() <= 1e-12 * largest).collect();
    eigen.eigenvectors.select_columns(&null)
}
