"""The study of the posterior: presses of the design, draws, what each level informs, calibration, bands."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, replace
from multiprocessing import get_context

import numpy as np

from fingerpad.core.checks import FloatArray, IntArray
from fingerpad.core.errors import ConvergenceError, InputError
from fingerpad.core.results import Matrix, Number, Vector, result_class
from fingerpad.data import bar_firing_rates, protocol
from fingerpad.experiments.conditions import Conditions
from fingerpad.experiments.gerling2014.curvature_thresholds import (
    Observer,
    interpolated,
    just_noticeable_difference,
)
from fingerpad.experiments.gerling2014.single_unit_uncertainty import (
    CredibleInterval,
    PosteriorConvergence,
)
from fingerpad.experiments.gerling2014.skin_deflection import PLATE_DEPTHS_MM
from fingerpad.experiments.manifest import Manifest
from fingerpad.experiments.runner import Runner
from fingerpad.experiments.scores import coefficient_of_determination
from fingerpad.inference.fitting.fractional_sum_of_squares import fractional_sum_of_squares
from fingerpad.inference.fitting.posterior import Chains, credible_band
from fingerpad.inference.identifiable import LARGEST_RESTING_SHARE, identifiable
from fingerpad.neuron.afferent import Afferent
from fingerpad.skin.indentation import Touch
from fingerpad.skin.sampling import SkinResponse
from studies.finger_levels import (
    SITES,
    Outputs,
    deflection_distances_mm,
    euclidean_hit_rates,
    gradient_hit_rates,
    largest_stress_kpa,
    outputs_of,
)
from studies.finger_posterior import (
    LOGARITHMIC,
    PARAMETERS,
    RESTING,
    SUBJECTS,
    Finger,
    Likelihood,
    Observations,
    Posterior,
    Prediction,
    Prior,
    Sampling,
    draw_posterior,
    prediction,
    synthetic,
)
from studies.posterior_calibration import Calibration, calibrate
from studies.tissue_candidates import HUMAN, LEVELS, Candidate
from studies.tissue_design import (
    RANGES,
    design,
    design_candidates,
    point_of,
    shares_of,
    values_at,
)
from studies.tissue_emulator import Emulator, left_out
from studies.tissue_search import SPHERES_PER_M, Key, flat_and_largest, targets, touches

N_TISSUES = 29
"""Points of the design."""

N_FOLDS = 7
"""Emulators that have not seen a seventh of the design each; their error is told."""

N_DRAWN = 300
"""Draws behind bands and probabilities."""

N_REPLICATES = 20
"""Synthetic experiments of the calibration."""

SAMPLING = Sampling()
REPEATED = Sampling(
    n_walkers=50,
    n_steps=80,
    most_steps=640,
    n_ensembles=2,
    largest_r_hat=1.1,
    smallest_effective_size=30.0,
)
"""Of the posterior, and of those that leave out a level or belong to a synthetic experiment."""

LEVEL, INNER_LEVEL = 0.95, 0.5
"""Probabilities within the outer and the inner band."""

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

CURVATURES_PER_M = (290.0, 296.0, 305.0, 316.0, 328.0, 340.0, 352.0, 365.0)
"""Comparisons of the bands of hit rates; between 287, 296 and 365 /m rates are interpolated."""

STANDARD_PER_M = SPHERES_PER_M[0]


@result_class
class Marginal:
    """Prior and posterior of one parameter.

    Parameters
    ----------
    name : str
        With its unit.
    human : float
        Value in the set `human`, for orientation.
    prior, posterior : CredibleInterval
        Medians and 95 % intervals.
    width : float
        Width of the posterior's interval over that of the prior's, of logarithms where the prior is
        logarithmic. [1]
    width_without : dict of float
        The same without the observations of a level.
    """

    name: str
    human: float
    prior: CredibleInterval
    posterior: CredibleInterval
    width: float
    width_without: dict[str, float]


@result_class
class EmulatorError:
    """Difference between emulated and pressed tissues that the emulator has not seen.

    Parameters
    ----------
    quantity : str
        With its unit.
    rms, largest : float
        Over all points of the design.
    human : float
        Root mean square for the set `human`, from all points of the design.
    residual : float
        Deviation of the observations, in the same unit; NaN if nothing is observed.
    """

    quantity: str
    rms: float
    largest: float
    human: float
    residual: Number


@result_class
class Band:
    """Predicted numbers over the draws.

    Parameters
    ----------
    at : array (n,)
        Where.
    median, low, high, inner_low, inner_high : array (n,)
        Median, and ends of the 95 % and of the 50 % interval.
    """

    at: Vector
    median: Vector
    low: Vector
    high: Vector
    inner_low: Vector
    inner_high: Vector


@result_class
class Bands:
    """Bands of all figures.

    Parameters
    ----------
    deflection : Band
        Under the cylinder [mm] over the distance [mm].
    force : Band
        Of the plate [N] over depth [mm].
    dynamic, static : Band
        Rates [spikes/s] over the shift of the bar [mm].
    population : Band
        Static rates of the middle row under the standard sphere [spikes/s] over the place across the finger
        [mm].
    gradient, euclidean : Band
        Hit rates [0-1] of both codes over the curvature of the comparison [1/m], mean of both positions.
    weber : Band
        Weber fraction at the standard [1/m]; NaN where no draw has a threshold.
    """

    deflection: Band
    force: Band
    dynamic: Band
    static: Band
    population: Band
    gradient: Band
    euclidean: Band
    weber: Band


@result_class
class Target:
    """A target and how probable it is.

    Parameters
    ----------
    name : str
        What is wanted.
    probability : float
        Share of the draws that meet it.
    interval : CredibleInterval
        Of the number that is judged.
    """

    name: str
    probability: float
    interval: CredibleInterval


@result_class
class TissuePosterior:
    """Result of `python -m studies tissue-posterior`.

    Parameters
    ----------
    n_tissues, n_unsolved : int
        Points of the design that were pressed, and those of which a press could not be solved.
    components : dict of int
        Components of the emulator, by output.
    errors : tuple of EmulatorError
        Of the emulator.
    convergence : PosteriorConvergence
        Of the draws.
    marginals : tuple of Marginal
        One per parameter.
    correlations : array (n_parameters, n_parameters)
        Of the draws, of logarithms where the prior is logarithmic.
    residuals : dict of (CredibleInterval, CredibleInterval)
        Deviation [mm or spikes/s] and correlation length [mm] of deflection, dynamic and static rates.
    effective_points : float
        Independent points of the deflection that inform a common shift as well as all correlated ones, at
        the median length.
    targets : tuple of Target
        Of the set `human`.
    all_targets : float
        Probability that all are met at once.
    bands : Bands
        For all figures.
    calibration : Calibration
        Of synthetic experiments with pressed tissues that the emulator has not seen.
    unsolved : int
        Synthetic experiments whose draws have not converged.
    manifest : Manifest
        What ran.
    """

    n_tissues: int
    n_unsolved: int
    components: dict[str, int]
    errors: tuple[EmulatorError, ...]
    convergence: PosteriorConvergence
    marginals: tuple[Marginal, ...]
    correlations: Matrix
    residuals: dict[str, tuple[CredibleInterval, CredibleInterval]]
    effective_points: Number
    targets: tuple[Target, ...]
    all_targets: float
    bands: Bands
    calibration: Calibration
    unsolved: int
    manifest: Manifest


# Presses


def pressed(
    runner: Runner, conditions: Conditions, candidates: Sequence[Candidate]
) -> tuple[FloatArray, dict[str, FloatArray], IntArray]:
    """Press what is missing of some candidates, and read what the levels need.

    A candidate of which a press cannot be solved is left out.

    Parameters
    ----------
    runner : Runner
        Where indentations are stored.
    conditions : Conditions
        Finger and resolution.
    candidates : sequence of Candidate
        Tissues.

    Returns
    -------
    array (n_times,)
        Times of all drives. [ms]
    dict of array
        `Outputs` of the candidates that were solved.
    int array (n_solved,)
        Their numbers.

    Raises
    ------
    InputError
        If candidates have different times, or none was solved.
    """
    wanted = [touches(candidate, conditions) for candidate in candidates]
    runner.solve(
        [touch for one in wanted for touch in one.values()],
        "tissues of the design",
        lambda touch, error: None,
    )
    solved = [
        number
        for number, one in enumerate(wanted)
        if all(runner.store.holds(touch) for touch in one.values())
    ]
    times, found = None, []
    for candidate, one in ((candidates[number], wanted[number]) for number in solved):
        own, outputs = outputs_of(_loaded(runner, one), candidate, conditions)
        if times is not None and not np.array_equal(own, times):
            raise InputError("candidates must have the same times: they differ.")
        times = own
        found.append(outputs)
    if times is None:
        raise InputError("candidates must hold at least one that can be pressed: got none.")
    outputs = {name: np.array([one[name] for one in found]) for name in found[0]}
    return times, outputs, np.array(solved)


def _loaded(runner: Runner, wanted: Mapping[Key, Touch]) -> dict[Key, SkinResponse]:
    return {key: runner.store.load(touch) for key, touch in wanted.items()}


def human_candidate() -> Candidate:
    """`human`, the bar pressed once."""
    return replace(HUMAN, finalist=False)


# Emulator


def emulator_errors(
    values: FloatArray,
    true: Outputs,
    emulated: Outputs,
    times_ms: FloatArray,
) -> dict[str, FloatArray]:
    """Differences of all levels between two outputs of the same points, (n_points, ...) by quantity.

    Parameters
    ----------
    values : array (n_points, 11)
        Parameters; gains belong to the pressed stress.
    true, emulated : Outputs
        Pressed and emulated.
    times_ms : array (n_times,)
        Times of the drives. [ms]
    """
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


def like_human(
    shares: FloatArray, outputs: Outputs, human: Outputs, prior: Prior, resting_share: float
) -> FloatArray:
    """Parameters (n_points, 11) of tissues with the afferent of `human`, its gains scaled to equal currents.

    Parameters
    ----------
    shares : array (n_points, n_tissues)
        Of `RANGES`.
    outputs, human : Outputs
        Of these tissues, and of `human`.
    prior : Prior
        With the medians of `human`.
    resting_share : float
        Potential at rest over the threshold of the afferent of `human`.
    """
    values = np.empty((len(shares), len(PARAMETERS)))
    values[:, : len(RANGES)] = values_at(shares)
    values[:, LOGARITHMIC] = prior.medians
    values[:, len(RANGES) + 1] = resting_share
    modulus = values[:, len(RANGES)]
    stress = largest_stress_kpa(human, modulus[:1]) / largest_stress_kpa(outputs, modulus)
    gains = [len(RANGES) + 2, len(RANGES) + 3]
    values[:, gains] *= stress[:, np.newaxis]
    return values


# Results


def interval(draws: FloatArray) -> CredibleInterval:
    """Median and 95 % interval of draws (n_draws,)."""
    low, high = credible_band(draws, LEVEL)
    return CredibleInterval(median=np.median(draws), low=low, high=high)


def band(at: FloatArray, draws: FloatArray) -> Band:
    """Band of draws (n_draws, n)."""
    low, high = credible_band(draws, LEVEL)
    inner_low, inner_high = credible_band(draws, INNER_LEVEL)
    return Band(
        at=at, median=np.median(draws, axis=0), low=low, high=high, inner_low=inner_low, inner_high=inner_high
    )


def scaled(values: FloatArray) -> FloatArray:
    """Logarithms of the parameters (n_points, 11) whose prior is logarithmic, the others as they are."""
    logarithmic = [*(number for number, one in enumerate(RANGES) if one.logarithmic), *LOGARITHMIC]
    return np.where(np.isin(np.arange(len(PARAMETERS)), logarithmic), np.log(np.abs(values)), values)


def widths(draws: FloatArray) -> FloatArray:
    """Widths of the 95 % intervals of draws (n_draws, n_parameters), of logarithms where the prior is."""
    low, high = credible_band(scaled(draws), LEVEL)
    return high - low


def marginals(
    prior: FloatArray, posterior: FloatArray, without: Mapping[str, FloatArray], human: FloatArray
) -> tuple[Marginal, ...]:
    """Compare draws of the prior, of the posterior and of posteriors that leave out a level."""
    wide = widths(prior)
    ratios = {level: widths(draws) / wide for level, draws in without.items()}
    narrow = widths(posterior) / wide
    return tuple(
        Marginal(
            name=name,
            human=human[number],
            prior=interval(prior[:, number]),
            posterior=interval(posterior[:, number]),
            width=narrow[number],
            width_without={level: float(ratio[number]) for level, ratio in ratios.items()},
        )
        for number, name in enumerate(PARAMETERS)
    )


def effective_points(positions_mm: FloatArray, length_mm: float) -> float:
    """Return how many independent points determine a mean as well as points with correlated residuals.

    Examples
    --------
    >>> effective_points(np.arange(10.0), 0.0)
    10.0
    >>> 1.0 < effective_points(np.arange(10.0), 5.0) < 3.0
    True
    """
    if length_mm == 0.0:
        return float(positions_mm.size)
    correlation = np.exp(-np.abs(positions_mm[:, np.newaxis] - positions_mm) / length_mm)
    ones = np.ones(positions_mm.size)
    return float(ones @ np.linalg.solve(correlation, ones))


def weber_fractions(static_hz: FloatArray, noise_sigma: FloatArray) -> FloatArray:
    """Weber fraction at the standard for each draw; NaN where no pressed sphere is discriminated.

    Parameters
    ----------
    static_hz : array (n_points, n_spheres, n_receptors)
        Static rates under `SPHERES_PER_M`. [spikes/s]
    noise_sigma : array (n_points,)
        Noise.

    Returns
    -------
    array (n_points,)
    """
    found = np.full(len(static_hz), np.nan)
    for row, (table, sigma) in enumerate(zip(static_hz, noise_sigma.tolist(), strict=True)):
        observer = Observer(
            interpolated(np.array(SPHERES_PER_M), table), SITES.neighbours, sigma, SITES.draws
        )
        try:
            found[row] = just_noticeable_difference(observer, STANDARD_PER_M) / STANDARD_PER_M
        except ConvergenceError:
            continue
    return found


def interpolated_spheres(static_hz: FloatArray) -> FloatArray:
    """Rates under the standard and `CURVATURES_PER_M`, from those under `SPHERES_PER_M`.

    The last axis but one holds the spheres.
    """
    wanted = np.log([STANDARD_PER_M, *CURVATURES_PER_M])
    by_sphere = np.moveaxis(static_hz, -2, 0)
    return np.moveaxis(interpolated(np.array(SPHERES_PER_M), by_sphere)(wanted), 0, -2)


def bands(found: Prediction, values: FloatArray) -> tuple[Bands, FloatArray]:
    """Bands of all figures, and Weber fractions of the draws.

    Parameters
    ----------
    found : Prediction
        Of the draws.
    values : array (n_draws, 11)
        Their parameters.

    Returns
    -------
    Bands
    array (n_draws,)
        Weber fractions.
    """
    shifts, noise = bar_firing_rates().shift_mm, values[:, -1]
    across = SITES.population.positions_mm
    middle = np.isclose(across[:, 0], np.median(across[:, 0]))
    spheres = interpolated_spheres(found.sphere_hz)
    weber = weber_fractions(found.sphere_hz[:, 0], noise)
    curvatures = np.array(CURVATURES_PER_M)
    known = weber[np.isfinite(weber)]
    return (
        Bands(
            deflection=band(deflection_distances_mm(), found.deflection_mm),
            force=band(np.array(PLATE_DEPTHS_MM), found.plate_force_n),
            dynamic=band(shifts, found.bar_hz[0]),
            static=band(shifts, found.bar_hz[1]),
            population=band(across[middle, 1], found.sphere_hz[:, 0, 0][:, middle]),
            gradient=band(curvatures, gradient_hit_rates(spheres, noise).mean(axis=1)),
            euclidean=band(curvatures, euclidean_hit_rates(spheres, noise).mean(axis=1)),
            weber=band(np.array([STANDARD_PER_M]), (known if known.size else weber)[:, np.newaxis]),
        ),
        weber,
    )


def judged(
    found: Prediction, values: FloatArray, weber: FloatArray, observed: Observations
) -> tuple[tuple[Target, ...], float]:
    """Probability of each target of the set `human`, and of all at once.

    Parameters
    ----------
    found : Prediction
        Of the draws.
    values : array (n_draws, 11)
        Their parameters.
    weber : array (n_draws,)
        Weber fractions at the standard; NaN counts as missed.
    observed : Observations
        Of all levels.

    Returns
    -------
    tuple of Target
    float
    """
    wanted, noise = targets(), values[:, -1]
    dynamic, static = (np.array([flat_and_largest(row) for row in rates]) for rates in found.bar_hz)
    people = observed.hits / observed.trials
    euclidean = euclidean_hit_rates(found.sphere_hz, noise) - people
    r2 = np.array([coefficient_of_determination(observed.deflection_mm, row) for row in found.deflection_mm])
    shallow, deep = found.plate_force_n.T
    fss = np.array([_fss(observed, *both) for both in zip(*found.bar_hz, strict=True)])
    difference = static[:, 1] - static[:, 0]
    (shallow_low, shallow_high), (deep_low, deep_high) = wanted.plate_force_n
    numbers: list[tuple[str, FloatArray, float, float]] = [
        ("R² under the cylinder", r2, wanted.r2, np.inf),
        ("plate at 1.0 mm [N]", shallow, shallow_low, shallow_high),
        ("plate at 2.0 mm [N]", deep, deep_low, deep_high),
        ("FSS in sample", fss, wanted.fss, np.inf),
        ("dynamic rate under the flat face [spikes/s]", dynamic[:, 0], *DYNAMIC_FLAT_HZ),
        ("largest dynamic rate [spikes/s]", dynamic[:, 1], LEAST_DYNAMIC_HZ, np.inf),
        ("static difference [spikes/s]", difference, *STATIC_DIFFERENCE_HZ),
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
        ("Weber fraction at 287 /m", weber, *WEBER_FRACTIONS),
    ]
    met = np.array([(low <= number) & (number <= high) for _, number, low, high in numbers])
    rows = tuple(
        Target(
            name=f"{name}, wanted: {_wanted(low, high)}",
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


def convergence(chains: Chains) -> PosteriorConvergence:
    """Size and convergence of the draws."""
    return PosteriorConvergence(
        ensembles=chains.draws.shape[0],
        walkers=chains.draws.shape[2],
        draws=len(chains.flat),
        evaluations=chains.n_evaluations,
        acceptance=chains.acceptance,
        r_hat=chains.r_hat.max(),
        effective_draws=chains.effective_sizes.min(),
        effective_draws_of_tails=chains.tail_effective_sizes.min(),
        draws_per_effective_draw=chains.autocorrelation_steps.max(),
    )


# Repeated posteriors


@dataclass(frozen=True)
class Case:
    """One posterior that is drawn in a process of its own.

    Parameters
    ----------
    finger : Finger
        Predicts the levels.
    observed : Observations
        What is fitted.
    prior : Prior
        Of the parameters.
    seed : int
        Of all random numbers.
    levels : tuple of str, optional
        Levels whose observations are used.
    truth : array (11,), optional
        Parameters behind a synthetic experiment.
    settings : Sampling, optional
        Of the sampler.
    """

    finger: Finger
    observed: Observations
    prior: Prior
    seed: int
    levels: tuple[str, ...] = LEVELS
    truth: FloatArray | None = None
    settings: Sampling = REPEATED

    def draw(self) -> Posterior | None:
        """Draw the posterior; None if it has not converged."""
        try:
            return draw_posterior(
                self.finger, Likelihood(self.observed), self.prior, self.seed, self.settings, self.levels
            )
        except ConvergenceError:
            return None


def _draw(case: Case) -> FloatArray | None:
    found = case.draw()
    return None if found is None else found.values


def drawn(cases: Sequence[Case], runner: Runner, stage: str) -> list[FloatArray | None]:
    """Draws (n_draws, 11) of some cases, on the runner's processes; None where they have not converged."""
    with runner.stage(stage, len(cases)) as advance:
        found = []
        if runner.jobs == 1:
            for case in cases:
                found.append(_draw(case))
                advance()
            return found
        with ProcessPoolExecutor(runner.jobs, mp_context=get_context("spawn")) as pool:
            for draws in pool.map(_draw, cases):
                found.append(draws)
                advance()
        return found


