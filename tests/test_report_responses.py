"""Figures of any population show every receptor once, in the place and colour of its answer."""

import numpy as np
import pytest
from numpy.testing import assert_array_equal

from fingerpad.errors import InputError
from fingerpad.report import responses
from fingerpad.report.appearance import png, write_png
from fingerpad.signals import ResponseMap, SpikeTrains


def response(columns: int = 2, count: int = 12, gain: float = 1.0) -> ResponseMap:
    """Receptors at random; every third stays silent."""
    generator = np.random.default_rng(columns)
    fires = np.arange(count) % 3 > 0
    return ResponseMap(
        positions_mm=generator.normal(size=(count, columns)) * 3.0,
        pitch_mm=1.0,
        spikes=SpikeTrains.from_lists([[5.0] if own else [] for own in fires]),
        dynamic_rate_hz=np.where(fires, gain * np.arange(count), 0.0),
        static_rate_hz=np.zeros(count),
        first_spike_latency_ms=np.where(fires, 5.0 + np.arange(count), np.nan),
    )


def test_receptors_that_answer_have_the_colour_of_it_and_the_others_none():
    answer = response()
    panels = [axes for axes in responses.draw({"mine": answer}).axes if axes.get_xlabel()]
    for axes, name in ((panels[0], "dynamic_rate_hz"), (panels[2], "first_spike_latency_ms")):
        silent, dots = axes.collections
        values = getattr(answer, name)
        answers = np.nan_to_num(values) > 0.0
        assert_array_equal(silent.get_offsets(), answer.positions_mm[~answers])
        assert_array_equal(dots.get_offsets(), answer.positions_mm[answers])
        assert_array_equal(dots.get_array(), values[answers])
    # Nobody fires in the hold: all hollow, and still a panel.
    assert len(panels[1].collections[0].get_offsets()) == 12


def test_a_column_has_one_scale_and_one_window():
    weak, strong = response(), response(gain=7.0)
    axes = responses.draw({"weak": weak, "strong": strong}).axes
    assert [panel.get_title() for panel in axes[:2]] == ["weak: dynamic ramp", "strong: dynamic ramp"]
    limits = [panel.collections[1].get_clim() for panel in axes[:2]]
    assert limits == [(0.0, 77.0)] * 2
    assert axes[0].get_xlim() == axes[1].get_xlim()
    assert axes[0].get_ylim() == axes[1].get_ylim()


def test_receptors_in_space_keep_all_three_coordinates():
    answer = response(columns=3)
    axes = responses.draw({"mine": answer}).axes[0]
    dots = np.array([axes.collections[1]._offsets3d[axis] for axis in range(3)]).T
    answers = answer.positions_mm[answer.dynamic_rate_hz > 0.0][:, [0, 2, 1]]
    assert {tuple(place) for place in dots} == {tuple(place) for place in answers}


def test_a_population_that_stays_silent_is_drawn_hollow():
    silent = ResponseMap([[0.0, 0.0]], 1.0, SpikeTrains.from_lists([[]]), [0.0], [0.0], [np.nan])
    assert png(responses.draw, {"silent": silent}).startswith(b"\x89PNG")


def test_nobody_is_refused():
    with pytest.raises(InputError, match="at least one population"):
        responses.draw({})


def test_a_picture_is_written_as_it_is_drawn(tmp_path):
    path = write_png(responses.draw, {"mine": response()}, tmp_path / "deeper" / "map.png")
    assert path.read_bytes() == png(responses.draw, {"mine": response()})
