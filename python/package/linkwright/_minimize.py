"""Minimization in the form of SciPy."""

from __future__ import annotations

import inspect
import warnings
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np

from ._errors import DefinitionError
from ._problem import Method, Problem, _numbers, says_stop
from ._results import Array, Cycle, Result

# Names of SciPy's finite differences, all of which mean central differences here.
DIFFERENCES = ("2-point", "3-point", "cs")

_STATUS = {"converged": 0, "cycle limit": 1, "infeasible": 2, "stalled": 3, "stopped": 4}


class OptimizeResult(dict):
    """Result of :func:`minimize`: `x`, `fun`, `success`, `status`, `message`, `nit`, `nfev`, `njev`, `maxcv`, `history`, `result`.

    The fields are also attributes. With SciPy installed it is a ``scipy.optimize.OptimizeResult``.
    """

    def __getattr__(self, name: str) -> Any:
        try:
            return self[name]
        except KeyError:
            raise AttributeError(name) from None


def _result(fields: dict[str, Any]) -> Any:
    try:
        from scipy.optimize import OptimizeResult as Class
    except ImportError:
        Class = OptimizeResult
    return Class(fields)


def minimize(
    fun: Callable[..., Any],
    x0: Any,
    args: Any = (),
    *,
    jac: Callable[..., Any] | bool | str | None = None,
    constraints: Any = (),
    bounds: Any = None,
    method: Method = "automatic",
    callback: Callable[..., Any] | None = None,
    tol: float | None = None,
    options: Mapping[str, Any] | None = None,
) -> Any:
    """Minimize a function subject to constraints and bounds, with few evaluations.

    Parameters
    ----------
    fun : callable
        ``fun(x, *args)`` returns the objective, or a pair (objective, gradient) if `jac` is True.
    x0 : array_like, shape (n,)
        Start; it is moved into the bounds.
    args : tuple, optional
        Further arguments of `fun` and `jac`; a single one need not be a tuple.
    jac : callable, True or str, optional
        Gradient, shape (n,). Otherwise (None, False, or SciPy's `2-point`, `3-point`, `cs`) central differences inside the bounds.
    constraints : optional
        ``NonlinearConstraint``, ``LinearConstraint`` or a dictionary with `type` (`eq` or `ineq`), `fun`, `jac`, `args`; one of
        them, or a sequence.
    bounds : optional
        ``Bounds``, or a pair (lower, upper) for each variable, with None for no bound.
    method : str or mapping
        A method of linkwright, see :func:`linkwright.methods`.
    callback : callable, optional
        ``callback(xk)``, ``callback(xk, state)`` if it has two parameters without defaults, or ``callback(intermediate_result)`` if its only parameter
        has that name; `state` and `intermediate_result` have `x`, `fun` and `nit`. The run stops if it returns True or raises ``StopIteration``.
    tol : float, optional
        Relative change of the objective, and violation relative to the limit (absolute where the limit is zero), below which the
        run ends: `accuracy` of the method. The method `automatic` has a stop test without this setting: it warns, and ends where the
        optimality conditions hold to about 1e-4 of the changes of the objective.
    options : mapping, optional
        Keys of ``[method]`` in a model file; `maxiter` is `max_cycles`, and `disp` prints the result.

    Returns
    -------
    OptimizeResult
        `x`, `fun`, `success`, `status` (0 converged, 1 cycle limit, 2 infeasible, 3 stalled, 4 stopped by the callback), `message`,
        `nit` (accepted cycles), `nfev` and `njev` (calls of `fun` and of its gradient), `maxcv` (largest violation in the unit of
        the constraint), `history`, and the `result` with report and figures.

    Examples
    --------
    >>> import linkwright
    >>> found = linkwright.minimize(lambda x: x[0]**2 + x[1]**2, [2.0, 2.0], bounds=[(-3, 3), (-3, 3)],
    ...     constraints={"type": "ineq", "fun": lambda x: x[0] + x[1] - 1})
    >>> found.x.round(4).tolist()
    [0.5, 0.5]
    """
    x0 = _numbers(x0, "x0")
    x0 = np.atleast_1d(x0.squeeze())
    if x0.ndim != 1 or not np.isfinite(x0).all():
        raise DefinitionError(f"x0 must be a vector of finite numbers, got {x0!r}")
    options = dict(options or {})
    lower, upper = _bounds(bounds, len(x0))
    x0 = np.clip(x0, lower, upper)
    if not (jac is None or isinstance(jac, bool) or callable(jac) or jac in DIFFERENCES):
        raise DefinitionError(f"`jac` is a function, True, None or one of {', '.join(DIFFERENCES)}, got {jac!r}")
    objective = ObjectiveBlock(fun, jac, args if isinstance(args, tuple) else (args,), x0, lower, upper)
    blocks = [objective, *_constraints(constraints, x0, lower, upper)]
    is_shown = options.pop("disp", False)
    problem = _problem(blocks, x0, lower, upper)
    found = problem.optimize(_options(method, tol, options), _callback(callback))
    result = _converted(found, blocks)
    if is_shown:
        print(f"{result.message}\n  objective {result.fun:.10g}, {result.nit} cycles, {result.nfev} evaluations, {result.njev} gradients")
    return result


