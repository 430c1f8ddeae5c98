"""Sizes of elements below a body: a share of the radius of the body wherever that can touch the skin.

Nothing but `gap` and `may_touch` of a body is asked. Its face is looked at on a square grid; the size of the
elements there is h = clip(share * radius, smallest, largest), and it grows from there by the growth of the
mesh.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np
from scipy.ndimage import find_objects, label, minimum_filter1d

from fingerpad.core.errors import InputError
from fingerpad.core.units import cosine_and_sine
from fingerpad.core.values import FloatArray
from fingerpad.geometry.courses import divided_ms
from fingerpad.geometry.fingertip import Finger, Fingertip
from fingerpad.geometry.grading import Grading, Strip, resolution_grading
from fingerpad.geometry.indenters import Indenter
from fingerpad.geometry.motion import STILL, Motion, Pose
from fingerpad.geometry.probing import traced_front

SHARES = {"quick": 0.6, "standard": 0.4, "paper": 0.25}
"""Size of elements over the radius of a body; the largest are those of `resolution_grading`."""

SMALLEST_MM, FEWEST_ACROSS = 0.05, 2
"""Smallest size of elements below an edge [mm], and their number across a part narrower than two of them."""

FEWEST_BELOW = 3  # Least number of elements across a body that is narrow along the finger and across.
ROUND_SHARE, ACROSS_PART = 1 / 4, 8
"""Size of elements below a ball over its radius, and number across a narrow part of another round body."""

WORTH = 2 / 3  # Sizes that are worth a strip, over the largest below a body.
ALIKE = 1.1  # By how much sizes may differ from those of the field.
MOST_ELEMENTS = {"quick": 16_000, "standard": 50_000, "paper": 500_000}
COARSEST = 6.0
"""Most elements below a body, and how much larger than wanted they may be if the wanted ones are too many."""

THICKEST, MOST_THROUGH = 2.0, 4
"""Largest thickness of elements of the stratum corneum over their width, and the number that is enough."""

PRESSED = 0.5  # The zone of the largest elements is the undeformed skin that this share of the depth reaches.
PRESSURE_KPA = 4.0
"""Least mean pressure over the section of a body with the undeformed skin: how deep a force may press it."""

REACH_MM, COARSE_MM, STEP_MM = (20.0, 10.0), 0.25, 0.05
"""Half-extents of a body that is looked at, along and across, and distance of the points there: of all, and
of those that may touch. [mm]"""

LOWEST_MM, MOST_STEPS = -6.0, 40
"""Lowest places of a face that can touch, as deep as the bone [mm], and steps in which they are found."""

FLAT_PER_MM = 1e-4  # Least curvature. [1/mm]
MOST_PLACES, NEAR_MM, NEAR_DEG = 60, 0.5, 15.0
"""Most places of a moving body that are looked at, and how near to each other. [mm, degrees]"""

NEAR_AXIS_MM, BELOW_TOP_MM, NARROW = 5.0, 0.3, 0.1
"""Half-extent over which edges and parts of a body are looked for, where parts are told apart [mm], and share
of the places of grooves that are narrower than their width."""


@dataclass(frozen=True)
class Face:
    """The side of a body that meets the skin, on a grid of places along and across the finger."""

    x_mm: FloatArray  #: Places along the finger from the axis, (n,). [mm]
    z_mm: FloatArray  #: Places across, (m,). [mm]
    front_mm: FloatArray  #: Height, positive towards the skin; -inf beside the body, (n, m). [mm]
    along_mm: FloatArray  #: Radius along the finger, very large where it is flat or hollow, (n, m). [mm]
    across_mm: FloatArray  #: The same across the finger. [mm]
    round_mm: FloatArray  #: Radius of a ball of the same Gaussian curvature, large at edges, (n, m). [mm]


@lru_cache(maxsize=16)
def face_of(
    indenter: Indenter,
    spin_deg: float = 0.0,
    half_mm: tuple[float, float] = REACH_MM,
    step_mm: float = COARSE_MM,
) -> Face:
    """Face of a body that is turned about its axis, to either side along and across.

    It is traced one step above the body, where the sharpest edge is as round as that.
    """
    cosine, sine = cosine_and_sine(spin_deg)
    axes = np.array([[cosine, 0.0, -sine], [0.0, 1.0, 0.0], [sine, 0.0, cosine]])

    def gap(points: FloatArray) -> tuple[FloatArray, FloatArray]:
        distance, normal = indenter.gap(points @ axes)
        return distance - step_mm, normal @ axes.T

    counts = (round(half / step_mm) for half in half_mm)
    x_mm, z_mm = (step_mm * np.arange(-count, count + 1, dtype=np.float64) for count in counts)
    x, z = np.meshgrid(x_mm, z_mm, indexing="ij")
    points = np.column_stack([x.ravel(), np.zeros(x.size), z.ravel()])
    height = traced_front(gap, points, below_mm=LOWEST_MM, most_steps=MOST_STEPS)
    height[~indenter.may_touch(points @ axes)] = -np.inf
    points[:, 1] = np.where(np.isfinite(height), height, 0.0)
    normal = gap(points)[1].reshape(*x.shape, 3)
    height = height.reshape(x.shape)
    along_mm, across_mm, round_mm = (
        np.maximum(radius_mm - step_mm, 0.0)
        for radius_mm in _radii(np.stack([x, height, z], axis=-1), normal)
    )
    return Face(x_mm, z_mm, height - step_mm, along_mm, across_mm, round_mm)


def _radii(surface: FloatArray, normal: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Radii of a surface along each axis of its grid and of its Gaussian curvature."""
    there = np.isfinite(surface[..., 1])
    surface = np.where(there[..., None], surface, 0.0)
    steps, turns = ([_differences(values, there, axis) for axis in (0, 1)] for values in (surface, normal))
    pairs = ((0, 0), (0, 1), (1, 1))
    e, f, g = ((steps[i] * steps[k]).sum(axis=-1) for i, k in pairs)
    along, twist, across = ((turns[i] * steps[k]).sum(axis=-1) for i, k in pairs)
    with np.errstate(divide="ignore", invalid="ignore"):
        gauss = np.where((along > 0.0) & (across > 0.0), (along * across - twist**2) / (e * g - f**2), 0.0)
        curvatures = along / e, across / g, np.sqrt(np.maximum(gauss, 0.0))
    along_mm, across_mm, round_mm = (
        1.0 / np.maximum(np.nan_to_num(each), FLAT_PER_MM) for each in curvatures
    )
    return along_mm, across_mm, round_mm


