"""One posterior of tissues, afferent and noise, given deflection, plate force, firing rates and hit rates.

Tissues are pressed at the points of a design. An emulator interpolates what the levels need; afferent and
observer are computed, not emulated. Arrays of parameters are (n_points, 11), in the order of `PARAMETERS`.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import emcee
import numpy as np
from scipy.linalg import solve_triangular
from scipy.special import logsumexp, ndtr, ndtri, xlog1py, xlogy
from scipy.stats import norm

from fingerpad.core.errors import ConvergenceError
from fingerpad.core.values import FloatArray
from fingerpad.data import bar_firing_rates, cylinder_deflection, psychophysics
from fingerpad.data import tissues as published
from fingerpad.experiments.gerling2014.skin import PLATE_DEPTHS_MM
from fingerpad.inference.fitting.posterior import Chains, LogDensity, sample
from fingerpad.inference.identifiable import LARGEST_RESTING_SHARE, identifiable
from fingerpad.inference.rate_posterior import CorrelatedResiduals
from fingerpad.neuron.afferent import Afferent
from studies.finger_levels import (
    Afferents,
    Outputs,
    bar_rates,
    deflection_distances_mm,
    gradient_hit_rates,
    largest_stress_kpa,
    plate_force_n,
    sphere_rates,
)
from studies.tissue_candidates import LEVELS
from studies.tissue_design import RANGES, shares_of, values_at
from studies.tissue_emulator import Emulator
from studies.tissue_search import plate_range_n

N_TISSUES = len(RANGES)
PARAMETERS = (
    *(one.name for one in RANGES),
    "modulus of the subcutis [kPa]",
    "potential at rest / threshold",
    "dynamic gain k_d/(C v) [1/kPa]",
    "static gain k_s/(C v) [1/(kPa ms)]",
    "time constant [ms]",
    "noise of the percept",
)
_SUBCUTIS, RESTING, _DYNAMIC, _STATIC, _TAU, _NOISE = range(N_TISSUES, len(PARAMETERS))
LOGARITHMIC = [_SUBCUTIS, _DYNAMIC, _STATIC, _TAU, _NOISE]
"""Numbers of the parameters with a log-normal prior."""

SUBJECTS = 4
"""Subjects of whose forces the lowest and the highest are known."""

DEFLECTION_SD_MM = 0.05
"""Scale of the prior of the residuals' deviation; its weight is that of one observation. [mm]"""

BETWEEN_SUBJECTS = tuple(np.geomspace(0.1, 1.2, 24).tolist())
"""Standard deviations of the logarithm of the force between subjects, equally probable. [1]"""


@dataclass(frozen=True)
class Prior:
    """Prior of what is not in `RANGES`; tissues are uniform there.

    The potential at rest is normal about 0 and stays below `LARGEST_RESTING_SHARE`. The others are
    log-normal: two thirds lie between the median divided and multiplied by the factor.
    """

    medians: FloatArray
    factors: FloatArray
    """Of the modulus [kPa], both gains [1/kPa, 1/(kPa ms)], tau [ms] and the noise, (5,)."""
    resting_share_sd: float = 1.0  #: Standard deviation of the potential at rest over the threshold. [1]

    @classmethod
    def about_human(cls) -> Prior:
        """Medians of the set `human` and of its afferent, and the paper's noise."""
        _, *afferent = identifiable(Afferent.for_tissues("human").parameters).tolist()
        medians = [published.HUMAN_SUBCUTIS_SHEAR.value, *afferent, psychophysics.NOISE_SIGMA.value]
        return cls(np.array(medians), np.array([3.0, 10.0, 10.0, 2.0, 2.0]))

    def log_density(self, values: FloatArray) -> FloatArray:
        """Log density of parameters, per logarithm of the log-normal ones; -inf outside."""
        shares, resting = shares_of(values[:, :N_TISSUES]), values[:, RESTING]
        scores = np.log(values[:, LOGARITHMIC] / self.medians) / np.log(self.factors)
        squares = np.square(scores).sum(axis=1) + np.square(resting / self.resting_share_sd)
        possible = ((shares >= 0.0) & (shares <= 1.0)).all(axis=1) & (resting <= LARGEST_RESTING_SHARE)
        return np.where(possible, -0.5 * squares, -np.inf)

    def draw(self, n_draws: int, random: np.random.Generator) -> FloatArray:
        """Draw parameters."""
        values = np.empty((n_draws, len(PARAMETERS)))
        values[:, :N_TISSUES] = values_at(random.uniform(size=(n_draws, N_TISSUES)))
        scores = random.normal(size=(n_draws, len(LOGARITHMIC)))
        values[:, LOGARITHMIC] = self.medians * self.factors**scores
        below = norm.cdf(LARGEST_RESTING_SHARE / self.resting_share_sd)
        values[:, RESTING] = self.resting_share_sd * norm.ppf(below * random.uniform(size=n_draws))
        return values


