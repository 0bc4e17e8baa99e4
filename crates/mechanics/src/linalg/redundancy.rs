//! Least-norm solutions of saddle-point systems with redundant constraints.

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
}

/// ε as a fraction of the smallest estimated diagonal entry of Φ K⁻¹ Φᵀ.
const SHIFT: f64 = 1e-4;

/// Stiffness of a coordinate, and entry of a constraint, relative to the largest one, up to which it counts as rounding.
const NEGLIGIBLE: f64 = 1e-12;

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
        Self { entries: vec![0.0; places.len()], places, diagonal, multipliers: multipliers.to_vec() }
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
    }

    /// Solves A X = B in place, or Aᵀ X = B if `transposed`, where `solve` solves with the shifted matrix.
    pub fn correct<const W: usize>(
        &self,
        b: &mut [[f64; W]],
        transposed: bool,
        mut solve: impl FnMut(&mut [[f64; W]]),
    ) {
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
}
