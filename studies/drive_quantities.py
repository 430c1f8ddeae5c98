"""Quantity in the skin that drives the afferent: the same fits, with each quantity in the place of SED.

The paper samples strain energy density (SED) and leaves open whether the end organ responds to a stress, a
strain or another quantity. Here each quantity of the skin half drives both terms of the current, I = beta +
k_d |Q'| + k_s Q, or the dynamic term alone, I = beta + k_d |Q'| + k_s U. All are fitted by the same methods
from start points with the same currents, on the same folds: only the quantity differs.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from fingerpad.core.checks import one_of
from fingerpad.core.errors import InputError
from fingerpad.core.results import Number, Vector, result_class
from fingerpad.core.signals import STORED_ENERGY, SedTraces
from fingerpad.experiments.gerling2014 import single_unit
from fingerpad.inference.fitting.methods import Method
from fingerpad.inference.identifiable import IDENTIFIABLE_NAMES, identifiable
from fingerpad.inference.rate_model import AfferentModel
from fingerpad.inference.rate_problem import RateProblem
from fingerpad.inference.recordings import RateRecordings
from fingerpad.inference.start_points import response_surface
from fingerpad.neuron.transduction import Drive, drive
from fingerpad.skin.sampling import SkinResponse
from studies.drive_fits import (
    DriveFit,
    Judged,
    drive_fit,
    judge,
    quick_method,
    relative_model,
    scaled_starts,
    six_of_relative,
)

QUANTITIES = (
    STORED_ENERGY,
    "instantaneous",
    "work",
    "von_mises",
    "compressive_stress",
    "compressive_strain",
)
"""Quantities of the skin half: three definitions of the energy density, two stresses and a strain."""


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

CANDIDATES = (*ALONE, *APART)
"""All that is compared."""


def quantity_traces(
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


@result_class
class DriveCandidate:
    """Fit of the afferent with one choice of quantities.

    Parameters
    ----------
    static, dynamic : str
        Quantities that the two terms of the current follow, see `QUANTITIES`.
    fit : DriveFit
        Fit of the four relative numbers.
    response_surface : DriveFit, optional
        Fit by the paper's method, where it was asked for.
    parameters : dict of str to float
        The four identifiable numbers.
    dynamic_rate_hz, static_rate_hz : array (n_shifts,)
        Rates by the fit to all shifts. [spikes/s]
    left_out_dynamic_rate_hz, left_out_static_rate_hz : array (n_shifts,)
        Rates under each shift by the fit that did not use it. [spikes/s]
    """

    static: str
    dynamic: str
    fit: DriveFit
    response_surface: DriveFit | None = None
    parameters: dict[str, Number]
    dynamic_rate_hz: Vector
    static_rate_hz: Vector
    left_out_dynamic_rate_hz: Vector
    left_out_static_rate_hz: Vector


@result_class
class DriveResult:
    """Fits with several choices of quantities.

    Parameters
    ----------
    method : str
        Method of the fits.
    shift_mm : array (n_shifts,)
        Shifts of the bar. [mm]
    observed_dynamic_rate_hz, observed_static_rate_hz : array (n_shifts,)
        Recorded rates. [spikes/s]
    candidates : tuple of DriveCandidate
        The first is the reference of the gains.
    """

    method: str
    shift_mm: Vector
    observed_dynamic_rate_hz: Vector
    observed_static_rate_hz: Vector
    candidates: tuple[DriveCandidate, ...]


def drive_result(
    traces: Mapping[str, SedTraces],
    recordings: RateRecordings,
    generator: np.random.Generator,
    candidates: Sequence[Drivers] = CANDIDATES,
    method: Method | None = None,
    with_response_surface: bool = False,
) -> DriveResult:
    """Fit every candidate in the same way.

    Parameters
    ----------
    traces : mapping of str to SedTraces
        From `quantity_traces`, SED among them.
    recordings : RateRecordings
        Observed dynamic and static rates, one per column of the traces.
    generator : numpy.random.Generator
        Draws the bootstrap.
    candidates : sequence of Drivers, optional
        What the two terms follow; the first is the reference of the gains.
    method : Method, optional
        For the relative numbers; `quick_method` by default.
    with_response_surface : bool, optional
        Fit by the paper's method as well.

    Returns
    -------
    DriveResult
    """
    method = method or quick_method()
    paper_drive = drive_of(traces, PAPER)
    reference: Judged | None = None
    surface_reference: Judged | None = None
    found: list[DriveCandidate] = []
    for drivers in candidates:
        driven = drive_of(traces, drivers)
        starts, model = scaled_starts(driven, paper_drive), AfferentModel.of_drive(driven)
        judged = judge(RateProblem(relative_model(model, starts[0]), recordings), method)
        reference = reference or judged
        fit = drive_fit(judged, reference, recordings, generator)
        surface: DriveFit | None = None
        if with_response_surface:
            by_surface = judge(RateProblem(model, recordings), response_surface(starts))
            surface_reference = surface_reference or by_surface
            surface = drive_fit(by_surface, surface_reference, recordings, generator)
        four = identifiable(six_of_relative(judged.fit.parameters, starts[0]))
        found.append(
            DriveCandidate(
                static=drivers.static,
                dynamic=drivers.dynamic,
                fit=fit,
                response_surface=surface,
                parameters=dict(zip(IDENTIFIABLE_NAMES, four.tolist(), strict=True)),
                dynamic_rate_hz=judged.predicted_hz[0],
                static_rate_hz=judged.predicted_hz[1],
                left_out_dynamic_rate_hz=judged.left_out_hz[0],
                left_out_static_rate_hz=judged.left_out_hz[1],
            )
        )
    assert recordings.dynamic_rate_hz is not None
    assert recordings.static_rate_hz is not None
    return DriveResult(
        method=method.name,
        shift_mm=np.array([float(name) for name in recordings.stimuli]),
        observed_dynamic_rate_hz=recordings.dynamic_rate_hz,
        observed_static_rate_hz=recordings.static_rate_hz,
        candidates=tuple(found),
    )
