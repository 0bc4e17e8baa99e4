"""Results: analyses, derivatives, checks, comparisons, and runs."""

from __future__ import annotations

import html
import os
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from . import _core
from ._errors import DefinitionError
from ._labels import Array, Labels

# Largest number of rows of the short form of a result.
SHOWN = 12
# Most points along a side of the slice of the design space, as in the command.
SLICE = 101


def _pandas() -> Any:
    try:
        import pandas
    except ImportError:
        raise ImportError("this needs pandas: pip install pandas") from None
    return pandas


def _xarray() -> Any:
    try:
        import xarray
    except ImportError:
        raise ImportError("this needs xarray: pip install xarray") from None
    return xarray


def whole(value: Any, name: str, least: int, most: int) -> int:
    """An integer argument from `least` to `most`."""
    if isinstance(value, bool) or not isinstance(value, (int, np.integer)) or not least <= value <= most:
        raise DefinitionError(f"`{name}` is a whole number from {least} to {most}, got {value!r}")
    return int(value)


def _shown(value: Any) -> str:
    """A number, or the range of an array, in a few words."""
    if np.ndim(value) == 0:
        return f"{value:.6g}"
    array = np.asarray(value, dtype=float)
    finite = array[np.isfinite(array)]
    shape = "×".join(str(n) for n in array.shape)
    return f"{shape} values" + (f", {finite.min():.6g} to {finite.max():.6g}" if finite.size else "")


class _Table:
    """A result with a short form for terminals and a table for notebooks: `_summary` has the first line and the rows."""

    def _summary(self) -> tuple[str, list[tuple[str, str]]]:
        raise NotImplementedError

    def __repr__(self) -> str:
        head, rows = self._summary()
        more = [f"  … {len(rows) - SHOWN} more"] if len(rows) > SHOWN else []
        return "\n".join([head, *(f"  {name}: {text}" for name, text in rows[:SHOWN]), *more])

    def _repr_html_(self) -> str:
        head, rows = self._summary()
        return f"<p>{html.escape(head)}</p>" + _html_table(["name", "values"], [list(row) for row in rows])


def _named_values(variables: tuple[str, ...], design: Array) -> str:
    shown = ", ".join(f"{name}={value:.6g}" for name, value in list(zip(variables, design.tolist()))[:6])
    return shown + (", …" if len(variables) > 6 else "")


def _free_names(names: Iterable[str], taken: Iterable[str]) -> dict[str, str]:
    """Columns of design variables: their names, after `design.` where another column has that name."""
    taken = set(taken)
    return {name: f"design.{name}" if name in taken else name for name in names}


@dataclass(frozen=True, repr=False)
class Analysis(_Table):
    """Responses, objective and constraints at one design.

    Attributes
    ----------
    design : ndarray, shape (n,)
        The design variables in their units.
    variables : tuple of str
        Their names.
    time : ndarray, shape (nt,), or None
        The time points, in the unit of the grid.
    responses : dict of str to ndarray or float
        Each response in its unit: shape (nt,), or a float if it does not depend on time.
    objective : float
        Value of the objective in its unit.
    constraints : dict of str to ndarray or float
        Normalized constraints: feasible means at most 1, and equal to 1 for an equality. Shape (nt,) or a float.
    violation_pct : float
        Largest violation in percent of the limit; negative in the feasible region.
    warnings : tuple of str
        Reasons to doubt the numbers, such as a loss of energy, each with the part of the model, the time and a remedy.
    axis : str
        Name of the axis of the responses: "time", or the quantity of a sweep. DataFrames and Datasets have it as index.
    """

    design: Array
    variables: tuple[str, ...]
    time: Array | None
    responses: dict[str, Any]
    objective: float
    constraints: dict[str, Any]
    violation_pct: float
    warnings: tuple[str, ...] = ()
    axis: str = "time"

    def __getitem__(self, name: str) -> Any:
        """The response of this name."""
        return _named(self.responses, "response", name)

    def to_pandas(self) -> Any:
        """Return a DataFrame with a column for each response and a row for each time point; one row without time points.

        A response that does not depend on time has the same value in all rows.
        """
        index = _index(self.time, self.axis)
        return _pandas().DataFrame({name: np.broadcast_to(v, len(index)) for name, v in self.responses.items()}, index=index)

    def _summary(self) -> tuple[str, list[tuple[str, str]]]:
        head = f"Analysis at {_named_values(self.variables, self.design)}: objective {self.objective:.8g}, violation {self.violation_pct:.3g} %"
        return head, [(name, _shown(values)) for name, values in self.responses.items()]

    def to_xarray(self) -> Any:
        """Return a Dataset with the coordinate :attr:`axis`."""
        data = {name: ((self.axis,) if np.ndim(values) else (), values) for name, values in self.responses.items()}
        return _xarray().Dataset(data, coords={self.axis: _points(self.time)})


