"""Beyond the paper: curvature thresholds from standard to standard.

    JND(s) = c - s,    where the comparison c is discriminated from the standard s in 75 % of trials
    Weber fraction = JND / s

A few spheres are pressed. Between them the rates of every receptor are interpolated in the logarithm of the
curvature (monotone cubic), so that any sphere can be a standard or a comparison.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

import numpy as np

from fingerpad.core.checked import result_class
from fingerpad.core.errors import ConvergenceError
from fingerpad.core.values import FloatArray, Number, Vector
from fingerpad.data import psychophysics
from fingerpad.experiments.conditions import CURVATURES, Conditions, Touch
from fingerpad.experiments.gerling2014.percept import (
    CENTRE_MM,
    GOODWIN_CURVATURES,
    draws_of,
    expected_of_measure,
)
from fingerpad.neuron.afferent import Afferent
from fingerpad.neuron.population import Population
from fingerpad.psychophysics import (
    d_prime_of_proportion,
    fit_psychometric,
    gaussian_information,
    posterior,
    yes_no,
)
from fingerpad.psychophysics.encoding import Measured, Noise, neighbour_pairs
from fingerpad.psychophysics.ideal_observer import SMALLEST_SPREAD
from fingerpad.psychophysics.observer import fit_noise_sigma
from fingerpad.psychophysics.sensitivity import InterpolatedObserver
from fingerpad.skin.sampling import SkinResponse

STANDARDS_PER_M = (144.0, 200.0, 287.0, 400.0)
PRESSED_PER_M = (144.0, 165.0, 190.0, 218.0, 250.0, 400.0, 445.0, 540.0)
"""Beside the paper's spheres: from the least standard to beyond the threshold of the greatest."""

LAYOUTS = {"paper": (3, 6), "square": (6, 6)}
"""Receptors along the finger and across: the paper's 18, and as many along as across, which cover the larger
contact of a flatter sphere on all sides."""

STEPS = (0.03, 0.06, 0.09, 0.12, 0.16, 0.21)  # Comparisons: shares by which they are more curved.
PROPORTION = 0.75
JUDGEMENTS = int(psychophysics.GOODWIN_TRIALS.value)  # Per comparison of an experiment.


@result_class
class CurvatureThreshold:
    """Threshold at one standard."""

    standard_per_m: float
    jnd_per_m: float  #: The standard and the just noticeable difference of the model. [1/m]
    weber_fraction: float
    ideal_weber_fraction: float  #: Threshold over standard; of the ideal observer by Fisher's information.
    fitted_weber_fraction: Number
    fitted_interval: tuple[Number, Number]  #: By a Weibull function through its counts, with 95 % interval.


@result_class
class MissingThreshold:
    """A standard without a threshold."""

    standard_per_m: float | None  #: None stands for all standards. [1/m]
    why_not: str


@result_class
class PopulationThresholds:
    """Thresholds of one population."""

    layout: str
    rows: int
    columns: int  #: Receptors along the finger and across.
    noise_sigma: Number  #: Standard deviation of the multiplicative noise; NaN if none fits people.
    standards: tuple[CurvatureThreshold, ...]  #: Standards with a threshold.
    without_threshold: tuple[MissingThreshold, ...]


@result_class
class CurvatureThresholds:
    """Thresholds of the static Gradient Sum at several standards."""

    seed: int  #: Of the random numbers.
    proportion: float  #: Hit rate at threshold. [0-1]
    judgements: int  #: Per comparison of an experiment.
    pressed_per_m: Vector  #: Pressed spheres, (n_spheres,). [1/m]
    populations: tuple[PopulationThresholds, ...]  #: By layout, the paper's first.


def threshold_touches(
    conditions: Conditions, curvatures_per_m: Sequence[float] = PRESSED_PER_M
) -> dict[float, Touch]:
    """Spheres pressed like the paper's own at 0.0 mm; keys are curvatures. [1/m]"""
    return {curvature: conditions.sphere_touch(curvature) for curvature in curvatures_per_m}


