"""Python functions as the analysis of a problem: their results are checked and put into one array."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from typing import Any

import numpy as np

from ._errors import AnalysisError, DefinitionError

Array = np.ndarray


class Functions:
    """The functions of a problem.

    `shapes` are the shapes of the responses, `n` the number of variables of the functions. `width` is the number of variables of
    the problem, which has one more if it minimizes a peak: the functions do not receive it.
    """

    def __init__(
        self,
        analyze: Callable[[Array], Any],
        derivatives: Callable[[Array], Any] | bool | None,
        second: Callable[[Array], Any] | None,
        map: Callable[..., Iterable[Any]] | None,
        shapes: Mapping[str, tuple[int, ...]],
        n: int,
    ) -> None:
        for function, what in [(analyze, "analyze"), (derivatives, "derivatives"), (second, "second_derivatives"), (map, "map")]:
            if function is not None and not callable(function) and not isinstance(function, bool):
                raise DefinitionError(f"`{what}` is not a function: {function!r}")
        self.derivatives: Any = None if derivatives is False else derivatives
        self.second: Any = second
        self.map: Any = map
        self.n = self.width = n
        self.one = One(analyze, self.derivatives is True, shapes)
        self._last: tuple[bytes, Any] = (b"", None)

    def table(self) -> dict[str, Any]:
        """The functions for the compiled part."""
        table: dict[str, Any] = {"analyze": self._analyze}
        if self.derivatives is not None:
            table["derivatives"] = self._derivatives
        if self.second is not None:
            table["second"] = self._second
        if self.map is not None:
            table["analyze_many"] = self._analyze_many
        return table

    def _analyze(self, b: Array) -> Array:
        b = b[: self.n]
        if self.derivatives is not True:
            return self.one(b)
        values, derivatives = self.one.pair(b)
        self._last = (b.tobytes(), derivatives)
        return values

    def _analyze_many(self, designs: list[Array]) -> list[Any]:
        found = self.map(Attempt(self.one), [b[: self.n] for b in designs])
        if not isinstance(found, Iterable):
            raise DefinitionError(f"`map` returned {type(found).__name__}; return the results of the designs in their order")
        found = list(found)
        if len(found) != len(designs):
            raise DefinitionError(f"`map` returned {len(found)} results for {len(designs)} designs")
        return [self._mapped(item, k) for k, item in enumerate(found)]

    def _mapped(self, item: Any, k: int) -> Any:
        """The result of `map` for a design: that of the function, checked, or an `AnalysisError`."""
        if isinstance(item, AnalysisError):
            return item
        if not isinstance(item, np.ndarray) or item.dtype != np.float64 or item.ndim != 1:
            raise DefinitionError(f"`map` returned {type(item).__name__} for design {k}; return the results of the function as they are")
        # Arrays from another process may be views into a message, without alignment.
        return np.require(item, requirements=["C", "A"])

    def _derivatives(self, b: Array) -> Array:
        b = b[: self.n]
        if self.derivatives is True:
            key, derivatives = self._last
            if key != b.tobytes():
                _, derivatives = self.one.pair(b)
        else:
            derivatives = self.derivatives(b)
        return self._widened(flatten(derivatives, self.one.shapes, (self.n,), "derivatives"), 1)

    def _second(self, b: Array) -> Array:
        b = b[: self.n]
        return self._widened(flatten(self.second(b), self.one.shapes, (self.n, self.n), "second_derivatives"), 2)

    def _widened(self, rows: Array, axes: int) -> Array:
        extra = self.width - self.n
        return rows if extra == 0 else np.pad(rows, [(0, 0)] + [(0, extra)] * axes)


class One:
    """The analysis of one design; it can be pickled if the function can."""

    def __init__(self, function: Callable[[Array], Any], is_pair: bool, shapes: Mapping[str, tuple[int, ...]]) -> None:
        self.function, self.is_pair, self.shapes = function, is_pair, dict(shapes)

    def __call__(self, b: Array) -> Array:
        """All values in one array."""
        return self.pair(b)[0] if self.is_pair else flatten(self.function(b), self.shapes, (), "analyze")

    def pair(self, b: Array) -> tuple[Array, Any]:
        """All values, and the derivatives as they were returned."""
        found = self.function(b)
        if not isinstance(found, tuple) or len(found) != 2:
            raise DefinitionError("`analyze` must return a pair (responses, derivatives), because `derivatives` is True")
        return flatten(found[0], self.shapes, (), "analyze"), found[1]


class Attempt:
    """An analysis that returns an `AnalysisError` instead of raising it, so that one failure does not end a map."""

    def __init__(self, one: One) -> None:
        self.one = one

    def __call__(self, b: Array) -> Any:
        try:
            return self.one(b)
        except AnalysisError as error:
            return error


def flatten(values: Any, shapes: Mapping[str, tuple[int, ...]], trailing: tuple[int, ...], what: str) -> Array:
    """The values of all responses in one array of shape (N, *trailing).

    Raises
    ------
    DefinitionError
        For a missing, additional or wrongly shaped response, and for values that are not real numbers.
    """
    if isinstance(values, Mapping):
        missing, more = [n for n in shapes if n not in values], [n for n in values if n not in shapes]
        if missing or more:
            kind, name = ("lacks", missing[0]) if missing else ("returned an unknown", more[0])
            raise DefinitionError(f"`{what}` {kind} response `{name}`; the responses are {', '.join(shapes)}")
        items = [values[name] for name in shapes]
        return _joined(items, shapes, trailing, what)
    if not isinstance(values, (list, tuple, np.ndarray)) and hasattr(values, "__array__"):
        values = np.asarray(values)  # an array of another library
    if len(shapes) == 1 and not _is_list_of_one(values):
        items = [values]
    else:
        if not isinstance(values, (list, tuple, np.ndarray)):
            raise DefinitionError(f"`{what}` returned {type(values).__name__}; return a mapping or a sequence of the responses")
        items = list(values)
        if len(items) != len(shapes):
            raise DefinitionError(f"`{what}` returned {len(items)} responses instead of {len(shapes)}: {', '.join(shapes)}")
    return _joined(items, shapes, trailing, what)


def _joined(items: list[Any], shapes: Mapping[str, tuple[int, ...]], trailing: tuple[int, ...], what: str) -> Array:
    blocks = [_block(item, name, shapes[name] + trailing, what) for item, name in zip(items, shapes)]
    flat = [block.reshape(-1, *trailing) for block in blocks]
    return np.require(flat[0] if len(flat) == 1 else np.concatenate(flat), requirements=["C", "A"])


def _is_list_of_one(values: Any) -> bool:
    return isinstance(values, (list, tuple)) and len(values) == 1


def _block(item: Any, name: str, shape: tuple[int, ...], what: str) -> Array:
    if np.ma.is_masked(item):
        raise DefinitionError(f"`{what}`, response `{name}`: a value is masked; give a number for each, or raise AnalysisError")
    try:
        array = np.asarray(item)
    except ValueError as error:
        raise DefinitionError(f"`{what}`, response `{name}`: {error}") from None
    if array.dtype.kind not in "fiub":
        raise DefinitionError(f"`{what}`, response `{name}`: expected real numbers, got {type(item).__name__} with dtype {array.dtype}")
    if array.shape != shape:
        # A number may come as an array with one element, and a gradient with respect to one variable as a number.
        if array.size == 1 == int(np.prod(shape)):
            return array.astype(np.float64).reshape(shape)
        raise DefinitionError(f"`{what}`, response `{name}`: expected the shape {shape}, got {array.shape}")
    return array.astype(np.float64, copy=False)
