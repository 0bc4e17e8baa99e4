//! The Newton step of the perturbed optimality conditions, reduced to n or to m unknowns.

use super::condensed_kkt::CondensedKkt;
use super::conditions::{LocalDerivatives, PerturbedConditions, PrimalDualIterate};
use nalgebra::{DMatrix, DVector};

/// Smallest diagonal entry of the condensed matrix.
const SMALLEST_DIAGONAL: f64 = 1e-14;

/// The step towards the conditions with λ s = ξ (x − l) = η (u − x) = μ; `None` if the system is singular.
///
/// With D = ∂²L + ξ/(x − l) + η/(u − x), S = s/λ and the residuals a and b,
///
/// $$ D\,dx + G^T dλ = a,\qquad G\,dx - S\,dλ = -b , $$
///
/// which becomes (S + G D⁻¹ Gᵀ) dλ = G D⁻¹ a + b if there are few rows, and (D + Gᵀ S⁻¹ G) dx = a − Gᵀ S⁻¹ b if there
/// are many. D is a diagonal, or a diagonal and a few outer products.
///
/// # Sources
/// Svanberg, *MMA and GCMMA – two methods for nonlinear optimization* (2007), section 5, without the
/// artificial variables.
pub(super) fn step(
    conditions: &PerturbedConditions<'_>,
    p: &PrimalDualIterate,
    at: &LocalDerivatives,
    μ: f64,
) -> Option<PrimalDualIterate> {
    let (n, m) = (p.x.len(), p.λ.len());
    let (mut diagonal, mut a) = (vec![1.0; n], DVector::zeros(n));
    for j in (0..n).filter(|&j| !conditions.fixed[j]) {
        let (below, above) = conditions.gaps(&p.x, j);
        diagonal[j] = (at.curvature[j] + p.ξ[j] / below + p.η[j] / above).max(SMALLEST_DIAGONAL);
        a[j] = -at.lagrangian_gradient[j] + μ / below - μ / above;
    }
    let (columns, weights) = conditions.outer_products();
    let g = &at.gradients.values.rows;
    let system = NewtonSystem {
        fixed: &conditions.fixed,
        rows: &at.gradients.rows,
        matrix: CondensedKkt::new(diagonal, columns, weights),
        slack_ratios: (0..m).map(|i| if conditions.equality[i] { 0.0 } else { p.s[i] / p.λ[i] }).collect(),
        a,
        b: DVector::from_fn(m, |i, _| g[i] + if conditions.equality[i] { 0.0 } else { μ / p.λ[i] }),
    };
    let rows_are_many = m > n && !conditions.equality.contains(&true);
    let (dx, dλ) = if rows_are_many {
        system.by_variables()?
    } else if system.matrix.coupling.is_some() {
        system.by_coupled_rows()?
    } else {
        system.by_rows()?
    };
    Some(complete(conditions, p, dx, dλ, &system.slack_ratios, μ))
}

/// The linear system of a Newton step, reduced to dx and dλ.
struct NewtonSystem<'a> {
    fixed: &'a [bool],
    /// G, m × n.
    rows: &'a DMatrix<f64>,
    /// D.
    matrix: CondensedKkt<'a>,
    /// Diagonal of S; zero for equality rows.
    slack_ratios: Vec<f64>,
    a: DVector<f64>,
    b: DVector<f64>,
}

