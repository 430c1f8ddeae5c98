"""Where a solved indentation lies outside of what was verified: caveats that its figures and pages show.

A caveat changes no number. To add one, write a function from a `SkinResponse` to a `Caveat` or None, and list
it in `CHECKS`.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import TYPE_CHECKING

import numpy as np

from fingerpad.core.checked import result_class
from fingerpad.core.values import Number
from fingerpad.mechanics.inertia import LARGEST_SHARE, inertial_share
from fingerpad.mechanics.materials import STABLE_STRETCHES

if TYPE_CHECKING:
    from fingerpad.skin.sampling import SkinResponse

EPIDERMIS = 1  # Number of the layer in which receptors are sampled.

LARGEST_SED_RATIO = 6.5
"""Largest SED over the shear modulus of the living epidermis that docs/presses.md compares between meshes:
58.5 kPa at 9 kPa, under a sphere of 0.25 mm."""

LARGEST_IMBALANCE = 5e-3
"""Largest share of the indenter's work that is neither stored nor dissipated nor held by the contact, in the
presses whose meshes docs/presses.md compares. Skin that snaps round an edge within one step loses more."""


@result_class
class Caveat:
    """One quantity of a result that lies outside of what was verified."""

    name: str  #: The quantity, such as "strain".
    value: Number
    limit: Number  #: What it is, and up to where results were verified.
    text: str  #: A sentence with both.


def _beyond(name: str, value: float, limit: float, text: str) -> Caveat | None:
    return Caveat(name=name, value=value, limit=limit, text=text) if value > limit else None


def strain(skin: SkinResponse) -> Caveat | None:
    """Compression of the living epidermis beyond the stretches at which the stability of laws is checked."""
    if "compressive_strain" not in skin.fields:
        return None
    sheet = skin.fields["compressive_strain"][:, : skin.mesh.living_epidermis.size]
    largest, limit = float(sheet.max()), -float(np.log(STABLE_STRETCHES[0]))
    text = (
        f"The living epidermis is compressed to a stretch of {np.exp(-largest):.2g}; that its law is stable "
        f"was checked down to {STABLE_STRETCHES[0]:g}."
    )
    return _beyond("strain", largest, limit, text)


def energy_density(skin: SkinResponse) -> Caveat | None:
    """Energy density above what was compared between meshes."""
    if skin.touch is None:
        return None
    shear_kpa = skin.touch.tissues.layers[EPIDERMIS].shear_modulus_kpa
    largest = float(skin.sed_kpa[:, skin.mesh.living_epidermis.ravel()].max())
    limit = LARGEST_SED_RATIO * shear_kpa
    text = (
        f"The strain energy density reaches {largest:.3g} kPa; meshes were compared up to {limit:.3g} kPa "
        "with these tissues."
    )
    return _beyond("energy density", largest, limit, text)


def frequency(skin: SkinResponse) -> Caveat | None:
    """Motion so fast that the inertia of the tissue, which is neglected, matters."""
    if skin.touch is None:
        return None
    touch = skin.touch
    share, fastest_hz, _ = inertial_share(touch.stimulus, touch.tissues.layers, touch.layers_mm)
    text = (
        f"The motion is as fast as a vibration of {fastest_hz:.3g} Hz, at which the neglected inertia of the "
        f"tissue is about {share:.2g} times its elastic force; up to {LARGEST_SHARE:g} it was compared."
    )
    return _beyond("inertia", share, LARGEST_SHARE, text)


def features(skin: SkinResponse) -> Caveat | None:
    """Edges of the body that are sharper than the elements, in whose size they were pressed."""
    if skin.touch is None or skin.touch.body == skin.touch.indenter:
        return None
    size_mm, body = skin.touch.grading.finest_strip_mm, type(skin.touch.indenter).__name__
    text = f"Edges of the {body} are sharper than the elements, so they were pressed with {size_mm:.3g} mm."
    return Caveat(name="edge radius", value=0.0, limit=size_mm, text=text)


def energy_balance(skin: SkinResponse) -> Caveat | None:
    """Work that is missing from the balance of energies: the skin snapped, or the steps were too long."""
    share = skin.energy_imbalance
    text = (
        f"{share:.2g} of the indenter's work is neither stored nor dissipated, above {LARGEST_IMBALANCE:g}: "
        "the skin snapped from one state to another, or the steps are too long; press at a finer "
        "resolution, or with more steps (PressSettings in Python)."
    )
    return _beyond("energy balance", share, LARGEST_IMBALANCE, text)


CHECKS: tuple[Callable[[SkinResponse], Caveat | None], ...] = (
    strain,
    energy_density,
    frequency,
    features,
    energy_balance,
)
"""What is asked of each result, in the order in which caveats are shown."""


def caveats_of(skin: SkinResponse) -> tuple[Caveat, ...]:
    """Find what lies outside of what was verified; empty if nothing does."""
    return tuple(found for found in (check(skin) for check in CHECKS) if found is not None)


def worst(caveats: Iterable[Caveat]) -> tuple[Caveat, ...]:
    """Of several results, the caveat of each quantity that lies farthest outside, by its name."""
    ordered = sorted(caveats, key=lambda each: (each.name, abs(each.value - each.limit)))
    return tuple({each.name: each for each in ordered}.values())