@dataclass(frozen=True)
class Observations:
    """What is observed on all levels."""

    deflection_mm: FloatArray  #: Under the cylinder, at `deflection_distances_mm`, (n_distances,). [mm]
    plate_force_n: FloatArray  #: Lowest and highest force of `SUBJECTS` subjects, (n_depths, 2). [N]
    dynamic_hz: FloatArray
    static_hz: FloatArray  #: Rates under the bar, (n_shifts,). [spikes/s]
    hits: FloatArray  #: Hits with the comparison spheres, in `trials` each, (2,).
    trials: float = psychophysics.GOODWIN_TRIALS.value

    @classmethod
    def published(cls) -> Observations:
        """Return those of people and of the paper's afferent."""
        observed, rates = cylinder_deflection(), bar_firing_rates()
        return cls(
            deflection_mm=observed.deflection_mm[~observed.is_artefact],
            plate_force_n=plate_range_n(),
            dynamic_hz=rates.dynamic_rate_hz,
            static_hz=rates.static_rate_hz,
            hits=psychophysics.GOODWIN_TRIALS.value * np.array(psychophysics.GOODWIN_HIT_RATES.value),
        )


@dataclass(frozen=True)
class Finger:
    """Predicts all levels from parameters, with an emulator of presses and the times of the drives [ms]."""

    emulator: Emulator
    times_ms: FloatArray

    def outputs(self, values: FloatArray) -> dict[str, FloatArray]:
        """Emulated outputs of presses."""
        return self.emulator.predict(shares_of(values[:, :N_TISSUES]))

    def predict(self, values: FloatArray, levels: Sequence[str] = LEVELS) -> Prediction:
        """Predict some levels."""
        return prediction(values, self.outputs(values), self.times_ms, levels)


@dataclass(frozen=True)
class Prediction:
    """Predicted observations; rates and hit rates that were not asked for are empty."""

    deflection_mm: FloatArray  #: Under the cylinder, (n_points, n_distances). [mm]
    plate_force_n: FloatArray
    """Of the finger of the parameters, the mean one between subjects, (n_points, n_depths). [N]"""
    bar_hz: FloatArray  #: Dynamic and static rates, (2, n_points, n_shifts). [spikes/s]
    sphere_hz: FloatArray
    """Static rates of the population, (n_points, n_positions, n_spheres, n_receptors). [spikes/s]"""
    hit_rates: FloatArray  #: Of the Gradient Sum, (n_points, n_positions, 2). [0-1]


_EMPTY = np.empty(0)


