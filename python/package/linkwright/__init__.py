"""Design optimization of multibody systems by sequential approximation, with exact sensitivities.

A :class:`Model` is a mechanism from a model file or a dictionary; a :class:`Problem` has responses from Python functions.
Both are analysed, differentiated, checked and optimized by the same methods. :func:`minimize` and :func:`scipy_method` have the
form of SciPy. A :class:`Study` does many runs of a model, on any executor. Units are SI and radians.
"""

import atexit as _atexit
import os as _os

from . import _core
from ._core import __version__
from ._errors import AnalysisError, DefinitionError, Error, ModelError
from ._labels import Variable
from ._minimize import OptimizeResult, minimize, scipy_method
from ._problem import BaseProblem, Model, Problem, methods
from ._results import Analyses, Analysis, Check, Comparison, Cycle, Figure, Page, Result, Sensitivities
from ._study import Study, StudyError, StudyResult

# A program that computes when the interpreter ends would continue.
_atexit.register(_core.end_programs)

# The threads of the library do not exist in a forked process: work there raises RuntimeError instead of waiting for ever.
if hasattr(_os, "register_at_fork"):
    _os.register_at_fork(after_in_child=_core.after_fork)

__all__ = [
    "Analyses",
    "Analysis",
    "AnalysisError",
    "BaseProblem",
    "Check",
    "Comparison",
    "Cycle",
    "DefinitionError",
    "Error",
    "Figure",
    "Model",
    "ModelError",
    "OptimizeResult",
    "Page",
    "Problem",
    "Result",
    "Sensitivities",
    "Study",
    "StudyError",
    "StudyResult",
    "Variable",
    "__version__",
    "methods",
    "minimize",
    "scipy_method",
]
