"""A reduced touch: fields of full presses about each pose, as modes with coefficients.

At every training pose the response at once Y and what each branch relaxes D_i (see `relaxation`) are
polynomials in sqrt(d / d_max) of the depth d below first touch: force and contact grow smoothly with it.
Their coefficients follow from all samples of the presses there by least squares. Fields are sampled about the
middle of the contact, so that they differ little from pose to pose, and are kept as the modes of their
singular value decomposition. Files hold arrays without code, a version and a checksum.
"""

from __future__ import annotations

import hashlib
import io
import json
from collections.abc import Mapping, Sequence
from dataclasses import asdict
from functools import cached_property
from pathlib import Path
from typing import cast

import numpy as np

from fingerpad.core.checked import checked, value_class
from fingerpad.core.errors import InputError
from fingerpad.core.files import check_file, path_of, write_atomically
from fingerpad.core.signals import STORED_ENERGY
from fingerpad.core.values import Finite, FloatArray, Many, Pair
from fingerpad.geometry.fingertip import Fingertip
from fingerpad.reduction.interpolation import Axis, chebyshev_points, lagrange
from fingerpad.reduction.relaxation import LEVELS, filtered, levels_mm, slope_changes
from fingerpad.reduction.training import TrainingPose
from fingerpad.skin.indentation import Touch
from fingerpad.skin.sampling import SkinResponse
from fingerpad.skin.store import value_digest

AT_ONCE, RELAXED = 14, 4  # Degree in sqrt(depth) of the response at once and of what relaxes.
GRID_POINTS = 41  # Points of the local fields along and across.
BEYOND_CONTACT_MM = 3.0  # How far the local fields extend beyond the contact. [mm]
LOST = 1e-3  # Part of the fields that modes may leave out, relative to the largest singular value.
FINE_PARTS = 20  # Parts of a training step in which the filters are integrated.

ERROR_FLOOR = 0.05
"""Part of the largest values of the training that errors are relative to in a touch that is still light."""

ON_THE_PAD = 0.85
"""Share of the half-width of the finger within which fields are sampled; they are continued beyond it."""


def depth_basis(depth_mm: FloatArray, deepest_mm: float, degree: int) -> FloatArray:
    """Polynomials in sqrt(d / d_max) that vanish at d = 0, (..., degree); 0 without contact."""
    share = np.sqrt(np.maximum(depth_mm, 0.0) / deepest_mm)
    return lagrange(chebyshev_points(degree + 1), share)[..., 1:] * (np.asarray(depth_mm) > 0.0)[..., None]


