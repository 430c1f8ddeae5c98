"""A touch, sample by sample: pose in, fields at the receptors, force and area out.

The filters of `model` act where the tissue is: each receptor relaxes by what has pressed it, so that an
indenter which slides meets skin that has not relaxed. For the force the same is true of the skin below the
contact; its share of relaxation is read from a sheet of further places.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numba import njit
from numpy.typing import ArrayLike
from scipy.optimize import brentq

from fingerpad.core.checked import checked_class, value_class
from fingerpad.core.displayed import Columns, Result
from fingerpad.core.errors import InputError
from fingerpad.core.units import with_unit
from fingerpad.core.values import Finite, FloatArray, Number, float_array, not_negative
from fingerpad.reduction.model import (
    GRID_POINTS,
    ReducedModel,
    Springs,
    amplitudes,
    depth_scale,
    filter_step,
    lost,
)
from fingerpad.reduction.training import weighted

SHEET_MM = 0.8  # Distance of the places that tell how far the skin below the contact has relaxed. [mm]
FORGETS_MM = 2.0  # Way of sliding over which the skin below the contact is replaced. [mm]
NEAR_MM = 0.03  # How far from the last depth that of a force is looked for first. [mm]
CLOSEST_MM = 1e-6  # Tolerance of the depth of a force. [mm]
MOST_SECANTS = 8  # Steps of the secant method before the depth of a force is looked for between two others.

LEAST_APART_MM = 1e-3
"""Distance of the first two depths of the secant method where the last step was shorter. [mm]"""


@value_class
class ReducedSample(Result):
    """A touch at one time."""

    time_ms: Number
    depth_mm: Number  #: Advance since first touch at the place of the touch. [mm]
    force_mn: Number  #: Force along the direction of pressing. [mN]
    contact_area_mm2: Number  #: Undeformed skin in contact. [mm²]
    fields: dict[str, FloatArray]  #: Quantities at the receptors, (n_receptors,). [each in its unit]
    force_error_mn: Number  #: The force of a full solution lies within it for 95 % of touches. [mN]
    field_errors: dict[str, float]  #: The same of each quantity, at all receptors. [its unit]

    def columns(self) -> Columns:
        """Each quantity, and the error within which that of a full solution lies, by receptor."""
        n_receptors = len(next(iter(self.fields.values())))
        errors = {f"{name}_error": np.full(n_receptors, error) for name, error in self.field_errors.items()}
        return {"receptor": np.arange(n_receptors), **self.fields, **errors}

    def __repr__(self) -> str:
        highest = (
            with_unit(f"{name} at most {values.max(initial=0.0):.3g}", name, " {}")
            for name, values in self.fields.items()
        )
        return (
            f"ReducedSample({self.time_ms:g} ms, {self.depth_mm:.3g} mm, {self.force_mn:.3g} ± "
            f"{self.force_error_mn:.1g} mN, {', '.join(highest)})"
        )


@checked_class
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
    """

    def __init__(self, model: ReducedModel, receptors_mm: ArrayLike, parameter: Finite | None = None):
        receptors = float_array("receptors_mm", receptors_mm, 2)
        if receptors.shape[1] != 2:
            raise InputError("receptors_mm", "needs columns x and z in mm", f"shape {receptors.shape}")
        shape = model.axes[3:]
        if bool(shape) != (parameter is not None):
            wanted = f"needs {shape[0].name} as parameter" if shape else "has no parameter of the indenter"
            raise InputError(f"This reduced touch {wanted}: got {parameter!r}.")
        self._model, self._shape = model, () if parameter is None else (parameter,)
        self._receptors, self._sheet = receptors, self._places_below()
        n_branches, n_quantities = model.times_ms.size, len(model.quantities)
        self._at_receptors = _Filters.at_rest((n_branches, n_quantities, len(receptors)))
        self._at_sheet = _Filters.at_rest((n_branches, len(self._sheet)))
        self._springs = Springs.at_rest(n_branches)
        self._time_ms, self._below_mm, self._further_mm, self._way_mm = 0.0, 0.0, 0.0, np.zeros(2)
        self._largest, self._modes = np.zeros(n_quantities + 1), model.modes.reshape(len(model.modes), -1)
        self.step(0.0, depth_mm=min(0.0, float(model.first_touch_mm.min())))

    def _places_below(self) -> FloatArray:
        """Places below all contacts of the range, (n, 2)."""
        model = self._model
        low, high = model.middle_mm.min(axis=0) - model.reach_mm, model.middle_mm.max(axis=0) + model.reach_mm
        x, z = (np.arange(a, b + SHEET_MM, SHEET_MM) for a, b in zip(low, high, strict=True))
        return np.column_stack([grid.ravel() for grid in np.meshgrid(x, z, indexing="ij")])

    def step(
        self,
        time_ms: Finite,
        depth_mm: Finite | None = None,
        force_mn: Finite | None = None,
        x_mm: Finite = 0.0,
        z_mm: Finite = 0.0,
        tilt_deg: Finite = 0.0,
    ) -> ReducedSample:
        """Go to a later time and pose, along a straight way, and return what is at the receptors then.

        Parameters
        ----------
        time_ms : float
            Not before the last step. [ms]
        depth_mm, force_mn : float
            Either the depth since first touch at the place of the touch, or the force. [mm, mN]
        x_mm, z_mm, tilt_deg : float
            The pose, as of a `Trajectory`.

        Raises
        ------
        InputError
            If the time goes back, neither or both of depth and force are given, or the pose lies out of the
            range; the state is then unchanged.
        """
        step_ms = time_ms - self._time_ms
        if step_ms < 0.0:
            raise InputError("time_ms", "must not go back", f"{time_ms:g} after {self._time_ms:g} ms")
        if (depth_mm is None) == (force_mn is None):
            raise InputError("A step needs either depth_mm or force_mn: give one of them.")
        model = self._model
        weights = model.pose_weights((x_mm, z_mm, tilt_deg, *self._shape))
        first_mm = float(weights @ model.first_touch_mm)
        corner_mm = weights @ model.middle_mm - model.reach_mm
        spacing_mm = 2 * model.reach_mm / (GRID_POINTS - 1)
        moved_mm = np.hypot(*(self._way_mm - [x_mm, z_mm]))
        press = _Press(
            model,
            totals=weighted(weights, model.totals),
            amounts=weighted(weights, model.coefficients),
            sheet_places=(self._sheet - corner_mm) / spacing_mm,
            springs=self._springs,
            sheet=self._at_sheet,
            kept=float(np.exp(-moved_mm / FORGETS_MM)),
            step_ms=step_ms,
        )
        if depth_mm is not None:
            below_mm = depth_mm - first_mm
        else:
            wanted_mn = not_negative("force_mn", force_mn, "mN")
            below_mm = press.depth_of(wanted_mn, self._below_mm, self._further_mm)
        if below_mm > model.depth_mm * (1 + 1e-9):
            raise InputError(
                f"The indenter must stay within {model.depth_mm:g} mm below first touch, the range of this "
                f"reduced touch: got {below_mm:.4g} mm; solve the touch in full, or reduce it over a "
                "wider range."
            )
        contact = press.to(below_mm)
        fields = fields_of(contact.terms @ press.amounts, self._modes)
        at_receptors = read_local(fields, (self._receptors - corner_mm) / spacing_mm)
        at_receptors = at_receptors.reshape(len(contact.terms), len(model.quantities), -1)
        scale = depth_scale(below_mm, model.depth_mm, model.exponents[:-1])[:, None]
        amplitude = amplitudes(at_receptors[1:], model.squared)
        self._at_receptors = self._at_receptors.after(press.factors, amplitude * scale)
        self._springs, self._at_sheet = contact.springs, contact.sheet
        self._further_mm = below_mm - self._below_mm
        self._way_mm, self._below_mm, self._time_ms = np.array([x_mm, z_mm]), below_mm, time_ms
        loss = lost(amplitude, self._at_receptors.relaxed / scale, model.squared)
        values = np.maximum(at_receptors[0] - loss.sum(axis=0), 0.0)
        self._largest = np.maximum(self._largest, [*values.max(axis=1, initial=0.0), contact.force_mn])
        errors = model.error * model.error_scale(self._largest)
        return ReducedSample(
            time_ms=time_ms,
            depth_mm=below_mm + first_mm,
            force_mn=contact.force_mn,
            contact_area_mm2=contact.area_mm2,
            fields=dict(zip(model.quantities, values, strict=True)),
            force_error_mn=float(errors[-1]),
            field_errors=dict(zip(model.quantities, errors.tolist(), strict=False)),
        )


