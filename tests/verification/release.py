"""Release: hysteresis, free recovery, second touch, against references with one dimension or closed forms."""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from scipy.integrate import cumulative_trapezoid, quad
from scipy.optimize import brentq

from fingerpad.geometry.bodies import Plate, Sphere
from fingerpad.geometry.mesh import block_mesh
from fingerpad.geometry.motion import Motion, Trajectory
from fingerpad.geometry.motions import repeated
from fingerpad.mechanics.contact import PlacedIndenter, place
from fingerpad.mechanics.materials import Material, Prony
from fingerpad.mechanics.newton import NewtonSettings
from fingerpad.mechanics.press import Deformation, Specimen, press
from fingerpad.mechanics.press_settings import PressSettings

from . import balance
from .case import Row, at_most, case, equal, near
from .half_space import lines, round_mesh

THEME = "Release and second touch"
THICK_MM, AREA_MM2 = 2.0, 4.0
SHEAR_KPA, EXPONENT = 10.0, 4.0
SERIES = Prony(shares=(0.3, 0.2), times_ms=(40.0, 300.0))
SINGLE = Prony(shares=(0.4,), times_ms=(60.0,))
TIGHT = NewtonSettings(residual_tolerance=1e-8, penetration_tolerance=1e-4)
LOOP = Trajectory((0.0, 50.0, 250.0, 300.0, 600.0), (0.0, 0.5, 0.5, 0.0, 0.0))
FINE_MS = 0.1


@lru_cache(maxsize=8)
def foam_block(motion: Motion, prony: Prony, steps: int = 20) -> Deformation:
    """Plate on a block of a foam without lateral strain, of which the whole stress relaxes: uniform uniaxial
    compression, whatever the fixed bottom and the free sides."""
    foam = Material.hyperfoam((SHEAR_KPA,), (EXPONENT,), 1e-6, prony)
    mesh = block_mesh([0.0, 2.0], [0.0, THICK_MM], [0.0, 2.0], layers=[2])
    placement = place(Plate(), mesh.nodes_mm[mesh.skin_nodes], np.zeros(3), np.eye(3))
    return press(
        Specimen(mesh, (foam,) * 4),
        PlacedIndenter(Plate(), placement),
        motion,
        PressSettings(steps, steps, TIGHT),
    )


def instantaneous_kpa(stretch, prony: Prony):
    """Second Piola-Kirchhoff stress of the unrelaxed foam along its one stretch."""
    return _factor(prony) * (stretch**EXPONENT - 1) / stretch**2


def stretch_at(stress_kpa, prony: Prony):
    """Stretch at that stress: a quadratic equation for its square, since the exponent is 4."""
    half = stress_kpa / (2 * _factor(prony))
    return np.sqrt(half + np.sqrt(half**2 + 1))


def _factor(prony: Prony) -> float:
    return 2 * SHEAR_KPA / EXPONENT / prony.long_term_share


