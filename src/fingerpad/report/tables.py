"""Tables of level 3."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from fingerpad.report import discrimination
from fingerpad.report.formatting import fixed, number, plain
from fingerpad.report.parts import Row, Table

UNBROKEN = "\N{NO-BREAK SPACE}"


def hit_rates(section: Mapping[str, Any]) -> list[Table]:
    """Return the numbers behind Figures 7 and 8."""
    panels = [*discrimination.observer_panels(dict(section)), *discrimination.criterion_panels(dict(section))]
    rows = [
        Row((title.replace("\n", ", "), place, *_with_spread(rates, suffix)))
        for title, rates in panels
        if rates
        for place, suffix in (("0.0", ""), ("0.2", "_shifted"))
        if rates.get(f"hit_rate{suffix}")
    ]
    columns = (
        "observer",
        "sphere at [mm]",
        *(f"{number(curvature)} 1/m" for curvature in section["curvature_per_m"][1:]),
    )
    return [Table("Hit rates, mean ± standard deviation", columns, rows)] if rows else []


def readings(section: Mapping[str, Any]) -> list[Table]:
    """Return what other readings of the paper's steps would give."""
    rows = [
        Row(
            (
                reading["reading"],
                " / ".join(plain(count) for count in reading["receptors"]),
                " / ".join(fixed(rise, 3) for rise in reading["rise"]),
                fixed(reading["largest_shift"], 3),
                *(fixed(reading[key], 3) for key in ("noise_sigma", "misfit", "own_largest_shift")),
            ),
            "final" if "(used)" in reading["reading"] else "",
        )
        for reading in section.get("reasons", {}).get("readings", [])
    ]
    columns = (
        "reading",
        "receptors",
        "rise of the sum, 287 to 365 1/m",
        "largest change by the shift",
        "noise of its own",
        "rms distance to people with it",
        "largest change by the shift with it",
    )
    note = (
        "Two numbers are for the spheres at 0.0 and at 0.2 mm. The noise is fitted to both positions "
        "together; expected hit rates, without the chance of a session."
    )
    return [Table("Readings of steps that the paper leaves open", columns, rows, note)] if rows else []


def _with_spread(rates: Mapping[str, Any], suffix: str) -> list[str]:
    means = rates[f"hit_rate{suffix}"]
    spreads = rates.get(f"hit_rate{suffix}_sd") or [None] * len(means)
    return [
        fixed(mean, 2)
        + ("" if mean is None or spread is None else f"{UNBROKEN}±{UNBROKEN}{fixed(spread, 2)}")
        for mean, spread in zip(means, spreads, strict=True)
    ]
