"""End organs at a depth, that of the living epidermis by default, below points of the skin or by x and z.

The sheet of living epidermis is one element thick and has rows along the finger and columns around it. The
coordinates (u, v) count them and are whole numbers at the middles of the elements. One cubic spline
interpolates all quantities over (u, v): the values f of the elements, their middles M, the points S of the
skin above them, and the points B of the epidermal-dermal border below. Because one spline serves all, values
that are linear in space are interpolated exactly.

- An end organ given by its x and z lies where M(u, v) has this x and z, on the volar side.
- A point of the skin has the (u, v) at which S(u, v) meets it. The end organ below lies where the normal n of
  the skin meets the border, S(u, v) - t n = B(u', v').

Its value is f(u, v) or f(u', v').

An end organ at another depth d lies at P = S(u, v) - d n, in one layer of tissue. The line along n crosses
the middles M_k of each sheet k of this layer at (u_k, v_k) and at the depth d_k. Its value is linear in depth
between the two f_k(u_k, v_k) that enclose d, and that of the nearest sheet beyond the first or last one. No
other layer is read, because SED jumps at borders; a depth on a border belongs to the layer above it.

Beyond the rim of the sheet the spline is continued: by mirroring where the body is halved, around it where it
is closed, through the pole at the tip, and otherwise along a straight line.

The spline is, with whole numbers u and v at the middles,

    f(u, v) = sum over i and j of b(u - i) b(v - j) c_ij,

where b is the cubic B-spline: for t within 0 ... 1 past a point, the coefficients at -1, 0, 1 and 2 have the
weights

    ((1 - t)^3,  4 - 6 t^2 + 3 t^3,  1 + 3 t + 3 t^2 - 3 t^3,  t^3)/6.

The coefficients c follow from the values f_ij (`coefficients`): the spline passes through all of them. It has
continuous slopes and curvatures, is exact for cubics and of fourth order. Source: de Boor 1978; Unser 1999.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property, partial
from typing import Any

import numpy as np
from numba import njit
from scipy.spatial import cKDTree

from fingerpad.core.errors import InputError
from fingerpad.core.threads import current_threads, in_blocks
from fingerpad.core.values import FloatArray, IntArray
from fingerpad.geometry.mesh import Mesh

Four = tuple[float, float, float, float]


def coefficients(values: FloatArray) -> FloatArray:
    """Coefficients of the spline through values on a grid.

    The influence of a value falls to 27 % from one point to the next. At the ends the slope is 0, so a grid
    is continued by some 20 points beyond the range of interest first.
    """
    n_rows, n_columns, n_quantities = values.shape
    found = np.array(values, dtype=np.float64, order="C")
    _solve_along(found.reshape(1, n_rows, n_columns * n_quantities))
    _solve_along(found)
    return found


@njit(cache=True, error_model="numpy", nogil=True)
def _solve_along(lines: FloatArray) -> None:
    """Solve (c_(i-1) + 4 c_i + c_(i+1))/6 = f_i along lines (n_sets, n_points, n_lines), in place."""
    # The slope is 0 at the ends. Gaussian elimination, point after point for all lines of a set.
    n_sets, n_points, n_lines = lines.shape
    upper = np.empty(n_points)
    upper[0] = 0.5
    for i in range(1, n_points):
        upper[i] = 1.0 / (4.0 - upper[i - 1])
    last = 1.0 / (4.0 - 2.0 * upper[n_points - 2])
    for k in range(n_sets):
        line = lines[k]
        for j in range(n_lines):
            line[0, j] *= 1.5
        for i in range(1, n_points - 1):
            for j in range(n_lines):
                line[i, j] = (6.0 * line[i, j] - line[i - 1, j]) * upper[i]
        for j in range(n_lines):
            line[-1, j] = (6.0 * line[-1, j] - 2.0 * line[-2, j]) * last
        for i in range(n_points - 2, -1, -1):
            for j in range(n_lines):
                line[i, j] -= upper[i] * line[i + 1, j]


@njit(cache=True, nogil=True)
def _weights(t: float) -> Four:
    square, cube, rest = t * t, t * t * t, (1.0 - t) ** 3
    return (
        rest / 6.0,
        (4.0 - 6.0 * square + 3.0 * cube) / 6.0,
        (1.0 + 3.0 * (t + square - cube)) / 6.0,
        cube / 6.0,
    )


@njit(cache=True, nogil=True)
def _slopes(t: float) -> Four:
    square = t * t
    return (-0.5 * (1.0 - t) ** 2, 1.5 * square - 2.0 * t, 0.5 + t - 1.5 * square, 0.5 * square)


@njit(cache=True, nogil=True)
def values_at(known: FloatArray, uv: FloatArray, padding: int) -> FloatArray:
    """Interpolate: values (n_places, n_quantities)."""
    found = np.zeros((len(uv), known.shape[2]))
    for n in range(len(uv)):
        row, column = math.floor(uv[n, 0]), math.floor(uv[n, 1])
        _add_near(
            known, row + padding - 1, column + padding - 1, _weights(uv[n, 0] - row),
            _weights(uv[n, 1] - column), found[n],
        )  # fmt: skip
    return found


@njit(cache=True, nogil=True)
def values_and_slopes_at(known: FloatArray, uv: FloatArray, padding: int) -> FloatArray:
    """Interpolate, and differentiate by u and by v: (3, n_places, n_quantities)."""
    found = np.zeros((3, len(uv), known.shape[2]))
    for n in range(len(uv)):
        row, column = math.floor(uv[n, 0]), math.floor(uv[n, 1])
        u, v = uv[n, 0] - row, uv[n, 1] - column
        along, around = _weights(u), _weights(v)
        first, at = row + padding - 1, column + padding - 1
        _add_near(known, first, at, along, around, found[0, n])
        _add_near(known, first, at, _slopes(u), around, found[1, n])
        _add_near(known, first, at, along, _slopes(v), found[2, n])
    return found


@njit(cache=True, nogil=True)
def _add_near(known: FloatArray, first: int, at: int, along: Four, around: Four, total: FloatArray) -> None:
    """Add up the 16 coefficients about a place, by their weights."""
    for i in range(4):
        near = known[first + i]
        a, b, c, d = near[at], near[at + 1], near[at + 2], near[at + 3]
        wa, wb, wc, wd = (
            along[i] * around[0], along[i] * around[1], along[i] * around[2], along[i] * around[3],
        )  # fmt: skip
        for k in range(total.size):
            total[k] = total[k] + wa * a[k] + wb * b[k] + wc * c[k] + wd * d[k]


_PADDING = 24
"""Rows and columns beyond the rim. The end of a spline acts 0.27 as strongly one element further on."""

_TIMES_PER_BLOCK = 64  # Times that one thread interpolates at once: their padded sheet stays in the cache.
_SITES_PER_BLOCK = 4096  # Sites that one thread locates at once.

_MOST_STEPS = 60
_LONGEST_STEP = 2.0  # elements
_EXACT_MM = 1e-9
_DIFFERENCE = 1e-4  # Step in u and v by which normals are differentiated.
_BEYOND_RIM = 0.9  # elements past the last middle that are tried; the mesh's bounds decide
_OFF_THE_SKIN = 0.25
"""How far beside the skin of the mesh a site may lie, over the size of its elements, which cut corners."""

_MIRROR = np.array([1.0, 1.0, -1.0])  # What the plane of symmetry, z = 0, does to a point.

Equations = Callable[[FloatArray, np.ndarray], tuple[FloatArray, FloatArray]]
"""From (u, v) of some sites (n, 2) and their numbers to the residual (n, 2) and its Jacobian."""

Surface = Callable[[FloatArray], FloatArray]
"""From (u, v) (n, 2) to points of a surface and their derivatives by u and by v, (3, n, 3)."""


@dataclass(frozen=True)
class Part:
    """Some of the end organs, and what they read in some of the elements."""

    elements: IntArray  #: Elements whose values `places` read.
    organs: IntArray | slice  #: Rows of the sites.
    places: Any  #: Places in these elements, of `ReceptorSheet.below` for example.
    weights: FloatArray | float  #: Share of these elements in the value of each end organ.


def refuse_beside_skin(sites_mm: FloatArray, missed: np.ndarray, away_mm: FloatArray) -> None:
    """Raise `InputError` for the first point (x, y, z) that was missed."""
    if missed.any():
        x, y, z = sites_mm[np.argmax(missed)]
        said = f"(x, y, z) = ({x:g}, {y:g}, {z:g}) mm is {away_mm[np.argmax(missed)]:.2g} mm beside it"
        raise InputError("sites", "must lie on the skin of the mesh", remedy=said)


def refuse_beside_volar_skin(organs_mm: FloatArray, missed: np.ndarray) -> None:
    """Raise `InputError` for the first place (x, z) that was missed."""
    if missed.any():
        x, z = organs_mm[np.argmax(missed)]
        said = f"(x, z) = ({x:g}, {z:g}) mm does not"
        raise InputError("sites", "must lie on the volar skin of the mesh", remedy=said)


def refuse_beside_tissue(sites_mm: FloatArray, depth_mm: FloatArray, missed: np.ndarray) -> None:
    """Raise `InputError` for the first depth that was missed."""
    if missed.any():
        place = ", ".join(f"{each:g}" for each in sites_mm[np.argmax(missed)])
        came = f"{depth_mm[np.argmax(missed)]:g} mm at ({place}) mm"
        raise InputError("depth_mm", "must lie in the tissue, between the skin and the bone", came)


def in_half(mesh: Mesh, sites_mm: FloatArray) -> FloatArray:
    """Sites, mirrored into the half that a mesh holds."""
    inside = sites_mm.copy()
    if not mesh.full:
        inside[:, -1] = np.abs(inside[:, -1])
    return inside


@dataclass(frozen=True)
class ReceptorSheet:
    """The elements just above the epidermal-dermal border, and coordinates on them."""

    mesh: Mesh

    def __post_init__(self) -> None:
        shape = self.mesh.living_epidermis.shape
        if 0 in shape:
            raise InputError("This mesh has no living epidermis: SED is sampled only in a layered finger.")
        if 1 in shape:
            raise InputError(f"Sampling needs two elements along and around, or more: got {shape}.")

    def below(self, sites_mm: FloatArray) -> FloatArray:
        """Find end organs below points of the skin (n, 3), or by their x and z on the volar side (n, 2)."""
        if sites_mm.shape[1] == 2:
            return self._facing_down(sites_mm, lambda uv, _: self._centre(uv))
        return self._below(self._above(sites_mm))

    def at(self, sites_mm: FloatArray, depth_mm: FloatArray) -> list[Part]:
        """Find end organs at a depth each, as of `below`."""
        if sites_mm.shape[1] == 3:
            uv = self._above(sites_mm)
        else:
            uv = self._facing_down(sites_mm, lambda uv, which: self._sunk(uv, depth_mm[which]))
        borders, layers = self._layers
        # Layers are offset from the skin by exact distances.
        layer = np.searchsorted(borders, depth_mm - _EXACT_MM)
        deepest = layer == len(borders)
        missed = deepest.copy()
        missed[deepest] = self._crossed(self._level(-1), uv[deepest])[1] < depth_mm[deepest] - _EXACT_MM
        parts: list[Part] = []
        for number in np.unique(layer):
            organs, sheets = np.flatnonzero(layer == number), layers[number]
            crossed = [self._crossed(self._middles_of(sheet), uv[organs]) for sheet in sheets]
            depths = np.stack([depth for _, depth, _ in crossed])
            for sheet, (places, _, lost), weights in zip(
                sheets, crossed, _enclosing(depths, depth_mm[organs]), strict=True
            ):
                some = weights > 0.0
                missed[organs[some & lost]] = True
                parts.append(Part(sheet.ravel(), organs[some], places[some], weights[some]))
        refuse_beside_tissue(sites_mm, depth_mm, missed)
        return [part for part in parts if len(part.places)]

    def _above(self, sites_mm: FloatArray) -> FloatArray:
        """(u, v) of points of the skin."""
        target = in_half(self.mesh, sites_mm)
        start = self._middles[_nearest(self._skin(self._middles)[0], target)]
        uv, missed = self._solve(lambda uv, which: _tangential(self._skin(uv), target[which]), start)
        point, *slopes = self._skin(uv)
        away = np.linalg.norm(point - target, axis=1)
        missed |= away > _OFF_THE_SKIN * np.linalg.norm(slopes, axis=2).max(axis=0)
        missed |= self._past_the_rim(target)
        refuse_beside_skin(sites_mm, missed, away)
        return uv

    def _facing_down(self, organs_mm: FloatArray, surface: Callable[..., FloatArray]) -> FloatArray:
        """(u, v) at which a surface has some x and z, on the volar side."""
        target = in_half(self.mesh, organs_mm)
        volar = self._middles[self._volar.ravel()]
        start = volar[_nearest(self._centre(volar)[0][:, [0, 2]], target)]
        uv, missed = self._solve(lambda uv, which: _projected(surface(uv, which), target[which]), start)
        missed |= self._turn(uv) * self._volar_sign <= 0.0
        missed |= self._past_the_rim(target)
        refuse_beside_volar_skin(organs_mm, missed)
        return uv

    def read(self, uv: FloatArray, values: FloatArray) -> FloatArray:
        def at_times(times: slice) -> FloatArray:
            some = np.asarray(values[times], dtype=np.float64).T
            known = some.reshape(*self.mesh.living_epidermis.shape, -1)
            # At the pole, where all columns meet, they agree on their mean.
            return values_at(self._control(known, 1.0, known[-1].mean(axis=0)), uv, _PADDING).T

        return np.vstack(in_blocks(at_times, len(values), _TIMES_PER_BLOCK))

    def _below(self, uv: FloatArray) -> FloatArray:
        """Where the normal of the skin at (u, v) meets the border, S - t n = B(u', v')."""
        normal, skin = self._outward(uv), self._skin(uv)[0]
        t = ((skin - self._border(uv)[0]) * normal).sum(axis=1, keepdims=True)
        target = skin - t * normal
        return self._solve(lambda uv, which: _tangential(self._border(uv), target[which]), uv)[0]

    def _sunk(self, uv: FloatArray, depth_mm: FloatArray) -> FloatArray:
        """Points at depths below the skin along its normal, and their derivatives, as of `Surface`."""

        def at(uv: FloatArray) -> FloatArray:
            return self._skin(uv)[0] - depth_mm[:, None] * self._outward(uv)

        by_u, by_v = (at(uv + step) - at(uv - step) for step in 0.5 * _DIFFERENCE * np.eye(2))
        return np.stack([at(uv), by_u / _DIFFERENCE, by_v / _DIFFERENCE])

    def _crossed(self, surface: Surface, uv: FloatArray) -> tuple[FloatArray, FloatArray, np.ndarray]:
        """Where the normals of the skin at (u, v) cross a surface, at which depth, and which do not."""
        skin, *slopes = self._skin(uv)
        tangents, normal = np.stack(slopes, axis=1), self._outward(uv)
        found, missed = self._solve(
            lambda uv, which: _tangential(surface(uv), skin[which], tangents[which]), uv
        )
        return found, ((skin - surface(found)[0]) * normal).sum(axis=1), missed

    @cached_property
    def _layers(self) -> tuple[FloatArray, list[list[IntArray]]]:
        """Depths of the borders between layers, and the sheets of each layer, from the skin inwards. [mm]"""
        mesh, n_through = self.mesh, self.mesh.shape[2]
        numbers = np.arange(len(mesh.elements)).reshape(mesh.shape)
        levels = np.flatnonzero(np.diff(mesh.layer[:n_through])) + 1
        # Where the skin turns sharply, columns are inclined and longer.
        borders = mesh.node_depth_mm[mesh.grid[:, :, levels]].min(axis=(0, 1))
        return borders, [[numbers[:, :, k] for k in each] for each in np.split(np.arange(n_through), levels)]

    def _solve(self, equations: Equations, start: FloatArray) -> tuple[FloatArray, np.ndarray]:
        """(u, v) of every site by Newton's method, and whether it did not converge, bool (n,)."""

        def block(sites: slice) -> tuple[FloatArray, np.ndarray]:
            return self._newton(lambda uv, which: equations(uv, sites.start + which), start[sites])

        uv, missed = zip(*in_blocks(block, max(len(start), 1), _SITES_PER_BLOCK), strict=True)
        return np.concatenate(uv), np.concatenate(missed)

    def _newton(self, equations: Equations, start: FloatArray) -> tuple[FloatArray, np.ndarray]:
        uv = start.copy()
        open_sites = np.arange(len(uv))
        for _ in range(_MOST_STEPS):
            excess, jacobian = equations(uv[open_sites], open_sites)
            unsolved = ~(np.abs(excess).max(axis=1) < _EXACT_MM)
            open_sites, excess, jacobian = open_sites[unsolved], excess[unsolved], jacobian[unsolved]
            if not open_sites.size:
                break
            (a, b), (c, d) = np.moveaxis(jacobian, 0, -1)
            determinant = np.where(a * d == b * c, np.inf, a * d - b * c)
            e, f = excess.T
            step = np.stack([b * f - d * e, c * e - a * f], axis=1) / determinant[:, None]
            step *= np.minimum(1.0, _LONGEST_STEP / np.maximum(np.abs(step).max(axis=1), 1e-300))[:, None]
            uv[open_sites] = self._kept(uv[open_sites] + step)
        missed = np.zeros(len(uv), dtype=bool)
        missed[open_sites] = True
        return uv, missed

    def _kept(self, uv: FloatArray) -> FloatArray:
        """(u, v) moved onto the sheet: to its rim, around the finger, or through the pole."""
        (first_u, last_u), (first_v, last_v) = self._limits
        u, v = uv.T
        if self._ends_in_pole:
            beyond, n_around = u > last_u, self.mesh.living_epidermis.shape[1]
            opposite = v + 0.5 * n_around if self._closed else n_around - 1.0 - v
            u, v = np.where(beyond, 2.0 * last_u - u, u), np.where(beyond, opposite, v)
        v = v % last_v if self._closed else np.clip(v, first_v, last_v)
        return np.stack([np.clip(u, first_u, last_u), v], axis=1)

    @cached_property
    def _limits(self) -> tuple[tuple[float, float], tuple[float, float]]:
        """Smallest and largest u and v: half an element past the last middle at a mirror or pole."""
        # Where elements grow towards a rim, it lies a little more than half a step beyond the last middle.
        n_along, n_around = self.mesh.living_epidermis.shape
        if self._closed:
            around = 0.0, float(n_around)
        else:
            first, last = (0.5 if mirrored else _BEYOND_RIM for mirrored in self._mirrors)
            around = -first, n_around - 1.0 + last
        return (-_BEYOND_RIM, n_along - 1.0 + (0.5 if self._ends_in_pole else _BEYOND_RIM)), around

    def _past_the_rim(self, sites_mm: FloatArray) -> np.ndarray:
        """Whether sites lie beyond the cut, or beside a body that is open to its sides, bool (n,)."""
        skin = self.mesh.nodes_mm[self.mesh.skin_nodes]
        beyond = skin[:, 0].min() - sites_mm[:, 0]
        if not self._ends_in_pole:
            beyond = np.maximum(beyond, sites_mm[:, 0] - skin[:, 0].max())
        if not (self._closed or all(self._mirrors)):
            z = sites_mm[:, -1]
            beyond = np.maximum(beyond, np.maximum(skin[:, 2].min() - z, z - skin[:, 2].max()))
        return beyond > _EXACT_MM

    @cached_property
    def _closed(self) -> bool:
        grid = self.mesh.skin_grid
        return bool((grid[:, 0] == grid[:, -1]).all())

    @cached_property
    def _ends_in_pole(self) -> bool:
        """Whether all columns end in one node."""
        return bool((self.mesh.skin_grid[-1] == self.mesh.skin_grid[-1, 0]).all())

    @cached_property
    def _mirrors(self) -> tuple[bool, bool]:
        """Whether the body is halved along the first and along the last column."""
        first, last = (
            bool(np.isin(self.mesh.skin_grid[:, column], self.mesh.symmetry_nodes).all())
            for column in (0, -1)
        )
        return first, last

    @cached_property
    def _middles(self) -> FloatArray:
        return np.argwhere(np.full(self.mesh.living_epidermis.shape, True)).astype(np.float64)

    @cached_property
    def _volar(self) -> np.ndarray:
        """Whether an element lies on the volar side: its upper face looks towards y < 0, bool (n, m)."""
        corners = self.mesh.nodes_mm[self.mesh.elements[self.mesh.living_epidermis]]
        normal = np.cross(corners[:, :, 6] - corners[:, :, 4], corners[:, :, 7] - corners[:, :, 5])
        return normal[..., 1] < 0.0

    @cached_property
    def _volar_sign(self) -> float:
        """Sign of the determinant of (x, z) by (u, v) on the volar side."""
        middles = self._middles[self._volar.ravel()]
        return float(np.sign(np.median(self._turn(middles))))

    def _turn(self, uv: FloatArray) -> FloatArray:
        """Return the determinant of (x, z) by (u, v), (n,); its sign differs on the volar and dorsal side."""
        _, by_u, by_v = self._centre(uv)
        return by_u[:, 0] * by_v[:, 2] - by_u[:, 2] * by_v[:, 0]

    def _padded_points(self, through: int) -> FloatArray:
        """Middles of the faces of one level of the grid, lifted onto the surface of its nodes, padded."""
        # The middle of a face's corners lies below that surface. Cubics through four nodes, along and around
        # the finger, give the distance.
        nodes = self.mesh.nodes_mm[self.mesh.grid[:, :, through]]
        middles = 0.25 * (nodes[:-1, :-1] + nodes[1:, :-1] + nodes[1:, 1:] + nodes[:-1, 1:])
        tall = np.concatenate([2 * nodes[:1] - nodes[1:2], nodes, 2 * nodes[-1:] - nodes[-2:-1]])
        along, around = _bulge(tall, 0), _bulge(self._wider(nodes), 1)
        bulge = (0.5 * around[:-1] + 0.5 * around[1:]) + (0.5 * along[:, :-1] + 0.5 * along[:, 1:])
        normal = np.cross(nodes[1:, 1:] - nodes[:-1, :-1], nodes[:-1, 1:] - nodes[1:, :-1])
        normal /= np.linalg.norm(normal, axis=2, keepdims=True)
        # The middle moves along the normal only.
        middles += (bulge * normal).sum(axis=2, keepdims=True) * normal
        return self._control(middles, _MIRROR, nodes[-1, 0])

    def _wider(self, nodes: FloatArray) -> FloatArray:
        if self._closed:
            return np.concatenate([nodes[:, -2:-1], nodes, nodes[:, 1:2]], axis=1)
        ends = [
            _MIRROR * inner if mirrored else 2.0 * end - inner
            for (end, inner), mirrored in zip(
                ((nodes[:, :1], nodes[:, 1:2]), (nodes[:, -1:], nodes[:, -2:-1])), self._mirrors, strict=True
            )
        ]
        return np.concatenate([ends[0], nodes, ends[1]], axis=1)

    @cached_property
    def _skin(self) -> Surface:
        return self._level(0)

    def _level(self, through: int) -> Surface:
        """Points of one level of the grid's nodes."""
        return _surface(self._padded_points(through))

    @cached_property
    def _centre(self) -> Surface:
        return self._middles_of(self.mesh.living_epidermis)

    def _middles_of(self, sheet: IntArray) -> Surface:
        """Points of the surface through the middles of a sheet of elements."""
        centres = self.mesh.nodes_mm[self.mesh.elements[sheet]].mean(axis=2)
        pole = centres[-1].mean(axis=0) * [1.0, 1.0, float(self.mesh.full)]
        return _surface(self._control(centres, _MIRROR, pole))

    @cached_property
    def _border(self) -> Surface:
        """Points B of the border, where the sheet's elements begin."""
        lower = self.mesh.elements[self.mesh.living_epidermis[0, 0], 0]
        return self._level(int(np.flatnonzero(self.mesh.grid[0, 0] == lower)[0]))

    def _outward(self, uv: FloatArray) -> FloatArray:
        point, by_u, by_v = self._skin(uv)
        normal = np.cross(by_u, by_v)
        inside_out = ((point - self._border(uv)[0]) * normal).sum(axis=1, keepdims=True) < 0.0
        return np.where(inside_out, -1.0, 1.0) * normal / np.linalg.norm(normal, axis=1, keepdims=True)

    def _control(self, known: FloatArray, mirror: float | FloatArray, pole: FloatArray) -> FloatArray:
        """Coefficients of the spline through (n_along, n_around, k), continued beyond its rim."""
        first, last = (True, True) if self._closed else self._mirrors
        around = known
        if not first:
            around = np.concatenate([_straight_on(around, 1, 0, axis=1)[:, ::-1], around], axis=1)
        if not last:
            around = np.concatenate([around, _straight_on(around, -2, -1, axis=1)], axis=1)
        n_around = around.shape[1]
        steps = np.arange(-_PADDING if first else 0, n_around + (_PADDING if last else 0))
        turns, steps = np.divmod(steps, n_around)
        odd = (turns % 2 == 1) & (not self._closed)
        rows = around[:, np.where(odd, n_around - 1 - steps, steps)]
        rows[:, odd] *= mirror
        if self._ends_in_pole:
            end = 2.0 * pole - rows[np.maximum(len(known) - 1 - np.arange(_PADDING), 0)]
        else:
            end = _straight_on(rows, -2, -1, axis=0)
        return coefficients(np.concatenate([_straight_on(rows, 1, 0, axis=0)[::-1], rows, end]))


