"""d': difference between two stimuli in standard deviations, independent of response bias.

    d' = z(H) - z(F)                            equal spread
    d_a = sqrt(2 / (1 + s^2)) (z(H) - s z(F))   spread of no signal over that of signal, s
    c  = -(z(H) + z(F)) / 2                     criterion, from midway

H and F are the rates of hits and false alarms, z the inverse of the normal distribution. Source: Macmillan &
Creelman 2005, Detection Theory, chapters 1 and 3.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from scipy.special import ndtri

from fingerpad.core.checks import one_of, positive, whole
from fingerpad.core.errors import InputError

CORRECTIONS = ("log-linear", "half", "none")


@dataclass(frozen=True)
class Sensitivity:
    """Detectability of a signal, and criterion of the observer.

    Parameters
    ----------
    d_prime : float
        d', or d_a where the spreads differ. [standard deviations]
    criterion : float
        c; positive for a conservative observer. [standard deviations]
    hit_rate, false_alarm_rate : float
        As corrected. [0-1]
    """

    d_prime: float
    criterion: float
    hit_rate: float
    false_alarm_rate: float


def sensitivity(
    n_hits: int,
    n_signals: int,
    n_false_alarms: int,
    n_others: int,
    *,
    correction: str = "log-linear",
    spread_ratio: float = 1.0,
) -> Sensitivity:
    """Return d' from hits and false alarms of a detection task.

    Parameters
    ----------
    n_hits, n_signals : int
        Responses "yes", and presentations, of the signal or the comparison.
    n_false_alarms, n_others : int
        Responses "yes", and presentations, without the signal or of the standard.
    correction : {"log-linear", "half", "none"}, optional
        Correction of rates of 0 and 1, for which d' is infinite: (k + 1/2) / (n + 1) for every rate (Hautus
        1995), 1/2 in place of a count of 0 and n - 1/2 in place of n, or none: then such rates are refused.
    spread_ratio : float, optional
        s, standard deviation without the signal over that with it: 1 gives d', others d_a.

    Examples
    --------
    >>> found = sensitivity(84, 100, 16, 100, correction="none")
    >>> round(found.d_prime, 2), abs(round(found.criterion, 2))
    (1.99, 0.0)
    """
    one_of("correction", correction, CORRECTIONS)
    s = positive("spread_ratio", spread_ratio)
    hits = _rate("n_hits", n_hits, "n_signals", n_signals, correction)
    false_alarms = _rate("n_false_alarms", n_false_alarms, "n_others", n_others, correction)
    z_hits, z_false_alarms = float(ndtri(hits)), float(ndtri(false_alarms))
    return Sensitivity(
        d_prime=math.sqrt(2.0 / (1.0 + s**2)) * (z_hits - s * z_false_alarms),
        criterion=-0.5 * (z_hits + z_false_alarms),
        hit_rate=hits,
        false_alarm_rate=false_alarms,
    )


def _rate(of: str, count: int, among: str, total: int, correction: str) -> float:
    k, n = whole(of, count, 0), whole(among, total, 1)
    if k > n:
        raise InputError(f"{of} must not exceed {among}: got {k} of {n}.")
    if correction == "log-linear":
        return (k + 0.5) / (n + 1.0)
    if correction == "half":
        return min(max(k, 0.5), n - 0.5) / n
    if k in (0, n):
        raise InputError(
            f"{of} is {k} of {n}, for which d' is infinite: choose the correction 'log-linear' or 'half'."
        )
    return k / n
