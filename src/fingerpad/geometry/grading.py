"""Sizes of the elements of a finger's mesh, fine about the contact and coarse elsewhere."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import replace
from typing import Annotated

import numpy as np
from scipy.optimize import brentq

from fingerpad.core.checked import checked, value_class
from fingerpad.core.errors import InputError
from fingerpad.core.values import Count, Finite, Flag, FloatArray, Many, Positive, choice

RESOLUTIONS = ("quick", "standard", "paper")

Strip = tuple[float, float, float]  # From, to and size of the elements between them. [mm]
STEPS_TO_SUM = 4000  # Intervals over which the number of elements is summed where their size varies.
FINGER_MM = 40.0  # Length of a finger, beyond which a fine zone has no elements. [mm]

MOST_ELEMENTS = 2_000_000
"""Elements of the fine zone beyond which no press ends; that of the paper's mesh has 143,000."""


@value_class
class Grading:
    """Fine zone of the mesh of a finger and sizes of its elements.

    Parameters
    ----------
    centre_mm : float
        x of the middle of the fine zone on the volar midline. [mm]
    half_length_mm, half_width_mm : float
        Fine zone on the skin: to either side along the finger, and across from the midline. [mm]
    size_x_mm, size_z_mm : float
        Size of the elements in the fine zone along and across. [mm]
    largest_mm : float
        Largest size of an element on the skin away from the fine zone. [mm]
    growth : float
        Largest ratio of neighbouring sizes, above 1 and at most 1.3.
    stratum_corneum, living_epidermis, dermis, subcutis : int
        Number of elements through each layer.
    full : bool
        Whether both halves of the finger are meshed, or only z >= 0.
    finer_along, finer_across : tuple of (from, to, size)
        Strips with even smaller elements, about a small body or an edge: x on the volar midline of its
        two sides or, across, z; and the largest size in it. Sizes grow from there by `growth`. [mm]
    """

    centre_mm: Finite
    half_length_mm: Positive
    half_width_mm: Positive
    size_x_mm: Positive
    size_z_mm: Positive
    largest_mm: Positive = 3.0
    growth: Finite = 1.3
    stratum_corneum: Count = 4
    living_epidermis: Count = 1
    dermis: Count = 4
    subcutis: Count = 4
    full: Flag = False
    finer_along: Many[Strip] = ()
    finer_across: Many[Strip] = ()

    def __post_init__(self) -> None:
        if not 1.0 < self.growth <= 1.3:
            raise InputError("growth", "must be above 1 and at most 1.3", repr(self.growth))
        for name in ("finer_along", "finer_across"):
            for begin, end, size in getattr(self, name):
                if not (np.isfinite([begin, end]).all() and begin < end and 0.0 < size < np.inf):
                    raise InputError(
                        name,
                        "needs strips of from, to and size in mm, to above from and size above 0",
                        repr((begin, end, size)),
                    )
        if self.elements_about > MOST_ELEMENTS:
            raise InputError(
                f"A grading may have about {MOST_ELEMENTS:,} elements in its fine zone: those of "
                f"{self.size_x_mm:g} by {self.size_z_mm:g} mm, and strips, are {self.elements_about:.3g}; "
                "take larger ones."
            )

    @property
    def elements_about(self) -> float:
        """Number of elements of the fine zone and of the strips, roughly."""
        along = min(2 * self.half_length_mm, FINGER_MM) / self.size_x_mm
        across = min((1 + self.full) * self.half_width_mm, FINGER_MM) / self.size_z_mm
        along += sum((end - begin) / size for begin, end, size in self.finer_along)
        across += sum((end - begin) / size for begin, end, size in self.finer_across)
        return max(along, 1.0) * max(across, 1.0) * sum(self.counts)

    @property
    def finest_x_mm(self) -> float:
        """Size of the smallest elements along the finger. [mm]"""
        return min([self.size_x_mm, *(size for _, _, size in self.finer_along)])

    @property
    def finest_z_mm(self) -> float:
        """Size of the smallest elements across the finger. [mm]"""
        return min([self.size_z_mm, *(size for _, _, size in self.finer_across)])

    @property
    def finest_strip_mm(self) -> float:
        """Size of the smallest elements in strips; infinite without any. [mm]"""
        return min((size for _, _, size in self.finer_along + self.finer_across), default=np.inf)

    def no_finer_than(self, size_mm: float) -> Grading:
        """Return the grading with elements of at least this size in its strips."""

        def coarse(strips: tuple[Strip, ...], largest_mm: float) -> tuple[Strip, ...]:
            larger = ((begin, end, max(size, size_mm)) for begin, end, size in strips)
            return tuple(strip for strip in larger if strip[2] < largest_mm)

        return replace(
            self,
            finer_along=coarse(self.finer_along, self.size_x_mm),
            finer_across=coarse(self.finer_across, self.size_z_mm),
        )

    @property
    def counts(self) -> tuple[int, int, int, int]:
        """Number of elements through each of `LAYERS`."""
        return self.stratum_corneum, self.living_epidermis, self.dermis, self.subcutis


