"""Errors of the meshes of the paper's finger against finer ones: strain energy density (SED) and rates.

The same bars and spheres are indented on a family of meshes. The afferent is the same on each, so that
differences in rates are errors of the mesh.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from scipy.optimize import brentq

from fingerpad.core.checked import result_class
from fingerpad.core.errors import InputError
from fingerpad.core.values import FloatArray, Number, Vector, float_array, positive
from fingerpad.data import bar_firing_rates, protocol, psychophysics
from fingerpad.experiments.conditions import CURVATURES, POSITIONS_MM, RECEPTOR_X_MM, Conditions
from fingerpad.experiments.runner import Runner
from fingerpad.geometry.grading import Grading
from fingerpad.inference.fitting.methods import fractional_sum_of_squares
from fingerpad.neuron.afferent import Afferent
from fingerpad.neuron.population import Population
from fingerpad.neuron.spikes import firing_rate_hz
from fingerpad.report.tables import fixed, number
from fingerpad.skin.code_hash import code_hash
from fingerpad.skin.indentation import Touch
from fingerpad.skin.sampling import SkinResponse
from studies.pages import joined, share, table

TISSUES = "trial3"
Sphere = tuple[float, float]
"""Position along the finger [mm] and curvature [1/m]."""

SHIFTS_MM = protocol.BAR_SHIFTS.value
CHOSEN_SHIFTS = tuple(
    SHIFTS_MM.index(shift) for shift in (-2.5, -1.9, -1.5, -1.3, -1.1, -0.9, -0.1, 0.9, 1.1, 1.3, 1.5, 1.7)
)
"""Shifts for meshes that take minutes a press: flanks and peak at both edges, centre and far side."""

CHOSEN_SPHERES: tuple[Sphere, ...] = tuple(
    (0.0, curvature)
    for curvature in (protocol.STANDARD_CURVATURE.value, *psychophysics.GOODWIN_CURVATURES.value)
)
EVERY_SPHERE: tuple[Sphere, ...] = tuple(
    (position, curvature) for position in POSITIONS_MM for curvature in CURVATURES
)
LOWEST_ORDER, HIGHEST_ORDER = 0.3, 6.0
"""A quantity that converges slower or faster is not taken to converge at all on these meshes."""


@dataclass(frozen=True)
class Level:
    """One mesh and what is pressed into it: shifts of the bar and spheres.

    The factor makes the elements of the resolution smaller, see `refined`.
    """

    name: str
    resolution: str
    factor: float = 1.0
    shifts: tuple[int, ...] = tuple(range(len(SHIFTS_MM)))
    spheres: tuple[Sphere, ...] = EVERY_SPHERE

    def bars(self) -> dict[int, Touch]:
        """Touches of the bar, by the number of their shift."""
        touches = Conditions(self.resolution, tissues=TISSUES).bar_touches()
        return {shift: _at_factor(touches[shift], self.factor) for shift in self.shifts}

    def balls(self) -> dict[Sphere, Touch]:
        """Touches of the spheres, by position and curvature."""
        touches = Conditions(self.resolution, tissues=TISSUES).sphere_touches()
        return {sphere: _at_factor(touches[sphere], self.factor) for sphere in self.spheres}


LEVELS = (
    Level("coarse", "standard", 0.5, CHOSEN_SHIFTS, CHOSEN_SPHERES),
    Level("quick", "quick"),
    Level("standard", "standard"),
    Level("fine", "standard", 1.5, CHOSEN_SHIFTS, CHOSEN_SPHERES),
)
"""From coarse to fine. All but quick are similar to each other, so that they show an order of convergence."""

FINEST = LEVELS[-1].name


def refined(grading: Grading, factor: float) -> Grading:
    """Mesh with the same zones and elements smaller by one factor in every direction.

    Sizes are divided by the factor, numbers of elements through each layer multiplied and rounded up. Sizes
    grow by growth^(1/factor) from one element to the next, hence as fast with distance as before.

    Examples
    --------
    >>> finer = refined(Grading(17.0, 2.0, 1.0, 0.2, 0.4), 2.0)
    >>> finer.size_x_mm, finer.size_z_mm, finer.counts
    (0.1, 0.2, (8, 2, 8, 8))
    """
    positive("factor", factor)
    layers = ("stratum_corneum", "living_epidermis", "dermis", "subcutis")
    return replace(
        grading,
        size_x_mm=grading.size_x_mm / factor,
        size_z_mm=grading.size_z_mm / factor,
        largest_mm=grading.largest_mm / factor,
        # A coarser mesh would outgrow what a grading allows to neighbours.
        growth=min(grading.growth ** (1.0 / factor), 1.3),
        **{name: math.ceil(factor * getattr(grading, name) - 1e-9) for name in layers},
    )


def _at_factor(touch: Touch, factor: float) -> Touch:
    return touch if factor == 1.0 else replace(touch, grading=refined(touch.grading, factor))


@dataclass(frozen=True)
class Reading:
    """Responses of receptors on one mesh."""

    touches: tuple[Any, ...]  #: Numbers of the bar's shifts, or positions and curvatures of spheres.
    sed_kpa: dict[str, FloatArray]
    rate_hz: dict[str, FloatArray]
    """SED at the end of the "ramp" and of the "hold" [kPa], "dynamic" and "static" firing rate [spikes/s],
    (n_touches, n_receptors)."""

    def only(self, touches: Sequence[Any]) -> Reading:
        """Return the rows of some touches, in their order."""
        rows = [self.touches.index(touch) for touch in touches]
        sed, rates = (
            {name: each[rows] for name, each in kind.items()} for kind in (self.sed_kpa, self.rate_hz)
        )
        return Reading(tuple(touches), sed, rates)


def over_thickness(skin: SkinResponse, sheets: int) -> SkinResponse:
    """Give the lowest sheet of the living epidermis the mean SED of all its equally thick sheets.

    A receptor samples the mean over the living epidermis, which is 0.1 mm thick. With one element through it,
    this is the element's own mean. With more, the lowest sheet alone would be another sampling depth.
    """
    lowest = skin.mesh.living_epidermis
    sed = skin.sed_kpa.copy()
    # Elements are numbered from skin to bone, the last index running fastest.
    sed[:, lowest] = np.mean([skin.sed_kpa[:, lowest - above] for above in range(sheets)], axis=0)
    return skin.with_fields(sed_kpa=sed)


def read(responses: Mapping[Any, SkinResponse], receptors_mm: FloatArray, sheets: int) -> Reading:
    """Return the responses of equal afferents at places (n_receptors, 2) to the touches of one mesh.

    The mesh has `sheets` elements through the living epidermis.
    """
    traces = [over_thickness(skin, sheets).sed(receptors_mm) for skin in responses.values()]
    ramp_ends = [int(np.argmin(np.abs(trace.times_ms - trace.kinks_ms[0]))) for trace in traces]
    trains = [Afferent.for_tissues(TISSUES).spikes(trace) for trace in traces]
    windows = {"dynamic": protocol.DYNAMIC_WINDOW.value, "static": protocol.STATIC_WINDOW.value}
    return Reading(
        tuple(responses),
        {
            "ramp": np.array([trace.values[end] for trace, end in zip(traces, ramp_ends, strict=True)]),
            "hold": np.array([trace.values[-1] for trace in traces]),
        },
        {
            name: np.array([firing_rate_hz(train, window) for train in trains])
            for name, window in windows.items()
        },
    )


@result_class
class Differences:
    """Largest absolute difference and root mean square between values and a reference."""

    max: Number
    rms: Number

    @classmethod
    def between(cls, values: FloatArray, reference: FloatArray, unit: float = 1.0) -> Differences:
        """Summarise differences in multiples of a unit.

        Examples
        --------
        >>> Differences.between(np.array([1.0, 5.0]), np.array([1.0, 2.0]), unit=2.0).max
        1.5
        """
        difference = (values - reference) / unit
        return cls(max=np.abs(difference).max(), rms=np.sqrt(np.square(difference).mean()))


@result_class
class MeshErrors:
    """Errors of one mesh at the touches that it shares with a finer one."""

    mesh: str
    against: str  #: Their names.
    touches: int  #: How many are shared.
    sed: dict[str, Differences]
    """At the end of the "ramp" and of the "hold", over the largest SED on the finer mesh. [1]"""
    rate_hz: dict[str, Differences]  #: "dynamic" and "static" firing rate. [spikes/s]
    fss: Number = float("nan")
    fss_against: Number = float("nan")
    """Weighted FSS of the rates under the bar on either mesh, no parameter fitted; NaN of spheres. [1]"""


def compare(readings: Mapping[str, Reading], mesh: str, against: str, fss: bool = False) -> MeshErrors:
    """Return the errors of one mesh at the touches that it shares with a finer one."""
    reading, reference = readings[mesh], readings[against]
    common = [touch for touch in reference.touches if touch in reading.touches]
    ours, finer = reading.only(common), reference.only(common)
    return MeshErrors(
        mesh=mesh,
        against=against,
        touches=len(common),
        sed={
            phase: Differences.between(ours.sed_kpa[phase], values, float(values.max()))
            for phase, values in finer.sed_kpa.items()
        },
        rate_hz={
            phase: Differences.between(ours.rate_hz[phase], values) for phase, values in finer.rate_hz.items()
        },
        fss=goodness_of_fit(ours) if fss else math.nan,
        fss_against=goodness_of_fit(finer) if fss else math.nan,
    )


def goodness_of_fit(reading: Reading) -> float:
    """Return the weighted FSS (Eqs. 12-14) of the rates at the indented shifts; no parameter is fitted."""
    observed = bar_firing_rates()
    shifts = list(reading.touches)
    dynamic, static = (
        fractional_sum_of_squares(rates_hz[shifts], reading.rate_hz[phase][:, 0])
        for phase, rates_hz in (("dynamic", observed.dynamic_rate_hz), ("static", observed.static_rate_hz))
    )
    return protocol.DYNAMIC_WEIGHT.value * dynamic + protocol.STATIC_WEIGHT.value * static


def observed_order(values: Sequence[float], factors: Sequence[float]) -> tuple[float, float]:
    """Order p and limit u of a quantity on three similar meshes, u_i = u + c f_i^-p (Richardson 1911).

    Values and factors, by which elements are smaller, go from coarse to fine. NaN unless the values approach
    a limit with an order from 0.3 to 6.

    Examples
    --------
    >>> order, limit = observed_order([2.0, 1.25, 1.0 + 1 / 9], [1.0, 2.0, 3.0])
    >>> round(order, 6), round(limit, 6)
    (2.0, 1.0)
    >>> observed_order([1.0, 2.0, 1.0], [1.0, 2.0, 3.0])
    (nan, nan)
    """
    u, f = float_array("values", values, 1), float_array("factors", factors, 1)
    if u.size != 3 or f.size != 3 or not 0.0 < f[0] < f[1] < f[2]:
        raise InputError(f"observed_order needs three values and three increasing factors: got {u}, {f}.")

    def excess(order: float) -> float:
        h = f**-order
        return float((h[0] - h[1]) / (h[1] - h[2]) - (u[0] - u[1]) / (u[1] - u[2]))

    if u[1] == u[2] or excess(LOWEST_ORDER) * excess(HIGHEST_ORDER) > 0.0:
        return math.nan, math.nan
    p = float(brentq(excess, LOWEST_ORDER, HIGHEST_ORDER, xtol=1e-12))
    c = (u[1] - u[2]) / (f[1] ** -p - f[2] ** -p)
    return p, float(u[2] - c * f[2] ** -p)


@result_class
class MeshSize:
    """Nodes of a level's mesh under bar and sphere, and its elements under the bar along and across. [mm]"""

    name: str
    bar_nodes: int
    sphere_nodes: int
    size_x_mm: float
    size_z_mm: float


