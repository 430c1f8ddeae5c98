"""Level 3: can a person tell two spheres apart? (paper, 2.2.3, 3.3, Figures 6-8)."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from fingerpad.afferent import Afferent
from fingerpad.checks import FloatArray
from fingerpad.discrimination import Experiment, discriminate_euclidean, discriminate_gradient_sum
from fingerpad.encoding import gradient_sum, neighbour_pairs
from fingerpad.indenters import Sphere
from fingerpad.noise_fit import expected_hit_rates, fit_noise_sigma
from fingerpad.parameters import protocol, psychophysics
from fingerpad.population import Population
from fingerpad.random_streams import Purpose, normals
from fingerpad.sampling import SkinResponse
from fingerpad.signals import HitRates, ResponseMap
from fingerpad.studies.conditions import RECEPTOR_X_MM, Conditions, Touch

CURVATURES = psychophysics.SPHERE_CURVATURES.value
POSITIONS_MM = protocol.SPHERE_POSITIONS.value
NOISE_DRAWS = 4000
"""Common random presentations behind the fit of the noise, which they leave uncertain by one percent."""

PATIENCE_MS = protocol.RAMP.value
"""How long the observer waits for first spikes. [ms]"""

Measure = Callable[[ResponseMap], FloatArray]
MEASURES: dict[str, Measure] = {
    "static": lambda response: response.static_rate_hz,
    "dynamic": lambda response: response.dynamic_rate_hz,
    "latency": lambda response: _waited(response.first_spike_latency_ms),
}


def touches(conditions: Conditions) -> dict[tuple[float, float], Touch]:
    """Seven spheres at two positions along the finger; keys are position and curvature.

    They press along the skin's normal, so that a sphere at 0.0 mm is centred on the population.
    """
    return {
        (position, curvature): conditions.touch(
            Sphere(curvature),
            RECEPTOR_X_MM + position,
            conditions.sphere_grading(),
            tilt_deg=conditions.skin_tilt_deg,
        )
        for position in POSITIONS_MM
        for curvature in CURVATURES
    }


def result(
    responses: dict[tuple[float, float], SkinResponse], afferent: Afferent, seed: int
) -> dict[str, Any]:
    """Hit rates of both strategies and all measures, at the noise that fits Goodwin's two points best."""
    population = Population.grid(afferent=afferent, centre_mm=(RECEPTOR_X_MM, 0.0))
    neighbours = neighbour_pairs(population.positions_mm, population.pitch_mm)
    answers = {key: population.respond(skin) for key, skin in responses.items()}

    def table(measure: str, position: float) -> FloatArray:
        return np.array([MEASURES[measure](answers[position, curvature]) for curvature in CURVATURES])

    goodwin = [CURVATURES.index(curvature) - 1 for curvature in psychophysics.GOODWIN_CURVATURES.value]
    draws = normals(seed, 1, len(population.positions_mm), Purpose.RESPONSE, NOISE_DRAWS)[0].T
    static = table("static", POSITIONS_MM[0])
    noise = fit_noise_sigma(lambda sigma: expected_hit_rates(static, neighbours, sigma, draws)[goodwin])

    def gradient(
        measure: str, sigma: float = noise.noise_sigma, experiment: Experiment | None = None
    ) -> dict[str, Any]:
        return _at_both_positions(
            lambda position, session: discriminate_gradient_sum(
                table(measure, position), neighbours, sigma, seed, experiment, session=session
            )
        )

    variants = {f"sigma_{sigma:g}": gradient("static", sigma) for sigma in _shown_noise()}
    variants["ten_matrices"] = gradient("static", experiment=Experiment(presentations=10))
    for sigma in psychophysics.DECISION_CRITERION_SIGMA.value:
        variants[f"criterion_{sigma:g}"] = gradient("static", experiment=Experiment(criterion_sigma=sigma))
    return {
        "seed": seed,
        "curvature_per_m": CURVATURES,
        "noise_sigma": noise.noise_sigma,
        "noise_fit_error": noise.root_mean_square_error,
        "noise_sigma_paper": psychophysics.NOISE_SIGMA.value,
        "goodwin": {
            "curvature_per_m": psychophysics.GOODWIN_CURVATURES.value,
            "hit_rate": psychophysics.GOODWIN_HIT_RATES.value,
        },
        "gradient_sums": {
            measure: [gradient_sum(table(measure, position), neighbours) for position in POSITIONS_MM]
            for measure in MEASURES
        },
        "gradient_sum": {measure: gradient(measure) for measure in MEASURES},
        "euclidean": {
            "static": _at_both_positions(
                lambda position, session: discriminate_euclidean(
                    table("static", position), noise.noise_sigma, seed, session=session
                )
            )
        },
        "variants": variants,
    }


def _waited(latency_ms: FloatArray) -> FloatArray:
    """Latencies of an observer who waits until the ramp ends: a later first spike, or none, counts as that.

    The rule has no jump: a receptor that falls silent says the same before and after
    (docs/decisions/silent-receptors.md).
    """
    return np.fmin(latency_ms, PATIENCE_MS)


def _shown_noise() -> list[float]:
    """Noise of Figure 7: the paper's best and those on either side of it."""
    return sorted({psychophysics.NOISE_SIGMA.value, *psychophysics.NOISE_SIGMA_SHOWN.value})


def _at_both_positions(discriminate: Callable[[float, int], HitRates]) -> dict[str, FloatArray]:
    """Hit rates at both positions, each in a session of its own."""
    first, shifted = (
        discriminate(position, session) for session, position in enumerate(POSITIONS_MM, start=1)
    )
    return {
        "hit_rate": first.hit_rate,
        "hit_rate_sd": first.hit_rate_sd,
        "hit_rate_shifted": shifted.hit_rate,
        "hit_rate_shifted_sd": shifted.hit_rate_sd,
    }
