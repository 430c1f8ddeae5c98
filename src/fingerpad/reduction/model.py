"""A reduced touch: fields of full presses about each pose, as modes with coefficients.

At every training pose the response at once Y and what each branch relaxes D_i (see below) are
polynomials in sqrt(d / d_max) of the depth d below first touch: force and contact grow smoothly with it.
Their coefficients follow from all samples of the presses there by least squares. Fields are sampled about the
middle of the contact, so that they differ little from pose to pose, and are kept as the modes of their
singular value decomposition. Files hold arrays without code, a version and a checksum.

A response to a pose relaxes by one first-order filter per time constant of the tissues. Each branch i of
the tissues' Prony series has relaxed a stress S_i away (`fingerpad.mechanics.viscoelastic`) that follows
tau_i dS_i/dt = g_i S0 - S_i. While the deformation follows the pose p alone, any quantity that is linear in
the stress therefore is

    y(t) = Y(p(t)) - sum_i m_i(t),    tau_i dm_i/dt = D_i(p(t)) - m_i,

with Y the response at once and D_i what branch i relaxes in a long hold of the pose. As in the full solver,
D_i is linear within a step, and then the steps are exact. Two corrections matter
(docs/decisions/reduced-touch.md):

- The stored energy is quadratic. Each branch holds an energy E_i = r_i^2 of a strain r_i, so r_i is filtered,
  and the branch has lost r_i^2 - (r_i - m_i)^2.
- Stress that relaxed at one depth counts less when the indenter has gone deeper, and more when it has come
  back: m_i filters s(d) D_i and counts as m_i / s(d), with s a power of the depth. At one depth s cancels.

`Springs` are for contact that retreats: skin that has relaxed stays behind the indenter. On the way down,
each ring of skin meets the indenter at a level e of the depth below first touch and follows it from then on.
A response Y(d) to the depth d is therefore that of springs, one per level, of the ways u_e = d - e (method of
dimensionality reduction: Popov & Hess, Method of Dimensionality Reduction in Contact Mechanics and Friction,
2015):

    Y(d) = sum_e s_e u_e,    s_e the change of the slope of Y at e.

Each spring relaxes as the force does: it presses with f_e = u_e - sum_i m_ie, where branch i of the tissues
filters g_i u_e. On the way up it follows the indenter while f_e > 0. Then it is free and recovers with f_e =
0, until the indenter meets it again. While no spring is free this changes nothing.
"""

from __future__ import annotations

import hashlib
import io
import json
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from functools import cached_property
from pathlib import Path

import numpy as np

from fingerpad.core.checked import checked, value_class
from fingerpad.core.errors import InputError
from fingerpad.core.files import check_file, path_of, write_atomically
from fingerpad.core.signals import STORED_ENERGY
from fingerpad.core.values import Finite, FloatArray, Many, Pair
from fingerpad.reduction.training import Axis, chebyshev_points, lagrange
from fingerpad.skin.indentation import Touch
from fingerpad.skin.store import value_digest

AT_ONCE, RELAXED = 14, 4  # Degree in sqrt(depth) of the response at once and of what relaxes.
GRID_POINTS = 41  # Points of the local fields along and across.

ERROR_FLOOR = 0.05
"""Part of the largest values of the training that errors are relative to in a touch that is still light."""

ON_THE_PAD = 0.85
"""Share of the half-width of the finger within which fields are sampled; they are continued beyond it."""


def depth_basis(depth_mm: FloatArray, deepest_mm: float, degree: int) -> FloatArray:
    """Polynomials in sqrt(d / d_max) that vanish at d = 0, (..., degree); 0 without contact."""
    share = np.sqrt(np.maximum(depth_mm, 0.0) / deepest_mm)
    return lagrange(chebyshev_points(degree + 1), share)[..., 1:] * (np.asarray(depth_mm) > 0.0)[..., None]


