"""Every law against closed forms: a cube in uniaxial and equibiaxial stretch, simple shear and dilatation.

The closed forms are principal Kirchhoff stresses, tau_a = lambda_a dW/dlambda_a, written by hand from the
energies and in NumPy only. The cube's stress comes from its nodal forces, t = sum f x' / v.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.optimize import brentq

from fingerpad.geometry.mesh import block_mesh
from fingerpad.mechanics.materials import Material, Polynomial

from .case import Row, at_most, case, near
from .solid import Solid

THEME = "Laws of the tissue"
CUBE = block_mesh([0.0, 1.0], [0.0, 1.0], [0.0, 1.0], layers=[0])


@dataclass(frozen=True)
class Reference:
    """A material, and its principal Kirchhoff stresses from principal stretches. [kPa]"""

    material: Material
    kirchhoff: Callable


def barred(stretches):
    """Stretches (..., 3) without their change of volume, and that change J (..., 1)."""
    jacobian = stretches.prod(axis=-1, keepdims=True)
    return jacobian ** (-1 / 3) * stretches, jacobian


def bulk_modulus(shear, poisson):
    """K = 2 G (1 + nu) / (3 (1 - 2 nu))."""
    return 2 * shear * (1 + poisson) / (3 * (1 - 2 * poisson))


def polynomial(c10, c01, c20, c11, c02, poisson, bulk_cubic=0.0):
    """tau_a = 2 W1 (b_a - I1/3) + 2 W2 (I1 b_a - b_a² - 2/3 I2) + J (K (J - 1) + 4/D2 (J - 1)³),
    b_a = lambdabar_a²."""
    bulk = bulk_modulus(2 * (c10 + c01), poisson)
    law = Polynomial(c10, c01, c20, c11, c02, bulk_linear=bulk / 2, bulk_cubic=bulk_cubic)

    def kirchhoff(stretches):
        bar, jacobian = barred(stretches)
        b = bar**2
        first = b.sum(axis=-1, keepdims=True)
        second = (1 / b).sum(axis=-1, keepdims=True)
        w1 = c10 + 2 * c20 * (first - 3) + c11 * (second - 3)
        w2 = c01 + c11 * (first - 3) + 2 * c02 * (second - 3)
        shape = 2 * w1 * (b - first / 3) + 2 * w2 * (first * b - b**2 - 2 / 3 * second)
        return shape + jacobian * (bulk * (jacobian - 1) + 4 * bulk_cubic * (jacobian - 1) ** 3)

    return Reference(Material(law), kirchhoff)


def neo_hooke(shear, poisson):
    """tau_a = G (b_a - I1/3) + K J (J - 1)."""
    closed = polynomial(shear / 2, 0.0, 0.0, 0.0, 0.0, poisson).kirchhoff
    return Reference(Material.neo_hooke(shear, poisson), closed)


def ogden(moduli, exponents, poisson):
    """tau_a = sum_i 2 mu_i/alpha_i (lambdabar_a^alpha_i - mean over a) + K J (J - 1)."""
    bulk = bulk_modulus(sum(moduli), poisson)

    def kirchhoff(stretches):
        bar, jacobian = barred(stretches)
        total = bulk * jacobian * (jacobian - 1)
        for modulus, exponent in zip(moduli, exponents, strict=True):
            power = bar**exponent
            total = total + 2 * modulus / exponent * (power - power.mean(axis=-1, keepdims=True))
        return total

    return Reference(Material.ogden(moduli, exponents, poisson), kirchhoff)


def hyperfoam(moduli, exponents, poisson):
    """tau_a = sum_i 2 mu_i/alpha_i (lambda_a^alpha_i - J^(-alpha_i beta)), beta = nu / (1 - 2 nu)."""
    beta = poisson / (1 - 2 * poisson)

    def kirchhoff(stretches):
        _, jacobian = barred(stretches)
        total = 0.0
        for modulus, exponent in zip(moduli, exponents, strict=True):
            total = total + 2 * modulus / exponent * (stretches**exponent - jacobian ** (-exponent * beta))
        return total

    return Reference(Material.hyperfoam(moduli, exponents, poisson), kirchhoff)


def hencky(young, poisson):
    """tau_a = 2 G ln lambdabar_a + K ln J."""
    shear = young / (2 * (1 + poisson))

    def kirchhoff(stretches):
        bar, jacobian = barred(stretches)
        return 2 * shear * np.log(bar) + bulk_modulus(shear, poisson) * np.log(jacobian)

    return Reference(Material.linear_elastic(young, poisson, law="hencky"), kirchhoff)


def exponential(shear, bulk):
    """Demiray's tissue, W = G/(2 b) (exp(b (I1 - 3)) - 1) with b = 1/2, given as a formula:
    tau_a = G exp(b (I1 - 3)) (b_a - I1/3) + K J (J - 1)."""
    formula = "shear * (exp((I1 - 3) / 2) - 1) + bulk / 2 * (J - 1)**2"

    def kirchhoff(stretches):
        bar, jacobian = barred(stretches)
        first = (bar**2).sum(axis=-1, keepdims=True)
        return shear * np.exp((first - 3) / 2) * (bar**2 - first / 3) + bulk * jacobian * (jacobian - 1)

    return Reference(Material.from_energy(formula, shear=shear, bulk=bulk), kirchhoff)


LAWS = {
    "neo-Hooke": neo_hooke(11.0, 0.45),
    "Mooney-Rivlin": polynomial(4.0, 1.5, 0.0, 0.0, 0.0, 0.48),
    "polynomial N = 2 with D1, D2": polynomial(4.0, 1.5, 2.5, 0.7, 0.9, 0.48, bulk_cubic=400.0),
    "Ogden N = 3": ogden((3.0, 4.0, 5.0), (-2.0, 3.5, 1.5), 0.48),
    "Storakers' hyperfoam N = 2": hyperfoam((2.0, 6.0), (7.0, 4.5), 0.4),
    "Hencky": hencky(30.0, 0.45),
    "energy of the user's own": exponential(11.0, 260.0),
}


def cauchy_of_cube(material, gradient):
    """Stress of a cube that is deformed homogeneously, from its nodal forces. [kPa]"""
    solid = Solid(CUBE, (material,) * 4)
    _, force, _ = solid.evaluate(CUBE.nodes_mm @ (gradient - np.eye(3)).T)
    return force.T @ CUBE.nodes_mm @ gradient.T / np.linalg.det(gradient)


def free_stretch(reference, stretches_of):
    """The stretch that leaves its own direction, the last one, without stress."""
    return brentq(lambda s: reference.kirchhoff(np.array(stretches_of(s)))[-1], 0.2, 4.0, xtol=1e-15)


def deformations(reference):
    """Name, gradient and expected Cauchy stress (3, 3) of each."""
    for stretch in (0.6, 0.9, 1.3, 2.0):
        across = free_stretch(reference, lambda s, stretch=stretch: (stretch, s, s))
        yield f"uniaxial stretch {stretch}", np.diag([stretch, across, across])
    for stretch in (0.75, 1.1, 1.4):
        through = free_stretch(reference, lambda s, stretch=stretch: (stretch, stretch, s))
        yield f"equibiaxial stretch {stretch}", np.diag([stretch, stretch, through])
    for shear in (0.1, 0.8):
        yield f"simple shear {shear}", np.array([[1.0, shear, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]])
    for jacobian in (0.9, 1.1):
        yield f"volume times {jacobian}", jacobian ** (1 / 3) * np.eye(3)


def expected_cauchy(reference, gradient):
    """Stress from the closed form in the principal frame of b = F F', turned back. [kPa]"""
    squares, axes = np.linalg.eigh(gradient @ gradient.T)
    stretches = np.sqrt(squares)
    return axes @ np.diag(reference.kirchhoff(stretches) / stretches.prod()) @ axes.T


