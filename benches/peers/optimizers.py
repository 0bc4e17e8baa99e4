"""Other optimizers on the problems of `linkwright compare --suite`: SciPy's SLSQP and trust-constr, NLopt's SLSQP and MMA, IPOPT.

    python -m venv peers && peers/bin/pip install -r benches/peers/requirements.txt
    cargo build --release -p linkwright-optimization --features mechanics --example problem_server
    peers/bin/python benches/peers/optimizers.py --output benches/peers/optimizers.csv
    cargo run --release -- compare --suite all --peers benches/peers/optimizers.csv

The problems come from the example `problem_server`, so they are written once, and all optimizers have the same exact derivatives. IPOPT is
the one that the wheel of `ipyopt` contains (`cyipopt` has no wheel), with its limited-memory Hessian. All programs are the unmodified packages
from PyPI and run in their own process; no part of them is linked to or copied into this project.

An analysis is a design at which values were asked for, a sensitivity analysis one at which derivatives were asked for; the same design asked
for twice counts once. A run ends after 500 analyses or 5 s of processor time of the optimizer. A line of the result is

    optimizer;problem;transformation;claim;analyses;sensitivity_analyses;design

with the claim `converged`, `infeasible` or `nothing`. `linkwright compare --peers` judges the designs as those of its own methods.
"""

import argparse
import json
import os
import signal
import subprocess
import warnings

os.environ.setdefault("OMP_NUM_THREADS", "1")
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
import ipyopt
import nlopt
import numpy as np
import scipy
from scipy.optimize import BFGS, Bounds, NonlinearConstraint, minimize

LIMIT = 500
SECONDS = 5.0
TOLERANCE = 1e-8


class LimitReached(Exception):
    pass


def end_by_time(*_):
    raise LimitReached


class Server:
    """The example `problem_server`."""

    def __init__(self, path):
        self.process = subprocess.Popen([path], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)

    def ask(self, **request):
        self.process.stdin.write(json.dumps(request) + "\n")
        self.process.stdin.flush()
        return json.loads(self.process.stdout.readline())


class Problem:
    """A problem that counts the designs at which it is evaluated. Rows c <= 0, or c = 0 where `equality`."""

    def __init__(self, server, name, transformation):
        answer = server.ask(problem=name, transformation=transformation)
        if "error" in answer:
            raise ValueError(f"{name}: {answer['error']}")
        self.server = server
        self.start = np.array(answer["start"], float)
        self.n = len(self.start)
        self.lower = np.array([-np.inf if v is None else v for v in answer["lower"]])
        self.upper = np.array([np.inf if v is None else v for v in answer["upper"]])
        self.equality = np.array(answer["equality"], bool)
        self.m = len(self.equality)
        self.known, self.analyses, self.sensitivities = {}, set(), set()

    def at(self, x):
        key = tuple(float(v) for v in x)
        if key not in self.known:
            if len(self.known) >= LIMIT:
                raise LimitReached
            answer = self.server.ask(x=list(key)) if np.all(np.isfinite(x)) else {"error": "not finite"}
            bad = {"f": np.nan, "df": np.full(self.n, np.nan), "c": np.full(self.m, np.nan), "dc": np.full((self.m, self.n), np.nan)}
            self.known[key] = bad if "error" in answer else {k: np.array(v, float) for k, v in answer.items()}
        return key, self.known[key]

    def values(self, x):
        key, at = self.at(x)
        self.analyses.add(key)
        self.last = np.array(key)
        return at

    def slopes(self, x):
        key, at = self.at(x)
        self.analyses.add(key)
        self.sensitivities.add(key)
        return at

    def objective(self, x):
        return float(self.values(x)["f"])

    def rows(self, x):
        return self.values(x)["c"]

    def gradient(self, x):
        return self.slopes(x)["df"]

    def jacobian(self, x):
        return self.slopes(x)["dc"].reshape(self.m, self.n)


def scipy_slsqp(p):
    def part(kind, sign, chosen):
        return {
            "type": kind,
            "fun": lambda x: sign * p.rows(x)[chosen],
            "jac": lambda x: sign * p.jacobian(x)[chosen],
        }

    parts = []
    if p.equality.any():
        parts.append(part("eq", 1.0, p.equality))
    if (~p.equality).any():
        parts.append(part("ineq", -1.0, ~p.equality))
    options = {"maxiter": LIMIT, "ftol": TOLERANCE}
    end = minimize(
        p.objective, p.start, jac=p.gradient, method="SLSQP", options=options, constraints=parts,
        bounds=list(zip(p.lower, p.upper)),
    )
    return ("converged" if end.success else "nothing"), end.x


def scipy_trust_constr(p):
    parts = []
    if p.m:
        low = np.where(p.equality, 0.0, -np.inf)
        parts.append(NonlinearConstraint(p.rows, low, 0.0, jac=p.jacobian, hess=BFGS()))
    options = {"maxiter": LIMIT, "gtol": TOLERANCE, "xtol": TOLERANCE}
    end = minimize(
        p.objective, p.start, jac=p.gradient, hess=BFGS(), method="trust-constr", options=options, constraints=parts,
        bounds=Bounds(p.lower, p.upper),
    )
    return ("converged" if end.status in (1, 2) else "nothing"), end.x