def scipy_method(
    fun: Callable[..., Any], x0: Any, args: Any = (), *, preset: Method = "automatic", **keywords: Any
) -> Any:
    """The method of :func:`minimize` for ``scipy.optimize.minimize(..., method=linkwright.scipy_method)``.

    Parameters
    ----------
    fun, x0, args
        As SciPy passes them.
    preset : str or mapping
        A method of linkwright; give it as ``options={"preset": "gcmma"}``.
    **keywords
        `jac`, `bounds`, `constraints`, `callback`, `tol`, and the options. `hess` and `hessp` are not used.

    Returns
    -------
    scipy.optimize.OptimizeResult
    """
    known = {name: keywords.pop(name, None) for name in ("jac", "bounds", "callback", "tol")}
    constraints = keywords.pop("constraints", ())
    for name in ("hess", "hessp"):
        keywords.pop(name, None)
    return minimize(fun, x0, args, constraints=constraints, method=preset, options=keywords, **known)


# Results can be pickled if the user's functions can: functions are wrapped in objects, not in closures.


class _WithArguments:
    """A function of x with further arguments."""

    def __init__(self, function: Callable[..., Any], args: tuple[Any, ...]) -> None:
        self.function, self.args = function, args

    def __call__(self, x: Array) -> Any:
        return self.function(x, *self.args)


class _Linear:
    """The product of a matrix and x, and its derivative."""

    def __init__(self, matrix: Array) -> None:
        self.matrix = matrix

    def value(self, x: Array) -> Array:
        return self.matrix @ x

    def derivative(self, _: Array) -> Array:
        return self.matrix


class _Stack:
    """The values of all blocks, and their derivatives."""

    def __init__(self, blocks: list[Block]) -> None:
        self.blocks = blocks

    def values(self, x: Array) -> list[float]:
        return np.concatenate([block.value(x) for block in self.blocks]).tolist()

    def derivatives(self, x: Array) -> list[Array]:
        return list(np.concatenate([block.jacobian(x) for block in self.blocks]))


class Block:
    """A vector function of x with its limits, and its derivatives: those of the user, or central differences inside the bounds."""

    def __init__(self, function: Callable[[Array], Any], jac: Any, x0: Array, box: tuple[Array, Array], name: str) -> None:
        self.function, self.name, self.box = function, name, box
        self.jac = jac if callable(jac) else None
        self.calls = self.gradients = 0
        self.size = len(self.value(x0))
        self.lower = self.upper = np.zeros(self.size)

    def value(self, x: Array) -> Array:
        self.calls += 1
        values = np.atleast_1d(_numbers(_dense(self.function(x)), self.name))
        if values.size == 1:
            return values.reshape(1)  # one number in any form, as of SciPy
        if values.ndim != 1:
            raise DefinitionError(f"{self.name} returned the shape {values.shape}; return a number or a vector")
        return values

    def jacobian(self, x: Array) -> Array:
        self.gradients += 1
        if self.jac is None:
            return self._central(x)
        rows = np.atleast_2d(_numbers(_dense(self.jac(x)), f"the derivative of {self.name}"))
        if rows.shape != (self.size, len(x)):
            raise DefinitionError(f"the derivative of {self.name} has the shape {rows.shape}, expected {(self.size, len(x))}")
        return rows

    def _central(self, x: Array) -> Array:
        columns = []
        for k in range(len(x)):
            h = 6e-6 * max(abs(x[k]), 1e-2)
            ends = np.clip([x[k] - h, x[k] + h], self.box[0][k], self.box[1][k])
            if ends[0] == ends[1]:
                columns.append(np.zeros(self.size))
                continue
            low, high = x.copy(), x.copy()
            low[k], high[k] = ends
            columns.append((self.value(high) - self.value(low)) / (ends[1] - ends[0]))
        return np.stack(columns, axis=1)


