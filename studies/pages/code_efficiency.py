"""How good the codes of a population are, as a table."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from fingerpad.report.formatting import fixed, number, plain
from fingerpad.report.parts import Row, Table
from fingerpad.report.tables import UNBROKEN


def tables(rows: Sequence[Mapping[str, Any]]) -> list[Table]:
    """Return efficiencies by code."""
    codes = [
        Row(
            (
                plain(row["code"]),
                plain(row["measure"]),
                plain(row["noise"]),
                number(row["receptors"]),
                _with_error(row["d_prime"], row["d_prime_error"]),
                _with_error(row["ideal_d_prime"], row["ideal_d_prime_error"]),
                _with_error(row["efficiency"], row["efficiency_error"]),
            )
        )
        for row in rows
    ]
    return [
        Table(
            "How good the codes are",
            ("code", "measure", "noise", "receptors", "d-prime", "that of the ideal observer", "efficiency"),
            codes,
            "Spheres of 287 and 316 1/m. Efficiency is the squared ratio of the two: the share of trials in "
            "which the ideal observer, who knows how responses vary, would judge as well. Receptors that are "
            "silent under one of the spheres are left out. The last rows take the spikes of the hold for "
            "Poisson processes, without other noise.",
        ),
    ]


def _with_error(value: float | None, error: float | None) -> str:
    return f"{fixed(value, 2)}{UNBROKEN}±{UNBROKEN}{fixed(error, 2)}"
