"""The analysis of a discrimination task: responses to every stimulus, decoded by every code and measure."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import ClassVar, Literal

import numpy as np
from scipy.special import ndtr, ndtri

from fingerpad.core.checked import checked, result_class
from fingerpad.core.displayed import Columns, Result
from fingerpad.core.errors import InputError
from fingerpad.core.signals import Skin
from fingerpad.core.values import FloatArray, IntArray, Matrix, Vector
from fingerpad.experiments.discrimination.decoding import SESSION as TASK_SESSION
from fingerpad.experiments.discrimination.decoding import (
    SideCurve,
    TaskStatistic,
    fit_task_noise,
    response_table,
    side_curves,
    silent_stimuli,
    task_statistic,
)
from fingerpad.experiments.discrimination.request import IDEAL, DiscriminationRequest, stimulus_index
from fingerpad.experiments.requests.afferents import parameters_of
from fingerpad.experiments.requests.parts import at
from fingerpad.experiments.requests.stimuli import NamedStimulus
from fingerpad.experiments.runner import Manifest, Runner
from fingerpad.psychophysics.curve import binomial_interval
from fingerpad.psychophysics.encoding import taking_part
from fingerpad.psychophysics.ideal_observer import (
    EFFICIENCY_TRIALS,
    SMALLEST_SPREAD,
    Presentation,
    code_efficiency,
    multiplied_responses,
    noisy_presentations,
)
from fingerpad.psychophysics.observer import ENCODERS, discriminate_by

SESSION = 2  # Session of the random numbers of efficiencies; that of the hit rates is another.
Encoded = tuple[FloatArray, np.ndarray]  # A measure (n_stimuli, n_receptors), and pairs of neighbours.


@result_class
class TaskPopulation:
    """The population of a task."""

    layout: str  # How the afferents are laid out.
    n_receptors: int
    pitch_mm: float  # Distance between neighbours. [mm]
    density_per_cm2: float  # Afferents per area of skin. [1/cm2]
    positions_mm: Matrix  # x and z, or x, y and z, (n_receptors, 2 or 3). [mm]
    sensitivity: Vector | None  # Factor on the gains of each afferent, (n_receptors,).


@result_class
class FittedNoise:
    """What the noise was fitted to."""

    code: str
    measure: str  # The decoding that was brought closest to the observed hit rates.
    stimulus: tuple[str, ...]  # The comparisons that were observed.
    observed: Vector
    hit_rate: Vector  # Hit rates of people and of the model, (n_observed,). [0-1]


@result_class
class TaskNoise:
    """The noise of a task."""

    sigma: float  # Standard deviation of the multiplicative noise.
    fitted_to: FittedNoise | None = None  # Absent where the noise was given.
    root_mean_square_error: float | None = None  # Of the fitted hit rates.


@result_class
class ForcedChoice:
    """Two presentations per trial, one of them the comparison: how often it is identified."""

    trials: int  # Trials per comparison behind the intervals, those of the task.
    proportions: Matrix
    """Proportion correct, and the ends of the exact 95 % interval that so many trials leave about it, (3,
    n_comparisons). [0-1]"""
    d_primes: Matrix
    """sqrt(2) times the normal quantile of these; NaN where it is infinite, negative below chance, (3,
    n_comparisons)."""


def forced_choice_of(d_prime: FloatArray, trials: int) -> ForcedChoice:
    """Two-alternative forced choice at some d', with the intervals of an experiment."""
    proportion = ndtr(np.asarray(d_prime) / np.sqrt(2.0))
    proportions = np.array([proportion, *binomial_interval(proportion, trials)])
    d_primes = np.sqrt(2.0) * ndtri(proportions)
    return ForcedChoice(
        trials=trials, proportions=proportions, d_primes=np.where(np.isfinite(d_primes), d_primes, np.nan)
    )


@result_class
class Decoding:
    """One measure of the population, decoded by one code."""

    code: str
    measure: str  # By the names of `CODES` and `MEASURES`.
    silent: tuple[str, ...] = ()  # Stimuli under which no afferent responds; there is no hit rate then.
    hit_rate: Vector | None = None
    hit_rate_sd: Vector | None = None  # Mean and standard deviation over repetitions, (n_comparisons,). [0-1]
    statistic: TaskStatistic | None = None  # What the code computes; absent for the ideal observer.
    d_prime: Vector | None = None  # Discriminability; NaN where it is infinite, (n_comparisons,).
    forced_choice: ForcedChoice | None = None  # As proportion correct; absent without noise.
    efficiency: Vector | None = None
    efficiency_error: Vector | None = None  # NaN where it cannot be estimated, (n_comparisons,).
    curves: tuple[SideCurve, ...] = ()  # Psychometric curves above and below the standard.


@result_class
class TaskObservation:
    """A hit rate of people."""

    at: float | str  # Level or name of the stimulus, as the task gives it.
    level: float | None  # On the axis of the psychometric curve.
    hit_rate: float  # Fraction of trials. [0-1]
    trials: int | None
    interval: tuple[float, float] | None  # Binomial interval, where the trials are known. [0-1]