def _differences(values: FloatArray, known: np.ndarray, axis: int) -> FloatArray:
    """Differences along an axis between neighbours of each point (n, m, 3), or to the one that is known."""
    # Over two steps: the curvature of flat triangles is that of a round body only as a mean over some length.
    values, known = np.moveaxis(values, axis, 0), np.moveaxis(known, axis, 0)
    step = np.diff(values, axis=0) * (known[1:] & known[:-1])[..., None]
    both = np.zeros_like(values)
    both[1:] += step
    both[:-1] += step
    return np.moveaxis(both, 0, axis)


def _extent_mm(touches: np.ndarray, axis: int) -> FloatArray:
    """Extent along an axis of the part of a body that touches at each place, 0 where none does. [mm]"""
    parts, _ = label(touches, np.ones((3, 3)))
    extents = [0, *(_extent(part[axis]) for part in find_objects(parts))]
    return STEP_MM * np.array(extents, dtype=np.float64)[parts]


def _extent(places: slice) -> int:
    """Return the steps along a part, a step wider on either side since it is traced above the body."""
    return max(places.stop - places.start - 3, 1)


def _groove_mm(touches: np.ndarray, axis: int) -> float:
    """Width along an axis of the narrowest groove between parts that touch, infinite without one. [mm]"""
    edges = np.diff(np.moveaxis(touches, axis, 1).astype(np.int8), axis=1)
    row, place = np.nonzero(edges)
    within = (row[1:] == row[:-1]) & (edges[row[:-1], place[:-1]] < 0)
    widths_mm = STEP_MM * (np.diff(place)[within] + 2)
    return float(np.quantile(widths_mm, NARROW)) if widths_mm.size else np.inf


@dataclass(frozen=True)
class Details:
    """The finest that a body has near its axis, along the finger and across."""

    sharpest_mm: float  #: Radius of the sharpest edge. [mm]
    parts_mm: tuple[float, float]  #: Extents of the narrowest part, infinite if all go on. [mm]
    grooves_mm: tuple[float, float]  #: Width of the narrowest groove, infinite without one. [mm]

    @property
    def narrowest_mm(self) -> float:
        """Width of the narrowest part or groove of any direction, infinite without one. [mm]"""
        return min(*self.parts_mm, *self.grooves_mm)