@result_class
class BarProfile:
    """Response of one receptor on one mesh to each shift of the bar, (n_shifts,). [mm, kPa, spikes/s]"""

    shift_mm: Vector
    sed_ramp_kpa: Vector
    sed_hold_kpa: Vector
    dynamic_rate_hz: Vector
    static_rate_hz: Vector


@result_class
class Convergence:
    """Largest SED of a touch at the end of the ramp on the similar meshes, and its order and limit.

    SED is from coarse to fine [kPa]; order [1] and limit [kPa] are NaN where values do not settle.
    """

    touch: str
    sed_kpa: Vector
    order: Number
    limit_kpa: Number


@result_class
class MeshRefinement:
    """Result of `python -m studies mesh-refinement`."""

    code_hash: str  #: Of the mechanics that solved the touches.
    meshes: tuple[MeshSize, ...]  #: From coarse to fine.
    profiles: dict[str, BarProfile]  #: By mesh.
    bars: tuple[MeshErrors, ...]
    spheres: tuple[MeshErrors, ...]
    """One receptor under the shifted bar, and the receptors of the population under spheres."""
    convergence: tuple[Convergence, ...]  #: By touch.


def run(runner: Runner, conditions: Conditions) -> MeshRefinement:
    """Solve every indentation that is not stored yet (an hour on one core), and compare the meshes.

    The conditions are not used. A stopped run continues after the last stored touch.
    """
    receptors = {
        "bars": np.array([[RECEPTOR_X_MM, 0.0]]),
        "balls": Population.grid(centre_mm=(RECEPTOR_X_MM, 0.0)).positions_mm,
    }
    readings: dict[str, dict[str, Reading]] = {"bars": {}, "balls": {}}
    for level in LEVELS:
        for kind, touches in (("bars", level.bars()), ("balls", level.balls())):
            runner.solve(touches.values(), f"{level.name}: {kind}")
            pressed = {key: runner.store.load(touch) for key, touch in touches.items()}
            sheets = next(iter(touches.values())).grading.living_epidermis
            readings[kind][level.name] = read(pressed, receptors[kind], sheets)
    bars, balls = readings["bars"], readings["balls"]
    pairs = [*((level.name, FINEST) for level in LEVELS[:-1]), ("quick", "standard")]
    return MeshRefinement(
        code_hash=code_hash(),
        meshes=tuple(_size(level) for level in LEVELS),
        profiles={name: profile(reading) for name, reading in bars.items()},
        bars=tuple(compare(bars, *pair, fss=True) for pair in pairs),
        spheres=tuple(compare(balls, *pair) for pair in pairs),
        convergence=(*convergence(bars), *convergence(balls)),
    )


