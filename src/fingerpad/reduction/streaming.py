"""A touch, sample by sample: pose in, fields at the receptors, force and area out.

The filters of `relaxation` act where the tissue is: each receptor relaxes by what has pressed it, so that an
indenter which slides meets skin that has not relaxed. For the force the same is true of the skin below the
contact; its share of relaxation is read from a sheet of further places.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numba import njit
from numpy.typing import ArrayLike
from scipy.optimize import brentq

from fingerpad.core.checks import FloatArray, finite, float_array, instance, not_negative
from fingerpad.core.errors import InputError
from fingerpad.reduction.interpolation import weighted
from fingerpad.reduction.model import GRID_POINTS, ReducedModel
from fingerpad.reduction.relaxation import amplitudes, depth_scale, filter_step, lost
from fingerpad.reduction.retreat import Springs

SHEET_MM = 0.8
"""Distance of the places that tell how far the skin below the contact has relaxed. [mm]"""

FORGETS_MM = 2.0
"""Way of sliding over which the skin below the contact is replaced. [mm]"""

LEAST_SHARE = 0.05
"""Least relaxation that the pose leads to, over that of the skin, from which it counts for the force."""

CLOSEST_MM = 1e-9
"""Tolerance of the depth of a force. [mm]"""


@dataclass(frozen=True)
class ReducedSample:
    """A touch at one time.

    Parameters
    ----------
    time_ms : float
        The time. [ms]
    depth_mm : float
        Advance since first touch at the place of the touch. [mm]
    force_mn : float
        Force along the direction of pressing. [mN]
    contact_area_mm2 : float
        Undeformed skin in contact. [mm²]
    fields : dict of str to array (n_receptors,)
        Quantities at the receptors. [kPa]
    force_error_mn : float
        The force of a full solution lies within it for 95 % of touches. [mN]
    field_errors : dict of str to float
        The same of each quantity, at all receptors. [kPa]
    """

    time_ms: float
    depth_mm: float
    force_mn: float
    contact_area_mm2: float
    fields: dict[str, FloatArray]
    force_error_mn: float
    field_errors: dict[str, float]


class ReducedTouch:
    """State of a touch that is evaluated sample by sample.

    Parameters
    ----------
    model : ReducedModel
        From `fingerpad.read_reduced` or `fingerpad.reduce_touch`.
    receptors_mm : array (n_receptors, 2)
        x and z of the end organs, as of `SkinResponse.sed`. [mm]
    parameter : float, optional
        The parameter of the indenter, if the model has one.

    Raises
    ------
    InputError
        If `receptors_mm` is no array of pairs, or the parameter is missing or out of range.
    """

    def __init__(self, model: ReducedModel, receptors_mm: ArrayLike, parameter: float | None = None):
        instance("model", model, ReducedModel)
        receptors = float_array("receptors_mm", receptors_mm, 2)
        if receptors.shape[1] != 2:
            raise InputError(f"receptors_mm needs columns x and z in mm: got shape {receptors.shape}.")
        shape = model.axes[3:]
        if bool(shape) != (parameter is not None):
            wanted = f"needs {shape[0].name} as parameter" if shape else "has no parameter of the indenter"
            raise InputError(f"This reduced touch {wanted}: got {parameter!r}.")
        self._model, self._shape = model, () if parameter is None else (finite("parameter", parameter),)
        self._receptors, self._sheet = receptors, self._places_below()
        n_branches, n_quantities = model.times_ms.size, len(model.quantities)
        self._at_receptors = _Filters.at_rest((n_branches, n_quantities, len(receptors)))
        self._at_sheet = _Filters.at_rest((n_branches, len(self._sheet)))
        self._springs = Springs.at_rest(n_branches)
        self._time_ms, self._way_mm = 0.0, np.zeros(2)
        self._share, self._largest = np.zeros(n_branches), np.zeros(n_quantities + 1)
        self._modes = model.modes.reshape(len(model.modes), -1)
        self.step(0.0, depth_mm=min(0.0, float(model.first_touch_mm.min())))

    def _places_below(self) -> FloatArray:
        """Places below all contacts of the range, (n, 2)."""
        model = self._model
        low, high = model.middle_mm.min(axis=0) - model.reach_mm, model.middle_mm.max(axis=0) + model.reach_mm
        x, z = (np.arange(a, b + SHEET_MM, SHEET_MM) for a, b in zip(low, high, strict=True))
        return np.column_stack([grid.ravel() for grid in np.meshgrid(x, z, indexing="ij")])

    def step(
        self,
        time_ms: float,
        depth_mm: float | None = None,
        force_mn: float | None = None,
        x_mm: float = 0.0,
        z_mm: float = 0.0,
        tilt_deg: float = 0.0,
    ) -> ReducedSample:
        """Go to a later time and pose, along a straight way from the last one.

        Parameters
        ----------
        time_ms : float
            Not before the last step. [ms]
        depth_mm, force_mn : float
            Either the depth since first touch at the place of the touch, or the force. [mm, mN]
        x_mm, z_mm, tilt_deg : float
            The pose, as of a `Trajectory`.

        Returns
        -------
        ReducedSample
            What is at the receptors now.

        Raises
        ------
        InputError
            If the time goes back, neither or both of depth and force are given, or the pose lies out of the
            range; the state is then unchanged.
        """
        step_ms = finite("time_ms", time_ms, "ms") - self._time_ms
        if step_ms < 0.0:
            raise InputError(f"time_ms must not go back: got {time_ms:g} after {self._time_ms:g} ms.")
        if (depth_mm is None) == (force_mn is None):
            raise InputError("A step needs either depth_mm or force_mn: give one of them.")
        model = self._model
        pose = finite("x_mm", x_mm, "mm"), finite("z_mm", z_mm, "mm"), finite("tilt_deg", tilt_deg, "degrees")
        weights = model.pose_weights((*pose, *self._shape))
        first_mm = float(weights @ model.first_touch_mm)
        totals, coefficients = weighted(weights, model.totals), weighted(weights, model.coefficients)
        follows = _Followed(model, totals[:, 0], self._springs, step_ms, np.hypot(*(self._way_mm - pose[:2])))
        if force_mn is None:
            below_mm = finite("depth_mm", depth_mm, "mm") - first_mm  # type: ignore[arg-type]
        else:
            wanted_mn = not_negative("force_mn", force_mn, "mN")
            below_mm = self._depth_of(
                wanted_mn,
                lambda at_mm: self._totals(at_mm, follows.terms(at_mm, follows.springs(at_mm)), totals)[0],
            )
        if below_mm > model.depth_mm * (1 + 1e-9):
            raise InputError(
                f"The indenter must stay within {model.depth_mm:g} mm below first touch, the range of this "
                f"reduced touch: got {below_mm:.4g} mm; solve the touch in full, or reduce it over a "
                "wider range."
            )
        springs = follows.springs(below_mm)
        terms = follows.terms(below_mm, springs)
        fields = self._fields(terms @ coefficients)
        corner, spacing = weights @ model.middle_mm - model.reach_mm, 2 * model.reach_mm / (GRID_POINTS - 1)
        n_quantities = len(model.quantities)
        at_receptors = read_local(fields, (self._receptors - corner) / spacing).reshape(
            len(terms), n_quantities, -1
        )
        # The first quantity stands for the pressure on the skin.
        at_sheet = read_local(fields[..., n_quantities::n_quantities], (self._sheet - corner) / spacing)
        scale = depth_scale(below_mm, model.depth_mm, model.exponents)
        factors, amplitude = filter_step(step_ms, model.times_ms), amplitudes(at_receptors[1:], model.squared)
        self._at_receptors = self._at_receptors.after(factors, amplitude * scale[:-1, None])
        self._at_sheet = self._at_sheet.after(factors, at_sheet * scale[-1])
        self._springs, self._way_mm, self._time_ms = springs, np.array(pose[:2]), time_ms
        loss = lost(amplitude, self._at_receptors.relaxed / scale[:-1, None], model.squared)
        values = np.maximum(at_receptors[0] - loss.sum(axis=0), 0.0)
        pressing, relaxed = at_sheet.sum(axis=1), self._at_sheet.relaxed.sum(axis=1)
        # A touch so light that its own relaxation is lost in that of an earlier one is not relaxed.
        tells = pressing * scale[-1] > LEAST_SHARE * relaxed
        self._share = np.divide(relaxed, pressing, out=np.zeros_like(relaxed), where=tells & (pressing > 0.0))
        force, area = self._totals(below_mm, terms, totals)
        self._largest = np.maximum(self._largest, [*values.max(axis=1, initial=0.0), force])
        errors = model.error * model.error_scale(self._largest)
        return ReducedSample(
            time_ms=time_ms,
            depth_mm=below_mm + first_mm,
            force_mn=force,
            contact_area_mm2=area,
            fields=dict(zip(model.quantities, values, strict=True)),
            force_error_mn=float(errors[-1]),
            field_errors=dict(zip(model.quantities, errors.tolist(), strict=False)),
        )

    def _fields(self, amounts: FloatArray) -> FloatArray:
        """Fields of the modes, (n_grid, n_grid, n * n_quantities): those of a point lie side by side."""
        found = (amounts @ self._modes).reshape(-1, GRID_POINTS, GRID_POINTS)
        return np.ascontiguousarray(np.moveaxis(found, 0, -1))

    def _totals(self, below_mm: float, terms: FloatArray, totals: FloatArray) -> tuple[float, float]:
        """Force and area, relaxed by the share of the skin below the contact."""
        model = self._model
        at_once, *relaxed = terms @ totals
        share = self._share / depth_scale(below_mm, model.depth_mm, model.exponents[-1])
        force, area = at_once - share @ np.array(relaxed).reshape(-1, 2)
        return max(float(force), 0.0), max(float(area), 0.0)

    def _depth_of(self, force_mn: float, force_at: Callable[[float], float]) -> float:
        """Depth below first touch at which the indenter presses with a force, relaxed as at the last step."""
        if force_mn <= 0.0:
            return 0.0
        deepest_mm = self._model.depth_mm
        if force_at(deepest_mm) < force_mn:
            return float("inf")
        return float(brentq(lambda at_mm: force_at(at_mm) - force_mn, 0.0, deepest_mm, xtol=CLOSEST_MM))


@dataclass(frozen=True)
class _Filters:
    """State of the filters of `relaxation` at some places: what has relaxed, and what drove it last."""

    relaxed: FloatArray
    before: FloatArray

    @classmethod
    def at_rest(cls, shape: tuple[int, ...]) -> _Filters:
        return cls(np.zeros(shape), np.zeros(shape))

    def after(self, factors: tuple[FloatArray, FloatArray, FloatArray], now: FloatArray) -> _Filters:
        """State after a step, by the factors of `filter_step`."""
        a, b, gamma = (each.reshape(-1, *[1] * (now.ndim - 1)) for each in factors)
        return _Filters(a * now + b * self.before + gamma * self.relaxed, now)


@dataclass(frozen=True)
class _Followed:
    """How the springs of `retreat` follow the indenter in one step, to any depth.

    `force_terms` (n_terms,) are the coefficients of the force at the pose, and `moved_mm` is the way aside.
    """

    model: ReducedModel
    force_terms: FloatArray
    before: Springs
    step_ms: float
    moved_mm: float

    @cached_property
    def _shares(self) -> FloatArray:
        """Part of the force that each branch relaxes in a long hold of the largest depth, (n_branches,)."""
        at_once, *relaxed = self.model.deepest_terms @ self.force_terms
        return np.array(relaxed) / at_once

    def springs(self, below_mm: float) -> Springs:
        """Springs at a depth below first touch."""
        kept = float(np.exp(-self.moved_mm / FORGETS_MM))
        way_mm = np.maximum(below_mm - self.model.levels_mm, 0.0)
        return self.before.followed(self.step_ms, way_mm, self.model.times_ms, self._shares, kept)

    def terms(self, below_mm: float, springs: Springs) -> FloatArray:
        """Factors of the terms there, (1 + n_branches, n_terms)."""
        way_mm = np.maximum(below_mm - self.model.levels_mm, 0.0)
        return self.model.terms(below_mm, springs.way_mm - way_mm)


@njit(cache=True, nogil=True)
def _weights(share):  # type: ignore[no-untyped-def]
    """Catmull-Rom's weights of the four points around a place, `share` of the way from the second."""
    s, s2, s3 = share, share * share, share * share * share
    return (
        0.5 * (-s3 + 2.0 * s2 - s), 0.5 * (3.0 * s3 - 5.0 * s2 + 2.0),
        0.5 * (-3.0 * s3 + 4.0 * s2 + s), 0.5 * (s3 - s2),
    )  # fmt: skip


@njit(cache=True, nogil=True)
def read_local(fields, places):  # type: ignore[no-untyped-def]
    """Read fields (n_grid, n_grid, n) at places (n_sites, 2) in steps of the grid; 0 outside of it.

    Returns
    -------
    array (n, n_sites)
    """
    last, n = fields.shape[0] - 1, fields.shape[2]
    found = np.zeros((len(places), n))
    for site in range(len(places)):
        u, v = places[site, 0], places[site, 1]
        if not (0.0 <= u <= last and 0.0 <= v <= last):
            continue
        i, j = min(int(u), last - 1), min(int(v), last - 1)
        along, across = _weights(u - i), _weights(v - j)
        here = found[site]
        for p in range(4):
            row = min(max(i + p - 1, 0), last)
            for q in range(4):
                weight, values = along[p] * across[q], fields[row, min(max(j + q - 1, 0), last)]
                for each in range(n):
                    here[each] += weight * values[each]
    return np.ascontiguousarray(found.T)
