//! Least-norm solutions of saddle-point systems with redundant constraints.

use nalgebra::{DMatrix, DVector};
use std::sync::Arc;

/// Entries of a saddle-point matrix A = \[K Φᵀ; Φ 0\] whose constraints may be redundant, for solutions of A x = b.
///
/// If constraints depend on each other, A is singular, and multipliers are not unique. Instead of A the matrix
/// A − ε E is factorized, where E is one in the diagonal of the multipliers, and the solution is corrected,
///
/// $$ (A - \varepsilon E)\,\delta = b - A x ,\qquad x \leftarrow x + \delta , $$
///
/// from x = 0 (proximal point iteration, or augmented Lagrangian method). Coordinates converge to the unique solution
/// and multipliers to the one of least norm, by a factor ε/(ε + σ) in each correction, where σ are the nonzero
/// eigenvalues of Φ K⁻¹ Φᵀ.
///
/// Constraints that depend on each other in all positions that satisfy them are independent in others, such as the stages of explicit
/// steps, where they contradict each other slightly. Directions U of the multipliers without effect, Φᵀ U = 0 in a consistent position
/// near by, can be excluded from the solution, Uᵀ λ = 0, by solving with
///
/// $$ \begin{bmatrix} A - \varepsilon E & U \\ U^T & 0 \end{bmatrix} , $$
///
/// instead.
///
/// # Sources
///
/// Rockafellar, *SIAM J. Control Optim.* 14 (1976) 877–898; Bayo & Ledesma, *Nonlinear Dyn.* 9 (1996) 113–130.
#[derive(Clone, Debug)]
pub(crate) struct Redundancy {
    /// Row, column and slot of every entry.
    places: Vec<[usize; 3]>,
    /// Slots of the multipliers' diagonal entries.
    diagonal: Vec<usize>,
    /// For each unknown, true for a multiplier.
    multipliers: Vec<bool>,
    /// The entries of A.
    entries: Vec<f64>,
    /// ε of the last matrix.
    shift: f64,
    /// Directions of the multipliers that solutions do not have.
    excluded: Arc<[Vec<f64>]>,
    /// The exclusion of these from solutions with the shifted matrix and with its transpose.
    exclusions: [Exclusion; 2],
}

/// The exclusion of directions U from solutions with a matrix B.
#[derive(Clone, Debug, Default)]
struct Exclusion {
    /// B⁻¹ U.
    responses: Vec<Vec<f64>>,
    /// (Uᵀ B⁻¹ U)⁻¹.
    inverse: DMatrix<f64>,
}

/// ε as a fraction of the smallest estimated diagonal entry of Φ K⁻¹ Φᵀ.
const SHIFT: f64 = 1e-4;

/// Stiffness of a coordinate, and entry of a constraint, relative to the largest one, up to which it counts as rounding.
const NEGLIGIBLE: f64 = 1e-12;

/// Change of a direction of unit length in one power iteration at which it counts as converged, and up to which it is one without effect.
const CONVERGED: f64 = 1e-11;
const WITHOUT_EFFECT: f64 = 1e-6;

/// Largest number of power iterations for one direction.
const MOST_ITERATIONS: usize = 12;

/// Multiples of the golden ratio have fractional parts that are distributed evenly.
const GOLDEN: f64 = 0.618_033_988_749_895;

/// Largest number of corrections.
const MOST_CORRECTIONS: usize = 40;

/// Size of a correction, as a fraction of the solution, at which the iteration ends.
const ROUNDING: f64 = 1e-15;

impl Redundancy {
    /// For the pattern `rows[i]` of columns, where `slot(i, j)` is the position of an entry.
    pub fn new(rows: &[Vec<usize>], multipliers: &[bool], slot: impl Fn(usize, usize) -> usize) -> Self {
        let places: Vec<_> = rows.iter().enumerate().flat_map(|(i, row)| row.iter().map(move |&j| [i, j])).collect();
        let places: Vec<_> = places.into_iter().map(|[i, j]| [i, j, slot(i, j)]).collect();
        let diagonal = (0..rows.len()).filter(|&i| multipliers[i]).map(|i| slot(i, i)).collect();
        Self {
            entries: vec![0.0; places.len()],
            places,
            diagonal,
            multipliers: multipliers.to_vec(),
            shift: 0.0,
            excluded: Arc::default(),
            exclusions: Default::default(),
        }
    }

