"""The efficiency of each code, relative to the ideal observer of the same responses."""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np

from fingerpad.core.checks import FloatArray
from fingerpad.core.errors import InputError
from fingerpad.core.results import Number, result_class
from fingerpad.core.units import MS_PER_S
from fingerpad.data import protocol
from fingerpad.experiments.conditions import RECEPTOR_X_MM, Conditions
from fingerpad.experiments.gerling2014 import sphere_discrimination
from fingerpad.experiments.manifest import Manifest
from fingerpad.experiments.runner import Runner
from fingerpad.neuron.population import Population
from fingerpad.psychophysics import (
    PoissonResponses,
    Presentation,
    ResponseModel,
    Statistic,
    efficiency,
    multiplied_responses,
    present,
)
from fingerpad.psychophysics.encoding import RESPONSE_MEASURES, distance, gradient_sum, neighbour_pairs
from studies.fitted_bars import fit_bars

PAIR_PER_M = (287.0, 316.0)
"""Two spheres near the threshold of people, at which efficiency is measured. [1/m]"""

TRIALS = 4000
"""Presentations of each sphere to the observers whose efficiency is measured."""

SESSION, REFERENCE_SESSION = 11, 12
"""Sessions of the random numbers; other studies have others."""


@result_class
class CodeEfficiency:
    """Efficiency of a code for one measure and kind of noise.

    Parameters
    ----------
    code, measure, noise : str
        Which.
    receptors : int
        Receptors that take part.
    proportion_correct, ideal_proportion_correct : float
        Of the code and of the ideal observer. [0-1]
    d_prime, d_prime_error, ideal_d_prime, ideal_d_prime_error : float
        Sensitivities and standard errors; inf where no trial is wrong.
    efficiency, efficiency_error : float
        Squared ratio of the sensitivities; NaN where the ideal observer is always right, or only guesses.
    """

    code: str
    measure: str
    noise: str
    receptors: int
    proportion_correct: float
    d_prime: Number
    d_prime_error: Number
    ideal_proportion_correct: float
    ideal_d_prime: Number
    ideal_d_prime_error: Number
    efficiency: Number
    efficiency_error: Number


@result_class
class CodeEfficiencyStudy:
    """Result of `python -m studies code-efficiency`.

    Parameters
    ----------
    efficiency : tuple of CodeEfficiency
        A row per code, measure and kind of noise.
    manifest : Manifest
        What ran.
    """

    efficiency: tuple[CodeEfficiency, ...]
    manifest: Manifest


def run(runner: Runner, conditions: Conditions) -> CodeEfficiencyStudy:
    """Press the bar and the paper's spheres, and measure the codes of a population of the fitted afferent.

    Parameters
    ----------
    runner : Runner
        Where indentations are stored.
    conditions : Conditions
        Finger, tissues, accuracy and seed.

    Returns
    -------
    CodeEfficiencyStudy
    """
    fitted = fit_bars(
        runner, conditions, {"spheres": sphere_discrimination.discrimination_touches(conditions)}
    )
    spheres = fitted.others["spheres"]
    with runner.stage("efficiency", 1) as advance:
        noise_sigma = sphere_discrimination.discriminate_spheres(
            spheres, fitted.afferent, conditions.seed
        ).noise_sigma
        population = Population.grid(centre_mm=(RECEPTOR_X_MM, 0.0), afferent=fitted.afferent)
        answers = [population.respond(spheres[0.0, curvature]) for curvature in PAIR_PER_M]
        tables = {
            name: np.array([read(answer) for answer in answers]) for name, read in RESPONSE_MEASURES.items()
        }
        neighbours = neighbour_pairs(population.positions_mm, population.pitch_mm)
        found = code_efficiencies(np.array(PAIR_PER_M), tables, neighbours, noise_sigma, conditions.seed)
        advance()
    return CodeEfficiencyStudy(efficiency=found, manifest=runner.manifest(conditions))