def _parts_mm(there: np.ndarray) -> list[float]:
    """Extents of the narrowest part along and across, infinite if all go on. [mm]"""
    parts = find_objects(label(there, np.ones((3, 3)))[0])
    return [
        STEP_MM * min(np.inf if _is_cut(part[axis], count) else _extent(part[axis]) for part in parts)
        for axis, count in enumerate(there.shape)
    ]


def _is_cut(places: slice, count: int) -> bool:
    """Whether a part may go on beyond the places that are looked at."""
    return places.start == 0 or places.stop == count


@lru_cache(maxsize=64)
def details_of(indenter: Indenter, spin_deg: float = 0.0) -> Details:
    """Find the sharpest edge, the narrowest part and the narrowest groove of a body."""
    face = face_of(indenter, spin_deg, (NEAR_AXIS_MM, NEAR_AXIS_MM), STEP_MM)
    touches = face.front_mm >= face.front_mm.max() - BELOW_TOP_MM
    sharpest_mm = float(min(face.along_mm.min(), face.across_mm.min()))
    both = zip(_parts_mm(touches), _parts_mm(np.isfinite(face.front_mm)), strict=True)
    whole_mm = (narrow if np.isinf(whole) else whole for narrow, whole in both)
    # A step of the grid may be wider than the body.
    along_mm, across_mm = (min(each, 2 * sharpest_mm) if each <= STEP_MM else each for each in whole_mm)
    return Details(sharpest_mm, (along_mm, across_mm), (_groove_mm(touches, 0), _groove_mm(touches, 1)))


def half_width_mm(indenter: Indenter) -> float:
    """Half of the extent of a body along the finger, or up to half a mm more; infinite if it goes on. [mm]"""
    face = face_of(indenter)
    reached_mm = np.abs(face.x_mm[np.isfinite(face.front_mm).any(axis=1)]).max()
    return float(reached_mm) if reached_mm < REACH_MM[0] else np.inf


def check_sizes(grading: Grading, indenter: Indenter, spin_deg: float) -> None:
    """Check that elements are small enough: a body, ridge or groove between two nodes has no effect."""
    details, sizes_mm = details_of(indenter, spin_deg), (grading.finest_x_mm, grading.finest_z_mm)
    fewest = 1 if np.isinf(details.parts_mm).any() else FEWEST_BELOW
    for what, extents_mm, least in (("part", details.parts_mm, fewest), ("groove", details.grooves_mm, 2)):
        for size_mm, extent_mm in zip(sizes_mm, extents_mm, strict=True):
            if size_mm > extent_mm / least:
                raise InputError(
                    "grading",
                    f"must have elements of at most {extent_mm / least:.3g} mm, because a {what} of "
                    f"the {type(indenter).__name__}, {extent_mm:.3g} mm wide, would go between the nodes",
                    f"{size_mm:g} mm",
                    "give a finer grading, or leave it out",
                )


