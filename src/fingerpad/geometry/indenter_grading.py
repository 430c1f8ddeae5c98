"""Grading for an indenter: fine about the contact, its edges and its grooves, depending on its rotation."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from fingerpad.core.errors import InputError
from fingerpad.core.units import cosine_and_sine
from fingerpad.geometry.fingertip import Finger, Fingertip
from fingerpad.geometry.grading import Grading, Strip, covering, resolution_grading
from fingerpad.geometry.indenters import Indenter
from fingerpad.geometry.motion import Pose

THIN_SIZE_MM = 0.025  # Size along the finger of elements below a wire: two across the strip in contact. [mm]

EDGE_SIZE_MM = {"quick": 0.2, "standard": 0.1, "paper": 0.1}
"""Size of elements across edges that are parallel to grid lines, as those of the paper's bar. [mm]"""

RIDGE_SIZE_MM = EDGE_SIZE_MM | {"quick": 0.15}
"""The same below a grating with blunt lips: with 0.2 mm SED was up to 18 % larger than at standard."""

OBLIQUE_SIZE_MM = {"quick": 0.3, "standard": 0.2, "paper": 0.1}
"""Size of elements under edges that cross grid lines at an angle. [mm]"""

ACROSS_GROOVE, FEWEST_ACROSS_GROOVE = 4, 2
"""Number of elements across the narrowest groove or ridge: in a mesh graded for it, and the least in any."""

MOST_RELIEF_ELEMENTS = {"quick": 25_000, "standard": 100_000, "paper": 500_000}
"""Most elements of the fine zone below a relief: the whole mesh has about 60,000 nodes at quick then."""

WIDER_ZONE = 1.7
"""How much longer the fine zone below a wide body may be: it reaches to where that first touches the pad."""

TIP_SHARE, LARGEST_TIP_MM = 1 / 4, 0.3
"""Size of elements under a round tip over its radius, and the size from which those of the fine zone will do:
they are at most 1.5 times as large. [mm]"""

BEYOND_TIP = 1.1
"""End of the small elements about a round tip or face, over its radius: skin is drawn in below it."""

SHARPEST_MM, BESIDE_SHARP_MM = 0.05, 0.15
"""Radius below which an edge is meshed as if it had this radius, and half-width of the strip of elements of
the size of the edge's radius. [mm]"""

RIM_SIZE_MM = {"quick": 0.2, "standard": 0.15, "paper": 0.1}
"""Largest size of elements at the rim of a punch. [mm]"""

MOST_ACROSS_FACE = {"quick": 40, "standard": 50, "paper": 100}
"""Elements of the size at the rim across the face of a punch: a rim finer than this is not resolved."""

RIM_STRIPS = ((0.7, 1.0), (0.4, 1.6), (0.0, 3.0))
"""Where strips about a rim begin, over its radius, and the size there over that at the rim. At an angle a to
the x axis the rim runs across lines of x that are 1 / cos a times as far apart."""

FEWEST_BELOW_RIM, NEEDLE_MM, BENT_MM = 4, 0.5, 0.1
"""Number of elements through the stratum corneum below a rim or an edge at least, where it bends sharply, the
radius below which a punch keeps the number of the resolution, and the largest radius of such an edge. [mm]"""

LEAST_ACROSS_RADIUS = 5
"""Least number of elements across the radius of a face, if those at the rim are no larger."""

LONGEST_REACH_MM, LONGEST_SLIDING_REACH_MM = 5.0, 10.0
"""Largest half-extents of a fine zone, of an indenter that stays and along one that moves aside: skin farther
away curves away. Far from its middle a wide body presses lightly, which a coarse mesh bears; but ridges that
slide over elements of their own size find no equilibrium, and those that touch the skin first are missed
(`first_touch_x_mm`). [mm]"""

OUTLINE_STEP_MM, STRAIGHT_MM = 0.1, 1.0
"""Distance of the places at which the outline of the pad is compared. Largest distance of first touch from
the axis of an indenter that presses straight. [mm]"""