def code_efficiencies(
    curvature_per_m: FloatArray,
    tables: Mapping[str, FloatArray],
    neighbours: np.ndarray,
    noise_sigma: float,
    seed: int,
) -> tuple[CodeEfficiency, ...]:
    """Measure codes against the ideal observer of the same responses, on two spheres near people's threshold.

    Parameters
    ----------
    curvature_per_m : array (n_spheres,)
        Increasing, both spheres of `PAIR_PER_M` among them. [1/m]
    tables : mapping of str to array (n_spheres, n_receptors)
        Static and dynamic rates, and latencies. [spikes/s or ms]
    neighbours : int array (n_pairs, 2)
        Of the population.
    noise_sigma : float
        Standard deviation of the multiplicative noise.
    seed : int
        Of the random numbers.

    Returns
    -------
    tuple of CodeEfficiency
        One row per code, measure and kind of noise. A receptor that is silent under one of the spheres has no
        noise that multiplies, and would tell them apart for certain: it is left out, for all observers.
    """
    rows = [int(np.flatnonzero(curvature_per_m == curvature)[0]) for curvature in PAIR_PER_M]
    found: list[CodeEfficiency] = []
    for measure, table in tables.items():
        standard, comparison = table[rows]
        # A latency of NaN, as of a silent receptor, is not above 0 either.
        heard = (standard > 0.0) & (comparison > 0.0)
        # No rate is a rate; no latency is none, and has no difference to others.
        pairs = neighbours[heard[neighbours].all(axis=1)] if measure == "latency" else neighbours
        if heard.any() and len(pairs):
            models = [multiplied_responses(rates[heard], noise_sigma) for rates in (standard, comparison)]
            found += _observed(measure, "multiplied", (models[0], models[1]), heard, pairs, seed)
    window_ms = protocol.STATIC_WINDOW.value
    seconds = (window_ms[1] - window_ms[0]) / MS_PER_S
    counts = [PoissonResponses(tables["static"][row] * seconds) for row in rows]
    everyone = np.ones(tables["static"].shape[1], dtype=bool)
    return (*found, *_observed("static", "Poisson", (counts[0], counts[1]), everyone, neighbours, seed))


def _observed(
    measure: str,
    noise: str,
    models: tuple[ResponseModel, ResponseModel],
    heard: np.ndarray,
    neighbours: np.ndarray,
    seed: int,
) -> list[CodeEfficiency]:
    """Measure both codes on responses with one kind of noise."""
    standard, comparison = models
    shown = present(standard, comparison, seed, TRIALS, SESSION)
    # The standard again, which Euclidean Distance compares every look with.
    reference = present(standard, standard, seed, TRIALS, REFERENCE_SESSION).standard
    codes: dict[str, Statistic] = {
        "Gradient Sum": lambda responses: gradient_sum(_placed(responses, heard), neighbours),
        "Euclidean Distance": lambda responses: distance(responses, reference),
    }
    return [
        _judged(code, measure, noise, int(heard.sum()), shown, statistic) for code, statistic in codes.items()
    ]


def _placed(responses: FloatArray, heard: np.ndarray) -> FloatArray:
    """Responses (n_trials, n_receptors) of all receptors, 0 for those that are left out."""
    everyone = np.zeros((len(responses), heard.size))
    everyone[:, heard] = responses
    return everyone


def _judged(
    code: str, measure: str, noise: str, receptors: int, shown: Presentation, statistic: Statistic
) -> CodeEfficiency:
    """Compare a code with the ideal observer; no efficiency where that one never fails, or only guesses."""
    judged, ideal = shown.of(statistic), shown.ideal()
    try:
        share, error = efficiency(judged, ideal)
    except InputError:
        share, error = math.nan, math.nan
    return CodeEfficiency(
        code=code,
        measure=measure,
        noise=noise,
        receptors=receptors,
        proportion_correct=judged.proportion_correct,
        d_prime=judged.d_prime,
        d_prime_error=judged.d_prime_error,
        ideal_proportion_correct=ideal.proportion_correct,
        ideal_d_prime=ideal.d_prime,
        ideal_d_prime_error=ideal.d_prime_error,
        efficiency=share,
        efficiency_error=error,
    )
