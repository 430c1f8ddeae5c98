"""Units inside fingerpad: mm, ms, kPa, mN, mA, mF, mV.

They are consistent: 1 kPa mm² = 1 mN, 1 kPa = 1 µJ/mm³ (so strain energy density, SED, in
kPa is energy per volume), and 1 mF mV/ms = 1 mA, so no factor appears in any equation of the paper.
"""

import math

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


def with_unit(said: str, quantity: str, brackets: str = " [{}]") -> str:
    """Text about a quantity, with its unit where it has one."""
    unit = QUANTITY_UNITS.get(quantity, "")
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