def filter_step(step_ms: float, times_ms: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Factors a, b and gamma of m = a D + b D_before + gamma m_before, (n_branches,) each."""
    if step_ms == 0.0:
        return np.zeros(times_ms.size), np.zeros(times_ms.size), np.ones(times_ms.size)
    gamma = np.exp(-step_ms / times_ms)
    average = times_ms / step_ms * (1.0 - gamma)
    return 1.0 - average, average - gamma, gamma


SHALLOWEST = 0.4  # Share of the largest depth up to which what has relaxed counts alike.


def depth_scale(depth_mm: float, deepest_mm: float, exponents: FloatArray) -> FloatArray:
    """Scale s of what relaxes at a depth, of the shape of the exponents; 1 at the largest depth."""
    return np.asarray(max(depth_mm / deepest_mm, SHALLOWEST) ** exponents)


def amplitudes(values: FloatArray, squared: FloatArray) -> FloatArray:
    """Return what relaxes linearly: values, or roots of those that are squares, (..., n_quantities, n)."""
    found = values.copy()
    found[..., squared, :] = np.sqrt(np.maximum(values[..., squared, :], 0.0))
    return found


def lost(amplitude: FloatArray, relaxed: FloatArray, squared: FloatArray) -> FloatArray:
    """Values that are lost when amplitudes have relaxed by `relaxed`, (..., n_quantities, n)."""
    found = relaxed.copy()
    found[..., squared, :] *= 2.0 * amplitude[..., squared, :] - relaxed[..., squared, :]
    return found


LEVELS = 48


def levels_mm(deepest_mm: float) -> FloatArray:
    """Levels of the springs, (LEVELS,), denser where contact begins. [mm]"""
    return np.asarray(deepest_mm * (np.arange(LEVELS) / LEVELS) ** 1.5)


def slope_changes(levels: FloatArray, deepest_mm: float, values: FloatArray) -> FloatArray:
    """Weights s_e of the springs, (n_levels, n), of functions with values (n_levels + 1, n).

    The values are those at the levels and at the largest depth; between them the functions are linear.
    """
    slopes = np.diff(values, axis=0) / np.diff(np.append(levels, deepest_mm))[:, None]
    return np.diff(slopes, axis=0, prepend=0.0)


@dataclass(frozen=True)
class Springs:
    """Ways of the springs, and what their branches have relaxed."""

    way_mm: FloatArray  #: u, at most 0 before the first touch of a level, (n_levels,). [mm]
    relaxed_mm: FloatArray  #: m, (n_branches, n_levels). [mm]

    @classmethod
    def at_rest(cls, n_branches: int) -> Springs:
        """Springs that nothing has touched."""
        return cls(np.zeros(LEVELS), np.zeros((n_branches, LEVELS)))

    def followed(
        self,
        step_ms: float,
        followed_mm: FloatArray,
        times_ms: FloatArray,
        shares: FloatArray,
        kept: float = 1.0,
    ) -> Springs:
        a, b, gamma = (each[:, None] for each in filter_step(step_ms, times_ms))
        known = kept * (b * shares[:, None] * self.way_mm + gamma * self.relaxed_mm)
        now = a * shares[:, None]
        free_mm = known.sum(axis=0) / (1.0 - now.sum())
        way_mm = np.maximum(followed_mm, free_mm)
        return Springs(way_mm, now * way_mm + known)


@value_class
class ReducedModel:
    """What a reduced touch is evaluated from, of `reduce_touch` or `read_reduced`."""

    axes: Many[Axis]  #: Axes of the range: x, z, tilt and perhaps a parameter of the indenter.
    depth_mm: Finite  #: Largest depth below first touch. [mm]
    at_mm: Pair  #: Place of the touch. [mm]
    times_ms: FloatArray  #: Time constants of the tissues, (n_branches,). [ms]
    quantities: Many[str]  #: Quantities of the fields, names of `SkinResponse.sample`.
    first_touch_mm: FloatArray  #: Depth of first touch at each pose, (n_poses,). [mm]
    middle_mm: FloatArray  #: x and z of the middle of the contact, (n_poses, 2). [mm]
    totals: FloatArray
    """Coefficients of the force [mN] and of the contact area [mm²], (n_poses, n_terms, 2).

    The terms are those of the response at once, then those of each branch."""
    coefficients: FloatArray  #: Coefficients of the modes, (n_poses, n_terms, n_modes).
    modes: FloatArray
    """Fields about the middle of the contact, (n_modes, n_quantities, n_grid, n_grid). [each in its unit]"""
    reach_mm: FloatArray  #: Half-extent of the fields along and across, (2,). [mm]
    largest: FloatArray
    """Largest values of the quantities [each in its unit] and of the force [mN] in the training,
    (n_quantities + 1,)."""
    error: FloatArray
    """Errors that 95 % of new touches stay within, all of them together, over `error_scale` (see `building`),
    (n_quantities + 1,). Infinite before that is measured."""
    exponents: FloatArray
    """Powers of the depth that scale what has relaxed, of quantities and force, (n_quantities + 1,)."""
    origin: Mapping[str, str]  #: What was pressed: for people, and to refuse another finger.

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
        """Which quantities are squares of what relaxes linearly, as energy is of strain, (n_quantities,)."""
        return np.array([quantity == STORED_ENERGY for quantity in self.quantities])

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
        """Factors of the terms at a depth, at once and of each branch; skin of each level stays behind."""
        once_of, relaxed_of = self._slope_changes
        depth = np.array(depth_mm)
        found = np.zeros((1 + self.times_ms.size, AT_ONCE + RELAXED * self.times_ms.size))
        found[0, :AT_ONCE] = depth_basis(depth, self.depth_mm, AT_ONCE) + behind_mm @ once_of
        relaxed = depth_basis(depth, self.depth_mm, RELAXED) + behind_mm @ relaxed_of
        for branch in range(self.times_ms.size):
            start = AT_ONCE + RELAXED * branch
            found[1 + branch, start : start + RELAXED] = relaxed
        return found


def origin_of(touch: Touch) -> dict[str, str]:
    """Tell what a model is made of: its indenter in words, and digests of finger and tissues."""
    return {
        "indenter": str(touch.indenter),
        "finger": value_digest(touch.finger),
        "tissues": value_digest(touch.tissues),
    }


FORMAT = "fingerpad reduced touch"
VERSION = 2
LARGEST_MB = 1000.0
AGAIN = "make it again with `fingerpad reduce`"

HEAD = ("depth_mm", "at_mm", "quantities", "origin")
ARRAYS = tuple(name for name, hint in ReducedModel.__annotations__.items() if hint == "FloatArray")
"""Fields in the head of a file, beside the axes, and its arrays."""


@checked
def write_reduced(model: ReducedModel, path: str | Path) -> None:
    """Write a reduced touch, as a whole or not at all."""
    head = {"format": FORMAT, "version": VERSION, "axes": [asdict(axis) for axis in model.axes]}
    head |= {name: getattr(model, name) for name in HEAD}
    arrays = {name: np.ascontiguousarray(getattr(model, name), dtype=np.float64) for name in ARRAYS}
    text = json.dumps(head, sort_keys=True)
    named = {"head": np.array(text), "checksum": np.array(_checksum(text, arrays))} | arrays
    buffer = io.BytesIO()
    np.savez_compressed(buffer, **named)  # type: ignore[arg-type]
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
        said = str(error.strerror or error)
        raise InputError(path, "must be a file that can be read", remedy=said) from error
    except Exception as error:  # a file of unknown content may fail in any way
        remedy = f"it is another file, or was cut short; {AGAIN}"
        raise InputError(path, "must be a whole file of a reduced touch", remedy=remedy) from error
    if found != (FORMAT, VERSION):
        came = f"{found[0]!r} of version {found[1]!r}"
        raise InputError(path, f"must be a {FORMAT} of version {VERSION}", came, AGAIN)
    if checksum != _checksum(text, arrays):
        raise InputError(f"{path} is damaged: its checksum is wrong; {AGAIN}.")
    if touch is not None:
        for name, value in origin_of(touch).items():
            if name != "indenter" and head["origin"][name] != value:
                raise InputError(f"{path} was made with another {name}: make it again with this one.")
    axes = tuple(Axis(**axis) for axis in head["axes"])
    return ReducedModel(axes=axes, **{name: head[name] for name in HEAD}, **arrays)


def _checksum(head: str, arrays: dict[str, np.ndarray]) -> str:
    digest = hashlib.sha256(head.encode())
    for name in ARRAYS:
        digest.update(repr(arrays[name].shape).encode())
        digest.update(np.ascontiguousarray(arrays[name]).tobytes())
    return digest.hexdigest()
