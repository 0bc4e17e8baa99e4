"""Examples of docstrings, of docs/python.md and of the README run."""

import doctest
import importlib
import re
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

import linkwright

ROOT = Path(__file__).resolve().parents[2]


def blocks(path):
    return re.findall(r"```python\n(.*?)```", path.read_text(), flags=re.S)


@pytest.mark.parametrize("module", ["_minimize", "_problem", "_results"])
def test_examples_of_docstrings(module):
    assert doctest.testmod(importlib.import_module(f"linkwright.{module}")).failed == 0


def test_every_public_name_has_a_docstring():
    for name in linkwright.__all__:
        thing = getattr(linkwright, name)
        if name.startswith("__"):
            continue
        assert thing.__doc__, name
        for method, value in vars(thing).items() if isinstance(thing, type) else ():
            if not method.startswith("_") and (callable(value) or isinstance(value, property)):
                assert value.__doc__, f"{name}.{method}"


@pytest.mark.parametrize("page", ["README.md", "python/README.md"])
def test_the_listings_of_the_readmes(page, monkeypatch, tmp_path):
    folder = (ROOT / page).parent
    [listing] = [block for block in blocks(ROOT / page) if "linkwright" in block]
    listing = listing.replace('"report.html"', repr(str(tmp_path / "report.html")))
    monkeypatch.chdir(folder)
    names = {}
    exec(listing, names)
    assert names["result"].success and (tmp_path / "report.html").exists()


def test_own_responses_in_the_guide():
    """A mass that drives into a spring with 3 m/s, as the simulator of the listing."""

    def my_simulator(mass, stiffness):
        frequency = np.sqrt(stiffness / mass)
        travel = 3.0 / frequency * np.sin(frequency * np.linspace(0.0, 2.0, 101))
        return SimpleNamespace(ok=mass > 0, reason="", travel=travel, force=stiffness * travel)

    [listing] = [block for block in blocks(ROOT / "docs" / "python.md") if "my_simulator" in block]
    names = {"my_simulator": my_simulator, "linkwright": linkwright}
    exec(listing, names)
    assert names["result"].design.shape == (3,)


def test_all_listings_of_the_guide_are_python():
    for listing in blocks(ROOT / "docs" / "python.md"):
        compile(listing, "docs/python.md", "exec")