@dataclass(frozen=True, repr=False)
class Analyses(_Table):
    """Responses, objective and constraints at many designs.

    Attributes
    ----------
    designs : ndarray, shape (m, n)
    responses, constraints : dict of str to ndarray
        As in :class:`Analysis`, with one row for each design: shape (m, nt) or (m,). NaN where the analysis failed.
    objective, violation_pct : ndarray, shape (m,)
    failures : list of (str or None)
        Why the analysis of a design failed.
    axis : str
        As in :class:`Analysis`.
    """

    designs: Array
    variables: tuple[str, ...]
    time: Array | None
    responses: dict[str, Array]
    objective: Array
    constraints: dict[str, Array]
    violation_pct: Array
    failures: list[str | None]
    axis: str = "time"

    def __len__(self) -> int:
        return len(self.designs)

    def _summary(self) -> tuple[str, list[tuple[str, str]]]:
        failed = sum(failure is not None for failure in self.failures)
        rows = {"objective": self.objective, "violation_pct": self.violation_pct, **self.responses}
        return f"Analyses of {len(self)} designs, {failed} failed", [(name, _shown(values)) for name, values in rows.items()]

    def to_pandas(self) -> Any:
        """Return a DataFrame with a row for each design: variables, objective, violation, responses that do not depend on time, failure.

        A variable or response with the name of another column has the column `design.NAME` or `response.NAME`.
        """
        own: dict[str, Any] = {"objective": self.objective, "violation_pct": self.violation_pct, "failure": self.failures}
        names = _free_names(self.variables, [*own, *self.responses])
        columns: dict[str, Any] = {names[name]: self.designs[:, k] for k, name in enumerate(self.variables)}
        numbers = {name: values for name, values in self.responses.items() if values.ndim == 1}
        columns |= {f"response.{name}" if name in own else name: values for name, values in numbers.items()}
        columns |= own
        return _pandas().DataFrame(columns)

    def to_xarray(self) -> Any:
        """Return a Dataset with the dimensions `design` and :attr:`axis`."""
        data: dict[str, Any] = {n: (("design", self.axis)[: v.ndim], v) for n, v in self.responses.items()}
        data |= {"objective": ("design", self.objective), "violation_pct": ("design", self.violation_pct)}
        coords = {self.axis: _points(self.time)} | {n: ("design", self.designs[:, k]) for k, n in enumerate(self.variables)}
        return _xarray().Dataset(data, coords=coords)


