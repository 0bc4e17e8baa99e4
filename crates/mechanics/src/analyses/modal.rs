//! Vibration modes: small undamped vibrations about a state.

use crate::events::unilateral::refuse_friction;
use crate::mechanism::Mechanism;
use crate::system::linearization::Linearization;
use crate::system::state::State;
use crate::system::{System, Unknown};
use crate::{Error, Result};
use error::Seconds;
use nalgebra::{Cholesky, Complex, DMatrix, DVector, Schur};

/// Natural angular frequencies (rad/s, increasing) and mode shapes about a state, without damping.
#[derive(Clone, Debug)]
pub struct VibrationModes {
    /// Angular frequencies in rad/s; −√(−ω²) for an unstable direction with ω² < 0.
    pub frequencies: Vec<f64>,
    /// Mode shapes φ, normalized by mass: one row per coordinate, one column per mode.
    pub shapes: DMatrix<f64>,
    /// Left vectors ψ with ψᵀ K = ω² ψᵀ M and ψᵀ M φ = 1: the shapes, unless forces have no potential.
    pub left: DMatrix<f64>,
    /// True if the stiffness is symmetric: all forces have a potential.
    pub is_symmetric: bool,
}

/// Difference of the stiffness from its transpose, as a fraction of its largest entry, up to which it counts as symmetric.
const SYMMETRIC: f64 = 1e-12;

/// Imaginary part of a square ω², as a fraction of it, that counts as rounding: a double eigenvalue may have one of this size.
const REAL: f64 = 1e-7;

/// Largest number of iterations for each eigenvalue.
const ITERATIONS: usize = 200;

/// Solves K φ = ω² M φ for the motions that satisfy the constraints.
///
/// K and M are the derivatives of the residual with respect to positions (with the reactions of `state`) and
/// accelerations; the constraints are eliminated by an orthogonal basis of the null space of Φ_q. Forces without a potential, such as
/// follower forces and feedback, make K unsymmetric.
///
/// # Errors
///
/// [`Error::Analysis`] if a motion that satisfies the constraints has no mass, or if two vibrations flutter: forces without a potential
/// then have a pair of complex squares ω². [`Error::Unsupported`] for dry friction that sticks.
///
/// # Sources
///
/// Bolotin, *Nonconservative Problems of the Theory of Elastic Stability* (1963).
pub fn modes(system: &mut System, mechanism: &Mechanism<f64>, state: &State<f64>) -> Result<VibrationModes> {
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
    let scaled = |stiffness: &DMatrix<f64>| &inverse * stiffness * inverse.transpose();
    let asymmetry = scaled(&((&stiffness - stiffness.transpose()) * 0.5)).amax();
    let symmetric = scaled(&((&stiffness + stiffness.transpose()) * 0.5));
    let is_symmetric = asymmetry <= SYMMETRIC * symmetric.amax();
    let eigen = match is_symmetric {
        true => Eigen::of_symmetric(symmetric),
        false => Eigen::of(scaled(&stiffness), state.t)?,
    };
    let unscaled = |vectors: &DMatrix<f64>| inverse.transpose() * vectors;
    let mut pairs =
        EigenPairs { left: eigen.left.as_ref().map(unscaled), right: unscaled(&eigen.right), squares: eigen.values };
    pairs.refine(&if is_symmetric { (&stiffness + stiffness.transpose()) * 0.5 } else { stiffness }, &mass);
    let mut order: Vec<usize> = (0..pairs.squares.len()).collect();
    order.sort_by(|&i, &j| pairs.squares[i].total_cmp(&pairs.squares[j]));
    let frequencies = order.iter().map(|&k| pairs.squares[k].abs().sqrt() * pairs.squares[k].signum()).collect();
    let by_coordinate = |vectors: &DMatrix<f64>| {
        let reduced = &basis * vectors.select_columns(&order);
        let mut vectors = DMatrix::zeros(mechanism.coordinates.len(), order.len());
        for (row, &equation) in free.iter().enumerate() {
            if let Unknown::Coordinate(i) = system.unknowns()[equation] {
                vectors.row_mut(i).copy_from(&reduced.row(row));
            }
        }
        vectors
    };
    let shapes = by_coordinate(&pairs.right);
    let left = pairs.left.as_ref().map_or_else(|| shapes.clone(), by_coordinate);
    Ok(VibrationModes { frequencies, shapes, left, is_symmetric })
}

/// Largest square that counts as rounding, relative to the largest square of the mechanism and its number of modes.
const ZERO: f64 = 1e3 * f64::EPSILON;

/// Squares ω² with their vectors in the reduced coordinates: K φ = ω² M φ, φᵀ M φ = 1, and ψᵀ K = ω² ψᵀ M, ψᵀ M φ = 1.
struct EigenPairs {
    squares: Vec<f64>,
    right: DMatrix<f64>,
    /// Left vectors ψ; `None` if they are the right ones.
    left: Option<DMatrix<f64>>,
}