def grading_below(
    finger: Finger,
    indenter: Indenter,
    resolution: str,
    at_mm: tuple[float, float],
    motion: Motion,
    tilt_deg: float = 0.0,
    spin_deg: float = 0.0,
) -> Grading:
    """Mesh that resolves a body wherever it touches the skin on its way, which goes through a point of it."""
    assert isinstance(finger, Fingertip)
    poses, near_mm = _visited(motion)
    skin = _Skin.about(finger, at_mm, max(REACH_MM) + max(np.hypot(pose.x_mm, pose.z_mm) for pose in poses))
    count, scale = skin.places_mm.size, min(finger.relative_size, 1.0)
    sizes_mm = [np.full(count, np.inf), np.full(count, np.inf)]
    pressed = [np.zeros(count, dtype=bool), np.zeros(count, dtype=bool)]
    contacts = [*_touching(skin, indenter, poses, motion, tilt_deg, spin_deg)]
    for part, extents_mm in zip(contacts, _extents_mm(contacts), strict=True):
        for axis, radius_mm in enumerate((part.face.along_mm, part.face.across_mm)):
            place, extent_mm = part.places[axis], extents_mm[axis]
            size_mm = scale * _size_mm(SHARES[resolution], radius_mm, part.face.round_mm, extent_mm)
            np.minimum.at(sizes_mm[axis], place[part.touches], size_mm[part.touches])
            pressed[axis][place[part.presses]] = True
    if len(poses) > 1:
        near = 2 * round(near_mm / STEP_MM / 2) + 1
        sizes_mm = [minimum_filter1d(size_mm, near) for size_mm in sizes_mm]
    if not pressed[0].any():  # it never touches
        pressed = [skin.places_mm == 0.0, skin.places_mm == 0.0]
    zone = _zone(finger, resolution, at_mm, *(skin.places_mm[each] for each in pressed))
    leaves = at_mm[1] != 0.0 or any(pose.z_mm or pose.spin_deg for pose in motion.poses)
    zone = replace(zone, full=zone.full or leaves or not indenter.mirrors(spin_deg))
    fewer = _fewer(sizes_mm, zone, MOST_ELEMENTS[resolution])
    if fewer is None:
        raise InputError(
            f"{type(indenter).__name__} has too many details for a mesh of {resolution}, with more than "
            f"{MOST_ELEMENTS[resolution]:,} elements below it; smooth or enlarge it, cut off what does not "
            "touch the skin, or give a grading."
        )
    along_mm, across_mm = fewer
    finest_mm = float(min(along_mm.min(), across_mm.min()))
    through = int(np.ceil(finger.stratum_corneum_mm / (THICKEST * finest_mm)))
    found = replace(
        zone,
        finer_along=_strips(at_mm[0] + skin.places_mm, along_mm, zone.growth),
        finer_across=_strips(at_mm[1] + skin.places_mm, across_mm, zone.growth),
        stratum_corneum=max(zone.stratum_corneum, min(through, MOST_THROUGH)),
    )
    if finest_mm <= SMALLEST_MM:  # others are resolved
        check_sizes(found, indenter, spin_deg)
    return found


def _visited(motion: Motion) -> tuple[dict[Pose, float], float]:
    """Places of a moving body, with the largest depth or force in each, and how near they are. [mm]"""
    near_mm, near_deg = NEAR_MM, NEAR_DEG
    if motion.stays:
        return {STILL: motion.largest}, near_mm
    while True:
        units = np.array([near_mm, near_mm, near_deg / 3.0, near_deg])
        times_ms = divided_ms(motion.samples_ms, np.abs(np.diff(motion.ways, axis=0) / units).max(axis=1))
        visited: dict[Pose, float] = {STILL: -np.inf}  # First touch is counted from here.
        for time_ms, depth_mm in zip(times_ms.tolist(), motion.prescribed_at(times_ms).tolist(), strict=True):
            way = np.array(list(vars(motion.pose_at(time_ms)).values()))
            there = Pose(*(units * np.round(way / units) + 0.0).tolist())
            visited[there] = max(depth_mm, visited.get(there, -np.inf))
        if len(visited) <= MOST_PLACES:
            return visited, near_mm
        near_mm, near_deg = 1.5 * near_mm, 1.5 * near_deg


@dataclass(frozen=True)
class _Skin:
    """Volar skin about a point, on a square grid of distances along the finger and across. [mm]"""

    places_mm: FloatArray  #: Distances from the point, (n,).
    y_mm: FloatArray  #: Height of the skin over that point, infinite beside the finger, (n, n).
    deepest_mm: float  #: Distance from the point to the bone.

    @staticmethod
    @lru_cache(maxsize=8)
    def about(finger: Fingertip, at_mm: tuple[float, float], reach_mm: float) -> _Skin:
        count = int(np.ceil(reach_mm / STEP_MM)) + 1
        places_mm = STEP_MM * np.arange(-count, count + 1, dtype=np.float64)
        x, z = np.meshgrid(at_mm[0] + places_mm, at_mm[1] + places_mm, indexing="ij")
        inside = (x >= 0.0) & (x <= finger.length_mm)
        inside[inside] = np.abs(z[inside]) < finger.section(x[inside])[2]
        y_mm = np.full(x.shape, np.inf)
        y_mm[inside] = finger.skin_point(x[inside], z[inside])[:, 1] - finger.skin_point(*at_mm)[1]
        return _Skin(places_mm, y_mm, float(finger.depth_available_mm(*at_mm)))

    def below(
        self, face: Face, pose: Pose, tilt_deg: float
    ) -> tuple[tuple[np.ndarray, np.ndarray], FloatArray]:
        """Places of the skin below a face, along and across, and its height in the axes of the body. [mm]"""
        middle = len(self.places_mm) // 2
        cosine, sine = cosine_and_sine(tilt_deg + pose.tilt_deg)
        at_mm = face.x_mm + cosine * pose.x_mm
        rows = middle + np.round((face.z_mm + pose.z_mm) / STEP_MM).astype(int)
        columns = np.full(face.front_mm.shape, middle)
        height_mm = np.full(face.front_mm.shape, np.inf)
        for k, row in enumerate(rows.tolist()):
            there = np.flatnonzero(np.isfinite(self.y_mm[:, row]))
            if there.size < 2:
                continue
            x, y = self.places_mm[there], self.y_mm[there, row]
            along_mm, up_mm = cosine * x + sine * y, cosine * y - sine * x
            order = np.argsort(along_mm)
            height_mm[:, k] = np.interp(at_mm, along_mm[order], up_mm[order], np.inf, np.inf)
            columns[:, k] = np.round(np.interp(at_mm, along_mm[order], there[order]))
        return (columns, np.broadcast_to(rows, columns.shape)), height_mm


