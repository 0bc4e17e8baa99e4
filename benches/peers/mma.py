"""Time of one MMA subproblem in other programs, for comparison with `cargo bench --bench subproblem -- mma_dual`.

    python -m venv peers && peers/bin/pip install nlopt mmapy numpy && peers/bin/python benches/peers/mma.py

NLopt (LGPL) and mmapy (GPL) are the unmodified packages from PyPI and run in their own process; no part of them is linked
to or copied into this project. The problem is that of the benchmark: the objective increases with every variable, the
rows decrease. For NLopt the time is that of an iteration, inner iterations included, minus the time in the callbacks. CPU time of the process, one thread where the numerical library allows it.
"""

import os
import time

os.environ.setdefault("OMP_NUM_THREADS", "1")
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
import nlopt
import numpy as np
from mmapy import mmasub


def wave(k):
    return 0.5 + 0.5 * np.modf(k * 0.618033988749895)[0]


class Problem:
    """f = sum p/(2.5 - x), g_i = sum q_i/(x + 0.5) - 0.95 of its value at the middle; 0 <= x <= 2."""

    def __init__(self, n, m):
        self.p = wave(np.arange(n))
        self.q = np.array([wave(np.arange(n) * 31 + i * 17) for i in range(1, m + 1)])
        self.limit = 0.95 * (self.q / 1.5).sum(axis=1)
        self.spent = 0.0

    def objective(self, x, grad):
        began = time.process_time()
        if grad.size:
            grad[:] = self.p / (2.5 - x) ** 2
        value = (self.p / (2.5 - x)).sum()
        self.spent += time.process_time() - began
        return value

    def rows(self, result, x, grad):
        began = time.process_time()
        if grad.size:
            grad[:] = -self.q / (x + 0.5) ** 2
        result[:] = (self.q / (x + 0.5)).sum(axis=1) - self.limit
        self.spent += time.process_time() - began


def time_nlopt(n, m, evaluations=12):
    problem = Problem(n, m)
    opt = nlopt.opt(nlopt.LD_MMA, n)
    opt.set_lower_bounds(0.0)
    opt.set_upper_bounds(2.0)
    opt.set_min_objective(problem.objective)
    opt.add_inequality_mconstraint(problem.rows, np.full(m, 1e-8))
    opt.set_maxeval(evaluations)
    began = time.process_time()
    try:
        opt.optimize(np.full(n, 1.2))
    except Exception as failure:  # only the time is needed
        return f"failed: {failure}"
    return (time.process_time() - began - problem.spent) / opt.get_numevals()


def time_mmapy(n, m):
    problem = Problem(n, m)
    x = np.full((n, 1), 1.2)
    gradient, rows, values = np.empty(n), np.empty((m, n)), np.empty(m)
    value = problem.objective(x[:, 0], gradient)
    problem.rows(values, x[:, 0], rows)
    low, upp = np.full((n, 1), 0.0), np.full((n, 1), 2.0)
    began = time.process_time()
    mmasub(
        m, n, 1, x, low, upp, x, x, value, gradient.reshape(-1, 1), values.reshape(-1, 1), rows,
        low, upp, 1.0, np.zeros((m, 1)), np.full((m, 1), 1e4), np.zeros((m, 1)),
    )
    return time.process_time() - began


if __name__ == "__main__":
    print("n,m,nlopt_ld_mma_s_per_iteration,mmapy_mmasub_s")
    for n, m in [(1_000, 10), (100_000, 1), (100_000, 10), (3, 1_000), (3, 10_000)]:
        mmapy_time = min(time_mmapy(n, m) for _ in range(3))
        # NLopt solves the dual problem by the same method: many rows, or many variables with ten rows, take minutes.
        nlopt_time = time_nlopt(n, m, 12 if n * m <= 100_000 else 2) if m <= 1_000 else "skipped"
        print(f"{n},{m},{nlopt_time},{mmapy_time}", flush=True)