@value_class
class ReducedModel:
    """What a reduced touch is evaluated from.

    Parameters
    ----------
    axes : tuple of Axis
        Axes of the range: x, z, tilt and perhaps a parameter of the indenter.
    depth_mm : float
        Largest depth below first touch. [mm]
    at_mm : (float, float)
        Place of the touch. [mm]
    times_ms : array (n_branches,)
        Time constants of the tissues. [ms]
    quantities : tuple of str
        Quantities of the fields, names of `SkinResponse.sample`.
    first_touch_mm : array (n_poses,)
        Depth of first touch at each pose. [mm]
    middle_mm : array (n_poses, 2)
        x and z of the middle of the contact. [mm]
    totals : array (n_poses, n_terms, 2)
        Coefficients of the force [mN] and of the contact area [mm²]: the terms are those of the response at
        once, then those of each branch.
    coefficients : array (n_poses, n_terms, n_modes)
        Coefficients of the modes.
    modes : array (n_modes, n_quantities, n_grid, n_grid)
        Fields about the middle of the contact. [each in its unit]
    reach_mm : array (2,)
        Half-extent of the fields along and across. [mm]
    largest : array (n_quantities + 1,)
        Largest values of the quantities [each in its unit] and of the force [mN] in the training.
    error : array (n_quantities + 1,)
        Errors that 95 % of new touches stay within, all of them together, over `error_scale` (see
        `building`). Infinite before that is measured.
    exponents : array (n_quantities + 1,)
        Powers of the depth that scale what has relaxed (see `relaxation`), of the quantities and the force.
    origin : dict of str
        What was pressed: for people, and to refuse another finger.
    """

    axes: Many[Axis]
    depth_mm: Finite
    at_mm: Pair
    times_ms: FloatArray
    quantities: Many[str]
    first_touch_mm: FloatArray
    middle_mm: FloatArray
    totals: FloatArray
    coefficients: FloatArray
    modes: FloatArray
    reach_mm: FloatArray
    largest: FloatArray
    error: FloatArray
    exponents: FloatArray
    origin: Mapping[str, str]

    def __repr__(self) -> str:
        ranges = ", ".join(
            f"{axis.name} {axis.low:g}" + (f" to {axis.high:g}" if axis.high > axis.low else "")
            for axis in self.axes
        )
        known = "known" if np.isfinite(self.error).all() else "not measured"
        return (
            f"ReducedModel({self.origin['indenter']}, to {self.depth_mm:g} mm, {ranges}, "
            f"{len(self.modes)} modes, errors {known})"
        )

    def error_scale(self, so_far: FloatArray) -> FloatArray:
        """Return what errors are relative to: the largest values so far, and a part of the training's."""
        return np.asarray(so_far + ERROR_FLOOR * self.largest)

    def pose_weights(self, values: Sequence[float]) -> FloatArray:
        """Weights of the training poses at a pose, (n_poses,); InputError outside of the range."""
        weights = np.ones(1)
        for axis, value in zip(self.axes, values, strict=True):
            weights = np.multiply.outer(weights, axis.weights(value)).ravel()
        return weights

    @cached_property
    def squared(self) -> np.ndarray:
        """Which quantities are squares of what relaxes linearly, (n_quantities,)."""
        return squares(self.quantities)

    @cached_property
    def pressures(self) -> FloatArray:
        """Modes of the first quantity, which stands for the pressure on skin, (n_modes, n_grid²). [kPa]"""
        return np.ascontiguousarray(self.modes[:, 0]).reshape(len(self.modes), -1)

    @cached_property
    def deepest_terms(self) -> FloatArray:
        """Terms of the largest depth, (1 + n_branches, n_terms)."""
        return self.terms(self.depth_mm, np.zeros(LEVELS))

    @cached_property
    def levels_mm(self) -> FloatArray:
        """Levels of the springs of `retreat`, (n_levels,). [mm]"""
        return levels_mm(self.depth_mm)

    @cached_property
    def _slope_changes(self) -> tuple[FloatArray, FloatArray]:
        """Weights of the springs in the polynomials of the depth, at once and relaxed, (n_levels, degree)."""
        at = np.append(self.levels_mm, self.depth_mm)
        once, relaxed = (
            slope_changes(self.levels_mm, self.depth_mm, depth_basis(at, self.depth_mm, degree))
            for degree in (AT_ONCE, RELAXED)
        )
        return once, relaxed

    def terms(self, depth_mm: Finite, behind_mm: FloatArray) -> FloatArray:
        """Factors of the terms of the response at once and of each branch.

        Parameters
        ----------
        depth_mm : float
            Depth below first touch. [mm]
        behind_mm : array (n_levels,)
            How far the skin of each level stays behind. [mm]
        """
        depth = np.array(depth_mm)
        once_of, relaxed_of = self._slope_changes
        once = depth_basis(depth, self.depth_mm, AT_ONCE) + behind_mm @ once_of
        relaxed = depth_basis(depth, self.depth_mm, RELAXED) + behind_mm @ relaxed_of
        found = np.zeros((1 + self.times_ms.size, AT_ONCE + RELAXED * self.times_ms.size))
        found[0, :AT_ONCE] = once
        for branch in range(self.times_ms.size):
            start = AT_ONCE + RELAXED * branch
            found[1 + branch, start : start + RELAXED] = relaxed
        return found