impl NewtonSystem<'_> {
    /// Solves for dλ first, with a diagonal D.
    fn by_rows(&self) -> Option<(DVector<f64>, DVector<f64>)> {
        let Self { fixed, rows, a, b, .. } = self;
        let diagonal = &self.matrix.diagonal;
        let mut system = DMatrix::from_diagonal(&DVector::from_column_slice(&self.slack_ratios));
        let mut right = b.clone();
        for (j, column) in rows.column_iter().enumerate().filter(|(j, _)| !fixed[*j]) {
            let inverse = 1.0 / diagonal[j];
            right.axpy(inverse * a[j], &column, 1.0);
            system.syger(inverse, &column, &column, 1.0);
        }
        system.fill_upper_triangle_with_lower_triangle();
        let dλ = if b.is_empty() { right } else { positive_solve(system, &right)? };
        let dx = |j: usize| if fixed[j] { 0.0 } else { (a[j] - rows.column(j).dot(&dλ)) / diagonal[j] };
        Some((DVector::from_fn(a.len(), |j, _| dx(j)), dλ))
    }

    /// Solves for dλ first, with outer products in D.
    fn by_coupled_rows(&self) -> Option<(DVector<f64>, DVector<f64>)> {
        let Self { fixed, rows, matrix, a, b, .. } = self;
        let row = |i: usize| DVector::from_fn(a.len(), |j, _| if fixed[j] { 0.0 } else { rows[(i, j)] });
        let mut dx = matrix.solve(a)?;
        let solutions: Vec<DVector<f64>> = (0..b.len()).map(|i| matrix.solve(&row(i))).collect::<Option<_>>()?;
        if solutions.is_empty() {
            return Some((dx, b.clone()));
        }
        let mut system = DMatrix::from_columns(&solutions.iter().map(|z| *rows * z).collect::<Vec<_>>());
        self.slack_ratios.iter().enumerate().for_each(|(i, s)| system[(i, i)] += s);
        let dλ = positive_solve(system, &(*rows * &dx + b))?;
        solutions.iter().zip(&dλ).for_each(|(z, λ)| dx.axpy(-λ, z, 1.0));
        Some((dx, dλ))
    }

    /// Solves for dx first.
    fn by_variables(&self) -> Option<(DVector<f64>, DVector<f64>)> {
        let Self { fixed, rows, slack_ratios, a, b, .. } = self;
        let n = a.len();
        let divided =
            |j: usize| DVector::from_fn(b.len(), |i, _| if fixed[j] { 0.0 } else { rows[(i, j)] / slack_ratios[i] });
        let weighted: Vec<DVector<f64>> = (0..n).map(divided).collect();
        let mut system = DMatrix::from_fn(n, n, |j, k| if fixed[k] { 0.0 } else { weighted[j].dot(&rows.column(k)) });
        self.matrix.add_to(&mut system);
        let right = DVector::from_fn(n, |j, _| a[j] - weighted[j].dot(b));
        let dx = positive_solve(system, &right)?;
        let change = *rows * &dx + b;
        Some((dx, DVector::from_fn(b.len(), |i, _| change[i] / slack_ratios[i])))
    }
}

/// Solves a system with a positive definite matrix; by LU if rounding makes the Cholesky factorization fail.
fn positive_solve(system: DMatrix<f64>, right: &DVector<f64>) -> Option<DVector<f64>> {
    let solution = match system.clone().cholesky() {
        Some(c) => c.solve(right),
        None => system.lu().solve(right)?,
    };
    solution.iter().all(|v| v.is_finite()).then_some(solution)
}

/// The Newton step with the changes of slacks and bound multipliers that follow from dx and dλ.
fn complete(
    conditions: &PerturbedConditions<'_>,
    p: &PrimalDualIterate,
    dx: DVector<f64>,
    dλ: DVector<f64>,
    slack_ratios: &[f64],
    μ: f64,
) -> PrimalDualIterate {
    let multiplier =
        |gap: f64, at: f64, change: f64| if gap.is_infinite() { 0.0 } else { (μ - at * change) / gap - at };
    let free = |j: usize, v: f64| if conditions.fixed[j] { 0.0 } else { v };
    let n = p.x.len();
    PrimalDualIterate {
        ξ: (0..n).map(|j| free(j, multiplier(conditions.gaps(&p.x, j).0, p.ξ[j], dx[j]))).collect(),
        η: (0..n).map(|j| free(j, multiplier(conditions.gaps(&p.x, j).1, p.η[j], -dx[j]))).collect(),
        s: (0..dλ.len())
            .map(|i| if conditions.equality[i] { 0.0 } else { μ / p.λ[i] - p.s[i] - slack_ratios[i] * dλ[i] })
            .collect(),
        x: dx.as_slice().to_vec(),
        λ: dλ.as_slice().to_vec(),
    }
}
