"""Formulas of strain energies: derivatives against complex steps, and refused formulas."""

import re
import warnings

import numpy as np
import pytest

from fingerpad import Energy, Material
from fingerpad.core.errors import MaterialWarning
from fingerpad.data import tissues
from fingerpad.mechanics.energy import SECOND, translate
from fingerpad.mechanics.materials import Hencky, Hyperfoam, MaterialTable, Ogden, Polynomial, instability
from refusals import refusals

LOGS = np.array([0.21, -0.34, 0.13, 0.17])
STEP = 1e-20
VOLUMETRIC = " + 50 * (J - 1)**2"


def names(logs):
    """Values of the variables of a formula, complex numbers allowed."""
    barred, jacobian = np.exp(logs[:3]), np.exp(logs[3])
    full = barred * jacobian ** (1 / 3)
    values = {f"lambdabar{a + 1}": barred[a] for a in range(3)}
    values |= {f"lambda{a + 1}": full[a] for a in range(3)}
    return values | {"J": jacobian, "I1": (barred**2).sum(), "I2": (barred**-2).sum()}


def slow(formula, coefficients, logs):
    """The formula as Python reads it."""
    functions = {"log": np.log, "exp": np.exp, "sqrt": np.sqrt}
    return eval(formula, functions, names(logs) | coefficients)


def slow_gradient(formula, coefficients, logs):
    offsets = 1j * STEP * np.eye(4)
    return np.array([slow(formula, coefficients, logs + offset).imag / STEP for offset in offsets])


FORMULAS = {
    "every variable": "lambda1 * lambda2**2 / lambda3 + lambdabar1 * lambdabar2 - lambdabar3 + J * I1 - I2",
    "numbers on the left": "2 - I1 + 3 / J - (1 - I2) * 4 / 5",
    "functions": "log(I1 + 2) * exp(a * J) / sqrt(I2) - exp(1) * log(2)",
    "signs and powers": "-(+lambda1)**-2.5 + (I1 - 3)**0 + (I1 - 3)**1 + (I2 - I1)**2 + a**2 * lambda2",
    "repeated parts": "(I1 - 3) * (I1 - 3) + (I1 - 3) / (J + a)",
}


def derivatives(formula, **coefficients):
    """`Energy.derivatives` of any formula, be it a law or not."""
    energy = object.__new__(Energy)
    object.__setattr__(energy, "formula", formula)
    object.__setattr__(energy, "coefficients", tuple(coefficients.items()))
    return energy.derivatives


@pytest.mark.parametrize("formula", FORMULAS.values(), ids=FORMULAS)
def test_derivatives_are_those_of_the_formula(formula):
    coefficients = {"a": 0.7} if "a " in formula or "a)" in formula or "a*" in formula else {}
    found = derivatives(formula, **coefficients)(LOGS)
    np.testing.assert_allclose(found[0], slow(formula, coefficients, LOGS), rtol=1e-14)
    np.testing.assert_allclose(found[1:5], slow_gradient(formula, coefficients, LOGS), rtol=1e-12)
    step = 1e-4
    for axis, offset in enumerate(step * np.eye(4)):
        one, two = (
            slow_gradient(formula, coefficients, LOGS + k * offset)
            - slow_gradient(formula, coefficients, LOGS - k * offset)
            for k in (1, 2)
        )
        expected = (8 * one - two) / (12 * step)
        np.testing.assert_allclose(found[SECOND[axis]], expected, rtol=0, atol=1e-9 * np.abs(found[5:]).max())


def test_powers_have_derivatives_where_their_base_is_zero_and_repeated_parts_are_evaluated_once():
    found = derivatives("(I1 - 3)**2 + (J - 1)**4 + (I2 - 3)**1")(np.zeros(4))
    assert np.isfinite(found).all()
    expected = derivatives("I2")(np.zeros(4))[SECOND]
    expected[:3, :3] += 2 * np.outer([2.0] * 3, [2.0] * 3)  # 2 dI1 x dI1
    np.testing.assert_allclose(found[SECOND], expected, atol=1e-14)
    assert len(translate("(I1 - 3) * (I1 - 3)", {})) == 3


LAWS = {
    "polynomial": Polynomial(4.0, 1.5, 2.5, 0.7, 0.9, bulk_linear=130.0, bulk_cubic=400.0),
    "ogden": Ogden((3.0, 4.0, 5.0), (-2.0, 3.5, 1.5), bulk_kpa=260.0),
    "hencky": Hencky(11.0, 260.0),
    "hyperfoam": Hyperfoam((2.0, 3.0, 6.0), (-3.0, 7.0, 4.5), poisson=0.4),
}


