"""The analysis of a discrimination task: responses to every stimulus, decoded by every code and measure."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import cached_property
from typing import ClassVar

import numpy as np
from scipy.special import ndtr, ndtri

from fingerpad.core.checked import checked, result_class, value_class
from fingerpad.core.displayed import Columns, Result
from fingerpad.core.errors import InputError
from fingerpad.core.signals import ResponseMap, Skin
from fingerpad.core.units import name_and_unit
from fingerpad.core.values import FloatArray, IntArray, Many, Matrix, Vector
from fingerpad.experiments.descriptions.population import population_neighbours
from fingerpad.experiments.descriptions.stimuli import NamedStimulus, VariedStimuli
from fingerpad.experiments.discrimination.decoding import (
    SideCurve,
    TaskStatistic,
    code_hit_rates,
    fit_task_noise,
    response_table,
    side_curves,
    silent_stimuli,
    task_statistic,
)
from fingerpad.experiments.discrimination.task import FITTED, IDEAL, DiscriminationTask
from fingerpad.experiments.discrimination.task_stimuli import stimulus_index
from fingerpad.neuron.population import Population
from fingerpad.neuron.spikes import Windows, rate_windows_ms
from fingerpad.psychophysics.code_efficiency import (
    EFFICIENCY_TRIALS,
    SMALLEST_SPREAD,
    code_efficiency,
    code_statistic,
    noisy_presentations,
)
from fingerpad.psychophysics.discrimination import Experiment
from fingerpad.psychophysics.encoding import taking_part
from fingerpad.psychophysics.functions import binomial_interval
from fingerpad.psychophysics.ideal_observer import Presentation, multiplied_responses

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
    """Result of a discrimination task.

    Parameters
    ----------
    question : str
        The task in words.
    axis : str
        What the levels are.
    stimulus : tuple of str
        Names, the standard first.
    level : array (n_stimuli,), optional
        Where the stimuli stand on the axis of the psychometric curve.
    population : TaskPopulation
        The afferents.
    noise : TaskNoise
        Given or fitted.
    responses : dict of str to array (n_stimuli, n_receptors)
        By measure. [spikes/s or ms]
    decodings : tuple of Decoding
        One per measure and code.
    observed : TaskObservations, optional
        Hit rates of people.
    """

    whole_as_json: ClassVar[bool] = True
    question: str
    axis: str
    stimulus: tuple[str, ...]
    level: Vector | None
    population: TaskPopulation
    noise: TaskNoise
    responses: dict[str, Matrix]
    decodings: tuple[Decoding, ...]
    observed: TaskObservations | None

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


@value_class
class PreparedTask:
    """A task with its stimuli and its population.

    Parameters
    ----------
    task : DiscriminationTask
        As it was read.
    stimuli : tuple of NamedStimulus
        From `task_stimuli`, the standard first.
    population : Population
        From `task_population`, or one's own.
    """

    task: DiscriminationTask
    stimuli: Many[NamedStimulus]
    population: Population

    def __post_init__(self) -> None:
        task = self.task
        for key, names in (("code", task.code), ("measure", task.measure)):
            for name, count in Counter(names).items():
                if count > 1:
                    raise InputError(key, "must name each once", remedy=f"{name} is given {count} times")
        self._check_windows()
        for number, point in enumerate(task.observed.points if task.observed else (), start=1):
            if isinstance(point.at, str) or self.stimuli[0].level is None:
                stimulus_index(self.stimuli, point.at, f"observed.points[{number}].at")
        if task.noise == FITTED and not self.observed_comparisons:
            raise InputError(
                "noise can only be fitted to observed hit rates of the comparisons, "
                f"{', '.join(stimulus.name for stimulus in self.stimuli[1:])}: observed.points has none."
            )
        if IDEAL in task.code and task.noise == 0.0:
            raise InputError("noise", "must be greater than 0 where code has ideal", "0")
        if task.noise == FITTED and task.code[0] == IDEAL:
            raise InputError(
                "code", "must not begin with ideal where noise is fitted", remedy="put another first"
            )
        if task.experiment.criterion_sigma > 0.0 and "euclidean" in task.code:
            raise InputError(
                "experiment.criterion_sigma",
                "must be 0 where code has euclidean, whose decision point does not vary",
                f"{task.experiment.criterion_sigma:g}",
            )

    def _check_windows(self) -> None:
        for stimulus in self.stimuli:
            for key, (start, end) in zip(("dynamic", "static"), self._windows_ms(stimulus), strict=True):
                if not 0.0 <= start < end:
                    raise InputError(
                        f"windows_ms.{key} must be a start from 0 on and a later end: got {start:g}, {end:g}."
                    )
                if stimulus.motion.end_ms < end:
                    raise InputError(
                        f"windows_ms.{key} must end with the stimuli, not at {end:g} ms: {stimulus.name!r} "
                        f"ends at {stimulus.motion.end_ms:g} ms."
                    )

    def _windows_ms(self, stimulus: NamedStimulus) -> Windows:
        asked = self.task.windows_ms
        return rate_windows_ms(stimulus.motion.phases, asked.dynamic, asked.static)

    @cached_property
    def observed_comparisons(self) -> dict[int, float]:
        """Observed hit rates of comparisons that are pressed, by their row among the stimuli."""
        points = self.task.observed.points if self.task.observed else ()
        return {
            row: point.hit_rate
            for point in points
            for row, stimulus in enumerate(self.stimuli[1:], start=1)
            if point.at in (stimulus.name, stimulus.level)
        }

    @cached_property
    def neighbours(self) -> IntArray:
        """Who is whose neighbour, (n_pairs, 2)."""
        return population_neighbours(self.task.population, self.population)

    @property
    def plan(self) -> Experiment:
        """Repetitions and criterion."""
        return self.task.experiment.plan

    @property
    def axis(self) -> str:
        """Say what the levels are."""
        if self.task.axis or not isinstance(self.task.stimuli, VariedStimuli):
            return self.task.axis or "level"
        name, unit = name_and_unit(self.task.stimuli.vary.rpartition(".")[2])
        return name.replace("_", " ") + (f" [{unit}]" if unit else "")

    def responses(self, skins: Mapping[str, Skin]) -> list[ResponseMap]:
        """Responses of the population to every stimulus."""
        return [
            self.population.respond(skins[stimulus.name], *self._windows_ms(stimulus))
            for stimulus in self.stimuli
        ]


@checked
def analyse(prepared: PreparedTask, skins: Mapping[str, Skin]) -> TaskResult:
    """Compute the responses to indented stimuli, and decode them by every code and measure.

    Parameters
    ----------
    prepared : PreparedTask
        The task.
    skins : mapping of str to Skin
        Response of the skin to each stimulus, by its name.

    Raises
    ------
    ConvergenceError
        If no noise gives the observed hit rates.
    """
    task, stimuli, latest_ms = prepared.task, prepared.stimuli, prepared.task.windows_ms.latency
    maps = prepared.responses(skins)
    tables = {measure: response_table(maps, measure, latest_ms) for measure in task.measure}
    silent = {measure: silent_stimuli(table, measure, latest_ms) for measure, table in tables.items()}
    if all(rows.size for rows in silent.values()):
        raise InputError(
            f"The population is silent: by {' or '.join(silent)} none of its {len(prepared.population)} "
            f"afferents responds to {_named(stimuli, next(iter(silent.values())))}, so that there is no hit "
            "rate; indent deeper, or place the population below the stimuli."
        )
    encoded = {measure: taking_part(table, prepared.neighbours) for measure, table in tables.items()}
    noise = _noise(prepared, encoded, silent)
    settings, population = task.population, prepared.population
    return TaskResult(
        question=task.question,
        axis=prepared.axis,
        stimulus=tuple(stimulus.name for stimulus in stimuli),
        level=None if stimuli[0].level is None else np.array([stimulus.level for stimulus in stimuli]),
        population=TaskPopulation(
            layout=settings.layout,
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
            for decoding in _decodings(prepared, measure, encoded[measure], silent[measure], noise.sigma)
        ),
        observed=_observed(prepared),
    )


def _named(stimuli: Sequence[NamedStimulus], rows: Sequence[int] | IntArray) -> str:
    if len(rows) == len(stimuli):
        return "any stimulus"
    return f"the stimulus {', '.join(stimuli[row].name for row in rows)}"


def _noise(
    prepared: PreparedTask, encoded: Mapping[str, Encoded], silent: Mapping[str, IntArray]
) -> TaskNoise:
    """Find the noise: as it is given, or as the first code and measure need it for the observed hit rates."""
    task, points = prepared.task, prepared.observed_comparisons
    if not isinstance(task.noise, str):
        return TaskNoise(sigma=task.noise)
    code, measure = task.code[0], task.measure[0]
    if silent[measure].size:
        raise InputError(
            f"noise cannot be fitted: by the measure {measure} the population is silent under "
            f"{_named(prepared.stimuli, silent[measure])}; give a number, or another measure first."
        )
    rows, observed = [row - 1 for row in points], list(points.values())
    fit = fit_task_noise(code, *encoded[measure], rows, observed, task.experiment.seed, prepared.plan)
    return TaskNoise(
        sigma=fit.noise_sigma,
        fitted_to=FittedNoise(
            code=code,
            measure=measure,
            stimulus=tuple(prepared.stimuli[row].name for row in points),
            observed=np.array(observed),
            hit_rate=np.asarray(fit.hit_rates),
        ),
        root_mean_square_error=fit.root_mean_square_error,
    )


def _decodings(
    prepared: PreparedTask, measure: str, encoded: Encoded, silent: IntArray, sigma: float
) -> list[Decoding]:
    """Decode one measure by every code; there is no hit rate without responses."""
    codes, seed = prepared.task.code, prepared.task.experiment.seed
    if silent.size:
        names = tuple(prepared.stimuli[row].name for row in silent)
        return [Decoding(code=code, measure=measure, silent=names) for code in codes]
    shown = noisy_presentations(encoded[0], sigma, seed, SESSION) if sigma > 0.0 else []
    return [_decoding(prepared, code, measure, encoded, sigma, shown) for code in codes]


def _decoding(
    prepared: PreparedTask, code: str, measure: str, encoded: Encoded, sigma: float, shown: list[Presentation]
) -> Decoding:
    settings, (table, neighbours) = prepared.task.experiment, encoded
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
        rates = code_hit_rates(code, table, neighbours, sigma, settings.seed, prepared.plan)
        decoding = Decoding(
            code=code,
            measure=measure,
            hit_rate=rates.hit_rate,
            hit_rate_sd=rates.hit_rate_sd,
            statistic=task_statistic(code, table, neighbours, sigma, settings.seed),
        )
        if shown:
            standard = multiplied_responses(table[0], sigma, SMALLEST_SPREAD)
            statistic = code_statistic(code, standard, neighbours, settings.seed, SESSION)
            compared = [code_efficiency(presentation, statistic) for presentation in shown]
            decoding = replace(
                decoding,
                d_prime=np.array([one.code.d_prime for one in compared]),
                efficiency=np.array([one.efficiency for one in compared]),
                efficiency_error=np.array([one.efficiency_error for one in compared]),
            )
    if decoding.d_prime is not None:
        decoding = replace(decoding, forced_choice=forced_choice_of(decoding.d_prime, settings.trials))
    levels = [stimulus.level for stimulus in prepared.stimuli if stimulus.level is not None]
    # One comparison has no curve: what is asked of two stimuli is how well they are told apart.
    if len(levels) < 3 or decoding.hit_rate is None:
        return decoding
    found = side_curves(levels, decoding.hit_rate, settings.trials, prepared.task.curve, settings.seed)
    return replace(decoding, curves=found)


def _observed(prepared: PreparedTask) -> TaskObservations | None:
    """Observed points with their levels, and binomial intervals where the trials are known."""
    observed, stimuli, points = prepared.task.observed, prepared.stimuli, []
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
