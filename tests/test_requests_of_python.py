"""Requests of `fp.reduce`, `fp.fit`, `fp.validate` and `fp.sweep` by keywords, with objects of Python."""

from dataclasses import dataclass

import numpy as np
import pytest

import fingerpad as fp
from fingerpad.experiments.conditions import Conditions
from fingerpad.experiments.requests.stimuli import ListedStimuli, NamedStimulus
from fingerpad.neuron.lif import LeakyIntegrateAndFire
from fingerpad.neuron.spikes import firing_rate_hz

COARSE = fp.Grading(17.37, 2.0, 2.0, 0.6, 0.6, 3.0, stratum_corneum=1, dermis=2, subcutis=2)
SOFT = fp.named_tissues("human").scaled(0.8)
COMMON = {"resolution": "quick", "tissues": SOFT, "grading": COARSE}


@dataclass(frozen=True)
class Ball(fp.Indenter):
    """A ball of one's own."""

    radius_mm: float = 5.0

    def gap(self, points_mm):
        off = points_mm - [0.0, -self.radius_mm, 0.0]
        far = np.linalg.norm(off, axis=1)
        return far - self.radius_mm, off / far[:, None]


@dataclass(frozen=True)
class Steady:
    """An afferent of one's own: stress charges a membrane."""

    gain_ma: float = 3e-7
    dynamic_quantity: str = "compressive_stress"
    static_quantity: str = "compressive_stress"

    def spikes(self, sed):
        current = fp.Traces(sed.times_ms, self.gain_ma * sed.values, quantity="current")
        return LeakyIntegrateAndFire(60.0, 1e-6, 50.0, 1.0).spikes(current)


PRESS = {"depth_mm": 0.4, "hold_ms": 300}


def test_an_own_object_is_reduced_with_what_an_own_afferent_follows():
    model = fp.reduce(object=Ball(), range={"depth_mm": 0.4}, calibration=0, afferents=Steady(), **COMMON)
    assert "compressive_stress" in model.quantities
    assert fp.ReducedTouch(model, [(17.37, 0.0)]).step(100.0, depth_mm=0.4).force_mn > 1.0


def test_an_own_object_is_validated_in_own_tissues(tmp_path):
    (tmp_path / "mine.csv").write_text("indenter,depth_mm,force_n\nmine,0.3,0.05\n")
    asked = {"observations": tmp_path / "mine.csv", "objects": {"mine": Ball()}} | COMMON
    soft, human = (
        fp.validate(**asked | more).predictions[0].predicted for more in ({}, {"tissues": "human"})
    )
    assert soft == pytest.approx(0.8 * human, rel=1e-3)


def test_the_numbers_of_an_own_object_vary_in_a_sweep(tmp_path):
    touch = {"object": Ball(), "motion": PRESS, "afferents": Steady()} | COMMON
    done = fp.sweep(touch=touch, grid={"object.radius_mm": [3.0, 6.0]}, out=tmp_path / "study.zarr")
    small, large = fp.open_sweep(done.path).force_mn.max("time").values
    assert small < large


def test_the_number_of_an_own_afferent_is_fitted():
    depths_mm = (0.2, 0.3, 0.4, 0.5, 0.6)
    stimuli = {
        f"{depth}": NamedStimulus(Ball(), fp.RampAndHold(depth, hold_ms=300.0), name=f"{depth}")
        for depth in depths_mm
    }
    presented = ListedStimuli(stimuli, conditions=Conditions("quick", tissues=SOFT, grading=COARSE))
    traces = [
        fp.touch(object=Ball(), motion=PRESS | {"depth_mm": depth}, **COMMON).skin.sed(
            [(17.37, 0.0)], "compressive_stress", "compressive_stress"
        )
        for depth in depths_mm
    ]
    known = Steady(6e-7)
    rates = [firing_rate_hz(known.spikes(each), (100.0, 350.0))[0] for each in traces]
    assert len(set(rates)) > 2
    found = fp.fit(
        recordings=fp.RateRecordings(tuple(stimuli), None, rates), stimuli=presented, afferent=Steady(),
        free=["gain_ma"], windows_ms={"static": (100.0, 350.0), "dynamic": (20.0, 50.0)},
    )  # fmt: skip
    assert found.fitted["gain_ma"] == pytest.approx(known.gain_ma, rel=0.1)
