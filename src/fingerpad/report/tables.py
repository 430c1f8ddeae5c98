"""Numbers as text, and tables: rows of any objects, columns that say what of them is shown and how."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Literal, NamedTuple

from fingerpad.core.units import name_and_unit

ABSENT = "–"
UNBROKEN = "\N{NO-BREAK SPACE}"
PHASE_LABELS = {"dynamic": "dynamic ramp", "static": "static hold"}
PARAMETER_SYMBOLS = {
    "intercept_ma": "intercept β",
    "dynamic_gain": "dynamic gain k_d",
    "static_gain": "static gain k_s",
    "time_constant_ms": "time constant τ",
    "capacitance_mf": "capacitance C",
    "threshold_mv": "threshold v",
}
"""The six parameters of the paper, with their symbols."""

IDENTIFIABLE_SYMBOLS = {
    "intercept_per_ms": "β/(C v)",
    "dynamic_gain_per_kpa": "k_d/(C v)",
    "static_gain_per_kpa_ms": "k_s/(C v)",
    "time_constant_ms": "τ",
}
"""The four identifiable numbers."""

_SUPERSCRIPT = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")


def number(value: float | None, digits: int = 3) -> str:
    """Return a number with so many significant digits, or a dash for one that does not exist."""
    if value is None or math.isnan(value):
        return ABSENT
    if math.isinf(value):
        return "∞" if value > 0 else "−∞"
    if float(value).is_integer() or abs(value) < 10.0**digits:
        shown = float(value) if float(value).is_integer() else float(f"{value:.{digits}g}")
    else:
        shown = float(round(value))
    size = abs(shown)
    if size >= 1e6 or 0.0 < size < 1e-3:
        mantissa, exponent = f"{size:.{digits - 1}e}".split("e")
        mantissa = mantissa.rstrip("0").rstrip(".") if "." in mantissa else mantissa
        text = f"{mantissa} × 10{str(int(exponent)).translate(_SUPERSCRIPT)}"
    elif size >= 1e4:
        text = f"{size:,.0f}".replace(",", " ")
    else:
        text = f"{size:.12g}"
    return f"−{text}" if shown < 0.0 else text


def fixed(value: float | None, decimals: int) -> str:
    """Return a number with so many decimals, for columns of numbers."""
    if value is None or not math.isfinite(value):
        return number(value)
    return f"{value:.{decimals}f}".replace("-", "−")


def span(ends: Iterable[float | None] | None, absent: str = ABSENT) -> str:
    """Return an interval; `absent` stands for an end that does not exist."""
    return ABSENT if ends is None else " … ".join(absent if end is None else number(end) for end in ends)


def joined(parts: Sequence[str]) -> str:
    """Return a list as a sentence has it."""
    return " and ".join([", ".join(parts[:-1]), parts[-1]] if len(parts) > 1 else parts)


def spelled(key: str) -> str:
    """Return the name of a field in words, its unit in brackets."""
    name, unit = name_and_unit(key)
    return name.replace("_", " ") + (f" [{unit}]" if unit else "")


def plain(value: Any, digits: int = 3, longest: int = 8) -> str:
    """Return any JSON value as a short text: lists above the longest by their size and range."""
    if isinstance(value, bool):
        return "yes" if value else "no"
    if value is None or isinstance(value, int | float):
        return number(value, digits)
    if isinstance(value, Mapping):
        items = (f"{spelled(str(key))}: {plain(item, digits, longest)}" for key, item in value.items())
        return "; ".join(items)
    if isinstance(value, Sequence) and not isinstance(value, str):
        if len(value) <= longest:
            shown = [plain(item, digits, longest).removesuffix(".") for item in value]
            return ("; " if any(", " in item for item in shown) else ", ").join(shown) or ABSENT
        known = [item for item in value if isinstance(item, int | float) and not math.isnan(item)]
        within = f", {number(min(known))} … {number(max(known))}" if known else ""
        return f"{len(value)} values{within}"
    return str(value)


def whole_percent(share: float | None) -> str:
    """Return a share in whole percent, or a dash for one that does not exist."""
    return f"{fixed(None if share is None else 100.0 * share, 0)} %"


def with_error(value: float | None, error: float | None, decimals: int = 2, space: str = UNBROKEN) -> str:
    return f"{fixed(value, decimals)}{space}±{space}{fixed(error, decimals)}"


Kind = Literal["", "assumed", "final"]  # An assumed input, or the row that is the result.


class Row(NamedTuple):
    """A row of a table."""

    cells: Sequence[str]  # Finished texts, the first is the row's heading.
    kind: Kind = ""  # How the row is marked.


@dataclass(frozen=True)
class Table:
    """A table."""

    title: str
    columns: Sequence[str]  # Headings with units; all empty where the table lists names and values.
    rows: Sequence[Row]  # One cell per column.
    note: str = ""  # A sentence below it.


class Column(NamedTuple):
    """A column of a table of objects."""

    value: (
        str | Callable[[Any], Any]
    )  # Path of fields, keys and places, as in "folds.0.fss"; or what computes it.
    heading: str | None = None  # By default the name in words; the unit of a field is added.
    form: int | Callable[[Any], str] = plain  # Number of decimals, or what makes a text.

    @property
    def title(self) -> str:
        name = "" if callable(self.value) else self.value.rpartition(".")[2]
        if self.heading is None:
            return spelled(name)
        unit = name_and_unit(name)[1] if self.heading and "[" not in self.heading else ""
        return f"{self.heading} [{unit}]" if unit else self.heading

    def cell(self, row: Any) -> str:
        value = self.value(row) if callable(self.value) else at(row, self.value)
        return fixed(value, self.form) if isinstance(self.form, int) else self.form(value)


def at(found: Any, path: str) -> Any:
    """Return what lies at a path: names of fields, keys and places, with dots between them."""
    for part in path.split("."):
        if isinstance(found, Mapping):
            found = found.get(part)
        else:
            found = found[int(part)] if part.isdigit() else getattr(found, part)
    return found


def filled(text: str, found: Any) -> str:
    """Fill in what lies at paths: `{fss}`, `{fss:2}` with decimals, `{folds:n}` counted, `{level:p}` in %."""

    def value(match: re.Match[str]) -> str:
        path, form = match.groups()
        shown = at(found, path)
        if form is None:
            return plain(shown)
        forms = {"n": lambda items: plain(len(items)), "p": whole_percent}
        return forms[form](shown) if form in forms else fixed(shown, int(form))

    return re.sub(r"\{([\w.]+)(?::(\w))?\}", value, text)


def table(
    title: str,
    rows: Iterable[Any],
    columns: Sequence[Column],
    note: str = "",
    mark: Callable[[Any], Kind] = lambda row: "",
) -> Table:
    """Return a table with a row for each object; `mark` says how its row is marked."""
    made = [Row(tuple(column.cell(row) for column in columns), mark(row)) for row in rows]
    return Table(title, tuple(column.title for column in columns), made, note)


def listed(
    title: str, values: Mapping[str, Any], columns: tuple[str, str] = ("", ""), note: str = "",
    form: int | Callable[[Any], str] = plain,
) -> Table:  # fmt: skip
    """Return names and values as a table."""
    return table(title, values.items(), (Column("0", columns[0]), Column("1", columns[1], form)), note)


def facts_table(title: str, facts: Mapping[str, object]) -> Table:
    """Return names of fields and their values; what is None or empty is left out."""
    given = {key: value for key, value in facts.items() if value is not None and value not in ({}, ())}
    return listed(title, {spelled(key): value for key, value in given.items()})
