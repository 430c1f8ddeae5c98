"""Depth of the receptor: layers of a block, recovery of a true layer, and its figure and tables."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from fingerpad.core.errors import InputError
from fingerpad.core.signals import SedTraces
from fingerpad.experiments.conditions import RECEPTOR_X_MM
from fingerpad.geometry.mesh import LAYERS
from fingerpad.inference.identifiable import six_parameters
from fingerpad.inference.rate_model import AfferentModel
from fingerpad.inference.recordings import RateRecordings
from fingerpad.report.style import png
from fingerpad.skin.sampling import SkinResponse
from sections import DEPTHS_MM, LAYER_OF_INTERVAL, layered_block
from studies import drive_depths
from studies.drive_fits import quick_method
from studies.pages import drive_study as report

TRUE_LAYER, OWN_LAYER = 4, 2
TIMES_MS = np.array([0.0, 10.0, 20.0, 30.0, 40.0, 50.0, 100.0, 300.0, 1000.0])
COURSE = np.clip(TIMES_MS / 50.0, 0.0, 1.0) ** 2
SHIFT_MM = np.linspace(-2.4, 2.4, 12)
FOUR_TRUE = [0.01, 3.0, 0.03, 50.0]


MESH = layered_block(RECEPTOR_X_MM)
WIDTH_MM = np.array([0.5, 0.5, 0.5, 1.0, 1.6, 3.0])
"""Peaks of energy below the edges of a bar, the wider the deeper."""


def felt_kpa(layer, distance_mm):
    return 0.3 + 2.0 * np.exp(-(((np.abs(distance_mm) - 1.4) / WIDTH_MM[layer]) ** 2))


def skin(shift_mm):
    """Energy that depends on the layer and is flat about the receptor, so that it is read exactly."""
    layer = np.arange(len(MESH.elements)) % MESH.shape[2]
    return SkinResponse(
        mesh=MESH,
        kinks_ms=(50.0,),
        axis_x_mm=RECEPTOR_X_MM,
        direction=np.array([0.0, 1.0, 0.0]),
        fields={
            "times_ms": TIMES_MS,
            "sed_kpa": np.outer(COURSE, felt_kpa(layer, shift_mm)),
            "work": np.zeros((9, MESH.living_epidermis.size)),
        },
        force_imbalance=0.0,
        energy_imbalance=0.0,
        penetration_mm=0.0,
        newton_steps=0,
        factorisations=0,
        linear_solver="none",
    )


SKINS = [skin(shift) for shift in SHIFT_MM]


def recordings():
    sed = SedTraces(TIMES_MS, np.outer(COURSE, felt_kpa(TRUE_LAYER, SHIFT_MM)), [50.0])
    rates = AfferentModel.of_traces(sed).evaluate(six_parameters(FOUR_TRUE))
    return RateRecordings(tuple(f"{shift:g}" for shift in SHIFT_MM), *rates)


@pytest.fixture(scope="module")
def found():
    method = replace(quick_method(), n_refined=1, difference_steps=(0.1,))
    return drive_depths.result(SKINS, recordings(), np.random.default_rng(0), method)


def test_borders_are_those_of_the_mesh_below_the_receptor():
    assert_allclose(drive_depths.borders_mm(MESH), DEPTHS_MM, rtol=1e-12)


def test_every_layer_is_read_and_no_other_leaks_in():
    site = [[RECEPTOR_X_MM, 0.0]]
    for layer in range(6):
        read = drive_depths.read_in(SKINS[3], layer).sed(site).sed_kpa[:, 0]
        assert_allclose(read, COURSE * felt_kpa(layer, SHIFT_MM[3]), rtol=1e-9)
    own = drive_depths.read_in(SKINS[3], OWN_LAYER)
    assert_array_equal(own.sed(site).sed_kpa, SKINS[3].sed(site).sed_kpa)


def test_what_is_not_kept_there_is_not_made_up():
    with pytest.raises(InputError, match=r"quantity must be one of stored, .*: got 'work'"):
        drive_depths.read_in(SKINS[0], 1).sample("work", [[RECEPTOR_X_MM, 0.0]])
    for layer in (-1, 6):
        with pytest.raises(InputError, match=f"one of the 6 of this mesh, from 0: got {layer}"):
            drive_depths.read_in(SKINS[0], layer)


def test_the_depth_that_made_the_rates_predicts_them_best(found):
    layers = found.layers
    assert [layer.tissue for layer in layers] == [LAYERS[tissue] for tissue in LAYER_OF_INTERVAL]
    assert found.own_layer == OWN_LAYER
    scores = [layer.fit.fss_out_of_sample for layer in layers]
    assert np.argmax(scores) == TRUE_LAYER
    assert scores[TRUE_LAYER] > 0.98
    assert scores[OWN_LAYER] < scores[TRUE_LAYER] - 0.03
    assert layers[TRUE_LAYER].fit.gain_interval[0] > 0.0
    assert layers[OWN_LAYER].fit.gain_interval == (0.0, 0.0)
    assert [layer.from_mm for layer in layers[1:]] == [layer.to_mm for layer in layers[:-1]]
    assert layers[5].largest_sed_kpa == pytest.approx(felt_kpa(5, SHIFT_MM).max(), rel=1e-6)


def test_the_figure_and_the_text_name_the_depth(found):
    section = SimpleNamespace(depths=found)
    (axes,) = report.draw_depths(section).axes
    lines = {line.get_label(): line for line in axes.lines}
    for label, phase in (("both, weighted", ""), ("dynamic rates", "_dynamic"), ("static rates", "_static")):
        drawn = lines[label].get_ydata().tolist()
        assert drawn == [getattr(layer.fit, f"fss_out_of_sample{phase}") for layer in found.layers]
    assert_allclose(lines["both, weighted"].get_xdata(), (DEPTHS_MM[:-1] + DEPTHS_MM[1:]) / 2.0)
    assert "[mm]" in axes.get_xlabel()
    assert png(report.draw_depths, section).startswith(b"\x89PNG")
    assert "between 1.00 and 1.62 mm, in the dermis" in report.caption_depths(section)
    table = report.depth_table(found)
    assert table.title == "Sampling depth"
    assert [row.cells[0] for row in table.rows] == [LAYERS[tissue] for tissue in LAYER_OF_INTERVAL]
    assert table.rows[TRUE_LAYER].cells[5] == f"{found.layers[TRUE_LAYER].fit.fss_out_of_sample:.3f}"
    assert all(len(row.cells) == len(table.columns) for row in table.rows)