@result_class
class TaskObservations:
    """What was observed in people, and by whom."""

    source: str
    points: tuple[TaskObservation, ...]


@result_class
class TaskResult(Result):
    """Result of a discrimination task."""

    whole_as_json: ClassVar[bool] = True
    question: str  #: The task in words.
    axis: str  #: What the levels are.
    stimulus: tuple[str, ...]  #: Names, the standard first.
    level: Vector | None  #: Where the stimuli stand on the axis of the psychometric curve.
    population: TaskPopulation  #: The afferents.
    noise: TaskNoise  #: Given or fitted.
    responses: dict[str, Matrix]  #: By measure. [spikes/s or ms]
    decodings: tuple[Decoding, ...]  #: One per measure and code.
    observed: TaskObservations | None  #: Hit rates of people.

    def columns(self) -> Columns:
        """Return what each decoding makes of each comparison; NaN where it has no answer."""
        n_comparisons, decodings = len(self.stimulus) - 1, self.decodings
        unknown = np.full(n_comparisons, np.nan)
        level = unknown if self.level is None else self.level[1:]
        found: Columns = {
            "comparison": np.tile(self.stimulus[1:], len(decodings)),
            "level": np.tile(level, len(decodings)),
            "code": np.repeat([decoding.code for decoding in decodings], n_comparisons),
            "measure": np.repeat([decoding.measure for decoding in decodings], n_comparisons),
        }
        for name in ("hit_rate", "hit_rate_sd", "d_prime", "efficiency"):
            given = (getattr(decoding, name) for decoding in decodings)
            found[name] = np.concatenate([unknown if values is None else values for values in given])
        return found

    def __repr__(self) -> str:
        return (
            f"TaskResult({self.population.n_receptors} afferents, {len(self.stimulus) - 1} comparisons with "
            f"{self.stimulus[0]}, {len(self.decodings)} decodings, noise {self.noise.sigma:.3g})"
        )


@checked
def analyse(task: DiscriminationRequest, skins: Mapping[str, Skin]) -> TaskResult:
    """Compute the responses to indented stimuli, and decode them by every code and measure.

    Parameters
    ----------
    task : DiscriminationRequest
        The task.
    skins : mapping of str to Skin
        Response of the skin to each stimulus, by its name.

    Raises
    ------
    ConvergenceError
        If no noise gives the observed hit rates.
    """
    stimuli, latest_ms = task.pressed, task.latest_ms
    maps = task.responses(skins)
    tables = {measure: response_table(maps, measure, latest_ms) for measure in task.measure}
    silent = {measure: silent_stimuli(table, measure, latest_ms) for measure, table in tables.items()}
    if all(rows.size for rows in silent.values()):
        raise InputError(
            f"The population is silent: by {' or '.join(silent)} none of its {len(task.population)} "
            f"afferents responds to {_named(stimuli, next(iter(silent.values())))}, so that there is no hit "
            "rate; indent deeper, or place the population below the stimuli."
        )
    encoded = {measure: taking_part(table, task.neighbours) for measure, table in tables.items()}
    noise = _noise(task, encoded, silent)
    settings, population = task.afferents, task.population
    return TaskResult(
        question=task.question,
        axis=task.said_axis,
        stimulus=tuple(stimulus.name for stimulus in stimuli),
        level=None if stimuli[0].level is None else np.array([stimulus.level for stimulus in stimuli]),
        population=TaskPopulation(
            layout=settings.layout if settings.population is None else "own",
            n_receptors=len(population),
            pitch_mm=population.pitch_mm,
            density_per_cm2=sum((settings.densities_per_cm2 or {"": settings.density_per_cm2}).values()),
            positions_mm=population.positions_mm,
            sensitivity=population.sensitivity,
        ),
        noise=noise,
        responses=tables,
        decodings=tuple(
            decoding
            for measure in task.measure
            for decoding in _decodings(task, measure, encoded[measure], silent[measure], noise.sigma)
        ),
        observed=_observed(task),
    )


def _named(stimuli: Sequence[NamedStimulus], rows: Sequence[int] | IntArray) -> str:
    if len(rows) == len(stimuli):
        return "any stimulus"
    return f"the stimulus {', '.join(stimuli[row].name for row in rows)}"


def _noise(
    task: DiscriminationRequest, encoded: Mapping[str, Encoded], silent: Mapping[str, IntArray]
) -> TaskNoise:
    """Find the noise: as it is given, or as the first code and measure need it for the observed hit rates."""
    points = task.observed_comparisons
    if not isinstance(task.noise, str):
        return TaskNoise(sigma=task.noise)
    code, measure = task.code[0], task.measure[0]
    if silent[measure].size:
        raise InputError(
            f"noise cannot be fitted: by the measure {measure} the population is silent under "
            f"{_named(task.pressed, silent[measure])}; give a number, or another measure first."
        )
    rows, observed = [row - 1 for row in points], list(points.values())
    table, neighbours = encoded[measure]
    encoder, settings = ENCODERS[code](neighbours), task.experiment
    fit = fit_task_noise(encoder, table, rows, observed, settings.seed, settings.plan)
    return TaskNoise(
        sigma=fit.noise_sigma,
        fitted_to=FittedNoise(
            code=code,
            measure=measure,
            stimulus=tuple(task.pressed[row].name for row in points),
            observed=np.array(observed),
            hit_rate=np.asarray(fit.hit_rates),
        ),
        root_mean_square_error=fit.root_mean_square_error,
    )