@checked
def resolution_grading(
    resolution: Annotated[str, choice(RESOLUTIONS)],
    centre_mm: Finite,
    half_length_mm: Finite = 5.0,
    half_width_mm: Finite = 1.0,
    finger_size: Positive = 1.0,
) -> Grading:
    k = min(finger_size, 1.0)
    zone = Grading(centre_mm, half_length_mm, half_width_mm, 0.25 * k, 0.25 * k, largest_mm=3.0 * k)
    if resolution == "quick":
        return replace(zone, size_x_mm=0.45 * k, size_z_mm=0.45 * k, stratum_corneum=2, dermis=3, subcutis=3)
    if resolution == "standard":
        return zone
    length, width = max(half_length_mm, 6.0 * k), max(half_width_mm, 5.0 * k)
    pad = replace(zone, half_length_mm=length, half_width_mm=width)
    return replace(pad, size_x_mm=0.1 * k, size_z_mm=0.1 * k, full=True)


def covering(gradings: Sequence[Grading]) -> Grading:
    """One grading that is at least as fine everywhere as each of several.

    Stimuli that are compared should be pressed into one mesh, so that the error of the mesh is the same.
    """
    if not gradings:
        raise InputError("covering", "needs at least one grading", "none")
    first = gradings[0].centre_mm
    proximal = min(grading.centre_mm - grading.half_length_mm - first for grading in gradings)
    distal = max(grading.centre_mm + grading.half_length_mm - first for grading in gradings)
    same_centre = all(grading.centre_mm == first for grading in gradings)  # avoids rounding
    centre = first if same_centre else first + 0.5 * (proximal + distal)

    return Grading(
        centre_mm=centre,
        half_length_mm=max(abs(each.centre_mm - centre) + each.half_length_mm for each in gradings),
        half_width_mm=max(grading.half_width_mm for grading in gradings),
        size_x_mm=min(grading.size_x_mm for grading in gradings),
        size_z_mm=min(grading.size_z_mm for grading in gradings),
        largest_mm=min(grading.largest_mm for grading in gradings),
        growth=min(grading.growth for grading in gradings),
        stratum_corneum=max(grading.stratum_corneum for grading in gradings),
        living_epidermis=max(grading.living_epidermis for grading in gradings),
        dermis=max(grading.dermis for grading in gradings),
        subcutis=max(grading.subcutis for grading in gradings),
        full=any(grading.full for grading in gradings),
        finer_along=_joined(grading.finer_along for grading in gradings),
        finer_across=_joined(grading.finer_across for grading in gradings),
    )


def _joined(strips: Iterable[tuple[Strip, ...]]) -> tuple[Strip, ...]:
    return tuple(dict.fromkeys(strip for each in strips for strip in each))


def lines_from_middle(
    grading: Grading, half_mm: float, size_mm: float, length_mm: float, strips: Sequence[Strip]
) -> FloatArray:
    """Lines from the middle of the fine zone to an end of the finger or, around, to its dorsal side. [mm]"""
    zone = half_mm, size_mm, length_mm, grading.growth, grading.largest_mm
    return lines_of_sizes(*zone, strips) if strips else graded_lines(*zone)


def lines_of_sizes(
    fine: float, size: float, length: float, growth: float, largest: float, strips: Sequence[Strip]
) -> FloatArray:
    """Lines from 0 to `length` as those of `graded_lines`, but closer together in strips.

    The size h of the elements is a function of place: the least of that of the fine zone, of those of the
    strips, and of what growth from there allows. The number of elements is the integral of 1/h, rounded up to
    an even number.
    """
    places = np.linspace(0.0, length, STEPS_TO_SUM + 1)
    slope = np.log(growth)
    sizes = np.minimum(size + slope * np.maximum(places - fine, 0.0), largest)
    for begin, end, smaller in strips:
        beside = np.maximum(np.maximum(begin - places, places - end), 0.0)
        sizes = np.minimum(sizes, smaller + slope * beside)
    density = 1.0 / sizes
    number = np.concatenate([[0.0], np.cumsum(0.5 * (density[1:] + density[:-1]) * np.diff(places))])
    n_steps = 2 * int(np.ceil(0.5 * number[-1]))
    lines = np.interp(np.linspace(0.0, number[-1], n_steps + 1), number, places)
    lines[-1] = length
    return lines


def graded_lines(fine: float, size: float, length: float, growth: float, largest: float) -> FloatArray:
    """Lines from 0 to `length`: equal steps over the fine zone, then growing ones, an even number in all."""
    n_fine = int(np.ceil(min(fine, length) / size - 1e-9))
    rest = length - n_fine * size
    if rest < size:
        n_even = 2 * int(np.ceil(0.5 * length / size))
        return np.linspace(0.0, length, n_even + 1)

    def outer(ratio: float, count: int) -> FloatArray:
        return np.minimum(size * ratio ** np.arange(1, count + 1), largest)

    count = 1
    while outer(growth, count).sum() < rest or (n_fine + count) % 2:
        count += 1
    ratio = brentq(lambda ratio: outer(ratio, count).sum() - rest, 1e-3, growth, xtol=1e-15)
    steps = np.concatenate([np.full(n_fine, size), outer(ratio, count)])
    lines = np.concatenate([[0.0], np.cumsum(steps)])
    lines[-1] = length
    return lines