    /// Excludes `directions` of the multipliers from the solutions of matrices that are factorized from now on.
    pub fn exclude(&mut self, directions: &Arc<[Vec<f64>]>) {
        self.excluded = Arc::clone(directions);
    }

    /// Prepares the exclusions, where `solve` solves with the shifted matrix, or with its transpose if its second argument is true.
    pub fn prepare(&mut self, mut solve: impl FnMut(&mut [[f64; 1]], bool)) {
        let count = self.excluded.len();
        for (k, exclusion) in self.exclusions.iter_mut().enumerate() {
            exclusion.responses.clear();
            for direction in self.excluded.iter() {
                let mut b: Vec<[f64; 1]> = direction.iter().map(|x| [*x]).collect();
                solve(&mut b, k == 1);
                exclusion.responses.push(b.into_flattened());
            }
            let entry = |i: usize, j: usize| dot(&self.excluded[i], &exclusion.responses[j]);
            let inverse = DMatrix::from_fn(count, count, entry).try_inverse();
            exclusion.inverse = inverse.unwrap_or_else(|| DMatrix::from_element(count, count, f64::NAN));
        }
    }

    /// Orthonormal basis of the directions of multipliers without effect, Φᵀ U = 0, where `solve` solves with the shifted matrix.
    ///
    /// They are the eigenvectors of ε (Φ K⁻¹ Φᵀ + ε)⁻¹ with the eigenvalue one. Those of all other directions are near zero, so that
    /// power iteration needs few steps.
    pub fn null_space(&self, mut solve: impl FnMut(&mut [[f64; 1]])) -> Arc<[Vec<f64>]> {
        let mut basis: Vec<Vec<f64>> = Vec::new();
        let mut b = vec![[0.0]; self.multipliers.len()];
        while basis.len() < self.diagonal.len() {
            // Any start that is not orthogonal to all of these directions finds one.
            let start = |i: usize| 0.5 + (GOLDEN * ((i + 1) * (basis.len() + 1)) as f64).fract();
            let all = self.multipliers.iter().enumerate();
            let mut direction: Vec<f64> = all.map(|(i, is_one)| if *is_one { start(i) } else { 0.0 }).collect();
            let mut change = f64::INFINITY;
            for _ in 0..MOST_ITERATIONS {
                orthonormalize(&mut direction, &basis);
                b.iter_mut().zip(&direction).for_each(|(b, x)| *b = [-self.shift * x]);
                solve(&mut b);
                let image = |i: usize| if self.multipliers[i] { b[i][0] } else { 0.0 };
                change = direction.iter().enumerate().map(|(i, x)| (image(i) - x).powi(2)).sum::<f64>().sqrt();
                direction.iter_mut().enumerate().for_each(|(i, x)| *x = image(i));
                if change <= CONVERGED {
                    break;
                }
            }
            if !(change <= WITHOUT_EFFECT) {
                break;
            }
            orthonormalize(&mut direction, &basis);
            basis.push(direction);
        }
        basis.into()
    }

    /// Stores `matrix` and subtracts ε from the diagonal of its multipliers.
    pub fn shift(&mut self, matrix: &mut [f64]) {
        self.entries.iter_mut().zip(&self.places).for_each(|(entry, place)| *entry = matrix[place[2]]);
        let n = self.multipliers.len();
        let (mut stiffness, mut compliance) = (vec![0.0f64; n], vec![0.0f64; n]);
        let entries = || self.places.iter().zip(&self.entries);
        // In equilibria K can have zeros on its diagonal, and rounding errors.
        for ([i, ..], entry) in entries().filter(|([i, j, _], _)| !self.multipliers[*i] && !self.multipliers[*j]) {
            stiffness[*i] = stiffness[*i].max(entry.abs());
        }
        let least = NEGLIGIBLE * stiffness.iter().fold(0.0f64, |a, k| a.max(*k));
        let gradients = || entries().filter(|([i, j, _], _)| self.multipliers[*i] && !self.multipliers[*j]);
        let mut largest = vec![0.0f64; n];
        gradients().for_each(|([i, ..], entry)| largest[*i] = largest[*i].max(entry.abs()));
        for ([i, j, _], entry) in gradients() {
            if stiffness[*j] > least && entry.abs() > NEGLIGIBLE * largest[*i] {
                compliance[*i] += entry * entry / stiffness[*j];
            }
        }
        let smallest = compliance.into_iter().filter(|x| *x > 0.0).fold(f64::INFINITY, f64::min);
        let shift = SHIFT * if smallest.is_finite() { smallest } else { 1.0 };
        self.diagonal.iter().for_each(|&slot| matrix[slot] -= shift);
        self.shift = shift;
    }

