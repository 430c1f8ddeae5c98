"""Relaxation against closed forms of Prony series, and the energy that springs hold."""

import numpy as np
import pytest

from fingerpad.geometry.mesh import block_mesh
from fingerpad.mechanics.assembly import Sparsity, assemble
from fingerpad.mechanics.materials import Material, MaterialTable, Polynomial, Prony
from fingerpad.mechanics.viscoelastic import (
    StepCoefficients,
    StressHistory,
    instantaneous_state,
    stored_energy_density,
)

PRONY = Prony(shares=(0.25, 0.35), times_ms=(40.0, 900.0))
SKIN = Material(Polynomial(c10=4.0, c01=1.5, c20=2.5, c11=0.7, c02=0.9, bulk_linear=130.0), prony=PRONY)
CUBE = block_mesh([0.0, 1.0], [0.0, 1.0], [0.0, 1.0], layers=[0])
TABLE = MaterialTable.of([SKIN])
SHARES, TIMES_MS = np.array(PRONY.shares), np.array(PRONY.times_ms)
FAST_MS, SLOW_MS = 1e-6, 1e7


def shear(amount):
    """Displacement of the cube's nodes in simple shear."""
    return np.outer(CUBE.nodes_mm[:, 1], [amount, 0.0, 0.0])


def march(times_ms, displacements, table=TABLE):
    """Impose displacements at times (from the unloaded state at 0); internal forces and stored energies."""
    sparsity = Sparsity.of(CUBE.elements, len(CUBE.nodes_mm))
    history = StressHistory.unloaded(1, table.shares.shape[1])
    blocks, forces, energies, before = np.empty((sparsity.column.size, 3, 3)), [], [], 0.0
    for time, displacement in zip(times_ms, displacements, strict=True):
        step = StepCoefficients.of(table, time - before)
        force = np.empty_like(displacement)
        assemble(
            CUBE, displacement, table.law, step.s,
            history.carried(step, CUBE.layer), sparsity, False, force, blocks,
        )  # fmt: skip
        where = CUBE, displacement, table
        now = instantaneous_state(*where)
        history = history.advanced(step, CUBE.layer, now.stress_kpa)
        energy = stored_energy_density(*where, history, now)
        forces.append(force)
        energies.append(energy[0])
        before = time
    return np.array(forces), np.array(energies)


def elastic(factor):
    """The same tissue without relaxation, its coefficients times `factor`."""
    coefficients = [factor * getattr(SKIN.law, name) for name in ("c10", "c01", "c20", "c11", "c02")]
    return MaterialTable.of([Material(Polynomial(*coefficients, bulk_linear=SKIN.law.bulk_linear))])


def ramp_factor(times_ms, ramp_ms):
    """S(t) / S0(end of ramp) for S0 that rises linearly and is then held: convolution of g with the ramp."""
    since = np.asarray(times_ms)[:, None]
    inside = np.minimum(since, ramp_ms)
    lost = inside - TIMES_MS * (np.exp(-(since - inside) / TIMES_MS) - np.exp(-since / TIMES_MS))
    return (inside[:, 0] - (SHARES * lost).sum(axis=1)) / ramp_ms


@pytest.mark.parametrize(
    "times_ms",
    [[50.0, 1000.0], [10.0, 25.0, 30.0, 50.0, 51.0, 400.0, 1000.0], list(np.arange(5.0, 1001.0, 5.0))],
    ids=["2 steps", "7 uneven steps", "200 steps"],
)
def test_steps_of_any_size_give_the_same_exact_ramp_and_hold(times_ms):
    """The recurrence is exact while S0 is linear in time within each step."""
    layer = np.zeros(1, dtype=int)
    end = np.random.default_rng(4).normal(size=(1, 8, 6))
    history, before = StressHistory.unloaded(1, 2), 0.0
    for time in times_ms:
        step = StepCoefficients.of(TABLE, time - before)
        stress = min(time / 50.0, 1.0) * end
        relaxed = step.s[0] * stress - history.carried(step, layer)
        history, before = history.advanced(step, layer, stress), time
        np.testing.assert_allclose(relaxed, ramp_factor([time], 50.0)[0] * end, rtol=1e-11)
        np.testing.assert_allclose(stress - history.relaxed.sum(axis=0), relaxed, rtol=1e-11)


