"""The page of `python -m studies code-efficiency`."""

from __future__ import annotations

from collections.abc import Sequence

from fingerpad.psychophysics.code_efficiency import SMALLEST_SPREAD
from fingerpad.report.formatting import number, with_error
from fingerpad.report.manifest import edition, manifest_chapter
from fingerpad.report.parts import Chapter, Page, Row, Table
from studies.code_efficiency import CodeEfficiencyStudy, EfficiencyRow


def tables(rows: Sequence[EfficiencyRow]) -> list[Table]:
    """Return efficiencies by code."""
    codes = [
        Row(
            (
                row.code,
                row.measure,
                row.noise,
                number(row.receptors),
                with_error(row.d_prime, row.d_prime_error),
                with_error(row.ideal_d_prime, row.ideal_d_prime_error),
                with_error(row.efficiency, row.efficiency_error),
            )
        )
        for row in rows
    ]
    return [
        Table(
            "Efficiency of codes",
            ("code", "measure", "noise", "receptors", "d-prime", "that of the ideal observer", "efficiency"),
            codes,
            "Spheres of 287 and 316 1/m. Efficiency is the squared ratio of the two: the share of the trials "
            "with which the ideal observer would reach the same d-prime. Multiplicative noise has a floor of "
            f"{number(SMALLEST_SPREAD)} spikes/s or ms. The last rows have Poisson spike counts of the hold "
            "without other noise.",
        ),
    ]


def code_efficiency_page(result: CodeEfficiencyStudy) -> Page:
    """Return the page of `python -m studies code-efficiency`."""
    return Page(
        "Efficiency of the codes",
        f"Gradient Sum and Euclidean Distance against the ideal observer. {edition(result.manifest)}.",
        [],
        [Chapter("", tables(result.efficiency)), manifest_chapter(result.manifest)],
    )
