"""Published numbers: each has a source and a status, and they agree with each other."""

from dataclasses import FrozenInstanceError
from pathlib import Path

import numpy as np
import pytest

from fingerpad import data
from fingerpad.data import (
    STATUSES,
    Published,
    all_published,
    fingertip,
    neuron,
    paper,
    protocol,
    psychophysics,
    tissues,
)
from refusals import refusals


def test_every_file_of_numbers_is_collected() -> None:
    assert {entry.stem for entry in Path(data.__file__).parent.glob("tables/*.toml")} == set(data.TOPICS)


def test_names_are_unique_and_statuses_known() -> None:
    names = [number.name for number in all_published()]
    assert len(set(names)) == len(names)
    assert {number.status for number in all_published()} == set(STATUSES)
    with pytest.raises(FrozenInstanceError):
        protocol.DEPTH.value = 2.0  # type: ignore[misc]


GOOD = {"name": "depth", "value": 1.0, "unit": "mm", "source": "here", "status": "paper"}


test_published_refuses_numbers_without_a_story = refusals(
    ({"status": "guessed"}, "status of depth must be one of paper, read, recalled, assumed: got 'guessed'"),
    ({"name": " "}, "as name"),
    ({"unit": ""}, "as unit"),
    ({"source": ""}, "as source"),
    ({"value": float("nan")}, "depth must be a finite number"),
    ({"value": (1.0, float("inf"))}, "depth must be a finite number"),
    ({"value": ()}, "at least one number"),
    call=lambda change: Published(**GOOD | change),
)  # fmt: skip


def test_geometry_is_consistent():
    layers = fingertip.STRATUM_CORNEUM.value + fingertip.LIVING_EPIDERMIS.value
    assert layers == pytest.approx(fingertip.RECEPTOR_DEPTH.value, abs=1e-12)
    x, y = fingertip.CONTACT_POINT.value
    assert fingertip.VOLAR_Y.value[fingertip.STATIONS_X.value.index(x)] == y
    assert 2 * max(fingertip.HALF_WIDTH_Z.value) == pytest.approx(fingertip.FULL_WIDTH.value, abs=0.05)
    volar, dorsal = np.array(fingertip.BONE_VOLAR_Y.value), np.array(fingertip.BONE_DORSAL_Y.value)
    assert fingertip.SPINE_Y.value == pytest.approx((volar + dorsal).mean() / 2, abs=0.4)
    assert fingertip.BONE_HEIGHT.value == pytest.approx((dorsal - volar).max() / 2, abs=0.3)
    assert fingertip.NAIL_X.value[0] < fingertip.BONE_TIP_X.value < fingertip.NAIL_X.value[1]


def test_hyperfoams_are_as_soft_as_published():
    assert tissues.WU_EPIDERMIS_YOUNG.value > tissues.MAENO_EPIDERMIS_YOUNG.value
    for mu, expected_young_kpa in (
        (tissues.WU_SKIN_HYPERFOAM_MU, 3.25),
        (tissues.WU_SUBCUTIS_HYPERFOAM_MU, 1.6),
    ):
        young_kpa = 2 * sum(mu.value) * (1 + tissues.WU_HYPERFOAM_POISSON.value)
        assert young_kpa == pytest.approx(expected_young_kpa, rel=0.02)


def test_windows_lie_in_their_phases_and_bar_shifts_are_the_36_positions_of_the_figure():
    end = protocol.RAMP.value + protocol.HOLD.value
    assert 0 < protocol.DYNAMIC_WINDOW.value[0] < protocol.DYNAMIC_WINDOW.value[1] <= protocol.RAMP.value
    assert protocol.RAMP.value < protocol.STATIC_WINDOW.value[0] < protocol.STATIC_WINDOW.value[1] <= end
    shifts = np.array(protocol.BAR_SHIFTS.value)
    assert shifts.size == 36
    np.testing.assert_allclose(shifts, -shifts[::-1], atol=1e-12)
    np.testing.assert_allclose(np.diff(shifts), 0.2, atol=1e-12)


def test_start_points_differ_in_the_gains_only_and_the_scale_keeps_their_ratio() -> None:
    first, second = neuron.DYNAMIC_GAIN_START_1.value, neuron.DYNAMIC_GAIN_START_2.value
    assert second / first == pytest.approx(1.025)
    assert 1e-4 <= first * neuron.DYNAMIC_GAIN_SCALE.value <= 4e-4
    assert 1e-4 <= second * neuron.DYNAMIC_GAIN_SCALE.value <= 4e-4


def test_assumed_spheres_are_never_called_the_papers() -> None:
    spheres = [getattr(psychophysics, f"SPHERE_{each:.0f}") for each in psychophysics.SPHERE_CURVATURES.value]
    statuses = {sphere.value: sphere.status for sphere in spheres}
    assumed = dict.fromkeys((316.0, 328.0, 340.0), "assumed")
    assert statuses == dict.fromkeys((287.0, 296.0, 365.0), "paper") | {305.0: "read"} | assumed
    assert psychophysics.SPHERE_CURVATURES.status == "assumed"
    assert (np.diff(psychophysics.SPHERE_CURVATURES.value) > 0).all()
    assert psychophysics.SPHERE_CURVATURES.value[0] == protocol.STANDARD_CURVATURE.value


def test_paper_differences_follow_from_its_extremes() -> None:
    difference = paper.DYNAMIC_RATE_MAXIMUM.value - paper.DYNAMIC_RATE_MINIMUM.value
    assert difference == pytest.approx(paper.DYNAMIC_RATE_DIFFERENCE.value, abs=1.0)
