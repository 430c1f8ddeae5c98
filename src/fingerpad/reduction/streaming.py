"""A touch, sample by sample: pose in, fields at the receptors, force and area out.

The filters of `relaxation` act where the tissue is: each receptor relaxes by what has pressed it, so that an
indenter which slides meets skin that has not relaxed. For the force the same is true of the skin below the
contact; its share of relaxation is read from a sheet of further places.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numba import njit
from numpy.typing import ArrayLike

from fingerpad.core.checks import FloatArray, finite, float_array, instance, not_negative
from fingerpad.core.errors import InputError
from fingerpad.reduction.model import GRID_POINTS, ReducedModel
from fingerpad.reduction.relaxation import filter_step

SHEET_MM = 0.8
"""Distance of the places that tell how far the skin below the contact has relaxed. [mm]"""

LEAST_SHARE = 0.05
"""Least relaxation that the pose leads to, over that of the skin, from which it counts for the force."""

MOST_SECANTS = 40
"""Steps of the search for the depth of a force."""


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
        self._n_receptors = len(receptors)
        self._sites = np.vstack([receptors, self._sheet()])
        n_branches, n_quantities = model.times_ms.size, len(model.quantities)
        self._relaxed = np.zeros((n_branches, n_quantities, len(self._sites)))
        self._before = np.zeros_like(self._relaxed)
        self._time_ms = 0.0
        self._share = np.zeros(n_branches)
        self._largest = np.zeros(n_quantities + 1)
        self._flat_modes = model.modes.reshape(len(model.modes), -1)
        self.step(0.0, depth_mm=min(0.0, float(model.first_touch_mm.min())))

    def _sheet(self) -> FloatArray:
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
        totals = np.tensordot(weights, model.totals, 1)
        if force_mn is None:
            below_mm = finite("depth_mm", depth_mm, "mm") - first_mm  # type: ignore[arg-type]
        else:
            below_mm = self._depth_of(not_negative("force_mn", force_mn, "mN"), totals)
        if below_mm > model.depth_mm * (1 + 1e-9):
            raise InputError(
                f"The indenter must stay within {model.depth_mm:g} mm below first touch, the range of this "
                f"reduced touch: got {below_mm:.4g} mm; solve the touch in full, or reduce it over a "
                "wider range."
            )
        terms = model.terms(below_mm)
        by_mode = terms @ np.tensordot(weights, model.coefficients, 1)
        local = (by_mode @ self._flat_modes).reshape(
            len(terms), len(model.quantities), GRID_POINTS, GRID_POINTS
        )
        middle = weights @ model.middle_mm
        at_sites = read_local(
            local, (self._sites - middle + model.reach_mm) / (2 * model.reach_mm) * (GRID_POINTS - 1)
        )
        a, b, gamma = (each[:, None, None] for each in filter_step(step_ms, model.times_ms))
        self._relaxed = a * at_sites[1:] + b * self._before + gamma * self._relaxed
        self._before, self._time_ms = at_sites[1:], time_ms
        values = np.maximum(at_sites[0] - self._relaxed.sum(axis=0), 0.0)[:, : self._n_receptors]
        # The first quantity stands for the pressure on the skin.
        sheet = slice(self._n_receptors, None)
        pressing = at_sites[1:, 0, sheet].sum(axis=1)
        relaxed = self._relaxed[:, 0, sheet].sum(axis=1)
        # A touch so light that its own relaxation is lost in that of an earlier one is not relaxed.
        tells = pressing > LEAST_SHARE * relaxed
        self._share = np.divide(relaxed, pressing, out=np.zeros_like(relaxed), where=tells & (pressing > 0.0))
        force, area = self._totals(terms, totals)
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

    def _totals(self, terms: FloatArray, totals: FloatArray) -> tuple[float, float]:
        """Force and area, relaxed by the share of the skin below the contact."""
        at_once, *relaxed = terms @ totals
        force, area = at_once - self._share @ np.array(relaxed).reshape(-1, 2)
        return max(float(force), 0.0), max(float(area), 0.0)

    def _depth_of(self, force_mn: float, totals: FloatArray) -> float:
        """Depth below first touch at which the indenter presses with a force, relaxed as at the last step."""
        model = self._model
        if force_mn <= 0.0:
            return 0.0
        low, high = 0.0, model.depth_mm
        if self._totals(model.terms(high), totals)[0] < force_mn:
            return float("inf")
        for _ in range(MOST_SECANTS):
            middle = 0.5 * (low + high)
            if self._totals(model.terms(middle), totals)[0] < force_mn:
                low = middle
            else:
                high = middle
        return high


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
    """Read fields (n, m, n_grid, n_grid) at places (n_sites, 2) in steps of the grid; 0 outside of it."""
    last = fields.shape[2] - 1
    found = np.zeros((fields.shape[0], fields.shape[1], len(places)))
    for site in range(len(places)):
        u, v = places[site, 0], places[site, 1]
        if not (0.0 <= u <= last and 0.0 <= v <= last):
            continue
        i, j = min(int(u), last - 1), min(int(v), last - 1)
        along, across = _weights(u - i), _weights(v - j)
        for p in range(4):
            row = min(max(i + p - 1, 0), last)
            for q in range(4):
                column = min(max(j + q - 1, 0), last)
                weight = along[p] * across[q]
                for n in range(fields.shape[0]):
                    for m in range(fields.shape[1]):
                        found[n, m, site] += weight * fields[n, m, row, column]
    return found
