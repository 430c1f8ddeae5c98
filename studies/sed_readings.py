"""SED "at the epidermal-dermal border": four readings of it on the stored presses of both sets.

The paper's model is fitted to the rates under the bar by its own method with each reading, and the noise to
people's two hit rates (docs/decisions/depth-of-sampling.md).
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace

import numpy as np

from fingerpad.core.checks import FloatArray
from fingerpad.core.errors import ConvergenceError
from fingerpad.core.random_streams import Purpose, normals
from fingerpad.core.results import Number, result_class
from fingerpad.core.signals import STORED_ENERGY
from fingerpad.data import psychophysics
from fingerpad.data.neuron import PAPER_INITIAL
from fingerpad.experiments.conditions import RECEPTOR_X_MM, Conditions
from fingerpad.experiments.gerling2014 import single_unit, sphere_discrimination
from fingerpad.experiments.gerling2014.discrepancy import expected_of_measure
from fingerpad.experiments.gerling2014.discrimination_statistics import (
    Measured,
    fit_noise_to_goodwin,
    goodwin_columns,
)
from fingerpad.experiments.manifest import Manifest
from fingerpad.experiments.runner import Runner
from fingerpad.neuron.afferent import Afferent
from fingerpad.neuron.population import Population
from fingerpad.psychophysics.encoding import neighbour_pairs
from fingerpad.psychophysics.noise_fit import NOISE_DRAWS
from fingerpad.report.formatting import fixed
from fingerpad.report.parts import Chapter, Page, Row, Table
from fingerpad.skin.sampling import SkinResponse

SETS = ("paper", "human")


def _at_nodes(values: FloatArray) -> FloatArray:
    """Mean of the elements about each node, then of the nodes of each element: (n_times, along, around)."""
    for axis in (1, 2):
        width = [(1, 1) if each == axis else (0, 0) for each in range(3)]
        padded = np.pad(values, width, mode="edge")
        before, here, after = (
            np.take(padded, np.arange(start, start + values.shape[axis]), axis=axis) for start in range(3)
        )
        values = 0.25 * before + 0.5 * here + 0.25 * after
    return values


READINGS: Mapping[str, Callable[[FloatArray, FloatArray], FloatArray]] = {
    "element above, living epidermis (used)": lambda above, below: above,
    "element below, dermis": lambda above, below: below,
    "mean of both": lambda above, below: 0.5 * (above + below),
    "average at the node": lambda above, below: _at_nodes(0.5 * (above + below)),
}
"""From SED of the elements above and below the border (n_times, n_along, n_around) to what is read. [kPa]"""


@result_class
class Reading:
    """The paper's model with one reading of SED, in one set of tissues."""

    tissues: str
    reading: str
    largest_sed_kpa: Number
    """At the receptor under the bar."""
    fss_in_sample: Number
    fss_out_of_sample: Number
    dynamic_flat_hz: Number
    dynamic_max_hz: Number
    static_difference_hz: Number
    noise_sigma: Number
    """Noise for 58 and 95 % with the static Gradient Sum; NaN where no noise meets the points."""
    hit_rates: tuple[Number, ...]
    """With that noise at 296 and 365 /m, spheres at 0.0 and at 0.2 mm."""


@result_class
class ReadingsStudy:
    """Readings of both sets, and what ran."""

    readings: tuple[Reading, ...]
    manifest: Manifest


def read_as(skin: SkinResponse, reading: str) -> SkinResponse:
    """Return a touch whose stored energy density in the living epidermis is that of a reading."""
    sheet, sed = skin.mesh.living_epidermis, skin.sed_kpa
    # Elements of one place on the skin are numbered in a row, from the skin downwards.
    read = READINGS[reading](sed[:, sheet], sed[:, sheet + 1])
    changed = sed.copy()
    changed[:, sheet.ravel()] = read.reshape(len(sed), -1)
    return skin.with_fields(sed_kpa=changed)


def run(runner: Runner, conditions: Conditions) -> ReadingsStudy:
    """Fit the paper's model with every reading to the presses of both sets.

    Parameters
    ----------
    runner : Runner
        Where indentations are stored: the folder of a reproduction has them all.
    conditions : Conditions
        Finger, resolution and seed.
    """
    found = []
    for tissues in SETS:
        of_set = replace(conditions, tissues=tissues)
        responses = runner.responses(
            {
                "bars": dict(enumerate(single_unit.bar_touches(of_set))),
                "spheres": sphere_discrimination.discrimination_touches(of_set),
            }
        )
        bars, spheres = responses["bars"], responses["spheres"]
        with runner.stage(f"{tissues}: readings", len(READINGS)) as advance:
            for reading in READINGS:
                found.append(_reading(tissues, reading, bars, spheres, conditions.seed))
                advance()
    return ReadingsStudy(readings=tuple(found), manifest=runner.manifest(conditions))