def _decodings(
    task: DiscriminationRequest, measure: str, encoded: Encoded, silent: IntArray, sigma: float
) -> list[Decoding]:
    """Decode one measure by every code; there is no hit rate without responses."""
    codes, seed = task.code, task.experiment.seed
    if silent.size:
        names = tuple(task.pressed[row].name for row in silent)
        return [Decoding(code=code, measure=measure, silent=names) for code in codes]
    shown = noisy_presentations(encoded[0], sigma, seed, SESSION) if sigma > 0.0 else []
    return [_decoding(task, code, measure, encoded, sigma, shown) for code in codes]


def _decoding(
    task: DiscriminationRequest,
    code: str,
    measure: str,
    encoded: Encoded,
    sigma: float,
    shown: list[Presentation],
) -> Decoding:
    settings, (table, neighbours) = task.experiment, encoded
    if code == IDEAL:
        best = np.array([presentation.ideal_hit_rate() for presentation in shown])
        decoding = Decoding(
            code=code,
            measure=measure,
            hit_rate=best,
            hit_rate_sd=np.sqrt(best * (1.0 - best) / EFFICIENCY_TRIALS),
            d_prime=np.array([presentation.ideal().d_prime for presentation in shown]),
        )
    else:
        encoder = ENCODERS[code](neighbours)
        rates = discriminate_by(encoder, table, sigma, settings.seed, settings.plan, session=TASK_SESSION)
        decoding = Decoding(
            code=code,
            measure=measure,
            hit_rate=rates.hit_rate,
            hit_rate_sd=rates.hit_rate_sd,
            statistic=task_statistic(encoder, table, sigma, settings.seed),
        )
        if shown:
            standard = multiplied_responses(table[0], sigma, SMALLEST_SPREAD)
            statistic = encoder.statistic(standard, settings.seed, SESSION)
            compared = [code_efficiency(presentation, statistic) for presentation in shown]
            decoding = replace(
                decoding,
                d_prime=np.array([one.code.d_prime for one in compared]),
                efficiency=np.array([one.efficiency for one in compared]),
                efficiency_error=np.array([one.efficiency_error for one in compared]),
            )
    if decoding.d_prime is not None:
        decoding = replace(decoding, forced_choice=forced_choice_of(decoding.d_prime, settings.trials))
    levels = [stimulus.level for stimulus in task.pressed if stimulus.level is not None]
    # One comparison has no curve: what is asked of two stimuli is how well they are told apart.
    if len(levels) < 3 or decoding.hit_rate is None:
        return decoding
    found = side_curves(levels, decoding.hit_rate, settings.trials, task.curve, settings.seed)
    return replace(decoding, curves=found)


def _observed(task: DiscriminationRequest) -> TaskObservations | None:
    """Observed points with their levels, and binomial intervals where the trials are known."""
    observed, stimuli, points = task.observed, task.pressed, []
    if observed is None:
        return None
    for point in observed.points:
        at = point.at
        low_high = binomial_interval(point.hit_rate, point.trials) if point.trials else None
        points.append(
            TaskObservation(
                at=at,
                level=stimuli[stimulus_index(stimuli, at, "at")].level if isinstance(at, str) else at,
                hit_rate=point.hit_rate,
                trials=point.trials,
                interval=None if low_high is None else (float(low_high[0]), float(low_high[1])),
            )
        )
    return TaskObservations(source=observed.source, points=tuple(points))


@result_class
class DiscriminationFile:
    """The file `discriminate.json`."""

    format: Literal["fingerpad discrimination"] = "fingerpad discrimination"
    format_version: Literal[3] = 3
    discrimination: TaskResult
    task: DiscriminationRequest  # What was asked, defaults included.
    afferent: dict[str, float | str]  # By name; in a mixed population with the type, "RA.threshold".
    manifest: Manifest


def discriminate(task: DiscriminationRequest, runner: Runner) -> DiscriminationFile:
    """Indent with all stimuli, compute the responses of the population, and decode them."""
    task.check()
    with task.origin.located(), at("afferents"):
        # The mesh is needed to tell, so this is left to the run; still it comes before anything is solved.
        next(iter(task.touches.values())).check_sites(task.population.sites_mm)
        task.neighbours  # noqa: B018
    skins = runner.responses({"stimuli": task.touches})["stimuli"]
    with runner.stage("discrimination", 1) as advance:
        found = analyse(task, skins)
        advance()
    meshes = {"stimuli": next(iter(skins.values())).mesh}
    return DiscriminationFile(
        discrimination=found,
        task=task,
        afferent=parameters_of(task.population),
        manifest=runner.manifest(task.settings, meshes, inputs=task.input_hashes()),
    )