    /// Solves A X = B in place, or Aᵀ X = B if `transposed`, where `solve` solves with the shifted matrix.
    pub fn correct<const W: usize>(
        &self,
        b: &mut [[f64; W]],
        transposed: bool,
        mut solve_shifted: impl FnMut(&mut [[f64; W]]),
    ) {
        let mut solve = |b: &mut [[f64; W]]| {
            solve_shifted(b);
            self.remove_excluded(b, transposed);
        };
        let right = b.to_vec();
        solve(b);
        let (mut change, mut columns) = (right.clone(), [CorrectionProgress::default(); W]);
        for _ in 0..MOST_CORRECTIONS {
            change.copy_from_slice(&right);
            for (&[i, j, _], entry) in self.places.iter().zip(&self.entries) {
                let (row, column) = if transposed { (j, i) } else { (i, j) };
                let x = b[column];
                change[row].iter_mut().zip(x).for_each(|(r, x)| *r -= entry * x);
            }
            solve(&mut change);
            let sizes = self.largest(&change);
            let solutions = self.largest(b);
            for (k, progress) in columns.iter_mut().enumerate().filter(|(_, progress)| !progress.is_done) {
                if progress.adds([sizes[0][k], sizes[1][k]], [solutions[0][k], solutions[1][k]]) {
                    b.iter_mut().zip(&change).for_each(|(x, change)| x[k] += change[k]);
                }
            }
            if columns.iter().all(|progress| progress.is_done) {
                return;
            }
        }
    }

    /// Turns solutions with the shifted matrix, or with its transpose, into those of the bordered matrix.
    fn remove_excluded<const W: usize>(&self, b: &mut [[f64; W]], transposed: bool) {
        let Exclusion { responses, inverse } = &self.exclusions[usize::from(transposed)];
        for lane in (0..W).take_while(|_| !responses.is_empty()) {
            let parts = self.excluded.iter().map(|direction| b.iter().zip(direction).map(|(b, u)| b[lane] * u).sum());
            let factors = inverse * DVector::from_iterator(responses.len(), parts);
            for (response, factor) in responses.iter().zip(factors.iter()) {
                b.iter_mut().zip(response).for_each(|(b, x)| b[lane] -= factor * x);
            }
        }
    }

    /// Largest absolute value of the coordinates and of the multipliers, column by column.
    fn largest<const W: usize>(&self, rows: &[[f64; W]]) -> [[f64; W]; 2] {
        let mut largest = [[0.0f64; W]; 2];
        for (row, &is_multiplier) in rows.iter().zip(&self.multipliers) {
            let largest = &mut largest[usize::from(is_multiplier)];
            largest.iter_mut().zip(row).for_each(|(largest, x)| *largest = largest.max(x.abs()));
        }
        largest
    }
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

/// Makes `direction` orthogonal to the `basis`, and its length one.
fn orthonormalize(direction: &mut [f64], basis: &[Vec<f64>]) {
    for other in basis {
        let share = dot(direction, other);
        direction.iter_mut().zip(other).for_each(|(x, y)| *x -= share * y);
    }
    let length = dot(direction, direction).sqrt();
    direction.iter_mut().for_each(|x| *x /= length);
}

/// Progress of the corrections of one column: of its coordinates and of its multipliers.
#[derive(Clone, Copy)]
struct CorrectionProgress {
    /// Sizes of the last correction.
    previous: [f64; 2],
    is_done: bool,
}

impl Default for CorrectionProgress {
    fn default() -> Self {
        Self { previous: [f64::INFINITY; 2], is_done: false }
    }
}

impl CorrectionProgress {
    /// Returns whether to add a correction of the given sizes to a solution of these sizes.
    ///
    /// Corrections end at the size of rounding errors, or when they decrease no more: what remains is the part of the
    /// right-hand side that contradicts the constraints, which is a rounding error as well.
    fn adds(&mut self, sizes: [f64; 2], solution: [f64; 2]) -> bool {
        let is_small = |k: usize| sizes[k] <= ROUNDING * solution[k];
        let is_stuck = |k: usize| !(sizes[k] < 0.5 * self.previous[k]);
        self.is_done = (0..2).all(|k| is_small(k) || is_stuck(k));
        let is_useful = (0..2).any(|k| !is_stuck(k));
        self.previous = sizes;
        is_useful
    }
}

#[cfg(test)]
mod tests {
    use crate::linalg::factor::Factor;