def grading_about(
    indenter: Indenter,
    resolution: str,
    x_mm: float,
    z_mm: float = 0.0,
    spin_deg: float = 0.0,
    finger_size: float = 1.0,
    moves: bool = False,
) -> Grading:
    """Grading that is fine under an indenter at (x, z) and 1 mm beyond, and finer about its edges."""
    reach = indenter.half_width_mm + 1.0
    if not indenter.mirrors(spin_deg):  # extent of a turned square along and across
        reach *= sum(map(abs, cosine_and_sine(spin_deg)))
    longest = LONGEST_SLIDING_REACH_MM if moves else LONGEST_REACH_MM
    far, reach = (min(reach, most_mm * min(finger_size, 1.0)) for most_mm in (longest, LONGEST_REACH_MM))
    grading = resolution_grading(resolution, x_mm, far, abs(z_mm) + reach, finger_size)
    if z_mm != 0.0 or not indenter.mirrors(spin_deg):
        grading = replace(grading, full=True)
    if np.isfinite(indenter.relief_mm):
        return _about_relief(grading, resolution, indenter)
    if indenter.rim_mm is not None:
        return _about_rim(grading, resolution, *indenter.rim_mm, z_mm)
    size = max(TIP_SHARE * indenter.tip_radius_mm, THIN_SIZE_MM)
    if size > LARGEST_TIP_MM:
        size = np.inf
    if indenter.symmetry_deg is None:
        reach = BEYOND_TIP * indenter.tip_radius_mm
        return _with_strips(grading, [(-reach, reach, size)], True, True, z_mm)
    thin, edges = indenter.half_width_mm < grading.size_x_mm, indenter.edges_mm(reach)
    if thin and spin_deg % 180.0 != 0.0:
        raise InputError(
            "spin_deg",
            f"must be 0 for {type(indenter).__name__}, because it is thinner than "
            f"{2 * grading.size_x_mm:g} mm, two elements of {resolution}",
            f"{spin_deg:g} degrees",
            "give a grading that is fine enough",
        )
    along, across = spin_deg % 180.0 == 0.0, spin_deg % 180.0 == 90.0
    if thin and not np.isfinite(size) and not edges:
        # A wire needs a few elements of its own size below it, from which the sizes grow.
        few_mm = 4 * THIN_SIZE_MM
        if resolution == "paper":  # its fine zone is the whole pad
            return replace(grading, core_half_length_mm=few_mm, core_size_mm=THIN_SIZE_MM)
        return replace(grading, half_length_mm=few_mm, size_x_mm=THIN_SIZE_MM)
    if np.isfinite(size):
        if not (along or across):
            return _finer_across_edges(grading, size, 0.0, spin_deg)
        reach = BEYOND_TIP * indenter.tip_radius_mm
        return _with_strips(grading, [(-reach, reach, size)], along, across, z_mm)
    if indenter.edge_reach_mm > 0.0:
        blunt_ridges = indenter.edge_reach_mm > LONGEST_REACH_MM and indenter.sharpest_mm > BENT_MM
        parallel = RIDGE_SIZE_MM if blunt_ridges else EDGE_SIZE_MM
        largest = parallel if along or across else OBLIQUE_SIZE_MM
        size = min(largest[resolution], indenter.narrowest_mm / ACROSS_GROOVE)
        grading = _finer_across_edges(grading, size, indenter.edge_reach_mm, spin_deg)
    sharp = [
        (place - BESIDE_SHARP_MM, place + BESIDE_SHARP_MM, max(radius, SHARPEST_MM))
        for place, radius in edges
        if abs(place) <= reach
    ]
    few = len(sharp) <= 2  # with the many lips of a grating the mesh would be too large
    if few and any(size <= BENT_MM for _, _, size in sharp):
        grading = _fine_where_bent(grading)
    return _with_strips(grading, sharp, along, across, z_mm)


def _about_relief(grading: Grading, resolution: str, indenter: Indenter) -> Grading:
    """Grading that resolves the narrowest part of a relief, with fewer elements across it where it must."""
    elements = MOST_RELIEF_ELEMENTS[resolution] + 1.0
    for count in range(ACROSS_GROOVE, FEWEST_ACROSS_GROOVE - 1, -1):
        size = min(OBLIQUE_SIZE_MM[resolution], indenter.relief_mm / count)
        along, across = min(size, grading.size_x_mm), min(size, grading.size_z_mm)
        elements = grading.elements_about * (grading.size_x_mm / along) * (grading.size_z_mm / across)
        if indenter.half_width_mm + 1.0 > LONGEST_REACH_MM:
            elements *= WIDER_ZONE
        if elements <= MOST_RELIEF_ELEMENTS[resolution]:
            return replace(grading, size_x_mm=along, size_z_mm=across)
    raise InputError(
        f"{type(indenter).__name__} has a ridge, groove or dot {indenter.relief_mm:.3g} mm wide, and must be "
        f"pressed with at most {MOST_RELIEF_ELEMENTS[resolution]:,} elements below it at {resolution}: to "
        f"resolve that takes {elements:,.0f}; smooth or enlarge the body, cut off what does not touch the "
        "skin, or give a grading."
    )


def _about_rim(grading: Grading, resolution: str, radius_mm: float, rim_mm: float, z_mm: float) -> Grading:
    """Grading about a round rim: fine where it runs at a right angle to the lines, coarser under the face."""
    coarsest = 2 * radius_mm / MOST_ACROSS_FACE[resolution]
    size = min(RIM_SIZE_MM[resolution], max(rim_mm, SHARPEST_MM, coarsest))
    strips: list[Strip] = []
    for inner, times in RIM_STRIPS:
        begin, end = inner * radius_mm, BEYOND_TIP * radius_mm
        largest = min(times * size, max(size, radius_mm / LEAST_ACROSS_RADIUS))
        strips += [(begin, end, largest), (-end, -begin, largest)]
    if radius_mm >= NEEDLE_MM:
        grading = _fine_where_bent(grading)
    return _with_strips(grading, strips, True, True, z_mm)


