"""Errors of the package: one sentence with the expected value, the actual value and the remedy."""

import difflib
import reprlib
import sys
from collections.abc import Collection
from itertools import count
from typing import Any

LONGEST_MESSAGE = 2000
"""Characters of an error's text; what is between its begin and its end is left out beyond that."""

_CLOSE = 0.6
"""Similarity of two names from which one is taken for the other, of `difflib`."""

_SHORTEST_STEM = 3
"""Letters from which the beginning of a name is taken for it."""

_NEW_NAMES = {"materials": "tissues"}
"""Names that were renamed."""


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
    """Text of a value in an error: its `repr` on one line, shortened where it is long."""
    return " ".join(_SHOWN.repr(value).split())


_SHOWN = _Shown()


def did_you_mean(wrong: str, known: Collection[str], owner: str = "") -> str:
    """Name the known word that is closest to a wrong one, or all of them."""
    near = closest(wrong, known)
    return f"did you mean {near}?" if near else f"{owner or 'it'} has {', '.join(known) or 'no keyword'}."


def closest(wrong: Any, known: Collection[str]) -> str | None:
    """Known word that a wrong one may be meant for; None if none is close."""
    if not isinstance(wrong, str):
        return None
    names = [name for name in known if isinstance(name, str)]
    # A name without its unit, such as `depth`, means the first unit that is known, not the most similar one.
    near = [name for name in names if name == _NEW_NAMES.get(wrong)]
    near = near or [name for name in names if wrong and name.startswith(f"{wrong}_")]
    near = near or [name for name in names if len(wrong) >= _SHORTEST_STEM and name.startswith(wrong)]
    near = near or difflib.get_close_matches(wrong, names, n=1, cutoff=_CLOSE)
    return near[0] if near else None


def got(value: Any, known: Collection[str], shown: str | None = None) -> str:
    """End of an error about a value that is none of several names."""
    near, said = closest(value, known), f"got {shown or repr(value)}"
    return f"{said} (did you mean {near}?)." if near else f"{said}."


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
