"""Relaxation against closed forms: one element, a generalised Maxwell solid, and a pressed block."""

from __future__ import annotations

import numpy as np
from scipy.interpolate import interp1d

from fingerpad.geometry.bodies import Plate, Sphere
from fingerpad.geometry.mesh import block_mesh
from fingerpad.geometry.motion import RampAndHold
from fingerpad.geometry.motions import sine
from fingerpad.mechanics.contact import PlacedIndenter, place
from fingerpad.mechanics.materials import Material, Polynomial, Prony
from fingerpad.mechanics.newton import NewtonSettings
from fingerpad.mechanics.press import Specimen, press
from fingerpad.mechanics.press_settings import PressSettings
from fingerpad.mechanics.viscoelastic import (
    StepCoefficients,
    StressHistory,
    instantaneous_state,
    stored_energy_density,
)

from . import balance
from .case import Row, at_most, case, near
from .laws import CUBE
from .solid import Solid

THEME = "Relaxation"
PRONY = Prony(shares=(0.25, 0.35), times_ms=(40.0, 900.0))
SHARES, TIMES_MS = np.array(PRONY.shares), np.array(PRONY.times_ms)
POLYNOMIAL = Polynomial(c10=4.0, c01=1.5, c20=2.5, c11=0.7, c02=0.9, bulk_linear=130.0)
LAWS = {
    "polynomial N = 2": Material(POLYNOMIAL, PRONY),
    "Ogden N = 3": Material.ogden((3.0, 4.0, 5.0), (-2.0, 3.5, 1.5), 0.48, PRONY),
    "hyperfoam N = 2": Material.hyperfoam((2.0, 6.0), (7.0, 4.5), 0.4, PRONY),
    "Hencky": Material.linear_elastic(30.0, 0.45, PRONY, law="hencky"),
}
INSTANT_MS, INWARDS_MS = 1e-6, 0.05
"""A time in which nothing relaxes, and a short one in which an indenter can be driven in. [ms]"""


def shear(amount):
    """Displacements of the cube in simple shear. [mm]"""
    return np.outer(CUBE.nodes_mm[:, 1], [amount, 0.0, 0.0])


def march(material, times_ms, displacements):
    """Forces [mN] and stored energy [µJ] of the cube that is given displacements at times, from rest at 0."""
    solid = Solid(CUBE, (material,) * 4)
    history, forces, energies, before = StressHistory.unloaded(1, len(SHARES)), [], [], 0.0
    for time, displacement in zip(times_ms, displacements, strict=True):
        step = StepCoefficients.of(solid.table, time - before)
        forces.append(solid.evaluate(displacement, step=step, history=history)[1])
        place_of = CUBE, displacement, solid.table
        now = instantaneous_state(*place_of)
        history, before = history.advanced(step, CUBE.layer, now.stress_kpa), time
        energies.append(stored_energy_density(*place_of, history, now)[0])
    return np.array(forces), np.array(energies)


def relaxation(times_ms):
    """g(t) = 1 - sum g_i (1 - exp(-t / tau_i))."""
    return 1 - (SHARES * (1 - np.exp(-np.asarray(times_ms)[..., None] / TIMES_MS))).sum(axis=-1)


def ramped(times_ms, ramp_ms):
    """Stress over its instantaneous value at the ramp's end: the convolution of g with a ramp and hold."""
    since = np.asarray(times_ms)[:, None]
    inside = np.minimum(since, ramp_ms)
    lost = inside - TIMES_MS * (np.exp(-(since - inside) / TIMES_MS) - np.exp(-since / TIMES_MS))
    return (inside[:, 0] - (SHARES * lost).sum(axis=1)) / ramp_ms