def _size(level: Level) -> MeshSize:
    bar, ball = next(iter(level.bars().values())), next(iter(level.balls().values()))
    return MeshSize(
        name=level.name,
        bar_nodes=len(bar.mesh.nodes_mm),
        sphere_nodes=len(ball.mesh.nodes_mm),
        size_x_mm=bar.grading.finest_x_mm,
        size_z_mm=bar.grading.size_z_mm,
    )


def profile(reading: Reading) -> BarProfile:
    """Return the responses of the first receptor to the bar."""
    return BarProfile(
        shift_mm=np.array([SHIFTS_MM[shift] for shift in reading.touches]),
        sed_ramp_kpa=reading.sed_kpa["ramp"][:, 0],
        sed_hold_kpa=reading.sed_kpa["hold"][:, 0],
        dynamic_rate_hz=reading.rate_hz["dynamic"][:, 0],
        static_rate_hz=reading.rate_hz["static"][:, 0],
    )


def convergence(readings: Mapping[str, Reading]) -> tuple[Convergence, ...]:
    """Order and limit of each touch's largest SED at the end of the ramp, on the three similar meshes."""
    similar = [level for level in LEVELS if level.resolution == "standard"]
    rows = []
    for touch in readings[FINEST].touches:
        sed = np.array([readings[level.name].only([touch]).sed_kpa["ramp"][0] for level in similar])
        values = sed[:, sed[-1].argmax()]
        order, limit = observed_order(values.tolist(), [level.factor for level in similar])
        rows.append(Convergence(touch=_named(touch), sed_kpa=values, order=order, limit_kpa=limit))
    return tuple(rows)


