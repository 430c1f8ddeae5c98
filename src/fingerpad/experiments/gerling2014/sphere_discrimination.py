"""Level 3: can a person tell two spheres apart? (paper, 2.2.3, 3.3, Figures 6-8)."""

from __future__ import annotations

from typing import Any

import numpy as np

from fingerpad.core.checks import FloatArray
from fingerpad.core.random_streams import Purpose, normals
from fingerpad.data import protocol, psychophysics
from fingerpad.experiments.conditions import RECEPTOR_X_MM, Conditions, Touch
from fingerpad.experiments.gerling2014 import goodwin
from fingerpad.experiments.gerling2014.discrepancy import first_spikes, fitted_noise, reasons
from fingerpad.experiments.gerling2014.percept_sessions import SESSIONS, Measured, Observers, observe
from fingerpad.experiments.gerling2014.percept_statistics import statistics
from fingerpad.neuron.afferent import Afferent
from fingerpad.neuron.population import Population
from fingerpad.psychophysics.encoding import (
    RESPONSE_MEASURES,
    answering_neighbours,
    gradient_sum,
    neighbour_pairs,
)
from fingerpad.psychophysics.noise_fit import NOISE_DRAWS
from fingerpad.skin.sampling import SkinResponse

CURVATURES = psychophysics.SPHERE_CURVATURES.value
POSITIONS_MM = protocol.SPHERE_POSITIONS.value


def touches(conditions: Conditions) -> dict[tuple[float, float], Touch]:
    """Seven spheres at two positions along the finger; keys are position and curvature.

    They press along the skin's normal, so that a sphere at 0.0 mm is centred on the population.
    """
    return {
        (position, curvature): conditions.sphere_touch(curvature, position)
        for position in POSITIONS_MM
        for curvature in CURVATURES
    }


def result(
    responses: dict[tuple[float, float], SkinResponse],
    afferent: Afferent,
    seed: int,
    sessions: int = SESSIONS,
) -> dict[str, Any]:
    """Hit rates of both strategies and all measures, at the noise that fits Goodwin's two points best.

    Parameters
    ----------
    responses : dict of SkinResponse
        By position and curvature, from `touches`.
    afferent : Afferent
        What every receptor is.
    seed : int
        Of all noise.
    sessions : int, optional
        How often the protocol is repeated; the first session is drawn, all of them tell the Monte-Carlo
        errors.

    Returns
    -------
    dict
        The noise; hit rates of the first session by strategy, measure and variant; what is known of people;
        `statistics` behind each of the paper's statements; and `reasons`, why ours differ.
    """
    population = Population.grid(afferent=afferent, centre_mm=(RECEPTOR_X_MM, 0.0))
    neighbours = neighbour_pairs(population.positions_mm, population.pitch_mm)
    answers = {key: population.respond(skin) for key, skin in responses.items()}
    tables = {
        name: [
            np.array([read(answers[position, curvature]) for curvature in CURVATURES])
            for position in POSITIONS_MM
        ]
        for name, read in RESPONSE_MEASURES.items()
    }
    measures = {
        name: _measured(name, both, neighbours)
        for name, both in tables.items()
        if name == "static" or _answers(name, both, neighbours)
    }
    draws = normals(seed, 1, len(population.positions_mm), Purpose.RESPONSE, NOISE_DRAWS)[0].T
    noise = fitted_noise(measures["static"], CURVATURES, draws)
    observers = observe(measures, noise.noise_sigma, seed, sessions)
    drawn = {name: _first_session(observers, name) for name in observers.mean}
    return {
        "seed": seed,
        "sessions": sessions,
        "curvature_per_m": CURVATURES,
        "noise_sigma": noise.noise_sigma,
        "noise_fit_error": noise.root_mean_square_error,
        "noise_sigma_paper": psychophysics.NOISE_SIGMA.value,
        "goodwin": goodwin.observed(CURVATURES[1:]),
        "gradient_sums": {
            name: [gradient_sum(one.responses, one.neighbours) for one in both]
            for name, both in measures.items()
        },
        "gradient_sum": {name: drawn[name] for name in measures},
        "euclidean": {"static": drawn["euclidean"]},
        "variants": {
            name: rates for name, rates in drawn.items() if name not in measures and name != "euclidean"
        },
        "silent": [name for name in RESPONSE_MEASURES if name not in measures],
        "statistics": statistics(observers, CURVATURES, tuple(measures)),
        "reasons": reasons(
            measures,
            tables["latency"],
            population.positions_mm,
            population.pitch_mm,
            CURVATURES,
            noise.noise_sigma,
            draws,
            seed,
        ),
    }


def _answers(name: str, tables: list[FloatArray], neighbours: np.ndarray) -> bool:
    """Whether a measure is more than silence: otherwise it is left out, for zeros give no hit rate."""
    if name == "latency":
        return all(len(answering_neighbours(table, neighbours)) > 0 for table in tables)
    return all(table.any() for table in tables)


def _measured(name: str, tables: list[FloatArray], neighbours: np.ndarray) -> list[Measured]:
    """Give a measure the pairs of receptors that its Gradient Sum goes over, position by position."""
    if name == "latency":
        return [first_spikes(table, neighbours) for table in tables]
    return [Measured(table, neighbours) for table in tables]


def _first_session(observers: Observers, name: str) -> dict[str, FloatArray]:
    """Hit rates of one observer as the paper reports them, one session at both positions."""
    (first, shifted), (spread, spread_shifted) = observers.mean[name][0], observers.spread[name][0]
    return {
        "hit_rate": first,
        "hit_rate_sd": spread,
        "hit_rate_shifted": shifted,
        "hit_rate_shifted_sd": spread_shifted,
    }
