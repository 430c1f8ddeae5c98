"""Energy balance: closed forms for one element, and the balance of whole indentations."""

import numpy as np
import pytest
from scipy.integrate import quad

import fingerpad as fp
from fingerpad.geometry.mesh import block_mesh
from fingerpad.geometry.mesh_checks import jacobian_at_gauss
from fingerpad.mechanics.balance import (
    EnergyBalance,
    MeanRelaxed,
    contact_energy,
    indenter_work,
    instantaneous_energy,
    relaxed_work,
)
from fingerpad.mechanics.contact import PlacedIndenter, place
from fingerpad.mechanics.element import SHAPE_DERIVATIVES
from fingerpad.mechanics.materials import Hyperfoam, MaterialTable
from fingerpad.mechanics.press import Specimen, press
from fingerpad.mechanics.viscoelastic import (
    StepCoefficients,
    StressHistory,
    instantaneous_state,
    stored_energy_density,
)
from presses import ELASTIC, block, press_into

PRONY = fp.Prony(shares=(0.25, 0.35), times_ms=(40.0, 900.0))
CUBE = block_mesh([0.0, 1.0], [0.0, 1.0], [0.0, 1.0], layers=[0])
SHEAR_KPA = 11.0
RELAXING = fp.Material.neo_hooke(SHEAR_KPA, 0.48, PRONY, moduli="instantaneous")


def test_work_of_a_force_is_exact_for_cubics_and_stops_at_kinks():
    times = np.array([0.0, 2.0, 3.0, 5.0, 6.0, 9.0, 20.0])
    depth = np.minimum(times, 5.0) / 5.0
    force = np.where(times <= 5.0, depth**3, 1.0 - 0.02 * (times - 5.0))
    work = indenter_work(times, depth, force, kinks_ms=(5.0,))
    np.testing.assert_allclose(work, 0.25 * depth**4, rtol=1e-12)
    smeared = indenter_work(times, depth, force, kinks_ms=())
    assert abs(smeared[-1] - 0.25) > 1e-3
    times = np.array([0.0, 1.0, 2.0, 4.0, 8.0])
    depth = 1.0 - np.exp(-times)
    work = indenter_work(times, depth, np.full(5, 7.0), kinks_ms=())
    np.testing.assert_allclose(work, 7.0 * depth, rtol=1e-12)
    work = indenter_work(np.array([0.0, 1.0]), np.array([0.0, 2.0]), np.array([0.0, 3.0]), kinks_ms=())
    assert work.tolist() == [0.0, 3.0]


def test_work_of_a_force_that_grows_evenly_and_falls_again_is_that_of_hertz():
    """F = d^3/2 gives W = 2/5 d^5/2; splines of time, of which d is a root, err by three times as much."""
    times = np.arange(11.0)
    force = np.minimum(times, 10.0 - times) / 5.0
    depth = force ** (2 / 3)
    work = indenter_work(times, depth, force, kinks_ms=(5.0,))
    np.testing.assert_allclose(work, 0.4 * depth**2.5, atol=1e-3)


def test_contact_stores_only_while_it_presses():
    gap = [np.array([0.3, -0.01, -0.02, 0.1]), np.array([-0.02, -0.03, 0.2, 0.2])]
    force = [np.array([0.0, 1.0, 4.0, 0.0]), np.array([2.0, 3.0, 0.0, 0.0])]
    # comes: 2/2 x 0.02; pressed further: (1 + 3)/2 x 0.02; leaves: 4/2 x -0.02; never touched: 0
    np.testing.assert_allclose(contact_energy(gap[0], force[0], gap[1], force[1]), 0.02 + 0.04 - 0.04)


@pytest.mark.parametrize("step_ms", [1e-4, 0.2, 5.0, 300.0, 1e5])
def test_mean_of_the_relaxed_stress_is_that_of_its_exponentials(step_ms):
    """S(t) of S' = (g S0 - S) / tau with S0 linear from p to r and S = s at the start, over the step."""
    tau, share = PRONY.times_ms[0], PRONY.shares[0]
    mean = MeanRelaxed.of(MaterialTable.of([RELAXING]), step_ms)
    marks = [step_ms * part for part in (1e-3, 1e-2, 0.1)]

    def average(start, end, relaxed):
        slope = share * (end - start) / step_ms

        def stress(t):
            lost = -np.expm1(-t / tau)
            return relaxed * (1 - lost) + share * start * lost + slope * (t - tau * lost)

        return quad(stress, 0.0, step_ms, points=marks, limit=500, epsabs=0, epsrel=1e-11)[0] / step_ms

    for found, unit in ((mean.new, (0, 1, 0)), (mean.old, (1, 0, 0)), (mean.kept, (0, 0, 1))):
        np.testing.assert_allclose(found[0, 0], average(*unit), rtol=1e-8)