class ObjectiveBlock(Block):
    """The objective, with its gradient in one call if `jac` is True."""

    def __init__(self, fun: Any, jac: Any, args: tuple[Any, ...], x0: Array, lower: Array, upper: Array) -> None:
        if not callable(fun):
            raise DefinitionError(f"`fun` is not a function: {fun!r}")
        self._last: tuple[bytes, Any] = (b"", None)
        self._pair = _WithArguments(fun, args)
        function: Any = self._pair
        derivative: Any = _WithArguments(jac, args) if callable(jac) else None
        if jac is True:
            function, derivative = self._first, self._second
        super().__init__(function, derivative, x0, (lower, upper), "`fun`")
        if self.size != 1:
            raise DefinitionError(f"`fun` returned {self.size} values; the objective is one number")

    def _first(self, x: Array) -> Any:
        pair = self._pair(x)
        if not isinstance(pair, tuple) or len(pair) != 2:
            raise DefinitionError("`fun` must return a pair (objective, gradient), because `jac` is True")
        self._last = (x.tobytes(), pair[1])
        return pair[0]

    def _second(self, x: Array) -> Any:
        key, gradient = self._last
        return gradient if key == x.tobytes() else self._pair(x)[1]


def _dense(values: Any) -> Any:
    return values.toarray() if hasattr(values, "toarray") else values


def _bounds(bounds: Any, n: int) -> tuple[Array, Array]:
    if bounds is None:
        return np.full(n, -np.inf), np.full(n, np.inf)
    if hasattr(bounds, "lb") and hasattr(bounds, "ub"):
        lower, upper = (np.broadcast_to(np.asarray(side, dtype=float), n).copy() for side in (bounds.lb, bounds.ub))
    else:
        pairs = list(bounds)
        if len(pairs) != n or any(np.size(pair) != 2 for pair in pairs):
            raise DefinitionError(f"bounds: give a pair (lower, upper) for each of the {n} variables")
        lower = np.array([-np.inf if low is None else low for low, _ in pairs], dtype=float)
        upper = np.array([np.inf if high is None else high for _, high in pairs], dtype=float)
    if not (lower <= upper).all():
        k = int(np.argmin(lower <= upper))
        raise DefinitionError(f"bounds of x{k}: the lower bound {lower[k]} and the upper bound {upper[k]} contain no value")
    return lower, upper


def _constraints(constraints: Any, x0: Array, lower: Array, upper: Array) -> list[Block]:
    if constraints is None:
        return []
    if isinstance(constraints, Mapping) or hasattr(constraints, "lb"):
        constraints = [constraints]
    return [_constraint(c, f"constraint {i}", x0, (lower, upper)) for i, c in enumerate(constraints)]


def _constraint(constraint: Any, name: str, x0: Array, box: tuple[Array, Array]) -> Block:
    if isinstance(constraint, Mapping):
        kind, args = str(constraint.get("type")).lower(), constraint.get("args", ())
        args = args if isinstance(args, tuple) else (args,)
        if kind not in ("eq", "ineq") or not callable(constraint.get("fun")):
            raise DefinitionError(f"{name}: give `type` (`eq` or `ineq`) and the function `fun`")
        jac = constraint.get("jac")
        derivative = _WithArguments(jac, args) if callable(jac) else None
        block = Block(_WithArguments(constraint["fun"], args), derivative, x0, box, name)
        block.upper = np.full(block.size, 0.0 if kind == "eq" else np.inf)
        return block
    if hasattr(constraint, "A"):
        matrix = np.atleast_2d(_numbers(_dense(constraint.A), name))
        if matrix.shape[1] != len(x0):
            raise DefinitionError(f"{name}: A has the shape {matrix.shape}, but there are {len(x0)} variables")
        linear = _Linear(matrix)
        block = Block(linear.value, linear.derivative, x0, box, name)
    elif hasattr(constraint, "fun") and hasattr(constraint, "lb"):
        block = Block(constraint.fun, constraint.jac, x0, box, name)
    else:
        raise DefinitionError(f"{name}: expected a constraint of SciPy or a dictionary, got {constraint!r}")
    block.lower, block.upper = (np.broadcast_to(np.asarray(side, float), block.size) for side in (constraint.lb, constraint.ub))
    return block