def fitted_model(
    axes: tuple[Axis, ...],
    deepest_mm: float,
    at_mm: tuple[float, float],
    poses: Sequence[TrainingPose],
    responses: Sequence[Sequence[SkinResponse]],
    quantities: tuple[str, ...],
) -> ReducedModel:
    touch = poses[0].touches[0]
    finger = cast(Fingertip, touch.finger)
    constants = np.unique([time for law in touch.tissues.layers for time in law.prony.times_ms])
    reach = _reach_mm(responses)
    terms = [
        _terms(skin.times_ms, skin.depth_mm - pose.meets_mm, deepest_mm, constants)
        for pose, each in zip(poses, responses, strict=True)
        for skin in each
    ]
    middles = np.array([_middle_mm(each[-1]) for each in responses])
    totals, fields_of, peaks = [], [], []
    for n, each in enumerate(responses):
        linear, quadratic = (
            np.vstack(rows) for rows in zip(*terms[n * len(each) : (n + 1) * len(each)], strict=True)
        )
        sites = _sites(finger, middles[n], reach)
        known = np.vstack(
            [np.hstack([skin.sample(quantity, sites) for quantity in quantities]) for skin in each]
        )
        whole = np.vstack([np.stack([skin.force_mn, skin.contact_area_mm2], axis=1) for skin in each])
        found = np.linalg.lstsq(linear, np.hstack([whole, known]), rcond=1e-8)[0]
        of_squares = np.concatenate([[False, False], np.repeat(squares(quantities), len(sites))])
        found[:, of_squares] = np.linalg.lstsq(quadratic, known[:, of_squares[2:]], rcond=1e-8)[0]
        peaks.append(known.reshape(len(known), len(quantities), -1).max(axis=(0, 2)))
        totals.append(found[:, :2])
        fields_of.append(found[:, 2:])
    values = np.stack(fields_of)
    coefficients, modes = _modes(values, len(quantities))
    largest = np.max(peaks, axis=0)
    return ReducedModel(
        axes=axes,
        depth_mm=deepest_mm,
        at_mm=at_mm,
        times_ms=constants,
        quantities=quantities,
        first_touch_mm=np.array([pose.first_touch_mm for pose in poses]),
        middle_mm=middles,
        totals=np.stack(totals),
        coefficients=coefficients,
        modes=modes,
        reach_mm=reach,
        largest=np.append(largest, max(skin.force_mn.max() for each in responses for skin in each)),
        error=np.full(len(quantities) + 1, np.inf),
        exponents=np.zeros(len(quantities) + 1),
        origin=origin_of(touch),
    )


def origin_of(touch: Touch) -> dict[str, str]:
    """Tell what a model is made of: its indenter in words, and digests of finger and tissues."""
    return {
        "indenter": str(touch.indenter),
        "finger": value_digest(touch.finger),
        "tissues": value_digest(touch.tissues),
    }


def squares(quantities: Sequence[str]) -> np.ndarray:
    """Tell which quantities are quadratic in the strain, (n_quantities,)."""
    return np.array([quantity == STORED_ENERGY for quantity in quantities])


