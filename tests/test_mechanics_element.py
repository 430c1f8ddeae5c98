"""The compiled brick against a slow one that only writes the energy down, and against laws of elements."""

from itertools import product

import numpy as np
import pytest

from fingerpad import Energy, Material
from fingerpad.mechanics.element import N_COLUMNS, add_tangent, element_state, element_system, relaxing_norms
from fingerpad.mechanics.materials import Hencky, Hyperfoam, MaterialTable, Ogden, Polynomial
from fingerpad.mechanics.tensors import power_minus_two_thirds

NEO_HOOKE = Material.neo_hooke(shear_kpa=11.0, poisson=0.48)
MOONEY = Material(Polynomial(c10=4.0, c01=1.5, bulk_linear=130.0))
POLYNOMIAL = Material(
    Polynomial(c10=4.0, c01=1.5, c20=2.5, c11=0.7, c02=0.9, bulk_linear=130.0, bulk_cubic=400.0)
)
OGDEN = Material(Ogden(moduli_kpa=(3.0, 4.0, 5.0), exponents=(-2.0, 3.5, 1.5), bulk_kpa=260.0))
HENCKY = Material(Hencky(shear_kpa=11.0, bulk_kpa=260.0))
OWN = Material.from_energy("b / 2 * (exp(I1 - 3) - 1) + k / 2 * (J - 1)**2", b=11.0, k=260.0)
FOAM = Material(Hyperfoam(moduli_kpa=(2.0, 3.0, 6.0), exponents=(-3.0, 7.0, 4.5), poisson=0.4))
LAWS = pytest.mark.parametrize(
    "material",
    [NEO_HOOKE, MOONEY, POLYNOMIAL, OGDEN, HENCKY, OWN, FOAM],
    ids=["neo-hooke", "mooney", "polynomial", "ogden", "hencky", "own", "foam"],
)
COMPLEX_STEP = 1e-30

BRICK = np.array(
    [[0, 0, 0], [2, 0, 0], [2, 1, 0], [0, 1, 0], [0, 0, 1.5], [2, 0, 1.5], [2, 1, 1.5], [0, 1, 1.5]],
    dtype=float,
)
DISTORTED = BRICK + np.random.default_rng(3).uniform(-0.15, 0.15, BRICK.shape)
WEDGE = DISTORTED[[0, 1, 1, 3, 4, 5, 5, 7]]  # two pairs of equal nodes: one side collapsed to an edge
SHAPES = pytest.mark.parametrize("nodes", [DISTORTED, WEDGE], ids=["brick", "wedge"])


def test_power_is_that_of_the_library_near_1_and_far_from_it():
    values = np.concatenate([np.geomspace(1e-6, 1e6, 241), np.linspace(0.9, 1.1, 21)])
    powers = np.empty_like(values)
    power_minus_two_thirds(values, powers)
    np.testing.assert_allclose(powers, values ** (-2 / 3), rtol=2e-15)


def local_corners():
    """Corners in the order lower face, then upper face, each counter-clockwise."""
    face = [(-1, -1), (1, -1), (1, 1), (-1, 1)]
    return [(*corner, height) for height in (-1, 1) for corner in face]


def shape_functions(point):
    return np.array(
        [np.prod([1 + c * p for c, p in zip(corner, point, strict=True)]) / 8 for corner in local_corners()]
    )


def shape_slopes(point):
    """dN/dxi (8, 3) by complex steps."""
    steps = 1j * COMPLEX_STEP * np.eye(3)
    return np.stack([shape_functions(point + step).imag / COMPLEX_STEP for step in steps], axis=1)


def symmetric(components):
    xx, yy, zz, xy, yz, xz = components
    return np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])


def slow_points(nodes, displacement):
    """Weight and deformation gradient at the 2x2x2 points."""
    for point in product(*3 * [(-1 / np.sqrt(3), 1 / np.sqrt(3))]):
        slopes = shape_slopes(np.array(point))
        jacobian = nodes.T @ slopes
        yield np.linalg.det(jacobian), np.eye(3) + displacement.T @ slopes @ np.linalg.inv(jacobian)


def kernel_order():
    """Row of the kernel's points for each point of `slow_points`: it numbers them like the nodes."""
    signs = list(product(*3 * [(-1, 1)]))
    return [local_corners().index(sign) for sign in signs]


def squared_stretches(right):
    """Eigenvalues of a symmetric matrix by the cosine formula, complex entries allowed."""
    mean = np.trace(right) / 3
    deviator = right - mean * np.eye(3)
    size = np.sqrt(np.trace(deviator @ deviator) / 6)
    angle = np.arccos(np.linalg.det(deviator / size) / 2) / 3
    first, last = (mean + 2 * size * np.cos(angle + turn) for turn in (0.0, 2 * np.pi / 3))
    return np.array([first, 3 * mean - first - last, last])


