"""Model files from dictionaries."""

from __future__ import annotations

import json
import re
from collections.abc import Mapping
from typing import Any

import numpy as np

from ._errors import DefinitionError

_BARE = re.compile(r"[A-Za-z0-9_-]+\Z")


def dumps(table: Mapping[str, Any]) -> str:
    """Return the text of a model file.

    Parameters
    ----------
    table : mapping
        Sections and keys as in a model file. Values may be NumPy numbers and arrays.

    Raises
    ------
    DefinitionError
        For a value that a model file cannot contain.
    """
    if not isinstance(table, Mapping):
        raise DefinitionError(f"a model is a dictionary of sections, got {type(table).__name__}")
    plain, sections = [], []
    for key, value in table.items():
        if isinstance(value, Mapping) and key == "design":
            sections += [_section(f"[design.{_key(name)}]", inner, f"design.{name}") for name, inner in value.items()]
        elif isinstance(value, Mapping):
            sections.append(_section(f"[{_key(key)}]", value, key))
        elif isinstance(value, (list, tuple)) and value and all(isinstance(item, Mapping) for item in value):
            sections += [_section(f"[[{_key(key)}]]", item, key) for item in value]
        else:
            plain.append(f"{_key(key)} = {_value(value, key)}")
    return "\n\n".join(["\n".join(plain), *sections]).strip() + "\n"


def _section(head: str, table: Any, where: str) -> str:
    if not isinstance(table, Mapping):
        raise DefinitionError(f"`{where}` is a table: give a dictionary, got {table!r}")
    return "\n".join([head, *(f"{_key(key)} = {_value(value, f'{where}.{key}')}" for key, value in table.items())])


def _key(key: Any) -> str:
    if not isinstance(key, str):
        raise DefinitionError(f"the key {key!r} is not a string")
    return key if _BARE.match(key) else _text(key)


def _text(text: str) -> str:
    return json.dumps(text, ensure_ascii=False).replace("\x7f", "\\u007f")


def _value(value: Any, where: str) -> str:
    if isinstance(value, (bool, np.bool_)):
        return "true" if value else "false"
    if isinstance(value, str):
        return _text(value)
    if isinstance(value, (int, np.integer)):
        return str(int(value))
    if isinstance(value, (float, np.floating)):
        return repr(float(value))
    if isinstance(value, Mapping):
        return "{ " + ", ".join(f"{_key(k)} = {_value(v, f'{where}.{k}')}" for k, v in value.items()) + " }"
    if isinstance(value, np.ndarray):
        value = value.tolist()
        if not isinstance(value, list):
            return _value(value, where)
    if isinstance(value, (list, tuple)):
        return "[" + ", ".join(_value(item, f"{where}[{i}]") for i, item in enumerate(value)) + "]"
    hint = "omit the key" if value is None else "give a number, a string, a list or a dictionary"
    raise DefinitionError(f"`{where}` is {value!r} of type {type(value).__name__}; {hint}")
