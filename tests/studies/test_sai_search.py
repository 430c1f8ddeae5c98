"""The search for an SAI afferent: areas from rays, and what it may choose, on a skin given by a formula."""

from dataclasses import replace

import numpy as np
import pytest

import fingerpad as fp
from fingerpad.data import afferents as published
from fingerpad.experiments.conditions import RECEPTOR_X_MM, Conditions
from studies import sai_search
from studies.sai_search import BOUNDS, Recordings, afferent_at, search

CONDITIONS = Conditions(resolution="quick")
START = fp.Afferent()
STRONG = replace(START, end_organs=1, intercept_ma=0.0, dynamic_gain=0.0, static_gain=1e-6)


class Disc:
    """Stress within a radius of the receptor, and none beyond."""

    def __init__(self, radius_mm):
        self.radius_mm = radius_mm

    def sed(self, sites, dynamic_quantity="stored", static_quantity="stored"):
        along = CONDITIONS.along_skin
        away = np.hypot((sites[:, 0] - RECEPTOR_X_MM) / along, sites[:, 1])
        course = np.outer([0.0, 1.0, 1.0], 8.0 * (away < self.radius_mm))
        times, kinks = [0.0, 50.0, 1000.0], [50.0]
        dynamic = fp.Traces(times, course, quantity=dynamic_quantity)
        return fp.Traces(times, course, kinks, static_quantity, dynamic)


def recordings(radius_mm):
    skins = dict.fromkeys(published.FIELD_DEPTHS.value, Disc(radius_mm)) | {"bar": Disc(2.2)}
    return Recordings(skins, CONDITIONS)


def test_the_area_is_that_of_the_disc_that_elicits_spikes():
    for radius_mm in (0.55, 1.35, 2.15):
        areas = recordings(radius_mm).areas_mm2(STRONG)
        np.testing.assert_allclose(areas, np.pi * radius_mm**2, rtol=1e-9)
    silent = replace(STRONG, static_gain=1e-12)
    assert recordings(1.35).areas_mm2(silent).tolist() == [0.0] * 5


def test_a_search_lowers_what_is_missed_within_the_ranges(monkeypatch):
    monkeypatch.setattr(sai_search, "POLISHING", 40)
    seen = recordings(1.35)
    found = search(seen, START, None)
    assert seen.missed(found) < seen.missed(START)
    for name, (low, high) in BOUNDS.items():
        assert low <= getattr(found, name) <= high
    assert found.intercept_ma < found.rheobase_ma
    assert (found.end_organs, found.static_quantity) == (6, "von_mises")


def test_a_point_is_the_afferent_with_its_numbers():
    point = np.array([np.log(1e-3), np.log(5e-7), np.log(100.0), -1e-7, 0.3, 0.4])
    found = afferent_at(point, START)
    assert [getattr(found, name) for name in BOUNDS] == pytest.approx([1e-3, 5e-7, 100.0, -1e-7, 0.3, 0.4])