def sheared(amount):
    return np.outer(CUBE.nodes_mm[:, 1], [amount, 0.0, 0.0])


def spent(material, times_ms, displacements, mesh=CUBE):
    """Energy dissipated up to each time of a prescribed motion."""
    table = MaterialTable.of([material])
    history = StressHistory.unloaded(len(mesh.elements), table.shares.shape[1])
    volume = jacobian_at_gauss(mesh).sum(axis=1)
    unspent, before, last, sums = 0.0, 0.0, np.zeros_like(mesh.nodes_mm), []
    for time, displacement in zip(times_ms, displacements, strict=True):
        step = StepCoefficients.of(table, time - before)
        now = instantaneous_state(mesh, displacement, table)
        unspent += relaxed_work(mesh, last, displacement, table, time - before, history, now)
        history = history.advanced(step, mesh.layer, now.stress_kpa)
        before, last = time, displacement
        stored = stored_energy_density(mesh, displacement, table, history, now) @ volume
        sums.append(instantaneous_energy(now) - stored - unspent)
    return np.array(sums)


@pytest.mark.parametrize("ramp_steps", [1, 7])
def test_one_relaxing_element_follows_the_closed_form(ramp_steps):
    """Ramp, then hold, of shear: the energy spent in branch i is the integral of s_i²/(g_i G tau_i)."""
    ramp_ms, amount = 60.0, 1e-4
    ramp, hold = np.linspace(0.0, ramp_ms, ramp_steps + 1)[1:], np.array([61.0, 200.0, 5000.0])
    times = np.concatenate([ramp, hold])
    motion = [sheared(amount * min(time / ramp_ms, 1.0)) for time in times]
    expected = np.zeros(times.size)
    for share, tau in zip(PRONY.shares, PRONY.times_ms, strict=True):
        scale = share * SHEAR_KPA * (amount / ramp_ms) ** 2 * tau
        x = np.minimum(times, ramp_ms) / tau
        in_ramp = tau * (x + 2 * np.expm1(-x) - 0.5 * np.expm1(-2 * x))
        since = np.maximum(times - ramp_ms, 0.0) / tau
        in_hold = -0.5 * tau * np.expm1(-ramp_ms / tau) ** 2 * np.expm1(-2 * since)
        expected += scale * (in_ramp + in_hold)
    np.testing.assert_allclose(spent(RELAXING, times, motion), expected, rtol=2e-6)


def test_work_of_the_relaxed_stress_is_that_of_a_slow_look_at_every_point():
    """Any step of any law: distorted elements, random history."""
    rng = np.random.default_rng(4)
    mesh = block_mesh([0.0, 1.0, 2.2], [0.0, 0.7], [0.0, 1.0], layers=[0])
    ends = [0.1 * rng.uniform(-1.0, 1.0, mesh.nodes_mm.shape) for _ in range(2)]
    full = np.array([[0, 3, 5], [3, 1, 4], [5, 4, 2]])
    foam = fp.Material(Hyperfoam((2.0, 3.0), (-3.0, 7.0), poisson=0.3), PRONY)
    for material in (RELAXING, foam):
        table = MaterialTable.of([material])
        history = StressHistory(rng.normal(size=(2, 8, 6)), 0.2 * rng.normal(size=(2, 2, 8, 6)))
        now = instantaneous_state(mesh, ends[1], table)
        found = relaxed_work(mesh, *ends, table, 25.0, history, now)
        mean = MeanRelaxed.of(table, 25.0)
        expected = 0.0
        for e in range(2):
            weights = now.energies[e, :, 0]
            squares = []
            for moved in ends:
                gradients = slow_gradients(mesh, moved, e)
                volumes = np.linalg.det(gradients)
                free = weights @ volumes / weights.sum() if material is foam else 1.0
                scale = (free / volumes) ** (2 / 3)
                squares.append(scale[:, None, None] * gradients.swapaxes(1, 2) @ gradients)
            strained = 0.5 * (squares[1] - squares[0])
            for q in range(8):
                for i in range(2):
                    relaxed = (
                        mean.new[0, i] * now.stress_kpa[e, q] + mean.kept[0, i] * history.relaxed[i, e, q]
                    )
                    relaxed = relaxed + mean.old[0, i] * history.instantaneous[e, q]
                    expected += weights[q] * (relaxed[full] * strained[q]).sum()
        np.testing.assert_allclose(found, expected, rtol=1e-10)


