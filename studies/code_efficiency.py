"""The efficiency of each code, relative to the ideal observer of the same responses."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from fingerpad.core.checks import FloatArray
from fingerpad.core.results import Number, result_class
from fingerpad.core.units import MS_PER_S
from fingerpad.data import protocol
from fingerpad.experiments.conditions import RECEPTOR_X_MM, Conditions
from fingerpad.experiments.gerling2014 import sphere_discrimination
from fingerpad.experiments.manifest import Manifest
from fingerpad.experiments.runner import Runner
from fingerpad.neuron.population import Population
from fingerpad.psychophysics.code_efficiency import (
    EFFICIENCY_TRIALS,
    SMALLEST_SPREAD,
    code_efficiency,
    code_statistic,
)
from fingerpad.psychophysics.encoding import RESPONSE_MEASURES, neighbour_pairs, taking_part
from fingerpad.psychophysics.ideal_observer import ResponseModel, multiplied_responses, present
from studies.fitted_bars import fit_bars
from studies.poisson_responses import PoissonResponses

PAIR_PER_M = (287.0, 316.0)
"""Two spheres near the threshold of people, at which efficiency is measured. [1/m]"""

SESSION = 11
"""Session of the random numbers; other studies have others."""

CODE_NAMES = {"gradient_sum": "Gradient Sum", "euclidean": "Euclidean Distance"}


@result_class
class EfficiencyRow:
    """Efficiency of a code for one measure and kind of noise.

    Parameters
    ----------
    code, measure, noise : str
        Which.
    receptors : int
        Receptors that respond to either sphere.
    proportion_correct, ideal_proportion_correct : float
        Of the code and of the ideal observer. [0-1]
    d_prime, d_prime_error, ideal_d_prime, ideal_d_prime_error : float
        Sensitivities and standard errors; inf where no trial is wrong.
    efficiency, efficiency_error : float
        As in `fingerpad.psychophysics.CodeEfficiency`.
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
    efficiency : tuple of EfficiencyRow
        A row per code, measure and kind of noise.
    manifest : Manifest
        What ran.
    """

    efficiency: tuple[EfficiencyRow, ...]
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
) -> tuple[EfficiencyRow, ...]:
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
    tuple of EfficiencyRow
        One row per code, measure and kind of noise.
    """
    rows = [int(np.flatnonzero(curvature_per_m == curvature)[0]) for curvature in PAIR_PER_M]
    found: list[EfficiencyRow] = []
    for measure, table in tables.items():
        pair, pairs = taking_part(table[rows], neighbours)
        if pair.any() and len(pairs):
            models = [multiplied_responses(responses, noise_sigma, SMALLEST_SPREAD) for responses in pair]
            responding = int(pair.any(axis=0).sum())
            found += _compared(measure, "multiplied", models, responding, pairs, seed)
    window_ms = protocol.STATIC_WINDOW.value
    seconds = (window_ms[1] - window_ms[0]) / MS_PER_S
    static = tables["static"][rows]
    counts = [PoissonResponses(responses * seconds) for responses in static]
    return (*found, *_compared("static", "Poisson", counts, static.shape[1], neighbours, seed))


def _compared(
    measure: str,
    noise: str,
    models: Sequence[ResponseModel],
    receptors: int,
    neighbours: np.ndarray,
    seed: int,
) -> list[EfficiencyRow]:
    """Compare both codes with the ideal observer, for one kind of noise."""
    standard, comparison = models
    shown = present(standard, comparison, seed, EFFICIENCY_TRIALS, SESSION)
    found = []
    for code, name in CODE_NAMES.items():
        of_code = code_efficiency(shown, code_statistic(code, standard, neighbours, seed, SESSION))
        found.append(
            EfficiencyRow(
                code=name,
                measure=measure,
                noise=noise,
                receptors=receptors,
                proportion_correct=of_code.code.proportion_correct,
                d_prime=of_code.code.d_prime,
                d_prime_error=of_code.code.d_prime_error,
                ideal_proportion_correct=of_code.ideal.proportion_correct,
                ideal_d_prime=of_code.ideal.d_prime,
                ideal_d_prime_error=of_code.ideal.d_prime_error,
                efficiency=of_code.efficiency,
                efficiency_error=of_code.efficiency_error,
            )
        )
    return found