@case(THEME, "One element held in shear", "Prony series")
def held_element() -> list[Row]:
    """A cube is sheared by 0.6 at once and held: shear force over its first value. Every nodal force follows
    the same g(t), at finite strain and for every law."""
    times = np.array([1.0, 7.0, 40.0, 300.0, 2000.0])
    forces = {
        name: march(material, [INSTANT_MS, *(INSTANT_MS + times)], [shear(0.6)] * 6)[0]
        for name, material in LAWS.items()
    }
    top = CUBE.nodes_mm[:, 1] == 1.0
    first = forces["polynomial N = 2"][:, top, 0].sum(axis=1)
    rows = [
        near(f"polynomial N = 2: share of the force after {time:g} ms", expected, got, 1e-6)
        for time, expected, got in zip(times, relaxation(times), first[1:] / first[0], strict=True)
    ]
    for name, force in forces.items():
        error = np.abs(force[1:] - relaxation(times)[:, None, None] * force[0]).max() / np.abs(force[0]).max()
        rows.append(at_most(f"{name}: largest error of any nodal force, relative", 1e-6, error))
    return rows


@case(THEME, "Ramp and hold of a Maxwell solid", "Generalised Maxwell solid")
def maxwell_solid() -> list[Row]:
    """A cube is sheared by 0.001 in 50 ms and held. Shear force, energy stored in the springs, and work minus
    that energy, which is dissipated in the dashpots: h_i' = g' - h_i / tau_i, G_i h_i² / tau_i.
    """
    final, ramp = 1e-3, 50.0
    times = np.concatenate([np.linspace(0.5, 50.0, 100), 50 + np.geomspace(0.5, 1450.0, 100)])
    amounts = final * np.minimum(times / ramp, 1.0)
    material = LAWS["polynomial N = 2"]
    forces, energies = march(material, times, [shear(amount) for amount in amounts])
    force = forces[:, CUBE.nodes_mm[:, 1] == 1.0, 0].sum(axis=1)
    stiffness = material.shear_modulus_kpa / PRONY.long_term_share
    since, inside = times[:, None], np.minimum(times, ramp)[:, None]
    springs = final / ramp * TIMES_MS * (np.exp(-(since - inside) / TIMES_MS) - np.exp(-since / TIMES_MS))
    held = stiffness / 2 * (PRONY.long_term_share * amounts**2 + (SHARES * springs**2).sum(axis=1))
    knots = np.concatenate([[0.0], force]), np.concatenate([[0.0], amounts])
    work = np.concatenate([[0.0], np.cumsum(0.5 * (knots[0][1:] + knots[0][:-1]) * np.diff(knots[1]))])[1:]
    # The heat of each dashpot up to t, in closed form while it is loaded and while it relaxes.
    rate, loaded = final / ramp, np.minimum(times, ramp)[:, None]
    x = np.exp(-loaded / TIMES_MS)
    heat = rate**2 * TIMES_MS * (loaded - 2 * TIMES_MS * (1 - x) + TIMES_MS / 2 * (1 - x**2))
    at_end = rate * TIMES_MS * (1 - x)
    heat = heat + at_end**2 / 2 * (1 - np.exp(-2 * (since - loaded) / TIMES_MS))
    heat = stiffness * (SHARES * heat).sum(axis=1)
    rows = []
    for time in (25.0, 50.0, times[-60], 1500.0):
        n = int(np.abs(times - time).argmin())
        factor = ramped(times[n : n + 1], ramp)[0]
        label = f"after {times[n]:.3g} ms"
        rows += [
            near(f"shear force {label}", stiffness * final * factor, force[n], 1e-5, "mN"),
            near(f"stored energy {label}", 1e6 * held[n], 1e6 * energies[n], 1e-5, "pJ"),
            near(
                f"work less stored energy {label}", 1e6 * heat[n], 1e6 * (work[n] - energies[n]), 1e-3, "pJ"
            ),
        ]
    return rows


def complex_modulus(frequency_hz):
    """Return storage and loss modulus over the modulus at once, from x = 2 pi f tau of each branch."""
    x = 2e-3 * np.pi * frequency_hz * TIMES_MS
    return 1 - SHARES.sum() + (SHARES * x**2 / (1 + x**2)).sum(), (SHARES * x / (1 + x**2)).sum()


def in_and_out_of_phase(times_ms, values, frequency_hz):
    """Amplitudes of sine and cosine beside a mean and what decays from the start with either time."""
    angle = 2e-3 * np.pi * frequency_hz * times_ms
    decays = np.exp(-times_ms[:, None] / TIMES_MS)
    columns = np.column_stack([np.sin(angle), np.cos(angle), np.ones_like(angle), decays])
    return np.linalg.lstsq(columns, values, rcond=None)[0][:2]


