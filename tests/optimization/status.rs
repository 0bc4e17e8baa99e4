//! Status of random programs whose answer is known by construction, in units of 1e-8 to 1e8.

use linkwright::Result;
use linkwright::nlp::{AutoSolver, KktResidual, ProgramStatus, QuadraticProgram, Solution, SubproblemSolver};
use linkwright::nlp::{Gradients, Program, Values};
use nalgebra::{DMatrix, DVector};

/// SplitMix64 random numbers, reproducible in every version.
struct Random(u64);

impl Random {
    fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ (z >> 31)) >> 11) as f64 / (1u64 << 53) as f64
    }
    fn within(&mut self, a: f64, b: f64) -> f64 {
        a + (b - a) * self.next()
    }
    fn vector(&mut self, n: usize) -> DVector<f64> {
        DVector::from_fn(n, |_, _| self.within(-1.0, 1.0))
    }
    fn index(&mut self, n: usize) -> usize {
        (self.next() * n as f64) as usize
    }
}

/// Variables measured in `unit`, rows multiplied by `row`, the objective by `objective`: powers of ten within 1e±8.
struct Units {
    unit: Vec<f64>,
    row: Vec<f64>,
    objective: f64,
}

impl Units {
    fn new(r: &mut Random, n: usize, m: usize) -> Self {
        let mut ten = |_| 10f64.powf(r.within(-8.0, 8.0));
        Self { unit: (0..n).map(&mut ten).collect(), row: (0..m).map(&mut ten).collect(), objective: ten(0) }
    }
}

/// A linear or quadratic program in natural units.
struct UnscaledProgram {
    a: Vec<DVector<f64>>,
    b: Vec<f64>,
    c: DVector<f64>,
    h: Option<DMatrix<f64>>,
    bounded: bool,
}

impl UnscaledProgram {
    fn random(r: &mut Random, n: usize, m: usize) -> Self {
        let a: Vec<_> = (0..m).map(|_| r.vector(n)).collect();
        let b = vec![0.0; m];
        Self { a, b, c: r.vector(n), h: None, bounded: true }
    }

    /// Adds a convex quadratic to the objective of half of the programs.
    fn curved(&mut self, r: &mut Random, flat: Option<&DVector<f64>>) {
        let n = self.c.len();
        if r.next() < 0.5 {
            let mut root = DMatrix::from_fn(n, n, |_, _| r.within(-1.0, 1.0));
            if let Some(d) = flat {
                // No curvature along d.
                root -= &root * d * d.transpose() / d.norm_squared();
            }
            self.h = Some(root.transpose() * root);
        }
    }

    /// Repeats rows, loosened or exactly, and adds rows of zeros.
    fn redundant(&mut self, r: &mut Random) {
        for _ in 0..3 {
            let i = r.index(self.a.len());
            let loose = if r.next() < 0.5 { 0.0 } else { 0.3 };
            let copy = self.a[i].clone();
            self.a.push(copy);
            self.b.push(self.b[i] + loose);
        }
        self.a.push(DVector::zeros(self.c.len()));
        self.b.push(0.0);
    }

    fn program(&self, units: &Units) -> QuadraticProgram {
        let n = self.c.len();
        let mut p = QuadraticProgram::new((0..n).map(|j| self.c[j] * units.objective / units.unit[j]).collect());
        for (i, a) in self.a.iter().enumerate() {
            let row = units.row[i % units.row.len()];
            let scaled: Vec<f64> = (0..n).map(|j| a[j] * row / units.unit[j]).collect();
            p = p.at_most(&scaled, self.b[i] * row);
        }
        if self.bounded {
            p.lower = units.unit.iter().map(|u| -3.0 * u).collect();
            p.upper = units.unit.iter().map(|u| 3.0 * u).collect();
        }
        p.hessian = self
            .h
            .as_ref()
            .map(|h| DMatrix::from_fn(n, n, |i, j| h[(i, j)] * units.objective / units.unit[i] / units.unit[j]));
        p
    }
}

/// Rows, multipliers and slacks first; then the objective for which x* is a solution.
fn solvable(r: &mut Random, n: usize, m: usize) -> (UnscaledProgram, DVector<f64>) {
    let mut plan = UnscaledProgram::random(r, n, m);
    let x = r.vector(n);
    plan.curved(r, None);
    let mut c = DVector::zeros(n);
    if let Some(h) = &plan.h {
        c -= h * &x;
    }
    for i in 0..m {
        plan.b[i] = plan.a[i].dot(&x);
        if i < n {
            c -= &plan.a[i] * r.within(0.1, 1.0);
        } else {
            plan.b[i] += r.within(0.1, 1.0);
        }
    }
    plan.c = c;
    (plan, x)
}

