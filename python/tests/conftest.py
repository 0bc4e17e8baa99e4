"""Models that several tests use."""

import faulthandler
from pathlib import Path

import pytest

import linkwright

MODELS = Path(__file__).resolve().parents[2] / "examples" / "models"

# The peak acceleration of the impact absorber at its optimum (Etman et al. 1998, and crates/optimization/src/cases).
ABSORBER_OPTIMUM = 0.520286


@pytest.fixture
def absorber() -> linkwright.Model:
    return linkwright.Model.from_file(MODELS / "impact-absorber.toml")


@pytest.fixture
def formula() -> linkwright.Model:
    return linkwright.Model.from_file(MODELS / "impact-absorber-formula.toml")


@pytest.fixture(autouse=True)
def no_hang():
    """Ends a test that waits for ever, with the stacks of all threads: locks and thread pools can do that."""
    faulthandler.dump_traceback_later(300, exit=True)
    yield
    faulthandler.cancel_dump_traceback_later()
