"""Small bodies: the two resolutions agree, and no energy is lost where skin slides round a rim."""

from __future__ import annotations

from fingerpad.geometry.bodies import FlatPunch, Sphere

from .case import Row, at_most, case, near
from .press_table import Press, solved

THEME = "Small bodies"
PRESSES = (
    ("sphere of 0.5 mm radius", Press(Sphere(curvature_per_m=2000.0)), 2.0),
    ("punch of 1 mm, fillet 0.1 mm", Press(FlatPunch(1.0, 0.1)), 1.0),
    ("punch of 1 mm, fillet 0.1 mm, friction 0.5", Press(FlatPunch(1.0, 0.1), friction=0.5), 1.0),
)


@case(
    THEME,
    "A small sphere and a small punch, quick against standard",
    "The press at standard resolution",
    slow=True,
)
def small_bodies() -> list[Row]:
    """Press a sphere 2 mm and a punch 1 mm deep into the finger with the default tissues. Compare the largest
    force and the largest SED of the living epidermis at the two resolutions."""
    rows: list[Row] = []
    for name, press, depth_mm in PRESSES:
        quick, standard = (solved(press, resolution, depth_mm) for resolution in ("quick", "standard"))
        rows += [
            near(f"{name}: force", standard.force_mn, quick.force_mn, relative=0.05, unit="mN"),
            near(f"{name}: largest SED", standard.sed_kpa, quick.sed_kpa, relative=0.1, unit="kPa"),
        ]
        for resolution, done in (("quick", quick), ("standard", standard)):
            rows.append(at_most(f"{name}: energy imbalance, {resolution}", 0.005, done.energy_imbalance))
    return rows