@dataclass(frozen=True, repr=False)
class Sensitivities(_Table):
    """Derivatives of responses with respect to the design variables.

    Attributes
    ----------
    design : ndarray, shape (n,)
    variables : tuple of str
    time : ndarray, shape (nt,), or None
    values : dict of str to ndarray
        For each response an array of shape (nt, n), or (n,) if it does not depend on time; in the unit of the response over
        that of the variable.
    axis : str
        As in :class:`Analysis`.
    """

    design: Array
    variables: tuple[str, ...]
    time: Array | None
    values: dict[str, Array]
    axis: str = "time"

    def _summary(self) -> tuple[str, list[tuple[str, str]]]:
        head = f"Sensitivities at {_named_values(self.variables, self.design)}"
        pairs = ((name, v, k) for name, v in self.values.items() for k in range(len(self.variables)))
        return head, [(f"d {name}/d {self.variables[k]}", _shown(v[..., k])) for name, v, k in pairs]

    def __getitem__(self, name: str) -> Array:
        """The derivatives of the response of this name."""
        return _named(self.values, "response", name)

    def to_pandas(self) -> Any:
        """Return a DataFrame with a column (response, variable) for each derivative and a row for each time point; one row without time points.

        The derivatives of a response that does not depend on time are the same in all rows.
        """
        pandas, index = _pandas(), _index(self.time, self.axis)
        columns = {
            (name, variable): np.broadcast_to(v[..., k], len(index))
            for name, v in self.values.items()
            for k, variable in enumerate(self.variables)
        }
        frame = pandas.DataFrame(columns, index=index)
        if columns:
            frame.columns = pandas.MultiIndex.from_tuples(list(columns), names=["response", "variable"])
        return frame

    def to_xarray(self) -> Any:
        """Return a Dataset with the dimensions :attr:`axis` and `variable`."""
        data = {name: ((self.axis, "variable")[-values.ndim :], values) for name, values in self.values.items()}
        return _xarray().Dataset(data, coords={self.axis: _points(self.time), "variable": list(self.variables)})


@dataclass(frozen=True, repr=False)
class Check(_Table):
    """Derivatives by all methods of an analysis, compared with finite differences.

    Attributes
    ----------
    methods : tuple of str
        Names of the methods.
    rows : list of dict
        A row for each derivative: `response`, `time`, `variable`, the value by each method, `differences` and their `error`,
        `status` (right, constant, wrong, kink, not repeatable, unclear) and an `explanation`.
    failed : dict of str to str
        Methods that failed, with the reasons.
    """

    methods: tuple[str, ...]
    rows: list[dict[str, Any]]
    failed: dict[str, str]

    @property
    def ok(self) -> bool:
        """True if every derivative is right, or constant and zero, and no method failed."""
        return not self.failed and all(row["status"] in ("right", "constant") for row in self.rows)

    def to_pandas(self) -> Any:
        """Return the rows as a DataFrame."""
        return _pandas().DataFrame(self.rows)

    def _summary(self) -> tuple[str, list[tuple[str, str]]]:
        counts: dict[str, int] = {}
        for row in self.rows:
            counts[row["status"]] = counts.get(row["status"], 0) + 1
        head = ", ".join(f"{count} {status}" for status, count in counts.items())
        wrong = [row for row in self.rows if row["status"] not in ("right", "constant")]
        rows = [(f"the {method} method", f"failed: {why}") for method, why in self.failed.items()]
        rows += [(f"{row['response']} by {row['variable']}", row["explanation"]) for row in wrong]
        return f"{head}, by {', '.join(self.methods)}", rows


@dataclass(frozen=True)
class Comparison:
    """Runs of several methods on one problem.

    Attributes
    ----------
    rows : list of dict
        A row for each method: `method`, `status`, `objective`, `violation_pct`, `cycles`, `analyses`, `sensitivity_analyses`,
        `kkt_residual` (largest residual of the optimality conditions, computed independently of the method), `design`. Converged
        runs with the least work are first.
    """

    rows: list[dict[str, Any]]

    def to_pandas(self) -> Any:
        """Return the rows as a DataFrame."""
        return _pandas().DataFrame(self.rows)

    def _repr_html_(self) -> str:
        names = [name for name in self.rows[0] if name != "design"]
        return _html_table(names, [[row[name] for name in names] for row in self.rows])


class Figure:
    """A figure of a report; a notebook shows it.

    Attributes
    ----------
    name : str
    svg : str
        The figure as SVG.
    """

    def __init__(self, name: str, svg: str) -> None:
        self.name, self.svg = name, svg

    def _repr_svg_(self) -> str:
        return self.svg

    def save(self, path: str | os.PathLike[str]) -> None:
        """Write the SVG to a file."""
        with open(path, "w", encoding="utf-8") as file:
            file.write(self.svg)

    def __repr__(self) -> str:
        return f"Figure({self.name!r}, {len(self.svg)} bytes of SVG)"


class Page(str):
    """A report as an HTML page; a notebook shows it."""

    def _repr_html_(self) -> str:
        return f'<iframe srcdoc="{html.escape(self, quote=True)}" width="100%" height="640" style="border:0"></iframe>'

    def __repr__(self) -> str:
        return f"Page({len(self)} characters of HTML)"


