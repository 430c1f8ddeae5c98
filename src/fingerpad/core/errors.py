"""Errors of the package: one sentence with the expected value, the actual value and the remedy."""

import sys
from itertools import count


class FingerpadError(Exception):
    """Base class of every error that fingerpad raises deliberately."""


class InputError(FingerpadError, ValueError):
    """An argument, option or file that cannot be used as given."""


class StoreError(FingerpadError):
    """A stored result that cannot be read or written."""


class ConvergenceError(FingerpadError, RuntimeError):
    """A solution that did not converge; no result is returned.

    Parameters
    ----------
    message : str
        What failed, where, and what to try.
    history : tuple of str, optional
        One line per attempt, oldest first; no part of the text of the error.
    """

    def __init__(self, message: str, history: tuple[str, ...] = ()):
        super().__init__(message)
        self.history = history


class MaterialWarning(UserWarning):
    """A material that becomes unstable within the range of stretches of a touch."""


class InertiaWarning(UserWarning):
    """A motion so fast that the inertia of the tissue, which is neglected, matters."""


def level_of_caller() -> int:
    """`stacklevel` of `warnings.warn` with which a warning names the line that called the package."""
    inside = __name__.partition(".")[0], "functools", "contextlib"
    for level in count(1):
        home = str(sys._getframe(level).f_globals.get("__name__", ""))
        if home.partition(".")[0] not in inside or sys._getframe(level).f_back is None:
            break
    return level