def slow_gradients(mesh, displacement, element):
    corners, gradients = mesh.elements[element], []
    for slopes in SHAPE_DERIVATIVES:
        inverse = np.linalg.inv(mesh.nodes_mm[corners].T @ slopes)
        gradients.append(np.eye(3) + displacement[corners].T @ slopes @ inverse)
    return np.array(gradients)


def pressed(indenter, prony, ramp_steps=6, hold_steps=6, depth_mm=0.4):
    layers = tuple(layer.with_prony(prony) for layer in ELASTIC)
    motion = fp.RampAndHold(depth_mm=depth_mm, ramp_ms=50.0, hold_ms=500.0)
    mesh = block()
    return press_into(mesh, layers, indenter, motion, fp.PressSettings(ramp_steps, hold_steps)), mesh


BALL = fp.Sphere(curvature_per_m=500.0)


def test_an_elastic_press_dissipates_nothing_and_balances_with_second_order_in_its_steps():
    imbalance = []
    for steps in (3, 6, 12):
        energy = pressed(fp.FlatPunch(2.0, 0.3), fp.Prony(), steps, 1)[0].energy
        assert not energy.dissipated_uj.any()
        imbalance.append(energy.relative_imbalance)
    assert imbalance[-1] < 3e-4
    assert imbalance[0] > 3.5 * imbalance[1] > 3.5**2 * imbalance[2]


def test_the_balance_holds_at_finite_strain_as_in_linear_theory():
    """The heat belongs to the energy that is stored, whatever the law: 13 % of strain cost nothing."""
    for depth_mm in (0.01, 0.4):
        energy = pressed(fp.Plate(), PRONY, 12, 12, depth_mm=depth_mm)[0].energy
        assert energy.relative_imbalance < 3e-4


def test_heat_of_a_foam_pressed_and_released_by_a_quarter_is_never_negative_and_balances():
    """The whole stress relaxes. The loss rate of a linear law would leave 5 %, however many steps."""
    foam = fp.Material.hyperfoam((10.0,), (4.0,), 1e-6, fp.Prony(shares=(0.3, 0.2), times_ms=(40.0, 300.0)))
    mesh = block_mesh([0.0, 2.0], [0.0, 2.0], [0.0, 2.0], layers=[2])
    placement = place(fp.Plate(), mesh.nodes_mm[mesh.skin_nodes], np.zeros(3), np.eye(3))
    motion = fp.Trajectory((0.0, 50.0, 250.0, 300.0, 400.0), (0.0, 0.5, 0.5, 0.0, 0.0))
    imbalance = []
    for steps in (5, 20):
        energy = press(
            Specimen(mesh, (foam,) * 4),
            PlacedIndenter(fp.Plate(), placement),
            motion,
            fp.PressSettings(steps, steps),
        ).energy
        assert (np.diff(energy.dissipated_uj) > 0.0).all()
        imbalance.append(energy.relative_imbalance)
    assert imbalance[0] < 0.01
    assert imbalance[1] < 0.1 * imbalance[0]


def test_terms_of_a_press_are_those_of_its_fields():
    """Stored energy and, by another integral, the work of the whole body: sums over the elements."""
    done, mesh = pressed(BALL, PRONY)
    volume = 2.0 * jacobian_at_gauss(mesh).sum(axis=1)  # both halves
    np.testing.assert_allclose(done.energy.stored_uj, done.sed_kpa @ volume, rtol=1e-12)
    np.testing.assert_array_equal(done.sed_kpa, done.fields.stored_kpa)
    given = done.energy.external_uj - done.energy.contact_uj
    np.testing.assert_allclose(done.fields.work_kpa @ volume, given, rtol=0, atol=0.004 * given[-1])


def test_balance_at_some_of_its_times():
    energy = EnergyBalance(*np.arange(20.0).reshape(5, 4))
    chosen = energy.at(np.array([0.0, 3.0]))
    assert chosen.times_ms.tolist() == [0.0, 3.0]
    assert chosen.contact_uj.tolist() == [16.0, 19.0]
    assert EnergyBalance(*np.zeros((5, 2))).relative_imbalance == 0.0