def test_stored_energy_of_a_held_shear_decays_from_instantaneous_to_long_term():
    displacement, times = shear(0.6), np.array([3.0, 40.0, 700.0])
    _, energies = march([FAST_MS, *(FAST_MS + times), SLOW_MS], [displacement] * 5)
    _, (instantaneous,) = march([1.0], [displacement], elastic(1 / PRONY.long_term_share))
    _, (long_term,) = march([1.0], [displacement], elastic(1.0))
    share = PRONY.long_term_share + (SHARES * np.exp(-2 * times[:, None] / TIMES_MS)).sum(axis=1)
    np.testing.assert_allclose(energies[0], instantaneous, rtol=1e-6)
    np.testing.assert_allclose(energies[1:-1], share * instantaneous, rtol=1e-6)
    np.testing.assert_allclose(energies[-1], long_term, rtol=1e-6)


FOAM = Material.hyperfoam((2.0, 3.0, 6.0), (-3.0, 7.0, 4.5), poisson=0.4, prony=PRONY)
OGDEN = Material.ogden((3.0, 4.0, 5.0), (-2.0, 3.5, 1.5), poisson=0.45, prony=PRONY)
SQUEEZED = CUBE.nodes_mm @ (np.diag([0.1, -0.15, 0.05]) + 0.2 * np.eye(3, k=1))


def test_foam_relaxes_as_a_whole_by_its_prony_series_and_rubber_keeps_its_pressure():
    swollen = 0.06 * CUBE.nodes_mm
    for material, expected in ((FOAM, PRONY.long_term_share), (OGDEN, 1.0)):
        (fast, slow), _ = march([FAST_MS, SLOW_MS], [swollen] * 2, MaterialTable.of([material]))
        np.testing.assert_allclose(slow, expected * fast, rtol=0, atol=1e-6 * np.abs(fast).max())
    # The Kirchhoff stress of a held foam is that at once times g(t), whatever its deformation.
    times = np.array([FAST_MS, 5.0, 60.0, 800.0])
    forces, _ = march(times, [SQUEEZED] * 4, MaterialTable.of([FOAM]))
    series = 1 - (SHARES * (1 - np.exp(-times[:, None] / TIMES_MS))).sum(axis=1)
    expected = series[:, None, None] * forces[0]
    np.testing.assert_allclose(forces, expected, rtol=0, atol=1e-6 * np.abs(forces[0]).max())


def test_history_is_that_of_its_formula():
    """H and S_i against the two lines of the module's head, written for whole arrays."""
    rng, n = np.random.default_rng(5), 700
    layer = rng.integers(0, 2, n)
    step = StepCoefficients(1.0, *(rng.uniform(0.1, 1.0, size) for size in ((2,), (2, 3), (2, 3), (2, 3))))
    before = StressHistory(rng.normal(size=(n, 8, 6)), rng.normal(size=(3, n, 8, 6)))
    now = rng.normal(size=(n, 8, 6))
    new, old, decay = (of.T[:, layer, None, None] for of in (step.new, step.old, step.decay))
    carried = (old * before.instantaneous + decay * before.relaxed).sum(axis=0)
    np.testing.assert_allclose(before.carried(step, layer), carried, rtol=0, atol=1e-14)
    advanced = before.advanced(step, layer, now)
    wanted = new * now + old * before.instantaneous + decay * before.relaxed
    np.testing.assert_allclose(advanced.relaxed, wanted, rtol=0, atol=1e-14)
    assert advanced.instantaneous is now
