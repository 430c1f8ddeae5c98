"""Hazard between given spikes against the potential of a general integrator."""

import math

import pytest
from numpy.testing import assert_allclose

from fingerpad.core.errors import InputError
from fingerpad.core.signals import SpikeTrains
from fingerpad.neuron.escape_rate import EscapeRate
from studies.escape_intensity import intensity_per_ms
from tests.test_escape_rate import NEURON, REFRACTORY, SOFT, free_potential, touched


def test_intensity_is_the_hazard_of_the_potential_since_the_last_spike():
    slow = EscapeRate(NEURON, 0.2, escape_ms=2.0)
    current = touched(2)
    spikes = SpikeTrains.from_lists([[15.0, 62.0], []])
    times = [0.0, 10.0, 15.0, 16.0, 18.0, 40.0, 60.0, 62.0, 64.9, 65.0, 250.0]
    found = intensity_per_ms(slow, current, spikes, [1, 0], times)
    for train, (site, restarts) in enumerate(((1, [0.0, 18.0, 65.0]), (0, [0.0]))):
        for row, time in enumerate(times):
            resting = train == 0 and any(spike < time < spike + REFRACTORY for spike in (15.0, 62.0))
            begin = max(begin for begin in restarts if begin <= time)
            if resting:
                assert found[row, train] == 0.0
                continue
            u = free_potential(current, site, begin, time)[-1][2](time)[0] if time > begin else 0.0
            assert_allclose(found[row, train], 0.5 * math.exp((u - 1.0) / 0.2), rtol=1e-8)


@pytest.mark.parametrize(
    ("make", "said"),
    [
        (
            lambda: intensity_per_ms(SOFT, touched(), SpikeTrains.from_lists([[]]), [0, 0], [1.0]),
            "sites needs one entry per train: got 2 for 1",
        ),
        (
            lambda: intensity_per_ms(SOFT, touched(), SpikeTrains.from_lists([[]]), [0], [1.0, 300.0]),
            "times_ms must increase within 0 ... 250 ms",
        ),
    ],
)
def test_sites_and_times_that_do_not_match_are_refused(make, said):
    with pytest.raises(InputError, match=said):
        make()
