from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from scipy.stats import kstest

import fingerpad as fp
from fingerpad.core.errors import TissuesWarning
from fingerpad.core.regions import jittered
from fingerpad.neuron.end_organs import EndOrgans
from fingerpad.neuron.population import CENTRE_MM, sensitivities
from refusals import refusals
from sections import SED_DRIVEN, SENSITIVE


class Bump:
    """A skin whose SED falls off with the distance from a point."""

    def __init__(self, x_mm, z_mm, peak_kpa=4.0, width_mm=2.0):
        self.centre, self.peak_kpa, self.width_mm = np.array([x_mm, z_mm]), peak_kpa, width_mm

    def sed(self, sites):
        squared = np.square(np.asarray(sites) - self.centre).sum(axis=1)
        peaks = self.peak_kpa * np.exp(-squared / self.width_mm**2)
        return fp.Traces([0.0, 50.0, 1000.0], np.outer([0.0, 1.0, 0.9], peaks), kinks_ms=[50.0])


def test_the_papers_population_is_3_by_6_at_1_mm_and_any_lattice_is_symmetric_at_its_density():
    population = fp.Population.grid()
    x, z = population.positions_mm.T
    assert population.pitch_mm == 1.0
    assert_allclose(np.unique(x), [16.37, 17.37, 18.37], rtol=1e-14)
    assert_array_equal(np.unique(z), [-2.5, -1.5, -0.5, 0.5, 1.5, 2.5])
    assert len({tuple(position) for position in population.positions_mm}) == 18
    for density in (25.0, 70.0, 400.0):
        pitch = fp.Population.grid(density, rows=2, columns=2).pitch_mm
        assert_allclose(100.0 / pitch**2, density, rtol=1e-14)
    positions = fp.Population.grid(70.0, rows=4, columns=5, centre_mm=(10.0, 2.0)).positions_mm
    mirrored = np.array([20.0, 4.0]) - positions
    assert_allclose(positions[np.lexsort(positions.T)], mirrored[np.lexsort(mirrored.T)], rtol=1e-12)


def test_the_default_grid_follows_the_finger_that_is_touched_and_others_stay():
    skin, child = Bump(13.0, 0.0), fp.Population.grid(centre_mm=(13.0, 0.0), afferent=SENSITIVE)
    skin.pad_mm = (13.0, 0.0)
    response, expected = fp.Population.grid(afferent=SENSITIVE).respond(skin), child.respond(skin)
    assert_allclose(response.positions_mm, expected.positions_mm, rtol=1e-12)
    assert_allclose(response.static_rate_hz, expected.static_rate_hz, rtol=1e-9)
    assert response.static_rate_hz.max() > 0.0
    mixed = fp.Population.mixed({"SAI": fp.Population.grid(afferent=SENSITIVE)}).respond(skin)
    assert_array_equal(mixed["SAI"].positions_mm, response.positions_mm)
    stays = fp.Population.grid(centre_mm=CENTRE_MM, afferent=SENSITIVE).respond(skin)
    assert_array_equal(stays.positions_mm, fp.Population.grid().positions_mm)
    branched = replace(fp.Population.grid(rows=1, columns=1), ends=EndOrgans([[[17.0, 0.0]]]))
    assert branched.on(skin) is branched


def test_each_receptor_answers_what_a_lone_afferent_would_answer_there():
    population, skin = fp.Population.grid(afferent=SENSITIVE), Bump(17.0, 0.3)
    response = population.respond(skin)
    assert len(response.spikes) == 18
    for receptor, position in enumerate(population.positions_mm):
        sed = skin.sed([position])
        assert_array_equal(response.spikes[receptor], population.afferent.spikes(sed)[0])
        dynamic_hz, static_hz = population.afferent.rates(sed)
        assert response.dynamic_rate_hz[receptor] == dynamic_hz[0]
        assert response.static_rate_hz[receptor] == static_hz[0]


class OneTrace:
    def sed(self, sites):
        return fp.Traces([0.0, 1.0], [[0.0], [1.0]])


test_what_cannot_be_used_is_refused = refusals(
    (lambda: fp.Population([[1.0, 2.0, 3.0, 4.0]], 1.0), "rows of x and z"),
    (lambda: fp.Population([[1.0, 2.0]], 0.0), ("pitch_mm",)),
    (lambda: fp.Population.grid(density_per_cm2=-1.0), ("density_per_cm2",)),
    (lambda: fp.Population.grid(rows=0), ("rows",)),
    (lambda: sensitivities(0, 0.4, 1), ("count",)),
    (lambda: sensitivities(3, -0.4, 1), ("spread",)),
    (lambda: fp.Population([[1.0, 2.0]], 1.0, sensitivity=[1.0, 1.0]), "per receptor, 1: got 2"),
    (lambda: fp.Population([[1.0, 2.0]], 1.0, sensitivity=[0.0]), "the smallest 0"),
    (lambda: fp.Population([[1.0, 2.0]], 1.0, places_mm=[[1.0, 2.0, 3.0]]), "a pair per receptor"),
    (lambda: fp.Population.grid(afferent=SED_DRIVEN).respond(OneTrace()),
     "one trace per receptor: got 1 for"),
    (lambda: fp.Population.grid(afferent=fp.Afferent()).respond(OneTrace()),
     r"'stored' and 'von_mises': got OneTrace\.sed\(sites\); add them, or use an afferent"),
)  # fmt: skip


