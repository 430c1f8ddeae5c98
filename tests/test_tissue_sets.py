"""The table of tissues: every layer of every set, with the numbers that the solver receives."""

from dataclasses import replace

import pytest

from fingerpad.data import tissues as published
from fingerpad.experiments.tissue_sets import ELASTICITY, tissue_layers
from fingerpad.geometry.mesh import LAYERS
from fingerpad.mechanics.tissues import TISSUES, named_tissues
from fingerpad.report.reproduction import tissue_table


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
    assert [(layer.tissues, layer.layer) for layer in layers] == [
        (tissues, layer) for tissues in TISSUES for layer in LAYERS
    ]
    assert len(tissue_table(layers).rows) == 4 * len(TISSUES)


def test_every_modulus_is_that_of_the_published_numbers_beside_it():
    assert list(ELASTICITY) == list(TISSUES)
    for layer, numbers in zip(
        tissue_layers(), (n for rows in ELASTICITY.values() for n in rows), strict=True
    ):
        assert layer.shear_kpa == pytest.approx(shear_kpa(numbers, layer.poisson)), layer.tissues
        assert all(number.status in layer.modulus_status for number in numbers)
        assert all(number.source in layer.source for number in numbers)


def test_only_the_deviator_relaxes():
    for layer in tissue_layers():
        bulk = [
            2.0 * shear * (1.0 + poisson) / (3.0 * (1.0 - 2.0 * poisson))
            for shear, poisson in (
                (layer.shear_kpa, layer.poisson),
                (layer.shear_at_once_kpa, layer.poisson_at_once),
            )
        ]
        assert bulk[0] == pytest.approx(bulk[1])
        assert layer.shear_kpa / layer.shear_at_once_kpa == pytest.approx(1.0 - sum(layer.prony_shares))
        material = named_tissues(layer.tissues).layers[LAYERS.index(layer.layer)]
        assert [1000.0 * time for time in layer.prony_times_s] == pytest.approx(list(material.prony.times_ms))
    human = tissue_table(tissue_layers()).rows[0].cells
    assert human[5:7] == (f"{published.LONG_TERM_POISSON.value:.2f}", "0.34")


def test_a_changed_constant_moves_its_rows_and_no_other(monkeypatch):
    before = tissue_table(tissue_layers()).rows
    changed = replace(published.HUMAN_DERMIS_SHEAR, value=2.0 * published.HUMAN_DERMIS_SHEAR.value)
    monkeypatch.setattr(published, "HUMAN_DERMIS_SHEAR", changed)
    after = tissue_table(tissue_layers()).rows
    moved = [old.cells[:2] for old, new in zip(before, after, strict=True) if old != new]
    assert moved == [("human", "dermis")]
