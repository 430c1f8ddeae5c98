"""Readings of SED at the epidermal-dermal border."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

import fingerpad as fp
from fingerpad.geometry.mesh import LAYERS
from studies.sed_readings import READINGS, read_as


@pytest.fixture(scope="module")
def skin():
    """A touch whose SED is 3 kPa in the living epidermis, 1 kPa in the dermis and 0 elsewhere."""
    pressed = fp.indent(
        fp.Fingertip(), fp.Sphere(curvature_per_m=287), fp.RampAndHold(depth_mm=0.02), resolution="quick"
    )
    tissue = np.array(LAYERS)[pressed.mesh.layer]
    sed = 3.0 * (tissue == "living epidermis") + 1.0 * (tissue == "dermis")
    return pressed.with_fields(sed_kpa=np.tile(sed, (pressed.times_ms.size, 1)))


@pytest.mark.parametrize(("reading", "expected"), list(zip(READINGS, (3.0, 1.0, 2.0, 2.0), strict=True)))
def test_each_reading_takes_its_side_of_the_border(skin, reading, expected):
    assert_allclose(read_as(skin, reading).sed([(17.37, 0.0), (16.0, 2.0)]).sed_kpa, expected, rtol=1e-9)


def test_the_average_at_the_node_keeps_lines_and_smooths_a_peak():
    """Bilinear from element means to nodes and back: a lone element keeps a quarter of its value."""
    rows, columns = np.meshgrid(np.arange(7.0), np.arange(9.0), indexing="ij")
    at_node, line, peak = READINGS["average at the node"], 2.0 * rows - columns, np.zeros((7, 9))
    peak[3, 4] = 1.0
    inner = (slice(None), slice(1, -1), slice(1, -1))
    assert_allclose(at_node(line[None], line[None])[inner], line[None][inner], rtol=1e-12, atol=1e-12)
    assert at_node(peak[None], peak[None])[0, 3, 4] == 0.25
    assert at_node(peak[None], peak[None]).sum() == pytest.approx(1.0)
