//! Programs with convex quadratic rows, written as second-order cones.

use super::qp::clarabel_error;
use super::sqp::Sqp;
use crate::kkt::{largest_change, variable_scales};
use crate::program::{Gradients, Program, Structure, check_finite, feasible_start};
use crate::solution::{Evaluations, Solution, SubproblemSolver};
use clarabel::algebra::CscMatrix;
use clarabel::solver::{
    DefaultSettings, DefaultSolver, IPSolver, NonnegativeConeT, SecondOrderConeT, SolverStatus, SupportedConeT,
    ZeroConeT,
};
use error::{Error, Result};
use nalgebra::DMatrix;

/// Solver of programs with a linear or convex quadratic objective and linear or convex quadratic rows, through Clarabel.
///
/// A row g + a·d + ½‖C d‖² ≤ 0 (see [`Program::row_factors`]) is the second-order cone
///
/// $$ \left\| \left(C d,\ τ - \tfrac12\right) \right\| \le τ + \tfrac12 ,\qquad τ = -(g + a \cdot d) . $$
///
/// Starting from the solution of Clarabel, [`Sqp`] computes the last digits and the multipliers, and relaxes a program
/// without a feasible point. The solver returns [`Error::Unsupported`] for a program without row factors.
///
/// # Sources
/// Lobo et al., *Linear Algebra Appl.* 284 (1998) 193–228, section 2.1.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[non_exhaustive]
pub struct SecondOrder {
    /// SQP solver for the last digits, the multipliers and the relaxation.
    pub sqp: Sqp,
}

impl SecondOrder {
    /// Replaces the SQP solver.
    #[must_use]
    pub fn with_sqp(self, sqp: Sqp) -> Self {
        Self { sqp }
    }
}

impl SubproblemSolver for SecondOrder {
    fn name(&self) -> &'static str {
        "second-order cone"
    }

    fn solve(&self, program: &dyn Program, start: &[f64]) -> Result<Solution> {
        let x = feasible_start(program, start)?;
        let Some(factors) = program.row_factors() else {
            let why = "the program provides no factors of its quadratic rows";
            return Err(Error::unsupported("second-order cone solver", why, "use the SQP solver"));
        };
        Error::check_length("factors of the rows", program.rows(), factors.len())?;
        let here = program.gradients(&x)?;
        check_finite(program, &x, &here)?;
        match cone_point(program, &x, &here, &factors)? {
            Some(found) => {
                let solution = self.sqp.solve(program, &found)?;
                let evaluations = solution.evaluations + Evaluations { gradients: 1, ..Default::default() };
                Ok(Solution { evaluations, ..solution })
            }
            None => self.sqp.solve(program, &x),
        }
    }
}

/// Clarabel's constraints A z + s = b with s in a product of cones.
#[derive(Default)]
struct Cones {
    entries: (Vec<usize>, Vec<usize>, Vec<f64>),
    right: Vec<f64>,
    cones: Vec<SupportedConeT<f64>>,
}

impl Cones {
    /// Adds the row a·z + s = b.
    fn push(&mut self, row: impl Iterator<Item = (usize, f64)>, b: f64) {
        for (j, v) in row.filter(|e| e.1 != 0.0) {
            self.entries.0.push(self.right.len());
            self.entries.1.push(j);
            self.entries.2.push(v);
        }
        self.right.push(b);
    }
}