@lru_cache(maxsize=8)
def one_dimension(motion: Motion, prony: Prony) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Times, force on the block and compression of the same foam as springs and dashpots in one dimension.

    S_i' = (g_i S0 - S_i) / tau_i by the implicit midpoint rule in steps of `FINE_MS`. Where the plate would
    have to pull, the block is free: S0 = sum S_i.
    """
    shares, taus = np.array(prony.shares), np.array(prony.times_ms)
    times = np.arange(0.0, motion.end_ms + FINE_MS / 2, FINE_MS)
    depth = motion.prescribed_at(times)
    pressed_kpa = instantaneous_kpa(1 - depth / THICK_MM, prony)
    half = 0.5 * FINE_MS / taus
    gain = half * shares / (1 + half)
    relaxed, unrelaxed, stress = np.zeros(shares.size), np.zeros(times.size), np.zeros(times.size)
    for n in range(1, times.size):
        known = ((1 - half) * relaxed + half * shares * unrelaxed[n - 1]) / (1 + half)
        # In tension the block is free.
        unrelaxed[n] = min(pressed_kpa[n], known.sum() / (1 - gain.sum()))
        relaxed = known + gain * unrelaxed[n]
        stress[n] = unrelaxed[n] - relaxed.sum()
    stretch = stretch_at(unrelaxed, prony)
    return times, -AREA_MM2 * stretch * stress, THICK_MM * (1 - stretch)


@case(THEME, "Hysteresis of a block under a plate", "Springs and dashpots in one dimension")
def hysteresis() -> list[Row]:
    """A foam block whose stress loses a half is compressed by a quarter in 50 ms, held and released in 50 ms,
    20 steps each. Force on the way, energy lost in the loop (integral of force over depth), time at which the
    plate leaves the block, and force afterwards.
    """
    done = foam_block(LOOP, SERIES)
    times, force, _ = one_dimension(LOOP, SERIES)
    rows = [
        near(f"force at {time:g} ms, {way}", np.interp(time, times, force),
             np.interp(time, done.times_ms, done.force_mn), 2e-3, "mN")
        for time, way in ((25.0, "loading"), (50.0, "loading"), (250.0, "hold"), (265.0, "unloading"),
                          (275.0, "unloading"))
    ]  # fmt: skip
    lost = np.trapezoid(force, LOOP.prescribed_at(times))
    touched = force > 1e-6 * force.max()
    return [
        *rows,
        near("energy lost in the loop", lost, done.energy.external_uj[-1], 0.01, "µJ"),
        equal(
            "plate leaves the block", times[touched][-1], done.times_ms[done.force_mn > 0.0][-1], 2.5, "ms"
        ),
        equal("force after 300 ms", 0.0, done.force_mn[done.times_ms >= 300.0].max(), 0.0, "mN"),
        equal(
            "area of contact after 300 ms",
            0.0,
            done.contact.area_mm2[done.times_ms >= 300.0].max(),
            0.0,
            "mm²",
        ),
    ]


@case(THEME, "Recovery of a released block", "Prony series: S0 = sum S_i, S0' = -(1 - g) S0 / tau")
def recovery() -> list[Row]:
    """The same block with one Prony term (g = 0.4, tau = 60 ms) after release: without load, its
    instantaneous stress decays as exp(-(1 - g) t / tau), at any strain. From it follows the compression that
    is left. There is no adhesion: the force is 0 from the time at which the plate leaves the block.
    """
    done = foam_block(LOOP, SINGLE, steps=60)
    compression = done.displacement_mm[:, :, 1].max(axis=1)
    free = np.flatnonzero(done.times_ms >= 300.0)
    start = instantaneous_kpa(1 - compression[free[0]] / THICK_MM, SINGLE)
    rows = [equal("force", 0.0, done.force_mn[free].max(), 0.0, "mN")]
    for n in free[[30, 45, -1]]:
        since = done.times_ms[n] - 300.0
        decayed = start * np.exp(-(1 - SINGLE.shares[0]) * since / SINGLE.times_ms[0])
        expected = THICK_MM * (1 - stretch_at(decayed, SINGLE))
        rows.append(
            near(f"compression after {since:.3g} ms", 1e3 * expected, 1e3 * compression[n], 0.01, "µm")
        )
    return rows


@case(THEME, "Second touch after a pause", "Springs and dashpots in one dimension")
def second_touch() -> list[Row]:
    """The block of two Prony terms is pressed twice by 0.5 mm, 50 ms in, 100 ms held, 50 ms out: force at the
    end of the second ramp over that of the first, for pauses of several lengths. After many relaxation
    times it is 1.
    """
    rows = []
    for pause_ms in (20.0, 200.0, 5000.0):
        motion = repeated(0.5, 2, 50.0, 100.0, pause_ms)
        done = foam_block(motion, SERIES, steps=10)
        times, force, _ = one_dimension(motion, SERIES)
        second = 250.0 + pause_ms
        ratios = [
            np.interp(second, t, f) / np.interp(50.0, t, f)
            for t, f in ((times, force), (done.times_ms, done.force_mn))
        ]
        rows.append(near(f"second over first force, pause of {pause_ms:g} ms", *ratios, 1e-3))
    return rows


RADIUS_MM, DEEP_MM, TURN_MS = 50.0, 0.02, 100.0
MAXWELL = Prony(shares=(0.5,), times_ms=(100.0,))
YOUNG_KPA, POISSON = 100.0, 0.499


def ting(time_ms: float) -> tuple[float, float]:
    """Force [mN] and area [mm²] of a sphere on a half-space that relaxes, driven in and out at one speed.

    On the way in (Lee & Radok 1960) F = k int_0^t E(t - s) d(d^1.5)/ds ds, a² = R d. On the way out (Ting
    1966) the contact is that of an earlier time t1 with int_t1^t E(t - s) d'(s) ds = 0, and the integral of F
    ends at t1.
    """
    g, tau, speed = MAXWELL.shares[0], MAXWELL.times_ms[0], DEEP_MM / TURN_MS
    k = 4 / 3 * np.sqrt(RADIUS_MM) * YOUNG_KPA / (1 - POISSON**2) / MAXWELL.long_term_share

    def kept(since):
        return 1 - g * (1 - np.exp(-since / tau))

    def passed(first, last):
        """Integral of E(t - s) ds over E(0), at time_ms."""
        whole = (1 - g) * (last - first)
        return whole + g * tau * (np.exp((last - time_ms) / tau) - np.exp((first - time_ms) / tau))

    equal_ms = time_ms
    if time_ms > TURN_MS:
        back = passed(TURN_MS, time_ms)
        if passed(0.0, TURN_MS) <= back:
            return 0.0, 0.0
        equal_ms = brentq(lambda first: passed(first, TURN_MS) - back, 0.0, TURN_MS)
    rate = 1.5 * speed**1.5
    force = k * quad(lambda s: kept(time_ms - s) * rate * np.sqrt(s), 0.0, equal_ms)[0]
    return force, np.pi * RADIUS_MM * speed * equal_ms


@lru_cache(maxsize=1)
def ball_in_and_out() -> Deformation:
    """Sphere driven into a nearly incompressible block and out of it, 12 steps each."""
    edges = lines(0.125, 1.25, 100.0, 1.5)
    mesh = round_mesh(edges, edges, 6)
    tissue = (Material.linear_elastic(YOUNG_KPA, POISSON, MAXWELL),) * 4
    ball = Sphere(curvature_per_m=1000.0 / RADIUS_MM)
    placement = place(ball, mesh.nodes_mm[mesh.skin_nodes], np.zeros(3), np.eye(3))
    motion = Trajectory((0.0, TURN_MS, 2 * TURN_MS), (0.0, DEEP_MM, 0.0))
    # Round-off of the large far elements is 1e-5 of the small forces before contact is lost.
    settings = PressSettings(12, 1, NewtonSettings(residual_tolerance=1e-4))
    return press(Specimen(mesh, tissue), PlacedIndenter(ball, placement), motion, settings)


@case(THEME, "Hysteresis of a sphere", "Lee & Radok 1960, Ting 1966: viscoelastic half-space", slow=True)
def hysteresis_of_a_sphere() -> list[Row]:
    """A sphere of 50 mm is driven 20 µm into a large block that relaxes by a half (tau = 100 ms, nu = 0.499)
    and out again, 100 ms each. The reference is a closed form for an incompressible half-space. The sphere
    loses contact before it is back.
    """
    done = ball_in_and_out()
    rows = []
    for n in (6, 12, 14, 16, 18):
        time = done.times_ms[n]
        force, area = ting(time)
        way = "in" if time <= TURN_MS else "out"
        largest = ting(TURN_MS)[0]
        rows += [
            equal(f"force over the largest at {time:.0f} ms, {way}", force / largest,
                  done.force_mn[n] / largest, 0.015),
            equal(f"area at {time:.0f} ms, {way}", area, done.contact.area_mm2[n], 0.15, "mm²"),
        ]  # fmt: skip
    times = np.linspace(0.0, 2 * TURN_MS, 2001)
    depth = DEEP_MM * (1 - np.abs(times / TURN_MS - 1))
    force = np.array([ting(time)[0] for time in times])
    work = cumulative_trapezoid(force, depth)
    gone = np.flatnonzero(force > 0.0)[-1]
    found = np.flatnonzero(done.force_mn > 0.0)[-1]
    return [
        *rows,
        near("energy lost in the loop", work[-1], done.energy.external_uj[-1], 0.03, "µJ"),
        equal("contact is lost", times[gone], done.times_ms[found], 200.0 / 24, "ms"),
    ]


@case(THEME, "Energy balance through a release", "Conservation of energy")
def balance_through_release() -> list[Row]:
    """The relaxing layered block that loses a half of its stiffness under every indenter: pressed by 0.3 mm,
    held, released and left alone, 16 steps per ramp. Largest imbalance at any time, over the largest work.
    """
    motion = Trajectory((0.0, 50.0, 200.0, 250.0, 400.0), (0.0, 0.3, 0.3, 0.0, 0.0))
    rows = []
    for name, indenter in balance.INDENTERS.items():
        done = balance.pressed(balance.block(), indenter, balance.RELAXING, motion, PressSettings(16, 6))
        rows.append(at_most(f"{name}: imbalance over work", 0.005, done.energy.relative_imbalance))
    return rows
