"""What a case is: a function that yields rows."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

RELATIVE, ABSOLUTE, AT_MOST, AT_LEAST = "relative", "absolute", "at most", "at least"


@dataclass(frozen=True)
class Row:
    """One number and its judgement.

    Parameters
    ----------
    quantity : str
        What is compared.
    expected, got : float
        The known answer (or bound) and ours.
    tolerance : float
        Allowed difference: relative to `expected` or absolute; none for a bound.
    judged : str
        One of "relative", "absolute", "at most" and "at least".
    unit : str
        Unit of both numbers.
    """

    quantity: str
    expected: float
    got: float
    tolerance: float
    judged: str
    unit: str

    @property
    def passes(self) -> bool:
        """Whether the number is good enough; a NaN never is."""
        if self.judged == AT_MOST:
            return bool(self.got <= self.expected)
        if self.judged == AT_LEAST:
            return bool(self.got >= self.expected)
        scale = abs(self.expected) if self.judged == RELATIVE else 1.0
        return bool(abs(self.got - self.expected) <= self.tolerance * scale)


def near(quantity: str, expected: float, got: float, relative: float, unit: str = "") -> Row:
    """Row whose numbers may differ by a share of the expected one.

    >>> near("force", 100.0, 101.0, relative=0.02).passes
    True
    """
    return Row(quantity, float(expected), float(got), relative, RELATIVE, unit)


def equal(quantity: str, expected: float, got: float, absolute: float, unit: str = "") -> Row:
    """Row whose numbers may differ by an absolute amount.

    >>> equal("angle", 0.0, float("nan"), absolute=1.0).passes
    False
    """
    return Row(quantity, float(expected), float(got), absolute, ABSOLUTE, unit)


def at_most(quantity: str, bound: float, got: float, unit: str = "") -> Row:
    """Row whose number must not exceed a bound."""
    return Row(quantity, float(bound), float(got), 0.0, AT_MOST, unit)


def at_least(quantity: str, bound: float, got: float, unit: str = "") -> Row:
    """Row whose number must not fall below a bound."""
    return Row(quantity, float(bound), float(got), 0.0, AT_LEAST, unit)


@dataclass(frozen=True)
class Case:
    """A question with a known answer.

    Parameters
    ----------
    name : str
        Name of the function.
    theme, title, source : str
        Chapter of the page, what is pressed or checked, and where the known answer comes from.
    slow : bool
        Whether only the page runs it, and not every test run.
    measure : callable
        Does the work; returns rows.
    """

    name: str
    theme: str
    title: str
    source: str
    slow: bool
    measure: Callable[[], list[Row]]

    @cached_property
    def rows(self) -> list[Row]:
        """What was measured, once per process."""
        return self.measure()


CASES: list[Case] = []


def case(theme: str, title: str, source: str, slow: bool = False) -> Callable:
    """Register a function as a case."""

    def register(measure: Callable[[], list[Row]]) -> Callable[[], list[Row]]:
        CASES.append(Case(measure.__name__, theme, title, source, slow, measure))
        return measure

    return register