@dataclass(frozen=True)
class Cycle:
    """A trial step of a run, as a callback receives it.

    Attributes
    ----------
    cycle : int
        Number of the cycle; 0 is the start. A rejected step has the number of its cycle.
    accepted : bool
    design : ndarray, shape (n,)
        The proposed design.
    objective : float
        Its objective.
    objective_error_pct, constraint_error_pct : float
        Errors of the approximation in percent.
    violation_pct : float
        Largest violation in percent.
    step_pct : float
        Largest relative change of a variable in percent.
    at_limits, retained, active : int
        Numbers of variables at a move limit, of retained and of active constraints.
    failure : str or None
        Why the analysis failed.
    status : str
        Status of the run.
    analyses, sensitivity_analyses : int
        Their numbers so far.
    """

    cycle: int
    accepted: bool
    design: Array
    objective: float
    objective_error_pct: float
    constraint_error_pct: float
    violation_pct: float
    step_pct: float
    at_limits: int
    retained: int
    active: int
    failure: str | None
    status: str
    analyses: int
    sensitivity_analyses: int


class Result:
    """The result of an optimization. It can be pickled, and continued by ``problem.optimize(resume=result)``."""

    def __init__(self, problem: Labels, state: _core.State, *, stopped: bool = False) -> None:
        self.problem = problem
        self._state = state
        self._stopped = stopped

    def __getstate__(self) -> dict[str, Any]:
        return {"problem": self.problem, "json": self._state.to_json(), "stopped": self._stopped}

    def __setstate__(self, state: dict[str, Any]) -> None:
        self.problem, self._stopped = state["problem"], state["stopped"]
        self._state = self.problem._core.state(state["json"])

    @property
    def status(self) -> str:
        """`converged`, `cycle limit`, `stalled`, `infeasible`, or `stopped` by the callback."""
        return "stopped" if self._stopped else self._state.status[0]

    @property
    def success(self) -> bool:
        """True if the run converged to a point that satisfies the optimality conditions."""
        return self.status == "converged"

    @property
    def message(self) -> str:
        """The reason of the status in words."""
        return "the callback stopped the run" if self._stopped else self._state.status[1]

    @property
    def design(self) -> Array:
        """The last accepted design, shape (n,)."""
        return self._state.design

    @property
    def variables(self) -> dict[str, float]:
        """The last accepted design by names."""
        return dict(zip(self.problem.variable_names, self.design.tolist()))

    @property
    def objective(self) -> float:
        """The objective at the last accepted design."""
        return self.problem._sign * self._state.values[0]

    @property
    def violation_pct(self) -> float:
        """The largest violation at the last accepted design in percent; negative if no constraint is active."""
        return self._state.values[1]

    @property
    def warnings(self) -> tuple[str, ...]:
        """Reasons to doubt the numbers of the last accepted design; see :class:`Analysis`."""
        return tuple(self._state.warnings)

    @property
    def cycles(self) -> int:
        """Number of accepted cycles."""
        return self._state.counters[0]

    @property
    def analyses(self) -> int:
        """Number of analyses, without those of finite differences."""
        return self._state.counters[1]

    @property
    def sensitivity_analyses(self) -> int:
        """Number of sensitivity analyses."""
        return self._state.counters[2]

    @property
    def responses(self) -> dict[str, Any]:
        """The responses at the last accepted design, as in :class:`Analysis`."""
        return self.problem._labelled_responses(self._state.responses)

    @property
    def constraints(self) -> dict[str, Any]:
        """The normalized constraints at the last accepted design, as in :class:`Analysis`."""
        return self.problem._labelled_constraints(self._state.constraints)

    @property
    def multipliers(self) -> list[tuple[str, float | None, float]]:
        """Active constraints of the last cycle: name, time (None if there is none), and multiplier in the unit of the objective.

        The multiplier is the derivative of the optimal (minimized) objective with respect to a tightening of the normalized constraint.
        """
        time, rows = self.problem.time, self.problem._core.constraints
        named = [(rows[j], p, multiplier) for j, p, multiplier in self._state.active]
        return [(row[0], float(time[p]) if row[4] and time is not None else None, m) for row, p, m in named]

    @property
    def history(self) -> Any:
        """A row for each trial step: a pandas DataFrame, or a dict of lists where pandas is not installed.

        The columns are the fields of :class:`Cycle`, and the design variables by name; a variable with the name of a field has the
        column `design.NAME`.
        """
        columns = dict(self._state.history())
        columns["objective"] = [self.problem._sign * value for value in columns["objective"]]
        designs = self._state.designs()
        names = _free_names(self.problem.variable_names, columns)
        columns |= {names[name]: designs[:, k].tolist() for k, name in enumerate(self.problem.variable_names)}
        try:
            import pandas
        except ImportError:
            return columns
        return pandas.DataFrame(columns)

    @property
    def figures(self) -> dict[str, Figure]:
        """The figures of the report by name."""
        return {name: Figure(name, svg) for name, svg in _core.figures(self._state, self.problem._core)}

    def report(self, path: str | os.PathLike[str] | None = None, *, slice: int = 0) -> Page:
        """Return the report as one HTML page without external files.

        Parameters
        ----------
        path : path, optional
            File to which the page is written.
        slice : int, optional
            Number of points along each side of the slice of the design space, at most 101; each point is an analysis. 0, the default, omits
            the slice. A problem of Python functions has no slice.
        """
        page = Page(_core.report(self._state, self.problem._core, whole(slice, "slice", 0, SLICE)))
        if path is not None:
            with open(path, "w", encoding="utf-8") as file:
                file.write(page)
        return page

    def __repr__(self) -> str:
        design = ", ".join(f"{name}={value:.6g}" for name, value in list(self.variables.items())[:6])
        more = ", …" if len(self.variables) > 6 else ""
        return f"<Result {self.status}: objective {self.objective:.8g} after {self.analyses} analyses; {design}{more}>"

    def _repr_html_(self) -> str:
        start = self._state.designs()[0]
        rows = [
            [v.name, v.unit, v.lower, first, last, v.upper]
            for v, first, last in zip(self.problem.variables, start, self.design)
        ]
        head = f"<p><b>{html.escape(self.problem.title)}</b>: {self.status}. {html.escape(self.message)}.</p>"
        numbers = (
            f"<p>Objective {self.objective:.8g} {html.escape(self.problem.objective_unit)}, violation "
            f"{self.violation_pct:.2g} %, {self.analyses} analyses, {self.sensitivity_analyses} sensitivity analyses.</p>"
        )
        table = _html_table(["variable", "unit", "lower", "start", "end", "upper"], rows)
        return head + numbers + table + self._convergence()

    def _convergence(self) -> str:
        figure = self.figures.get("convergence")
        return "" if figure is None else figure.svg[figure.svg.index("<svg") :]