impl EigenPairs {
    /// Makes the low squares as accurate as the stiffness allows, by one step of inverse iteration and the Rayleigh quotient.
    ///
    /// Eigenvalues of a full matrix have the absolute error of the largest one, and stretching modes of beams have squares that are
    /// larger by many orders of magnitude than those of bending. Squares above the geometric mean are accurate without it.
    ///
    /// # Sources
    ///
    /// Parlett, *The Symmetric Eigenvalue Problem* (1998), sections 4.6 and 4.8.
    fn refine(&mut self, stiffness: &DMatrix<f64>, mass: &DMatrix<f64>) {
        let largest = self.squares.iter().fold(0.0f64, |a, x| a.max(x.abs()));
        let least = self.squares.iter().fold(f64::INFINITY, |a, x| a.min(*x));
        let zero = ZERO * self.squares.len() as f64 * largest;
        // Free motions and instabilities make the stiffness indefinite; a shift by the lowest vibration makes it definite.
        let vibrations = self.squares.iter().copied().filter(|square| *square > zero);
        let Some(lowest) = vibrations.reduce(f64::min) else { return };
        let shift = if least > zero { 0.0 } else { lowest.max(-2.0 * least) };
        let matrix = stiffness + mass * shift;
        let transposed = self.left.is_some().then(|| matrix.transpose().lu());
        let factors = matrix.lu();
        for k in 0..self.squares.len() {
            let is_high = (self.squares[k] + shift).powi(2) >= (least + shift) * (largest + shift);
            if is_high {
                continue;
            }
            let Some(mut right) = factors.solve(&(mass * self.right.column(k))) else { continue };
            right.unscale_mut(right.dot(&(mass * &right)).sqrt());
            let mut left = right.clone();
            if let (Some(all), Some(factors)) = (&self.left, &transposed) {
                let Some(found) = factors.solve(&(mass.tr_mul(&all.column(k)))) else { continue };
                left = &found / found.dot(&(mass * &right));
            }
            let square = left.dot(&(stiffness * &right));
            if square.is_finite() && right.iter().chain(&left).all(|x| x.is_finite()) {
                self.squares[k] = square;
                self.right.set_column(k, &right);
                self.left.iter_mut().for_each(|all| all.set_column(k, &left));
            }
        }
    }
}

/// Real eigenvalues of a matrix with their unit vectors.
struct Eigen {
    values: Vec<f64>,
    right: DMatrix<f64>,
    /// Left vectors whose product with the right ones is one; `None` for a symmetric matrix, of which they are the right ones.
    left: Option<DMatrix<f64>>,
}

impl Eigen {
    fn of_symmetric(matrix: DMatrix<f64>) -> Self {
        let eigen = matrix.symmetric_eigen();
        Self { values: eigen.eigenvalues.iter().copied().collect(), right: eigen.eigenvectors, left: None }
    }

    /// By the complex Schur form, whose vectors follow by substitution, at the time `t` in s.
    fn of(matrix: DMatrix<f64>, t: f64) -> Result<Self> {
        let n = matrix.nrows();
        let failed = |why: String| {
            let remedy = "reduce the forces without a potential (follower forces, feedback), or simulate the motion";
            Error::analysis("modes", format!("{why} at t = {t}", t = Seconds(t)), remedy)
        };
        let schur = Schur::try_new(matrix.map(Complex::from), f64::EPSILON, ITERATIONS * n);
        let (basis, triangle) = schur.ok_or_else(|| failed("the eigenvalues are not found".into()))?.unpack();
        let values = triangle.diagonal();
        if let Some(square) = values.iter().find(|square| square.im.abs() > REAL * square.norm()) {
            let (re, im) = (square.re, square.im.abs());
            let why = format!("two vibrations flutter: their squares ω² are {re:.6e} ± {im:.6e} i (rad/s)²");
            return Err(failed(why));
        }
        let smallest = f64::EPSILON * values.iter().fold(0.0f64, |a, x| a.max(x.norm())).max(f64::MIN_POSITIVE);
        let mut right = DMatrix::zeros(n, n);
        for k in 0..n {
            let mut vector = DVector::zeros(n);
            vector[k] = Complex::from(1.0);
            for i in (0..k).rev() {
                let sum: Complex<f64> = (i + 1..=k).map(|j| triangle[(i, j)] * vector[j]).sum();
                let difference = triangle[(i, i)] - triangle[(k, k)];
                vector[i] = -sum / if difference.norm() > smallest { difference } else { Complex::from(smallest) };
            }
            let vector = &basis * vector;
            // A real vector times a complex number.
            let largest = vector.iter().copied().reduce(|a, b| if b.norm() > a.norm() { b } else { a });
            let real = vector.map(|x| (x / largest.unwrap_or(Complex::from(1.0))).re);
            right.set_column(k, &real.normalize());
        }
        let inverse = right.clone().try_inverse().filter(|inverse| inverse.iter().all(|x| x.is_finite()));
        let inverse =
            inverse.ok_or_else(|| failed("two vibrations are about to flutter: they have one shape".into()))?;
        Ok(Self { values: values.iter().map(|square| square.re).collect(), right, left: Some(inverse.transpose()) })
    }
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