@case(THEME, "One element in oscillating shear", "Storage and loss modulus of a generalised Maxwell solid")
def oscillating_element() -> list[Row]:
    """A cube is sheared by 0.001 sin(2 pi f t), three cycles of 100 steps: parts of its force in and out
    of phase with the shear, over the force without relaxation.
    """
    rows, amplitude, material = [], 1e-3, LAWS["polynomial N = 2"]
    at_once = material.shear_modulus_kpa / PRONY.long_term_share * amplitude
    for frequency in (0.2, 4.0, 50.0):
        times = np.arange(1, 301) * 10.0 / frequency
        amounts = amplitude * np.sin(2e-3 * np.pi * frequency * times)
        forces, _ = march(material, times, [shear(amount) for amount in amounts])
        force = forces[:, CUBE.nodes_mm[:, 1] == 1.0, 0].sum(axis=1)
        got = in_and_out_of_phase(times, force, frequency) / at_once
        for name, expected, share in zip(("storage", "loss"), complex_modulus(frequency), got, strict=True):
            rows.append(near(f"{frequency:g} Hz: {name} modulus, share", expected, share, 2e-3))
    return rows


@case(
    THEME,
    "Block under an oscillating plate",
    "Storage and loss modulus; exact for an incompressible body",
    slow=True,
)
def oscillating_block() -> list[Row]:
    """A plate is pressed 0.02 mm into a block, held, and vibrates by 0.005 mm for 15 cycles of 20 steps, of
    which some are interpolated: parts of its force in and out of phase, over those of the block without
    relaxation. Stress is taken as linear in each step, so that its relaxed part is by 0.8 % too small.
    """
    edges = np.array([0.0, 0.5, 1.2, 2.0])
    mesh = block_mesh(np.concatenate([-edges[:0:-1], edges]), edges, edges, [0, 1, 3], symmetric=True)
    placement = place(Plate(), mesh.nodes_mm[mesh.skin_nodes], np.zeros(3), np.eye(3))
    moduli = np.array([40.0, 40.0, 20.0, 8.0])
    relaxing = tuple(Material.neo_hooke(shear, 0.4999, PRONY) for shear in moduli)
    at_once = tuple(Material.neo_hooke(shear, 0.4999) for shear in moduli / PRONY.long_term_share)
    tight = PressSettings(3, 4, NewtonSettings(residual_tolerance=1e-7, penetration_tolerance=1e-4))
    rows = []
    for frequency in (2.0, 20.0):
        motion = sine(0.02, 0.005, frequency, cycles=15, hold_ms=200.0)
        amplitudes = []
        for materials in (relaxing, at_once):
            done = press(Specimen(mesh, materials), PlacedIndenter(Plate(), placement), motion, tight)
            vibrates = done.times_ms > motion.cycles.start_ms
            times = done.times_ms[vibrates] - motion.cycles.start_ms
            amplitudes.append(in_and_out_of_phase(times, done.force_mn[vibrates], frequency))
        storage, loss = amplitudes[0] / amplitudes[1][0]
        expected = complex_modulus(frequency)
        rows += [
            near(f"{frequency:g} Hz: storage modulus, share", expected[0], storage, 5e-3),
            near(f"{frequency:g} Hz: loss modulus, share", expected[1], loss, 0.02),
        ]
    return rows


@case(THEME, "Limits in time", "Definition of instantaneous and long-term moduli")
def limits_in_time() -> list[Row]:
    """The same cube, sheared by 0.6: instantaneous forces and forces after 10^7 ms against elastic cubes with
    the instantaneous and the long-term coefficients; largest relative difference.
    """
    names = ("c10", "c01", "c20", "c11", "c02")

    def elastic(factor):
        scaled = {name: factor * getattr(POLYNOMIAL, name) for name in names}
        material = Material(Polynomial(bulk_linear=POLYNOMIAL.bulk_linear, **scaled))
        return Solid(CUBE, (material,) * 4).evaluate(shear(0.6))[1]

    (fast, slow), _ = march(LAWS["polynomial N = 2"], [INSTANT_MS, 1e7], [shear(0.6)] * 2)
    rows = []
    for name, got, factor, bound in (
        ("at once", fast, 1 / PRONY.long_term_share, 1e-6),
        ("after long", slow, 1.0, 1e-4),
    ):
        expected = elastic(factor)
        rows.append(at_most(f"{name}: forces", bound, np.abs(got - expected).max() / np.abs(expected).max()))
    return rows


