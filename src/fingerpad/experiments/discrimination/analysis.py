"""The analysis of a discrimination task: responses to every stimulus, decoded by every code and measure."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import ClassVar, Literal

import numpy as np
from scipy.special import ndtr, ndtri

from fingerpad.core.checked import checked, result_class
from fingerpad.core.displayed import Columns, Result
from fingerpad.core.errors import ConvergenceError, InputError
from fingerpad.core.signals import Skin
from fingerpad.core.values import FloatArray, IntArray, Matrix, Number, Vector
from fingerpad.experiments.discrimination.request import (
    IDEAL,
    CurveSettings,
    DiscriminationRequest,
    stimulus_index,
)
from fingerpad.experiments.requests.afferents import parameters_of
from fingerpad.experiments.requests.parts import at
from fingerpad.experiments.requests.stimuli import NamedStimulus
from fingerpad.experiments.runner import Manifest, Runner
from fingerpad.psychophysics.curve import binomial_interval
from fingerpad.psychophysics.curve_fit import fit_psychometric
from fingerpad.psychophysics.curve_uncertainty import bootstrap, posterior
from fingerpad.psychophysics.encoding import RESPONSE_MEASURES, Measured, Noise, noise_offset, taking_part
from fingerpad.psychophysics.ideal_observer import (
    EFFICIENCY_TRIALS,
    SMALLEST_SPREAD,
    Presentation,
    efficiency,
    multiplied_responses,
    noisy_presentations,
)
from fingerpad.psychophysics.observer import ENCODERS, discriminate_by, fit_noise_sigma

SESSION, EFFICIENCY_SESSION = 1, 2
"""Sessions of random numbers: of hit rates, as the reproduction's spheres at 0.0 mm; of efficiencies."""
SHOWN_PRESENTATIONS = 1000  # Presentations behind the mean and spread of a statistic that a figure shows.
CURVE_POINTS = 61
CREDIBLE = 0.95


@result_class
class TaskPopulation:
    """The population of a task."""

    layout: str  #: How the afferents are laid out.
    n_receptors: int
    pitch_mm: float  #: Distance between neighbours. [mm]
    density_per_cm2: float  #: Afferents per area of skin. [1/cm2]
    positions_mm: Matrix  #: x and z, or x, y and z, (n_receptors, 2 or 3). [mm]
    sensitivity: Vector | None  #: Factor on the gains of each afferent, (n_receptors,).


@result_class
class FittedNoise:
    """What the noise was fitted to."""

    code: str
    measure: str  #: The decoding that was brought closest to the observed hit rates.
    stimulus: tuple[str, ...]  #: The comparisons that were observed.
    observed: Vector
    hit_rate: Vector  #: Hit rates of people and of the model, (n_observed,). [0-1]


@result_class
class TaskNoise:
    """The noise of a task."""

    sigma: float  #: Standard deviation of the multiplicative noise.
    fitted_to: FittedNoise | None = None  #: Absent where the noise was given.
    root_mean_square_error: float | None = None  #: Of the fitted hit rates.


@result_class
class ForcedChoice:
    """Two presentations per trial, one of them the comparison: how often it is identified."""

    trials: int  #: Trials per comparison behind the intervals, those of the task.
    proportions: Matrix
    """Proportion correct, and the ends of the exact 95 % interval that so many trials leave about it, (3,
    n_comparisons). [0-1]"""
    d_primes: Matrix
    """sqrt(2) times the normal quantile of these; NaN where it is infinite, negative below chance, (3,
    n_comparisons)."""


@result_class
class TaskStatistic:
    """Mean and standard deviation of a code's statistic over noisy presentations, (n_stimuli,)."""

    mean: Vector
    sd: Vector


@result_class
class CurveThreshold:
    """Threshold of a psychometric curve."""

    proportion: float  #: Hit rate at the threshold. [0-1]
    difference: Number
    level: Number  #: From the standard, and on the axis. [unit of what varies]
    over_standard: float | None  #: Difference over standard (Weber fraction); absent where that is 0.
    bootstrap_interval: tuple[Number, Number] | None
    posterior_interval: tuple[Number, Number]
    """Confidence and credible interval of the difference; the former is absent where no comparison lies on
    the rise of the curve. [unit of what varies]"""


@result_class
class CurvePoints:
    """A fitted curve at points (n_points,), with its credible band."""

    difference: Vector
    level: Vector
    proportion: Vector
    low: Vector
    high: Vector


@result_class
class CurveFit:
    """A fitted psychometric curve."""

    sigmoid: str
    trials: int  #: Judgements per comparison behind the intervals.
    threshold: CurveThreshold  #: At the proportion that the task asks for.
    slope: Number  #: Of the hit rate at the threshold; NaN where no comparison lies on the rise.
    lapse: float  #: What is missing to 1 far above the threshold. [0-1]
    at_bounds: tuple[str, ...]  #: Parameters that ended at a bound.
    curve: CurvePoints