@pytest.mark.parametrize("law", LAWS.values(), ids=LAWS)
def test_moduli_of_a_law_are_those_of_its_formula(law):
    np.testing.assert_allclose(law.energy.shear_modulus_kpa, law.shear_modulus_kpa, rtol=1e-12)
    np.testing.assert_allclose(law.energy.bulk_modulus_kpa, law.bulk_modulus_kpa, rtol=1e-12)
    assert law.energy.is_coupled == isinstance(law, Hyperfoam)


def test_foam_does_not_expand_more_than_its_poissons_ratio():
    """Uniaxial Storakers foam of one term: lateral stretch = stretch^-nu, whatever the stretch."""
    foam, stretch = Hyperfoam((3.0,), (6.0,), poisson=0.4).energy, 0.6
    sides = -0.4 * np.log(stretch)
    strain = np.array([np.log(stretch), sides, sides])
    first = foam.derivatives([*(strain - strain.mean()), strain.sum()])
    stress = first[1:4] - first[1:4].mean() + first[4]
    np.testing.assert_allclose(stress[1:], 0.0, atol=1e-13 * abs(stress[0]))
    axial = 2 * 3.0 / 6.0 * (stretch**6 - np.exp(6 * sides))  # tau = 2 mu / alpha (l1^alpha - l2^alpha)
    np.testing.assert_allclose(stress[0], axial, rtol=1e-12)


test_what_cannot_be_a_law_is_refused_in_one_sentence = refusals(
    (("I1 - 3 +", {}), "not a formula"),
    (("I1 - I3", {}), "'I3', which is neither"),
    (("mu * (I1 - 3)" + VOLUMETRIC, {}), "'mu'.* give its value"),
    (("5 * (I1 - 3)" + VOLUMETRIC, {"mu": 2.0}), "does not use the coefficient 'mu'"),
    (("J * (I1 - 3)" + VOLUMETRIC, {"J": 2.0}), "another name"),
    (("sin(I1)", {}), "only log, exp, sqrt"),
    (("log(I1, 2)", {}), "2 argument"),
    (("I1**J", {}), "exponent"),
    (("I1 if J else I2", {}), "may hold numbers"),
    (("__import__('os').getcwd()", {}), "may hold numbers"),
    (("(1).real", {}), "may hold numbers"),
    (("True * I1", {}), "finite number"),
    (("3 + 4", {}), "does not depend"),
    (("I1 / (2 - 2)", {}), "cannot be evaluated"),
    (("log(0) * I1", {}), "finite"),
    (("log(1 - J) + I1", {}), "not finite at the stretches"),
    (("5 * (lambdabar1**2 - 1)" + VOLUMETRIC, {}), "prefer a direction"),
    (("-5 * (I1 - 3)" + VOLUMETRIC, {}), "shear modulus"),
    (("5 * (I1 - 3)", {}), "bulk modulus"),
    (("5 * (I1 - 3) + 60 * J**2", {}), "free of stress at rest: its mean stress there is 120 kPa"),
    ((" + ".join(f"I1**{n}" for n in range(2, 150)), {}), "operations, more than 200"),
    (("(" * 300 + "I1" + ")" * 300, {}), "not a formula|cannot be evaluated"),
    ((5.0, {}), "must be a text"),
    (("mu * I1", {"mu": np.nan}), ("mu",)),
    call=lambda given: Energy(given[0], tuple(given[1].items())),
)  # fmt: skip


test_unusable_laws_are_refused = refusals(
    (lambda: Ogden((), (), 10.0), "one to three moduli"),
    (lambda: Ogden((1.0,) * 4, (1.0, 2.0, 3.0, 4.0), 10.0), "got 4 and 4"),
    (lambda: Ogden((1.0, 2.0), (1.0,), 10.0), "got 2 and 1"),
    (lambda: Ogden((1.0,), (0.0,), 10.0), "exponent of Ogden may be 0"),
    (lambda: Ogden((1.0, -2.0), (1.0, 2.0), 10.0), "initial shear modulus of Ogden"),
    (lambda: Ogden((1.0,), (2.0,), 0.0), ("bulk_kpa",)),
    (lambda: Hyperfoam((1.0,), (np.inf,), 0.4), ("exponents",)),
    (lambda: Hyperfoam((1.0,), (2.0,), 0.5), "0.5; take 0.4999"),
    (lambda: Hencky(0.0, 1.0), ("shear_kpa",)),
    (lambda: Material("rubber"), "law must be"),
    (lambda: Material(Hencky(1.0, 1.0), prony=0.3), ("prony",)),
    (lambda: Material.linear_elastic(1.0, 0.3, law="st_venant"), "neo_hooke, hencky"),
)  # fmt: skip