/// Clarabel's solution; `None` if it finds none.
fn cone_point(
    program: &dyn Program,
    x: &[f64],
    here: &Gradients,
    factors: &[Option<DMatrix<f64>>],
) -> Result<Option<Vec<f64>>> {
    let n = x.len();
    let scale = variable_scales(program, x, x);
    let Cones { entries, right, cones } = constraints(program, x, here, factors, &scale)?;
    let objective = largest_change(&scale, &here.objective).max(f64::MIN_POSITIVE);
    let q: Vec<f64> = (0..n).map(|j| here.objective[j] * scale[j] / objective).collect();
    let p = match program.structure() {
        Structure::Linear => CscMatrix::zeros((n, n)),
        _ => objective_hessian(program, x, &scale, objective)?,
    };
    let a = CscMatrix::new_from_triplets(right.len(), n, entries.0, entries.1, entries.2);
    let settings = DefaultSettings { verbose: false, max_threads: 1, presolve_enable: false, ..Default::default() };
    let mut solver = DefaultSolver::new(&p, &q, &a, &right, &cones, settings)
        .map_err(|e| clarabel_error(&e, "check that the program's rows are finite"))?;
    solver.solve();
    let is_solved = matches!(solver.solution.status, SolverStatus::Solved | SolverStatus::AlmostSolved);
    let (l, u) = (program.lower(), program.upper());
    Ok(is_solved.then(|| (0..n).map(|j| (x[j] + scale[j] * solver.solution.x[j]).clamp(l[j], u[j])).collect()))
}

/// Equality rows, linear rows, bounds and quadratic rows, in this order, in units of variables and rows at `x`.
fn constraints(
    program: &dyn Program,
    x: &[f64],
    here: &Gradients,
    factors: &[Option<DMatrix<f64>>],
    scale: &[f64],
) -> Result<Cones> {
    let n = x.len();
    let (l, u) = (program.lower(), program.upper());
    let unit = |i: usize| largest_change(scale, here.rows.row(i).iter()).max(f64::MIN_POSITIVE);
    let gradient = |i: usize| {
        let r = unit(i);
        (0..n).map(move |j| (j, here.rows[(i, j)] * scale[j] / r))
    };
    let value = |i: usize| here.values.rows[i] / unit(i);
    let mut out = Cones::default();
    let equalities: Vec<usize> = (0..factors.len()).filter(|&i| program.is_equality(i)).collect();
    equalities.iter().for_each(|&i| out.push(gradient(i), -value(i)));
    out.cones.push(ZeroConeT(equalities.len()));
    let linear = (0..factors.len()).filter(|&i| !program.is_equality(i) && factors[i].is_none());
    linear.for_each(|i| out.push(gradient(i), -value(i)));
    for j in 0..n {
        if l[j].is_finite() {
            out.push(std::iter::once((j, -1.0)), (x[j] - l[j]) / scale[j]);
        }
        if u[j].is_finite() {
            out.push(std::iter::once((j, 1.0)), (u[j] - x[j]) / scale[j]);
        }
    }
    out.cones.push(NonnegativeConeT(out.right.len() - equalities.len()));
    for (i, factor) in factors.iter().enumerate().filter(|(i, _)| !program.is_equality(*i)) {
        let Some(c) = factor else { continue };
        Error::check_length("columns of a row's factor", n, c.ncols())?;
        let root = unit(i).sqrt();
        out.push(gradient(i), 0.5 - value(i));
        for k in 0..c.nrows() {
            out.push((0..n).map(|j| (j, -c[(k, j)] * scale[j] / root)), 0.0);
        }
        out.push(gradient(i), -0.5 - value(i));
        out.cones.push(SecondOrderConeT(c.nrows() + 2));
    }
    Ok(out)
}

/// Upper triangle of the scaled Hessian of a convex quadratic objective.
fn objective_hessian(program: &dyn Program, x: &[f64], scale: &[f64], objective: f64) -> Result<CscMatrix<f64>> {
    let n = x.len();
    let h = program.lagrangian_hessian(x, &vec![0.0; program.rows()])?.unwrap_or_else(|| DMatrix::zeros(n, n));
    let (mut i, mut j, mut v) = (vec![], vec![], vec![]);
    for (row, column) in (0..n).flat_map(|b| (0..=b).map(move |a| (a, b))).filter(|&(a, b)| h[(a, b)] != 0.0) {
        i.push(row);
        j.push(column);
        v.push(h[(row, column)] * scale[row] * scale[column] / objective);
    }
    Ok(CscMatrix::new_from_triplets(n, n, i, j, v))
}