def _fine_where_bent(grading: Grading) -> Grading:
    """Divide the stratum corneum into `FEWEST_BELOW_RIM` elements at least."""
    return replace(grading, stratum_corneum=max(FEWEST_BELOW_RIM, grading.stratum_corneum))


def _with_strips(
    grading: Grading, strips: Sequence[Strip], along: bool, across: bool, z_mm: float
) -> Grading:
    """Add strips, given about the indenter's axis, that are finer than the grading is there."""
    x = [(begin + grading.centre_mm, end + grading.centre_mm, size) for begin, end, size in strips]
    z = [(begin + z_mm, end + z_mm, size) for begin, end, size in strips]
    finest_x = grading.core_size_mm or grading.size_x_mm
    return replace(
        grading,
        finer_along=tuple(strip for strip in x if along and strip[2] < finest_x),
        finer_across=tuple(strip for strip in z if across and strip[2] < grading.size_z_mm),
    )


def grading_along(
    finger: Finger,
    indenter: Indenter,
    resolution: str,
    at_mm: tuple[float, float],
    poses: Sequence[Pose],
    tilt_deg: float = 0.0,
    spin_deg: float = 0.0,
) -> Grading:
    """Grading that is fine under an indenter wherever it goes, and where its ridges or dots first touch."""
    (x_mm, z_mm), size = at_mm, finger.relative_size
    places = {(pose.x_mm, pose.z_mm, pose.spin_deg) for pose in poses}
    outermost = sorted(places, key=lambda place: (place[2], place[0], place[1]))
    gradings = [
        grading_about(indenter, resolution, x_mm + x, z_mm + z, spin_deg + spin, size, moves=len(places) > 1)
        for x, z, spin in outermost
    ]
    joint = covering(gradings)
    if any(spin for _, _, spin in outermost):  # skin that is twisted has no mirror image
        joint = replace(joint, full=True)
    if joint.finer_along or joint.finer_across:
        joint = replace(
            joint,
            finer_along=_swept([grading.finer_along for grading in gradings]),
            finer_across=_swept([grading.finer_across for grading in gradings]),
        )
    longest = LONGEST_REACH_MM * min(size, 1.0)
    is_wide = np.isfinite(indenter.narrowest_mm) and indenter.half_width_mm + 1.0 > longest
    if not (is_wide and isinstance(finger, Fingertip)):  # the mesh of any other finger is its own
        return joint
    first = first_touch_x_mm(finger, x_mm, indenter.half_width_mm, tilt_deg)
    if abs(first - x_mm) <= STRAIGHT_MM:
        return joint
    return covering([joint, replace(joint, centre_mm=first, half_length_mm=longest)])


def first_touch_x_mm(finger: Fingertip, x_mm: float, half_width_mm: float, tilt_deg: float) -> float:
    """Where a flat face that presses on a finger first touches its midline, x. [mm]"""
    begin, end = max(x_mm - half_width_mm, 0.0), min(x_mm + half_width_mm, finger.length_mm)
    x = np.linspace(begin, end, int(np.ceil((end - begin) / OUTLINE_STEP_MM)) + 1)
    cosine, sine = cosine_and_sine(tilt_deg)
    skin = finger.skin_point(x, 0.0)
    return float(x[(cosine * skin[:, 1] - sine * skin[:, 0]).argmin()])


def _swept(strips: Sequence[tuple[Strip, ...]]) -> tuple[Strip, ...]:
    """Return strips that cover each strip of a body on its way between places."""
    together = zip(*strips, strict=True)
    ends = [tuple(zip(*same, strict=True)) for same in together]
    return tuple((min(begins), max(ends), min(sizes)) for begins, ends, sizes in ends)


def _finer_across_edges(grading: Grading, size_mm: float, reach_mm: float, spin_deg: float) -> Grading:
    """Make elements across edges within reach of the axis smaller; a core exists only along the finger."""
    along, across = min(size_mm, grading.size_x_mm), min(size_mm, grading.size_z_mm)
    if spin_deg % 90.0 != 0.0:
        return replace(grading, size_x_mm=along, size_z_mm=across)
    if spin_deg % 180.0 != 0.0:
        return replace(grading, size_z_mm=across)
    if along < grading.size_x_mm and reach_mm < grading.half_length_mm:
        return replace(grading, core_half_length_mm=reach_mm, core_size_mm=along)
    return replace(grading, size_x_mm=along)


def sizes_across(grading: Grading, spin_deg: float) -> tuple[float, ...]:
    """Sizes of elements along x of an indenter turned by `spin_deg`, the finest of each direction. [mm]"""
    size_x, size_z = grading.finest_x_mm, grading.finest_z_mm
    if spin_deg % 180.0 == 0.0:
        return (size_x,)
    return (size_z,) if spin_deg % 90.0 == 0.0 else (size_x, size_z)
