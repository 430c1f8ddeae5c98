"""Efficiencies of codes against the ideal observer of the same responses."""

from dataclasses import replace

import numpy as np
import pytest

from fingerpad.experiments.conditions import RECEPTOR_X_MM
from fingerpad.neuron.population import Population
from fingerpad.psychophysics.encoding import RESPONSE_MEASURES, neighbour_pairs
from sections import SENSITIVE, SphereSkin
from studies import code_efficiency
from studies.pages import code_efficiency as page

CURVATURES = (287.0, 316.0)
FROM_0 = replace(SENSITIVE, initial_mv=0.0)  # latencies under two spheres differ more than from rest
POPULATION = Population.grid(centre_mm=(RECEPTOR_X_MM, 0.0), afferent=FROM_0)
PAIRS = neighbour_pairs(POPULATION.positions_mm, POPULATION.pitch_mm)


@pytest.fixture(scope="module")
def found():
    answers = [POPULATION.respond(SphereSkin.wide(curvature)) for curvature in CURVATURES]
    tables = {
        name: np.array([read(answer) for answer in answers]) for name, read in RESPONSE_MEASURES.items()
    }
    return code_efficiency.code_efficiencies(np.array(CURVATURES), tables, PAIRS, 0.06, seed=0)


def test_no_code_is_more_efficient_than_the_ideal_observer(found):
    rows = found
    assert {(row.code, row.measure, row.noise) for row in rows} >= {
        ("Gradient Sum", "static", "multiplied"),
        ("Euclidean Distance", "latency", "multiplied"),
        ("Gradient Sum", "static", "Poisson"),
    }
    for row in rows:
        assert row.efficiency < 1.0 + 3.0 * row.efficiency_error
        assert row.proportion_correct <= row.ideal_proportion_correct + 0.01


def test_receptors_without_a_latency_under_one_sphere_are_left_out_and_silent_rates_are_not():
    curvatures = np.array(code_efficiency.PAIR_PER_M)
    static = np.array([[30.0, 0.0, 20.0, 10.0], [33.0, 0.0, 21.0, 9.0]])
    latency = np.array([[10.0, np.nan, 12.0, 30.0], [10.0, 70.0, 11.0, 33.0]])
    pairs = np.array([[0, 1], [1, 2], [0, 3]])
    rows = code_efficiency.code_efficiencies(
        curvatures, {"static": static, "latency": latency}, pairs, 0.1, seed=0
    )
    assert [row.receptors for row in rows] == [3, 3, 3, 3, 4, 4]
    alone = code_efficiency.code_efficiencies(
        curvatures, {"static": static, "latency": latency[:, [0, 3]]}, np.array([[0, 1]]), 0.1, seed=0
    )
    # Of the pairs of latencies only that of receptors 0 and 3 has both.
    assert alone[2].code == rows[2].code == "Gradient Sum"
    assert rows[2].d_prime == pytest.approx(alone[2].d_prime, abs=0.1)


def test_a_receptor_that_begins_to_respond_has_the_information_of_the_noise_floor():
    """One of two afferents starts to fire: d' grows with its rate over the floor and is not infinite."""
    curvatures = np.array(code_efficiency.PAIR_PER_M)
    for rate_hz in (1.0, 2.0):
        static = np.array([[30.0, 0.0], [30.0, rate_hz]])
        row, *_ = code_efficiency.code_efficiencies(
            curvatures, {"static": static}, np.array([[0, 1]]), 0.1, seed=0
        )
        expected = rate_hz / np.sqrt(1.0 + 0.5 * (0.1 * rate_hz) ** 2)
        assert row.ideal_d_prime == pytest.approx(expected, abs=4.0 * row.ideal_d_prime_error)


def test_the_table_has_a_row_per_code_measure_and_noise(found):
    (table,) = page.tables(found)
    assert len(table.rows) == len(found)
    assert {len(row.cells) for row in table.rows} == {len(table.columns)}
