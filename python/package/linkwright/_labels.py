"""Names, units and time points of a problem, by which its results are labelled."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ._core import Problem as CoreProblem

Array = np.ndarray


@dataclass(frozen=True)
class Variable:
    """A design variable.

    Attributes
    ----------
    name, unit : str
    start, lower, upper : float
        Start value and bounds in the unit; -inf and inf for none.
    """

    name: str
    unit: str
    start: float
    lower: float
    upper: float


class Labels:
    """Names, units, signs and time points of a problem, by which its results are labelled."""

    _core: CoreProblem

    def _attach(self, core: CoreProblem) -> None:
        self._core = core
        self.title, self.objective_name, self.objective_unit, self._sign = core.head
        self.variables = tuple(Variable(*row) for row in core.variables)
        self.variable_names = tuple(variable.name for variable in self.variables)
        # Names, and whether there are values over time; read once, because every analysis needs them.
        self._responses = tuple((row[0], row[2]) for row in core.responses)
        self._constraints = tuple((row[0], row[4]) for row in core.constraints)
        self.response_names = tuple(name for name, _ in self._responses)
        self.constraint_names = tuple(name for name, _ in self._constraints)
        grid = core.time
        self.axis: str = "time" if grid is None else grid[0]
        self.time: Array | None = None if grid is None else grid[2]
        if self.time is not None:
            self.time.flags.writeable = False

    @property
    def start(self) -> Array:
        """The start design, shape (n,)."""
        return np.array([variable.start for variable in self.variables])

    @property
    def lower(self) -> Array:
        """The lower bounds, shape (n,)."""
        return np.array([variable.lower for variable in self.variables])

    @property
    def upper(self) -> Array:
        """The upper bounds, shape (n,)."""
        return np.array([variable.upper for variable in self.variables])

    @property
    def fingerprint(self) -> int:
        """A number that identifies the problem: a hash of its names, limits and time points."""
        return self._core.fingerprint

    def _objective(self, value: Any) -> Any:
        """The objective in its unit from the minimized one; NaN without an objective."""
        return self._sign * value if self.objective_name else np.nan * value

    def _labelled_responses(self, arrays: Sequence[Array]) -> dict[str, Any]:
        return _labelled(self._responses, arrays)

    def _labelled_constraints(self, arrays: Sequence[Array]) -> dict[str, Any]:
        return _labelled(self._constraints, arrays)


def _labelled(rows: Sequence[tuple[str, bool]], arrays: Sequence[Array]) -> dict[str, Any]:
    """The arrays by name; a float for what has no values over time."""
    return {name: v if is_history else float(v[0]) for (name, is_history), v in zip(rows, arrays)}