def slow_density(law, right, dilatation):
    """W(C~, Jbar) of each law, written down once more; without U unless the law couples the two."""
    first = np.trace(right)
    x, y = first - 3, (first**2 - np.trace(right @ right)) / 2 - 3
    if isinstance(law, Polynomial):
        return law.c10 * x + law.c01 * y + law.c20 * x**2 + law.c11 * x * y + law.c02 * y**2
    if isinstance(law, Energy):
        return 11.0 / 2 * (np.exp(x) - 1)
    stretches = np.sqrt(squared_stretches(right))
    if isinstance(law, Hencky):
        return law.shear_kpa * (np.log(stretches) ** 2).sum()
    terms = zip(law.moduli_kpa, law.exponents, strict=True)
    if isinstance(law, Ogden):
        return sum(2 * mu / alpha**2 * ((stretches**alpha).sum() - 3) for mu, alpha in terms)
    stretches, beta = stretches * dilatation ** (1 / 3), law.poisson / (1 - 2 * law.poisson)
    return sum(
        2 * mu / alpha**2 * ((stretches**alpha).sum() - 3 + (dilatation ** (-alpha * beta) - 1) / beta)
        for mu, alpha in terms
    )


def slow_volumetric(law, dilatation):
    """U(Jbar); nothing for the law that couples shape and volume."""
    if isinstance(law, Hyperfoam):
        return 0.0
    if isinstance(law, Hencky):
        return 0.5 * law.bulk_kpa * np.log(dilatation) ** 2
    if isinstance(law, Polynomial):
        return law.bulk_linear * (dilatation - 1) ** 2 + law.bulk_cubic * (dilatation - 1) ** 4
    return 0.5 * 260.0 * (dilatation - 1) ** 2


def slow_energy(material, nodes, displacement, s, history):
    """Pi_e from its definition; complex displacements allowed."""
    points = list(zip(slow_points(nodes, displacement), kernel_order(), strict=True))
    volume = sum(weight for (weight, _), _ in points)
    dilatation = sum(weight * np.linalg.det(gradient) for (weight, gradient), _ in points) / volume
    relaxing_dilatation = dilatation if isinstance(material.law, Hyperfoam) else 1.0
    total = volume * slow_volumetric(material.law, dilatation)
    for (weight, gradient), row in points:
        right = np.linalg.det(gradient) ** (-2 / 3) * gradient.T @ gradient
        total += weight * s * slow_density(material.law, right, dilatation)
        total -= weight * 0.5 * relaxing_dilatation ** (2 / 3) * (symmetric(history[row]) * right).sum()
    return total


def slow_force(material, nodes, displacement, s, history):
    """Gradient of the energy by complex steps, exact to round-off."""
    force = np.empty((8, 3))
    for a, i in product(range(8), range(3)):
        moved = displacement.astype(complex)
        moved[a, i] += 1j * COMPLEX_STEP
        force[a, i] = slow_energy(material, nodes, moved, s, history).imag / COMPLEX_STEP
    return force


def kernel(material, nodes, displacement, s=1.0, history=None):
    law = MaterialTable.of([material]).law[0]
    force, packed, blocks = np.empty((8, 3)), np.empty((8, N_COLUMNS)), np.zeros((64, 3, 3))
    history = np.zeros((8, 6)) if history is None else history
    energy = element_system(nodes, displacement, law, s, history, True, force, packed)
    add_tangent(packed, np.arange(64).reshape(8, 8), blocks)
    return energy, force, blocks.reshape(8, 8, 3, 3).transpose(0, 2, 1, 3).reshape(24, 24)


def random_state(nodes, seed=0, size=0.1):
    """Displacements (equal for equal nodes), a factor s and a history."""
    generator = np.random.default_rng(seed)
    displacement = generator.uniform(-size, size, nodes.shape)
    same = (nodes[:, None] == nodes[None]).all(axis=2).argmax(axis=1)
    return displacement[same], 0.7, generator.uniform(-3.0, 3.0, (8, 6))


@SHAPES
@LAWS
def test_energy_and_force_are_those_of_the_definition(material, nodes):
    displacement, s, history = random_state(nodes)
    energy, force, _ = kernel(material, nodes, displacement, s, history)
    np.testing.assert_allclose(energy, slow_energy(material, nodes, displacement, s, history), rtol=1e-12)
    expected = slow_force(material, nodes, displacement, s, history)
    np.testing.assert_allclose(force, expected, rtol=0, atol=1e-12 * np.abs(expected).max())


