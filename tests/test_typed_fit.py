"""Fits of RA, PC and SAII afferents, and of a class of one's own, to rates that they made."""

from dataclasses import dataclass, replace

import numpy as np
import pytest

import fingerpad as fp
from fingerpad.inference.afferent_fit import TypedModel, fit_afferent
from fingerpad.neuron.lif import LeakyIntegrateAndFire
from refusals import refusals

NAMES = ("a", "b", "c", "d", "e", "f")


@dataclass(frozen=True)
class Steady:
    """An afferent of one's own: stress over a threshold charges a membrane."""

    gain_ma: float = 1e-7
    dynamic_quantity: str = "compressive_stress"
    static_quantity: str = "compressive_stress"

    def spikes(self, sed: fp.Traces) -> fp.SpikeTrains:
        membrane = LeakyIntegrateAndFire(60.0, 1e-6, 50.0, 1.0)
        return membrane.spikes(fp.Traces(sed.times_ms, self.gain_ma * sed.values, quantity="current"))


def ramps(quantity, heights):
    course = np.outer([0.0, 1.0, 0.9], heights)
    return fp.Traces([0.0, 50.0, 1000.0], course, [50.0], quantity=quantity)


@pytest.mark.parametrize(
    ("afferent", "free", "factor", "heights"),
    [
        (fp.RA(), ["threshold"], 2.0, [4.0, 6.0, 9.0, 13.0, 18.0, 25.0]),
        (fp.PC(), ["threshold"], 2.0, [0.3, 0.5, 0.9, 1.4, 2.0, 5.0]),
        (fp.SAII(), ["static_gain", "dynamic_gain"], 1.5, [0.04, 0.06, 0.09, 0.13, 0.18, 0.25]),
        (Steady(), ["gain_ma"], 3.0, [16.0, 18.0, 20.0, 23.0, 26.0, 30.0]),
    ],
    ids=lambda value: type(value).__name__,
)
def test_numbers_of_any_type_are_found_again(afferent, free, factor, heights):
    traces = ramps(afferent.static_quantity, heights)
    known = replace(afferent, **{name: factor * getattr(afferent, name) for name in free})
    dynamic, static = TypedModel(known, (), [traces]).evaluate(np.empty(0))
    assert dynamic.all()
    recorded = fp.RateRecordings(NAMES, dynamic, static if static.all() else None)
    found = fit_afferent(afferent, free, traces, recorded)
    assert found.fss_in_sample > 0.98
    assert found.fss_out_of_sample > 0.9
    for name in free:  # one to three spikes of a PC determine its threshold within a fifth
        assert getattr(found.afferent, name) == pytest.approx(getattr(known, name), rel=0.25)
    again, _ = TypedModel(found.afferent, (), [traces]).evaluate(np.empty(0))
    np.testing.assert_array_equal(found.dynamic_rate_hz, again)


TWO = ramps("compressive_stress", [5.0, 9.0]), fp.RateRecordings(NAMES[:2], [10.0, 20.0], None)

test_numbers_that_cannot_be_fitted_are_refused = refusals(
    ((fp.RA(), ["treshold"]), r"free must be one of .*did you mean threshold"),
    ((fp.RA(), []), "free must name at least one number of RA, one of .*: got none"),
    ((fp.RA(), ["quantity"]), r"quantity must be greater than 0|must be a finite number"),
    ((fp.Afferent(intercept_ma=0.0), ["intercept_ma"]), "intercept_ma must be greater than 0"),
    ((len, ["threshold"]), "afferent must be like AnyAfferent, with"),
    call=lambda chosen: fit_afferent(*chosen, *TWO),
)
