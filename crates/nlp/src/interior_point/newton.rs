//! The Newton step of the perturbed optimality conditions, reduced to n or to m unknowns.

use super::point::{Frame, LocalDerivatives, Point};
use super::stiffness::CondensedKkt;
use nalgebra::{DMatrix, DVector};

/// Smallest curvature that is divided by.
const FLAT: f64 = 1e-14;

/// The step towards the conditions with λ s = ξ (x − l) = η (u − x) = μ; `None` if the system is singular.
///
/// With D = ∂²L + ξ/(x − l) + η/(u − x), S = s/λ and the residuals a and b,
///
/// $$ D\,dx + G^T dλ = a,\qquad G\,dx - S\,dλ = -b , $$
///
/// which becomes (S + G D⁻¹ Gᵀ) dλ = G D⁻¹ a + b where rows are few, and (D + Gᵀ S⁻¹ G) dx = a − Gᵀ S⁻¹ b where they
/// are many. D is a diagonal, or a diagonal and a few outer products.
///
/// **Source.** Svanberg, *MMA and GCMMA – two methods for nonlinear optimization* (2007), section 5, without the
/// artificial variables.
pub(super) fn step(frame: &Frame<'_>, p: &Point, at: &LocalDerivatives, μ: f64) -> Option<Point> {
    let (n, m) = (p.x.len(), p.λ.len());
    let (mut stiffness, mut a) = (vec![1.0; n], DVector::zeros(n));
    for j in (0..n).filter(|&j| !frame.fixed[j]) {
        let (below, above) = frame.gaps(&p.x, j);
        stiffness[j] = (at.curvature[j] + p.ξ[j] / below + p.η[j] / above).max(FLAT);
        a[j] = -at.slope[j] + μ / below - μ / above;
    }
    let (columns, weights) = frame.outer_products();
    let stiffness = CondensedKkt::new(stiffness, columns, weights);
    let g = &at.gradients.values.rows;
    let softness: Vec<f64> = (0..m).map(|i| if frame.equality[i] { 0.0 } else { p.s[i] / p.λ[i] }).collect();
    let b = DVector::from_fn(m, |i, _| g[i] + if frame.equality[i] { 0.0 } else { μ / p.λ[i] });
    let rows_are_many = m > n && !frame.equality.contains(&true);
    let (dx, dλ) = if rows_are_many {
        by_variables(frame, at, &stiffness, &softness, &a, &b)?
    } else if stiffness.coupling.is_some() {
        by_coupled_rows(frame, at, &stiffness, &softness, &a, &b)?
    } else {
        by_rows(frame, at, &stiffness.diagonal, &softness, &a, &b)?
    };
    Some(complete(frame, p, dx, dλ, &softness, μ))
}

fn by_rows(
    frame: &Frame<'_>,
    at: &LocalDerivatives,
    stiffness: &[f64],
    softness: &[f64],
    a: &DVector<f64>,
    b: &DVector<f64>,
) -> Option<(DVector<f64>, DVector<f64>)> {
    let rows = &at.gradients.rows;
    let m = b.len();
    let mut system = DMatrix::from_diagonal(&DVector::from_column_slice(softness));
    let mut right = b.clone();
    for (j, column) in rows.column_iter().enumerate().filter(|(j, _)| !frame.fixed[*j]) {
        let flexibility = 1.0 / stiffness[j];
        right.axpy(flexibility * a[j], &column, 1.0);
        system.syger(flexibility, &column, &column, 1.0);
    }
    system.fill_upper_triangle_with_lower_triangle();
    let dλ = if m == 0 { right } else { positive_solve(system, &right)? };
    let dx =
        DVector::from_fn(
            a.len(),
            |j, _| {
                if frame.fixed[j] { 0.0 } else { (a[j] - rows.column(j).dot(&dλ)) / stiffness[j] }
            },
        );
    Some((dx, dλ))
}

/// The same with a matrix that is not a diagonal.
fn by_coupled_rows(
    frame: &Frame<'_>,
    at: &LocalDerivatives,
    stiffness: &CondensedKkt,
    softness: &[f64],
    a: &DVector<f64>,
    b: &DVector<f64>,
) -> Option<(DVector<f64>, DVector<f64>)> {
    let rows = &at.gradients.rows;
    let row = |i: usize| DVector::from_fn(a.len(), |j, _| if frame.fixed[j] { 0.0 } else { rows[(i, j)] });
    let mut dx = stiffness.solve(a)?;
    let answers: Vec<DVector<f64>> = (0..b.len()).map(|i| stiffness.solve(&row(i))).collect::<Option<_>>()?;
    if answers.is_empty() {
        return Some((dx, b.clone()));
    }
    let mut system = DMatrix::from_columns(&answers.iter().map(|z| rows * z).collect::<Vec<_>>());
    softness.iter().enumerate().for_each(|(i, s)| system[(i, i)] += s);
    let dλ = positive_solve(system, &(rows * &dx + b))?;
    answers.iter().zip(&dλ).for_each(|(z, λ)| dx.axpy(-λ, z, 1.0));
    Some((dx, dλ))
}

fn by_variables(
    frame: &Frame<'_>,
    at: &LocalDerivatives,
    stiffness: &CondensedKkt,
    softness: &[f64],
    a: &DVector<f64>,
    b: &DVector<f64>,
) -> Option<(DVector<f64>, DVector<f64>)> {
    let rows = &at.gradients.rows;
    let n = a.len();
    let weighted: Vec<DVector<f64>> = (0..n)
        .map(|j| DVector::from_fn(b.len(), |i, _| if frame.fixed[j] { 0.0 } else { rows[(i, j)] / softness[i] }))
        .collect();
    let mut system = DMatrix::from_fn(n, n, |j, k| if frame.fixed[k] { 0.0 } else { weighted[j].dot(&rows.column(k)) });
    let mut right = a.clone();
    stiffness.add_to(&mut system);
    for j in 0..n {
        right[j] -= weighted[j].dot(b);
    }
    let dx = positive_solve(system, &right)?;
    let change = rows * &dx + b;
    let dλ = DVector::from_fn(b.len(), |i, _| change[i] / softness[i]);
    Some((dx, dλ))
}

fn positive_solve(system: DMatrix<f64>, right: &DVector<f64>) -> Option<DVector<f64>> {
    let solution = match system.clone().cholesky() {
        Some(c) => c.solve(right),
        None => system.lu().solve(right)?,
    };
    solution.iter().all(|v| v.is_finite()).then_some(solution)
}

/// The changes of slacks and bound multipliers that go with dx and dλ.
fn complete(frame: &Frame<'_>, p: &Point, dx: DVector<f64>, dλ: DVector<f64>, softness: &[f64], μ: f64) -> Point {
    let price = |gap: f64, at: f64, change: f64| if gap.is_infinite() { 0.0 } else { (μ - at * change) / gap - at };
    let free = |j: usize, v: f64| if frame.fixed[j] { 0.0 } else { v };
    let n = p.x.len();
    Point {
        ξ: (0..n).map(|j| free(j, price(frame.gaps(&p.x, j).0, p.ξ[j], dx[j]))).collect(),
        η: (0..n).map(|j| free(j, price(frame.gaps(&p.x, j).1, p.η[j], -dx[j]))).collect(),
        s: (0..dλ.len())
            .map(|i| if frame.equality[i] { 0.0 } else { μ / p.λ[i] - p.s[i] - softness[i] * dλ[i] })
            .collect(),
        x: dx.as_slice().to_vec(),
        λ: dλ.as_slice().to_vec(),
    }
}