def without_each_level(
    finger: Finger, observed: Observations, prior: Prior, seed: int, settings: Sampling
) -> dict[str, Case]:
    """Return the posteriors that leave out the observations of one level, by that level."""
    return {
        level: Case(
            finger,
            observed,
            prior,
            seed,
            tuple(other for other in LEVELS if other != level),
            settings=settings,
        )
        for level in LEVELS
    }


def synthetic_experiments(
    shares: FloatArray,
    outputs: Outputs,
    times_ms: FloatArray,
    centres: FloatArray,
    emulators: Sequence[Emulator],
    unseen: IntArray,
    residuals: Mapping[str, tuple[float, float]],
    prior: Prior,
    n_replicates: int,
    seed: int,
    settings: Sampling,
) -> list[Case]:
    """Experiments with tissues of the design, computed from their presses.

    Parameters
    ----------
    shares : array (n_points, n_tissues)
        Of `RANGES`.
    outputs : Outputs
        Of the presses.
    times_ms : array (n_times,)
        Times of the drives. [ms]
    centres : array (n_points, 11)
        Parameters about which those of the afferent, the modulus and the noise are drawn.
    emulators, unseen
        From `left_out`: the posterior uses the emulator that has not seen the tissue.
    residuals
        As of `synthetic`.
    prior : Prior
        Of the posterior.
    n_replicates : int
        At most one per point.
    seed : int
        Of truths, residuals and draws.
    settings : Sampling
        Of the sampler.

    Returns
    -------
    list of Case
    """
    random = np.random.Generator(np.random.Philox([seed, 3]))
    cases = []
    for number in random.permutation(len(shares))[:n_replicates].tolist():
        truth = centres[number].copy()
        truth[LOGARITHMIC] *= TRUTH_FACTOR ** random.normal(size=len(LOGARITHMIC))
        truth[RESTING] = min(truth[RESTING] + TRUTH_RESTING_SD * random.normal(), LARGEST_RESTING_SHARE)
        own = {name: rows[number : number + 1] for name, rows in outputs.items()}
        observed = synthetic(prediction(truth[np.newaxis], own, times_ms), residuals, random)
        finger = Finger(emulators[int(unseen[number])], times_ms)
        cases.append(Case(finger, observed, prior, seed + 1 + number, truth=truth, settings=settings))
    return cases


