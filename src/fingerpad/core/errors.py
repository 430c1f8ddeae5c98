"""Errors of the package: one sentence with the expected value, the actual value and the remedy."""

import reprlib
import sys
from itertools import count
from typing import Any

LONGEST_MESSAGE = 2000
"""Characters of an error's text; what is between its begin and its end is left out beyond that."""


class FingerpadError(Exception):
    """Base class of every error that fingerpad raises deliberately."""

    def __str__(self) -> str:
        said = super().__str__()
        if len(said) <= LONGEST_MESSAGE:
            return said
        return f"{said[: LONGEST_MESSAGE // 2]} ... {said[-LONGEST_MESSAGE // 4 :]}"


class _Shown(reprlib.Repr):
    """`repr` of bounded length and cost, also of numbers with more digits than Python writes."""

    def __init__(self) -> None:
        super().__init__()
        self.maxlevel, self.maxstring, self.maxother, self.maxlong = 3, 80, 120, 60
        self.maxlist = self.maxtuple = self.maxdict = self.maxset = self.maxfrozenset = self.maxarray = 6

    def repr_int(self, x: int, level: int) -> str:
        if x.bit_length() > 1000:
            return f"a whole number of {x.bit_length()} bits"
        return super().repr_int(x, level)


def shown(value: Any) -> str:
    """Text of a value in an error: its `repr` on one line, shortened where it is long.

    Examples
    --------
    >>> shown("half"), shown([0.0] * 1000), shown(10**5000)
    ("'half'", '[0.0, 0.0, 0.0, 0.0, 0.0, 0.0, ...]', 'a whole number of 16610 bits')
    """
    return " ".join(_SHOWN.repr(value).split())


_SHOWN = _Shown()


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


class TissuesWarning(UserWarning):
    """An afferent that responds to other tissues than those with which it was fitted."""


def level_of_caller() -> int:
    """`stacklevel` of `warnings.warn` with which a warning names the line that called the package."""
    inside = __name__.partition(".")[0], "functools", "contextlib"
    for level in count(1):
        home = str(sys._getframe(level).f_globals.get("__name__", ""))
        if home.partition(".")[0] not in inside or sys._getframe(level).f_back is None:
            break
    return level
