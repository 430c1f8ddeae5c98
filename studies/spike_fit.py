"""Spike trains of the fitted afferent, made noisy, and the afferent found again in them.

No spike times of this experiment are public, only rates. What a fit to spikes could tell is therefore shown
on spikes whose parameters are known: the afferent that was fitted to the rates, with a soft threshold, under
the bar at all its positions. The same fit is then tried on spikes that other noise made.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from scipy.special import ndtri
from scipy.stats import kstwo

from fingerpad.core.checks import FloatArray, finite
from fingerpad.core.errors import ConvergenceError, InputError
from fingerpad.core.random_streams import Presentations
from fingerpad.core.results import Matrix, Number, Vector, result_class
from fingerpad.core.signals import SedTraces, SpikeTrains
from fingerpad.core.units import MS_PER_S
from fingerpad.data import protocol
from fingerpad.experiments.conditions import Conditions
from fingerpad.experiments.manifest import Manifest
from fingerpad.experiments.runner import Runner
from fingerpad.inference.identifiable import (
    SPIKE_PARAMETER_NAMES,
    SPIKE_PARAMETER_UNITS,
    identifiable,
)
from fingerpad.inference.spike_fit import SpikeFit, fit_spikes, soft_membrane, soft_spikes
from fingerpad.inference.spike_likelihood import (
    SpikeLikelihood,
    time_rescaling,
)
from fingerpad.inference.start_points import spike_start
from fingerpad.neuron.afferent import Afferent
from fingerpad.neuron.transduction import Drive, drive
from studies import isi_variability
from studies.escape_intensity import intensity_per_ms
from studies.fitted_bars import fit_bars
from studies.isi_variability import CORRELATION_MS, SOFT_THRESHOLD, STEP_MS, IsiVariability
from studies.membrane_noise import (
    CorrelatedCurrentNoise,
    MembraneNoise,
    ThresholdNoise,
    WhiteCurrentNoise,
)
from studies.noisy_lif import noisy_spikes

WIDTH = 0.2
"""Width of the true threshold over the threshold."""

POSITIVE = np.array([False, False, False, True, True])
"""Whether a parameter is positive: tau and the width are."""

N_REPEATS = 5
LEVEL = 0.95
PIECES = 8
"""Linear pieces of the drive per interval of mechanics: spikes are made and fitted with the same ones."""

OTHER_AMOUNT = 0.3
"""Of each other noise; its meaning is that of `studies.isi_variability`."""

N_QUANTILES = 100
SHOWN_MS = (0.0, 250.0)
SHOWN_STEP_MS = 0.5


def truth(driven: Drive, afferent: Afferent, seed: int) -> FloatArray:
    """Return the true parameters: those of the afferent, with its gains rescaled to a soft threshold.

    A soft threshold fires early. The three gains are multiplied by what keeps the rate of the held afferent.

    Parameters
    ----------
    driven : Drive
        Strain energy density under each position of the bar.
    afferent : Afferent
        Fitted to the rates.
    seed : int
        Of the run.

    Returns
    -------
    array (5,)
    """
    current_ma = isi_variability.largest_held_current_ma(driven, afferent)
    kept = isi_variability.held_at_its_rate(SOFT_THRESHOLD, afferent.membrane, current_ma, WIDTH, seed)
    four = identifiable(afferent.parameters)
    return np.array([*(kept.current_factor * four[:3]), four[3], WIDTH])


@result_class
class TimeRescalingTest:
    """Intervals rescaled by the fitted intensity, which are uniform if the model made the spikes.

    Parameters
    ----------
    share, quantile : array (n_quantiles,)
        Uniform quantiles, and those of the rescaled intervals. [1]
    distance, p_value : float
        Largest distance of both distributions, and its p-value. [1]
    distance_of_truth : float
        The same with the true parameters. [1]
    limit : float
        What chance allows at the level of the study. [1]
    """

    share: Vector
    quantile: Vector
    distance: Number
    p_value: Number
    distance_of_truth: Number
    limit: Number


@result_class
class Recovery:
    """The afferent recovered from its own spikes.

    Parameters
    ----------
    n_spikes : int
        In all trains.
    level : float
        Confidence of the intervals. [1]
    start, truth, estimate, standard_error, low, high : array (5,)
        In the order of `SPIKE_PARAMETER_NAMES`.
    n_held : int
        Intervals that hold the truth.
    correlation : array (5, 5)
        Of the estimates.
    log_likelihood, log_likelihood_of_truth : float
        At the estimate and at the truth.
    n_steps : int
        Of the fit.
    rescaled : TimeRescalingTest
        Goodness of fit.
    """

    n_spikes: int
    level: float
    start: Vector
    truth: Vector
    estimate: Vector
    standard_error: Vector
    low: Vector
    high: Vector
    n_held: int
    correlation: Matrix
    log_likelihood: Number
    log_likelihood_of_truth: Number
    n_steps: int
    rescaled: TimeRescalingTest


@result_class
class Raster:
    """Spikes of the first presentations, and the intensity at one position.

    Parameters
    ----------
    shift_mm : array (n_positions,)
        Of the bar. [mm]
    spikes_ms : tuple of array (n_spikes,)
        At each position. [ms]
    shown : int
        Number of the position with most spikes.
    times_ms : array (n_times,)
        Times of the intensity. [ms]
    intensity_hz : dict of str to array (n_times,)
        Of "truth" and "fitted". [1/s]
    """

    shift_mm: Vector
    spikes_ms: tuple[Vector, ...]
    shown: int
    times_ms: Vector
    intensity_hz: dict[str, Vector]


@result_class
class OtherNoise:
    """A soft threshold fitted to spikes that other noise made; None where it could not be fitted.

    Parameters
    ----------
    name : str
        Of the noise.
    amount : float
        As in `studies.isi_variability`. [1]
    n_spikes : int
        In all trains.
    estimate : array (5,) or None
        In the order of `SPIKE_PARAMETER_NAMES`.
    over_truth : array (4,) or None
        Estimates of the identifiable numbers over their true values. [1]
    distance, limit : float or None
        Of `TimeRescalingTest`. [1]
    dynamic_rate_error_hz, static_rate_error_hz : float or None
        Root mean square over the positions. [spikes/s]
    """

    name: str
    amount: float
    n_spikes: int
    estimate: Vector | None = None
    over_truth: Vector | None = None
    distance: float | None = None
    limit: float | None = None
    dynamic_rate_error_hz: float | None = None
    static_rate_error_hz: float | None = None


@result_class
class SpikeFits:
    """Spike trains of the fitted afferent: noise, recovery, and the effect of other noise on a fit.

    Parameters
    ----------
    n_repeats, n_positions : int
        Presentations per position, and positions of the bar.
    names, units : tuple of str
        Of the five parameters.
    variability : IsiVariability
        Of the held afferent.
    recovery : Recovery or None
        None for an afferent that is silent or spikes that cannot be fitted.
    raster : Raster or None
        As `recovery`.
    other_noise : tuple of OtherNoise
        A row per source.
    """

    n_repeats: int
    n_positions: int
    names: tuple[str, ...]
    units: tuple[str, ...]
    variability: IsiVariability
    recovery: Recovery | None
    raster: Raster | None
    other_noise: tuple[OtherNoise, ...]


@result_class
class SpikeFitStudy:
    """Result of `python -m studies spike-fit`.

    Parameters
    ----------
    spike_fit : SpikeFits
        Spikes and their fits.
    manifest : Manifest
        What ran.
    """

    spike_fit: SpikeFits
    manifest: Manifest


def run(runner: Runner, conditions: Conditions) -> SpikeFitStudy:
    """Press the bar at all shifts, fit the afferent to the rates, simulate its spikes and fit these.

    Parameters
    ----------
    runner : Runner
        Where indentations are stored.
    conditions : Conditions
        Finger, tissues, accuracy and seed.

    Returns
    -------
    SpikeFitStudy
    """
    fitted = fit_bars(runner, conditions)
    with runner.stage("spikes", 1) as advance:
        shift_mm = np.array(protocol.BAR_SHIFTS.value)
        found = result(fitted.sed, fitted.afferent, shift_mm, conditions.seed)
        advance()
    return SpikeFitStudy(spike_fit=found, manifest=runner.manifest(conditions))


def result(sed: SedTraces, afferent: Afferent, shift_mm: FloatArray, seed: int) -> SpikeFits:
    """Simulate spikes of an afferent with a soft threshold and with other noise, and fit them.

    Parameters
    ----------
    sed : SedTraces
        Strain energy density at the receptor, one column per position of the bar.
    afferent : Afferent
        Fitted to the rates; it has to fire in the hold.
    shift_mm : array (n_sites,)
        Positions of the bar. [mm]
    seed : int
        Of the run.

    Returns
    -------
    SpikeFits
    """
    driven = drive(sed, pieces=PIECES)
    variability = isi_variability.result(driven, afferent, seed)
    recovery, raster = None, None
    others: tuple[OtherNoise, ...] = ()
    if variability.rate_hz > 0.0:
        true = truth(driven, afferent, seed)
        presentations = Presentations.of_one_afferent(sed.n_sites, N_REPEATS)
        recorded = SpikeLikelihood(
            driven, soft_spikes(driven, true, presentations, seed), presentations.sites
        )
        fit = _fit_if_possible(recorded)
        if fit is not None:
            recovery, raster = _recovery(recorded, fit, true), _raster(recorded, fit, true, shift_mm)
        others = _other_noise(driven, afferent, presentations, seed)
    return SpikeFits(
        n_repeats=N_REPEATS,
        n_positions=sed.n_sites,
        names=SPIKE_PARAMETER_NAMES,
        units=SPIKE_PARAMETER_UNITS,
        variability=variability,
        recovery=recovery,
        raster=raster,
        other_noise=others,
    )


def _fit_if_possible(recorded: SpikeLikelihood) -> SpikeFit | None:
    """Fit, or None for spikes that are too few or too regular: that is a finding, not a failure."""
    try:
        return fit_spikes(recorded, spike_start())
    except (ConvergenceError, InputError):
        return None


def interval(fit: SpikeFit, level: float) -> FloatArray:
    """Confidence interval of each parameter, symmetric for the gains, in the logarithm for tau and width.

    Parameters
    ----------
    fit : SpikeFit
        Estimates and their standard errors.
    level : float
        Probability that such intervals contain the true value. [0-1]

    Returns
    -------
    array (5, 2)
        Lower and upper end.

    Raises
    ------
    InputError
        If the level does not lie between 0 and 1.
    """
    if not 0.0 < finite("level", level) < 1.0:
        raise InputError(f"level must lie between 0 and 1: got {level!r}.")
    reach = ndtri(0.5 + 0.5 * level) * fit.standard_errors
    relative = reach / np.abs(fit.parameters)
    return np.stack(
        [
            np.where(POSITIVE, fit.parameters * np.exp(sign * relative), fit.parameters + sign * reach)
            for sign in (-1.0, 1.0)
        ],
        axis=1,
    )


def _recovery(recorded: SpikeLikelihood, fit: SpikeFit, true: FloatArray) -> Recovery:
    low, high = interval(fit, LEVEL).T
    rescaled = time_rescaling(recorded, fit.parameters)
    shares = (np.arange(N_QUANTILES) + 0.5) / N_QUANTILES
    return Recovery(
        n_spikes=fit.n_spikes,
        level=LEVEL,
        start=spike_start(),
        truth=true,
        estimate=fit.parameters,
        standard_error=fit.standard_errors,
        low=low,
        high=high,
        n_held=int(((low < true) & (high > true)).sum()),
        correlation=fit.covariance / np.outer(fit.standard_errors, fit.standard_errors),
        log_likelihood=fit.log_likelihood,
        log_likelihood_of_truth=recorded.log_likelihood(true),
        n_steps=len(fit.history) - 1,
        rescaled=TimeRescalingTest(
            share=shares,
            quantile=np.quantile(rescaled.quantiles, shares),
            distance=rescaled.statistic,
            p_value=rescaled.p_value,
            distance_of_truth=time_rescaling(recorded, true).statistic,
            limit=kstwo.ppf(LEVEL, fit.n_spikes),
        ),
    )


def _raster(recorded: SpikeLikelihood, fit: SpikeFit, true: FloatArray, shift_mm: FloatArray) -> Raster:
    """First presentation of each position, and the intensity at the one that makes the afferent fire most."""
    n_sites = recorded.drive.n_sites
    first = [recorded.trains[number] for number in range(n_sites)]
    busiest = int(np.argmax([train.size for train in first]))
    times = np.arange(SHOWN_MS[0], SHOWN_MS[1], SHOWN_STEP_MS)
    train = SpikeTrains.from_lists([first[busiest]])
    intensity_hz = {}
    for name, parameters in (("truth", true), ("fitted", fit.parameters)):
        soft, current = soft_membrane(recorded.drive, parameters)
        intensity_hz[name] = MS_PER_S * intensity_per_ms(soft, current, train, [busiest], times)[:, 0]
    return Raster(
        shift_mm=shift_mm, spikes_ms=tuple(first), shown=busiest, times_ms=times, intensity_hz=intensity_hz
    )


def _other_noise(
    driven: Drive, afferent: Afferent, presentations: Presentations, seed: int
) -> tuple[OtherNoise, ...]:
    """Fit a soft threshold to spikes that the afferent made with a hard one and other noise."""
    current = afferent.transduction.current(driven)
    held_ma = isi_variability.largest_held_current_ma(driven, afferent)
    sources = {
        "white noise of the current": MembraneNoise(
            current=WhiteCurrentNoise(OTHER_AMOUNT * held_ma * CORRELATION_MS**0.5, STEP_MS)
        ),
        f"noise of the current, correlated over {CORRELATION_MS:g} ms": MembraneNoise(
            current=CorrelatedCurrentNoise(OTHER_AMOUNT * held_ma, CORRELATION_MS, STEP_MS)
        ),
        "threshold, new for each interval": MembraneNoise(threshold=ThresholdNoise(OTHER_AMOUNT)),
    }
    rows = []
    for name, noise in sources.items():
        trains = noisy_spikes(afferent.membrane, current, noise, seed, presentations, afferent.intercept_ma)
        recorded = SpikeLikelihood(driven, trains, presentations.sites)
        fit = _fit_if_possible(recorded)
        found: dict[str, Any] = {}
        if fit is not None:
            found = {
                "estimate": fit.parameters,
                "over_truth": fit.parameters[:4] / identifiable(afferent.parameters),
                "distance": time_rescaling(recorded, fit.parameters).statistic,
                "limit": kstwo.ppf(LEVEL, fit.n_spikes),
                **_rate_errors(recorded, fit, presentations, seed),
            }
        rows.append(OtherNoise(name=name, amount=OTHER_AMOUNT, n_spikes=recorded.n_spikes, **found))
    return tuple(rows)


def _rate_errors(
    recorded: SpikeLikelihood, fit: SpikeFit, presentations: Presentations, seed: int
) -> dict[str, float]:
    """Root mean square over the positions of the difference in mean rate, fitted less recorded. [spikes/s]"""
    again = soft_spikes(recorded.drive, fit.parameters, presentations, seed + 1)
    windows = {"dynamic": protocol.DYNAMIC_WINDOW.value, "static": protocol.STATIC_WINDOW.value}
    errors = {}
    for phase, window in windows.items():
        ours, theirs = (_mean_rates_hz(trains, presentations, window) for trains in (again, recorded.trains))
        errors[f"{phase}_rate_error_hz"] = float(np.sqrt(np.mean((ours - theirs) ** 2)))
    return errors


def _mean_rates_hz(
    trains: SpikeTrains, presentations: Presentations, window_ms: tuple[float, ...]
) -> FloatArray:
    """Spikes per time in a window, at each site over all its presentations."""
    owners = np.repeat(np.arange(len(trains)), np.diff(trains.offsets))
    inside = (trains.times_ms > window_ms[0]) & (trains.times_ms <= window_ms[1])
    counts = np.bincount(owners[inside], minlength=len(trains))
    n_sites = int(presentations.sites.max()) + 1
    totals = np.bincount(presentations.sites, weights=counts, minlength=n_sites)
    repeats = np.bincount(presentations.sites, minlength=n_sites)
    return MS_PER_S * totals / (repeats * (window_ms[1] - window_ms[0]))
