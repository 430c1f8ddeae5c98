"""Block of docs/tissues.md: every named set of tissues."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import groupby

from fingerpad.experiments.tissue_sets import TissueLayer, tissue_layers
from fingerpad.report.tables import fixed, number
from studies.pages import table

SET_COLUMNS = ("set", "law of dermis and subcutis", "shear moduli [kPa]", "nu", "relaxing share", "status")


def set_blocks() -> dict[str, str]:
    """Return one row per named set, moduli from the outside in."""
    rows = [_set(name, list(layers)) for name, layers in groupby(tissue_layers(), lambda each: each.tissues)]
    return {"sets": table(SET_COLUMNS, rows)}


def _set(name: str, layers: Sequence[TissueLayer]) -> tuple[str, ...]:
    return (
        f"`{name}`",
        layers[-1].law,
        " / ".join(number(layer.shear_kpa) for layer in layers),
        _once([fixed(layer.poisson, 2) for layer in layers]),
        _once([fixed(sum(layer.prony_shares), 2) for layer in layers]),
        _once([layer.modulus_status for layer in layers]),
    )


def _once(texts: Sequence[str]) -> str:
    """Values of four layers, each of them once.

    >>> _once(["0.40", "0.40", "0.40", "0.40"]), _once(["0.48", "0.48", "0.40", "0.40"])
    ('0.40', '0.48 / 0.40')
    """
    return " / ".join(dict.fromkeys(texts))
