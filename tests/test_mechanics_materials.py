"""Materials as they are made: moduli, tables, refusals. Their answers are in `tests/verification/laws.py`."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

from fingerpad.mechanics.materials import Material, MaterialTable, Polynomial, Prony
from fingerpad.mechanics.tissues import TISSUES, named_tissues
from refusals import refusals


def test_linear_elastic_has_the_moduli_asked_for():
    material = Material.linear_elastic(young_kpa=136.0, poisson=0.48)
    shear, bulk = material.shear_modulus_kpa, material.bulk_modulus_kpa
    np.testing.assert_allclose(9 * bulk * shear / (3 * bulk + shear), 136.0, rtol=1e-14)
    np.testing.assert_allclose((3 * bulk - 2 * shear) / (2 * (3 * bulk + shear)), 0.48, rtol=1e-14)


def test_table_holds_instantaneous_coefficients_and_pads_short_series():
    relaxing = Prony(shares=(0.2, 0.3), times_ms=(10.0, 500.0))
    law = Polynomial(8.0, 2.0, 1.0, 0.5, 0.25, bulk_linear=100.0, bulk_cubic=7.0)
    long_term = Material(law, prony=relaxing)
    instantaneous = Material(Polynomial(8.0, bulk_linear=100.0), prony=relaxing, moduli="instantaneous")
    elastic = Material(Polynomial(8.0, bulk_linear=100.0))
    table = MaterialTable.of([long_term, instantaneous, elastic])
    np.testing.assert_allclose(table.law[0, :8], [16.0, 4.0, 2.0, 1.0, 0.5, 100.0, 7.0, 0.5], rtol=1e-15)
    np.testing.assert_allclose(table.law[1, :8], [8.0, 0, 0, 0, 0, 100.0, 0, 0.5], rtol=1e-15)
    np.testing.assert_allclose(table.law[2, :8], [8.0, 0, 0, 0, 0, 100.0, 0, 1.0], rtol=1e-15)
    np.testing.assert_array_equal(table.shares, [[0.2, 0.3], [0.2, 0.3], [0.0, 0.0]])
    assert (table.times_ms > 0).all()


test_unusable_materials_are_refused_in_one_sentence = refusals(
    (lambda: Material.neo_hooke(shear_kpa=-1.0, poisson=0.48), "shear_kpa"),
    (lambda: Material.neo_hooke(shear_kpa=np.nan, poisson=0.48), "shear_kpa"),
    (lambda: Material.neo_hooke(shear_kpa=1.0, poisson=0.5), "poisson"),
    (lambda: Material.linear_elastic(young_kpa=0.0, poisson=0.3), ("young_kpa",)),
    (lambda: Material.linear_elastic(young_kpa=1.0, poisson=-1.0), "poisson"),
    (lambda: Material.polynomial(1.0, -2.0, 0, 0, 0, poisson=0.48), "c10"),
    (lambda: Polynomial(c10=np.inf, bulk_linear=1.0), ("c10",)),
    (lambda: Polynomial(c10=1.0, bulk_linear=0.0), "bulk_linear"),
    (lambda: Polynomial(c10=1.0, bulk_linear=1.0, bulk_cubic=-1.0), "bulk_cubic"),
    (lambda: Material(Polynomial(c10=1.0, bulk_linear=1.0), moduli="relaxed"), ("moduli",)),
    (lambda: Prony(shares=(0.5,), times_ms=()), "one time per share"),
    (lambda: Prony(shares=(0.5, 0.5), times_ms=(1.0, 2.0)), "less than 1"),
    (lambda: Prony(shares=(-0.1,), times_ms=(1.0,)), "share"),
    (lambda: Prony(shares=(0.1,), times_ms=(0.0,)), "time"),
    (lambda: named_tissues("trial9"), "trial1"),
)  # fmt: skip


def test_the_sets_paper_and_human_have_a_long_term_ratio_of_0_40_and_0_34_at_once():
    for name in ("paper", "human"):
        for layer in named_tissues(name).layers:
            assert layer.poisson == pytest.approx(0.40)
            c10 = layer.law.c10 * layer.instantaneous_factor
            instantaneous = replace(layer, law=replace(layer.law, c10=c10))
            assert instantaneous.poisson == pytest.approx(0.34, abs=0.003)


def test_the_set_paper_is_trial_3_with_another_poissons_ratio():
    trial, paper = named_tissues("trial3"), named_tissues("paper")
    for ours, theirs in zip(paper.layers[2:], trial.layers[2:], strict=True):
        assert ours.shear_modulus_kpa == theirs.shear_modulus_kpa
    outer = paper.layers[0], trial.layers[0]
    young = [2.0 * (1.0 + tissue.poisson) * tissue.shear_modulus_kpa for tissue in outer]
    assert young == pytest.approx([136.0, 136.0])


def test_every_named_set_grows_softer_inwards():
    for name in TISSUES:
        shear = [material.shear_modulus_kpa for material in named_tissues(name).layers]
        assert all(outer >= inner for outer, inner in pairwise(shear))
        assert len(shear) == 4
    human = [layer.shear_modulus_kpa for layer in named_tissues("human").layers]
    assert human == pytest.approx([25.0, 6.0, 5.2, 1.3])
