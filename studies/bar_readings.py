"""Two readings of the rates under the bar that the paper leaves open, with one table each.

*Intervals.* Equations 7 and 8 sum the intervals l ... m and divide by m - l, which is one less than their
number; the text calls m - l the number of intervals, and speaks of averaging reciprocal intervals.

*Body.* The text calls a stimulus "bar" in some places and "location-grating shift" in others: the bar of 3 mm
may have been one ridge of a grating.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from fingerpad.core.checks import FloatArray
from fingerpad.core.results import Number, Vector, result_class
from fingerpad.core.signals import SpikeTrains
from fingerpad.core.units import MS_PER_S
from fingerpad.data import bar_firing_rates, protocol
from fingerpad.experiments.conditions import Conditions, Touch
from fingerpad.experiments.gerling2014 import single_unit
from fingerpad.experiments.manifest import Manifest
from fingerpad.experiments.runner import Runner
from fingerpad.geometry.edged_indenters import Grating
from fingerpad.geometry.indenters import Bar
from fingerpad.inference.afferent_methods import (
    bounds_of,
    by_differences,
    fitted_six,
    four_number_problem,
)
from fingerpad.inference.fitting.cross_validation import cross_validate, interleaved_folds
from fingerpad.inference.rate_model import (
    AfferentModel,
    RateModel,
    Rates,
    evaluate_rows,
)
from fingerpad.neuron.afferent import PARAMETER_NAMES, Afferent
from fingerpad.neuron.rate_windows import PAPER_WINDOWS_MS
from fingerpad.neuron.transduction import Drive, drive

USED = "all intervals that close in the window over their number (used)"
LITERAL = "all intervals that close in the window, over one less (as printed)"
INSIDE = "intervals between spikes within the window, over their number"
RECIPROCAL = "mean of the reciprocals of all intervals that close in the window (the text)"
INTERVALS = (USED, LITERAL, INSIDE, RECIPROCAL)
"""Readings of Eqs. 6-10."""

BAR = "bar alone"
GROOVES_MM = (1.0, 3.0, 5.0)
"""Widths of the grooves beside ridges as wide as the bar. Gratings of 3 and 5 mm were recorded from (Lesniak
& Gerling 2009, read); 1 mm is the narrow end (assumed). [mm]"""


def counted_rates_hz(spikes: SpikeTrains, window_ms: tuple[float, ...], reading: str) -> FloatArray:
    """Rate of every train in a window, by one reading of Eqs. 6-10.

    Parameters
    ----------
    spikes : SpikeTrains
        One train per stimulus.
    window_ms : (float, float)
        Start, which is excluded, and end, which is included. [ms]
    reading : str
        One of `INTERVALS`.

    Returns
    -------
    array (n_trains,)
        0 where a reading leaves no interval. [spikes/s]

    Examples
    --------
    >>> train = SpikeTrains.from_lists([[20.0, 35.0, 45.0]])
    >>> [float(counted_rates_hz(train, (30.0, 50.0), reading)[0].round(1)) for reading in INTERVALS]
    [80.0, 40.0, 100.0, 83.3]
    """
    start, end = window_ms
    opening, closing = spikes.times_ms[:-1], spikes.times_ms[1:]
    train = np.searchsorted(spikes.offsets, np.arange(1, spikes.times_ms.size), side="right") - 1
    chosen = (np.isin(np.arange(1, spikes.times_ms.size), spikes.offsets, invert=True)) & (closing > start)
    chosen &= closing <= end
    if reading == INSIDE:
        chosen &= opening > start
    interval_ms, train = (closing - opening)[chosen], train[chosen]

    def per_train(values: FloatArray) -> FloatArray:
        return np.bincount(train, values, minlength=len(spikes)).astype(np.float64)

    count = per_train(np.ones_like(interval_ms))
    if reading == RECIPROCAL:
        total, over = per_train(MS_PER_S / interval_ms), count
    else:
        total = MS_PER_S * (np.maximum(count - 1.0, 0.0) if reading == LITERAL else count)
        over = per_train(interval_ms)
    return np.divide(total, over, out=np.zeros(len(spikes)), where=over > 0.0)


@dataclass(frozen=True)
class CountedModel:
    """The paper's model of one afferent with its intervals counted by one reading; a `RateModel`.

    Parameters
    ----------
    driven : Drive
        One column per stimulus.
    reading : str
        One of `INTERVALS`.
    """

    driven: Drive
    reading: str

    @property
    def names(self) -> tuple[str, ...]:
        """Names of beta, k_d, k_s, tau, C, v."""
        return PARAMETER_NAMES

    @property
    def n_stimuli(self) -> int:
        """Number of stimuli."""
        return self.driven.n_sites

    def evaluate(self, parameters: FloatArray) -> Rates:
        """Rates (n_stimuli,) for six parameters. [spikes/s]"""
        follows = {name: getattr(self.driven, name) for name in ("dynamic_quantity", "static_quantity")}
        spikes = Afferent.from_parameters(parameters, **follows).spikes(self.driven)
        dynamic, static = (counted_rates_hz(spikes, window, self.reading) for window in PAPER_WINDOWS_MS)
        return dynamic, static

    def evaluate_batch(self, points: FloatArray) -> Rates:
        """Rates (n_points, n_stimuli) for rows of six parameters. [spikes/s]"""
        return evaluate_rows(self, points)


@result_class
class ReadingRates:
    """Rates under the bar by one reading.

    Parameters
    ----------
    reading : str
        Which.
    dynamic_rate_hz, static_rate_hz : array (n_shifts,)
        Of the afferent that is fitted to the first reading. [spikes/s]
    dynamic, static : Modulation
        Of these rates at the edge.
    fss_same_afferent : float
        Of these rates.
    fss_in_sample, fss_out_of_sample : float
        Of an afferent fitted to this reading: all shifts, and mean of the folds.
    """

    reading: str
    dynamic_rate_hz: Vector
    static_rate_hz: Vector
    dynamic: single_unit.Modulation
    static: single_unit.Modulation
    fss_same_afferent: Number
    fss_in_sample: Number
    fss_out_of_sample: Number


@result_class
class BarReadings:
    """Result of `python -m studies bar-readings`.

    Parameters
    ----------
    quantity : str
        What drives both terms of the current.
    shift_mm : array (n_shifts,)
        Shifts of the bar, proximal positive. [mm]
    observed_dynamic_hz, observed_static_hz : array (n_shifts,)
        Recorded rates. [spikes/s]
    intervals : tuple of ReadingRates
        By reading of Eqs. 6-10.
    bodies : tuple of ReadingRates
        The bar alone, then one ridge of a grating by the width of the grooves.
    manifest : Manifest
        What ran.
    """

    quantity: str
    shift_mm: Vector
    observed_dynamic_hz: Vector
    observed_static_hz: Vector
    intervals: tuple[ReadingRates, ...]
    bodies: tuple[ReadingRates, ...]
    manifest: Manifest


def grating_touches(conditions: Conditions, groove_mm: float) -> list[Touch]:
    """Press a grating at all shifts in the place of the bar, which becomes its ridge at the centre.

    Parameters
    ----------
    conditions : Conditions
        Finger, tissues and accuracy.
    groove_mm : float
        Width of a groove. Ridges have the width and the edges of the bar. [mm]
    """
    bar = Bar()
    grating = Grating(bar.width_mm, groove_mm, bar.fillet_mm)
    return [replace(touch, indenter=grating) for touch in single_unit.bar_touches(conditions)]


def compare(models: dict[str, RateModel], driven: dict[str, Drive]) -> tuple[ReadingRates, ...]:
    """Fit the first model, predict with the others, and fit each of them.

    Parameters
    ----------
    models : dict of RateModel
        Models of the six parameters by reading, one stimulus per shift.
    driven : dict of Drive
        Their drives, which set the bounds of the fit.
    """
    recordings, shift_mm = single_unit.bar_recordings(), np.array(protocol.BAR_SHIFTS.value)
    everything = np.arange(shift_mm.size)
    fitted: FloatArray | None = None
    found = []
    for reading, model in models.items():
        problem, method = four_number_problem(model, recordings), by_differences(bounds_of(driven[reading]))
        own = method.fit(problem, everything)
        fitted = own.parameters if fitted is None else fitted
        dynamic, static = model.evaluate(fitted_six(fitted))
        found.append(
            ReadingRates(
                reading=reading,
                dynamic_rate_hz=dynamic,
                static_rate_hz=static,
                dynamic=single_unit.edge_modulation(shift_mm, dynamic),
                static=single_unit.edge_modulation(shift_mm, static),
                fss_same_afferent=problem.score(fitted, everything),
                fss_in_sample=own.score,
                fss_out_of_sample=cross_validate(
                    problem, method, interleaved_folds(everything.size)
                ).score_test,
            )
        )
    return tuple(found)


def run(runner: Runner, conditions: Conditions) -> BarReadings:
    """Press bar and gratings at all shifts, and compare both kinds of readings.

    Parameters
    ----------
    runner : Runner
        Where indentations are stored.
    conditions : Conditions
        Finger, tissues and accuracy.

    Returns
    -------
    BarReadings
    """
    touches = {BAR: single_unit.bar_touches(conditions)} | {
        f"ridge of a grating, grooves of {groove_mm:g} mm": grating_touches(conditions, groove_mm)
        for groove_mm in GROOVES_MM
    }
    pressed = runner.responses({body: dict(enumerate(each)) for body, each in touches.items()})
    quantity = conditions.quantity
    driven = {
        body: drive(single_unit.receptor_sed(list(responses.values()), quantity, quantity))
        for body, responses in pressed.items()
    }
    with runner.stage("fits", 2) as advance:
        intervals = compare(
            {reading: CountedModel(driven[BAR], reading) for reading in INTERVALS},
            dict.fromkeys(INTERVALS, driven[BAR]),
        )
        advance()
        bodies = compare({body: AfferentModel.of_drive(each) for body, each in driven.items()}, driven)
        advance()
    observed = bar_firing_rates()
    return BarReadings(
        quantity=quantity,
        shift_mm=observed.shift_mm,
        observed_dynamic_hz=observed.dynamic_rate_hz,
        observed_static_hz=observed.static_rate_hz,
        intervals=intervals,
        bodies=bodies,
        manifest=runner.manifest(conditions),
    )