def calibration(cases: Sequence[Case], draws: Sequence[FloatArray | None]) -> Calibration:
    """Where the true parameters of synthetic experiments lie among their draws."""
    converged = [(case, found) for case, found in zip(cases, draws, strict=True) if found is not None]

    def once(replicate: tuple[Case, FloatArray]) -> tuple[FloatArray, FloatArray]:
        case, found = replicate
        assert case.truth is not None
        return case.truth, found

    return calibrate(PARAMETERS, converged, once)


def run(runner: Runner, conditions: Conditions) -> TissuePosterior:
    """Press the design, draw the posterior, and test it with synthetic experiments.

    Parameters
    ----------
    runner : Runner
        Where indentations are stored; a stopped run continues after the last one.
    conditions : Conditions
        Finger, resolution and seed; its tissues are not used.

    Returns
    -------
    TissuePosterior

    Raises
    ------
    ConvergenceError
        If an indentation cannot be solved, or the draws have not converged.
    StoreError
        If a stored indentation is damaged or the folder cannot be written.
    """
    seed = conditions.seed
    times, human, _ = pressed(runner, conditions, [human_candidate()])
    times, outputs, solved = pressed(runner, conditions, design_candidates(N_TISSUES))
    shares = design(N_TISSUES)[solved]
    with runner.stage("emulators", 1) as advance:
        emulator = Emulator.fit(shares, outputs)
        emulators, unseen = left_out(shares, outputs, N_FOLDS)
        advance()
    finger, observed, prior = Finger(emulator, times), Observations.published(), Prior.about_human()
    likelihood = Likelihood(observed)
    with runner.stage("posterior", 1) as advance:
        posterior = draw_posterior(finger, likelihood, prior, seed, SAMPLING)
        advance()
    some = posterior.spread_out(N_DRAWN)
    found = finger.predict(some)
    random = np.random.Generator(np.random.Philox([seed, 1]))
    residuals = {
        name: (interval(deviation), interval(length))
        for name, (deviation, length) in likelihood.residual_draws(found, random).items()
    }
    resting = float(np.prod(identifiable(Afferent.for_tissues("human").parameters)[[0, 3]]))
    centres = like_human(shares, outputs, human, prior, resting)
    own = like_human(shares_of(point_of(HUMAN.tissues))[np.newaxis], human, human, prior, resting)
    without = without_each_level(finger, observed, prior, seed, REPEATED)
    experiments = synthetic_experiments(
        shares,
        outputs,
        times,
        centres,
        emulators,
        unseen,
        {name: (deviation.median, length.median) for name, (deviation, length) in residuals.items()}
        | {"force": (BETWEEN_SUBJECTS_SD, 0.0)},
        prior,
        N_REPLICATES,
        seed,
        REPEATED,
    )
    draws = drawn([*without.values(), *experiments], runner, "repeated posteriors")
    of_levels = dict(zip(without, draws, strict=False))
    repeated = draws[len(without) :]
    all_bands, weber = bands(found, some)
    judgements, all_targets = judged(found, some, weber, observed)
    left_outputs = {name: np.empty_like(rows) for name, rows in outputs.items()}
    for number, one in enumerate(emulators):
        rows = unseen == number
        for name, values in one.predict(shares[rows]).items():
            left_outputs[name][rows] = values
    return TissuePosterior(
        n_tissues=len(shares),
        n_unsolved=N_TISSUES - len(shares),
        components=emulator.n_components,
        errors=error_table(
            emulator_errors(centres, outputs, left_outputs, times),
            emulator_errors(own, human, finger.outputs(own), times),
            residuals,
            observed,
        ),
        convergence=convergence(posterior.chains),
        marginals=marginals(
            prior.draw(len(posterior.values), random),
            posterior.values,
            {level: values for level, values in of_levels.items() if values is not None},
            own[0],
        ),
        correlations=np.array(np.corrcoef(scaled(posterior.values).T)),
        residuals=residuals,
        effective_points=effective_points(deflection_distances_mm(), residuals["deflection"][1].median),
        targets=judgements,
        all_targets=all_targets,
        bands=all_bands,
        calibration=calibration(experiments, repeated),
        unsolved=sum(values is None for values in repeated),
        manifest=runner.manifest(conditions),
    )


def error_table(
    errors: Mapping[str, FloatArray],
    human: Mapping[str, FloatArray],
    residuals: Mapping[str, tuple[CredibleInterval, CredibleInterval]],
    observed: Observations,
) -> tuple[EmulatorError, ...]:
    """Sum up differences of all levels, beside the deviation of the observations."""
    people = observed.hits / observed.trials
    deviations = {
        "deflection [mm]": residuals["deflection"][0].median,
        "force of the plate [relative]": BETWEEN_SUBJECTS_SD / np.sqrt(SUBJECTS),
        "dynamic rate [spikes/s]": residuals["dynamic"][0].median,
        "static rate [spikes/s]": residuals["static"][0].median,
        "static rate of the population [spikes/s]": np.nan,
        "hit rate": float(np.sqrt(people * (1.0 - people) / observed.trials).mean()),
    }
    return tuple(
        EmulatorError(
            quantity=name,
            rms=_rms(each),
            largest=np.abs(each).max(),
            human=_rms(human[name]),
            residual=deviations[name],
        )
        for name, each in errors.items()
    )


def _rms(values: FloatArray) -> float:
    return float(np.sqrt(np.square(values).mean()))
