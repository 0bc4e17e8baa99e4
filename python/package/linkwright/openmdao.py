"""Components and a driver for OpenMDAO. Import it where OpenMDAO is installed."""

from __future__ import annotations

import re
from typing import Any

import numpy as np

try:
    import openmdao.api as om
    from openmdao.core.driver import Driver as BaseDriver
    from openmdao.core.driver import RecordingDebugging
except ImportError:
    raise ImportError("linkwright.openmdao needs OpenMDAO: pip install openmdao") from None

from ._errors import AnalysisError, ModelError
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
    The variable that bounds a peak belongs to the optimization and not to the analysis; it is not an input. A design that cannot be
    analysed raises ``openmdao.api.AnalysisError``, which OpenMDAO's drivers understand.

    Inputs and outputs have the numbers and units of the model, as ``model.variables`` and ``model.analyze()`` have them: millimetres
    for a variable with ``start = "300 mm"``. The units are not declared to OpenMDAO, since names of units differ.

    The analysis uses real numbers: a complex step (``method="cs"``) raises a RuntimeError. None is needed, as the partials are exact.

    Check the partials with ``check_partials(form="central", step=1e-6, step_calc="rel_avg")``: absolute steps do not suit
    variables of all sizes.
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
        if self.under_complex_step:
            raise RuntimeError(
                f"the component `{self.pathname}` of linkwright has no complex step: use its partials, which are exact, or `fd`"
            )
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

    The method works with scaled values (`ref`, `ref0`, `scaler`, `adder` of OpenMDAO), and so do its history and report.

    Options
    -------
    preset : str
        A method, see :func:`linkwright.methods`; `automatic` by default.
    tol : float
        Relative change of the objective, and violation, below which the run ends; not used by `automatic`, which has a stop test of its
        own.
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
        self._check_parts()
        self.result.reset()
        self.iter_count = 0
        values = self.get_design_var_values()
        sizes = {name: np.size(value) for name, value in values.items()}
        x0 = np.concatenate([np.ravel(value) for value in values.values()])
        lower, upper = (np.concatenate(list(side.values())) for side in _limits(self, "design_var", sizes))
        x0 = np.clip(x0, lower, upper)
        model = _Model(self, list(values), np.cumsum([0, *sizes.values()]))
        objective = next(iter(self._objs))
        blocks = [_block(model, name, x0, (lower, upper)) for name in [objective, *self._cons]]
        if blocks[0].size != 1:
            raise RuntimeError(f"the objective `{objective}` has {blocks[0].size} values; give one number")
        ends = _limits(self, "constraint", {name: block.size for name, block in zip(self._cons, blocks[1:])})
        for name, block in zip(self._cons, blocks[1:]):
            block.lower, block.upper = (side[name] for side in ends)
        try:
            problem = _problem(blocks, x0, lower, upper, _labels(sizes))
        except ModelError:  # a name with another meaning in formulas
            problem = _problem(blocks, x0, lower, upper)
        method = {"preset": self.options["preset"], "accuracy": self.options["tol"], "max_cycles": self.options["maxiter"]}
        self.found = problem.optimize(method)
        # The model is left at the accepted design, which need not be the last analysed one.
        model.values(self.found.design)
        self.result.exit_status = self.found.status
        return not self.found.success

    def _check_parts(self) -> None:
        if len(self._objs) != 1:
            names = f": {', '.join(self._objs)}" if self._objs else ""
            raise RuntimeError(f"the driver of linkwright needs one objective, the model has {len(self._objs)}{names}")
        if not self._designvars:
            raise RuntimeError("the model has no design variables; add one with add_design_var")


def _labels(sizes: dict[str, int]) -> list[str]:
    """Names of the single design variables, as they can be written in formulas."""
    return [
        re.sub(r"\W", "_", name if size == 1 else f"{name}_{i}") for name, size in sizes.items() for i in range(size)
    ]


def _limits(driver: Driver, kind: str, sizes: dict[str, int]) -> tuple[dict[str, np.ndarray], dict[str, np.ndarray]]:
    """Lower and upper limits of design variables or constraints in the scaled units of the driver, by name."""
    table = driver._designvars if kind == "design_var" else driver._cons
    first, second = (
        {name: _side(table[name], side, size) for name, size in sizes.items()} for side in ("lower", "upper")
    )
    first, second = _scaled(driver, kind, first), _scaled(driver, kind, second)
    # A negative scaler makes an upper limit of a lower one.
    lower = {name: np.minimum(first[name], second[name]) for name in sizes}
    return lower, {name: np.maximum(first[name], second[name]) for name in sizes}


def _side(meta: Any, side: str, size: int) -> np.ndarray:
    """A limit as it is declared; for OpenMDAO, None and magnitudes of 1e30 mean no limit."""
    limit = meta[side] if meta.get("equals") is None else meta["equals"]
    if limit is None:
        return np.full(size, -np.inf if side == "lower" else np.inf)
    limits = np.broadcast_to(np.asarray(limit, dtype=float).ravel(), size).copy()
    limits[limits >= 1e29] = np.inf
    limits[limits <= -1e29] = -np.inf
    return limits


def _scaled(driver: Driver, kind: str, limits: dict[str, np.ndarray]) -> dict[str, np.ndarray]:
    """Declared limits in the scaled units of the driver."""
    autoscaler = getattr(driver, "autoscaler", None)
    if autoscaler is None:
        # Drivers without an autoscaler store limits that are scaled already, except infinite ones, which mean no limit.
        def reversed_(name: str) -> Any:
            scaler = (driver._designvars if kind == "design_var" else driver._cons)[name].get("total_scaler")
            return 1.0 if scaler is None else np.sign(np.ravel(scaler))

        return {name: np.where(np.isinf(limit), limit * reversed_(name), limit) for name, limit in limits.items()}
    vector = driver._vectors[kind]
    vector.set_data(limits, driver_scaling=False)
    (autoscaler.apply_design_var_scaling if kind == "design_var" else autoscaler.apply_constraint_scaling)(vector)
    return {name: np.array(vector[name], dtype=float).ravel() for name in limits}


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
            self._point = (b"", {})  # the model is at x from now on, even if it fails there
            parts = {name: x[first:last] for name, first, last in zip(self.names, self.ends, self.ends[1:])}
            if hasattr(driver, "autoscaler"):
                driver._vectors["design_var"].set_data(parts, driver_scaling=True)
                driver._set_design_vars()
            else:
                for name, part in parts.items():
                    driver.set_design_var(name, part)
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
