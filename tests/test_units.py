"""Units go with the quantity: what a trace prints and plots, and sizes that no laboratory has."""

import numpy as np
import pytest

import fingerpad as fp
from fingerpad.core.units import (
    QUANTITY_UNITS,
    SKIN_QUANTITY_UNITS,
    UNITS,
    gain_unit,
    name_and_unit,
    units_of,
)
from fingerpad.experiments.recording_files import read_recordings
from fingerpad.experiments.requests.stimuli import ShiftedBar
from fingerpad.experiments.validation.observations import read_observations
from fingerpad.inference.identifiable import SPIKE_PARAMETER_NAMES
from fingerpad.skin.fields import sampled_fields
from fingerpad.skin.section import SURFACE_QUANTITIES


def traces(quantity):
    values = np.array([[0.0], [0.5], [0.4]])
    return fp.Traces([0.0, 50.0, 1000.0], values, quantity=quantity)


def test_every_quantity_that_skin_has_is_in_the_table_with_its_unit():
    fields = {name: field.unit for name, field in sampled_fields().items()}
    assert SKIN_QUANTITY_UNITS.keys() == fields.keys() | set(SURFACE_QUANTITIES)
    assert {name: QUANTITY_UNITS[name] for name in fields} == fields
    assert [QUANTITY_UNITS[name] for name in SURFACE_QUANTITIES] == ["mm", "mm", ""]


def test_units_follow_from_names_and_quantities():
    assert name_and_unit("ramp_ms") == ("ramp", "ms")
    assert name_and_unit("static_rate_hz") == ("static_rate", "spikes/s")
    assert name_and_unit("frequency_hz") == ("frequency", "Hz")
    assert name_and_unit("duty") == ("duty", "")
    ends = list(UNITS)
    assert not [(a, b) for n, a in enumerate(ends) for b in ends[n + 1 :] if b.endswith(a)]
    assert list(units_of(SPIKE_PARAMETER_NAMES).values()) == ["1/ms", "1/kPa", "1/(kPa ms)", "ms", "1"]
    assert gain_unit("dynamic_gain", "stored") == "mA ms/kPa"
    assert gain_unit("static_gain", "skin_stretch") == "mA"


@pytest.mark.parametrize(
    ("quantity", "said", "label", "attribute"),
    [
        ("stored", "stored at most 0.5 kPa)", "strain energy density [kPa]", "kPa"),
        ("deep_displacement", "deep_displacement at most 0.5 mm)", "deep displacement [mm]", "mm"),
        ("skin_stretch", "skin_stretch at most 0.5)", "skin stretch", "1"),
    ],
)
def test_traces_are_printed_plotted_and_tabulated_in_the_unit_of_their_quantity(
    quantity, said, label, attribute
):
    shown = traces(quantity)
    assert repr(shown).endswith(said)
    assert shown.plot().get_ylabel() == label
    assert shown.to_dataset()[quantity].attrs["units"] == attribute


def test_spikes_in_seconds_are_noticed_before_anything_is_pressed(tmp_path):
    path = tmp_path / "spikes.csv"
    path.write_text("shift_mm,spike_times_ms\n0,0.011 0.034 0.61\n-1,0.015 0.4\n")
    with pytest.raises(fp.InputError, match=r"must be in ms: the last of all spikes came 0.61 ms"):
        read_recordings(path, ShiftedBar())
    path.write_text("shift_mm,spike_times_ms\n0,11 34 610\n-1,15 400\n")
    assert read_recordings(path, ShiftedBar()).recordings.trains.times_ms.size == 5


def test_a_force_that_no_finger_resists_with_is_asked_back(tmp_path):
    path = tmp_path / "force.csv"
    path.write_text("indenter,depth_mm,force_n\nplate,0.5,30\n")
    with pytest.raises(fp.InputError, match=r"at most 10 N for each mm of depth_mm: got 30 N at 0.5 mm"):
        read_observations(path)
    path.write_text("indenter,depth_mm,force_n\nplate,0.5,0.03\nplate,0,0\n")
    assert read_observations(path).observed.tolist() == [0.03, 0.0]
