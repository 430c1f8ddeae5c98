"""The table of tissues: every layer of every set, with the numbers that the solver receives."""

from dataclasses import replace
from itertools import chain, product
from types import SimpleNamespace

import numpy as np
import pytest

from fingerpad.data import tissues as published
from fingerpad.experiments.tissue_sets import ELASTICITY, tissue_layers
from fingerpad.geometry.mesh import LAYERS
from fingerpad.mechanics.tissues import TISSUES, named_tissues
from report_rows import table_of


def tissue_table(layers):
    return table_of("reproduction", "Tissues", SimpleNamespace(tissues=layers))


def shear_kpa(numbers, poisson):
    """Shear modulus that published numbers give, by their names."""
    first = numbers[0]
    if "Young" in first.name:
        return first.value / (2.0 * (1.0 + poisson))
    if "polynomial" in first.name:
        return 2.0 * (first.value[0] + first.value[1])
    return sum(first.value) if "hyperfoam" in first.name else first.value


def test_the_table_has_four_rows_per_set_in_order():
    layers = tissue_layers()
    assert [(each.tissues, each.layer) for each in layers] == list(product(TISSUES, LAYERS))
    assert len(tissue_table(layers).rows) == 4 * len(TISSUES)


def test_every_modulus_is_that_of_the_published_numbers_beside_it():
    assert list(ELASTICITY) == list(TISSUES)
    for layer, numbers in zip(tissue_layers(), chain.from_iterable(ELASTICITY.values()), strict=True):
        assert layer.shear_kpa == pytest.approx(shear_kpa(numbers, layer.poisson)), layer.tissues
        assert all(number.status in layer.modulus_status for number in numbers)
        assert all(number.source in layer.source for number in numbers)


def test_only_the_deviator_relaxes():
    for layer in tissue_layers():
        moduli = ((layer.shear_kpa, layer.poisson), (layer.shear_at_once_kpa, layer.poisson_at_once))
        bulk = [2.0 * shear * (1.0 + nu) / (3.0 * (1.0 - 2.0 * nu)) for shear, nu in moduli]
        assert bulk[0] == pytest.approx(bulk[1])
        assert layer.shear_kpa / layer.shear_at_once_kpa == pytest.approx(1.0 - sum(layer.prony_shares))
        material = named_tissues(layer.tissues).layers[LAYERS.index(layer.layer)]
        assert [1000.0 * time for time in layer.prony_times_s] == pytest.approx(list(material.prony.times_ms))
    human = tissue_table(tissue_layers()).rows[0].cells
    assert human[5:7] == (f"{published.LONG_TERM_POISSON.value:.2f}", "0.34")


def test_a_changed_constant_moves_its_rows_and_no_other(monkeypatch):
    before = tissue_table(tissue_layers()).rows
    changed = replace(published.HUMAN_DERMIS, value=tuple(2.0 * c for c in published.HUMAN_DERMIS.value))
    monkeypatch.setattr(published, "HUMAN_DERMIS", changed)
    after = tissue_table(tissue_layers()).rows
    moved = [old.cells[:2] for old, new in zip(before, after, strict=True) if old != new]
    assert moved == [("human", "dermis")]


def test_the_stiffening_set_is_trial_3_with_another_coefficient():
    for stiffens, plain in zip(
        named_tissues("trial3_stiffening").layers, named_tissues("trial3").layers, strict=True
    ):
        assert stiffens.shear_modulus_kpa == pytest.approx(plain.shear_modulus_kpa)
        assert stiffens.bulk_modulus_kpa == pytest.approx(plain.bulk_modulus_kpa)
    ratios = [layer.law.c20 / layer.law.c10 for layer in named_tissues("trial3_stiffening").layers]
    assert ratios == pytest.approx([0.0, 0.0, 5.0, 5.0])


@pytest.mark.parametrize("layer", ["SKIN", "SUBCUTIS"])
def test_polynomials_follow_wus_hyperfoam_in_uniaxial_compression(layer):
    """Nominal stress of both laws in a bar that is free to the sides, up to 50 %."""
    mu, alpha, (c10, c01, c20, c11, c02) = (
        np.array(getattr(published, f"WU_{layer}_{name}").value)
        for name in ("HYPERFOAM_MU", "HYPERFOAM_ALPHA", "POLYNOMIAL")
    )
    stretch, nu = np.linspace(0.5, 1.0, 60, endpoint=False)[:, None], 0.48
    volume = stretch ** (1.0 - 2.0 * nu)
    exponent = -alpha * nu / (1.0 - 2.0 * nu)
    foam = (2.0 / stretch * (mu / alpha * (stretch**alpha - volume**exponent))).sum(axis=1)
    length = stretch[:, 0]
    first, second = length**2 + 2.0 / length - 3.0, 2.0 * length + length**-2 - 3.0
    of_first = c10 + 2.0 * c20 * first + c11 * second
    of_second = c01 + c11 * first + 2.0 * c02 * second
    polynomial = 2.0 * (length - length**-2) * (of_first + of_second / length)
    misfit = np.sqrt(np.mean((polynomial - foam) ** 2)) / np.abs(foam).max()
    assert misfit < 0.001