SHOWN = {"uniaxial": (0, 0), "equibiaxial": (0, 0), "simple": (0, 1), "volume": (0, 0)}


def rows_of(name):
    """Largest stress of each deformation, and the largest error of any component of any."""
    reference, rows, errors = LAWS[name], [], []
    for title, gradient in deformations(reference):
        got, expected = cauchy_of_cube(reference.material, gradient), expected_cauchy(reference, gradient)
        errors.append(np.abs(got - expected).max() / np.abs(expected).max())
        component = SHOWN[title.split()[0]]
        rows.append(
            near(f"{title}: stress {'xy'[component[0]]}{'xy'[component[1]]}", expected[component],
                 got[component], 1e-9, "kPa")
        )  # fmt: skip
    return [*rows, at_most("largest error of any stress component, relative", 1e-12, np.max(errors))]


def _register(name):
    def measure() -> list[Row]:
        return rows_of(name)

    measure.__name__ = "law_" + "_".join(re.findall("[a-z0-9]+", name.lower()))
    measure.__doc__ = (
        "One cube; its stress from nodal forces. The stretches across a uniaxial or equibiaxial test are "
        "those that leave no stress there."
    )
    case(THEME, f"Homogeneous deformations, {name}", "Rivlin 1948; Ogden 1984, ch. 4")(measure)