@dataclass(frozen=True)
class _Contact:
    """Where a body meets the undeformed skin in one place of its way."""

    spin_deg: float  #: By which the body is turned about its axis.
    face: Face
    places: tuple[np.ndarray, np.ndarray]  #: Of the skin below the face, along and across, (n, m) each.
    touches: np.ndarray  #: Whether the face reaches the skin there, bool (n, m).
    presses: np.ndarray  #: Whether it goes clearly deeper, bool (n, m).


def _touching(
    skin: _Skin,
    indenter: Indenter,
    poses: dict[Pose, float],
    motion: Motion,
    tilt_deg: float,
    spin_deg: float,
) -> Iterator[_Contact]:
    """Yield the contact in each place of the way, found on a coarse grid and looked at on a fine one."""
    first_mm: dict[float, float] = {}  # Way to first touch, on each grid.

    def contact(pose: Pose, prescribed: float, half_mm: tuple[float, float], step_mm: float) -> _Contact:
        face = face_of(indenter, spin_deg + pose.spin_deg, half_mm, step_mm)
        places, height_mm = skin.below(face, pose, tilt_deg)
        clear_mm = height_mm - face.front_mm
        clear_mm -= first_mm.setdefault(step_mm, float(clear_mm.min()))
        depth_mm = prescribed
        if motion.by_force:
            touched = min(int(motion.largest / PRESSURE_KPA / step_mm**2), clear_mm.size - 1)
            depth_mm = min(float(np.partition(clear_mm, touched, axis=None)[touched]), skin.deepest_mm)
        # On the way to first touch the fine grid is wanted too.
        least_mm = float(clear_mm.min()) if step_mm == COARSE_MM else -np.inf
        touches = clear_mm <= max(depth_mm, least_mm)
        return _Contact(pose.spin_deg, face, places, touches, clear_mm <= PRESSED * depth_mm)

    half_mm = 0.0, 0.0
    for pose, prescribed in poses.items():
        coarse = contact(pose, prescribed, REACH_MM, COARSE_MM)
        along, across = np.nonzero(coarse.touches)
        reached_mm = _whole(coarse.face.x_mm[along]), _whole(coarse.face.z_mm[across])
        half_mm = max(half_mm[0], reached_mm[0]), max(half_mm[1], reached_mm[1])
    for pose, prescribed in poses.items():
        fine = contact(pose, prescribed, half_mm, STEP_MM)
        if fine.touches.any():
            yield fine


def _extents_mm(contacts: Sequence[_Contact]) -> list[FloatArray]:
    """Largest extents on the way, along and across, of the part at each place of each contact. [mm]"""
    # Of a dot that enters or leaves the contact only a sliver touches, which is no reason for small elements.
    widest_mm: dict[float, FloatArray] = {}
    for part in contacts:
        extents_mm = np.stack([_extent_mm(part.touches, axis) for axis in (0, 1)])
        widest_mm[part.spin_deg] = np.maximum(widest_mm.get(part.spin_deg, 0.0), extents_mm)
    return [widest_mm[part.spin_deg] for part in contacts]


