"""Level 2: when an afferent fires under the bar, and which term drives it (paper, 2.1, 2.2.2, 4.4)."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
from scipy.interpolate import interp1d

from fingerpad.core.checks import FloatArray
from fingerpad.core.results import Number, Vector, result_class
from fingerpad.core.signals import Traces
from fingerpad.data import bar_firing_rates, protocol
from fingerpad.experiments.conditions import RECEPTOR_X_MM
from fingerpad.experiments.gerling2014.skin_force import PLATE_DEPTHS_MM, plate
from fingerpad.neuron.afferent import Afferent
from fingerpad.neuron.population import Population
from fingerpad.neuron.rate_windows import PAPER_WINDOWS_MS
from fingerpad.skin.sampling import SkinResponse


@result_class
class FiringCourse:
    """Course of the firing and of the current under the bar, shift by shift, and rates by depth."""

    peak_ms: Vector
    """End of the shortest interval between spikes, (n_shifts,); NaN with fewer than two spikes. [ms]"""
    window_ms: tuple[float, float]
    """The paper's window of the dynamic rate. [ms]"""
    dynamic_share_ramp: Vector
    """Share of the dynamic term in the charge of both terms in the ramp, (n_shifts,). [1]"""
    dynamic_share_hold: Vector
    """The same in the hold, (n_shifts,). [1]"""
    sed_r2: Number
    """R² of the line from SED in the middle of the static window to the observed static rates. [1]"""
    depth_mm: Vector
    """Depths of a flat plate, (n_depths,). [mm]"""
    static_rate_by_depth_hz: Vector
    """Static rate at these depths, mean of the population, (n_depths,). [spikes/s]"""

    @property
    def fires(self) -> np.ndarray:
        """Shifts at which there are at least two spikes, (n_shifts,)."""
        return np.isfinite(self.peak_ms)


def firing_course(
    drive: Traces, sed: Traces, afferent: Afferent, pressed: Mapping[str, SkinResponse]
) -> FiringCourse:
    """Read when the fitted afferent fires and what drives it."""
    observed, (dynamic_ms, static_ms) = bar_firing_rates(), PAPER_WINDOWS_MS
    population = Population.grid(afferent=afferent, centre_mm=(RECEPTOR_X_MM, 0.0))
    in_hold = interp1d(sed.times_ms, sed.values, axis=0)(0.5 * (static_ms[0] + static_ms[1]))
    ramp_ms, end_ms = protocol.RAMP.value, float(drive.times_ms[-1])
    return FiringCourse(
        peak_ms=np.array([_peak_ms(train) for train in afferent.spikes(drive)]),
        window_ms=(dynamic_ms[0], dynamic_ms[1]),
        dynamic_share_ramp=_dynamic_share(drive, afferent, 0.0, ramp_ms),
        dynamic_share_hold=_dynamic_share(drive, afferent, ramp_ms, end_ms),
        sed_r2=float(np.corrcoef(in_hold, observed.static_rate_hz)[0, 1] ** 2),
        depth_mm=np.array(PLATE_DEPTHS_MM),
        static_rate_by_depth_hz=np.array(
            [population.respond(pressed[plate(depth)]).static_rate_hz.mean() for depth in PLATE_DEPTHS_MM]
        ),
    )


def _peak_ms(spikes_ms: FloatArray) -> float:
    """End of the shortest interval between spikes, NaN with fewer than two spikes. [ms]"""
    return float(spikes_ms[1 + np.diff(spikes_ms).argmin()]) if spikes_ms.size > 1 else np.nan


def _dynamic_share(drive: Traces, afferent: Afferent, start_ms: float, end_ms: float) -> FloatArray:
    """Share of the dynamic term in the charge of both terms from a start to an end, (n_sites,); 0 without."""
    transduction = afferent.transduction
    static, dynamic = (
        _charge(replace(transduction, intercept_ma=0.0, **{other: 0.0}).current(drive), start_ms, end_ms)
        for other in ("dynamic_gain", "static_gain")
    )
    both = static + dynamic
    return np.divide(dynamic, both, out=np.zeros_like(both), where=both > 0.0)


def _charge(current: Traces, start_ms: float, end_ms: float) -> FloatArray:
    """Integral of a current whose knots include both times, (n_sites,). [mA ms]"""
    first = np.searchsorted(current.times_ms, start_ms, side="right") - 1
    last = np.searchsorted(current.times_ms, end_ms, side="left")
    within = slice(first, last + 1)
    return np.asarray(np.trapezoid(current.values[within], current.times_ms[within], axis=0))