STABLE_RIVLIN = Polynomial(c10=5.0, c01=1.0, bulk_linear=100.0)


def test_stable_laws_and_published_foams_are_taken_without_a_word():
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        for law in (*LAWS.values(), STABLE_RIVLIN):
            Material(law)
    # Wu's hyperfoams have negative terms, and are stable all the same.
    for moduli, exponents in (
        (tissues.WU_SKIN_HYPERFOAM_MU, tissues.WU_SKIN_HYPERFOAM_ALPHA),
        (tissues.WU_SUBCUTIS_HYPERFOAM_MU, tissues.WU_SUBCUTIS_HYPERFOAM_ALPHA),
    ):
        assert instability(Hyperfoam(moduli.value, exponents.value, tissues.WU_HYPERFOAM_POISSON.value)) == ""
    # Convex by a formula, and by numbers.
    for coefficients in (
        tissues.HUMAN_STRATUM_CORNEUM,
        tissues.HUMAN_LIVING_EPIDERMIS,
        tissues.HUMAN_SUBCUTIS,
    ):
        law = Polynomial(*coefficients.value, bulk_linear=100.0)
        assert instability(law) == instability(law.energy) == ""


def stiffness_by_differences(formula, coefficients, logs):
    """Smallest stiffness of the energy against isochoric changes of the logarithmic stretches."""
    step, directions = 1e-4, np.array([[1.0, -1.0, 0.0, 0.0], [1.0, 1.0, -2.0, 0.0]])

    def energy(first, second):
        return slow(formula, coefficients, logs + step * (first * directions[0] + second * directions[1]))

    here = energy(0, 0)
    diagonal = [energy(*unit) + energy(-unit[0], -unit[1]) - 2 * here for unit in ((1, 0), (0, 1))]
    mixed = (energy(1, 1) + energy(-1, -1) - energy(1, -1) - energy(-1, 1)) / 4
    return np.linalg.eigvalsh([[diagonal[0], mixed], [mixed, diagonal[1]]])[0] / step**2


UNSTABLE = {
    "softens when stretched": Polynomial(c10=5.0, c20=-0.4, bulk_linear=100.0),
    "softens at once": Polynomial(c10=8.0, c01=-3.0, bulk_linear=100.0),
    "softens when compressed": Ogden((14.0, -4.0), (2.0, -4.0), bulk_kpa=200.0),
}


@pytest.mark.parametrize("law", UNSTABLE.values(), ids=UNSTABLE)
def test_instability_is_named_where_it_starts(law):
    with pytest.warns(MaterialWarning, match="is unstable in") as caught:
        Material(law)
    found = re.search(r"in (\w+) (\w+) from stretch ([\d.]+) on", str(caught[0].message))
    mode, side, stretch = found[1], found[2], float(found[3])
    assert (stretch > 1.0) == (side == "tension")
    path = np.array({"uniaxial": (1.0, -0.5, -0.5, 0.0), "equibiaxial": (1.0, 1.0, -2.0, 0.0)}[mode])
    formula, coefficients = law.energy.formula, dict(law.energy.coefficients)
    before, after = (
        stiffness_by_differences(formula, coefficients, np.log(stretch) * (1 + by) * path)
        for by in (-0.15, 0.05)
    )
    assert after < 0.0 < before


def test_foam_may_lose_its_stability_in_compression():
    assert "uniaxial compression" in instability(Hyperfoam((-9.0, 10.0), (6.0, 1.0), poisson=0.1))
    assert instability(Hyperfoam((-9.0, 10.0), (2.0, 1.0), poisson=0.3)) != ""


def test_laws_of_different_length_share_one_table():
    foam, rubber = Material(LAWS["hyperfoam"]), Material(LAWS["polynomial"])
    table = MaterialTable.of([foam, rubber])
    assert table.law.shape[1] == 11 + 4 * len(LAWS["hyperfoam"].energy.program)
    np.testing.assert_array_equal(table.law[1, 11:], 0.0)