def _whole(places_mm: FloatArray) -> float:
    """Half-extent that holds all places and a little beyond, in whole mm. [mm]"""
    return float(np.ceil(np.abs(places_mm).max() + COARSE_MM))


def _size_mm(share: float, radius_mm: FloatArray, round_mm: FloatArray, extent_mm: FloatArray) -> FloatArray:
    """Size of elements below a body of this radius, in a part of this extent. [mm]"""
    part_mm = np.maximum(extent_mm / ACROSS_PART, ROUND_SHARE * radius_mm)
    size_mm = np.minimum(np.minimum(share * radius_mm, ROUND_SHARE * round_mm), part_mm)
    coarsest_mm = extent_mm / FEWEST_ACROSS
    return np.clip(size_mm, np.minimum(SMALLEST_MM, coarsest_mm), coarsest_mm)


def _zone(
    finger: Fingertip, resolution: str, at_mm: tuple[float, float], x_mm: FloatArray, z_mm: FloatArray
) -> Grading:
    """Zone of the largest elements below a body that presses at these distances from a point. [mm]"""
    zone = resolution_grading(resolution, at_mm[0], finger_size=finger.relative_size)
    # Whole elements from the axis to the middle of the zone: a line goes through the axis.
    aside_mm = zone.size_x_mm * float(np.round(0.5 * (x_mm.min() + x_mm.max()) / zone.size_x_mm))
    half_length_mm = float(np.abs(x_mm - aside_mm).max()) + STEP_MM
    half_width_mm = float(np.abs(at_mm[1] + z_mm).max()) + STEP_MM
    centre_mm = at_mm[0] + aside_mm
    return resolution_grading(resolution, centre_mm, half_length_mm, half_width_mm, finger.relative_size)


def _fewer(sizes_mm: Sequence[FloatArray], zone: Grading, most: int) -> list[FloatArray] | None:
    """Sizes worth a strip, larger alike until the elements of the zone are not too many; None if never."""
    widths_mm = 2 * zone.half_length_mm, (1 + zone.full) * zone.half_width_mm
    worth_mm = [np.where(size_mm < WORTH * zone.size_x_mm, size_mm, np.inf) for size_mm in sizes_mm]
    by = 1.0
    while by <= COARSEST:
        larger_mm = [np.where(by * size_mm < zone.size_x_mm, by * size_mm, np.inf) for size_mm in worth_mm]
        lines = [
            _lines(size_mm, zone) + width_mm / zone.size_x_mm
            for size_mm, width_mm in zip(larger_mm, widths_mm, strict=True)
        ]
        if lines[0] * lines[1] * sum(zone.counts) <= most:
            return larger_mm
        by *= 1.05
    return None


def _lines(size_mm: FloatArray, zone: Grading) -> float:
    """Return how many lines more than those of the zone sizes take that grow from their places."""
    place_mm = np.log(zone.growth) * STEP_MM * np.arange(size_mm.size)
    ahead = np.minimum.accumulate(size_mm - place_mm) + place_mm
    behind = np.minimum.accumulate((size_mm + place_mm)[::-1])[::-1] - place_mm
    grown_mm = np.minimum(np.minimum(ahead, behind), zone.size_x_mm)
    return float((STEP_MM / grown_mm - STEP_MM / zone.size_x_mm).sum())


def _strips(place_mm: FloatArray, size_mm: FloatArray, growth: float) -> tuple[Strip, ...]:
    """Few strips from which sizes grow to about those of a field, smallest first."""
    strips: list[Strip] = []
    envelope_mm = np.full(len(size_mm), np.inf)
    while (wanted := size_mm < envelope_mm / ALIKE).any():
        start = int(np.where(wanted, size_mm, np.inf).argmin())
        alike = np.append(size_mm <= ALIKE**2 * size_mm[start], False)
        first = start - int(alike[start::-1].argmin()) + 1
        last = start + int(alike[start:].argmin()) - 1
        begin_mm, end_mm = float(place_mm[first]) - STEP_MM / 2, float(place_mm[last]) + STEP_MM / 2
        strips.append((begin_mm, end_mm, float(size_mm[start])))
        beside_mm = np.maximum(np.maximum(begin_mm - place_mm, place_mm - end_mm), 0.0)
        envelope_mm = np.minimum(envelope_mm, size_mm[start] + np.log(growth) * beside_mm)
    return tuple(strips)