def prediction(
    values: FloatArray, outputs: Outputs, times_ms: FloatArray, levels: Sequence[str] = LEVELS
) -> Prediction:
    """Predict levels of parameters from the outputs of presses, pressed or emulated."""
    afferents = afferents_of(values, outputs)
    percept = "percept" in levels
    spheres = sphere_rates(afferents, times_ms, outputs) if percept else _EMPTY
    return Prediction(
        deflection_mm=outputs["deflection"],
        plate_force_n=plate_force_n(outputs, values[:, _SUBCUTIS]),
        bar_hz=bar_rates(afferents, times_ms, outputs) if "firing" in levels else _EMPTY,
        sphere_hz=spheres,
        hit_rates=gradient_hit_rates(spheres, values[:, _NOISE]) if percept else _EMPTY,
    )


def afferents_of(values: FloatArray, outputs: Outputs) -> Afferents:
    """Afferents of parameters, relative to the largest stress under the bar."""
    stress = largest_stress_kpa(outputs, values[:, _SUBCUTIS])
    return Afferents(
        resting_share=values[:, RESTING],
        dynamic_gain=values[:, _DYNAMIC] * stress,
        static_gain=values[:, _STATIC] * stress,
        time_constant_ms=values[:, _TAU],
    )


@dataclass(frozen=True)
class Likelihood:
    """Likelihood of every level, their residuals independent of each other."""

    observed: Observations

    @cached_property
    def _rates(self) -> CorrelatedResiduals:
        shifts = bar_firing_rates().shift_mm
        return CorrelatedResiduals(shifts.size, shifts)

    @cached_property
    def _profile(self) -> CorrelatedResiduals:
        distances = deflection_distances_mm()
        return CorrelatedResiduals(distances.size, distances, deviation=DEFLECTION_SD_MM)

    def of_levels(self, found: Prediction, levels: Sequence[str] = LEVELS) -> dict[str, FloatArray]:
        """Log likelihood (n_points,) of each of some levels, up to a constant."""
        return {level: getattr(self, f"_{level}")(found) for level in levels}

    def residual_draws(
        self, found: Prediction, random: np.random.Generator
    ) -> dict[str, tuple[FloatArray, FloatArray]]:
        """Draw deviation and correlation length of deflection, dynamic and static rates for every point."""
        dynamic, static = found.bar_hz
        return {
            "deflection": self._profile.draw(self.observed.deflection_mm - found.deflection_mm, random),
            "dynamic": self._rates.draw(self.observed.dynamic_hz - dynamic, random),
            "static": self._rates.draw(self.observed.static_hz - static, random),
        }

    def _deflection(self, found: Prediction) -> FloatArray:
        return self._profile.log_likelihood(self.observed.deflection_mm - found.deflection_mm)

    def _force(self, found: Prediction) -> FloatArray:
        return log_extremes(np.log(self.observed.plate_force_n), np.log(found.plate_force_n))

    def _firing(self, found: Prediction) -> FloatArray:
        dynamic, static = found.bar_hz
        return self._rates.log_likelihood(self.observed.dynamic_hz - dynamic) + self._rates.log_likelihood(
            self.observed.static_hz - static
        )

    def _percept(self, found: Prediction) -> FloatArray:
        hits, trials = self.observed.hits, self.observed.trials
        # People's spheres had no position of ours: the mean of both.
        rate = np.clip(found.hit_rates.mean(axis=1), 1e-9, 1.0 - 1e-9)
        return np.asarray((xlogy(hits, rate) + xlog1py(trials - hits, -rate)).sum(axis=1))


