"""Receptive fields: areas, centres and hot spots of known maps; test_validation moves the probe."""

import numpy as np
import pytest

import fingerpad as fp
from fingerpad.experiments.receptive_field import ReceptiveField, places_about
from fingerpad.neuron.end_organs import EndOrgans

PLACES_MM, WIDTH_MM = places_about(4.0, 0.2), 0.6


def hill(x_mm: float, z_mm: float, spikes: float, places_mm: np.ndarray = PLACES_MM) -> np.ndarray:
    """Spikes that fall off as a Gaussian about a place."""
    away = np.hypot(places_mm[:, None] - x_mm, places_mm[None, :] - z_mm)
    return spikes * np.exp(-0.5 * (away / WIDTH_MM) ** 2)


def field(*hills: np.ndarray, places_mm: np.ndarray = PLACES_MM) -> ReceptiveField:
    counts = np.round(np.sum(hills, axis=0)).astype(int)
    return ReceptiveField(x_mm=places_mm, z_mm=places_mm, spike_count=counts, depth_mm=0.2)


def test_a_hill_has_the_area_of_its_disc_and_one_spot_at_its_top():
    finely_mm = places_about(3.0, 0.05)
    found = field(hill(0.4, -0.6, 1000.0, finely_mm), places_mm=finely_mm)
    radius_mm = WIDTH_MM * np.sqrt(2.0 * np.log(10.0))  # where a tenth of the spikes is left
    assert found.area_mm2 == pytest.approx(np.pi * radius_mm**2, rel=0.01)
    np.testing.assert_allclose(found.centre_mm, (0.4, -0.6), atol=0.01)
    np.testing.assert_allclose(found.hot_spots_mm, [(0.4, -0.6)], atol=1e-9)


def test_two_hills_are_two_spots_and_one_place_with_a_spike_less_makes_none():
    two = field(hill(-1.4, 0.0, 40.0), hill(1.4, 0.0, 30.0))
    np.testing.assert_allclose(two.hot_spots_mm, [(-1.4, 0.0), (1.4, 0.0)], atol=1e-9)
    assert not two.is_cut_off
    plateau = np.minimum(hill(0.0, 0.0, 40.0), 30.0)
    plateau[20, 20] = 29.0
    assert len(field(plateau).hot_spots_mm) == 1
    assert field(np.full_like(plateau, 3.0)).is_cut_off


def test_a_probe_that_elicits_nothing_has_no_field():
    silent = field(np.zeros((PLACES_MM.size, PLACES_MM.size)))
    assert (silent.area_mm2, len(silent.hot_spots_mm)) == (0.0, 0)
    assert np.isnan(silent.centre_mm).all()


@pytest.mark.slow
def test_an_end_organ_aside_moves_the_field_to_its_side():
    aside = EndOrgans([[[1.2, -0.8]]])
    away, own = (fp.receptive_field("RA", 0.2, ends=ends).centre_mm for ends in (aside, None))
    np.testing.assert_allclose(np.subtract(away, own), (1.2, -0.8), atol=0.1)


@pytest.mark.parametrize(
    ("wrong", "says"),
    [
        ({"depth_mm": -1.0}, "depth_mm must be greater than 0"),
        ({"afferent": "XX"}, "must be one of SAI, RA, PC, SAII"),
        ({"reach_mm": 30.0}, "reach_mm must be 1 to 100 times spacing_mm"),
        ({"reach_mm": 9.0}, "sites must lie on the volar skin"),
        ({"ends": EndOrgans.about([[0.0, 0.0], [1.0, 1.0]], 3, 0.5)}, "ends must be those of one afferent"),
        ({"probe": 3}, "probe must be of type Indenter"),
    ],
)
def test_wrong_requests_are_refused_before_the_press(wrong, says):
    with pytest.raises(fp.InputError, match=says):
        fp.receptive_field(**wrong)
