"""The study of the posterior: presses of the design, emulator, draws, targets, and synthetic experiments."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, replace
from multiprocessing import get_context

import numpy as np

from fingerpad.core.checked import result_class
from fingerpad.core.errors import ConvergenceError, InputError
from fingerpad.core.values import FloatArray, IntArray, Number
from fingerpad.data import protocol
from fingerpad.experiments.conditions import Conditions
from fingerpad.experiments.fit.likelihoods import interval
from fingerpad.experiments.fit.results import CredibleInterval, PosteriorConvergence
from fingerpad.experiments.runner import Manifest, Runner
from fingerpad.experiments.scores import coefficient_of_determination
from fingerpad.inference.fitting.methods import fractional_sum_of_squares
from fingerpad.inference.identifiable import LARGEST_RESTING_SHARE, identifiable
from fingerpad.neuron.afferent import Afferent
from fingerpad.psychophysics.sensitivity import InterpolatedObserver
from studies.finger_levels import SITES, Outputs, euclidean_hit_rates, largest_stress_kpa, outputs_of
from studies.finger_posterior import (
    LOGARITHMIC,
    PARAMETERS,
    RESTING,
    SUBJECTS,
    Finger,
    Likelihood,
    Observations,
    Prediction,
    Prior,
    Sampling,
    draw_posterior,
    prediction,
    synthetic,
)
from studies.posterior_calibration import Calibration, calibrate
from studies.tissue_candidates import HUMAN, Candidate
from studies.tissue_design import RANGES, design, design_candidates, point_of, shares_of, values_at
from studies.tissue_emulator import Emulator, left_out
from studies.tissue_search import SPHERES_PER_M, flat_and_largest, targets, touches

N_TISSUES, N_FOLDS = 29, 7
"""Points of the design, and emulators that have not seen one of so many parts of it."""

N_DRAWN, N_REPLICATES = 300, 20
"""Draws behind probabilities, and synthetic experiments of the calibration."""

SAMPLING = Sampling()
REPEATED = Sampling(
    n_walkers=50, n_steps=80, most_steps=640, n_ensembles=2, largest_r_hat=1.1, smallest_effective_size=30.0
)
"""Of the posterior, and of those of synthetic experiments."""

TRUTH_FACTOR, TRUTH_RESTING_SD = 1.3, 0.3
"""Afferents, noise and modulus of synthetic experiments: two thirds within this factor of `human`, whose
potential at rest over the threshold they have with this deviation."""

BETWEEN_SUBJECTS_SD = 0.36
"""Deviation of the logarithm of the force between subjects in synthetic experiments: the ranges of people
over the mean range of four normal numbers, 2.06 deviations. [1]"""

DYNAMIC_FLAT_HZ, LEAST_DYNAMIC_HZ, STATIC_DIFFERENCE_HZ = (45.0, 75.0), 180.0, (42.0, 56.0)
WEBER_FRACTIONS, LARGEST_SHIFT_EFFECT = (0.09, 0.14), 0.03
"""Further targets of the set `human`: rates under the flat face of the bar, the largest one, and the
difference of the static ones [spikes/s]; Weber fraction at 287 /m; difference of a hit rate between the
positions."""

STANDARD_PER_M = SPHERES_PER_M[0]


@result_class
class Marginal:
    """Prior and posterior of one parameter, and its value in the set `human`, for orientation."""

    name: str
    human: float
    prior: CredibleInterval
    posterior: CredibleInterval


@result_class
class EmulatorError:
    """Difference between emulated and pressed tissues that the emulator has not seen."""

    quantity: str  #: With its unit.
    rms: float
    largest: float  #: Over all points of the design.
    residual: Number  #: Deviation of the observations, in the same unit; NaN if nothing is observed.


@result_class
class Target:
    """A target, the share of the draws that meet it, and the number that is judged."""

    name: str
    probability: float
    interval: CredibleInterval


@result_class
class TissuePosterior:
    """Result of `python -m studies tissue-posterior`."""

    n_tissues: int
    n_unsolved: int
    """Points of the design that were pressed, and those of which a press could not be solved."""
    errors: tuple[EmulatorError, ...]  #: Of the emulator.
    convergence: PosteriorConvergence  #: Of the draws.
    marginals: tuple[Marginal, ...]  #: One per parameter.
    targets: tuple[Target, ...]  #: Of the set `human`.
    all_targets: float  #: Probability that all are met at once.
    calibration: Calibration  #: Of synthetic experiments with pressed tissues that the emulator has not seen.
    unsolved: int  #: Synthetic experiments whose draws have not converged.
    manifest: Manifest  #: What ran.


def pressed(
    runner: Runner, conditions: Conditions, candidates: Sequence[Candidate]
) -> tuple[FloatArray, dict[str, FloatArray], IntArray]:
    """Press what is missing of some candidates, and read what the levels need.

    A candidate of which a press cannot be solved is left out. The result is the times of all drives
    (n_times,) [ms], `Outputs` of the candidates that were solved, and their numbers (n_solved,).
    """
    wanted = [touches(candidate, conditions) for candidate in candidates]
    every = [touch for one in wanted for touch in one.values()]
    runner.solve(every, "tissues of the design", lambda touch, error: None)
    solved = [number for number, one in enumerate(wanted) if all(map(runner.store.holds, one.values()))]
    times, found = None, []
    for number in solved:
        responses = {key: runner.store.load(touch) for key, touch in wanted[number].items()}
        own, outputs = outputs_of(responses, candidates[number], conditions)
        if times is not None and not np.array_equal(own, times):
            raise InputError("candidates must have the same times: they differ.")
        times = own
        found.append(outputs)
    if times is None:
        raise InputError("candidates must hold at least one that can be pressed: got none.")
    return times, {name: np.array([one[name] for one in found]) for name in found[0]}, np.array(solved)


def emulator_errors(
    values: FloatArray, true: Outputs, emulated: Outputs, times_ms: FloatArray
) -> dict[str, FloatArray]:
    """Differences of all levels between pressed and emulated outputs of the same points, by quantity."""
    exact, found = (prediction(values, outputs, times_ms) for outputs in (true, emulated))
    pairs = {
        "deflection [mm]": (exact.deflection_mm, found.deflection_mm),
        "force of the plate [relative]": (np.log(exact.plate_force_n), np.log(found.plate_force_n)),
        "dynamic rate [spikes/s]": (exact.bar_hz[0], found.bar_hz[0]),
        "static rate [spikes/s]": (exact.bar_hz[1], found.bar_hz[1]),
        "static rate of the population [spikes/s]": (exact.sphere_hz, found.sphere_hz),
        "hit rate": (exact.hit_rates.mean(axis=1), found.hit_rates.mean(axis=1)),
    }
    return {name: second - first for name, (first, second) in pairs.items()}


def error_table(
    errors: Mapping[str, FloatArray], residuals: Mapping[str, tuple[float, float]], observed: Observations
) -> tuple[EmulatorError, ...]:
    """Sum up differences of all levels, beside the deviation of the observations."""
    people = observed.hits / observed.trials
    deviations = {
        "deflection [mm]": residuals["deflection"][0],
        "force of the plate [relative]": BETWEEN_SUBJECTS_SD / np.sqrt(SUBJECTS),
        "dynamic rate [spikes/s]": residuals["dynamic"][0],
        "static rate [spikes/s]": residuals["static"][0],
        "static rate of the population [spikes/s]": np.nan,
        "hit rate": float(np.sqrt(people * (1.0 - people) / observed.trials).mean()),
    }
    return tuple(
        EmulatorError(
            quantity=name,
            rms=float(np.sqrt(np.square(each).mean())),
            largest=np.abs(each).max(),
            residual=deviations[name],
        )
        for name, each in errors.items()
    )


def like_human(
    shares: FloatArray, outputs: Outputs, human: Outputs, prior: Prior, resting_share: float
) -> FloatArray:
    """Parameters (n_points, 11) of tissues with the afferent of `human`, its gains scaled to equal currents.

    Shares (n_points, n_tissues) are those of `RANGES`; the prior has the medians of `human`.
    """
    values = np.empty((len(shares), len(PARAMETERS)))
    values[:, : len(RANGES)] = values_at(shares)
    values[:, LOGARITHMIC] = prior.medians
    values[:, RESTING] = resting_share
    modulus = values[:, len(RANGES)]
    stress = largest_stress_kpa(human, modulus[:1]) / largest_stress_kpa(outputs, modulus)
    gains = [RESTING + 1, RESTING + 2]
    values[:, gains] *= stress[:, np.newaxis]
    return values


def weber_fractions(static_hz: FloatArray, noise_sigma: FloatArray) -> FloatArray:
    """Weber fraction at the standard for each draw; NaN where no pressed sphere is discriminated.

    Static rates under `SPHERES_PER_M` are (n_points, n_spheres, n_receptors) [spikes/s], the noise
    (n_points,).
    """
    observers = (
        InterpolatedObserver(np.array(SPHERES_PER_M), rates, SITES.neighbours, sigma, SITES.draws)
        for rates, sigma in zip(static_hz, noise_sigma.tolist(), strict=True)
    )
    found = [observer.difference(STANDARD_PER_M) for observer in observers]
    return np.array(found) / STANDARD_PER_M


def judged(found: Prediction, values: FloatArray, observed: Observations) -> tuple[tuple[Target, ...], float]:
    """Probability of each target of the set `human`, and of all at once, from draws (n_draws, 11)."""
    wanted, noise = targets(), values[:, -1]
    dynamic, static = (np.array([flat_and_largest(row) for row in rates]) for rates in found.bar_hz)
    euclidean = euclidean_hit_rates(found.sphere_hz, noise) - observed.hits / observed.trials
    shallow, deep = found.plate_force_n.T
    ranges = wanted.plate_force_n
    numbers: list[tuple[str, FloatArray, float, float]] = [
        (
            "R² under the cylinder",
            np.array(
                [coefficient_of_determination(observed.deflection_mm, row) for row in found.deflection_mm]
            ),
            wanted.r2,
            np.inf,
        ),
        ("plate at 1.0 mm [N]", shallow, *ranges[0]),
        ("plate at 2.0 mm [N]", deep, *ranges[1]),
        (
            "FSS in sample",
            np.array([_fss(observed, *both) for both in zip(*found.bar_hz, strict=True)]),
            wanted.fss,
            np.inf,
        ),
        ("dynamic rate under the flat face [spikes/s]", dynamic[:, 0], *DYNAMIC_FLAT_HZ),
        ("largest dynamic rate [spikes/s]", dynamic[:, 1], LEAST_DYNAMIC_HZ, np.inf),
        ("static difference [spikes/s]", static[:, 1] - static[:, 0], *STATIC_DIFFERENCE_HZ),
        ("rate at 3.5 mm [spikes/s]", found.bar_hz[:, :, [0, -1]].max(axis=(0, 2)), 0.0, 0.0),
        ("noise", noise, *wanted.noise_sigma),
        (
            "difference of a hit rate between positions",
            np.ptp(found.hit_rates, axis=1).max(axis=1),
            0.0,
            LARGEST_SHIFT_EFFECT,
        ),
        (
            "Euclidean Distance at that noise, rms",
            np.sqrt(np.square(euclidean).mean(axis=(1, 2))),
            0.0,
            wanted.euclidean_rms,
        ),
        ("Weber fraction at 287 /m", weber_fractions(found.sphere_hz[:, 0], noise), *WEBER_FRACTIONS),
    ]
    met = np.array([(low <= number) & (number <= high) for _, number, low, high in numbers])
    rows = tuple(
        Target(
            name=f"{name}: {_wanted(low, high)}",
            probability=each.mean(),
            interval=interval(number[np.isfinite(number)]),
        )
        for (name, number, low, high), each in zip(numbers, met, strict=True)
    )
    return rows, float(met.all(axis=0).mean())


def _wanted(low: float, high: float) -> str:
    if low == high:
        return f"{low:g}"
    if np.isinf(high):
        return f"at least {low:g}"
    return f"at most {high:g}" if low == 0.0 else f"{low:g} to {high:g}"


def _fss(observed: Observations, dynamic_hz: FloatArray, static_hz: FloatArray) -> float:
    """FSS over all shifts, Eqs. 12-14."""
    return protocol.DYNAMIC_WEIGHT.value * fractional_sum_of_squares(
        observed.dynamic_hz, dynamic_hz
    ) + protocol.STATIC_WEIGHT.value * fractional_sum_of_squares(observed.static_hz, static_hz)


# Synthetic experiments


@dataclass(frozen=True)
class Case:
    """A synthetic experiment, whose posterior is drawn in a process of its own."""

    finger: Finger
    observed: Observations
    prior: Prior
    seed: int
    truth: FloatArray
    settings: Sampling

    def draw(self) -> FloatArray | None:
        """Draw the posterior (n_draws, 11); None if it has not converged."""
        likelihood = Likelihood(self.observed)
        try:
            return draw_posterior(self.finger, likelihood, self.prior, self.seed, self.settings).values
        except ConvergenceError:
            return None


def drawn(cases: Sequence[Case], runner: Runner) -> list[FloatArray | None]:
    """Draws of some cases, on the runner's processes."""
    found = []
    with runner.stage("synthetic experiments", len(cases)) as advance:
        if runner.jobs == 1:
            for case in cases:
                found.append(case.draw())
                advance()
            return found
        with ProcessPoolExecutor(runner.jobs, mp_context=get_context("spawn")) as pool:
            for draws in pool.map(Case.draw, cases):
                found.append(draws)
                advance()
    return found


