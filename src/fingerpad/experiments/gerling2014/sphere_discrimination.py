"""Level 3: how often two spheres are discriminated (paper, 2.2.3, 3.3, Figures 6-8)."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from fingerpad.core.checked import result_class
from fingerpad.core.random_streams import Purpose, normals
from fingerpad.core.signals import Traces
from fingerpad.core.values import Matrix, Vector
from fingerpad.data import protocol, psychophysics
from fingerpad.experiments.conditions import RECEPTOR_X_MM, Conditions, Touch
from fingerpad.experiments.gerling2014.discrepancy import (
    DiscrepancyAnalysis,
    discrepancy_analysis,
    expected_of_measure,
)
from fingerpad.experiments.gerling2014.discrimination_statistics import (
    SESSIONS,
    DiscriminationStatistics,
    GoodwinHitRates,
    Measured,
    discrimination_statistics,
    fit_noise_to_goodwin,
    goodwin_hit_rates_at,
    observe,
)
from fingerpad.inference.afferent_fit import ToRatesAndHitRates
from fingerpad.inference.problem import SphereHitRates
from fingerpad.inference.rate_model import AfferentModel
from fingerpad.neuron.afferent import Afferent
from fingerpad.neuron.population import Population
from fingerpad.psychophysics.encoding import RESPONSE_MEASURES, gradient_sum, neighbour_pairs, taking_part
from fingerpad.psychophysics.observer import NOISE_DRAWS
from fingerpad.skin.sampling import SkinResponse

FIT_SEED, FIT_DRAWS = 0, 1000
"""Seed of a fit, and number of random presentations behind its hit rates. It is not the seed of the run:
another seed of the observers keeps the afferent."""

CURVATURES = psychophysics.SPHERE_CURVATURES.value
POSITIONS_MM = protocol.SPHERE_POSITIONS.value

FITTED_SPHERES = tuple(
    (position, curvature)
    for position in POSITIONS_MM
    for curvature in (CURVATURES[0], *psychophysics.GOODWIN_CURVATURES.value)
)
"""Position and curvature of the spheres that people discriminated, the standard first. [mm, 1/m]"""


@result_class
class ObserverHitRates:
    """Hit rates of one observer in one session, as the paper reports them."""

    hit_rate: Vector
    hit_rate_sd: Vector
    hit_rate_shifted: Vector  # Means with the spheres at 0.0 and at 0.2 mm, (n_comparisons,). [0-1]
    hit_rate_shifted_sd: Vector  # Standard deviations, (n_comparisons,). [0-1]


@result_class
class SphereDiscrimination:
    """Hit rates of all observers at the noise that fits Goodwin's two points best."""

    seed: int
    sessions: int  # Of all noise; repetitions of the protocol.
    curvature_per_m: Vector  # The spheres, the standard first, (7,). [1/m]
    noise_sigma: float
    noise_fit_error: float
    noise_sigma_paper: float  # Fitted noise, root mean square error of the fit [0-1], and the paper's noise.
    goodwin: GoodwinHitRates  # Of people.
    gradient_sums: dict[str, Matrix]  # Without noise, by measure, (n_positions, 7). [spikes/s or ms]
    gradient_sum: dict[str, ObserverHitRates]
    euclidean: dict[str, ObserverHitRates]
    variants: dict[str, ObserverHitRates]  # First session; variants of the static Gradient Sum by name.
    silent: tuple[str, ...]  # Measures that are left out because the population stays silent.
    statistics: DiscriminationStatistics  # Behind the paper's statements.
    reasons: DiscrepancyAnalysis  # Why the numbers differ from the paper's.


def discrimination_touches(conditions: Conditions) -> dict[tuple[float, float], Touch]:
    """Seven spheres at two positions along the finger; keys are position and curvature.

    They press along the skin's normal, so that a sphere at 0.0 mm is centred on the population.
    """
    return {
        (position, curvature): conditions.sphere_touch(curvature, position)
        for position in POSITIONS_MM
        for curvature in CURVATURES
    }