def log_extremes(
    extremes: FloatArray,
    centre: FloatArray,
    n_subjects: int = SUBJECTS,
    deviations: Sequence[float] = BETWEEN_SUBJECTS,
) -> FloatArray:
    """Log likelihood of the lowest and the highest of some normal numbers, their deviation integrated out.

    The joint density of both among n is n (n - 1) f(low) f(high) (F(high) - F(low))^(n - 2). Depths are
    independent and share the deviation, one of some that are equally probable.

    Extremes are (n_depths, 2), means of the distribution (n_points, n_depths), and the result (n_points,).

    Examples
    --------
    >>> inside, beside = log_extremes(np.array([[-0.4, 0.4]]), np.array([[0.0], [1.0]]))
    >>> bool(inside > beside)
    True
    """
    deviation = np.array(deviations)[:, np.newaxis, np.newaxis]
    low, high = ((extremes[:, end] - centre) / deviation for end in range(2))
    between = np.maximum(norm.cdf(high) - norm.cdf(low), np.finfo(float).tiny)
    joint = (
        np.log(n_subjects * (n_subjects - 1))
        + norm.logpdf(low)
        + norm.logpdf(high)
        + (n_subjects - 2) * np.log(between)
        - 2.0 * np.log(deviation)
    )
    return np.asarray(logsumexp(joint.sum(axis=2), axis=0) - np.log(len(deviations)))


# Coordinates in which the parameters correlate least


def to_coordinates(values: FloatArray, outputs: Outputs) -> FloatArray:
    """Transform parameters to the coordinates of the sampler.

    They are unbounded, and most are normal under the prior: normal scores of the tissues, the logarithm of
    the plate's force at the greater depth for the modulus, ln(1 - u) for the potential at rest u, and
    logarithms; gains are multiplied by the largest stress under the bar, which gives currents.
    """
    points = values.astype(np.float64)
    points[:, :N_TISSUES] = ndtri(shares_of(values[:, :N_TISSUES]))
    points[:, RESTING] = np.log(1.0 - values[:, RESTING])
    points[:, LOGARITHMIC] = np.log(values[:, LOGARITHMIC])
    stress = np.log(largest_stress_kpa(outputs, values[:, _SUBCUTIS]))
    points[:, [_DYNAMIC, _STATIC]] += stress[:, np.newaxis]
    points[:, _SUBCUTIS] = np.log(plate_force_n(outputs, values[:, _SUBCUTIS])[:, -1])
    return points


def tissue_shares(points: FloatArray) -> FloatArray:
    """Shares of `RANGES` (n_points, 5) at coordinates."""
    return np.asarray(ndtr(points[:, :N_TISSUES]))


def from_coordinates(points: FloatArray, outputs: Outputs) -> FloatArray:
    """Parameters of coordinates: the inverse of `to_coordinates`."""
    values = np.empty_like(points)
    values[:, :N_TISSUES] = values_at(tissue_shares(points))
    values[:, RESTING] = 1.0 - np.exp(points[:, RESTING])
    values[:, LOGARITHMIC] = np.exp(points[:, LOGARITHMIC])
    values[:, _SUBCUTIS] /= plate_force_n(outputs, np.ones(len(points)))[:, -1]
    values[:, [_DYNAMIC, _STATIC]] /= largest_stress_kpa(outputs, values[:, _SUBCUTIS])[:, np.newaxis]
    return values


def log_posterior(
    finger: Finger, likelihood: Likelihood, prior: Prior, levels: Sequence[str] = LEVELS
) -> LogDensity:
    """Log posterior density of rows of coordinates given some levels, up to a constant."""

    def log_density(points: FloatArray) -> FloatArray:
        outputs = finger.emulator.predict(tissue_shares(points))
        values = from_coordinates(points, outputs)
        # Tissues are uniform, so that their scores are normal. The logarithm of |du/d ln(1 - u)| is
        # ln(1 - u). Other coordinates are those of the prior, up to a shift that depends on the tissues.
        heights = (
            prior.log_density(values)
            - 0.5 * np.square(points[:, :N_TISSUES]).sum(axis=1)
            + points[:, RESTING]
        )
        possible = np.isfinite(heights)
        if possible.any():
            some = {name: rows[possible] for name, rows in outputs.items()}
            predicted = prediction(values[possible], some, finger.times_ms, levels)
            heights[possible] += sum(likelihood.of_levels(predicted, levels).values())
        return heights

    return log_density


