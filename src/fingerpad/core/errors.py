"""Errors of the package: one sentence with the expected value, the actual value and the remedy."""

import copy
import difflib
import re
import reprlib
import sys
from collections.abc import Collection
from itertools import count
from typing import Any

from fingerpad.core.units import name_and_unit

Place = tuple[int | str, ...]  # Keys and indices from 0 that lead to a value.

LONGEST_MESSAGE = 2000
"""Characters of an error's text; what is between its begin and its end is left out beyond that."""

_CLOSE = 0.6  # Similarity of two names from which one is taken for the other, of `difflib`.
_SHORTEST_STEM = 3  # Letters from which the beginning of a name is taken for it.
_NEW_NAMES = {"materials": "tissues"}  # Names that were renamed.


class FingerpadError(Exception):
    """Base class of every error that fingerpad raises deliberately."""

    def __str__(self) -> str:
        said = self._said()
        if len(said) <= LONGEST_MESSAGE:
            return said
        return f"{said[: LONGEST_MESSAGE // 2]} ... {said[-LONGEST_MESSAGE // 4 :]}"

    def _said(self) -> str:
        return super().__str__()


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
    near = near or [name for name in names if name_and_unit(name)[0] == wrong != name]
    near = near or difflib.get_close_matches(wrong, names, n=1, cutoff=_CLOSE)
    near = near or [name for name in names if len(wrong) >= _SHORTEST_STEM and name.startswith(wrong)]
    return near[0] if near else None


class InputError(FingerpadError, ValueError):
    """An argument, option or file that cannot be used as given.

    Parameters
    ----------
    path : str or tuple of str and int
        What it is about, as the attribute `path` tells programs: an argument such as "at_mm[0]", or keys and
        indices from 0 in a file, such as ("stimuli", 1, "width_mm"). Alone, it is a sentence about no
        single argument.
    expected : str, optional
        What must be, which begins with a verb.
    got : str, optional
        What came.
    remedy : str, optional
        What to do, or the fact that was met.

    Examples
    --------
    >>> error = InputError("depth_mm", "must be greater than 0 [mm]", "-1", "press inwards")
    >>> print(error)
    depth_mm must be greater than 0 [mm]: got -1; press inwards.
    >>> error.path, error.got
    (('depth_mm',), '-1')
    """

    def __init__(self, path: object, expected: str = "", got: str = "", remedy: str = ""):
        super().__init__(path, expected, got, remedy)
        self.expected, self.got, self.remedy = expected, got, remedy
        self.path: Place = ()
        """What it is about."""
        self.where, self.source, self.in_file = "", "", False
        """Words for the path; the file and its line; whether the path leads through a file."""
        self.said = str(path)
        if expected:
            self.path = path if isinstance(path, tuple) else _parts(str(path))
            self.where = spelled(self.path) if isinstance(path, tuple) else str(path)
            self.said = f"{expected}: got {got}" if got else expected
            self.said += f"{'; ' if got else ': '}{remedy}" if remedy else ""
            self.said += "" if self.said.endswith(("?", ".")) else "."

    def _said(self) -> str:
        between = " " if self.expected else ": "
        said = f"{self.where}{between}{self.said}" if self.where else self.said
        return f"{self.source}, {said}" if self.source else said

    def at(self, place: Place, words: str | None = None, in_file: bool = True) -> "InputError":
        """Return the same error at a place, of a file or of an argument, which `words` spell."""
        other = copy.copy(self)
        other.path, other.where, other.in_file = place, spelled(place) if words is None else words, in_file
        return other

    def from_source(self, source: str) -> "InputError":
        """Return the same error with the file, and perhaps its line, in front."""
        other = copy.copy(self)
        other.source = source
        return other


def spelled(path: Place) -> str:
    """Spell a place in a file, such as stimuli[2].width_mm, entries counted from 1."""
    text = "".join(f"[{part + 1}]" if isinstance(part, int) else f".{part}" for part in path)
    return text.lstrip(".") or "the file"


def named(path: Place) -> str:
    """Spell a part of an argument, such as corners_mm[0], entries counted from 0."""
    return "".join(f"[{part}]" if isinstance(part, int) else f".{part}" for part in path).lstrip(".")


def _parts(path: str) -> Place:
    """Parts of the name of an argument, such as corners_mm[0]; none of the name of a file."""
    if not re.fullmatch(r"[\w-]+(\[\d+\])*", path):
        return ()
    return tuple(int(part) if part.isdigit() else part for part in re.findall(r"[^\[\]]+", path))


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
    inside = __name__.partition(".")[0], "functools", "contextlib", "pydantic"
    for level in count(1):
        home = str(sys._getframe(level).f_globals.get("__name__", ""))
        if home.partition(".")[0] not in inside or sys._getframe(level).f_back is None:
            break
    return level
