"""A search for one SAI afferent of the set `human`: some recordings decide, others are predicted.

Fitted: rates under the bar at 36 shifts (Phillips & Johnson 1981) and areas of receptive fields at five
depths (Vega-Bermudez & Johnson 1999). Six numbers of the afferent are free. Predicted: when the fastest
spikes come, the decline of the rate in the first second of a hold, and the index of Eq. 11, edge against flat
face. `python -m studies sai-search` presses six times and searches for a quarter of an hour.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np
from scipy.optimize import differential_evolution, minimize

from fingerpad.core.checked import result_class
from fingerpad.core.values import FloatArray, Vector
from fingerpad.data import afferents as published
from fingerpad.data import bar_firing_rates, protocol
from fingerpad.experiments.conditions import RECEPTOR_X_MM, Conditions
from fingerpad.experiments.receptive_field import PROBE, probing, within_field
from fingerpad.experiments.runner import Manifest, Runner
from fingerpad.geometry.bodies import Bar
from fingerpad.geometry.grading import Grading
from fingerpad.inference.fitting.methods import fractional_sum_of_squares, interleaved_folds
from fingerpad.neuron.afferent import Afferent
from fingerpad.neuron.population import Population
from fingerpad.neuron.spikes import modulation_index
from fingerpad.report.tables import number
from fingerpad.skin.sampling import SkinResponse
from studies.pages import table

BOUNDS: dict[str, tuple[float, float]] = {
    "dynamic_gain": (1e-5, 1e-2),
    "static_gain": (1e-8, 1e-5),
    "time_constant_ms": (15.0, 500.0),
    "intercept_ma": (-4e-6, 2e-7),
    "adapting_share": (0.0, 0.5),
    "reach_mm": (0.1, 1.3),
}
"""Ranges of the free numbers; gains and time constant are searched by their logarithms."""

LOGARITHMIC = ("dynamic_gain", "static_gain", "time_constant_ms")
LARGEST_RESTING_SHARE = 0.8  # Of the threshold, by the intercept alone: the afferent is silent at rest.
WEIGHT_OF_AREAS = 0.25  # Of the mean factor by which areas are missed, against FSS.
GENERATIONS, SIZE, POLISHING = 15, 8, 120

SITE_MARGIN_MM = 0.3
"""Fine zone of the one bar beyond its outermost shifted site. [mm]"""

RAYS, RADII_MM = 8, np.arange(0.0, 3.01, 0.1)
ANGLES = 2.0 * np.pi * np.arange(RAYS) / RAYS
FAST_MS, EARLY_MS, LATE_MS = (30.0, 50.0), (50.0, 150.0), (600.0, 950.0)


@result_class
class SaiSearch:
    """The afferent that was found, how it fits, and what it predicts."""

    parameters: dict[str, float]  #: The free numbers.
    fss: float
    fss_out_of_sample: float  #: FSS under the bar, of all shifts and as the mean of six folds. [1]
    areas_mm2: Vector  #: Areas of receptive fields at `FIELD_DEPTHS`, (5,). [mm²]
    fast_in_window: int
    firing: (
        int  #: Shifts with their fastest spikes 30 to 50 ms after the onset, of those that fire in the ramp.
    )
    decline: float  #: Decline of the rate from 50 to 150 ms until 600 to 950 ms. [1]
    edge_index: float  #: Eq. 11 of the largest rate and of the smallest below the flat face of the bar. [1]
    manifest: Manifest


class Recordings:
    """Presses of a bar and of a probe, and how afferents answer them."""

    def __init__(self, skins: Mapping[Any, SkinResponse], conditions: Conditions):
        self.skins, self.observed = skins, bar_firing_rates()
        along = conditions.along_skin
        shifts = RECEPTOR_X_MM + along * self.observed.shift_mm
        self.shifts_mm = np.column_stack([shifts, np.zeros(shifts.size)])
        radii, angles = np.meshgrid(RADII_MM, ANGLES)
        x = RECEPTOR_X_MM + along * radii * np.cos(angles)
        self.places_mm = np.column_stack([x.ravel(), (radii * np.sin(angles)).ravel()])

    def fss(self, afferent: Afferent, chosen: FloatArray | slice = slice(None)) -> float:
        """FSS of some shifts of the bar, with the paper's weights."""
        response = Population(self.shifts_mm, 1.0, afferent).respond(self.skins["bar"])
        dynamic, static = (
            fractional_sum_of_squares(observed[chosen], predicted[chosen])
            for observed, predicted in (
                (self.observed.dynamic_rate_hz, response.dynamic_rate_hz),
                (self.observed.static_rate_hz, response.static_rate_hz),
            )
        )
        return 0.25 * dynamic + 0.75 * static

    def areas_mm2(self, afferent: Afferent) -> FloatArray:
        """Areas within which the probe elicits a share of the spikes at the middle, from eight rays."""
        population = Population(self.places_mm, 1.0, afferent)
        areas = []
        for depth_mm in published.FIELD_DEPTHS.value:
            counts = population.respond(self.skins[depth_mm]).spikes.counts.reshape(RAYS, -1)
            within = within_field(counts)
            last = np.where(within.any(axis=1), within.shape[1] - np.argmax(within[:, ::-1], axis=1), 0)
            radius = np.maximum(last - 0.5, 0.0) * (RADII_MM[1] - RADII_MM[0])
            areas.append(float(np.mean(np.pi * radius**2)))
        return np.array(areas)

    def missed(self, afferent: Afferent, chosen: FloatArray | slice = slice(None)) -> float:
        """Return the lack of FSS and, with its weight, the mean logarithm by which areas are missed."""
        areas = np.maximum(self.areas_mm2(afferent), 0.05)
        factors = np.abs(np.log(areas / published.SAI_FIELD_AREAS_BY_DEPTH.value))
        return 1.0 - self.fss(afferent, chosen) + WEIGHT_OF_AREAS * float(np.clip(factors, 0.0, 2.0).mean())