@dataclass(frozen=True)
class _Filters:
    """State of the filters of `model` at some places: what has relaxed, and what drove it last."""

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
class _Contact:
    """Contact at the end of a step, and the state that it leaves."""

    terms: FloatArray
    springs: Springs
    sheet: _Filters
    force_mn: float
    area_mm2: float


@dataclass(frozen=True)
class _Press:
    """One step at a pose, to any depth."""

    model: ReducedModel
    totals: FloatArray  #: Coefficients of force and area at the pose, (n_terms, 2).
    amounts: FloatArray  #: Those of the modes, (n_terms, n_modes).
    sheet_places: FloatArray  #: Places of the sheet, in steps of the grid, (n_sheet, 2).
    springs: Springs
    sheet: _Filters  #: State before the step.
    kept: float  #: Part of the skin below the contact that is still there after the way aside.
    step_ms: float

    @cached_property
    def factors(self) -> tuple[FloatArray, FloatArray, FloatArray]:
        return filter_step(self.step_ms, self.model.times_ms)

    @cached_property
    def _shares(self) -> FloatArray:
        """Part of the force that each branch relaxes in a long hold of the largest depth, (n_branches,)."""
        at_once, *relaxed = self.model.deepest_terms @ self.totals[:, 0]
        return np.array(relaxed) / at_once

    def to(self, below_mm: float) -> _Contact:
        """Go to a depth below first touch."""
        model, way_mm = self.model, np.maximum(below_mm - self.model.levels_mm, 0.0)
        springs = self.springs.followed(self.step_ms, way_mm, model.times_ms, self._shares, self.kept)
        terms = model.terms(below_mm, springs.way_mm - way_mm)
        pressing = read_local(fields_of(terms[1:] @ self.amounts, model.pressures), self.sheet_places)
        scale = depth_scale(below_mm, model.depth_mm, model.exponents[-1])
        sheet = self.sheet.after(self.factors, scale * pressing)
        # What has relaxed elsewhere does not count for the force: only what has the shape of the pressure.
        square = (pressing**2).sum(axis=1)
        overlap = (sheet.relaxed * pressing).sum(axis=1)
        share = np.divide(overlap, scale * square, out=np.zeros_like(square), where=square > 0.0)
        at_once, *relaxed = terms @ self.totals
        force, area = at_once - share @ np.array(relaxed).reshape(-1, 2)
        return _Contact(terms, springs, sheet, max(float(force), 0.0), max(float(area), 0.0))

    def depth_of(self, force_mn: float, near_mm: float, further_mm: float) -> float:
        """Depth below first touch at which the indenter presses with a force; infinite beyond the range."""
        # It is looked for about `near_mm`, the depth before, and further on by as much as in the step before.

        def missing_mn(at_mm: float) -> float:
            return self.to(at_mm).force_mn - force_mn

        deepest_mm = self.model.depth_mm
        # The secant method usually ends after three depths; where it fails, two depths enclose the force.
        apart_mm = further_mm if abs(further_mm) > LEAST_APART_MM else LEAST_APART_MM
        last_mm, at_mm = near_mm + further_mm - apart_mm, near_mm + further_mm
        last_mn = missing_mn(last_mm)
        for _ in range(MOST_SECANTS if force_mn > 0.0 else 0):
            if not 0.0 < at_mm < deepest_mm:
                break
            now_mn = missing_mn(at_mm)
            if now_mn == last_mn:
                break
            last_mm, last_mn, at_mm = at_mm, now_mn, at_mm - now_mn * (at_mm - last_mm) / (now_mn - last_mn)
            if abs(at_mm - last_mm) <= CLOSEST_MM:
                return at_mm
        low, high = (min(max(near_mm + way_mm, 0.0), deepest_mm) for way_mm in (-NEAR_MM, NEAR_MM))
        if missing_mn(low) >= 0.0:
            low, high = 0.0, low
            # Skin that is still behind the indenter may press a little at depth 0.
            if missing_mn(low) >= 0.0:
                return low
        elif missing_mn(high) < 0.0:
            low, high = high, deepest_mm
            if missing_mn(high) < 0.0:
                return float("inf")
        return float(brentq(missing_mn, low, high, xtol=CLOSEST_MM))


def fields_of(amounts: FloatArray, modes: FloatArray) -> FloatArray:
    """Fields (n_grid, n_grid, n) of modes (n_modes, n_grid² or a multiple), those of a point side by side."""
    found = (amounts @ modes).reshape(-1, GRID_POINTS, GRID_POINTS)
    return np.ascontiguousarray(np.moveaxis(found, 0, -1))


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
    """Read fields (n_grid, n_grid, n) at places (n_sites, 2) in steps of the grid; 0 outside of it."""
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
