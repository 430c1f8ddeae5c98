"""The paper's protocol several times: every observer of Figures 7 and 8, at both positions.

A session is the whole protocol with its own noise. The paper reports one session. Several sessions give the
Monte-Carlo error of a verdict. Within a session all observers of one position share the same noise, so that
differences between them are not due to chance.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from fingerpad.core.checks import FloatArray, whole
from fingerpad.core.errors import InputError
from fingerpad.core.signals import HitRates
from fingerpad.data import psychophysics
from fingerpad.psychophysics.discrimination import (
    Experiment,
    checked_responses,
    discriminate_euclidean,
    hit_rates_of_sums,
)
from fingerpad.psychophysics.encoding import check_neighbours
from fingerpad.psychophysics.noisy_responses import noisy_gradient_sums, session_trials

SESSIONS = 5
"""Sessions of a study. The first is drawn; all of them give the Monte-Carlo error."""

SWEPT_NOISE = tuple(round(0.015 + 0.01 * step, 3) for step in range(8))
"""Noise sigma_1 that is tried, over the paper's range."""

FEW = 10
"""Noise matrices, and hit rates, of the paper's smaller experiments."""

AGAIN = 20
"""Repetitions of the judgements of one session, which show how stable their mean is."""

CRITERION_SIGMAS = psychophysics.DECISION_CRITERION_SIGMA.value

_PAPER = Experiment()
_FIRST_SESSION = 1
"""Session 0 of a seed belongs to the fit of the noise."""


@dataclass(frozen=True)
class Measured:
    """One response measure of the population at one position of the spheres."""

    responses: FloatArray
    """The standard in the first row, (n_spheres, n_receptors). [any unit]"""
    neighbours: np.ndarray
    """Pairs that the Gradient Sum goes over, (n_pairs, 2)."""

    def __post_init__(self) -> None:
        responses = checked_responses(self.responses)
        neighbours = check_neighbours(self.neighbours, responses.shape[1])
        if not len(neighbours):
            raise InputError("Measured needs neighbours that respond to every sphere: there are none.")
        object.__setattr__(self, "responses", responses)
        object.__setattr__(self, "neighbours", neighbours)


@dataclass(frozen=True)
class Observers:
    """Hit rates of every observer, session by session."""

    mean: dict[str, FloatArray]
    spread: dict[str, FloatArray]
    """mu_3 and sigma_3, by the name of the observer. [0-1]"""
    unsteadiness: dict[int, FloatArray]
    """Standard deviation of mu_3 when the judgements of the static Gradient Sum are repeated, by the number
    of hit rates behind it. [0-1]
    """


def observe(
    measures: Mapping[str, Sequence[Measured]], noise_sigma: float, seed: int, sessions: int = SESSIONS
) -> Observers:
    """Simulate the judgements of every observer at every position in several sessions."""
    whole("sessions", sessions, 2)
    n_positions = len(measures["static"])
    judged = [
        _judge(
            {name: each[position] for name, each in measures.items()},
            noise_sigma,
            seed,
            _FIRST_SESSION + session * n_positions + position,
        )
        for session in range(sessions)
        for position in range(n_positions)
    ]
    shape = (sessions, n_positions, -1)
    return Observers(
        {name: np.reshape([rates[name].hit_rate for rates, _ in judged], shape) for name in judged[0][0]},
        {name: np.reshape([rates[name].hit_rate_sd for rates, _ in judged], shape) for name in judged[0][0]},
        {count: np.reshape([moved[count] for _, moved in judged], shape[:2]) for count in judged[0][1]},
    )


def _judge(
    measures: Mapping[str, Measured], noise_sigma: float, seed: int, session: int
) -> tuple[dict[str, HitRates], dict[int, float]]:
    """Hit rates of every observer at one position in one session, and how unstable their means are."""
    static, pairs = measures["static"].responses, measures["static"].neighbours

    def sums(
        responses: FloatArray, pairs: np.ndarray, sigma: FloatArray | float, plan: Experiment
    ) -> FloatArray:
        distributions, presentations = plan.sums_per_sphere
        trials = session_trials(session, responses.shape[-2], distributions)
        return noisy_gradient_sums(responses, pairs, sigma, seed, trials, presentations)

    rates = {
        name: hit_rates_of_sums(
            sums(one.responses, one.neighbours, noise_sigma, _PAPER), seed, session=session
        )
        for name, one in measures.items()
        if name != "static"
    }
    named = {"static": noise_sigma} | {f"sigma_{sigma:g}": sigma for sigma in SWEPT_NOISE}
    by_level = sums(np.array([static] * len(named)), pairs, np.array(list(named.values())), _PAPER)
    by_name = dict(zip(named, by_level, strict=True))
    rates |= {name: hit_rates_of_sums(one, seed, session=session) for name, one in by_name.items()}
    # The first of many presentations, or hit rates, are those of a smaller experiment.
    rates["ten_matrices"] = hit_rates_of_sums(by_name["static"][:, :, :FEW], seed, session=session)
    rates["ten_hit_rates"] = hit_rates_of_sums(by_name["static"], seed, Experiment(hit_rates=FEW), session)
    plans = [Experiment(criterion_sigma=sigma) for sigma in CRITERION_SIGMAS]
    many = sums(static, pairs, noise_sigma, plans[0])
    for plan in plans:
        rates[f"criterion_{plan.criterion_sigma:g}"] = hit_rates_of_sums(many, seed, plan, session)
    rates["euclidean"] = discriminate_euclidean(static, noise_sigma, seed, session=session)
    unsteady = {
        count: _unsteadiness(by_name["static"], count, seed, session) for count in (FEW, _PAPER.hit_rates)
    }
    return rates, unsteady


def _unsteadiness(sums: FloatArray, hit_rates: int, seed: int, session: int) -> float:
    """Return how much the mean of so many hit rates varies (1 sd) between picks of the same sums."""
    plan = Experiment(hit_rates=hit_rates)
    means = [
        # Session numbers far beyond those of the study: no other step uses their random numbers.
        hit_rates_of_sums(sums, seed, plan, session * 1000 + 1_000_000 + again).hit_rate
        for again in range(AGAIN)
    ]
    return float(np.sqrt(np.var(means, axis=0, ddof=1).mean()))