@dataclass(frozen=True)
class Pressed:
    """Pressed tissues of the design, and emulators that have not seen them."""

    shares: FloatArray  #: Of `RANGES`, (n_points, n_tissues).
    outputs: Outputs  #: Of the presses.
    times_ms: FloatArray  #: Times of the drives, (n_times,). [ms]
    centres: FloatArray
    """Parameters with the afferent of `human`, from `like_human`, (n_points, 11)."""
    emulators: Sequence[Emulator]
    unseen: IntArray  #: Both from `left_out`.

    def emulated(self) -> dict[str, FloatArray]:
        """Return outputs of every point by the emulator that has not seen it."""
        found = {name: np.empty_like(rows) for name, rows in self.outputs.items()}
        for number, one in enumerate(self.emulators):
            rows = self.unseen == number
            for name, values in one.predict(self.shares[rows]).items():
                found[name][rows] = values
        return found

    def experiments(
        self,
        residuals: Mapping[str, tuple[float, float]],
        prior: Prior,
        n_replicates: int,
        seed: int,
        settings: Sampling,
    ) -> list[Case]:
        """Draw experiments with tissues of the design, at most one per point.

        Observations are computed from the presses, with residuals as of `synthetic`. The afferent, the
        modulus and the noise are drawn about the centres. The posterior uses the emulator that has not seen
        the tissue.
        """
        random = np.random.Generator(np.random.Philox([seed, 3]))
        cases = []
        for number in random.permutation(len(self.shares))[:n_replicates].tolist():
            truth = self.centres[number].copy()
            truth[LOGARITHMIC] *= TRUTH_FACTOR ** random.normal(size=len(LOGARITHMIC))
            resting = truth[RESTING] + TRUTH_RESTING_SD * random.normal()
            truth[RESTING] = min(resting, LARGEST_RESTING_SHARE)
            own = {name: rows[number : number + 1] for name, rows in self.outputs.items()}
            observed = synthetic(prediction(truth[np.newaxis], own, self.times_ms), residuals, random)
            finger = Finger(self.emulators[int(self.unseen[number])], self.times_ms)
            cases.append(Case(finger, observed, prior, seed + 1 + number, truth, settings))
        return cases


