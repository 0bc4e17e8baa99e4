"""`minimize` and `scipy_method`, compared with SciPy's own methods."""

import pickle

import numpy as np
import pytest

import linkwright

scipy = pytest.importorskip("scipy")
from scipy import optimize  # noqa: E402


def rosenbrock(x):
    return optimize.rosen(x)


def sum_of_squares(x, centre):
    return float(((x - centre) ** 2).sum())


def slopes(x, centre):
    return 2 * (x - centre)


def both(x, centre):
    return sum_of_squares(x, centre), slopes(x, centre)


@pytest.mark.parametrize("fun, jac", [(sum_of_squares, None), (sum_of_squares, slopes), (both, True)])
def test_results_pickle_if_the_functions_do(fun, jac):
    limits = [
        optimize.LinearConstraint([[1.0, 1.0]], -np.inf, 2.0),
        optimize.NonlinearConstraint(np.prod, -np.inf, 5.0),
        {"type": "ineq", "fun": sum_of_squares, "jac": slopes, "args": (0.5,)},
    ]
    keywords = {"args": (2.0,), "jac": jac, "constraints": limits}
    for found in [
        linkwright.minimize(fun, [0.0, 0.2], **keywords),
        optimize.minimize(fun, [0.0, 0.2], method=linkwright.scipy_method, **keywords),
    ]:
        copy = pickle.loads(pickle.dumps(found))
        assert copy.x.tolist() == found.x.tolist() and copy.success
        # The problem of the copy is the same.
        assert copy.result.problem.analyze(copy.x).objective == found.fun


def hs71():
    """Hock & Schittkowski 71: f* = 17.0140173."""
    return dict(
        fun=lambda x: x[0] * x[3] * (x[0] + x[1] + x[2]) + x[2],
        x0=[1.0, 5.0, 5.0, 1.0],
        bounds=[(1, 5)] * 4,
        constraints=[
            optimize.NonlinearConstraint(np.prod, 25, np.inf),
            {"type": "eq", "fun": lambda x: (x**2).sum() - 40},
        ],
    )


def test_hock_schittkowski_71():
    found = linkwright.minimize(**hs71())
    assert found.success and found.status == 0 and found.fun == pytest.approx(17.0140173, rel=1e-5), found
    assert found.maxcv < 1e-2 * 1e-5 * 40 * 100 and len(found.history) > 1
    assert isinstance(found, optimize.OptimizeResult) and "converged" in repr(found.result)


def test_as_a_method_of_scipy():
    problem = hs71()
    ours = optimize.minimize(problem["fun"], problem["x0"], method=linkwright.scipy_method, bounds=problem["bounds"], constraints=problem["constraints"])
    theirs = optimize.minimize(problem["fun"], problem["x0"], method="SLSQP", bounds=problem["bounds"], constraints=problem["constraints"])
    assert ours.success and ours.fun == pytest.approx(theirs.fun, rel=1e-5)
    np.testing.assert_allclose(ours.x, theirs.x, rtol=2e-3)


def test_options_presets_and_gradients():
    for jac in (optimize.rosen_der, True):
        fun = (lambda x: (optimize.rosen(x), optimize.rosen_der(x))) if jac is True else optimize.rosen
        found = optimize.minimize(
            fun, [-1.2, 1.0], jac=jac, method=linkwright.scipy_method, tol=1e-9, options={"preset": "bfgs", "maxiter": 300},
            bounds=optimize.Bounds([-2, -2], [2, 2]), hess="2-point",
        )
        assert found.fun < 1e-4, found
    with pytest.raises(linkwright.ModelError, match="maxfev"):
        optimize.minimize(rosenbrock, [0.0, 0.0], method=linkwright.scipy_method, options={"maxfev": 3})


def test_linear_and_two_sided_constraints_and_fixed_variables():
    linear = optimize.LinearConstraint([[1.0, 1.0, 0.0], [0.0, 1.0, 1.0]], [1.0, 2.0], [1.0, np.inf])
    ring = optimize.NonlinearConstraint(lambda x: x[:2] @ x[:2], 0.6, 0.9)
    found = linkwright.minimize(
        lambda x: x @ x, [1.0, 0.5, 1.0], jac=lambda x: 2 * x, bounds=[(None, None), (0, None), (1.5, 1.5)], constraints=[linear, ring]
    )
    assert found.success and found.x[2] == 1.5 and found.x[:2].sum() == pytest.approx(1.0, abs=1e-6)
    theirs = optimize.minimize(
        lambda x: x @ x, [1.0, 0.5, 1.0], jac=lambda x: 2 * x, bounds=[(None, None), (0, None), (1.5, 1.5)], constraints=[linear, ring],
        method="trust-constr",
    )
    assert found.fun == pytest.approx(theirs.fun, rel=1e-4)


def test_differences_stay_inside_the_bounds():
    def f(x):
        assert (x >= 0).all() and (x <= 2).all()
        return np.sqrt(x).sum() + (x - 1) @ (x - 1)

    assert linkwright.minimize(f, [0.0, 2.0], bounds=[(0, 2)] * 2).nfev > 0