@dataclass(frozen=True)
class Posterior:
    """Draws of all parameters: the chains in the coordinates, and the parameters (n_draws, 11)."""

    chains: Chains
    values: FloatArray

    def spread_out(self, n_draws: int) -> FloatArray:
        """Return some of the draws, evenly spaced along the chains."""
        return self.values[np.linspace(0, len(self.values) - 1, n_draws).round().astype(np.int64)]


@dataclass(frozen=True)
class Sampling:
    """Settings of the sampler; as of `fingerpad.inference.fitting.posterior.sample`."""

    n_walkers: int = 60
    n_steps: int = 100
    most_steps: int = 1600
    largest_r_hat: float = 1.03
    smallest_effective_size: float = 150.0
    n_ensembles: int = 4


def draw_posterior(
    finger: Finger, likelihood: Likelihood, prior: Prior, seed: int, settings: Sampling | None = None
) -> Posterior:
    """Sample the posterior given all levels."""
    density = log_posterior(finger, likelihood, prior)
    random = np.random.Generator(np.random.Philox([seed, 2]))
    first = prior.draw(N_TRIED, random)
    proposal = adapted(density, to_coordinates(first, finger.outputs(first)), random)
    chains = sample(
        density,
        proposal.centre,
        np.sqrt(np.diagonal(proposal.factor @ proposal.factor.T)),
        PARAMETERS,
        seed=seed,
        moves=[(proposal.move(), 0.7), (emcee.moves.DEMove(), 0.3)],
        **vars(settings or Sampling()),
    )
    flat = chains.flat
    return Posterior(chains, from_coordinates(flat, finger.emulator.predict(tissue_shares(flat))))


@dataclass(frozen=True)
class Proposal:
    """A multivariate Student distribution: points are proposed independently of the present one."""

    centre: FloatArray  #: Its centre, (n,).
    factor: FloatArray  #: Cholesky factor of its scale matrix, (n, n).
    freedom: float = 7.0  #: Degrees of freedom: tails wider than those of what is sampled.

    @classmethod
    def of(cls, centre: FloatArray, covariance: FloatArray) -> Proposal:
        """Proposal about a centre with a covariance, a small variance added."""
        floor = 1e-8 * np.trace(covariance) / centre.size
        return cls(centre, np.linalg.cholesky(covariance + floor * np.eye(centre.size)))

    def draw(self, n_draws: int, random: Any) -> FloatArray:
        """Draw points (n_draws, n)."""
        normal = random.normal(size=(n_draws, self.centre.size))
        stretch = np.sqrt(self.freedom / random.chisquare(self.freedom, size=n_draws))
        return self.centre + stretch[:, np.newaxis] * (normal @ self.factor.T)

    def log_density(self, points: FloatArray) -> FloatArray:
        """Log density (n_points,), up to a constant that all proposals share."""
        white = solve_triangular(self.factor, (points - self.centre).T, lower=True)
        power = 0.5 * (self.freedom + self.centre.size)
        tails = -power * np.log1p(np.square(white).sum(axis=0) / self.freedom)
        return np.asarray(tails - np.log(np.diagonal(self.factor)).sum())

    def move(self) -> Any:
        """Return the move of emcee that proposes from it."""

        def propose(points: FloatArray, random: Any) -> tuple[FloatArray, FloatArray]:
            new = self.draw(len(points), random)
            return new, self.log_density(points) - self.log_density(new)

        return emcee.moves.MHMove(propose)


N_TRIED, N_BEST, N_SEARCHES, N_WEIGHTINGS = 800, 80, 5, 8
"""Search for the proposal: draws per round; the best that give the next centre and covariance; rounds of this
kind; rounds in which all draws count by their weights."""

WIDENED = 1.5
"""Factor on the spread of the best draws, which are closer to each other than the density is wide."""


