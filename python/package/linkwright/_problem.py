"""Models and problems."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any

import numpy as np

from . import _core, _toml
from ._errors import AnalysisError, DefinitionError
from ._functions import Functions
from ._labels import Array, Labels
from ._results import Analyses, Analysis, Check, Comparison, Cycle, Result, Sensitivities, cycle, whole

Design = Any
"""A design: an array of shape (n,), a mapping of names to values or a Series with names as index (the others have their start values), or None for the start."""

Method = Any
"""A method: its name, or a dictionary with the keys of ``[method]`` in a model file."""


# Largest number of time points of a response in a check.
POINTS = 1000
# Largest number of responses of a problem: as many as a model file may have parts of one kind.
RESPONSES = 10_000


def methods() -> dict[str, str]:
    """Return the names and descriptions of all methods."""
    return dict(_core.methods())


class BaseProblem(Labels):
    """Common base class of models and problems."""

    def design(self, b: Design = None) -> Array:
        """Return a design as an array of shape (n,).

        Parameters
        ----------
        b : array_like, mapping or None
            Values in the order of the variables, or values by name (the others have their start values), or None for the start. A
            pandas Series whose index has names is a mapping.

        Raises
        ------
        DefinitionError
            For a wrong length, type or name, and for NaN.
        """
        if b is None:
            return self.start
        named = _by_name(b)
        if named is not None:
            unknown = [name for name in named if name not in self.variable_names]
            if unknown:
                known = ", ".join(self.variable_names)
                raise DefinitionError(f"there is no design variable `{unknown[0]}`; there are {known}")
            b = [named.get(variable.name, variable.start) for variable in self.variables]
        array = _numbers(b, "the design")
        if array.shape != (len(self.variables),):
            names = ", ".join(self.variable_names[:8])
            raise DefinitionError(
                f"the design has the shape {array.shape}, expected ({len(self.variables)},): a value for each of {names}"
            )
        self._check_finite(array)
        return array

    def _ordered(self, designs: Any) -> Any:
        """Designs with the columns in the order of the variables."""
        columns = list(getattr(designs, "columns", []))
        if not any(isinstance(name, str) for name in columns):
            return designs
        missing = [name for name in self.variable_names if name not in columns]
        if missing:
            raise DefinitionError(f"the designs have no column `{missing[0]}`; give one for each of {', '.join(self.variable_names)}")
        return np.column_stack([_numbers(designs[name], f"column `{name}`") for name in self.variable_names])

    def _check_finite(self, designs: Array) -> None:
        if not np.isfinite(designs).all():
            index = tuple(np.argwhere(~np.isfinite(designs))[0])
            where = f" of design {index[0]}" if len(index) > 1 else ""
            raise DefinitionError(f"design variable `{self.variable_names[index[-1]]}`{where} is {designs[index]}")

    def analyze(self, b: Design = None) -> Analysis:
        """Analyse a design.

        Parameters
        ----------
        b : array_like of shape (n,), mapping or None
            The design, see :meth:`design`.

        Returns
        -------
        Analysis

        Raises
        ------
        AnalysisError
            If the design cannot be analysed.
        """
        design = self.design(b)
        responses, objective, constraints, violation, warnings = self._core.analyze(design)
        return Analysis(
            design,
            self.variable_names,
            self.time,
            self._labelled_responses(responses),
            self._objective(objective),
            self._labelled_constraints(constraints),
            violation,
            tuple(warnings),
            self.axis,
        )

    def analyze_many(self, designs: Any) -> Analyses:
        """Analyse many designs in one call, a model on all cores. Designs that fail have NaN and a reason.

        Parameters
        ----------
        designs : array_like of shape (m, n), or DataFrame
            A DataFrame with named columns has one for each variable; its other columns are not used.

        Returns
        -------
        Analyses
        """
        array = _numbers(self._ordered(designs), "designs")
        if array.ndim != 2 or array.shape[1] != len(self.variables):
            raise DefinitionError(f"designs have the shape {array.shape}, expected (m, {len(self.variables)})")
        self._check_finite(array)
        responses, objective, constraints, violation, failures = self._core.analyze_many(array)
        return Analyses(
            array,
            self.variable_names,
            self.time,
            {name: v if is_history else v[:, 0] for (name, is_history), v in zip(self._responses, responses)},
            self._objective(objective),
            {name: v if is_history else v[:, 0] for (name, is_history), v in zip(self._constraints, constraints)},
            violation,
            failures,
            self.axis,
        )

    def sensitivities(
        self, b: Design = None, *, method: str | None = None, responses: Iterable[str] | None = None
    ) -> Sensitivities:
        """Differentiate the responses with respect to the design variables.

        Parameters
        ----------
        b : array_like of shape (n,), mapping or None
            The design, see :meth:`design`.
        method : str, optional
            One of :attr:`gradient_methods` (such as `direct` or `adjoint`), or finite differences of whole analyses:
            `forward`, `central`, `richardson`, `noise-aware`. By default the method of the model.
        responses : iterable of str, optional
            Names of the responses; all by default.

        Returns
        -------
        Sensitivities
        """
        if method is not None and not isinstance(method, str):
            raise DefinitionError(f"the method of derivatives is a name, got {method!r}")
        design = self.design(b)
        indices = self._response_indices(responses)
        arrays = self._core.sensitivities(design, indices, method)
        values = {}
        for h, array in zip(indices, arrays):
            name, _, over_time = self._core.responses[h]
            values[name] = array if over_time else array[0]
        return Sensitivities(design, self.variable_names, self.time, values, self.axis)

    @property
    def gradient_methods(self) -> tuple[str, ...]:
        """Names of the methods by which the analysis can be differentiated; empty if it has one only."""
        return tuple(self._core.gradient_methods)

    def check(self, b: Design = None, *, points: int = 5, responses: Iterable[str] | None = None) -> Check:
        """Compare the derivatives by all methods with finite differences that estimate their own error.

        Parameters
        ----------
        b : array_like of shape (n,), mapping or None
            The design, see :meth:`design`.
        points : int
            Time points of each response, at most 1000.
        responses : iterable of str, optional
            Names of the responses; all by default.

        Returns
        -------
        Check
        """
        indices = self._response_indices(responses)
        if not indices:
            raise DefinitionError("there is no response to check")
        found, table, failed = self._core.check(self.design(b), whole(points, "points", 1, POINTS), indices)
        rows = []
        for response, time, variable, values, difference, error, status, explanation in table:
            row = {"response": response, "time": time, "variable": variable, **dict(zip(found, values))}
            rows.append(row | {"differences": difference, "error": error, "status": status, "explanation": explanation})
        return Check(tuple(found), rows, dict(failed))

    def compare(self, names: Iterable[str] | None = None) -> Comparison:
        """Run several methods on this problem.

        Parameters
        ----------
        names : iterable of str, optional
            Names of methods; all by default.

        Returns
        -------
        Comparison
        """
        rows: list[dict[str, Any]] = []
        for name in methods() if names is None else [names] if isinstance(names, str) else _iterable(names, "names"):
            if not isinstance(name, str):
                raise DefinitionError(f"`names` has the names of methods, got {name!r}")
            status, objective, violation, cycles, analyses, derivatives, kkt, design = self._core.compare(name)
            rows.append(
                {
                    "method": name,
                    "status": status,
                    "objective": objective,
                    "violation_pct": violation,
                    "cycles": cycles,
                    "analyses": analyses,
                    "sensitivity_analyses": derivatives,
                    "kkt_residual": kkt,
                    "design": np.array(design),
                }
            )
        if not rows:
            raise DefinitionError("there is no method to compare")
        rows.sort(key=lambda r: (r["status"] != "converged", r["analyses"] == 0, r["analyses"] + r["sensitivity_analyses"]))
        return Comparison(rows)

    def optimize(
        self,
        method: Method = None,
        callback: Callable[[Cycle], Any] | None = None,
        *,
        start: Design = None,
        resume: Result | None = None,
    ) -> Result:
        """Find the best design.

        Parameters
        ----------
        method : str or dict, optional
            Name of a method (see :func:`linkwright.methods`), or a dictionary with the keys of ``[method]`` in a model file, for
            instance ``{"preset": "gcmma", "max_cycles": 50}``. By default that of the model; `automatic` for a
            :class:`Problem`.
        callback : callable, optional
            ``callback(cycle)`` is called with each :class:`Cycle`, the start first. The run stops if it returns True or raises
            ``StopIteration``; any other exception ends the run and is raised here.
        start : array_like of shape (n,), mapping or None
            The start design, see :meth:`design`.
        resume : Result, optional
            A result of this problem, from which the run continues; with the same method it has the same bits as a run without
            interruption. It replaces `start`.

        Returns
        -------
        Result

        Raises
        ------
        KeyboardInterrupt
            After Ctrl-C, at the end of the cycle.
        """
        if callback is not None and not callable(callback):
            raise DefinitionError(f"`callback` is not a function: {callback!r}")
        stopped = False

        def observe(state: _core.State) -> bool:
            nonlocal stopped
            if callback is None:
                return False
            row = {name: values[0] for name, values in state.history(True).items()}
            try:
                stopped = says_stop(callback(cycle(self, row, state.designs(True)[0], state)))
            except StopIteration:
                stopped = True
            return stopped

        if resume is not None:
            self._check_resume(resume, start)
        state = None if resume is None else resume._state
        found = self._core.optimize(self.design(start), self._method(method), observe, state)
        return Result(self, found, stopped=stopped and found.status[0] == "running")

    def _check_resume(self, resume: Any, start: Design) -> None:
        if not isinstance(resume, Result):
            raise DefinitionError(f"`resume` is a result of `optimize`, got {type(resume).__name__}")
        if start is not None:
            raise DefinitionError("a run continues from its last design: give `resume` or `start`")
        changes = _changes(resume.problem, self)
        if changes:
            raise DefinitionError(f"`resume` is the result of another problem; what differs: {'; '.join(changes)}")

    def _method(self, method: Method) -> str | None:
        if method is None:
            return None
        table = {"preset": method} if isinstance(method, str) else method
        if not isinstance(table, Mapping):
            raise DefinitionError(f"a method is a name or a dictionary, got {method!r}")
        return _toml.dumps({"method": table})

    def _response_indices(self, names: Iterable[str] | None) -> list[int]:
        if names is None:
            return list(range(len(self.response_names)))
        if isinstance(names, str):
            names = [names]
        indices = []
        for name in _iterable(names, "responses"):
            if name not in self.response_names:
                raise DefinitionError(f"there is no response `{name}`; there are {', '.join(self.response_names)}")
            indices.append(self.response_names.index(name))
        return indices

    def __repr__(self) -> str:
        points = 0 if self.time is None else len(self.time)
        sizes = f"{len(self.variables)} variables, {len(self.response_names)} responses, {len(self.constraint_names)} constraints"
        return f"<{type(self).__name__} {self.title!r}: {sizes}, {points} time points>"


class Model(BaseProblem):
    """A mechanism with its outputs, an objective, constraints and a method, as in a model file.

    Parameters
    ----------
    text : str
        The text of a model file.
    name : str
        Its name in messages.
    programs : path, optional
        The folder in which the program of the model may run (docs/programs.md); by default it may not.

    Notes
    -----
    A model without an objective can be analysed, differentiated and studied, but not optimized; its objective is NaN.

    Examples
    --------
    >>> import linkwright
    >>> model = linkwright.Model.from_dict({
    ...     "design": {"width": {"start": 3.0, "lower": 0.5}},
    ...     "output": [{"name": "stress", "value": "1/width"}],
    ...     "objective": {"minimize": "width"},
    ...     "constraint": [{"name": "strength", "value": "stress", "at_most": 0.5}],
    ... })
    >>> round(model.optimize("automatic").objective, 4)
    2.0
    """

    def __init__(self, text: str, name: str = "model", *, programs: str | os.PathLike[str] | None = None) -> None:
        if not isinstance(text, str):
            raise DefinitionError(f"the text of a model is a string, got {type(text).__name__}")
        self.text, self.name = text, name
        self.programs: str | None = None if programs is None else os.path.abspath(programs)
        self._attach(_core.Problem(name, text, programs=self.programs))

    @classmethod
    def from_file(cls, path: str | os.PathLike[str], *, allow_programs: bool = False) -> Model:
        """Read a model file with the files that it names.

        Parameters
        ----------
        path : path
        allow_programs : bool
            Let the model start the program that it names, in the folder of the file. Inspect the file and the program first: a program
            has all rights of its user.
        """
        name = os.fsdecode(path)
        return cls(_core.model_text(name, text_of(name)), name, programs=(os.path.dirname(name) or ".") if allow_programs else None)

    @classmethod
    def from_string(cls, text: str, name: str = "model", *, allow_programs: bool = False) -> Model:
        """Read the text of a model file.

        Parameters
        ----------
        text : str
        name : str
            Name of the model in messages.
        allow_programs : bool
            Let the model start the program that it names, in the current folder.
        """
        return cls(text, name, programs="." if allow_programs else None)

    @classmethod
    def from_dict(cls, table: Mapping[str, Any], name: str = "model", *, allow_programs: bool = False) -> Model:
        """Make a model from a dictionary with the sections and keys of a model file.

        Parameters
        ----------
        table : mapping
            A list of dictionaries is a repeated section such as ``[[body]]``. Values may be NumPy numbers and arrays. ``version`` is
            2 by default.
        name : str
            Name of the model in messages.
        allow_programs : bool
            Let the model start the program that it names, in the current folder.
        """
        if not isinstance(table, Mapping):
            raise DefinitionError(f"a model is a dictionary of sections, got {type(table).__name__}")
        return cls.from_string(_toml.dumps({"version": 2, **table}), name, allow_programs=allow_programs)

    @property
    def note(self) -> str | None:
        """A note with the new words of a file of an earlier version."""
        return self._core.note

    def __reduce__(self) -> Any:
        return _restored, (type(self), self.text, self.name, self.programs)


class Problem(BaseProblem):
    """A problem whose responses are computed by Python functions.

    Parameters
    ----------
    variables : mapping
        Names to start values, or to tables with `start`, `lower`, `upper`, `unit`.
    responses : mapping or sequence
        Names, or names to tables with `unit`, `linear_in` (intermediate variables: `reciprocal`, `area`, a power, or one of
        them for each variable by name) and `over_time` (True by default if there are time points).
    analyze : callable
        ``analyze(b)`` with `b` of shape (n,) returns the responses: a mapping of names to values, a sequence in their order, or
        the values of the only one. A response over time has the shape (nt,), another is a number. Where a design cannot be
        analysed it raises :class:`AnalysisError`; NaN has the same effect.
    derivatives : callable or True, optional
        ``derivatives(b)`` returns ∂r/∂b in the same form, with shapes (nt, n) and (n,). True if `analyze` returns a pair
        (responses, derivatives). Without it there are finite differences.
    second_derivatives : callable, optional
        ``second_derivatives(b)`` with shapes (nt, n, n) and (n, n), for methods that use them.
    objective : str or mapping
        The quantity to minimize: a formula of responses and variables, or a table with the keys of ``[objective]`` in a model
        file, such as ``{"minimize": "force", "over": "peak", "bound": {"start": 1.0}}`` or ``{"maximize": "speed"}``.
    constraints : mapping, optional
        Names to tables with the keys of ``[[constraint]]``: `value` (a formula; the name by default), `at_most`, `at_least`,
        `equals`, `scale`, `from`, `to`, `continuous`, `neighbours`.
    time : array_like or mapping, optional
        The time points, shape (nt,), or a table with `at`, `name` and `unit`.
    differences : str, optional
        `forward`, `central` (the default), `richardson`, or `noise-aware`, for responses with noise.
    step : float, optional
        Relative step of the differences.
    map : callable, optional
        ``map(function, designs)``, for instance the `map` of an executor: designs of finite differences and of
        :meth:`analyze_many` are analysed by it. `analyze` must then meet its requirements (a pool of processes pickles it). By default
        designs are analysed one after another in the calling thread.
    name : str
        Title for tables and figures.
    method : str or mapping
        The default method of :meth:`optimize`.

    Notes
    -----
    Objective and constraints are formulas of the responses, which the approximations use exactly. A quantity that is not a
    formula must be computed in `analyze` as another response.

    Examples
    --------
    >>> import numpy, linkwright
    >>> problem = linkwright.Problem(
    ...     {"width": {"start": 3.0, "lower": 0.5}}, ["stress"], lambda b: 1 / b[0],
    ...     derivatives=lambda b: -1 / b**2,
    ...     objective="width", constraints={"strength": {"value": "stress", "at_most": 0.5}})
    >>> round(problem.optimize().objective, 4)
    2.0
    """

    def __init__(
        self,
        variables: Mapping[str, Any],
        responses: Mapping[str, Any] | Sequence[str],
        analyze: Callable[[Array], Any],
        *,
        derivatives: Callable[[Array], Any] | bool | None = None,
        second_derivatives: Callable[[Array], Any] | None = None,
        objective: str | Mapping[str, Any],
        constraints: Mapping[str, Mapping[str, Any]] | None = None,
        time: Any = None,
        differences: str = "central",
        step: float | None = None,
        map: Callable[..., Iterable[Any]] | None = None,
        name: str = "problem",
        method: Method = "automatic",
    ) -> None:
        self._arguments = {key: value for key, value in locals().items() if key not in ("self", "__class__")}
        self._setup()

    def _setup(self) -> None:
        a = self._arguments
        table: dict[str, Any] = {"version": 2, "title": a["name"]}
        table["design"] = {
            key: _bounded(value) if isinstance(value, Mapping) else {"start": value}
            for key, value in _mapping(a["variables"], "variables").items()
        }
        if a["time"] is not None:
            time = a["time"] if isinstance(a["time"], Mapping) else {"at": _numbers(a["time"], "time")}
            table["time"] = {**time, "at": _numbers(time.get("at"), "time")}
            if table["time"]["at"].ndim != 1:
                raise DefinitionError(f"time: expected the time points as a vector, got the shape {table['time']['at'].shape}")
        responses = a["responses"]
        if isinstance(responses, str):
            responses = [responses]
        if not isinstance(responses, Mapping):
            names = list(_iterable(responses, "responses"))
            twice = [name for k, name in enumerate(names) if name in names[:k]]
            if twice:
                raise DefinitionError(f"there are two responses `{twice[0]}`; give each a name of its own")
            responses = {key: {} for key in names}
        points = len(table["time"]["at"]) if "time" in table else 0
        if len(responses) > RESPONSES:
            what = f"{len(responses)} responses are too many; at most {RESPONSES} are read"
            raise DefinitionError(f"{what}: give those of one kind as one response over `time`, or the largest of them")
        if a["step"] is not None and (isinstance(a["step"], bool) or not isinstance(a["step"], (int, float, np.integer, np.floating))):
            raise DefinitionError(f"`step` is a number, the relative step of the differences, got {a['step']!r}")
        outputs: list[dict[str, Any]] = []
        shapes: dict[str, tuple[int, ...]] = {}
        for key, value in responses.items():
            output = dict(value) if isinstance(value, Mapping) else {"unit": value}
            over_time = output.pop("over_time", "time" in table)
            if over_time and "time" not in table:
                raise DefinitionError(f"response `{key}` has values over time, but there are no time points; give `time`")
            shapes[key] = (points,) if over_time else ()
            # The formula only says whether there is a value for each time point; the functions compute the values.
            outputs.append({"name": key, "value": "time" if over_time else "0", **output})
        table["output"] = outputs
        objective = a["objective"]
        table["objective"] = objective if isinstance(objective, Mapping) else {"minimize": objective}
        table["constraint"] = [
            {"name": key, "value": key, **_mapping(value, f"constraint `{key}`")}
            for key, value in _mapping(a["constraints"] or {}, "constraints").items()
        ]
        if not table["constraint"]:
            del table["constraint"]
        method = a["method"]
        table["method"] = {"preset": method} if isinstance(method, str) else method
        if a["second_derivatives"] is not None and a["derivatives"] in (None, False):
            raise DefinitionError("`second_derivatives` needs `derivatives`: give both")
        functions = Functions(
            a["analyze"], a["derivatives"], a["second_derivatives"], a["map"], shapes, len(table["design"])
        )
        self.text = _toml.dumps(table)
        step = None if a["step"] is None else float(a["step"])
        self._attach(_core.Problem(a["name"], self.text, functions.table(), (a["differences"], step)))
        functions.width = len(self.variables)

    def __getstate__(self) -> dict[str, Any]:
        return self._arguments

    def __setstate__(self, state: dict[str, Any]) -> None:
        self._arguments = state
        self._setup()


def _restored(kind: type[Model], text: str, name: str, programs: str | None) -> Model:
    return kind(text, name, programs=programs)


def _changes(before: Labels, after: Labels) -> list[str]:
    """What differs between two problems, as far as a run depends on it; empty for one problem."""
    if before.fingerprint == after.fingerprint:
        return []

    def parts(problem: Labels) -> dict[str, Any]:
        found: dict[str, Any] = {"the objective": (problem.objective_name, problem._sign)}
        found["the design variables"] = problem.variable_names
        found["the responses"] = tuple(tuple(row) for row in problem._core.responses)
        found["the time points"] = None if problem.time is None else tuple(problem.time)
        for name, side, limit, scale, _ in problem._core.constraints:
            found[f"constraint `{name}`"] = (side, limit, scale)
        return found

    old, new = parts(before), parts(after)
    changes = []
    for name in {**old, **new}:
        if old.get(name) != new.get(name):
            is_limit = name.startswith("constraint") and name in old and name in new
            changes.append(f"{name} has the limit {new[name][1]:g} instead of {old[name][1]:g}" if is_limit else name)
    return changes or ["the formulas or parts of the model"]


def _by_name(b: Any) -> Mapping[Any, Any] | None:
    """Values by name, if they have names: of a mapping, or of a Series with names as index."""
    if isinstance(b, Mapping):
        return b
    index = getattr(b, "index", None)
    if callable(getattr(b, "items", None)) and index is not None and any(isinstance(name, str) for name in index):
        return dict(b.items())
    return None


def text_of(path: str) -> str:
    """The text of a file."""
    try:
        with open(path, encoding="utf-8", newline="") as file:
            return file.read()
    except UnicodeDecodeError as error:
        raise DefinitionError(f"{path} is not a text in UTF-8: {error}; give a model file or a study file") from None


def _iterable(value: Any, what: str) -> Iterable[Any]:
    if not isinstance(value, Iterable):
        raise DefinitionError(f"`{what}` has names, got {value!r}")
    return value


def says_stop(answer: Any) -> bool:
    """True if a callback returns True, as a Python or NumPy Boolean."""
    return isinstance(answer, (bool, np.bool_)) and bool(answer)


def _bounded(variable: Mapping[str, Any]) -> dict[str, Any]:
    """A variable without infinite bounds, which a model file omits."""
    none = {"lower": -np.inf, "upper": np.inf}
    return {key: value for key, value in variable.items() if not (key in none and value is not None and value == none[key])}


def _mapping(value: Any, what: str) -> Mapping[str, Any]:
    if not isinstance(value, Mapping):
        raise DefinitionError(f"{what}: expected a mapping, got {type(value).__name__}")
    return value


def _numbers(values: Any, what: str) -> Array:
    """Values as a new C-contiguous array of float64."""
    if np.ma.is_masked(values):
        raise DefinitionError(f"{what}: a value is masked; give a number for each")
    if isinstance(values, (list, tuple)) and any(isinstance(value, (bool, np.bool_)) for value in values):
        raise DefinitionError(f"{what}: expected real numbers, got {values!r}")
    try:
        array = np.asarray(values)
    except ValueError as error:
        raise DefinitionError(f"{what}: {error}") from None
    if array.dtype.kind not in "fiu":
        raise DefinitionError(f"{what}: expected real numbers, got {type(values).__name__} with dtype {array.dtype}")
    return np.array(array, dtype=np.float64, order="C")


__all__ = ["AnalysisError", "BaseProblem", "Design", "Method", "Model", "Problem", "methods"]