@result_class
class SideCurve:
    """Hit rates on one side of the standard, with their curve or the reason why there is none."""

    side: str  #: Of the standard.
    difference: Vector
    hit_rate: Vector  #: Distance from the standard, and hit rate, (n_comparisons,).
    fit: CurveFit | None = None
    why_not: str | None = None  #: Why there is no curve.


@result_class
class Decoding:
    """One measure of the population, decoded by one code."""

    code: str
    measure: str  #: By the names of `CODES` and `MEASURES`.
    silent: tuple[str, ...] = ()  #: Stimuli under which no afferent responds; there is no hit rate then.
    hit_rate: Vector | None = None
    hit_rate_sd: Vector | None = None  #: Mean and standard deviation of repetitions, (n_comparisons,). [0-1]
    statistic: TaskStatistic | None = None  #: What the code computes; absent for the ideal observer.
    d_prime: Vector | None = None  #: Discriminability; NaN where it is infinite, (n_comparisons,).
    forced_choice: ForcedChoice | None = None  #: As proportion correct; absent without noise.
    efficiency: Vector | None = None
    efficiency_error: Vector | None = None  #: NaN where it cannot be estimated, (n_comparisons,).
    curves: tuple[SideCurve, ...] = ()  #: Psychometric curves above and below the standard.


@result_class
class TaskObservation:
    """A hit rate of people."""

    at: float | str  #: Level or name of the stimulus, as the task gives it.
    level: float | None  #: On the axis of the psychometric curve.
    hit_rate: float  #: Fraction of trials. [0-1]
    trials: int | None
    interval: tuple[float, float] | None  #: Binomial interval, where the trials are known. [0-1]


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
    tables = {
        measure: np.array([RESPONSE_MEASURES[measure](answer) for answer in maps]) for measure in task.measure
    }
    if "latency" in tables and latest_ms is not None:
        tables["latency"] = np.fmin(tables["latency"], latest_ms)
    silent = {measure: silent_stimuli(table, measure, latest_ms) for measure, table in tables.items()}
    if all(rows.size for rows in silent.values()):
        raise InputError(
            f"The population is silent: by {' or '.join(silent)} none of its {len(task.population)} "
            f"afferents responds to {_named(stimuli, next(iter(silent.values())))}, so that there is no hit "
            "rate; indent deeper, or place the population below the stimuli."
        )
    encoded = {
        measure: taking_part(table, task.neighbours, noise_offset(measure, task.population.noise_offset_hz))
        for measure, table in tables.items()
    }
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
    task: DiscriminationRequest, encoded: Mapping[str, Measured], silent: Mapping[str, IntArray]
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
    measured, settings = encoded[measure], task.experiment
    encoder = ENCODERS[code](measured.neighbours)
    predict = encoder.predictor(measured.responses, settings.seed, settings.plan, SESSION)
    fit = fit_noise_sigma(lambda sigma: predict(measured.noise(sigma))[rows], observed)
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
    task: DiscriminationRequest, measure: str, encoded: Measured, silent: IntArray, sigma: float
) -> list[Decoding]:
    """Decode one measure by every code; there is no hit rate without responses."""
    codes, seed = task.code, task.experiment.seed
    if silent.size:
        names = tuple(task.pressed[row].name for row in silent)
        return [Decoding(code=code, measure=measure, silent=names) for code in codes]
    noise, shown = encoded.noise(sigma), []
    if sigma > 0.0:
        shown = noisy_presentations(encoded.responses, noise, seed, EFFICIENCY_SESSION)
    return [_decoding(task, code, measure, encoded, noise, shown) for code in codes]


def _decoding(
    task: DiscriminationRequest,
    code: str,
    measure: str,
    encoded: Measured,
    noise: Noise,
    shown: list[Presentation],
) -> Decoding:
    settings, table = task.experiment, encoded.responses
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
        encoder = ENCODERS[code](encoded.neighbours)
        rates = discriminate_by(encoder, table, noise, settings.seed, settings.plan, session=SESSION)
        values = encoder.of_noisy(table, noise, settings.seed, SESSION, SHOWN_PRESENTATIONS)
        decoding = Decoding(
            code=code,
            measure=measure,
            hit_rate=rates.hit_rate,
            hit_rate_sd=rates.hit_rate_sd,
            statistic=TaskStatistic(mean=values.mean(axis=1), sd=values.std(axis=1, ddof=1)),
        )
        if shown:
            standard = multiplied_responses(table[0], noise, SMALLEST_SPREAD)
            statistic = encoder.statistic(standard, settings.seed, EFFICIENCY_SESSION)
            found = [presentation.of(statistic) for presentation in shown]
            shares = [efficiency(one, each.ideal()) for one, each in zip(found, shown, strict=True)]
            decoding = replace(
                decoding,
                d_prime=np.array([one.d_prime for one in found]),
                efficiency=np.array([share for share, _ in shares]),
                efficiency_error=np.array([error for _, error in shares]),
            )
    if decoding.d_prime is not None:
        decoding = replace(decoding, forced_choice=forced_choice_of(decoding.d_prime, settings.trials))
    levels = [stimulus.level for stimulus in task.pressed if stimulus.level is not None]
    # One comparison has no curve: what is asked of two stimuli is how well they are told apart.
    if len(levels) < 3 or decoding.hit_rate is None:
        return decoding
    curves = side_curves(levels, decoding.hit_rate, settings.trials, task.curve, settings.seed)
    return replace(decoding, curves=curves)