def _reading(
    tissues: str,
    reading: str,
    bars: Mapping[int, SkinResponse],
    spheres: Mapping[tuple[float, float], SkinResponse],
    seed: int,
) -> Reading:
    sed = single_unit.receptor_sed([read_as(skin, reading) for skin in bars.values()])
    problem = single_unit.rate_problem(sed, PAPER_INITIAL.value)
    best, folds = single_unit.fit(problem)
    afferent = Afferent.from_parameters(
        best.parameters,
        dynamic_quantity=STORED_ENERGY,
        static_quantity=STORED_ENERGY,
        initial_mv=PAPER_INITIAL.value,
    )
    unit = single_unit.single_unit_result(problem, best, folds, afferent, "response surface")
    sigma, rates = _noise(afferent, {key: read_as(skin, reading) for key, skin in spheres.items()}, seed)
    dynamic, static = unit.modulation.dynamic.ours, unit.modulation.static.ours
    return Reading(
        tissues=tissues,
        reading=reading,
        largest_sed_kpa=float(sed.sed_kpa.max()),
        fss_in_sample=unit.fss_in_sample,
        fss_out_of_sample=unit.fss_out_of_sample,
        dynamic_flat_hz=dynamic.minimum_hz,
        dynamic_max_hz=dynamic.maximum_hz,
        static_difference_hz=static.difference_hz,
        noise_sigma=sigma,
        hit_rates=rates,
    )


def _noise(
    afferent: Afferent, spheres: Mapping[tuple[float, float], SkinResponse], seed: int
) -> tuple[float, tuple[float, ...]]:
    """Noise that fits people's two points with the static Gradient Sum, and the hit rates with it."""
    population = Population.grid(afferent=afferent, centre_mm=(RECEPTOR_X_MM, 0.0))
    pairs = neighbour_pairs(population.positions_mm, population.pitch_mm)
    curvatures, positions = sphere_discrimination.CURVATURES, sphere_discrimination.POSITIONS_MM
    static = [
        Measured(
            np.array([population.respond(spheres[place, each]).static_rate_hz for each in curvatures]), pairs
        )
        for place in positions
    ]
    draws = normals(seed, 1, len(population.positions_mm), Purpose.RESPONSE, NOISE_DRAWS)[0].T
    try:
        fitted = fit_noise_to_goodwin(
            lambda sigma: expected_of_measure(static, sigma, draws), curvatures, len(positions)
        )
    except ConvergenceError:
        return float("nan"), ()
    rates = expected_of_measure(static, fitted.noise_sigma, draws)[:, goodwin_columns(curvatures)]
    return fitted.noise_sigma, tuple(rates.T.ravel().tolist())


def readings_table(readings: tuple[Reading, ...]) -> Table:
    """Return the table of all readings, the set `paper` first."""
    return Table(
        "SED at the epidermal-dermal border, by reading",
        ("set", "reading", "largest SED [kPa]", "FSS in sample", "FSS out of sample", "dynamic, flat face",
         "dynamic, largest", "static difference", "noise for 58 and 95 %", "hit rates"),
        [
            Row(
                (
                    f"`{each.tissues}`", each.reading, fixed(each.largest_sed_kpa, 2),
                    fixed(each.fss_in_sample, 2), fixed(each.fss_out_of_sample, 2),
                    fixed(each.dynamic_flat_hz, 0), fixed(each.dynamic_max_hz, 0),
                    fixed(each.static_difference_hz, 0), fixed(each.noise_sigma, 3),
                    ", ".join(fixed(rate, 2) for rate in each.hit_rates),
                )
            )
            for each in readings
        ],
        "SED drives both terms in both sets, fitted by response surfaces from both start points; rates in "
        f"spikes/s; the paper's noise is {psychophysics.NOISE_SIGMA.value:g}; hit rates at 296 and 365 /m, "
        "spheres at 0.0 and 0.2 mm each.",
    )  # fmt: skip


def readings_page(result: ReadingsStudy) -> Page:
    """Return the page of the study."""
    return Page(
        "Readings of the border",
        "Where SED is read at the epidermal-dermal border, on the presses of both sets.",
        [],
        [Chapter("", [readings_table(result.readings)])],
    )
