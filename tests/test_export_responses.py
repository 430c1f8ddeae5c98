"""A response written as a table and read back by the standard library is the same response."""

import csv

import numpy as np
import pytest
from numpy.testing import assert_array_equal

from fingerpad.errors import InputError, StoreError
from fingerpad.export.responses import write_response_csv
from fingerpad.response_maps import recruitment_rank
from fingerpad.signals import ResponseMap, SpikeTrains


def random_response(columns: int) -> ResponseMap:
    generator = np.random.default_rng(3)
    trains = [np.cumsum(generator.exponential(17.0, count)) for count in generator.integers(0, 6, size=40)]
    return ResponseMap(
        positions_mm=generator.normal(size=(40, columns)),
        pitch_mm=1.0,
        spikes=SpikeTrains.from_lists(trains),
        dynamic_rate_hz=generator.exponential(100.0, 40),
        static_rate_hz=generator.exponential(30.0, 40),
        first_spike_latency_ms=[train[0] if train.size else np.nan for train in trains],
    )


@pytest.mark.parametrize(("columns", "places"), [(2, ["x_mm", "z_mm"]), (3, ["x_mm", "y_mm", "z_mm"])])
def test_every_number_comes_back_to_the_last_bit(tmp_path, columns, places):
    response = random_response(columns)
    with open(write_response_csv(response, tmp_path / "deeper" / "map.csv"), encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    assert [int(row["receptor"]) for row in rows] == list(range(40))

    def column(name: str) -> list[float]:
        return [float(row[name] or "nan") for row in rows]

    assert_array_equal(np.transpose([column(name) for name in places]), response.positions_mm)
    for name in ("dynamic_rate_hz", "static_rate_hz", "first_spike_latency_ms"):
        assert_array_equal(column(name), getattr(response, name))
    assert_array_equal(column("recruitment_rank"), recruitment_rank(response.first_spike_latency_ms))
    for receptor, row in enumerate(rows):
        assert_array_equal([float(time) for time in row["spike_times_ms"].split()], response.spikes[receptor])
    assert np.isnan(column("first_spike_latency_ms")).any()


def test_what_is_no_response_is_refused_and_nothing_is_written(tmp_path):
    with pytest.raises(InputError, match="response must be of type ResponseMap"):
        write_response_csv([1.0], tmp_path / "map.csv")
    assert list(tmp_path.iterdir()) == []


def test_a_file_in_the_way_of_a_folder_is_named(tmp_path):
    (tmp_path / "taken").write_text("")
    with pytest.raises(StoreError, match="taken"):
        write_response_csv(random_response(2), tmp_path / "taken" / "map.csv")