def _html_table(names: list[str], rows: list[list[Any]]) -> str:
    def cell(value: Any) -> str:
        return f"{value:.6g}" if isinstance(value, float) else html.escape(str(value))

    head = "".join(f"<th>{html.escape(name)}</th>" for name in names)
    body = "".join("<tr>" + "".join(f"<td>{cell(value)}</td>" for value in row) + "</tr>" for row in rows)
    return f"<table><thead><tr>{head}</tr></thead><tbody>{body}</tbody></table>"


def _index(time: Array | None, axis: str) -> Any:
    """The rows of a DataFrame: the time points, or one row."""
    return _pandas().RangeIndex(1) if time is None else _pandas().Index(time, name=axis)


def _points(time: Array | None) -> Array:
    return np.empty(0) if time is None else time


def _named(table: Mapping[str, Any], kind: str, name: str) -> Any:
    try:
        return table[name]
    except KeyError:
        raise DefinitionError(f"there is no {kind} `{name}`; there are {', '.join(table)}") from None


def cycle(problem: Labels, row: dict[str, Any], design: Array, state: _core.State) -> Cycle:
    """A trial step from a row of the history."""
    _, analyses, derivatives, _ = state.counters
    row["objective"] *= problem._sign
    return Cycle(**row, design=design, status=state.status[0], analyses=analyses, sensitivity_analyses=derivatives)