def to_rates_and_hit_rates(
    responses: dict[tuple[float, float], SkinResponse], quantity: str
) -> ToRatesAndHitRates:
    """Return the method that fits an afferent to its rates and to Goodwin's two points at once.

    The two points are those of people at 296 and 365 /m, at both positions, by the Gradient Sum and by the
    Euclidean Distance of static rates, with the paper's noise.
    """
    sites = Population.grid(centre_mm=(RECEPTOR_X_MM, 0.0)).positions_mm
    return fit_to_people(
        [
            responses[position, curvature].sed(sites, quantity, quantity)
            for position, curvature in FITTED_SPHERES
        ]
    )


def fit_to_people(traces: Sequence[Traces]) -> ToRatesAndHitRates:
    """Return the method of `to_rates_and_hit_rates` for given drives of the afferents."""
    population = Population.grid(centre_mm=(RECEPTOR_X_MM, 0.0))
    n_receptors = len(population.positions_mm)
    hit_rates = SphereHitRates(
        AfferentModel.of_traces(traces),
        n_positions=len(POSITIONS_MM),
        n_receptors=n_receptors,
        neighbours=neighbour_pairs(population.positions_mm, population.pitch_mm),
        noise_sigma=psychophysics.NOISE_SIGMA.value,
        standard_normals=normals(FIT_SEED, 1, n_receptors, Purpose.RESPONSE, FIT_DRAWS)[0].T,
    )
    n_codes = 2
    observed = np.tile(psychophysics.GOODWIN_HIT_RATES.value, n_codes * len(POSITIONS_MM))
    return ToRatesAndHitRates(hit_rates, observed, FIT_SEED)


def discriminate_spheres(
    responses: dict[tuple[float, float], SkinResponse],
    afferent: Afferent,
    seed: int,
    sessions: int = SESSIONS,
) -> SphereDiscrimination:
    """Hit rates of both codes and all measures, at the noise that fits Goodwin's two points best."""
    population = Population.grid(afferent=afferent, centre_mm=(RECEPTOR_X_MM, 0.0))
    neighbours = neighbour_pairs(population.positions_mm, population.pitch_mm)
    maps = {key: population.respond(skin) for key, skin in responses.items()}
    tables = {
        name: [
            np.array([read(maps[position, curvature]) for curvature in CURVATURES])
            for position in POSITIONS_MM
        ]
        for name, read in RESPONSE_MEASURES.items()
    }
    encoded = {name: [taking_part(table, neighbours) for table in both] for name, both in tables.items()}
    # A measure without responses has no hit rate and is left out.
    measures = {
        name: [Measured(*one) for one in both]
        for name, both in encoded.items()
        if name == "static" or all(len(pairs) and table.any() for table, pairs in both)
    }
    draws = normals(seed, 1, len(population.positions_mm), Purpose.RESPONSE, NOISE_DRAWS)[0].T
    noise = fit_noise_to_goodwin(
        lambda sigma: expected_of_measure(measures["static"], sigma, draws), CURVATURES, len(POSITIONS_MM)
    )
    observers = observe(measures, noise.noise_sigma, seed, sessions)
    drawn = {}
    for name in observers.mean:
        (rate, shifted), (spread, spread_shifted) = observers.mean[name][0], observers.spread[name][0]
        drawn[name] = ObserverHitRates(
            hit_rate=rate, hit_rate_sd=spread, hit_rate_shifted=shifted, hit_rate_shifted_sd=spread_shifted
        )
    codes = (*measures, "euclidean")
    return SphereDiscrimination(
        seed=seed,
        sessions=sessions,
        curvature_per_m=np.array(CURVATURES),
        noise_sigma=noise.noise_sigma,
        noise_fit_error=noise.root_mean_square_error,
        noise_sigma_paper=psychophysics.NOISE_SIGMA.value,
        goodwin=goodwin_hit_rates_at(CURVATURES[1:]),
        gradient_sums={
            name: np.array([gradient_sum(one.responses, one.neighbours) for one in both])
            for name, both in measures.items()
        },
        gradient_sum={name: drawn[name] for name in measures},
        euclidean={"static": drawn["euclidean"]},
        variants={name: rates for name, rates in drawn.items() if name not in codes},
        silent=tuple(name for name in RESPONSE_MEASURES if name not in measures),
        statistics=discrimination_statistics(observers, CURVATURES, tuple(measures)),
        reasons=discrepancy_analysis(
            measures,
            tables["latency"],
            population.positions_mm,
            population.pitch_mm,
            CURVATURES,
            noise.noise_sigma,
            draws,
            seed,
        ),
    )
