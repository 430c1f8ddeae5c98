"""Units inside fingerpad: mm, ms, kPa, mN, mA, mF, mV.

They close among themselves: 1 kPa mm² = 1 mN and 1 kPa = 1 µJ/mm³, so strain energy density (SED)
in kPa is energy per volume. With mF, mV and ms a current comes out in mF mV/ms = mA·mV/V; the
membrane equation (paper, Eq. 5) reads I/C in mA/mF = V/s = mV/ms, so no factor is needed there.
"""

MS_PER_S = 1000.0
KPA_PER_MPA = 1000.0
MM_PER_M = 1000.0


def radius_mm(curvature_per_m: float) -> float:
    """Radius of a sphere from its curvature. [mm]

    Examples
    --------
    >>> round(radius_mm(287.0), 3)
    3.484
    """
    return MM_PER_M / curvature_per_m
