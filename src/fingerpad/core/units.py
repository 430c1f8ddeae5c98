"""Units inside fingerpad: mm, ms, kPa, mN, mA, mF, mV, and the one table of the unit of each name.

They are consistent: 1 kPa mm² = 1 mN, 1 kPa = 1 µJ/mm³ (so strain energy density, SED, in
kPa is energy per volume), and 1 mF mV/ms = 1 mA, so no factor appears in any equation of the paper.
"""

import math
from collections.abc import Iterable

MS_PER_S = 1000.0
MM_PER_M = 1000.0
MN_PER_N = 1000.0

SKIN_QUANTITY_UNITS = {
    "stored": "kPa",
    "instantaneous": "kPa",
    "work": "kPa",
    "von_mises": "kPa",
    "compressive_stress": "kPa",
    "compressive_strain": "",
    "skin_displacement": "mm",
    "deep_displacement": "mm",
    "skin_stretch": "",
}
"""Unit of each quantity that an afferent can follow, by its name; empty for a strain."""

QUANTITY_UNITS = {**SKIN_QUANTITY_UNITS, "current": "mA", "relative_current": ""}
"""Unit of each quantity of `Traces`, by its name; empty for a pure number."""


UNITS = {
    "_per_cm2": "1/cm²",
    "_mm_per_s": "mm/s",
    "_mm_s": "mm/s",
    "_per_kpa_ms": "1/(kPa ms)",
    "_per_kpa": "1/kPa",
    "_per_ma": "1/mA",
    "_per_ms": "1/ms",
    "_per_mm": "1/mm",
    "_per_m": "1/m",
    "_mm": "mm",
    "_mm2": "mm²",
    "_mm3": "mm³",
    "_ms": "ms",
    "_s": "s",
    "_n": "N",
    "_mn": "mN",
    "_kpa": "kPa",
    "_deg": "degrees",
    "_hz": "spikes/s",
    "_ma": "mA",
    "_mv": "mV",
    "_mf": "mF",
    "_uj": "µJ",
    "_mb": "MB",
}
"""Unit by the end of a name, such as that of a field or of a column; longer ends first."""

FREQUENCIES = ("frequency_hz", "frequencies_hz", "corner_hz")  # Ends of names in Hz that are no firing rates.
LENGTHS_MM = {"mm": 1.0, "um": 1e-3, "cm": 10.0, "m": 1000.0, "inch": 25.4}  # Units of length of a file. [mm]


def name_and_unit(key: str) -> tuple[str, str]:
    """Split a key into what it names and the unit that it ends with, which is empty where there is none."""
    end = next((end for end in UNITS if key.endswith(end)), "")
    return key.removesuffix(end), "Hz" if key.endswith(FREQUENCIES) else UNITS.get(end, "")


def unit_of(key: str) -> str:
    """Return the unit that a name ends with; empty where there is none."""
    return name_and_unit(key)[1]


def units_of(keys: Iterable[str]) -> dict[str, str]:
    """Return the unit of each name, "1" of a pure number."""
    return {key: unit_of(key) or "1" for key in keys}


def gain_unit(gain: str, quantity: str) -> str:
    """Return the unit of a gain of an afferent, "dynamic_gain" or "static_gain", on a quantity."""
    current, unit = {"dynamic_gain": "mA ms", "static_gain": "mA"}[gain], QUANTITY_UNITS[quantity]
    return f"{current}/{unit}" if unit else current


def with_unit(said: str, quantity: str, brackets: str = " [{}]") -> str:
    """Text about a quantity, with its unit where it has one."""
    unit = QUANTITY_UNITS[quantity]
    return said + brackets.format(unit) if unit else said


def radius_mm(curvature_per_m: float) -> float:
    """Radius of a sphere from its curvature. [mm]"""
    return MM_PER_M / curvature_per_m


def curvature_per_m(radius_mm: float) -> float:
    """Curvature of a sphere from its radius. [1/m]"""
    return MM_PER_M / radius_mm


def cosine_and_sine(angle_deg: float) -> tuple[float, float]:
    """Cosine and sine of an angle in degrees, without rounding at quarter turns."""
    if angle_deg % 90.0 == 0.0:
        return ((1.0, 0.0), (0.0, 1.0), (-1.0, 0.0), (0.0, -1.0))[int(angle_deg // 90.0) % 4]
    angle = math.radians(angle_deg)
    return math.cos(angle), math.sin(angle)