for _name in LAWS:
    _register(_name)


def small_strain_error(reference):
    """Deviation from Hooke's law at a strain of 1e-6, relative."""
    strain = 1e-6 * np.array([[1.0, 0.4, -0.3], [0.4, -0.5, 0.8], [-0.3, 0.8, 0.7]])
    mean = np.trace(strain) / 3 * np.eye(3)
    shear, bulk = reference.material.shear_modulus_kpa, reference.material.bulk_modulus_kpa
    hooke = 2 * shear * (strain - mean) + 3 * bulk * mean
    got = cauchy_of_cube(reference.material, np.eye(3) + strain)
    return np.abs(got - hooke).max() / np.abs(hooke).max()


@case(THEME, "Hooke's law at small strain", "Hooke's law with the initial moduli")
def small_strain() -> list[Row]:
    """Largest relative deviation from 2 G dev(e) + K tr(e) at a strain of 1e-6. The second-order term
    remains.
    """
    return [at_most(name, 1e-5, small_strain_error(reference)) for name, reference in LAWS.items()]


@case(THEME, "Incompressible limit of a bar", "Rivlin 1948")
def incompressible_limit() -> list[Row]:
    """Axial stress at stretch 1.4 over the incompressible 2 (l² - 1/l)(W1 + W2 / l), minus 1: first order in
    1 - 2 nu.
    """
    stretch, coefficients = 1.4, (4.0, 1.5, 2.5, 0.7, 0.9)
    first, second = stretch**2 + 2 / stretch, 2 * stretch + stretch**-2
    c10, c01, c20, c11, c02 = coefficients
    w1 = c10 + 2 * c20 * (first - 3) + c11 * (second - 3)
    w2 = c01 + c11 * (first - 3) + 2 * c02 * (second - 3)
    limit = 2 * (stretch**2 - 1 / stretch) * (w1 + w2 / stretch)
    errors = []
    for gap in (1e-3, 1e-4):
        material = Material.polynomial(*coefficients, poisson=0.5 - gap)

        def across(width, material=material):
            return cauchy_of_cube(material, np.diag([stretch, width, width]))[1, 1]

        width = brentq(across, 0.6, 1.2, xtol=1e-15)
        errors.append(cauchy_of_cube(material, np.diag([stretch, width, width]))[0, 0] / limit - 1)
    return [
        at_most("error at nu = 0.4999", 1e-3, abs(errors[1])),
        near("error at nu = 0.499 over error at nu = 0.4999", 10.0, errors[0] / errors[1], 0.05),
    ]
