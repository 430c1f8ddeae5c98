"""Numbers as text, and tables: rows of cells, made here or filled in by the rows of `pages.toml`."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any, Literal, NamedTuple

import numpy as np

from fingerpad import data
from fingerpad.core.units import name_and_unit

ABSENT = "–"
UNBROKEN = "\N{NO-BREAK SPACE}"
PHASE_LABELS = {"dynamic": "dynamic ramp", "static": "static hold"}
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


WORDS = {"stored": "strain energy density", "von_mises": "von Mises stress", "work": "work of the stress"}
"""Names in words, where these are not those of the code."""


def in_words(name: str) -> str:
    return WORDS.get(name, name.replace("_", " "))


def joined(parts: Sequence[str]) -> str:
    """Return a list as a sentence has it."""
    return " and ".join([", ".join(parts[:-1]), parts[-1]] if len(parts) > 1 else parts)


def spelled(key: str) -> str:
    """Return the name of a field in words, its unit in brackets."""
    name, unit = name_and_unit(key)
    return name.replace("_", " ") + (f" [{unit}]" if unit else "")


def plain(value: Any, digits: int = 3, longest: int = 8) -> str:
    """Return any JSON value as a short text: lists above the longest by their size and range."""
    if isinstance(value, np.ndarray):
        value = value.tolist()
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
    return str(value) or ABSENT


def percent(share: float | None, decimals: int = 0) -> str:
    """Return a share in percent, or a dash for one that does not exist."""
    return f"{fixed(None if share is None else 100.0 * share, decimals)} %"


def with_error(value: float | None, error: float | None, decimals: int = 2) -> str:
    """Return a value with its error; a dash for one that does not exist."""
    if value is None or math.isnan(value):
        return ABSENT
    return f"{fixed(value, decimals)}{UNBROKEN}±{UNBROKEN}{fixed(error, decimals)}"


Kind = Literal["", "assumed", "final"]  # An assumed input, or the row that is the result.


class Row(NamedTuple):
    """A row of a table."""

    cells: Sequence[str]  #: Finished texts, the first is the row's heading.
    kind: Kind = ""  #: How the row is marked.


@dataclass(frozen=True)
class Table:
    """A table."""

    title: str
    columns: Sequence[str]  #: Headings with units; all empty where the table lists names and values.
    rows: Sequence[Row]  #: One cell per column.
    note: str = ""  #: A sentence below it.


def at(found: Any, path: str) -> Any:
    """Return what lies at a path: names of fields, keys and places with dots between them, or None."""
    for part in path.split(".") if path else ():
        if found is None:
            return None
        if isinstance(found, Mapping):
            found = found.get(part)
        elif part.removeprefix("-").isdigit():
            found = found[int(part)] if int(part) < len(found) else None
        else:
            found = getattr(found, part)
    return found


FORMS: dict[str, Callable[[Any], str]] = {
    "": plain,
    "count": lambda items: plain(len(items)),
    "percent": percent,
    "interval": lambda found: ABSENT if found is None else span((found.low, found.high), "open"),
    # The record of what was used: nothing is rounded or left out.
    "exact": partial(plain, digits=12, longest=1000),
    "words": in_words,
    "span": span,
}
"""Forms of values in texts of `pages.toml`, beside a number of decimals."""


def filled(text: str, found: Any) -> str:
    """Fill in what lies at paths, `{fss}` or `{fss:2}`, see `FORMS`; a path may begin with `data`."""

    def value(match: re.Match[str]) -> str:
        path, form = match.groups(default="")
        root, _, rest = path.partition(".")
        shown = at(data, rest) if root == "data" else at(found, path)
        return fixed(shown, int(form)) if form.isdigit() else FORMS[form](shown)

    return re.sub(r"\{([\w.-]+)(?::(\w+))?\}", value, text)


def filled_table(spec: Mapping[str, Any], found: Any, made: Sequence[Sequence[str]] = ()) -> Table:
    """Return a table of `pages.toml`: of its `rows`, of its `cells` for `each` part, or of what was made."""
    if "rows" in spec:
        made = [tuple(filled(cell, found) for cell in row) for row in spec["rows"]]
    elif "each" in spec:
        parts = at(found, spec["each"])
        parts = parts.items() if isinstance(parts, Mapping) else parts
        made = [tuple(filled(cell, part) for cell in spec["cells"]) for part in parts]
    columns = [filled(heading, found) for heading in spec.get("columns", ("", ""))]
    rows = [Row(cells, _kind(cells)) for cells in made]
    return Table(filled(spec["table"], found), columns, rows, filled(spec.get("note", ""), found))


def _kind(row: Sequence[str]) -> Kind:
    if "assumed" in row:
        return "assumed"
    return "final" if row[0] == "met" or row[0].endswith("(used)") else ""


def facts_table(title: str, facts: Mapping[str, object]) -> Table:
    """Return names of fields and their values; what is None or empty is left out."""
    given = {key: value for key, value in facts.items() if value is not None and value not in ({}, ())}
    return Table(title, ("", ""), [Row((spelled(key), plain(value))) for key, value in given.items()])
