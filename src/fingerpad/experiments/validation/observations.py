"""Files of observations: nine kinds, each known by its header."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path

import numpy as np

from fingerpad.core.checked import checked
from fingerpad.core.errors import InputError
from fingerpad.core.files import check_file
from fingerpad.core.tables import TableRow, read_csv
from fingerpad.core.units import unit_of
from fingerpad.core.values import FloatArray, finite, float_array, not_negative, one_of, positive
from fingerpad.data.afferents import TYPES
from fingerpad.experiments.requests.stimulus import indenter_named
from fingerpad.geometry.indenters import Indenter
from fingerpad.geometry.mesh import LAYERS

LARGEST_FILE_MB = 1.0  # Larger files are refused: they hold no published table. [MB]

STIFFEST_N_PER_MM = 10.0  # No fingertip has it; plates have 0.05 to 0.5 (Dandekar 1995, as quoted).
Value = float | str


def not_concave(name: str, value: float, unit: str = "") -> float:
    """Return a curvature that is not negative, else raise `InputError`."""
    if finite(name, value, unit) < 0.0:
        raise InputError(
            name,
            f"must not be negative [{unit}], because indenters are spheres and, at 0, a flat plate",
            repr(value),
            "leave concave surfaces out",
        )
    return float(value)


COLUMNS: dict[str, Callable[..., float]] = {
    "depth_mm": not_negative,
    "distance_mm": finite,
    "position_mm": finite,
    "curvature_per_m": not_concave,
    "ridge_mm": positive,
    "groove_mm": positive,
    "spacing_mm": positive,
    "speed_mm_s": positive,
    "force_n": not_negative,
    "deflection_mm": finite,
    "rate_hz": not_negative,
    "time_ms": not_negative,
    "area_mm2": not_negative,
    "strain": not_negative,
}  # Check of each column of numbers.

INDENTER = "indenter"
WORDS = {
    "afferent": tuple(TYPES),
    "layer": tuple(layer.replace(" ", "_") for layer in LAYERS[:-1]),
}  # Columns that hold one of some words.


@dataclass(frozen=True)
class Kind:
    """A kind of observation."""

    name: str
    conditions: tuple[str, ...]  #: Columns that say under what was observed.
    observed: str  #: Column of what was observed.

    @property
    def columns(self) -> tuple[str, ...]:
        """All columns, in the order of the documented header."""
        return (*self.conditions, self.observed)

    @property
    def axis(self) -> str:
        """Condition that is a place along the finger, whose direction a source may leave open."""
        return next((name for name in self.conditions if name in ("distance_mm", "position_mm")), "")


KINDS: dict[str, Kind] = {
    kind.name: kind
    for kind in (
        Kind("force", (INDENTER, "depth_mm"), "force_n"),
        Kind("deflection", (INDENTER, "depth_mm", "distance_mm"), "deflection_mm"),
        Kind("rate_curvature", ("force_n", "curvature_per_m"), "rate_hz"),
        Kind("rate_position", ("force_n", "curvature_per_m", "position_mm"), "rate_hz"),
        Kind("grating", ("force_n", "ridge_mm", "groove_mm", "position_mm"), "rate_hz"),
        Kind("receptive_field", ("afferent", "depth_mm"), "area_mm2"),
        Kind("dots", ("afferent", "spacing_mm", "speed_mm_s", "force_n"), "rate_hz"),
        Kind("adaptation", ("depth_mm", "time_ms"), "rate_hz"),
        Kind("strain", ("force_n", "layer"), "strain"),
    )
}  # By name.


@dataclass(frozen=True)
class Observation:
    """One row of a file."""

    line: int
    condition: tuple[Value, ...]  #: Values of the kind's conditions; an indenter as it is written.
    observed: float


@dataclass(frozen=True)
class Observations:
    """What a file holds."""

    kind: Kind
    rows: tuple[Observation, ...]
    source: str
    objects: Mapping[str, Indenter] = field(default_factory=dict)  #: Objects by the names that rows give.

    @cached_property
    def observed(self) -> FloatArray:
        """What was observed, (n_rows,). [unit of the kind]"""
        return float_array("observed", [row.observed for row in self.rows], 1)

    def indenter(self, text: str) -> Indenter:
        """Return the body that a row names."""
        return self.objects[text] if text in self.objects else indenter_named(text)

    @property
    def conditions(self) -> list[tuple[object, ...]]:
        """Conditions of the rows, equal where they mean the same: `punch:6.35` and `punch:6.350` are one."""
        return [
            tuple(
                self.indenter(str(value)) if column == INDENTER else value
                for column, value in zip(self.kind.conditions, row.condition, strict=True)
            )
            for row in self.rows
        ]


@checked
def read_observations(path: str | Path, objects: Mapping[str, Indenter] | None = None) -> Observations:
    r"""Read a file of observations.

    Parameters
    ----------
    path : str or Path
        A CSV file in UTF-8, of at most `LARGEST_FILE_MB`. Its header decides the kind; columns may stand in
        any order, and lines that begin with # are comments.
    objects : mapping of str to Indenter, optional
        Bodies of one's own, by the names that the column of the indenter has for them.

    Examples
    --------
    >>> from tempfile import TemporaryDirectory
    >>> with TemporaryDirectory() as folder:
    ...     path = Path(folder) / "plate.csv"
    ...     _ = path.write_text("indenter,depth_mm,force_n\nplate,1,0.11\nplate,1,0.23\n", encoding="utf-8")
    ...     found = read_observations(path)
    >>> found.kind.name, found.rows[1].condition, found.observed.tolist()
    ('force', ('plate', 1.0), [0.11, 0.23])
    """
    path = check_file(Path(path), LARGEST_FILE_MB)
    lines = read_csv(path, (INDENTER, *WORDS, *COLUMNS))
    kind = _kind(path, tuple(lines[0].entries))
    own = dict(objects or {})
    return Observations(kind, tuple(_observation(line, kind, own) for line in lines), str(path), own)


def _kind(path: Path, columns: tuple[str, ...]) -> Kind:

    def differing(kind: Kind) -> set[str]:
        return set(kind.columns) ^ set(columns)

    nearest = min(KINDS.values(), key=lambda kind: len(differing(kind)))
    if not differing(nearest):
        return nearest
    lacking = [f"add {column}" for column in nearest.columns if column not in columns]
    unwanted = [f"leave out {column}" for column in columns if column not in nearest.columns]
    known = "; ".join(",".join(kind.columns) for kind in KINDS.values())
    raise InputError(
        f"{path}, header: must be that of one kind ({known}): got {','.join(columns)}; for the kind "
        f"{nearest.name}, {' and '.join(lacking + unwanted)}."
    )


def _observation(line: TableRow, kind: Kind, own: Mapping[str, Indenter]) -> Observation:
    condition = tuple(_value(line, column, own) for column in kind.conditions)
    observed = line.number(kind.observed, unit_of(kind.observed), COLUMNS[kind.observed])
    stiffest = STIFFEST_N_PER_MM * line.number("depth_mm", "mm") if kind.observed == "force_n" else np.inf
    if observed > stiffest:
        raise InputError(
            f"{line.place}: force_n must be at most {STIFFEST_N_PER_MM:g} N for each mm of depth_mm: got "
            f"{observed:g} N at {line.text('depth_mm')} mm; check its unit."
        )
    return Observation(line.line, condition, observed)


def _value(line: TableRow, column: str, own: Mapping[str, Indenter]) -> Value:
    if column in COLUMNS:
        return line.number(column, unit_of(column), COLUMNS[column])
    text = line.text(column)
    with line.placed():
        if column in WORDS:
            return one_of(column, text, WORDS[column])
        if text not in own:
            indenter_named(text)
    return text