class BumpWithStress(Bump):
    """The same skin, which also knows a stress: wider than the energy."""

    def sed(self, sites, dynamic_quantity="stored", static_quantity="stored"):
        traces = super().sed(sites)
        stress = np.sqrt(traces.values)
        values = {"stored": traces.values, "compressive_stress": stress, "von_mises": 8.0 * stress}
        followed = {
            name: fp.Traces(traces.times_ms, values[name], traces.kinks_ms, quantity=name)
            for name in (dynamic_quantity, static_quantity)
        }
        dynamic = None if dynamic_quantity == static_quantity else followed[dynamic_quantity]
        return replace(followed[static_quantity], dynamic=dynamic)


def test_the_default_afferent_warns_of_other_tissues_and_their_own_does_not():
    skin = BumpWithStress(17.37, 0.0)
    for own in ("", "human"):
        skin.tissues_name = own
        assert fp.Population.grid(rows=1, columns=1).respond(skin).spikes
    skin.tissues_name = "paper"
    with pytest.warns(TissuesWarning, match=r"the skin has 'paper': give .*for_tissues\('paper'\)") as found:
        fp.Population.grid(rows=1, columns=1).respond(skin)
    assert found[0].filename == __file__
    fp.Population.grid(rows=1, columns=1, afferent=fp.Afferent.for_tissues("paper")).respond(skin)


def test_a_population_samples_what_the_dynamic_term_of_its_afferent_follows():
    skin = BumpWithStress(17.0, 0.3)
    lone = replace(SED_DRIVEN, dynamic_quantity="compressive_stress")
    of_energy, of_stress = (fp.Population.grid(afferent=afferent) for afferent in (SED_DRIVEN, lone))
    usual, extended = of_energy.respond(skin), of_stress.respond(skin)
    assert_array_equal(usual.spikes.times_ms, of_energy.respond(Bump(17.0, 0.3)).spikes.times_ms)
    dynamic_hz, _ = lone.rates(skin.sed(fp.Population.grid().positions_mm, "compressive_stress"))
    assert_array_equal(extended.dynamic_rate_hz, dynamic_hz)
    assert (extended.dynamic_rate_hz != usual.dynamic_rate_hz).any()
    both = replace(lone, static_quantity="compressive_stress")
    assert (fp.Population.grid(afferent=both).respond(skin).static_rate_hz != usual.static_rate_hz).any()


def test_sensitivity_multiplies_both_gains_and_not_the_intercept():
    resting = replace(SED_DRIVEN, intercept_ma=4e-7, dynamic_gain=3e-4, static_gain=1e-6)
    positions, skin = fp.Population.grid().positions_mm, BumpWithStress(17.0, 0.3)
    factors = np.linspace(0.4, 1.8, 18)
    for quantity in ("stored", "compressive_stress"):
        afferent = replace(resting, dynamic_quantity=quantity)
        response = fp.Population(positions, 1.0, afferent, sensitivity=factors).respond(skin)
        for receptor, factor in enumerate(factors):
            gains = {name: factor * getattr(afferent, name) for name in ("dynamic_gain", "static_gain")}
            lone = replace(afferent, **gains)
            expected = fp.Population(positions[[receptor]], 1.0, lone).respond(skin)
            assert_allclose(response.spikes[receptor], expected.spikes[0], rtol=1e-9)
        assert len(response.spikes.times_ms) > 100


def test_sensitivities_are_lognormal_with_mean_one():
    factors = sensitivities(20_000, spread=0.4, seed=3)
    logarithms = np.log(factors)
    assert kstest((logarithms + 0.08) / 0.4, "norm").pvalue > 0.01
    assert abs(factors.mean() - 1.0) < 4.0 * factors.std() / np.sqrt(factors.size)
    assert_array_equal(sensitivities(5, 0.4, seed=3), factors[:5])
    assert not np.isin(sensitivities(5, 0.4, seed=4), factors).any()


def test_a_layout_becomes_a_population_where_its_plane_lies_on_the_skin():
    layout = jittered(fp.Ellipse(3.0, 2.0), 100.0, seed=1)

    def place(places):
        return np.column_stack([places[:, 0] + 17.0, -np.ones(len(places)), places[:, 1]])

    flat, curved = fp.Population.of_layout(layout), fp.Population.of_layout(layout, place)
    assert_array_equal(flat.positions_mm, layout.places_mm)
    assert curved.positions_mm.shape == (len(layout), 3)
    for population in (flat, curved):
        assert_array_equal(population.places_mm, layout.places_mm)
        assert len(population) == len(layout)
