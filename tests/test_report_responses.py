"""Figures of any population show every receptor once, at its position, coloured by its response."""

import numpy as np
import pytest
from numpy.testing import assert_array_equal

from fingerpad import InputError, ResponseMap, SpikeTrains
from fingerpad.report import responses
from fingerpad.report.responses import draw_mixed_responses
from fingerpad.report.style import png, write_png


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
    panels = [axes for axes in responses.draw_responses({"mine": answer}).axes if axes.get_xlabel()]
    for axes, name in ((panels[0], "dynamic_rate_hz"), (panels[2], "first_spike_latency_ms")):
        silent, dots, *_ = axes.collections
        values = getattr(answer, name)
        answers = np.nan_to_num(values) > 0.0
        assert_array_equal(silent.get_offsets(), answer.positions_mm[~answers])
        assert_array_equal(dots.get_offsets(), answer.positions_mm[answers])
        assert_array_equal(dots.get_array(), values[answers])
    # Nobody fires in the hold: all hollow, and still a panel.
    assert len(panels[1].collections[0].get_offsets()) == 12


def test_a_column_has_one_scale():
    weak, strong = response(), response(gain=7.0)
    axes = responses.draw_responses({"weak": weak, "strong": strong}).axes
    panels = [panel for panel in axes if panel.get_title().endswith("dynamic ramp")]
    assert [panel.get_title() for panel in panels] == ["weak: dynamic ramp", "strong: dynamic ramp"]
    assert [panel.collections[1].get_clim() for panel in panels] == [(0.0, 77.0)] * 2


def test_receptors_in_space_are_drawn_from_below_and_dorsal_ones_are_squares():
    answer = response(columns=3)
    axes = responses.draw_responses({"mine": answer}).axes[0]
    answers = answer.dynamic_rate_hz > 0.0
    dorsal = answer.positions_mm[:, 1] > 0.0
    sides = [answers & ~dorsal, answers & dorsal]
    assert all(side.any() for side in sides)
    for dots, side in zip((axes.collections[1], axes.collections[3]), sides, strict=True):
        assert_array_equal(dots.get_offsets(), answer.positions_mm[side][:, [0, 2]])
        assert_array_equal(dots.get_array(), answer.dynamic_rate_hz[side])
    corners = [len(dots.get_paths()[0].to_polygons()[0]) for dots in axes.collections]
    assert corners[2] == corners[3] == 5
    assert corners[0] == corners[1] > 5


def test_a_picture_is_written_as_it_is_drawn_a_silent_one_too_and_nobody_is_refused(tmp_path):
    silent = ResponseMap([[0.0, 0.0]], 1.0, SpikeTrains.from_lists([[]]), [0.0], [0.0], [np.nan])
    for shown in ({"mine": response()}, {"silent": silent}):
        path = write_png(responses.draw_responses, shown, tmp_path / "deeper" / "map.png")
        assert path.read_bytes() == png(responses.draw_responses, shown)
        assert path.read_bytes().startswith(b"\x89PNG")
    with pytest.raises(InputError, match="at least one population"):
        responses.draw_responses({})


def test_a_mixed_population_has_a_raster_and_a_map_per_touch():
    maps = {"SAI": response(), "RA": response(columns=3)}
    figure = draw_mixed_responses({"press": maps, "hold": maps})
    raster, places = figure.axes[:2]
    marks = [np.array(lines.get_segments()) for lines in raster.collections]
    assert [each[:, :, 0].ravel().tolist() for each in marks] == [[5.0] * 16, [5.0] * 16]
    assert [set(np.floor(each[:, :, 1]).ravel()) for each in marks] == [{0.0}, {1.0}]
    assert [len(np.unique(each[:, 0, 1])) for each in marks] == [8, 8]
    assert [label.get_text() for label in raster.get_yticklabels()] == ["SAI\n8 of 12", "RA\n8 of 12"]
    assert [len(dots.get_offsets()) for dots in places.collections] == [4, 8, 4, 8]
    assert len(figure.axes) == 4
    assert [text.get_text() for text in places.get_legend().get_texts()] == ["SAI", "RA"]
    with pytest.raises(InputError, match="at least one response"):
        draw_mixed_responses({})