def force_differences(material, nodes, displacement, s, history):
    """Tangent by fourth-order differences of the force."""
    differences, step = np.empty((24, 24)), 1e-3
    for column in range(24):
        offset = np.zeros(24)
        offset[column] = step
        offset = offset.reshape(8, 3)
        one, two = (
            kernel(material, nodes, displacement + k * offset, s, history)[1]
            - kernel(material, nodes, displacement - k * offset, s, history)[1]
            for k in (1, 2)
        )
        differences[:, column] = ((8 * one - two) / (12 * step)).ravel()
    return differences


STATES = {
    "brick": (DISTORTED, *random_state(DISTORTED)),
    "wedge": (WEDGE, *random_state(WEDGE)),
    # Stretches that are equal or nearly equal.
    **{
        f"{difference:g} apart": (
            BRICK,
            BRICK @ np.diag([0.3, -0.1, difference - 0.1]),
            1.0,
            np.zeros((8, 6)),
        )
        for difference in (0.0, 1e-7, 1e-4)
    },
}


@LAWS
@pytest.mark.parametrize("state", STATES)
def test_tangent_is_the_derivative_of_the_force_and_symmetric(material, state):
    _, _, tangent = kernel(material, *STATES[state])
    differences = force_differences(material, *STATES[state])
    np.testing.assert_allclose(tangent, differences, rtol=0, atol=1e-8 * np.abs(tangent).max())
    np.testing.assert_allclose(tangent, tangent.T, rtol=0, atol=1e-13 * np.abs(tangent).max())


@SHAPES
@LAWS
def test_all_laws_of_equal_moduli_are_one_law_at_rest(material, nodes):
    shear, bulk = material.shear_modulus_kpa, material.bulk_modulus_kpa
    neo_hooke = Material(Polynomial(c10=shear / 2, bulk_linear=bulk / 2))
    tangent, expected = (kernel(law, nodes, np.zeros((8, 3)))[2] for law in (material, neo_hooke))
    np.testing.assert_allclose(tangent, expected, rtol=0, atol=1e-12 * np.abs(expected).max())


def test_inside_out_element_has_no_energy():
    mirrored = BRICK * [1.0, 1.0, -1.0] - BRICK
    assert np.isnan(kernel(NEO_HOOKE, BRICK, mirrored)[0])


@SHAPES
@LAWS
def test_instantaneous_stress_as_history_takes_the_place_of_the_energy(material, nodes):
    """d(-1/2 H : C) with H = -S0 is the power of the relaxing stress, so both give the same forces."""
    displacement, _, _ = random_state(nodes)
    law = MaterialTable.of([material]).law[0]
    stress, energies = np.empty((8, 6)), np.empty((8, 2))
    element_state(nodes, displacement, law, stress, energies)
    _, by_energy, _ = kernel(material, nodes, displacement)
    _, by_history, _ = kernel(material, nodes, displacement, s=0.0, history=-stress)
    np.testing.assert_allclose(by_history, by_energy, rtol=0, atol=1e-12 * np.abs(by_energy).max())


@LAWS
def test_state_reports_weights_and_energies_that_add_up(material):
    displacement, _, _ = random_state(DISTORTED)
    law = MaterialTable.of([material]).law[0]
    energies = np.empty((8, 2))
    volumetric, pressure, dilatation = element_state(DISTORTED, displacement, law, np.empty((8, 6)), energies)
    volume = energies[:, 0].sum()
    slope = slow_volumetric(material.law, dilatation + 1j * COMPLEX_STEP)
    np.testing.assert_allclose([volumetric, pressure], [np.real(slope), np.imag(slope) / COMPLEX_STEP])
    total, _, _ = kernel(material, DISTORTED, displacement)
    np.testing.assert_allclose(energies[:, 0] @ energies[:, 1] + volume * volumetric, total, rtol=1e-13)


def test_norms_are_those_of_the_spatial_deviators():
    displacement, _, _ = random_state(DISTORTED)
    tensors = np.random.default_rng(2).normal(size=(3, 8, 6))
    norms = np.empty((3, 8))
    relaxing_norms(DISTORTED, displacement, MaterialTable.of([NEO_HOOKE]).law[0], tensors, norms)
    points = zip(slow_points(DISTORTED, displacement), kernel_order(), strict=True)
    for (_, gradient), row in points:
        isochoric = np.linalg.det(gradient) ** (-1 / 3) * gradient
        for n in range(3):
            spatial = isochoric @ symmetric(tensors[n, row]) @ isochoric.T
            deviator = spatial - np.trace(spatial) / 3 * np.eye(3)
            np.testing.assert_allclose(norms[n, row], (deviator**2).sum(), rtol=1e-12)
