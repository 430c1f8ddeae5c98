"""One cube of each law against the closed forms of rubber elasticity (Rivlin 1948)."""

from itertools import pairwise

import numpy as np
import pytest
from scipy.optimize import brentq

from fingerpad.errors import InputError
from fingerpad.mechanics.element import element_system
from fingerpad.mechanics.materials import Material, MaterialTable, Polynomial, Prony
from fingerpad.mechanics.tissues import TISSUES, named_tissues

CUBE = np.array(
    [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0, 0, 1], [1, 0, 1], [1, 1, 1], [0, 1, 1]], dtype=float
)
NEO_HOOKE = Material.neo_hooke(shear_kpa=11.0, poisson=0.48)
MOONEY = Material(Polynomial(c10=4.0, c01=1.5, bulk_linear=130.0))
POLYNOMIAL = Material.polynomial(4.0, 1.5, 2.5, 0.7, 0.9, poisson=0.48)
LAWS = pytest.mark.parametrize(
    "material", [NEO_HOOKE, MOONEY, POLYNOMIAL], ids=["neo-hooke", "mooney", "polynomial"]
)


def cauchy_stress(material, gradient):
    """Stress of a homogeneously deformed cube from its nodal forces: sum of f x' / v. [kPa]"""
    force = np.empty((8, 3))
    law = MaterialTable.of([material]).law[0]
    displacement = CUBE @ (gradient - np.eye(3)).T
    element_system(CUBE, displacement, law, 1.0, np.zeros((8, 6)), False, force, np.empty((8, 8, 3, 3)))
    return force.T @ CUBE @ gradient.T / np.linalg.det(gradient)


def slopes(material, first, second):
    """W1 = dW/dI1 and W2 = dW/dI2."""
    x, y, material = first - 3, second - 3, material.law
    w1 = material.c10 + 2 * material.c20 * x + material.c11 * y
    w2 = material.c01 + material.c11 * x + 2 * material.c02 * y
    return w1, w2


@LAWS
@pytest.mark.parametrize("stretch", [0.6, 0.95, 1.3, 2.0])
def test_isochoric_uniaxial_stretch(material, stretch):
    """t1 - t2 = 2 (l² - 1/l) (W1 + W2 / l)."""
    stress = cauchy_stress(material, np.diag([stretch, stretch**-0.5, stretch**-0.5]))
    w1, w2 = slopes(material, stretch**2 + 2 / stretch, 2 * stretch + stretch**-2)
    expected = 2 * (stretch**2 - 1 / stretch) * (w1 + w2 / stretch)
    np.testing.assert_allclose(stress[0, 0] - stress[1, 1], expected, rtol=1e-12)
    np.testing.assert_allclose(np.trace(stress), 0.0, atol=1e-11 * material.bulk_modulus_kpa)


@LAWS
@pytest.mark.parametrize("stretch", [0.7, 1.05, 1.5])
def test_isochoric_equibiaxial_stretch(material, stretch):
    """t1 - t3 = 2 (l² - l^-4) (W1 + l² W2)."""
    stress = cauchy_stress(material, np.diag([stretch, stretch, stretch**-2]))
    w1, w2 = slopes(material, 2 * stretch**2 + stretch**-4, stretch**4 + 2 * stretch**-2)
    expected = 2 * (stretch**2 - stretch**-4) * (w1 + stretch**2 * w2)
    np.testing.assert_allclose(stress[0, 0] - stress[2, 2], expected, rtol=1e-12)
    np.testing.assert_allclose(stress[0, 0], stress[1, 1], rtol=1e-12)