/// An infeasible program: a positive combination of the rows reads 0 ≤ −1 (Farkas).
fn contradictory(r: &mut Random, n: usize, m: usize) -> UnscaledProgram {
    let mut plan = UnscaledProgram::random(r, n, m);
    plan.curved(r, None);
    for i in 0..m {
        plan.b[i] = r.within(-0.2, 1.0);
    }
    let (mut sum, mut right) = (DVector::zeros(n), 0.0);
    for i in 0..m.min(n) {
        let weight = r.within(0.2, 1.0);
        sum += &plan.a[i] * weight;
        right += plan.b[i] * weight;
    }
    plan.a.push(-sum);
    plan.b.push(-right - r.within(0.1, 1.0));
    plan
}

/// A program with a feasible point and an unbounded direction in which the objective decreases.
fn unbounded(r: &mut Random, n: usize, m: usize) -> UnscaledProgram {
    let mut plan = UnscaledProgram::random(r, n, m);
    let (x, d) = (r.vector(n), r.vector(n).normalize());
    for i in 0..m {
        let along = plan.a[i].dot(&d);
        let stop = along + r.within(0.0, 0.3);
        if along > -0.01 {
            plan.a[i] -= &d * stop;
        }
        plan.b[i] = plan.a[i].dot(&x) + r.within(0.0, 1.0);
    }
    plan.curved(r, Some(&d));
    let tilt = plan.c.dot(&d) + 0.3;
    plan.c -= &d * tilt;
    plan.bounded = false;
    plan
}

fn judge(program: &dyn Program, start: &[f64], s: &Solution) -> f64 {
    KktResidual::of(program, start, s).unwrap().largest()
}

#[test]
fn linear_and_quadratic_programs() {
    let mut r = Random(1);
    let mut wrong = vec![];
    for k in 0..200 {
        let (n, m) = (2 + r.index(5), 3 + r.index(10));
        let kind = k % 4;
        let (mut plan, x) = match kind {
            0 | 3 => {
                let (plan, x) = solvable(&mut r, n, m.max(n));
                (plan, Some(x))
            }
            1 => (contradictory(&mut r, n, m), None),
            _ => (unbounded(&mut r, n, m), None),
        };
        if kind == 3 || r.next() < 0.3 {
            plan.redundant(&mut r);
        }
        let units = Units::new(&mut r, n, plan.a.len());
        let program = plan.program(&units);
        let start = vec![0.0; n];
        let s = AutoSolver::default().solve(&program, &start).unwrap();
        let expected =
            [ProgramStatus::Solved, ProgramStatus::Relaxed, ProgramStatus::Unbounded, ProgramStatus::Solved][kind];
        let mut good = s.status == expected;
        if s.status.is_usable() {
            good &= judge(&program, &start, &s) < 1e-6 && judge(&program, &start, &s) == s.kkt.largest();
        }
        if let Some(x) = x {
            let exact = Program::values(&program, &(0..n).map(|j| x[j] * units.unit[j]).collect::<Vec<_>>()).unwrap();
            good &= (s.objective - exact.objective).abs() <= 1e-7 * units.objective;
        }
        if !good {
            wrong.push((k, kind, s.status, s.kkt, s.iterations));
        }
    }
    assert!(wrong.is_empty(), "{} wrong: {wrong:#?}", wrong.len());
}

/// Σ w (x/u)⁴ + c·x/u with rows Σ q (x/u − centre)² + a·x/u ≤ b.
struct CurvedProgram {
    w: DVector<f64>,
    c: DVector<f64>,
    q: Vec<DVector<f64>>,
    centre: Vec<DVector<f64>>,
    a: Vec<DVector<f64>>,
    b: Vec<f64>,
    units: Units,
    lower: Vec<f64>,
    upper: Vec<f64>,
}

