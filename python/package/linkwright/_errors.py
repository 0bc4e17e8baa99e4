"""Exceptions. Each message says what happened, where, and what to do."""


class Error(Exception):
    """Base class of the exceptions of linkwright."""


class DefinitionError(Error, ValueError):
    """A problem, a design, a method or another argument is wrong."""


class ModelError(DefinitionError):
    """A model cannot be read. The message shows the lines of its text."""


class AnalysisError(Error, RuntimeError):
    """A design cannot be analysed.

    Raise it in a function of a :class:`~linkwright.Problem` where a design cannot be analysed: the optimizer then rejects
    the design and takes a smaller step. Any other exception ends the run and arrives with its traceback.
    """