def _named(touch: int | Sphere) -> str:
    """Name of a touch in tables.

    >>> _named(0), _named((0.0, 287.0))
    ('bar, shift -3.5 mm', 'sphere 287 /m at 0 mm')
    """
    if isinstance(touch, int):
        return f"bar, shift {SHIFTS_MM[touch]:g} mm"
    return f"sphere {touch[1]:g} /m at {touch[0]:g} mm"


ERROR_COLUMNS = (
    "under", "mesh", "nodes", "against", "SED, ramp: max", "RMS", "SED, hold: max", "RMS",
    "dynamic rate: max [spikes/s]", "RMS", "static rate: max [spikes/s]", "RMS",
)  # fmt: skip


def blocks(results: MeshRefinement) -> dict[str, str]:
    """Return the convergence table."""
    nodes = {size.name: (size.bar_nodes, size.sphere_nodes) for size in results.meshes}
    rows = [
        (
            under,
            row.mesh,
            number(nodes[row.mesh][kind]),
            row.against,
            *(share(value) for each in row.sed.values() for value in (each.max, each.rms)),
            *(fixed(value, 1) for each in row.rate_hz.values() for value in (each.max, each.rms)),
        )
        for kind, (under, errors) in enumerate((("bar", results.bars), ("spheres", results.spheres)))
        for row in errors
    ]
    orders = [row.order for row in results.convergence if math.isfinite(row.order)]
    fits = "; ".join(
        f"{row.mesh} {fixed(row.fss, 3)} ({row.against} {fixed(row.fss_against, 3)})" for row in results.bars
    )
    below = (
        "SED as a share of its largest value on the finer mesh. The largest SED of a touch settles with an "
        f"order of {fixed(float(np.median(orders)), 1)} (median of {len(orders)} of "
        f"{len(results.convergence)} touches). FSS at the common shifts, no parameter fitted: {fits}. "
        f"`python -m studies mesh-refinement` computes this table; mechanical code {results.code_hash}."
    )
    return {"mesh-refinement": joined(table(ERROR_COLUMNS, rows), below)}
