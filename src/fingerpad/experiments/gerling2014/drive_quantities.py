"""Which quantity in the skin drives the afferent: the same fits, with each quantity in the place of SED.

The paper samples strain energy density (SED) and leaves open whether the end organ feels a stress, a strain
or something else. Here each quantity that the skin half gives drives both terms of the current, I = beta +
k_d |Q'| + k_s Q, or the dynamic term alone, I = beta + k_d |Q'| + k_s U. All are fitted by the same methods
from start points with the same currents, on the same folds, so that a difference is the quantity's.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from fingerpad.core.checks import one_of
from fingerpad.core.errors import InputError
from fingerpad.core.signals import STORED_ENERGY, SedTraces
from fingerpad.experiments.gerling2014 import single_unit
from fingerpad.experiments.gerling2014.drive_fits import (
    Judged,
    judge,
    quick_method,
    relative_model,
    row,
    scaled_starts,
    six_of_relative,
)
from fingerpad.inference.fitting import Method
from fingerpad.inference.identifiable import IDENTIFIABLE_NAMES, identifiable
from fingerpad.inference.rate_model import AfferentModel
from fingerpad.inference.rate_problem import RateProblem
from fingerpad.inference.recordings import PHASES, RateRecordings
from fingerpad.inference.start_points import response_surface
from fingerpad.neuron.transduction import Drive, drive
from fingerpad.skin.sampling import SkinResponse

QUANTITIES = (
    STORED_ENERGY,
    "instantaneous",
    "work",
    "von_mises",
    "compressive_stress",
    "compressive_strain",
)
"""What the skin half gives: three definitions of the energy density, two stresses and a strain."""


@dataclass(frozen=True)
class Drivers:
    """What the two terms of the current follow.

    Parameters
    ----------
    static, dynamic : str
        Names of `QUANTITIES`.

    Examples
    --------
    >>> Drivers("stored", "stored") == PAPER
    True
    """

    static: str
    dynamic: str

    def __post_init__(self) -> None:
        one_of("static", self.static, QUANTITIES)
        one_of("dynamic", self.dynamic, QUANTITIES)


PAPER = Drivers(STORED_ENERGY, STORED_ENERGY)
ALONE = tuple(Drivers(quantity, quantity) for quantity in QUANTITIES)
"""One quantity for both terms; the paper's first."""

EXTENDED = Drivers(STORED_ENERGY, "compressive_stress")
"""The extension of the paper's model that explains the dynamic rates best."""

APART = (EXTENDED, *(Drivers(STORED_ENERGY, quantity) for quantity in ("von_mises", "compressive_strain")))
"""SED for the static term, another quantity for the dynamic one."""

SHOWN = (PAPER, *(Drivers(quantity, quantity) for quantity in QUANTITIES[3:]), EXTENDED)
"""What a reproduction compares: the other energies differ from the stored one by hardly a percent."""

SHOWN_QUANTITIES = (STORED_ENERGY, *QUANTITIES[3:])
"""What it needs to read for that."""


def receptor_traces(
    responses: Sequence[SkinResponse], quantities: Sequence[str] = QUANTITIES
) -> dict[str, SedTraces]:
    """Read quantities at the one receptor, one column per shift of the bar.

    Parameters
    ----------
    responses : sequence of SkinResponse
        One per shift.
    quantities : sequence of str, optional
        Names of `QUANTITIES`.

    Returns
    -------
    dict of str to SedTraces
        Each quantity in the place of SED.
    """
    return {name: single_unit.receptor_traces(list(responses), name) for name in quantities}


def traces_of(traces: Mapping[str, SedTraces], drivers: Drivers) -> SedTraces:
    """Traces for an afferent whose two terms follow these quantities.

    Parameters
    ----------
    traces : mapping of str to SedTraces
        Each quantity in the place of SED, all at the same times.
    drivers : Drivers
        What each term follows.

    Returns
    -------
    SedTraces
        With the static quantity in the place of SED.
    """
    static, dynamic = traces[drivers.static], traces[drivers.dynamic]
    if drivers.static == drivers.dynamic:
        return static
    if drivers.dynamic == STORED_ENERGY:
        raise InputError("drivers must name a quantity other than SED for a dynamic term of its own.")
    return single_unit.following(static, dynamic, drivers.dynamic)


def drive_of(traces: Mapping[str, SedTraces], drivers: Drivers) -> Drive:
    """Drive of an afferent whose two terms follow these quantities; parameters as in `traces_of`."""
    return drive(traces_of(traces, drivers))


def result(
    traces: Mapping[str, SedTraces],
    recordings: RateRecordings,
    generator: np.random.Generator,
    candidates: Sequence[Drivers] = SHOWN,
    method: Method | None = None,
    with_response_surface: bool = False,
) -> dict[str, Any]:
    """Fit every candidate in the same way, ready for the report.

    Parameters
    ----------
    traces : mapping of str to SedTraces
        From `receptor_traces`, SED among them.
    recordings : RateRecordings
        Observed dynamic and static rates, one per column of the traces.
    generator : numpy.random.Generator
        Draws the bootstrap.
    candidates : sequence of Drivers, optional
        What the two terms follow; the paper's first, with which the others are compared.
    method : Method, optional
        For the relative numbers; `quick_method` by default.
    with_response_surface : bool, optional
        Fit by the paper's method as well.

    Returns
    -------
    dict
        `shift_mm`, observed rates and `candidates`: per candidate its drivers, `fit` (see `row`),
        `response_surface` if asked for, the four identifiable numbers and rates.
    """
    method = method or quick_method()
    reference = drive_of(traces, PAPER)
    judged: dict[str, list[Judged]] = {"fit": [], "response_surface": []}
    rows: list[dict[str, Any]] = []
    for drivers in candidates:
        driven = drive_of(traces, drivers)
        starts, model = scaled_starts(driven, reference), AfferentModel.of_drive(driven)
        fits = {"fit": judge(RateProblem(relative_model(model, starts[0]), recordings), method)}
        if with_response_surface:
            fits["response_surface"] = judge(RateProblem(model, recordings), response_surface(starts))
        for key, one in fits.items():
            judged[key].append(one)
        best = fits["fit"]
        four = identifiable(six_of_relative(best.fit.parameters, starts[0]))
        rows.append(
            {
                "static": drivers.static,
                "dynamic": drivers.dynamic,
                **{key: row(one, judged[key][0], recordings, generator) for key, one in fits.items()},
                "parameters": dict(zip(IDENTIFIABLE_NAMES, four.tolist(), strict=True)),
                **{f"{phase}_rate_hz": best.predicted_hz[n] for n, phase in enumerate(PHASES)},
                **{f"left_out_{phase}_rate_hz": best.left_out_hz[n] for n, phase in enumerate(PHASES)},
            }
        )
    return {
        "method": method.name,
        "shift_mm": [float(name) for name in recordings.stimuli],
        **{f"observed_{phase}_rate_hz": getattr(recordings, f"{phase}_rate_hz") for phase in PHASES},
        "candidates": rows,
    }