@LAWS
@pytest.mark.parametrize("shear", [0.1, 0.8])
def test_simple_shear_and_its_normal_stresses(material, shear):
    """t12 = 2 g (W1 + W2), t11 - t33 = 2 g² W1, t22 - t33 = -2 g² W2."""
    stress = cauchy_stress(material, np.array([[1.0, shear, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]))
    w1, w2 = slopes(material, 3 + shear**2, 3 + shear**2)
    np.testing.assert_allclose(stress[0, 1], 2 * shear * (w1 + w2), rtol=1e-12)
    size = 1e-12 * material.shear_modulus_kpa
    np.testing.assert_allclose(stress[0, 0] - stress[2, 2], 2 * shear**2 * w1, rtol=1e-11, atol=size)
    np.testing.assert_allclose(stress[1, 1] - stress[2, 2], -2 * shear**2 * w2, rtol=1e-11, atol=size)


@pytest.mark.parametrize("jacobian", [0.8, 1.1])
def test_dilatation_feels_only_the_volumetric_energy(jacobian):
    """t = U'(J) = 2 (J-1)/D1 + 4 (J-1)³/D2, the same in all directions."""
    material = Material(Polynomial(c10=4.0, c01=1.5, c20=2.5, bulk_linear=130.0, bulk_cubic=400.0))
    stress = cauchy_stress(material, jacobian ** (1 / 3) * np.eye(3))
    pressure = 2 * 130.0 * (jacobian - 1) + 4 * 400.0 * (jacobian - 1) ** 3
    np.testing.assert_allclose(stress, pressure * np.eye(3), rtol=1e-12, atol=1e-12 * abs(pressure))


def pulled_stress(poisson, stretch):
    """Axial stress of a free bar of the polynomial law. [kPa]"""
    material = Material.polynomial(4.0, 1.5, 2.5, 0.7, 0.9, poisson=poisson)
    across = brentq(
        lambda width: cauchy_stress(material, np.diag([stretch, width, width]))[1, 1], 0.4, 1.5, xtol=1e-15
    )
    return cauchy_stress(material, np.diag([stretch, across, across]))[0, 0]


def test_free_bar_tends_to_the_incompressible_one():
    stretch = 1.4
    w1, w2 = slopes(POLYNOMIAL, stretch**2 + 2 / stretch, 2 * stretch + stretch**-2)
    incompressible = 2 * (stretch**2 - 1 / stretch) * (w1 + w2 / stretch)
    coarse, fine = (pulled_stress(0.5 - gap, stretch) / incompressible - 1 for gap in (1e-3, 1e-4))
    assert abs(fine) < 1e-3
    np.testing.assert_allclose(coarse / fine, 10.0, rtol=0.05)  # first order in 1 - 2 nu


@LAWS
def test_small_strain_is_hookes_law(material):
    strain = 1e-6 * np.array([[1.0, 0.4, -0.3], [0.4, -0.5, 0.8], [-0.3, 0.8, 0.7]])
    stress = cauchy_stress(material, np.eye(3) + strain)
    mean = np.trace(strain) / 3 * np.eye(3)
    hooke = 2 * material.shear_modulus_kpa * (strain - mean) + 3 * material.bulk_modulus_kpa * mean
    np.testing.assert_allclose(stress, hooke, rtol=0, atol=1e-5 * np.abs(hooke).max())


def test_linear_elastic_has_the_moduli_asked_for():
    material = Material.linear_elastic(young_kpa=136.0, poisson=0.48)
    shear, bulk = material.shear_modulus_kpa, material.bulk_modulus_kpa
    np.testing.assert_allclose(9 * bulk * shear / (3 * bulk + shear), 136.0, rtol=1e-14)
    np.testing.assert_allclose((3 * bulk - 2 * shear) / (2 * (3 * bulk + shear)), 0.48, rtol=1e-14)


def test_table_holds_instantaneous_coefficients_and_pads_short_series():
    relaxing = Prony(shares=(0.2, 0.3), times_ms=(10.0, 500.0))
    long_term = Material(
        Polynomial(8.0, 2.0, 1.0, 0.5, 0.25, bulk_linear=100.0, bulk_cubic=7.0), prony=relaxing
    )
    instantaneous = Material(Polynomial(8.0, bulk_linear=100.0), prony=relaxing, moduli="instantaneous")
    elastic = Material(Polynomial(8.0, bulk_linear=100.0))
    table = MaterialTable.of([long_term, instantaneous, elastic])
    np.testing.assert_allclose(table.law[0, :8], [16.0, 4.0, 2.0, 1.0, 0.5, 100.0, 7.0, 0.5], rtol=1e-15)
    np.testing.assert_allclose(table.law[1, :8], [8.0, 0, 0, 0, 0, 100.0, 0, 0.5], rtol=1e-15)
    np.testing.assert_allclose(table.law[2, :8], [8.0, 0, 0, 0, 0, 100.0, 0, 1.0], rtol=1e-15)
    np.testing.assert_array_equal(table.shares, [[0.2, 0.3], [0.2, 0.3], [0.0, 0.0]])
    assert (table.times_ms > 0).all()


@pytest.mark.parametrize(
    ("make", "said"),
    [
        (lambda: Material.neo_hooke(shear_kpa=-1.0, poisson=0.48), "shear_kpa"),
        (lambda: Material.neo_hooke(shear_kpa=np.nan, poisson=0.48), "shear_kpa"),
        (lambda: Material.neo_hooke(shear_kpa=1.0, poisson=0.5), "poisson"),
        (lambda: Material.linear_elastic(young_kpa=0.0, poisson=0.3), "young_kpa"),
        (lambda: Material.linear_elastic(young_kpa=1.0, poisson=-1.0), "poisson"),
        (lambda: Material.polynomial(1.0, -2.0, 0, 0, 0, poisson=0.48), "c10"),
        (lambda: Polynomial(c10=np.inf, bulk_linear=1.0), "c10"),
        (lambda: Polynomial(c10=1.0, bulk_linear=0.0), "bulk_linear"),
        (lambda: Polynomial(c10=1.0, bulk_linear=1.0, bulk_cubic=-1.0), "bulk_cubic"),
        (lambda: Material(Polynomial(c10=1.0, bulk_linear=1.0), moduli="relaxed"), "moduli"),
        (lambda: Prony(shares=(0.5,), times_ms=()), "one time per share"),
        (lambda: Prony(shares=(0.5, 0.5), times_ms=(1.0, 2.0)), "less than 1"),
        (lambda: Prony(shares=(-0.1,), times_ms=(1.0,)), "share"),
        (lambda: Prony(shares=(0.1,), times_ms=(0.0,)), "time"),
        (lambda: named_tissues("trial9"), "trial1"),
    ],
)
def test_unusable_materials_are_refused_in_one_sentence(make, said):
    with pytest.raises(InputError, match=said) as refusal:
        make()
    assert "\n" not in str(refusal.value)
    assert str(refusal.value).endswith(".")


@pytest.mark.parametrize("name", list(TISSUES))
def test_every_named_set_grows_softer_inwards(name):
    shear = [material.shear_modulus_kpa for material in named_tissues(name).layers]
    assert all(outer >= inner for outer, inner in pairwise(shear))
    assert len(shear) == 4