def nlopt_run(algorithm, with_equalities):
    def run(p):
        if p.equality.any() and not with_equalities:
            return "nothing", p.start
        optimizer = nlopt.opt(algorithm, p.n)
        optimizer.set_lower_bounds(p.lower)
        optimizer.set_upper_bounds(p.upper)

        def objective(x, gradient):
            if gradient.size:
                gradient[:] = p.gradient(x)
            return p.objective(x)

        def rows(chosen):
            def evaluate(result, x, gradient):
                if gradient.size:
                    gradient[:] = p.jacobian(x)[chosen]
                result[:] = p.rows(x)[chosen]

            return evaluate

        optimizer.set_min_objective(objective)
        for chosen, add in [(~p.equality, optimizer.add_inequality_mconstraint), (p.equality, optimizer.add_equality_mconstraint)]:
            if chosen.any():
                add(rows(chosen), np.full(chosen.sum(), TOLERANCE))
        optimizer.set_ftol_rel(TOLERANCE)
        optimizer.set_xtol_rel(TOLERANCE)
        optimizer.set_maxeval(LIMIT)
        x = optimizer.optimize(p.start)
        ended_by_limit = optimizer.last_optimize_result() in (nlopt.MAXEVAL_REACHED, nlopt.MAXTIME_REACHED)
        return ("nothing" if ended_by_limit else "converged"), x

    return run


def ipopt(p):
    def gradient(x, out):
        out[()] = p.gradient(x)
        return out

    def rows(x, out):
        out[()] = p.rows(x)
        return out

    def jacobian(x, out):
        out[()] = p.jacobian(x).ravel()
        return out

    far = 2e19
    dense = (np.repeat(np.arange(p.m), p.n), np.tile(np.arange(p.n), p.m))
    solver = ipyopt.Problem(
        n=p.n,
        x_l=np.clip(p.lower, -far, far),
        x_u=np.clip(p.upper, -far, far),
        m=p.m,
        g_l=np.where(p.equality, 0.0, -far),
        g_u=np.zeros(p.m),
        sparsity_indices_jac_g=dense,
        sparsity_indices_h=(np.array([], int), np.array([], int)),
        eval_f=p.objective,
        eval_grad_f=gradient,
        eval_g=rows,
        eval_jac_g=jacobian,
        ipopt_options={
            "hessian_approximation": "limited-memory", "tol": TOLERANCE, "max_iter": LIMIT, "print_level": 0, "sb": "yes",
        },
    )
    x, _, status = solver.solve(p.start.copy())
    return {0: "converged", 1: "converged", 2: "infeasible"}.get(status, "nothing"), x


NLOPT = f"NLopt {nlopt.version_major()}.{nlopt.version_minor()}.{nlopt.version_bugfix()}"
IPOPT = "IPOPT (ipyopt 0.12.10)"
OPTIMIZERS = {
    f"SLSQP (SciPy {scipy.__version__})": scipy_slsqp,
    f"trust-constr (SciPy {scipy.__version__})": scipy_trust_constr,
    f"SLSQP ({NLOPT})": nlopt_run(nlopt.LD_SLSQP, True),
    f"MMA ({NLOPT})": nlopt_run(nlopt.LD_MMA, False),
    IPOPT: ipopt,
}


def attempt(run, p):
    """The claim and the last design; a run that raises an exception claims nothing at its last analysed design."""
    p.last = p.start
    signal.setitimer(signal.ITIMER_PROF, SECONDS)
    try:
        claim, x = run(p)
    except Exception:  # whatever an optimizer raises
        claim, x = "nothing", p.last
    finally:
        signal.setitimer(signal.ITIMER_PROF, 0.0)
    x = np.clip(x, p.lower, p.upper)
    answer = p.server.ask(x=[float(v) for v in x]) if np.all(np.isfinite(x)) else {}
    values = np.array([answer.get("f"), *answer.get("c", [])], float)
    # A design at which the problem is undefined cannot be judged.
    return (claim, x) if np.all(np.isfinite(values)) else ("nothing", p.start)


def main():
    arguments = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    arguments.add_argument("--server", default="target/release/examples/problem_server")
    arguments.add_argument("--output", default="benches/peers/optimizers.csv")
    arguments.add_argument("--transform", action="append", help="as for `linkwright compare` [default: standard]")
    arguments.add_argument("--suites", default="HockSchittkowski,Adversarial,Time,Catalogue", help="separated by commas")
    options = arguments.parse_args()
    warnings.simplefilter("ignore")
    np.seterr(all="ignore")
    signal.signal(signal.SIGPROF, end_by_time)
    server = Server(options.server)
    known = [p for p in server.ask(list=True)["problems"] if not p["expensive"]]
    problems = [p["name"] for suite in options.suites.split(",") for p in known if p["suite"] == suite]
    with open(options.output, "w", encoding="utf-8") as output:
        output.write("optimizer;problem;transformation;claim;analyses;sensitivity_analyses;design\n")
        for transformation in options.transform or ["standard"]:
            for name in problems:
                for optimizer, run in OPTIMIZERS.items():
                    p = Problem(server, name, transformation)
                    claim, x = attempt(run, p)
                    design = " ".join(repr(float(v)) for v in x)
                    cells = [optimizer, name, transformation, claim, len(p.analyses), len(p.sensitivities), design]
                    output.write(";".join(str(cell) for cell in cells) + "\n")
                    output.flush()


if __name__ == "__main__":
    main()