def test_arguments_and_callbacks():
    seen = []
    found = linkwright.minimize(lambda x, a: (x[0] - a) ** 2, [0.0], (3.0,), bounds=[(-5, 5)], callback=lambda xk: seen.append(xk))
    assert found.x[0] == pytest.approx(3.0, abs=1e-3) and len(seen) == found.nit

    def callback(*, intermediate_result):
        seen.append(intermediate_result.fun)
        raise StopIteration

    stopped = linkwright.minimize(lambda x: (x[0] - 3) ** 2, [0.0], bounds=[(-5, 5)], callback=callback)
    assert stopped.status in (4, 0) and stopped.nit == 1


def test_an_infeasible_problem_is_not_a_success():
    found = linkwright.minimize(lambda x: x[0], [0.5], bounds=[(0, 1)], constraints={"type": "ineq", "fun": lambda x: x[0] - 2})
    assert not found.success and found.maxcv == pytest.approx(1.0, abs=1e-2)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (dict(x0=[np.nan]), "x0"),
        (dict(x0=["a"]), "x0"),
        (dict(bounds=[(0, 1), (0, 1)]), "for each of the 1"),
        (dict(bounds=[(2, 1)]), "contain no value"),
        (dict(constraints={"type": "inq", "fun": abs}), "`eq` or `ineq`"),
        (dict(constraints=[3]), "constraint 0"),
        (dict(constraints=optimize.LinearConstraint([[1.0, 1.0]], 0, 1)), "A has the shape"),
        (dict(constraints=optimize.NonlinearConstraint(lambda x: x, 2.0, 1.0)), "contain no value"),
        (dict(fun=3), "not a function"),
        (dict(fun=lambda x: [1.0, 2.0]), "one number"),
        (dict(fun=lambda x: "one"), "real numbers"),
        (dict(jac=lambda x: [1.0, 2.0]), "derivative of `fun`"),
        (dict(method="slsqp"), "no method"),
    ],
)
def test_wrong_arguments_are_named(arguments, message):
    with pytest.raises(linkwright.DefinitionError, match=message):
        linkwright.minimize(**(dict(fun=lambda x: x[0] ** 2, x0=[1.0]) | arguments))


def test_an_exception_of_the_function_arrives():
    def f(x):
        if x[0] < 0.5:
            raise OverflowError("mine")
        return x[0] ** 2

    with pytest.raises(OverflowError, match="mine"):
        linkwright.minimize(f, [1.0], bounds=[(-1, 1)])


def test_forms_of_scipy():
    def fun(x, factor=1.0):
        return factor * (x[0] - 3.0) ** 2

    assert linkwright.minimize(fun, [1.0], constraints=None).x[0] == pytest.approx(3.0, abs=1e-4)
    assert linkwright.minimize(fun, [1.0], args=2.0).x[0] == pytest.approx(3.0, abs=1e-4)
    equal = {"type": "EQ", "fun": lambda x, c: x[0] - c, "args": 2.0}
    assert linkwright.minimize(fun, [1.0], constraints=equal).x[0] == pytest.approx(2.0, abs=1e-4)
    assert linkwright.minimize(fun, [1.0], jac="2-point").x[0] == pytest.approx(3.0, abs=1e-4)
    for jac in ("nope", 3):
        with pytest.raises(linkwright.DefinitionError, match="`jac` is a function"):
            linkwright.minimize(fun, [1.0], jac=jac)
    with pytest.raises(linkwright.DefinitionError, match="give a pair"):
        linkwright.minimize(fun, [1.0, 1.0], bounds=(0, 1))
    with pytest.raises(linkwright.DefinitionError, match="the same option"):
        linkwright.minimize(fun, [1.0], options={"maxiter": 3, "max_cycles": 5})
    stopped = linkwright.minimize(fun, [1.0], callback=lambda x: np.all(x > -9))
    assert stopped.status == 4 and stopped.nit == 1


def test_the_default_method_says_that_it_does_not_use_tol():
    with pytest.warns(UserWarning, match="does not use `tol`"):
        linkwright.minimize(lambda x: (x[0] - 3.0) ** 2, [1.0], tol=1e-3)


def test_an_unbounded_problem_is_named():
    found = linkwright.minimize(lambda x: -x[0], [1.0])
    assert not found.success and "seems to be unbounded" in found.message


def test_one_number_in_any_form_and_the_callbacks_of_scipy():
    seen = []
    found = linkwright.minimize(lambda x: np.array([[x @ x]]), [1.0, 2.0], callback=lambda x, state: seen.append((x, state.fun)))
    assert found.success and abs(found.fun) < 1e-6
    assert all(abs(x @ x - fun) < 1e-12 for x, fun in seen) and seen
    # A second parameter with a default is not SciPy's state.
    linkwright.minimize(lambda x: x @ x, [1.0], callback=lambda x, more=3: seen.append(more))
    assert seen[-1] == 3
    with pytest.raises(linkwright.DefinitionError, match="`callback` is not a function: 3"):
        linkwright.minimize(lambda x: x @ x, [1.0], callback=3)
    from scipy.optimize import NonlinearConstraint

    many = NonlinearConstraint(lambda x: np.full(10001, x[0]), -9, 9)
    with pytest.raises(linkwright.DefinitionError, match="10002 responses are too many"):
        linkwright.minimize(lambda x: x @ x, [1.0], constraints=many)