impl CurvedProgram {
    fn random(r: &mut Random, n: usize, m: usize) -> Self {
        let positive = |r: &mut Random| DVector::from_fn(n, |_, _| r.within(0.1, 1.0));
        Self {
            w: positive(r),
            c: r.vector(n),
            q: (0..m).map(|_| positive(r)).collect(),
            centre: (0..m).map(|_| r.vector(n)).collect(),
            a: (0..m).map(|_| r.vector(n)).collect(),
            b: vec![0.0; m],
            units: Units::new(r, n, m),
            lower: vec![f64::NEG_INFINITY; n],
            upper: vec![f64::INFINITY; n],
        }
    }
    fn natural(&self, x: &[f64]) -> DVector<f64> {
        DVector::from_fn(x.len(), |j, _| x[j] / self.units.unit[j])
    }
    fn row(&self, i: usize, z: &DVector<f64>) -> f64 {
        let d = z - &self.centre[i];
        self.q[i].dot(&d.component_mul(&d)) + self.a[i].dot(z)
    }
    fn row_slope(&self, i: usize, z: &DVector<f64>) -> DVector<f64> {
        (z - &self.centre[i]).component_mul(&self.q[i]) * 2.0 + &self.a[i]
    }
    fn slope(&self, z: &DVector<f64>) -> DVector<f64> {
        self.w.component_mul(&z.map(|v| 4.0 * v.powi(3))) + &self.c
    }
    fn in_a_box(mut self) -> Self {
        self.lower = self.units.unit.iter().map(|u| -5.0 * u).collect();
        self.upper = self.units.unit.iter().map(|u| 5.0 * u).collect();
        self
    }
}

impl Program for CurvedProgram {
    fn variables(&self) -> usize {
        self.c.len()
    }
    fn rows(&self) -> usize {
        self.b.len()
    }
    fn lower(&self) -> &[f64] {
        &self.lower
    }
    fn upper(&self) -> &[f64] {
        &self.upper
    }
    fn values(&self, x: &[f64]) -> Result<Values> {
        let z = self.natural(x);
        Ok(Values {
            objective: (self.w.dot(&z.map(|v| v.powi(4))) + self.c.dot(&z)) * self.units.objective,
            rows: (0..self.b.len()).map(|i| (self.row(i, &z) - self.b[i]) * self.units.row[i]).collect(),
        })
    }
    fn gradients(&self, x: &[f64]) -> Result<Gradients> {
        let (z, u) = (self.natural(x), &self.units);
        let slope = self.slope(&z);
        Ok(Gradients {
            values: self.values(x)?,
            objective: (0..x.len()).map(|j| slope[j] * u.objective / u.unit[j]).collect(),
            rows: DMatrix::from_fn(self.b.len(), x.len(), |i, j| self.row_slope(i, &z)[j] * u.row[i] / u.unit[j]),
        })
    }
}

#[test]
fn nonlinear_programs() {
    let mut r = Random(7);
    let mut wrong = vec![];
    for k in 0..60 {
        let (n, m) = (2 + r.index(4), 2 + r.index(5));
        let kind = k % 3;
        let mut p = CurvedProgram::random(&mut r, n, m);
        let x = r.vector(n);
        for i in 0..m {
            p.b[i] = p.row(i, &x) + if i < n.min(2) { 0.0 } else { r.within(0.2, 1.0) };
        }
        match kind {
            // Stationary at x with the first rows active.
            0 => {
                p.c.fill(0.0);
                let pull = (0..n.min(2)).fold(p.slope(&x), |s, i| s + p.row_slope(i, &x) * r.within(0.2, 1.0));
                p.c -= pull;
            }
            // Two balls of radius one half, their centres two units apart.
            1 => {
                for i in 0..2 {
                    p.q[i].fill(1.0);
                    p.a[i].fill(0.0);
                    p.centre[i].fill(0.0);
                    p.centre[i][0] = if i == 0 { -1.0 } else { 1.0 };
                    p.b[i] = 0.25;
                }
            }
            // Linear in the first variable, and unbounded.
            _ => {
                p.w[0] = 0.0;
                p.c[0] = -0.5;
                for i in 0..m {
                    (p.q[i][0], p.a[i][0]) = (0.0, -p.a[i][0].abs());
                    p.b[i] = p.row(i, &x) + 0.2;
                }
            }
        }
        let program = if kind == 2 { p } else { p.in_a_box() };
        let start: Vec<f64> = (0..n).map(|j| program.units.unit[j] * r.within(-1.0, 1.0)).collect();
        let s = AutoSolver::default().solve(&program, &start).unwrap();
        let expected = [ProgramStatus::Solved, ProgramStatus::Relaxed, ProgramStatus::Unbounded][kind];
        let mut good = s.status == expected;
        if s.status.is_usable() {
            good &= judge(&program, &start, &s) < 1e-6;
        }
        if kind == 0 {
            let exact: Vec<f64> = (0..n).map(|j| x[j] * program.units.unit[j]).collect();
            let best = Program::values(&program, &exact).unwrap().objective;
            good &= (s.objective - best).abs() <= 1e-7 * program.units.objective;
        }
        if !good {
            wrong.push((k, kind, s.status, s.kkt, s.iterations, s.relaxation));
        }
    }
    assert!(wrong.is_empty(), "{} wrong: {wrong:#?}", wrong.len());
}