def _surface(control: FloatArray) -> Surface:
    return partial(values_and_slopes_at, control, padding=_PADDING)


def _nearest(points: FloatArray, targets: FloatArray) -> IntArray:
    found: IntArray = cKDTree(points).query(targets, workers=current_threads())[1]
    return found


def _bulge(nodes: FloatArray, axis: int) -> FloatArray:
    """How far a cubic through four nodes in a row passes beside the middle of the inner two."""
    first, second, third, fourth = (np.moveaxis(nodes, axis, 0)[k : k - 3 or None] for k in range(4))
    return np.moveaxis((second + third - first - fourth) / 16.0, 0, axis)


def _straight_on(values: FloatArray, inner: int, outer: int, axis: int) -> FloatArray:
    """Continue rows or columns of (n_along, n_around, k) along a line through two of them, by `_PADDING`."""
    before, end = (np.take(values, [which], axis) for which in (inner, outer))
    return end + np.arange(1.0, _PADDING + 1).reshape((-1, 1, 1)[: 3 - axis]) * (end - before)


def _enclosing(depths: FloatArray, depth: FloatArray) -> FloatArray:
    """Weights (m, n) of sheets at increasing depths (m, n): linear in between, the nearest sheet beyond."""
    last, organs = len(depths) - 1, np.arange(depth.size)
    upper = np.clip((depths < depth).sum(axis=0) - 1, 0, last)
    lower = np.minimum(upper + 1, last)
    gap = depths[lower, organs] - depths[upper, organs]
    share = np.clip((depth - depths[upper, organs]) / np.where(gap > 0.0, gap, np.inf), 0.0, 1.0)
    weights = np.zeros_like(depths)
    weights[upper, organs] = 1.0 - share
    weights[lower, organs] += share
    return weights


def _tangential(
    surface: FloatArray, target: FloatArray, tangents: FloatArray | None = None
) -> tuple[FloatArray, FloatArray]:
    """Distance from a target along both tangents, by default those of a surface, and its Jacobian."""
    # The Jacobian is taken at fixed tangents.
    point, *slopes = surface
    slope = np.stack(slopes, axis=1)
    tangent = slope if tangents is None else tangents
    tangent = tangent / np.linalg.norm(tangent, axis=2, keepdims=True)
    excess = (tangent * (point - target)[:, None]).sum(axis=2)
    return excess, np.einsum("nik,njk->nij", tangent, slope)


def _projected(surface: FloatArray, target: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Distance from a target (n, 2) in x and z, and its Jacobian."""
    point, *slopes = surface[..., [0, 2]]
    return point - target, np.stack(slopes, axis=2)