def adapted(density: LogDensity, points: FloatArray, random: np.random.Generator) -> Proposal:
    """Adapt a proposal to a density by rounds of draws, from first draws that are wider than the density.

    The first rounds keep the best draws. Then the draws of all further rounds are weighted by the density
    over the mixture of their proposals (Cornuet et al. 2012), and weights are truncated at the mean times the
    root of their number (Ionides 2008).

    Examples
    --------
    >>> random = np.random.default_rng(1)
    >>> def normal(points):
    ...     return -0.5 * np.square(points - 3.0).sum(axis=1)
    >>> found = adapted(normal, 5.0 * random.normal(size=(800, 2)), random)
    >>> found.centre.round(0).tolist(), np.diagonal(found.factor).round(0).tolist()
    ([3.0, 3.0], [1.0, 1.0])
    """
    heights = density(points)
    for _ in range(N_SEARCHES):
        if not np.isfinite(heights).any():
            raise ConvergenceError("No first draw is possible: widen the prior.", ())
        order = np.argsort(heights)[-N_BEST:]
        best, known = points[order], heights[order]
        proposal = Proposal.of(best.mean(axis=0), np.cov(best.T))
        new = proposal.draw(N_TRIED - N_BEST, random)
        points, heights = np.concatenate([best, new]), np.concatenate([known, density(new)])
    proposals = [Proposal(proposal.centre, WIDENED * proposal.factor)]
    drawn, heights = np.empty((0, points.shape[1])), np.empty(0)
    for _ in range(N_WEIGHTINGS):
        new = proposals[-1].draw(N_TRIED, random)
        drawn, heights = np.concatenate([drawn, new]), np.concatenate([heights, density(new)])
        mixture = logsumexp([one.log_density(drawn) for one in proposals], axis=0)
        logarithms = heights - mixture
        weights = np.exp(logarithms - logarithms.max())
        weights = np.minimum(weights, weights.mean() * np.sqrt(weights.size))
        proposals.append(
            Proposal.of(np.average(drawn, axis=0, weights=weights), np.cov(drawn.T, aweights=weights))
        )
    return proposals[-1]


def synthetic(
    truth: Prediction, residuals: Mapping[str, tuple[float, float]], random: np.random.Generator
) -> Observations:
    """Draw an experiment whose truth is the prediction of one point; rates are not below 0, as recorded ones.

    Residuals are deviation and correlation length [mm] of "deflection" [mm], "dynamic" and "static"
    [spikes/s], and the deviation between subjects as the first entry of "force".
    """
    shifts = bar_firing_rates().shift_mm
    dynamic, static = truth.bar_hz[:, 0]
    between = residuals["force"][0] * random.normal(size=(len(PLATE_DEPTHS_MM), SUBJECTS))
    subjects = truth.plate_force_n[0][:, np.newaxis] * np.exp(between)
    template = Observations.published()
    return replace(
        template,
        deflection_mm=truth.deflection_mm[0]
        + _correlated(deflection_distances_mm(), *residuals["deflection"], random),
        plate_force_n=np.column_stack([subjects.min(axis=1), subjects.max(axis=1)]),
        dynamic_hz=np.maximum(dynamic + _correlated(shifts, *residuals["dynamic"], random), 0.0),
        static_hz=np.maximum(static + _correlated(shifts, *residuals["static"], random), 0.0),
        hits=random.binomial(int(template.trials), truth.hit_rates[0].mean(axis=0)).astype(np.float64),
    )


def _correlated(
    positions_mm: FloatArray, deviation: float, length_mm: float, random: np.random.Generator
) -> FloatArray:
    """Draw residuals whose correlation falls exponentially with the distance."""
    if length_mm == 0.0:
        return deviation * random.normal(size=positions_mm.size)
    distances = np.abs(positions_mm[:, np.newaxis] - positions_mm)
    factor = np.linalg.cholesky(np.exp(-distances / length_mm))
    return deviation * factor @ random.normal(size=positions_mm.size)