def wide_bar_grading(conditions: Conditions) -> Grading:
    """Mesh of the single-unit study, fine over all shifted sites and not only about the receptor."""
    farthest = max(abs(shift) for shift in protocol.BAR_SHIFTS.value)
    return replace(conditions.bar_grading(), half_length_mm=farthest + SITE_MARGIN_MM)


def touches(conditions: Conditions) -> dict[Any, Any]:
    """Bar, read at shifted sites, and the probe at each depth."""
    bar = conditions.touch(
        Bar(), RECEPTOR_X_MM, wide_bar_grading(conditions), tilt_deg=conditions.skin_tilt_deg
    )
    probes = {
        depth_mm: conditions.probe_touch(PROBE, probing(depth_mm))
        for depth_mm in published.FIELD_DEPTHS.value
    }
    return {"bar": bar, **probes}


def afferent_at(point: FloatArray, start: Afferent) -> Afferent:
    """Return the afferent of a point of the search, (6,)."""
    given = {
        name: float(np.exp(value) if name in LOGARITHMIC else value)
        for name, value in zip(BOUNDS, point, strict=True)
    }
    return replace(start, **given)  # type: ignore[arg-type]


def search(
    recordings: Recordings, start: Afferent, seed: int | None, chosen: FloatArray | slice = slice(None)
) -> Afferent:
    """Find numbers by differential evolution and a simplex; without a seed by a simplex from the start."""
    bounds = [tuple(np.log(ends)) if name in LOGARITHMIC else ends for name, ends in BOUNDS.items()]
    point = np.array([getattr(start, name) for name in BOUNDS])
    point = np.where([name in LOGARITHMIC for name in BOUNDS], np.log(np.maximum(point, 1e-12)), point)

    def missed(point: FloatArray) -> float:
        if any(not low <= value <= high for value, (low, high) in zip(point, bounds, strict=True)):
            return np.inf
        afferent = afferent_at(point, start)
        if afferent.intercept_ma > LARGEST_RESTING_SHARE * afferent.rheobase_ma:
            return np.inf
        return recordings.missed(afferent, chosen)

    if seed is not None:
        more = {"popsize": SIZE, "maxiter": GENERATIONS, "polish": False, "x0": point}
        point = differential_evolution(missed, bounds, seed=seed, **more).x
    options = {"maxfev": POLISHING, "xatol": 1e-3, "fatol": 1e-4}
    return afferent_at(minimize(missed, point, method="Nelder-Mead", options=options).x, start)


def run(runner: Runner, conditions: Conditions) -> SaiSearch:
    """Press what is missing, search with all shifts and with each fold left out, and predict."""
    named = touches(conditions)
    recordings = Recordings(runner.responses({"sai": named})["sai"], conditions)
    start = Afferent()
    found = search(recordings, start, conditions.seed)
    folds = interleaved_folds(recordings.observed.shift_mm.size)
    tested = [
        recordings.fss(search(recordings, found, None, folds != fold), folds == fold)
        for fold in range(folds.max() + 1)
    ]
    response = Population(recordings.shifts_mm, 1.0, found).respond(recordings.skins["bar"])
    early: list[float] = []
    late: list[float] = []
    in_window: list[bool] = []
    for train in response.spikes:
        ramp = train[train < protocol.RAMP.value + 10.0]
        if ramp.size > 2:
            fastest = ramp[1:][np.argmin(np.diff(ramp))]
            in_window.append(FAST_MS[0] <= fastest <= FAST_MS[1])
        for counts, (start_ms, end_ms) in ((early, EARLY_MS), (late, LATE_MS)):
            spikes = np.count_nonzero((train >= start_ms) & (train < end_ms))
            counts.append(spikes / (end_ms - start_ms))
    flat_mm = protocol.BAR_WIDTH.value / 2 - protocol.BAR_FILLET.value
    static_hz = response.static_rate_hz
    flat_hz = static_hz[np.abs(recordings.observed.shift_mm) < flat_mm].min()
    return SaiSearch(
        parameters={name: float(getattr(found, name)) for name in BOUNDS},
        fss=recordings.fss(found),
        fss_out_of_sample=float(np.mean(tested)),
        areas_mm2=recordings.areas_mm2(found),
        fast_in_window=sum(in_window),
        firing=len(in_window),
        decline=1.0 - sum(late) / sum(early),
        edge_index=float(modulation_index(static_hz.max(), flat_hz)),
        manifest=runner.manifest(conditions),
    )


def blocks(result: SaiSearch) -> dict[str, str]:
    """Table of what was fitted and of what is predicted."""
    wanted = published.SAI_FIELD_AREAS_BY_DEPTH.value
    areas = zip(published.FIELD_DEPTHS.value, result.areas_mm2, wanted, strict=True)
    rows = [
        ("FSS in sample", "fitted", number(result.fss), ""),
        ("FSS out of sample", "predicted", number(result.fss_out_of_sample), "0.90"),
        *(
            (f"area at {1000 * depth_mm:.0f} µm [mm²]", "fitted", number(found), number(seen))
            for depth_mm, found, seen in areas
        ),
        (
            "fastest spikes 30 to 50 ms after the onset",
            "predicted",
            f"{result.fast_in_window} of {result.firing}",
            "all",
        ),
        ("decline in the first second", "predicted", number(result.decline), "0.15 to 0.40"),
        ("index of Eq. 11, edge against flat face", "predicted", number(result.edge_index), "0.71"),
    ]
    return {"sai": table(("what", "role", "`human`", "recorded"), rows)}
