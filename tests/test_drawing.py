"""Results draw themselves, show a picture in notebooks, and say in one line what they are."""

import matplotlib
import numpy as np
import pytest
from matplotlib.figure import Figure

import fingerpad as fp
from fingerpad.core.errors import InputError
from fingerpad.psychophysics.psychometric import fit_psychometric
from fingerpad.report.drawing import DRAWINGS


@pytest.fixture(scope="module")
def results():
    """One result of each type that draws itself, by the name of the type."""
    finger = fp.Fingertip()
    skin = fp.indent(finger, fp.Sphere(radius_mm=4.0), fp.RampAndHold(depth_mm=0.6, hold_ms=60))
    response = fp.Population.grid(density_per_cm2=200).respond(skin, static_window_ms=(60, 110))
    return {
        "SkinResponse": skin,
        "ResponseMap": response,
        "SpikeTrains": response.spikes,
        "SedTraces": skin.sed([(17.37, 0.0), (19.0, 0.0)]),
        "PsychometricFit": fit_psychometric([10.0, 20.0, 40.0], [55, 70, 95], [100] * 3),
        "Fingertip": finger,
    }


@pytest.mark.parametrize(("kind", "what"), [(kind, what) for kind in DRAWINGS for what in DRAWINGS[kind]])
def test_every_drawing_fills_axes_that_say_what_they_show(results, kind, what):
    axes = Figure().add_subplot()
    assert results[kind].plot(axes, what) is axes
    assert axes.has_data()
    assert axes.get_xlabel()
    assert axes.get_ylabel()


def test_drawings_show_the_numbers_of_the_result(results):
    skin, axes = results["SkinResponse"], Figure().add_subplot()
    (line,) = skin.plot(axes).lines
    assert line.get_ydata().tolist() == skin.force_mn.tolist()
    shown = results["ResponseMap"].plot(Figure().add_subplot(), "map", quantity="dynamic_rate_hz")
    assert shown.collections[0].get_array().tolist() == results["ResponseMap"].dynamic_rate_hz.tolist()
    pad = skin.plot(Figure().add_subplot(), "pad", quantity="compressive_stress", reach_mm=2.0)
    middle = skin.sample("compressive_stress", [(skin.axis_x_mm, 0.0)])[-1, 0]
    assert pad.collections[0].get_array().reshape(61, 61)[30, 30] == pytest.approx(middle, rel=1e-9)


def test_without_axes_a_figure_of_pyplot_is_made(results):
    matplotlib.use("agg")
    from matplotlib import pyplot

    axes = results["SkinResponse"].plot()
    assert axes.figure is pyplot.gcf()
    pyplot.close(axes.figure)


@pytest.mark.parametrize("kind", DRAWINGS)
def test_a_notebook_shows_a_small_picture_and_one_line(results, kind):
    html, line = results[kind]._repr_html_(), repr(results[kind])
    assert 'src="data:image/png;base64,iVBOR' in html
    assert len(html) < 150_000
    assert "\n" not in line
    assert 20 < len(line) < 160


def test_unknown_drawings_and_quantities_are_refused(results):
    with pytest.raises(InputError, match="what must be one of force, section"):
        results["SkinResponse"].plot(what="sed")
    with pytest.raises(InputError, match="quantity must be one of"):
        results["ResponseMap"].plot(Figure().add_subplot(), "map", quantity="rate")


def test_results_become_tables_and_data_sets(results):
    skin, response = results["SkinResponse"], results["ResponseMap"]
    table = response.to_pandas()
    assert table.static_rate_hz.tolist() == response.static_rate_hz.tolist()
    assert table.spikes.sum() == response.spikes.times_ms.size
    assert np.array_equal(skin.to_xarray(response).force_mn.values, skin.force_mn)


def test_silent_afferents_are_drawn_as_silent():
    axes = fp.SpikeTrains.from_lists([[], []]).plot(Figure().add_subplot())
    assert "no afferent fires" in axes.texts[0].get_text()