def _problem(
    blocks: list[Block], x0: Array, lower: Array, upper: Array, variables: Sequence[str] | None = None
) -> Problem:
    """A problem with a response for each value of each function. The variables are x0, x1, … without other names."""
    names = ["objective", *(f"c{i}_{j}" for i, block in enumerate(blocks[1:]) for j in range(block.size))]
    limits = [limit for block in blocks[1:] for limit in zip(block.lower.tolist(), block.upper.tolist())]
    constraints = {name: _limits(name, *limit) for name, limit in zip(names[1:], limits) if limit != (-np.inf, np.inf)}
    labels = variables or [f"x{k}" for k in range(len(x0))]
    stack = _Stack(blocks)
    return Problem(
        {label: {"start": x0[k], "lower": lower[k], "upper": upper[k]} for k, label in enumerate(labels)},
        names,
        stack.values,
        derivatives=stack.derivatives,
        objective="objective",
        constraints=constraints,
        name="minimize",
    )


def _limits(name: str, lower: float, upper: float) -> dict[str, float]:
    if not lower <= upper or lower == np.inf or upper == -np.inf:
        raise DefinitionError(f"constraint {name}: the limits {lower} and {upper} contain no value")
    if lower == upper:
        return {"equals": lower}
    sides = {"at_least": lower, "at_most": upper}
    return {side: limit for side, limit in sides.items() if np.isfinite(limit)}


def _options(method: Method, tol: float | None, options: dict[str, Any]) -> dict[str, Any]:
    table = {"preset": method} if isinstance(method, str) else dict(method)
    table |= {key: value for key, value in options.items() if key != "maxiter"}
    if tol is not None:
        table["accuracy"] = float(tol)
        if table.get("preset", "automatic") == "automatic":
            text = "the method `automatic` has a stop test of its own and does not use `tol`; omit it, or choose another method"
            warnings.warn(text, stacklevel=3)
    if options.get("maxiter") is not None:
        if "max_cycles" in options:
            raise DefinitionError("`maxiter` and `max_cycles` are the same option: give one of them")
        table["max_cycles"] = int(options["maxiter"])
    return table


def _callback(callback: Callable[..., Any] | None) -> Callable[[Cycle], Any] | None:
    if callback is None:
        return None
    if not callable(callback):
        raise DefinitionError(f"`callback` is not a function: {callback!r}")
    try:
        parameters = dict(inspect.signature(callback).parameters)
    except (TypeError, ValueError):
        parameters = {}
    positional = (inspect.Parameter.POSITIONAL_ONLY, inspect.Parameter.POSITIONAL_OR_KEYWORD)
    needed = [p for p in parameters.values() if p.default is p.empty and p.kind in positional]

    def call(cycle: Cycle) -> Any:
        if cycle.cycle == 0 or not cycle.accepted:
            return False
        state = _result({"x": cycle.design, "fun": cycle.objective, "nit": cycle.cycle})
        if set(parameters) == {"intermediate_result"}:
            return callback(intermediate_result=state)
        return callback(cycle.design, state) if len(needed) == 2 else callback(cycle.design)

    return call


def _violation(block: Block, values: Array) -> float:
    return float(np.maximum(block.lower - values, values - block.upper).max(initial=0.0))


def _converted(found: Result, blocks: list[Block]) -> Any:
    values = np.array(list(found.responses.values()))
    ends = np.cumsum([block.size for block in blocks])
    parts = np.split(values, ends[:-1])
    return _result(
        {
            "x": found.design,
            "fun": found.objective,
            "success": found.success,
            "status": _STATUS.get(found.status, 5),
            "message": found.message or found.status,
            "nit": found.cycles,
            "nfev": blocks[0].calls,
            "njev": blocks[0].gradients,
            "maxcv": max((_violation(b, v) for b, v in zip(blocks[1:], parts[1:])), default=0.0),
            "history": found.history,
            "result": found,
        }
    )


__all__ = ["OptimizeResult", "minimize", "scipy_method"]