def _observed(task: DiscriminationRequest) -> TaskObservations | None:
    """Observed points with their levels, and binomial intervals where the trials are known."""
    if task.observed is None:
        return None
    points = []
    for point in task.observed.points:
        at, interval = point.at, None
        level = task.pressed[stimulus_index(task.pressed, at, "at")].level if isinstance(at, str) else at
        if point.trials:
            low, high = binomial_interval(point.hit_rate, point.trials)
            interval = float(low), float(high)
        points.append(TaskObservation(**dict(point), level=level, interval=interval))
    return TaskObservations(source=task.observed.source, points=tuple(points))


def silent_stimuli(table: FloatArray, measure: str, latest_ms: float | None = None) -> IntArray:
    if measure != "latency" or latest_ms is not None:
        return np.flatnonzero((table == (latest_ms if measure == "latency" else 0.0)).all(axis=1))
    missing = np.isnan(table)
    if not missing.any(axis=0).all():
        return np.empty(0, dtype=np.int64)
    return np.flatnonzero(missing.sum(axis=1) == missing.sum(axis=1).max())


def forced_choice_of(d_prime: FloatArray, trials: int) -> ForcedChoice:
    """Two-alternative forced choice at some d', with the intervals of an experiment."""
    proportion = ndtr(np.asarray(d_prime) / np.sqrt(2.0))
    proportions = np.array([proportion, *binomial_interval(proportion, trials)])
    d_primes = np.sqrt(2.0) * ndtri(proportions)
    return ForcedChoice(
        trials=trials, proportions=proportions, d_primes=np.where(np.isfinite(d_primes), d_primes, np.nan)
    )


def side_curves(
    levels: Sequence[float], rates: FloatArray, trials: int, settings: CurveSettings, seed: int
) -> tuple[SideCurve, ...]:
    """Psychometric curves over the distance from the standard, where the hit rate is chance, on either side.

    The intervals are those of an experiment with so many trials per comparison that finds these hit rates.
    """
    standard, others = levels[0], np.asarray(levels[1:], dtype=np.float64)
    found = []
    for side, sign in (("above", 1.0), ("below", -1.0)):
        difference = sign * (others - standard)
        order = [int(row) for row in np.argsort(difference) if difference[row] > 0.0]
        if not order:
            continue
        fit, why_not = None, None
        try:
            fit = _curve_fit(standard, sign, difference[order], rates[order], trials, settings, seed)
        except (ConvergenceError, InputError) as error:
            why_not = str(error).splitlines()[0]
        found.append(
            SideCurve(
                side=side, difference=difference[order], hit_rate=rates[order], fit=fit, why_not=why_not
            )
        )
    return tuple(found)


def _curve_fit(
    standard: float,
    sign: float,
    difference: FloatArray,
    rates: FloatArray,
    trials: int,
    settings: CurveSettings,
    seed: int,
) -> CurveFit:
    if difference.size < 2:
        raise InputError("A curve needs two comparisons on a side of the standard or more: got 1.")
    counts = np.round(rates * trials)
    lapse = None if isinstance(settings.lapse, str) else settings.lapse  # free, to be fitted
    fit = fit_psychometric(
        difference, counts, np.full(rates.size, trials), sigmoid=settings.sigmoid, lapse=lapse
    )
    wanted = settings.proportion
    threshold = fit.threshold(wanted)
    of_posterior = posterior(fit)
    at = np.linspace(0.0, 1.05 * difference[-1], CURVE_POINTS + 1)[1:]
    low, high = of_posterior.band(at, CREDIBLE)
    return CurveFit(
        sigmoid=settings.sigmoid,
        trials=trials,
        threshold=CurveThreshold(
            proportion=wanted,
            difference=threshold,
            level=standard + sign * threshold,
            over_standard=threshold / abs(standard) if standard else None,
            bootstrap_interval=(
                None if fit.is_step else bootstrap(fit, seed).threshold_interval(wanted, CREDIBLE)
            ),
            posterior_interval=of_posterior.threshold_interval(wanted, CREDIBLE),
        ),
        slope=math.nan if fit.is_step else fit.slope(wanted),
        lapse=fit.function.lapse,
        at_bounds=fit.at_bounds,
        curve=CurvePoints(
            difference=at, level=standard + sign * at, proportion=fit.predict(at), low=low, high=high
        ),
    )


@result_class
class DiscriminationFile:
    """The file `discriminate.json`."""

    format: Literal["fingerpad discrimination"] = "fingerpad discrimination"
    format_version: Literal[3] = 3
    discrimination: TaskResult
    task: DiscriminationRequest  #: What was asked, defaults included.
    afferent: dict[str, float | str]  #: By name; in a mixed population with the type, "RA.threshold".
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
