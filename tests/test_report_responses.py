"""Figures of a population of several types: a band of spikes and marks on the map for each type."""

import numpy as np

from fingerpad import ResponseMap, SpikeTrains
from fingerpad.report.style import png, write_png
from studies.afferents_page import draw_mixed_responses


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


def test_a_picture_is_written_as_it_is_drawn(tmp_path):
    shown = {"press": {"SAI": response()}}
    path = write_png(tmp_path / "deeper" / "map.png", draw_mixed_responses, shown)
    assert path.read_bytes() == png(draw_mixed_responses, shown)
    assert path.read_bytes().startswith(b"\x89PNG")


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
