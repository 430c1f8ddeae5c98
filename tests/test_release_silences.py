"""An SAI afferent through the whole chain: it fires in the hold and is silent once the indenter has left."""

import numpy as np
import pytest

from fingerpad import Afferent, Fingertip, Sphere, indent, repeated
from fingerpad.skin.indentation import CONTACT_POINT_MM

TOUCHES = repeated(0.8, touches=2, ramp_ms=50.0, hold_ms=400.0, pause_ms=400.0)
HOLDS, PAUSES = ((100.0, 450.0), (1000.0, 1350.0)), ((500.0, 900.0), (1400.0, 1800.0))


@pytest.fixture(scope="module")
def skin():
    return indent(Fingertip(), Sphere(curvature_per_m=287), TOUCHES)


@pytest.fixture(scope="module")
def spikes(skin):
    afferent = Afferent()
    (train,) = afferent.spikes(
        skin.sed([CONTACT_POINT_MM], afferent.dynamic_quantity, afferent.static_quantity)
    )
    return train


def test_it_fires_in_both_holds_and_not_in_the_pauses(spikes):
    def rate_hz(start, end):
        return 1000.0 * ((spikes >= start) & (spikes < end)).sum() / (end - start)

    first, second = (rate_hz(*hold) for hold in HOLDS)
    assert first > 20.0
    assert 0.8 * first < second <= first
    assert [rate_hz(*pause) for pause in PAUSES] == [0.0, 0.0]


def test_its_skin_is_unloaded_then_and_holds_less_and_less_energy(skin):
    released = np.flatnonzero(skin.times_ms >= PAUSES[1][0])
    assert not skin.force_mn[released].any()
    assert not skin.contact_area_mm2[released].any()
    sed = skin.sed([CONTACT_POINT_MM]).values[:, 0]
    assert (np.diff(sed[released]) < 0.0).all()
    assert sed[released[0]] < 0.1 * sed.max()
