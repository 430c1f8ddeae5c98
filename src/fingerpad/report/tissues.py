"""The table of tissues: each layer of each named set with its law, moduli, relaxation and status."""

from __future__ import annotations

from collections.abc import Sequence

from fingerpad.experiments.tissue_sets import TissueLayer
from fingerpad.report.formatting import ABSENT, fixed, number
from fingerpad.report.parts import Row, Table

COLUMNS = (
    "set",
    "layer",
    "law",
    "shear modulus, long-term [kPa]",
    "shear modulus, at once [kPa]",
    "nu, long-term",
    "nu, at once",
    "Prony shares (times [s])",
    "status: modulus / nu / Prony",
    "source of the modulus",
)
NOTE = (
    "Moduli and Poisson's ratio nu are those for small strains. Only the deviator relaxes: the bulk modulus "
    "is the same at once and in the long term, so that nu is smaller at once. The sets trial1, trial2 and "
    "trial3 stand for the paper's three trials; the numbers of its Tables 1 and 2 are lost."
)


def tissue_table(layers: Sequence[TissueLayer]) -> Table:
    """Return one row per set and layer."""
    rows = [
        Row.of(
            layer.tissues,
            layer.layer,
            layer.law,
            number(layer.shear_kpa),
            number(layer.shear_at_once_kpa) if layer.prony_shares else ABSENT,
            fixed(layer.poisson, 2),
            fixed(layer.poisson_at_once, 2) if layer.prony_shares else ABSENT,
            ", ".join(
                f"{number(share)} ({number(time)})"
                for share, time in zip(layer.prony_shares, layer.prony_times_s, strict=True)
            )
            or "none",
            " / ".join(
                status or ABSENT
                for status in (layer.modulus_status, layer.poisson_status, layer.prony_status)
            ),
            layer.source,
        )
        for layer in layers
    ]
    return Table("Tissues by set and layer (in place of the paper's Tables 1 and 2)", COLUMNS, rows, NOTE)