def curvature_thresholds(
    responses: Mapping[float, SkinResponse], afferent: Afferent, noise_sigma: float, seed: int
) -> CurvatureThresholds:
    """Thresholds of each layout: the paper's with a given noise, others with one that is fitted to people."""
    curvatures, populations = np.array(sorted(responses)), []
    for name, (rows, columns) in LAYOUTS.items():
        population = Population.grid(rows=rows, columns=columns, centre_mm=CENTRE_MM, afferent=afferent)
        neighbours = neighbour_pairs(population.positions_mm, population.pitch_mm)
        static = np.array([population.respond(responses[at]).static_rate_hz for at in curvatures.tolist()])
        draws = draws_of(population, seed)
        standards: list[CurvatureThreshold] = []
        missed: list[MissingThreshold] = []
        sigma = noise_sigma
        if name != "paper":
            table = static[np.searchsorted(curvatures, (CURVATURES[0], *GOODWIN_CURVATURES))]
            measured = Measured(table, neighbours, population.noise_offset_hz)
            try:
                sigma = fitted_noise(measured, draws)
            except ConvergenceError as error:
                sigma, missed = math.nan, [MissingThreshold(standard_per_m=None, why_not=str(error))]
        for standard in STANDARDS_PER_M if math.isfinite(sigma) else ():
            noise = Noise(sigma, population.noise_offset_hz)
            observer = InterpolatedObserver(curvatures, static, neighbours, noise, draws)
            try:
                standards.append(threshold_at(observer, standard))
            except ConvergenceError as error:
                missed.append(MissingThreshold(standard_per_m=standard, why_not=str(error)))
        populations.append(
            PopulationThresholds(
                layout=name,
                rows=rows,
                columns=columns,
                noise_sigma=sigma,
                standards=tuple(standards),
                without_threshold=tuple(missed),
            )
        )
    return CurvatureThresholds(
        seed=seed,
        proportion=PROPORTION,
        judgements=JUDGEMENTS,
        pressed_per_m=curvatures,
        populations=tuple(populations),
    )


def fitted_noise(measured: Measured, draws: FloatArray) -> float:
    """Noise for which the hit rates at Goodwin's points are closest to people's."""
    return fit_noise_sigma(lambda sigma: expected_of_measure([measured], draws, sigma)[0]).noise_sigma


def threshold_at(observer: InterpolatedObserver, standard_per_m: float) -> CurvatureThreshold:
    """Find the just noticeable difference at a standard, and the result of an experiment there."""
    jnd_per_m, farthest = observer.difference(standard_per_m, PROPORTION), observer.highest
    if math.isnan(jnd_per_m):
        raise ConvergenceError(
            f"No sphere up to {farthest:g} /m is discriminated from {standard_per_m:g} /m in "
            f"{PROPORTION:.0%} of trials: use spheres of larger curvature, or lower the noise."
        )
    steps = np.array([step for step in STEPS if standard_per_m * (1.0 + step) <= farthest])
    hit_rate = np.array([observer.hit_rate(standard_per_m, standard_per_m * (1.0 + step)) for step in steps])
    counts = np.round(JUDGEMENTS * hit_rate)
    fit = fit_psychometric(steps, counts, np.full(steps.size, JUDGEMENTS), sigmoid="weibull", lapse=0.0)
    rates, slopes = observer.responses(standard_per_m), observer.slopes(standard_per_m)
    information = gaussian_information(rates, slopes, observer.noise, SMALLEST_SPREAD)
    ideal_jnd_per_m = d_prime_of_proportion(PROPORTION, yes_no) / np.sqrt(information)
    return CurvatureThreshold(
        standard_per_m=standard_per_m,
        jnd_per_m=jnd_per_m,
        weber_fraction=jnd_per_m / standard_per_m,
        ideal_weber_fraction=float(ideal_jnd_per_m) / standard_per_m,
        fitted_weber_fraction=fit.threshold(PROPORTION),
        fitted_interval=posterior(fit).threshold_interval(PROPORTION),
    )