def pressed_block(poisson, hold_ms):
    """Times of the hold [ms] and force over its first value: a sphere pressed 0.4 mm into a block quickly."""
    edges = np.array([0.0, 0.4, 0.8, 1.3, 2.0, 3.0])
    both = np.concatenate([-edges[:0:-1], edges])
    mesh = block_mesh(both, edges, edges, layers=[0, 1, 2, 3, 3], symmetric=True)
    layers = tuple(Material.neo_hooke(shear, poisson, PRONY) for shear in (40.0, 40.0, 20.0, 8.0))
    ball = Sphere(curvature_per_m=500.0)
    placement = place(ball, mesh.nodes_mm[mesh.skin_nodes], np.zeros(3), np.eye(3))
    settings = PressSettings(3, 12, NewtonSettings(residual_tolerance=1e-6, penetration_tolerance=2e-4))
    done = press(
        Specimen(mesh, layers),
        PlacedIndenter(ball, placement),
        RampAndHold(0.4, INWARDS_MS, hold_ms),
        settings,
    )
    hold = done.times_ms[3:] - INWARDS_MS
    return hold[1:], done.force_mn[4:] / done.force_mn[3]


@case(THEME, "Relaxation of an indented block", "Prony series; exact for an incompressible body")
def relaxing_block() -> list[Row]:
    """A sphere of 2 mm indents a block of three stiffnesses by 0.4 mm within 50 µs and is held. All
    stress of an incompressible body relaxes by g(t) at constant shape; the difference decreases with 1 - 2
    nu.
    """
    rows, errors = [], {}
    for poisson, relative in ((0.49, 0.05), (0.499, 0.005)):
        hold, share = pressed_block(poisson, 2000.0)
        errors[poisson] = np.abs(share - relaxation(hold)).max()
        rows += [
            near(
                f"nu = {poisson}: share of the force after {hold[i]:.3g} ms",
                relaxation(hold[i]),
                share[i],
                relative,
            )
            for i in (int(np.abs(hold - 100.0).argmin()), -1)
        ]
    ratio = errors[0.499] / errors[0.49]
    return [*rows, at_most("largest error at nu = 0.499 over that at nu = 0.49", 0.15, ratio)]


@case(
    THEME,
    "Time steps chosen by a bound on SED",
    "120 even and growing steps; the tolerance itself",
    slow=True,
)
def chosen_steps() -> list[Row]:
    """A relaxing layered block, indented by 0.3 mm with steps chosen by a tolerance on SED, linear in
    between: largest difference from 40 + 80 steps at any of their times in the living epidermis, over its
    largest SED. Under a sphere on elements of this size (0.4 mm), a node that comes into contact within a
    step causes a kink in SED there, which earlier steps cannot predict. Half of the tolerance is reserved for
    that.
    """
    fine = PressSettings(40, 80, NewtonSettings(residual_tolerance=1e-6, penetration_tolerance=2e-4))
    rows = []
    for name in ("plate", "sphere"):
        for tolerance in (0.05, 0.01):
            error = error_of_steps(name, fine, PressSettings(sed_tolerance=tolerance))
            rows.append(
                at_most(f"{name}, tolerance {tolerance}: error over tolerance", 1.0, error / tolerance)
            )
    return rows


def error_of_steps(name, fine, chosen):
    """Largest difference of SED over time between two choices of steps, over its largest value."""
    receptors = balance.block().living_epidermis.ravel()
    truth, done = (
        balance.pressed(balance.block(), balance.INDENTERS[name], balance.RELAXING, settings=settings)
        for settings in (fine, chosen)
    )
    between = interp1d(done.times_ms, done.sed_kpa[:, receptors], axis=0)(truth.times_ms)
    return np.abs(between - truth.sed_kpa[:, receptors]).max() / truth.sed_kpa[:, receptors].max()