def run(runner: Runner, conditions: Conditions) -> TissuePosterior:
    """Press the design, draw the posterior, and test it with synthetic experiments.

    A stopped run continues after the last stored press. The tissues of the conditions are not used.
    """
    seed, prior, observed = conditions.seed, Prior.about_human(), Observations.published()
    likelihood = Likelihood(observed)
    times, human, _ = pressed(runner, conditions, [replace(HUMAN, finalist=False)])
    times, outputs, solved = pressed(runner, conditions, design_candidates(N_TISSUES))
    shares = design(N_TISSUES)[solved]
    resting = float(np.prod(identifiable(Afferent.for_tissues("human").parameters)[[0, 3]]))
    with runner.stage("emulators", 1) as advance:
        finger = Finger(Emulator.fit(shares, outputs), times)
        centres = like_human(shares, outputs, human, prior, resting)
        tissues = Pressed(shares, outputs, times, centres, *left_out(shares, outputs, N_FOLDS))
        advance()
    with runner.stage("posterior", 1) as advance:
        posterior = draw_posterior(finger, likelihood, prior, seed, SAMPLING)
        advance()
    some = posterior.spread_out(N_DRAWN)
    found = finger.predict(some)
    random = np.random.Generator(np.random.Philox([seed, 1]))
    residuals = {
        name: (float(np.median(deviation)), float(np.median(length)))
        for name, (deviation, length) in likelihood.residual_draws(found, random).items()
    } | {"force": (BETWEEN_SUBJECTS_SD, 0.0)}
    experiments = tissues.experiments(residuals, prior, N_REPLICATES, seed, REPEATED)
    repeated = drawn(experiments, runner)
    pairs = [
        (case.truth, draws) for case, draws in zip(experiments, repeated, strict=True) if draws is not None
    ]
    judgements, all_targets = judged(found, some, observed)
    own = like_human(shares_of(point_of(HUMAN.tissues))[np.newaxis], human, human, prior, resting)
    before = prior.draw(len(posterior.values), random)
    return TissuePosterior(
        n_tissues=len(shares),
        n_unsolved=N_TISSUES - len(shares),
        errors=error_table(emulator_errors(centres, outputs, tissues.emulated(), times), residuals, observed),
        convergence=PosteriorConvergence.of(posterior.chains),
        marginals=tuple(
            Marginal(
                name=name,
                human=own[0, number],
                prior=interval(before[:, number]),
                posterior=interval(posterior.values[:, number]),
            )
            for number, name in enumerate(PARAMETERS)
        ),
        targets=judgements,
        all_targets=all_targets,
        calibration=calibrate(PARAMETERS, pairs),
        unsolved=len(experiments) - len(pairs),
        manifest=runner.manifest(conditions),
    )
