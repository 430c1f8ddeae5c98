"""Objects of a user's own, which requests take in the place of names (tests/test_composes.py)."""

from dataclasses import dataclass

import numpy as np

import fingerpad as fp


def root(traces):
    """A current in proportion to the root of what is followed."""
    return fp.Traces(traces.times_ms, 1e-5 * traces.values**0.5, quantity="current")


TRANSDUCTION = fp.OwnAfferent(root, fp.Afferent().membrane)


@dataclass(frozen=True)
class Counter:
    """An afferent that fires each time that strain energy density has risen by a step."""

    step_kpa: float = 0.05
    type: str = "counter"
    dynamic_quantity: str = "stored"
    static_quantity: str = "stored"
    rate_measure: str = "count"

    def spikes(self, traces):
        levels = np.arange(1, 500) * self.step_kpa
        trains = []
        for course in traces.values.T:
            rising = np.maximum.accumulate(course)
            reached = levels[levels <= rising[-1]]
            rising, first = np.unique(rising, return_index=True)
            trains.append(np.interp(reached, rising, traces.times_ms[first]))
        return fp.SpikeTrains.from_lists(trains)


@dataclass(frozen=True)
class Ball(fp.Indenter):
    """A ball, of which nothing but the gap is written."""

    radius_mm: float = 4.0
    store_key = "ball of the tests, 1"

    def gap(self, points_mm):
        offsets = points_mm - np.array([0.0, -self.radius_mm, 0.0])
        distance = np.linalg.norm(offsets, axis=1)
        return distance - self.radius_mm, offsets / distance[:, None]


_OWN = fp.Material(fp.Energy("b / 2 * (exp(I1 - 3) - 1) + k / 2 * (J - 1)**2", (("b", 12.0), ("k", 600.0))))
TISSUES = fp.Tissues(_OWN, _OWN, _OWN, _OWN)
COUNTER, BALL = Counter(), Ball()
COARSE = fp.Grading(17.37, 3.0, 3.0, 0.8, 0.8, 6.0, 1.3, 2, 1, 2, 2)
GRADING = fp.Grading(17.37, 3.0, 3.0, 0.7, 0.7, 6.0, 1.3, 2, 1, 2, 2)
MIXED = fp.Population.mixed({"SAI": fp.Population.grid(), "counter": fp.Population.grid(afferent=COUNTER)})