def _terms(
    times_ms: FloatArray, depth_mm: FloatArray, deepest_mm: float, constants_ms: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """One row per time: the response at once, less what each branch has relaxed; and the same of squares."""
    # The strain behind a square grows with the depth here.
    steps = np.arange(FINE_PARTS * (times_ms.size - 1) + 1) / FINE_PARTS
    fine = np.interp(steps, np.arange(times_ms.size), times_ms)
    depth = np.maximum(np.interp(fine, times_ms, depth_mm), 0.0)[:, None]
    basis = depth_basis(depth[:, 0], deepest_mm, RELAXED)
    linear = [depth_basis(depth_mm, deepest_mm, AT_ONCE)]
    quadratic = linear.copy()
    for constant in constants_ms.tolist():
        relaxed = filtered(fine, np.hstack([basis, depth]), constant)
        share = np.divide(relaxed[:, -1:], depth, out=np.zeros_like(depth), where=depth > 0.0)
        linear.append(-relaxed[::FINE_PARTS, :-1])
        quadratic.append(-(share * (2.0 - share) * basis)[::FINE_PARTS])
    return np.hstack(linear), np.hstack(quadratic)


def _middle_mm(skin: SkinResponse) -> FloatArray:
    """X and z of the middle of the contact in the undeformed skin, weighted by the pressure. [mm]"""
    nodes_mm = skin.mesh.nodes_mm[skin.mesh.skin_nodes]
    weight = skin.contact_pressure_kpa.max(axis=0) * skin.mesh.skin_area_mm2
    x, _, z = (weight @ nodes_mm) / weight.sum()
    return np.array([x, z if skin.touch is not None and skin.touch.grading.full else 0.0])


def _reach_mm(responses: Sequence[Sequence[SkinResponse]]) -> FloatArray:
    """Half-extent of the largest contact and `BEYOND_CONTACT_MM`, along and across. [mm]"""
    extents = []
    for each in responses:
        skin = each[-1]
        touched = skin.mesh.nodes_mm[skin.mesh.skin_nodes][skin.contact_pressure_kpa.max(axis=0) > 0.0]
        extents.append(np.abs(touched[:, [0, 2]] - _middle_mm(skin)).max(axis=0))
    return np.asarray(np.max(extents, axis=0) + BEYOND_CONTACT_MM)


def _sites(finger: Fingertip, middle_mm: FloatArray, reach_mm: FloatArray) -> FloatArray:
    """Places of the end organs of a local field, (n_grid², 2), moved onto the pad if they lie beside it."""
    along, across = (np.linspace(-reach, reach, GRID_POINTS) for reach in reach_mm)
    x, z = (grid.ravel() for grid in np.meshgrid(middle_mm[0] + along, middle_mm[1] + across, indexing="ij"))
    x = np.clip(x, 2.0, finger.length_mm - 2.0)
    widest = ON_THE_PAD * finger.section(x)[2]
    return np.column_stack([x, np.clip(z, -widest, widest)])


def _modes(values: FloatArray, n_quantities: int) -> tuple[FloatArray, FloatArray]:
    """Coefficients (n_poses, n_terms, n_modes) and modes of fields (n_poses, n_terms, n_values)."""
    by_quantity = values.reshape(*values.shape[:2], n_quantities, -1)
    scale = np.abs(by_quantity).max(axis=(0, 1, 3), keepdims=True)
    flat = (by_quantity / scale).reshape(values.shape[0] * values.shape[1], -1)
    left, size, right = np.linalg.svd(flat, full_matrices=False)
    kept = int((size > LOST * size[0]).sum())
    modes = right[:kept].reshape(1, kept, n_quantities, -1) * scale
    return (
        (left[:, :kept] * size[:kept]).reshape(*values.shape[:2], kept),
        np.ascontiguousarray(modes.reshape(kept, n_quantities, GRID_POINTS, GRID_POINTS)),
    )


FORMAT = "fingerpad reduced touch"
VERSION = 2
LARGEST_MB = 1000.0

ARRAYS = (
    "times_ms",
    "first_touch_mm",
    "middle_mm",
    "totals",
    "coefficients",
    "modes",
    "reach_mm",
    "largest",
    "error",
    "exponents",
)


@checked
def write_reduced(model: ReducedModel, path: str | Path) -> None:
    """Write a reduced touch, as a whole or not at all.

    Raises
    ------
    StoreError
        If the file cannot be written.
    """
    head = {
        "format": FORMAT,
        "version": VERSION,
        "axes": [asdict(axis) for axis in model.axes],
        "depth_mm": model.depth_mm,
        "at_mm": model.at_mm,
        "quantities": model.quantities,
        "origin": model.origin,
    }
    arrays = {name: np.ascontiguousarray(getattr(model, name), dtype=np.float64) for name in ARRAYS}
    text = json.dumps(head, sort_keys=True)
    buffer = io.BytesIO()
    np.savez_compressed(
        buffer,
        head=np.array(text),
        checksum=np.array(_checksum(text, arrays)),
        **arrays,  # type: ignore[arg-type]
    )
    write_atomically(path_of("path", path), buffer.getvalue())


@checked
def read_reduced(path: str | Path, touch: Touch | None = None) -> ReducedModel:
    """Read a reduced touch.

    Parameters
    ----------
    path : str or Path
        A file of `write_reduced` or of `fingerpad reduce`.
    touch : Touch, optional
        If given, its finger and tissues must be those of the file.
    """
    source = check_file(path_of("path", path), LARGEST_MB)
    try:
        with source.open("rb") as opened, np.load(opened, allow_pickle=False) as file:
            text, checksum = str(file["head"]), str(file["checksum"])
            arrays = {name: file[name] for name in ARRAYS}
        head = json.loads(text)
        found = head["format"], head["version"]
    except OSError as error:
        raise InputError(
            path, "must be a file that can be read", remedy=str(error.strerror or error)
        ) from error
    except Exception as error:  # a file of unknown content may fail in any way
        raise InputError(
            path,
            "must be a whole file of a reduced touch",
            remedy="it is another file, or was cut short; make it again with `fingerpad reduce`",
        ) from error
    if found != (FORMAT, VERSION):
        raise InputError(
            path,
            f"must be a {FORMAT} of version {VERSION}",
            f"{found[0]!r} of version {found[1]!r}",
            "make it again with `fingerpad reduce`",
        )
    if checksum != _checksum(text, arrays):
        raise InputError(f"{path} is damaged: its checksum is wrong; make it again with `fingerpad reduce`.")
    if touch is not None:
        for name, value in origin_of(touch).items():
            if name != "indenter" and head["origin"][name] != value:
                raise InputError(f"{path} was made with another {name}: make it again with this one.")
    return ReducedModel(
        axes=tuple(Axis(**axis) for axis in head["axes"]),
        depth_mm=head["depth_mm"],
        at_mm=tuple(head["at_mm"]),
        quantities=tuple(head["quantities"]),
        origin=head["origin"],
        **arrays,
    )


def _checksum(head: str, arrays: dict[str, np.ndarray]) -> str:
    digest = hashlib.sha256(head.encode())
    for name in ARRAYS:
        digest.update(repr(arrays[name].shape).encode())
        digest.update(np.ascontiguousarray(arrays[name]).tobytes())
    return digest.hexdigest()
