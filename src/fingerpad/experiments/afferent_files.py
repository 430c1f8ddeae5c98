"""Afferents whose parameters stand in a file of results."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any, cast

from fingerpad.core.errors import InputError, StoreError, shown
from fingerpad.core.files import read_text
from fingerpad.data.tissues import DEFAULT_TISSUES
from fingerpad.experiments import schemas
from fingerpad.mechanics.materials import Tissues
from fingerpad.neuron.afferent import PARAMETER_NAMES, Afferent, AnyAfferent
from fingerpad.neuron.afferent_types import afferent_types

CHOSEN = "fingerpad fit of chosen numbers"  # Format of a fit of some numbers of one type.


def fitted_afferent(path: Path, tissues: str | Tissues = DEFAULT_TISSUES) -> AnyAfferent:
    """Afferent of a file of results: `fit.json`, or `results.json` of a reproduction."""
    try:
        read_text(path)  # names a file that cannot be read
        values = schemas.read(path, "fingerpad fit", CHOSEN, "fingerpad reproduction")
    except (InputError, StoreError) as error:
        raise InputError(f"afferent: {error}") from error
    try:
        if "fitted" in values:
            kind: Any = afferent_types(tissues)[values["type"]]
            return cast(AnyAfferent, replace(kind, **values["fitted"]))
        column = "human" if tissues == "human" else "paper"
        fitted = values["fit"] if "fit" in values else values[column]["single_unit"]
        named = values if "fit" in values else fitted
        parameters = [fitted["parameters"][name] for name in PARAMETER_NAMES]
        quantities = {name: named[name] for name in ("dynamic_quantity", "static_quantity")}
    except (LookupError, TypeError) as error:
        raise InputError(
            f"afferent: {path} must hold the parameters of a fit: {shown(error.args[0])} is missing there."
        ) from error
    try:
        return Afferent.from_parameters(parameters, **quantities, initial_mv=named.get("initial_mv"))
    except InputError as error:
        raise InputError(f"afferent: {path}: {error}") from error