    /// Two masses that are held twice by the same constraint: each of the multipliers carries half.
    #[test]
    fn redundant_multipliers_share_the_reaction() {
        let rows: Vec<Vec<usize>> = vec![vec![0, 2, 3], vec![1, 2, 3], vec![0, 1, 2, 3], vec![0, 1, 2, 3]];
        let mut factor = Factor::new(&rows, &[false, false, true, true]);
        factor.allow_redundancy(&rows, &[false, false, true, true]);
        let values = [[2.0, 0.0, 1.0, 1.0], [0.0, 3.0, -1.0, -1.0], [1.0, -1.0, 0.0, 0.0], [1.0, -1.0, 0.0, 0.0]];
        let mut assembled = || {
            factor.entries_mut().fill(0.0);
            for (i, row) in rows.iter().enumerate() {
                for &j in row {
                    let slot = factor.slot(i, j);
                    factor.entries_mut()[slot] = values[i][j];
                }
            }
            factor.factorize().unwrap();
            let mut b = [[10.0], [0.0], [0.5], [0.5]];
            let mut c = b;
            factor.solve(&mut b);
            factor.solve_transposed(&mut c);
            (b, c)
        };
        // 2 a + λ = 10, 3 b − λ = 0, a − b = 1/2: λ = 5.4.
        let expected = [2.3, 1.8, 2.7, 2.7];
        let (b, c) = assembled();
        for k in 0..4 {
            // Rounding errors of the right-hand side contradict the constraints; they are divided by ε.
            let tolerance = if k < 2 { 1e-14 } else { 1e-11 };
            assert!((b[k][0] - expected[k]).abs() < tolerance, "{b:?}");
            assert!((c[k][0] - expected[k]).abs() < tolerance, "{c:?}");
        }
    }

    /// Masses held by two constraints that depend on each other in one position, where the multipliers (1, −1) have no effect, and
    /// contradict each other by δ in another one. There only the sum of the constraints counts.
    #[test]
    fn excluded_multipliers_leave_the_sum_of_the_constraints() {
        let rows: Vec<Vec<usize>> = vec![vec![0, 2, 3], vec![1, 2, 3], vec![0, 1, 2, 3], vec![0, 1, 2, 3]];
        let mut factor = Factor::new(&rows, &[false, false, true, true]);
        factor.allow_redundancy(&rows, &[false, false, true, true]);
        let assemble = |factor: &mut Factor, δ: f64| {
            let second = -1.0 - δ;
            let values =
                [[2.0, 0.0, 1.0, 1.0], [0.0, 3.0, -1.0, second], [1.0, -1.0, 0.0, 0.0], [1.0, second, 0.0, 0.0]];
            factor.entries_mut().fill(0.0);
            for (i, row) in rows.iter().enumerate() {
                for &j in row {
                    let slot = factor.slot(i, j);
                    factor.entries_mut()[slot] = values[i][j];
                }
            }
            factor.factorize().unwrap();
        };
        assemble(&mut factor, 0.0);
        let directions = factor.null_space();
        let found: Vec<f64> = directions.iter().flatten().map(|x| x * directions[0][2].signum()).collect();
        let half = 0.5f64.sqrt();
        assert!(found.iter().zip([0.0, 0.0, half, -half]).all(|(x, y)| (x - y).abs() < 1e-12), "{found:?}");
        factor.exclude(&directions);
        let δ = 0.1;
        assemble(&mut factor, δ);
        for transposed in [false, true] {
            let mut b = [[10.0], [0.0], [0.5], [0.5]];
            if transposed {
                factor.solve_transposed(&mut b)
            } else {
                factor.solve(&mut b)
            }
            // a + λ = 5, 3 b = (2 + δ) λ, 2 a − (2 + δ) b = 1.
            let s = 2.0 + δ;
            let λ = 9.0 / (2.0 + s * s / 3.0);
            let expected = [5.0 - λ, s * λ / 3.0, λ, λ];
            assert!(b.iter().zip(expected).all(|(x, y)| (x[0] - y).abs() < 1e-12), "{b:?} for {expected:?}");
        }
    }
}
