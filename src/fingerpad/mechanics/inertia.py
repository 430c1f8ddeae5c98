"""Inertia of the tissue, which a press neglects: when that is right, and the mass that an indenter moves.

A column of tissue between indenter and bone, free at its sides, carries compression at the speed
sqrt(E / rho) and has its first resonance when it is a quarter of a wavelength long,

    f_0 = 1 / (4 t),    t = sum over layers of h / sqrt(E / rho),

with thickness h, density rho and E, Young's modulus at once. Below it the force that accelerates the tissue
is to the force that deforms it as (f / f_0)². This share is compared with that of real presses, m w² / k with
the moved mass m and stiffness k, in docs/decisions/inertia.md.

Another motion counts as the sine that has its way D from reversal to reversal and its largest speed v,
f = v / (pi D). Its amplitude is D / 2: of the whole elastic force at the largest depth d of this way, inertia
takes about (f / f_0)² D / (2 d).
"""

from __future__ import annotations

import warnings
from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike

from fingerpad.core.errors import InertiaWarning, level_of_caller
from fingerpad.core.units import MS_PER_S
from fingerpad.core.values import FloatArray, float_array
from fingerpad.data.tissues import DENSITY
from fingerpad.geometry.motion import Motion
from fingerpad.mechanics.materials import Material

LARGEST_SHARE = 0.1
"""Force that accelerates the tissue over the elastic force, above which a touch warns or has a caveat."""

LEAST_WAY = 1e-3  # Way over the largest depth or force of a motion below which it counts as noise.


def resonance_hz(materials: Sequence[Material], thickness_mm: ArrayLike) -> float:
    """First resonance of a column of tissue on bone. [Hz]"""
    young_kpa = np.array([_young_at_once_kpa(material) for material in materials])
    speed_m_per_s = np.sqrt(1e3 * young_kpa / DENSITY.value)
    return float(MS_PER_S / (4.0 * (float_array("thickness_mm", thickness_mm, 1) / speed_m_per_s).sum()))


def _young_at_once_kpa(material: Material) -> float:
    """Young's modulus before any relaxation. [kPa]"""
    shear = material.shear_modulus_kpa
    if material.moduli == "long_term":
        shear /= material.prony.long_term_share
    return 9.0 * material.bulk_modulus_kpa * shear / (3.0 * material.bulk_modulus_kpa + shear)


def fastest_hz(motion: Motion) -> float:
    return float(_strokes(motion)[0].max(initial=0.0))


def _strokes(motion: Motion) -> tuple[FloatArray, FloatArray]:
    """Frequency of each part from reversal to reversal [Hz], and half of its way over the deepest there."""
    # Air has no inertia: what comes before first touch, and above the skin, does not count.
    times_ms = np.union1d(motion.samples_ms, motion.onset_ms)
    prescribed = np.maximum(motion.prescribed_at(times_ms), 0.0)
    steps, lengths_ms = np.diff(prescribed), np.diff(times_ms)
    run = np.cumsum(np.diff(np.sign(steps), prepend=np.sign(steps[:1])) != 0.0)
    way, fastest, deepest = np.zeros((3, run[-1] + 1))
    np.add.at(way, run, np.abs(steps))
    np.maximum.at(fastest, run, np.abs(steps) / lengths_ms)
    np.maximum.at(deepest, run, np.maximum(prescribed[1:], prescribed[:-1]))
    counts = way > LEAST_WAY * max(motion.largest, 0.0)  # a tilted body may touch above the depth of 0
    amplitude = 0.5 * way
    # A vibration that begins or ends in its middle has half of its way there: the next part tells the whole.
    way = np.maximum(way, np.maximum(np.append(way[1:], 0.0), np.append(0.0, way[:-1])))
    frequency_hz = MS_PER_S * fastest[counts] / (np.pi * way[counts])
    return frequency_hz, amplitude[counts] / deepest[counts]


def inertial_share(
    motion: Motion, materials: Sequence[Material], thickness_mm: ArrayLike
) -> tuple[float, float, float]:
    """Force that accelerates the tissue over what the motion adds to its elastic force; also f and f_0."""
    resonance, fastest = resonance_hz(materials, thickness_mm), fastest_hz(motion)
    return (fastest / resonance) ** 2, fastest, resonance


def share_of_force(motion: Motion, materials: Sequence[Material], thickness_mm: ArrayLike) -> float:
    """Force that accelerates the tissue over the whole elastic force of the press at that time. [1]"""
    frequency_hz, amplitude = _strokes(motion)
    resonance = resonance_hz(materials, thickness_mm)
    return float(((frequency_hz / resonance) ** 2 * amplitude).max(initial=0.0))


def warn_of_inertia(motion: Motion, materials: Sequence[Material], thickness_mm: ArrayLike) -> None:
    """Warn if a motion is so fast that the inertia of the tissue changes the force of the press."""
    share, fastest = share_of_force(motion, materials, thickness_mm), fastest_hz(motion)
    if share > LARGEST_SHARE:
        warnings.warn(
            f"The fastest part of the motion is as fast as a vibration of {fastest:.3g} Hz, at which the "
            "inertia of the tissue, which is neglected, takes a force of about "
            f"{share:.2g} times the elastic force: stay below {np.sqrt(LARGEST_SHARE / share) * fastest:.2g} "
            "Hz or vibrate less, or read the results as those of tissue without mass.",
            InertiaWarning,
            stacklevel=level_of_caller(),
        )
