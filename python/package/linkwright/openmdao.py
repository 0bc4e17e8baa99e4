"""Components and a driver for OpenMDAO. Import it where OpenMDAO is installed."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import numpy as np

try:
    import openmdao.api as om
    from openmdao.core.driver import Driver as BaseDriver
    from openmdao.core.driver import RecordingDebugging
except ImportError:
    raise ImportError("linkwright.openmdao needs OpenMDAO: pip install openmdao") from None

from ._errors import AnalysisError
from ._minimize import Block, _problem
from ._problem import BaseProblem

__all__ = ["Component", "Driver"]


class Component(om.ExplicitComponent):
    """The analysis of a model, with exact partial derivatives.

    Each design variable of the model is an input of shape (1,), each response an output of shape (nt,), or (1,) if it does not
    depend on time, with the same names. Derivatives come from one sensitivity analysis for all outputs.

    Parameters
    ----------
    model : Model or Problem
        Option `model`.
    responses : list of str, optional
        Option `responses`: names of the outputs; all responses by default.
    method : str, optional
        Option `method`: the method of derivatives, see :meth:`linkwright.Model.sensitivities`.

    Notes
    -----
    The variable that bounds a peak belongs to the optimization and not to the analysis; it is no input. A design that cannot be
    analysed raises ``openmdao.api.AnalysisError``, which OpenMDAO's drivers understand. Units are SI and not declared, since names
    of units differ; scale in the driver.

    Check the partials with ``check_partials(form="central", step=1e-6, step_calc="rel_avg")``: absolute steps do not suit
    variables in SI units.
    """

    def initialize(self) -> None:
        """Declare the options."""
        self.options.declare("model", types=BaseProblem, recordable=False, desc="the model that is analysed")
        self.options.declare("responses", default=None, types=(list, tuple), allow_none=True, desc="names of the outputs")
        self.options.declare("method", default=None, types=str, allow_none=True, desc="method of derivatives")

    def setup(self) -> None:
        """Declare inputs, outputs and partials."""
        model = self.options["model"]
        self._names = list(self.options["responses"] or model.response_names)
        bounds = _bounds_of_peaks(model)
        self._inputs_by_name = [name for name in model.variable_names if name not in bounds]
        start = model.analyze()
        for variable in model.variables:
            if variable.name in self._inputs_by_name:
                self.add_input(variable.name, val=variable.start)
        for name in self._names:
            self.add_output(name, val=np.atleast_1d(start[name]))
        self.declare_partials(self._names, self._inputs_by_name)
        # Drivers and models often compute derivatives where they have just computed outputs, and outputs twice.
        self._last: tuple[bytes, dict[str, Any]] = (start.design.tobytes(), start.responses)

    def _design(self, inputs: Any) -> np.ndarray:
        return self.options["model"].design({name: float(inputs[name][0]) for name in self._inputs_by_name})

    def compute(self, inputs: Any, outputs: Any, *more: Any) -> None:
        """Analyse the design."""
        design = self._design(inputs)
        key, responses = self._last
        if key != design.tobytes():
            try:
                responses = self.options["model"].analyze(design).responses
            except AnalysisError as error:
                raise om.AnalysisError(str(error)) from error
            self._last = (design.tobytes(), responses)
        for name in self._names:
            outputs[name] = responses[name]

    def compute_partials(self, inputs: Any, partials: Any, *more: Any) -> None:
        """Differentiate the responses."""
        model = self.options["model"]
        try:
            found = model.sensitivities(self._design(inputs), method=self.options["method"], responses=self._names)
        except AnalysisError as error:
            raise om.AnalysisError(str(error)) from error
        for name in self._names:
            rows = np.atleast_2d(found[name])
            for variable in self._inputs_by_name:
                partials[name, variable] = rows[:, [model.variable_names.index(variable)]]


def _bounds_of_peaks(model: BaseProblem) -> set[str]:
    """Names of the variables on which no response depends because they bound a peak: the objective has the same name."""
    return {model.objective_name} & set(model.variable_names)


class Driver(BaseDriver):
    """The methods of linkwright as a driver, for the design variables, the objective and the constraints of any model.

    Options
    -------
    preset : str
        A method, see :func:`linkwright.methods`; `automatic` by default.
    tol : float
        Relative change of the objective, and violation, below which the run ends.
    maxiter : int
        Largest number of cycles.

    Attributes
    ----------
    found : linkwright.Result
        The result of the last run, with its history, report and figures.
    """

    def __init__(self, **options: Any) -> None:
        super().__init__(**options)
        for feature in (
            "optimization",
            "gradients",
            "inequality_constraints",
            "equality_constraints",
            "two_sided_constraints",
            "linear_constraints",
        ):
            self.supports[feature] = True
        self.found: Any = None

    def _declare_options(self) -> None:
        self.options.declare("preset", default="automatic", types=str, desc="a method of linkwright")
        self.options.declare("tol", default=1e-6, types=float, lower=0.0, desc="accuracy of the stop test")
        self.options.declare("maxiter", default=200, types=int, lower=1, desc="largest number of cycles")

    def _get_name(self) -> str:
        return f"linkwright_{self.options['preset']}"

    def run(self) -> bool:
        """Optimize. Returns True if the run failed, as OpenMDAO wants it."""
        self.result.reset()
        self.iter_count = 0
        values = self.get_design_var_values()
        sizes = [np.size(value) for value in values.values()]
        names, ends = list(values), np.cumsum([0, *sizes])
        x0 = np.concatenate([np.ravel(value) for value in values.values()])
        lower, upper = (self._limits(self._designvars, names, sizes, side) for side in ("lower", "upper"))
        model = _Model(self, names, ends)
        objective = next(iter(self._objs))
        blocks = [_block(model, objective, np.clip(x0, lower, upper), (lower, upper))]
        for name, meta in self._cons.items():
            block = _block(model, name, np.clip(x0, lower, upper), (lower, upper))
            low, high = ("equals", "equals") if meta["equals"] is not None else ("lower", "upper")
            block.lower, block.upper = (_side(meta[side], block.size, side) for side in (low, high))
            blocks.append(block)
        problem = _problem(blocks, np.clip(x0, lower, upper), lower, upper)
        method = {"preset": self.options["preset"], "accuracy": self.options["tol"], "max_cycles": self.options["maxiter"]}
        self.found = problem.optimize(method)
        # The model is left at the accepted design, which need not be the last analysed one.
        model.values(self.found.design)
        self.result.exit_status = self.found.status
        return not self.found.success

    def _limits(self, table: Any, names: Iterable[str], sizes: list[int], side: str) -> np.ndarray:
        return np.concatenate([_side(table[name][side], size, side) for name, size in zip(names, sizes)])


def _side(limit: Any, size: int, side: str) -> np.ndarray:
    """A limit as an array; for OpenMDAO, None and numbers of 1e30 in size mean none."""
    if limit is None:
        return np.full(size, -np.inf if side == "lower" else np.inf)
    limits = np.broadcast_to(np.asarray(limit, dtype=float).ravel(), size).copy()
    limits[limits >= 1e29] = np.inf
    limits[limits <= -1e29] = -np.inf
    return limits


class _Model:
    """Values and derivatives of objective and constraints, one run of the model for each design."""

    def __init__(self, driver: Driver, names: list[str], ends: np.ndarray) -> None:
        self.driver, self.names, self.ends = driver, names, ends
        self._point: tuple[bytes, dict[str, Any]] = (b"", {})
        self._slope: tuple[bytes, dict[str, Any]] = (b"", {})

    def values(self, x: np.ndarray) -> dict[str, Any]:
        key, values = self._point
        if key != x.tobytes():
            driver = self.driver
            self._point = (b"", {})  # the model is at x from now on, also if it fails there
            # The public name until 3.44, a private one since.
            setter = getattr(driver, "_set_design_var", None) or driver.set_design_var
            for name, first, last in zip(self.names, self.ends, self.ends[1:]):
                setter(name, x[first:last])
            try:
                with RecordingDebugging(driver._get_name(), driver.iter_count, driver):
                    driver.iter_count += 1
                    driver._run_solve_nonlinear()
            except om.AnalysisError as error:
                raise AnalysisError(str(error)) from error
            values = {n: np.array(v, copy=True) for n, v in driver.get_objective_values().items()}
            values |= {n: np.array(v, copy=True) for n, v in driver.get_constraint_values().items()}
            self._point = (x.tobytes(), values)
        return values

    def slopes(self, x: np.ndarray) -> dict[str, Any]:
        key, slopes = self._slope
        if key != x.tobytes():
            self.values(x)  # totals belong to the state of the model
            of = [*self.driver._objs, *self.driver._cons]
            totals = self.driver._compute_totals(of=of, wrt=self.names, return_format="flat_dict")
            slopes = {n: np.hstack([np.atleast_2d(totals[n, wrt]) for wrt in self.names]) for n in of}
            self._slope = (x.tobytes(), slopes)
        return slopes


def _block(model: _Model, name: str, x0: np.ndarray, box: tuple[np.ndarray, np.ndarray]) -> Block:
    return Block(lambda x: np.ravel(model.values(x)[name]), lambda x: model.slopes(x)[name], x0, box, f"`{name}`")
